//! The blend against ray marchers without tables, each with as many steps as it takes to come as near to the truth; both
//! in the same frames, in turn.

use super::cases::{Case, Motion};
use super::compare::of_times;
use super::curve::{Setup, march_pass};
use super::errors::{OPACITY_OF_ALGORITHM, cut_picture, error, measured, of_exact};
use super::march::{MarchLight, MarchSettings};
use super::record::Ratio;
use super::run::{Flight, Subject, fly};
use super::statistics::Draw;
use super::variants::Variant;
use crate::Result;
use crate::compare::Measured;
use crate::frame::Picture;
use crate::reference::exact_frame;
use crate::scene::Scene;

/// Most steps that are tried, and those of the march that stands for infinitely many.
const MOST_STEPS: u32 = 512;

/// Times of marchers over those of the frame at equal error, for those that come as near at all: marchers of the view by
/// the frame's light are measured by the exact compositor, as the frame is; those with sun rays by their own limit.
/// `subjects`: two of the variant's quality, of which the second marches.
pub fn over_marches(
    setup: &Setup<'_>,
    (name, scene): (&str, &Scene),
    variant: &Variant,
    mut subjects: [Subject; 2],
    flight: &Flight,
    step: &mut dyn FnMut(),
) -> Result<Vec<Ratio>> {
    let (size, window) = (setup.size, setup.window);
    let case = Case { name: name.to_owned(), scene: scene.clone(), motion: Motion::Animated };
    let off = |picture: &Picture, by: &Measured| -> Result<Option<f64>> {
        let error = error(&cut_picture(picture, window), by, OPACITY_OF_ALGORITHM, scene.exposure)?;
        Ok(error.map(|e| e.without_noise()))
    };
    let blended = &mut subjects[0].renderer;
    let shown = blended.render(scene, 0.0, size)?;
    let quality = &variant.quality;
    let pixels = exact_frame(blended, scene, setup.tables, quality, size, window, &mut || {})?;
    let exact = of_exact(window.size, &pixels);
    let Some(bound) = off(&shown, &exact)? else { return Ok(Vec::new()) };
    step();
    let mut found = Vec::new();
    for light in [MarchLight::Frame, MarchLight::SunRays] {
        let marched = |subject: &mut Subject, steps: u32| -> Result<Picture> {
            let settings = MarchSettings { light, steps };
            let march = march_pass(setup.gpu, scene, subject, settings, quality.tile)?;
            subject.renderer.compose_with(Some(Box::new(march)));
            subject.renderer.render(scene, 0.0, size)
        };
        let by = match light {
            MarchLight::Frame => exact.clone(),
            MarchLight::SunRays => {
                let limit = cut_picture(&marched(&mut subjects[1], MOST_STEPS)?, window);
                measured("limit of the march", limit.size, &limit.radiance)
            }
        };
        let mut error_of = |steps| {
            let picture = marched(&mut subjects[1], steps)?;
            let error = off(&picture, &by)?.unwrap_or(f64::INFINITY);
            tracing::info!(name, steps, error, bound);
            Ok(error)
        };
        let steps = least_steps(bound, &mut error_of)?;
        step();
        let Some(steps) = steps else { continue };
        marched(&mut subjects[1], steps)?;
        let runs = fly(&[&case, &case], &mut subjects, flight, &mut || {})?;
        if let [ours, theirs] = &runs[..] {
            let march = MarchSettings { light, steps }.name();
            let case = format!("{march} over {name} {}", variant.name);
            found.extend(of_times(&case, ours, theirs, Draw::InPairs));
        }
        step();
    }
    Ok(found)
}

/// Times that a caller hears of one scene and preset.
pub const HEARD: u32 = 5;

/// The least number of steps whose error is within the bound, by doubling and halving; none up to [`MOST_STEPS`].
fn least_steps(bound: f64, error_of: &mut dyn FnMut(u32) -> Result<f64>) -> Result<Option<u32>> {
    let (mut short, mut enough) = (0, 4);
    while error_of(enough)? > bound {
        (short, enough) = (enough, 2 * enough);
        if enough >= MOST_STEPS {
            return Ok(None);
        }
    }
    // To a sixteenth: the error is not smooth enough for more.
    while 16 * (enough - short) > enough {
        let middle = short.midpoint(enough);
        if middle == short {
            break;
        }
        if error_of(middle)? > bound { short = middle } else { enough = middle }
    }
    Ok(Some(enough))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_found_by_their_error() {
        let steps = |scale: f64| {
            let mut asked = Vec::new();
            let mut error_of = |n: u32| {
                asked.push(n);
                Ok(scale / f64::from(n))
            };
            let found = least_steps(0.01, &mut error_of).expect("no device asked");
            (found, asked)
        };
        for wanted in [1, 3, 4, 5, 17, 100, 255] {
            let found = steps(0.01 * f64::from(wanted)).0.expect("few enough");
            assert!((wanted..=wanted + wanted / 15).contains(&found), "{found} for {wanted}");
        }
        let (none, asked) = steps(0.01 * 600.0);
        assert_eq!((none, asked), (None, vec![4, 8, 16, 32, 64, 128, 256]));
    }
}
