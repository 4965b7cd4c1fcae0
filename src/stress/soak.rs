//! A long flight: memory and work of a frame must not grow.

use glam::DVec3;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::frame::{Preset, RenderSettings, Renderer};
use crate::gpu::Gpu;
use crate::scene::{DEFAULT_SCENE, Scene};
use crate::tables::TableSet;

/// Time of the flight from one frame to the next, s: accelerated, since the light grid and the rings have
/// as much to do for every frame then as they can have.
pub const STEP: f64 = 2.0;
/// m/s, of an airliner.
const SPEED: f64 = 230.0;
/// m, among the tops of the clouds.
const ALTITUDE: f64 = 1350.0;
/// rad/s, a standard-rate turn and back, over and over.
const TURN: f64 = 0.052;
/// rad/s, of the sun: four times that of the Earth's rotation, so that the sky changes too.
const SUN: f64 = 3e-4;
/// Frames at the beginning that are not counted: caches fill, buffers find their size.
const WARM_UP: f64 = 0.1;
/// Growth of memory that is none: of the last quarter over the first, MiB. Allocators keep free
/// memory in steps of some MiB; a leak of one picture of 64 x 36 a frame comes to more in 1000 frames.
const MOST_GROWTH: f64 = 16.0;
/// Processor time of a frame in the last quarter over that in the first: what there is to do changes
/// with the clouds on the way.
const MOST_SLOWER: f64 = 1.5;

/// What a frame took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Moment {
    /// Resident memory of the process, MiB.
    pub memory: f64,
    /// Memory on the device that the renderer tells, MiB.
    pub device: f64,
    /// Processor time of all threads, ms.
    pub work: f64,
}

/// What a flight came to: medians over its first and last quarter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Soak {
    /// Seconds of flight.
    pub seconds: f64,
    /// Frames.
    pub frames: usize,
    /// First quarter.
    pub first: Moment,
    /// Last quarter.
    pub last: Moment,
    /// Largest memory of all, MiB.
    pub most: f64,
}

impl Soak {
    /// Why it is not as it should be.
    pub fn failure(&self) -> Option<String> {
        let grown = self.last.memory - self.first.memory;
        if grown > MOST_GROWTH {
            return Some(format!("memory has grown by {grown:.1} MiB"));
        }
        let slower = self.last.work / self.first.work;
        (slower > MOST_SLOWER).then(|| format!("frames take {slower:.2} times as long at the end"))
    }
}

/// Flies for so many seconds of the scene's time. `frame` is called after each frame.
pub fn soak(
    seconds: f64,
    size: [u32; 2],
    preset: Preset,
    mut frame: impl FnMut(&Moment),
) -> Result<Soak> {
    let mut scene = Scene::from_toml(DEFAULT_SCENE, "the built-in scene", "".as_ref())?;
    let tables = TableSet::embedded()?;
    let settings = RenderSettings { preset, ..Default::default() };
    let mut renderer = Renderer::new(&Gpu::headless()?, &tables, &scene, &settings)?;
    let frames = (seconds / STEP).ceil().max(8.0) as usize;
    let mut moments = Vec::with_capacity(frames);
    let (mut position, mut heading) = (DVec3::Y * ALTITUDE, 0.0_f64);
    let height = scene.sun.direction.y;
    for number in 0..frames {
        let time = number as f64 * STEP;
        heading += TURN * STEP * (time * TURN).sin();
        let ahead = DVec3::new(heading.sin(), -0.05, -heading.cos());
        position += SPEED * STEP * DVec3::new(ahead.x, 0.0, ahead.z);
        scene.camera.position = position;
        scene.camera.target = position + 1000.0 * ahead;
        let level = (1.0 - height * height).sqrt();
        let (sin, cos) = (SUN * time).sin_cos();
        scene.sun.direction = DVec3::new(level * cos, height, level * sin).normalize();
        let before = processor_seconds()?;
        let picture = renderer.render(&scene, time, size)?;
        let moment = Moment {
            memory: resident_mib()?,
            device: picture.stats.counters.bytes_resident as f64 / MIB,
            work: (processor_seconds()? - before) * 1e3,
        };
        frame(&moment);
        moments.push(moment);
    }
    let counted = &moments[(frames as f64 * WARM_UP) as usize..];
    let quarter = (counted.len() / 4).max(1);
    Ok(Soak {
        seconds: frames as f64 * STEP,
        frames,
        first: medians(&counted[..quarter]),
        last: medians(&counted[counted.len() - quarter..]),
        most: moments.iter().map(|m| m.memory).fold(0.0, f64::max),
    })
}

const MIB: f64 = (1 << 20) as f64;

fn medians(moments: &[Moment]) -> Moment {
    let median = |of: fn(&Moment) -> f64| {
        let mut values: Vec<f64> = moments.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    Moment { memory: median(|m| m.memory), device: median(|m| m.device), work: median(|m| m.work) }
}

/// A number of a file of Linux's that describes this process.
fn proc_number(path: &str, find: impl Fn(&str) -> Option<f64>) -> Result<f64> {
    let text = std::fs::read_to_string(path).map_err(|_| {
        Error::Failed(format!("{path} cannot be read: memory and time are measured on Linux only"))
    })?;
    find(&text).ok_or_else(|| Error::Failed(format!("{path} is of another form than expected")))
}

fn resident_mib() -> Result<f64> {
    proc_number("/proc/self/status", |text| {
        let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        line.split_whitespace().next()?.parse::<f64>().ok().map(|kib| kib / 1024.0)
    })
}

/// Of all threads, those of the driver too.
fn processor_seconds() -> Result<f64> {
    // Linux tells all programs a hundred ticks a second, whatever it counts itself.
    const TICKS: f64 = 100.0;
    proc_number("/proc/self/stat", |text| {
        // The name before may hold anything, up to the last parenthesis.
        let (_, fields) = text.rsplit_once(") ")?;
        let field = |i: usize| fields.split(' ').nth(i)?.parse::<f64>().ok();
        Some((field(11)? + field(12)?) / TICKS)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flight(first: [f64; 2], last: [f64; 2]) -> Soak {
        let moment = |[memory, work]: [f64; 2]| Moment { memory, device: 80.0, work };
        let (first, last) = (moment(first), moment(last));
        Soak { seconds: 16.0, frames: 8, first, last, most: last.memory }
    }

    #[test]
    fn growth_fails() {
        assert_eq!(flight([300.0, 100.0], [302.0, 110.0]).failure(), None);
        let grown = flight([300.0, 100.0], [330.0, 100.0]).failure();
        assert!(grown.is_some_and(|text| text.contains("30.0 MiB")));
        let slower = flight([300.0, 100.0], [300.0, 200.0]).failure();
        assert!(slower.is_some_and(|text| text.contains("2.00 times")));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn memory_and_time_are_those_of_this_process() {
        let (memory, time) = (resident_mib().expect("Linux"), processor_seconds().expect("Linux"));
        let kept = vec![1u8; 64 << 20];
        let sum: u64 = (0..20).map(|_| kept.iter().map(|b| u64::from(*b)).sum::<u64>()).sum();
        assert_eq!(sum, 20 * (64 << 20));
        assert!(resident_mib().expect("Linux") > memory + 60.0);
        assert!(processor_seconds().expect("Linux") > time);
    }
}
