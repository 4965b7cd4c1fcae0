//! What frames of a flight owe to the frames before them: an error against the same frame made
//! alone, and flicker.

use glam::DVec4;

use super::cases::Case;
use super::errors::{OPACITY_OF_ALGORITHM, cut, error, measured};
use super::flicker::{Seen, residual};
use super::record::Motion;
use super::run::{Subject, picture_alone};
use super::session::Listener;
use super::traced_flicker::Tracing;
use crate::frame::{Picture, Quality};
use crate::reference::{Window, exact_frame};
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
        let distance = renderer.distance()?;
        let pixels =
            exact_frame(renderer, &scene, tables, &with.quality, size, window, &mut || {})?;
        let of_pixel = |p: &crate::reference::ExactPixel| p.radiance.extend(1.0 - p.transmittance);
        let distance = cut(&distance, size, window).into_iter().map(f64::from).collect::<Vec<_>>();
        let seen =
            |radiance| Seen { scene: scene.clone(), time, radiance, distance: distance.clone() };
        let radiance = cut(&shown.radiance, size, window);
        frames.push(seen(radiance.iter().map(|p| DVec4::from(p.map(f64::from))).collect()));
        exact.push(seen(pixels.iter().map(of_pixel).collect()));
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
