//! What looking a chord up costs on a device, by each of the ways that [`compare`](super::compare)
//! measures the errors of. Shader: `shaders/tables/chord_lookups.wgsl`.
//!
//! All tables fetch from the built-in one, at places that are their own: what differs are the
//! coordinates. A device that is a processor (software drivers) is measured by processor time of all
//! threads, which other work on the machine does not lengthen; others by the clock.

use std::time::Instant;

use cpu_time::ProcessTime;

use super::lookup::BINS;
use super::measure::TestChord;
use crate::error::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::medium::Phase;
use crate::tables::{TableSet, TablesGpu};

/// Chords of a run: a tenth of a second in software.
const CHORDS: usize = 1 << 20;
/// Runs of each way, by turns.
const ROUNDS: usize = 7;
/// Side of a workgroup; as in the shader.
const WORKGROUP: usize = 64;
/// Entry points, steps of the march, and what they are called.
const WAYS: [(&str, usize, &str); 6] = [
    ("by_linear_angles", BINS, "linear angles, 2 fetches"),
    ("by_two_points", BINS, "two octahedral points, 2 fetches"),
    ("by_disc", BINS, "direction and place on a disc, 2 fetches, decoded"),
    ("by_march", 8, "march of 8 steps"),
    ("by_march", 16, "march of 16 steps"),
    ("by_march", BINS, "march of 21 steps"),
];
/// What reading chords and writing answers takes.
const NOTHING: &str = "nothing";

/// Time of a look-up.
#[derive(Clone, Debug, PartialEq)]
pub struct LookupTime {
    /// The way.
    pub name: &'static str,
    /// ns, the least of some runs.
    pub nanoseconds: f64,
}

/// Chords on a device.
struct Chords<'a> {
    gpu: &'a Gpu,
    tables: TablesGpu,
    library: ShaderLibrary,
    input: wgpu::Buffer,
    output: wgpu::Buffer,
    count: usize,
}

impl<'a> Chords<'a> {
    fn new(gpu: &'a Gpu, chords: &[TestChord], count: usize) -> Result<Self> {
        let end = |p: glam::DVec3| p.as_vec3().extend(0.0).to_array();
        let chords = chords.iter().cycle().take(count);
        let values: Vec<[f32; 4]> = chords.flat_map(|c| [end(c.entry), end(c.exit)]).collect();
        let tables = TableSet::embedded()?;
        // Any medium: the scattering tables are not read.
        let phase = Phase::Mie { diameter_um: 20.0 };
        Ok(Self {
            gpu,
            tables: TablesGpu::new(gpu, &tables, &phase, 1.0)?,
            library: ShaderLibrary::new()?,
            input: buffers::storage_with(gpu, "chords", &values),
            output: buffers::storage(gpu, "answers", count, size_of::<[f32; 4]>()),
            count,
        })
    }

    fn kernel(&self, steps: usize) -> Result<Kernel> {
        let file = crate::shader_file!("tables/chord_lookups.wgsl");
        let defs = [("STEPS", steps as u32)];
        Kernel::new(self.gpu, &self.library, file, &defs, &[self.tables.layout()])
    }

    fn run(&self, kernel: &Kernel, entry_point: &str) {
        let resources = [self.input.as_entire_binding(), self.output.as_entire_binding()];
        let own = kernel.bind(self.gpu, &resources);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(kernel.pipeline(entry_point));
            pass.set_bind_group(0, &own, &[]);
            pass.set_bind_group(1, self.tables.bind_group(), &[]);
            pass.dispatch_workgroups(self.count.div_ceil(WORKGROUP) as u32, 1, 1);
        }
        self.gpu.queue.submit([encoder.finish()]);
    }

    fn answers(&self, count: usize) -> Result<Vec<[f32; 4]>> {
        self.gpu.read_buffer(&self.output, count)
    }

    /// Seconds of a run.
    fn time(&self, kernel: &Kernel, entry_point: &str) -> Result<f64> {
        let is_processor = self.gpu.adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        let (work, clock) = (ProcessTime::now(), Instant::now());
        self.run(kernel, entry_point);
        // One answer: it is there when all are.
        self.answers(1)?;
        let elapsed = if is_processor { work.elapsed() } else { clock.elapsed() };
        Ok(elapsed.as_secs_f64())
    }
}

/// Measures all ways on these chords, by turns.
pub fn lookup_times(gpu: &Gpu, chords: &[TestChord]) -> Result<Vec<LookupTime>> {
    let chords = Chords::new(gpu, chords, CHORDS)?;
    let kernels: Vec<_> =
        WAYS.iter().map(|(_, steps, _)| chords.kernel(*steps)).collect::<Result<_>>()?;
    let mut least = [f64::INFINITY; WAYS.len() + 1];
    // The first round compiles and is not counted.
    for round in 0..=ROUNDS {
        let entry_points = WAYS.iter().map(|(entry_point, ..)| *entry_point);
        for (i, entry_point) in std::iter::once(NOTHING).chain(entry_points).enumerate() {
            let seconds = chords.time(&kernels[i.saturating_sub(1)], entry_point)?;
            if round > 0 {
                least[i] = least[i].min(seconds);
            }
        }
    }
    let [nothing, ways @ ..] = least;
    let named = WAYS.iter().zip(ways).map(|((.., name), seconds)| LookupTime {
        name,
        nanoseconds: (seconds - nothing) * 1e9 / CHORDS as f64,
    });
    Ok(named.collect())
}

#[cfg(test)]
mod tests {
    use super::super::alternatives::{LinearAngles, TwoPoints};
    use super::super::encoding::unpack;
    use super::super::grid::filtered;
    use super::super::mapping::ChordMapping;
    use super::super::measure::test_chords;
    use super::*;
    use crate::medium::Shape;
    use glam::Vec4;

    /// Devices filter with 8 bits of the place between two texels, which differ by 1 at most.
    const FILTERED: f32 = 4e-3;

    /// Prints the largest and asserts that it is below a bound.
    #[track_caller]
    fn below(what: &str, off: impl Iterator<Item = f32>, most: f32) {
        let worst =
            off.fold(0.0f32, |worst, off| if off > worst || off.is_nan() { off } else { worst });
        println!("{what}: {worst:.1e}");
        assert!(worst < most, "{what}: {worst}");
    }

    /// Neighbours on a circle.
    fn apart(a: f64, b: f64) -> f64 {
        let d = (a - b).abs();
        d.min(1.0 - d)
    }

    #[test]
    fn the_device_finds_the_places_that_the_host_finds() {
        let gpu = Gpu::headless().expect("an adapter");
        let shape = Shape::new("soft-1".parse().expect("a shape"));
        let chords = test_chords(&shape, 1000, 3);
        let device = Chords::new(&gpu, &chords, chords.len()).expect("buffers");
        let kernel = device.kernel(BINS).expect("a kernel");
        let mappings: [(&str, &dyn ChordMapping, f64); 2] = [
            // Angles lose half their digits next to 0, where the cosine is 1: its step is 6e-8.
            ("place_of_linear_angles", &LinearAngles, 5e-4),
            ("place_of_two_points", &TwoPoints, 1e-6),
        ];
        for (entry_point, mapping, most) in mappings {
            device.run(&kernel, entry_point);
            let places = device.answers(chords.len()).expect("answers");
            let worst = chords.iter().zip(&places).flat_map(|(chord, found)| {
                let expected = mapping.place(chord.entry, chord.exit).at;
                std::array::from_fn::<_, 4, _>(|i| apart(expected[i], f64::from(found[i])))
            });
            let worst = worst.fold(0.0, f64::max);
            println!("{entry_point}: {worst:e}");
            assert!(worst < most, "{entry_point}: {worst}");
        }
        // What is looked up there, for chords of which the device's own places are taken.
        let tables = TableSet::embedded().expect("built-in tables");
        let table = &tables.optical_depth()[0];
        let texel = |node| unpack(table.texels()[node]);
        let fetched = [
            ("by_linear_angles", "place_of_linear_angles"),
            ("by_two_points", "place_of_two_points"),
        ];
        for (entry_point, place) in fetched {
            device.run(&kernel, place);
            let places = device.answers(chords.len()).expect("answers");
            device.run(&kernel, entry_point);
            let found = device.answers(chords.len()).expect("answers");
            let off = places.iter().zip(&found).map(|(at, found)| {
                let at = at.map(|x| f64::from(x).clamp(0.0, 1.0));
                let expected = filtered(&table.grid(), at, texel);
                (Vec4::from_array(*found) - expected).abs().max_element()
            });
            below(entry_point, off, FILTERED);
        }
        device.run(&kernel, "by_disc");
        let found = device.answers(chords.len()).expect("answers");
        let off = chords.iter().zip(&found).map(|(chord, found)| {
            let step = table.step(chord.entry, chord.exit);
            // Chords of any length: where one has no direction in f32, no matter is on it.
            (found[0] - step.mean_density).abs() * (chord.exit - chord.entry).length() as f32
        });
        below("by_disc", off, 2.0 * FILTERED);
        device.run(&kernel, "nothing");
        let found = device.answers(chords.len()).expect("answers");
        for (chord, found) in chords.iter().zip(&found) {
            let sum = chord.entry.as_vec3() + chord.exit.as_vec3();
            assert_eq!(*found, sum.extend(0.0).to_array());
        }
        for steps in [8, 16, BINS] {
            let kernel = device.kernel(steps).expect("a kernel");
            device.run(&kernel, "by_march");
            let found = device.answers(chords.len()).expect("answers");
            let off = chords.iter().zip(&found).map(|(chord, found)| {
                let place = |i: usize| (i as f64 + 0.5) / steps as f64;
                let density = |i| table.density(chord.entry.lerp(chord.exit, place(i)), 0);
                let mean = (0..steps).map(density).sum::<f64>() / steps as f64;
                (f64::from(found[0]) - mean).abs() as f32
            });
            below(&format!("by_march, {steps} steps"), off, FILTERED);
        }
    }
}
