//! Ratios of run times that say how the cost of a frame grows, and what it does not cost: pairs of cases, frame by frame
//! in turn.

use super::cases::{CUMULUS, Case, Motion, built_in, cases};
use super::compare::of_times;
use super::record::Ratio;
use super::run::{Flight, Subject, fly};
use super::statistics::Draw;
use crate::scene::Scene;
use crate::{Error, Result};

/// Two cases whose times are compared, the second over the first.
pub struct Pair {
    /// What the ratio tells.
    pub name: &'static str,
    /// Them.
    pub cases: [Case; 2],
}

/// Cells a side and layers of the field with ten times the particles, for 96 and 8: each is 2.17 times finer, as the
/// cells' side is.
const FINE_CELLS: u32 = 208;
const FINE_LAYERS: u32 = 17;

/// One more ring has four times the area; ten times the particles fill the same clouds; clouds that are not in view, and a
/// picture in which nothing changes.
pub fn pairs() -> Result<Vec<Pair>> {
    let all = cases()?;
    let named = |name: &str| {
        let found = all.iter().find(|case| case.name == name).cloned();
        found.ok_or_else(|| Error::Failed(format!("there is no case {name}")))
    };
    let cumulus = built_in("cumulus", CUMULUS)?;
    let moving =
        |scene: Scene| Case { name: "cumulus".to_owned(), scene, motion: Motion::Animated };
    let mut wider = cumulus.clone();
    let mut finer = cumulus.clone();
    if let (Some(wide), Some(fine)) = (&mut wider.clouds, &mut finer.clouds) {
        wide.rings += 1;
        fine.cell_size *= f64::from(fine.cells) / f64::from(FINE_CELLS);
        (fine.cells, fine.layers) = (FINE_CELLS, FINE_LAYERS);
    }
    Ok(vec![
        Pair { name: "one_more_ring", cases: [moving(cumulus.clone()), moving(wider)] },
        Pair { name: "ten_times_the_particles", cases: [moving(cumulus), moving(finer)] },
        Pair {
            name: "looking_away_over_empty_sky",
            cases: [named("empty_sky")?, named("looking_away")?],
        },
        Pair {
            name: "paused_over_animated",
            cases: [named("still_animated")?, named("still_paused")?],
        },
    ])
}

/// Flies a pair and compares times of frames and passes; `step` hears of every frame.
pub fn scaling(
    pair: &Pair,
    mut subjects: [Subject; 2],
    flight: &Flight,
    step: &mut dyn FnMut(),
) -> Result<(Vec<Ratio>, [f64; 2])> {
    let [first, second] = &pair.cases;
    let runs = fly(&[first, second], &mut subjects, flight, step)?;
    let [first, second] = &runs[..] else {
        return Err(Error::Failed("a pair of other than two".to_owned()));
    };
    let particles = [first, second].map(|run| {
        let all = run.frames.iter().map(|frame| frame.counters.particles_generated as f64);
        all.sum::<f64>() / run.frames.len() as f64
    });
    let name = format!("{} {}", pair.name, first.preset);
    Ok((of_times(&name, first, second, Draw::InPairs), particles))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_as_their_names_say() {
        let pairs = pairs().expect("built in");
        assert_eq!(pairs.len(), 4);
        let field = |case: &Case| case.scene.clouds.clone();
        for pair in &pairs {
            pair.cases.iter().for_each(|case| case.scene.validate().expect(pair.name));
        }
        let [Some(few), Some(more)] = pairs[0].cases.each_ref().map(field) else {
            panic!("no field")
        };
        assert_eq!(more.rings, few.rings + 1);
        let [Some(coarse), Some(fine)] = pairs[1].cases.each_ref().map(field) else {
            panic!("no field")
        };
        let ratio = fine.slots() as f64 / coarse.slots() as f64;
        assert!((9.5..10.5).contains(&ratio), "{ratio}");
        let reach = |f: &crate::scene::CloudField| f.cell_size * f64::from(f.cells);
        assert!((reach(&coarse) / reach(&fine) - 1.0).abs() < 1e-9);
        assert_eq!(pairs[2].cases[0].scene.camera, pairs[2].cases[1].scene.camera);
        assert_eq!(pairs[3].cases[0].scene, pairs[3].cases[1].scene);
        assert_eq!(pairs[3].cases[1].motion, Motion::Paused);
    }
}
