//! What frames of a flight owe to the frames before them: an error against the same frame made
//! alone, and flicker.

use glam::{DVec3, DVec4};

use super::cases::Case;
use super::errors::{OPACITY_OF_ALGORITHM, cut, error, measured};
use super::flicker::{Seen, residual};
use super::record::Motion;
use super::run::{Subject, picture_alone};
use super::session::Listener;
use super::traced_flicker::Tracing;
use crate::frame::{Picture, Quality};
use crate::reference::{ExactPixel, Window, exact_frame};
use crate::scene::Scene;
use crate::{Error, Result};

/// The frame of a flight that is looked at. The same in every bench, so that what is kept of the reference
/// fits.
pub(super) const FRAME: u32 = 16;
/// Flicker is measured in the middle of the picture, of so many parts along both axes: the exact compositor
/// takes 2 ms of a processor for every pixel.
pub(super) const WINDOW: u32 = 3;

/// What to measure a flight's frames with.
pub struct Instruments<'a> {
    /// The tables of the renderer, and where the flicker of the reference is from.
    pub tracing: Tracing<'a>,
    /// The numbers it was made with.
    pub quality: Quality,
    /// Pixels.
    pub size: [u32; 2],
}

/// Light of a window with opacity and distance of the exact compositor's clouds: those depend on the
/// particles alone, so that all presets are followed in the same pixels.
fn seen(
    scene: &Scene,
    time: f64,
    pixels: &[ExactPixel],
    light: impl Iterator<Item = DVec3>,
) -> Seen {
    let opaque = |(light, pixel): (DVec3, &ExactPixel)| light.extend(1.0 - pixel.transmittance);
    Seen {
        scene: scene.clone(),
        time,
        radiance: light.zip(pixels).map(opaque).collect(),
        distance: pixels.iter().map(|pixel| pixel.distance).collect(),
    }
}

fn light(pixel: &[f32; 4]) -> DVec3 {
    DVec4::from(pixel.map(f64::from)).truncate()
}

/// Flies up to a frame and compares that with the same one made alone, and with the one before it.
pub fn motion(
    case: &Case,
    subject: &mut Subject,
    with: &Instruments<'_>,
    listener: &mut dyn Listener,
) -> Result<Option<Motion>> {
    let (renderer, tables) = (&mut subject.renderer, with.tracing.tables);
    let (size, window) = (with.size, Window::middle(with.size, WINDOW));
    renderer.forget();
    let (mut frames, mut exact) = (Vec::new(), Vec::new());
    let mut picture = None;
    for index in 0..=FRAME {
        let (scene, time) = case.frame(index);
        if index + 1 < FRAME {
            renderer.frame(&scene, time, size)?;
            continue;
        }
        let shown = renderer.render(&scene, time, size)?;
        let pixels =
            exact_frame(renderer, &scene, tables, &with.quality, size, window, &mut || {})?;
        let radiance = cut(&shown.radiance, size, window);
        frames.push(seen(&scene, time, &pixels, radiance.iter().map(light)));
        exact.push(seen(&scene, time, &pixels, pixels.iter().map(|p| p.radiance)));
        picture = Some(shown);
    }
    let Some(picture) = picture else {
        return Err(Error::Failed("a flight of no frames".to_owned()));
    };
    let (scene, _) = case.frame(FRAME);
    let alone: Picture = picture_alone(renderer, case, size, FRAME)?;
    let reference = measured("alone", size, &alone.radiance);
    let Some(alone) = error(&picture, &reference, OPACITY_OF_ALGORITHM, scene.exposure)? else {
        return Ok(None);
    };
    let ([before, after], [exact_before, exact_after]) = (&frames[..], &exact[..]) else {
        return Err(Error::Failed("a flight of one frame".to_owned()));
    };
    let (flicker, flicker_pixels) = residual(before, after, size, window);
    let (flicker_of_exact, _) = residual(exact_before, exact_after, size, window);
    let flicker_of_reference =
        with.tracing.flicker(case, FRAME, [before, after], (size, window), listener)?;
    Ok(Some(Motion {
        case: case.name.clone(),
        preset: subject.name.clone(),
        frame: FRAME,
        alone,
        flicker,
        flicker_of_exact,
        flicker_of_reference,
        flicker_pixels,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::cases::cases;
    use crate::bench::flicker::followed;
    use crate::frame::{Preset, RenderSettings};
    use crate::gpu::Gpu;
    use crate::tables::TableSet;

    const SIZE: [u32; 2] = [96, 54];

    /// Both presets see other opacities and distances, and are followed in the same pixels, so what is kept of
    /// the reference is of the pixels of every preset.
    #[test]
    fn presets_are_followed_in_the_same_pixels() {
        let tables = TableSet::embedded().expect("the built-in tables");
        let gpu = Gpu::headless().expect("an adapter");
        let cases = cases().expect("built in");
        let case = cases.iter().find(|case| case.name == "flight").expect("a flight");
        let window = Window::middle(SIZE, WINDOW);
        let with = |preset: Preset, stop: f32| {
            let mut quality = Preset::Low.quality();
            (quality.steps, quality.transmittance_stop) = (preset.quality().steps, stop);
            let settings = RenderSettings { quality: Some(quality), ..Default::default() };
            let name = preset.name();
            let mut subject =
                Subject::new(&gpu, &tables, &case.scene, &settings, name).expect(name);
            let found = [FRAME - 1, FRAME].map(|frame| {
                let (scene, time) = case.frame(frame);
                let shown = subject.renderer.render(&scene, time, SIZE).expect(name);
                let exact = exact_frame(
                    &subject.renderer,
                    &scene,
                    &tables,
                    &quality,
                    SIZE,
                    window,
                    &mut || {},
                );
                let radiance = cut(&shown.radiance, SIZE, window);
                seen(&scene, time, &exact.expect(name), radiance.iter().map(light))
            });
            let [before, after] = &found;
            let pixels = followed(before, after, SIZE, window);
            let places: Vec<_> =
                pixels.iter().map(|f| (f.pixel, f.corners, f.shares.map(f64::to_bits))).collect();
            let light: Vec<_> = after.radiance.iter().map(|p| p.truncate()).collect();
            (places, light)
        };
        let (rough, rough_light) = with(Preset::Low, 0.3);
        let (fine, fine_light) = with(Preset::High, 0.004);
        assert!(rough.len() > 100, "{}", rough.len());
        assert_eq!(rough, fine);
        assert_ne!(rough_light, fine_light, "the frames do differ");
    }
}
