//! The flicker that the truth itself has: clouds that change, and turn before a camera that flies.
//!
//! A pixel is followed from frame to frame as in `flicker`. Pairs of paths begin at the later frame's pixel and
//! at one of the four earlier pixels around the same cloud, drawn by its share: the mean of their
//! differences is what the two true pictures would differ by. Both paths of a pair have the same random
//! numbers, so that some of their noise is the same. The pairs of a pixel are halved, and the product of the
//! two halves' mean differences is on average the squared difference itself: their errors have nothing to do
//! with each other, so there is no noise to be subtracted.
//!
//! That takes a quarter of an hour for a few hundred pixels, so what was found is kept beside the reference pictures.

use std::path::{Path, PathBuf};

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cases::{Case, FPS};
use super::flicker::{Followed, Seen, followed, middle_of};
use super::record::TracedFlicker;
use super::session::Listener;
use crate::frame::gpu_data::Particle;
use crate::frame::population::Shapes;
use crate::output::{fingerprint_of, write_atomically};
use crate::reference::{Filter, Moments, Random, View, Window, World};
use crate::scene::Scene;
use crate::tables::TableSet;
use crate::{Error, Result};

/// Of the window's columns and rows every fourth one is traced: for the same work, fewer pixels with more
/// paths say more about the mean of squares.
const EVERY: u32 = 4;
/// Pixels between two steps of the progress.
const PIXELS_A_STEP: usize = 8;
/// Half of an interval that holds 95 % of a normal distribution, standard deviations.
const NORMAL_95: f64 = 1.959_964;
/// Clouds that differ by less (relative) are the same, computed by another processor.
const SAME_MATTER: f64 = 1e-6;
/// Cameras that are nearer to each other are the same, m.
const SAME_PLACE: f64 = 1e-4;
/// Streams of random numbers: for paths, and for the choice of an earlier pixel.
const PATHS: u64 = 0;
const CHOICES: u64 = 1;

/// What was traced.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Subject {
    /// The later frame.
    pub frame: u32,
    /// Frames a second.
    pub fps: f64,
    /// Pixels of the whole picture.
    pub size: [u32; 2],
    /// First pixel and size of the window.
    pub window: [[u32; 2]; 2],
    /// Fingerprints of both frames' scenes, cameras included.
    pub scenes: [String; 2],
    /// Volume times extinction, summed over all particles of both frames, m^2: tells clouds that this
    /// program makes otherwise from the same scene.
    pub matter: [f64; 2],
}

impl Subject {
    /// Of a frame and the one before it: their scenes at their times, s.
    fn of(
        tables: &TableSet,
        frame: u32,
        scenes: [(&Scene, f64); 2],
        size: [u32; 2],
        window: Window,
    ) -> Result<Self> {
        let shapes = Shapes::new(tables);
        let one = |p: &Particle| f64::from(p.radius).powi(3) * f64::from(p.extinction);
        let matter = |(scene, time): (&Scene, f64)| -> Result<f64> {
            Ok(shapes.populate(scene, time)?.iter().map(one).sum())
        };
        let [before, after] = scenes;
        let matter = [matter(before)?, matter(after)?];
        let scenes = [mark(before.0)?, mark(after.0)?];
        Ok(Self { frame, fps: FPS, size, window: [window.corner, window.size], scenes, matter })
    }

    fn is(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= SAME_MATTER * a.abs().max(b.abs());
        let matter = self.matter.iter().zip(other.matter).all(|(a, b)| near(*a, b));
        matter && Self { matter: other.matter, ..self.clone() } == *other
    }
}

/// Fingerprint of a scene whose camera was computed: other processors round it otherwise.
fn mark(scene: &Scene) -> Result<String> {
    let mut scene = scene.clone();
    let camera = &mut scene.camera;
    for vector in [&mut camera.position, &mut camera.target, &mut camera.up] {
        // + 0.0: a zero has no sign.
        *vector = (*vector / SAME_PLACE).round() * SAME_PLACE + 0.0;
    }
    Ok(fingerprint_of(scene.identity()?.as_bytes()))
}

/// The file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Kept {
    subject: Subject,
    flicker: TracedFlicker,
}

/// How to come to it.
pub struct Tracing<'a> {
    /// The tables, for the shapes.
    pub tables: &'a TableSet,
    /// Where it is kept.
    pub folder: &'a Path,
    /// Pairs of paths a pixel, where it is to be traced if it is not kept.
    pub pairs: Option<u32>,
}

impl Tracing<'_> {
    /// The flicker between two frames of a case, kept or traced; none where neither is to be had.
    pub fn flicker(
        &self,
        case: &Case,
        frame: u32,
        [before, after]: [&Seen; 2],
        (size, window): ([u32; 2], Window),
        listener: &mut dyn Listener,
    ) -> Result<Option<TracedFlicker>> {
        let path = self.path(case, size);
        let scenes = [before, after].map(|seen| (&seen.scene, seen.time));
        let subject = Subject::of(self.tables, frame, scenes, size, window)?;
        if let Some(kept) = read(&path).filter(|kept| kept.subject.is(&subject)) {
            return Ok(Some(kept.flicker));
        }
        let Some(pairs) = self.pairs else { return Ok(None) };
        let found = trace(self.tables, [before, after], (size, window), pairs, listener)?;
        if let Some(flicker) = found {
            let json = serde_json::to_string_pretty(&Kept { subject, flicker })
                .map_err(|e| Error::Failed(format!("JSON: {e}")))?;
            // A folder that cannot be written does not take the figure away.
            if let Err(error) = write_atomically(&path, |out| writeln!(out, "{json}")) {
                tracing::warn!("{error}; the traced flicker is not kept");
            }
        }
        Ok(found)
    }

    fn path(&self, case: &Case, size: [u32; 2]) -> PathBuf {
        let [width, height] = size;
        self.folder.join(format!("{}-{width}x{height}-flicker.json", case.name.replace('/', "-")))
    }
}

/// What is kept, if it can be read.
fn read(path: &Path) -> Option<Kept> {
    serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()
}

/// Sums over a pixel's pairs.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Later minus earlier radiance, of each half.
    differences: [DVec3; 2],
    later: DVec3,
}

/// Traces so many pairs of paths for every pixel that can be followed; none where there is none.
pub fn trace(
    tables: &TableSet,
    [before, after]: [&Seen; 2],
    (size, window): ([u32; 2], Window),
    pairs: u32,
    listener: &mut dyn Listener,
) -> Result<Option<TracedFlicker>> {
    // Halves of the same size.
    let pairs = pairs.next_multiple_of(2);
    let worlds = [
        World::new(&before.scene, tables, before.time)?,
        World::new(&after.scene, tables, after.time)?,
    ];
    let view = |seen: &Seen| View::new(&seen.scene.camera, size, None, Filter::Centre);
    let views = [view(before), view(after)];
    let ray = |at: usize, pixel: usize| views[at].ray(middle_of(pixel, window), [0.0; 2]);
    let of_pixel = |Followed { pixel, corners, shares }: &Followed| {
        let mut sums = Sums::default();
        let mut choices = Random::new(CHOICES, *pixel as u64, 0);
        for pair in 0..pairs {
            let mut left = choices.unit();
            let chosen = shares.iter().position(|share| {
                left -= share;
                left < 0.0
            });
            let corner = corners[chosen.unwrap_or(corners.len() - 1)];
            let random = || Random::new(PATHS, *pixel as u64, pair.into());
            let later = worlds[1].radiance(ray(1, *pixel), &mut random());
            let earlier = worlds[0].radiance(ray(0, corner), &mut random());
            sums.differences[(pair % 2) as usize] += later - earlier;
            sums.later += later;
        }
        sums
    };
    let mut all = followed(before, after, size, window);
    let columns = window.size[0] as usize;
    let is_traced =
        |pixel: usize| [pixel % columns, pixel / columns].iter().all(|v| v % EVERY as usize == 0);
    all.retain(|followed| is_traced(followed.pixel));
    listener.begin(all.len().div_ceil(PIXELS_A_STEP) as u64, "steps of the reference's flicker");
    let mut found = Vec::with_capacity(all.len());
    for some in all.chunks(PIXELS_A_STEP) {
        found.par_extend(some.par_iter().map(of_pixel));
        listener.step();
    }
    Ok(summed(&found, pairs))
}

fn summed(found: &[Sums], pairs: u32) -> Option<TracedFlicker> {
    let half = 0.5 * f64::from(pairs);
    let (mut squares, mut light) = (Moments::default(), 0.0);
    for sums in found {
        let [a, b] = sums.differences.map(|sum| sum / half);
        squares.add(a.dot(b) / 3.0);
        light += sums.later.element_sum() / 3.0 / f64::from(pairs);
    }
    let mean = light / found.len().max(1) as f64;
    if found.len() < 2 || mean <= 0.0 {
        return None;
    }
    let square = squares.estimate();
    let share = |off: f64| (square.value + off * square.standard_error).max(0.0).sqrt() / mean;
    Some(TracedFlicker {
        flicker: share(0.0),
        interval: [share(-NORMAL_95), share(NORMAL_95)],
        pixels: found.len(),
        pairs,
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec4;

    use super::*;
    use crate::bench::cases::cases;
    use crate::bench::motion::{FRAME, WINDOW};
    use crate::bench::session::REFERENCE_SIZE;
    use crate::scene::Sky;

    const SIZE: [u32; 2] = [24, 16];

    struct Deaf;

    impl Listener for Deaf {
        fn begin(&mut self, _: u64, _: &'static str) {}
        fn step(&mut self) {}
    }

    /// Nothing but an even sky, which is taken for a cloud far away; paths know it without noise.
    fn sky(radiance: f64, time: f64) -> Seen {
        let count = (SIZE[0] * SIZE[1]) as usize;
        Seen {
            scene: Scene { sky: Sky::Uniform { radiance }, ..Scene::default() },
            time,
            radiance: vec![DVec4::ONE; count],
            distance: vec![1000.0; count],
        }
    }

    fn case(seen: &Seen) -> Case {
        let motion = crate::bench::cases::Motion::Paused;
        Case { name: "a/case".to_owned(), scene: seen.scene.clone(), motion }
    }

    #[test]
    fn what_is_without_noise_is_found_exactly() {
        let tables = TableSet::embedded().expect("the built-in tables");
        let window = Window::whole(SIZE);
        for (later, expected) in [(0.05, 0.0), (0.051, 0.001 / 0.051)] {
            let (before, after) = (sky(0.05, 0.0), sky(later, 0.1));
            let found = trace(&tables, [&before, &after], (SIZE, window), 3, &mut Deaf);
            let found = found.expect("traced").expect("pixels");
            assert!((found.flicker - expected).abs() < 1e-12, "{found:?}");
            assert!(found.interval.iter().all(|v| (v - expected).abs() < 1e-9), "{found:?}");
            // The outermost have no four neighbours; an odd number has no halves.
            assert!(found.pixels > 12 && found.pixels <= 24 && found.pairs == 4, "{found:?}");
        }
    }

    /// Noise of fifty times the difference leaves the square of the difference where it is.
    #[test]
    fn noise_adds_nothing() {
        let mut random = Random::new(7, 0, 0);
        let mut normal = || (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        const PAIRS: u32 = 1000;
        let half = f64::from(PAIRS) / 2.0;
        let mut pixel = |difference: f64| Sums {
            // Means of as many have so much less noise.
            differences: std::array::from_fn(|_| {
                DVec3::splat(half * (difference + 50.0 * difference * normal() / half.sqrt()))
            }),
            later: DVec3::splat(f64::from(PAIRS)),
        };
        let sums: Vec<_> =
            (0..2000).map(|i| pixel(if i % 2 == 0 { 0.02 } else { -0.02 })).collect();
        let found = summed(&sums, PAIRS).expect("pixels");
        // 4 standard errors of 5 / sqrt(2000) of the square, half of that of its root.
        assert!((found.flicker / 0.02 - 1.0).abs() < 0.23, "{found:?}");
        assert!(found.interval[0] < found.flicker && found.flicker < found.interval[1]);
        assert!(found.interval[1] - found.interval[0] < 0.01, "{found:?}");
    }

    #[test]
    fn what_is_kept_is_taken_where_it_fits() {
        let tables = TableSet::embedded().expect("the built-in tables");
        let dir = tempfile::tempdir().expect("a temporary folder");
        let (before, after) = (sky(0.05, 0.0), sky(0.051, 0.1));
        let get = |pairs, frame| {
            let tracing = Tracing { tables: &tables, folder: dir.path(), pairs };
            let pictures = (SIZE, Window::whole(SIZE));
            let found =
                tracing.flicker(&case(&before), frame, [&before, &after], pictures, &mut Deaf);
            found.expect("traced")
        };
        assert_eq!(get(None, 5), None);
        let traced = get(Some(2), 5);
        assert!(traced.is_some() && get(None, 5) == traced, "it is kept");
        assert_eq!(get(None, 6), None, "of another frame");
        let mut other = sky(0.05, 0.0);
        other.scene.sun.direction = DVec3::new(0.0, 1.0, 1.0);
        let tracing = Tracing { tables: &tables, folder: dir.path(), pairs: None };
        let pictures = (SIZE, Window::whole(SIZE));
        let found = tracing.flicker(&case(&before), 5, [&other, &after], pictures, &mut Deaf);
        assert_eq!(found.expect("nothing to be traced"), None, "of another sun");
        std::fs::write(dir.path().join("a-case-24x16-flicker.json"), "{}").expect("written");
        assert_eq!(get(None, 5), None, "damaged");
        assert_eq!(get(Some(2), 5), traced, "traced again");
    }

    /// What is kept beside the reference pictures is of the clouds that there are today.
    #[test]
    fn the_flights_own_flicker_is_kept() {
        let tables = TableSet::embedded().expect("the built-in tables");
        let cases = cases().expect("built in");
        let case = cases.iter().find(|case| case.name == "flight").expect("a flight");
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
        let tracing = Tracing { tables: &tables, folder: &folder, pairs: None };
        let [before, after] = [FRAME - 1, FRAME].map(|frame| case.frame(frame));
        let scenes = [(&before.0, before.1), (&after.0, after.1)];
        let window = Window::middle(REFERENCE_SIZE, WINDOW);
        let subject =
            Subject::of(&tables, FRAME, scenes, REFERENCE_SIZE, window).expect("particles");
        let kept =
            read(&tracing.path(case, REFERENCE_SIZE)).expect("made by scripts/reference-images");
        assert!(kept.subject.is(&subject), "{:?}, not {subject:?}", kept.subject);
        let TracedFlicker { flicker, interval: [low, high], pixels, .. } = kept.flicker;
        assert!(low <= flicker && flicker <= high && high < 0.02 && pixels > 100, "{kept:?}");
    }
}
