//! Popping: what the borders of rings leave between two frames of a straight flight, when the clouds are followed along
//! the camera's way; as frames are, and with rings that end at once in place of fading into each other.

use glam::DVec4;

use super::cases::{FLIGHT, FPS, built_in};
use super::flicker::{Seen, residuals};
use super::record::{Popping, Residual};
use super::run::Subject;
use crate::reference::Window;
use crate::{Error, Result};

/// Speed of the flight, m/s: that of an aeroplane.
pub const SPEED: f64 = 90.0;
/// Share of the pixels that jump by less than the largest jump that is told.
const MOST: f64 = 0.999;

/// Flies straight ahead from the scene flight's place for so many frames. Time stands still, so that nothing but the
/// camera's way changes the picture.
pub fn popping(subject: &mut Subject, size: [u32; 2], frames: u32) -> Result<Popping> {
    let still = built_in("flight", FLIGHT)?;
    let mut ahead = still.camera.basis().forward;
    ahead.y = 0.0;
    let step = ahead.normalize() * (SPEED / FPS);
    let renderer = &mut subject.renderer;
    let [fading, at_once] = [false, true].map(|at_once| -> Result<Residual> {
        renderer.forget();
        renderer.end_rings_at_once(at_once);
        let (mut before, mut jumps, mut mean): (Option<Seen>, Vec<f64>, _) =
            (None, Vec::new(), 0.0);
        for frame in 0..=frames {
            let mut scene = still.clone();
            scene.camera.position += step * f64::from(frame);
            scene.camera.target += step * f64::from(frame);
            let picture = renderer.render(&scene, 0.0, size)?;
            let distance = renderer.distance()?.into_iter().map(f64::from).collect();
            let light = |pixel: &[f32; 4]| DVec4::from(pixel.map(f64::from));
            let radiance = picture.radiance.iter().map(light).collect();
            let now = Seen { scene, time: 0.0, radiance, distance };
            if let Some(before) = &before {
                let found = residuals(before, &now, size, Window::whole(size));
                mean += found.iter().map(|(_, light)| light).sum::<f64>();
                jumps.extend(found.iter().map(|(square, _)| square.sqrt()));
            }
            before = Some(now);
        }
        renderer.end_rings_at_once(false);
        let count = jumps.len() as f64;
        mean /= count.max(1.0);
        if mean <= 0.0 {
            return Err(Error::Failed("no clouds can be followed on the flight".to_owned()));
        }
        let square = jumps.iter().map(|jump| jump * jump).sum::<f64>();
        jumps.sort_by(f64::total_cmp);
        Ok(Residual {
            rms: (square / count).sqrt() / mean,
            most: jumps[(MOST * (count - 1.0)) as usize] / mean,
            pixels: jumps.len(),
        })
    });
    Ok(Popping {
        case: "flight".to_owned(),
        preset: subject.name.clone(),
        frames,
        fading: fading?,
        at_once: at_once?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Preset, RenderSettings};
    use crate::gpu::Gpu;
    use crate::tables::TableSet;

    /// Rings that end at once leave more between frames. In 256x144 pixels and 6 pairs of frames it was 0.0092 of the mean
    /// in place of 0.0080: most of both is what changes with the angle, and edges.
    #[test]
    fn cross_fade_is_seen() {
        let tables = TableSet::embedded().expect("the built-in tables");
        let gpu = Gpu::headless().expect("an adapter");
        let scene = built_in("flight", FLIGHT).expect("built in");
        let mut quality = Preset::Low.quality();
        quality.grid.fineness *= 0.5;
        let settings = RenderSettings { quality: Some(quality), ..Default::default() };
        let mut subject = Subject::new(&gpu, &tables, &scene, &settings, "low").expect("made");
        let found = popping(&mut subject, [256, 144], 6).expect("a flight");
        println!("{found:?}");
        assert!(found.fading.pixels > 20_000, "{found:?}");
        assert!(found.at_once.rms > 1.04 * found.fading.rms, "{found:?}");
    }
}
