//! How many paths each pixel gets, where all are to be about as noisy.
//!
//! Every pixel gets a pilot first. What it gets in all is decided by the pilots of the pixels
//! around it, never by its own: its own paths are independent of theirs, so their mean is that of
//! a number of paths fixed beforehand - without bias, the pilot's among them - and so is its
//! standard error. Decided by its own pilot, pixels that happen to be dark would get other numbers of
//! paths than those that happen to be bright, and the mean would lean to one side.

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::film::Film;
use crate::compare::LUMINANCE;

/// Paths of the pilot, few beside those that 2 % take. What eight of them say of the pixel in their
/// midst scatters by 12 % of the error in the scenes that ship, of which the pixels' own differences
/// are 5 %: who wants most pixels below an error asks for a tenth less.
pub const PILOT: u32 = 128;
/// Pixels that the clouds hide less of show sky or ground.
const CLOUDY: f64 = 0.5;
/// Where the error cannot be reached with the paths that a pixel may get, and where there is hardly
/// a cloud, so many times the error is aimed at.
const COARSE: f64 = 3.0;
/// Times the paths that a pixel may get: who needs so many gets those of the coarse aim.
const HOPELESS: f64 = 2.0;

/// What is wanted of a picture whose pixels get paths by their noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Aim {
    /// Standard error of a pixel's brightness over the brightness.
    pub standard_error: f64,
    /// Paths a pixel at most.
    pub most: u32,
}

/// What the pilots around a pixel tell.
#[derive(Clone, Copy, Default)]
struct Around {
    brightness: f64,
    /// Of one path.
    variance: f64,
    opacity: f64,
}

impl Aim {
    /// Paths for a pixel with these around.
    fn paths(&self, around: &Around) -> u32 {
        let level = (self.standard_error * around.brightness).powi(2);
        let most = f64::from(self.most);
        let wanted = around.variance / level.max(f64::MIN_POSITIVE);
        let coarse = wanted / (COARSE * COARSE);
        // From all that it may get to the coarse aim's: who needs a little more than that is a little noisier.
        let hopeless = (wanted / most - 1.0).clamp(0.0, HOPELESS - 1.0) / (HOPELESS - 1.0);
        let wanted = if around.opacity >= CLOUDY {
            wanted.min(most) * (1.0 - hopeless) + coarse * hopeless
        } else {
            coarse
        };
        // The number is whole and in range.
        wanted.ceil().clamp(f64::from(PILOT.min(self.most)), most) as u32
    }

    /// How many paths each pixel of a film is to get; all pixels have its pilot.
    pub fn allot(&self, film: &Film) -> Vec<u32> {
        let [width, height] = film.size.map(|n| n as usize);
        let one = |index: usize| {
            let (x, y) = (index % width, index / width);
            let (mut sum, mut count) = (Around::default(), 0.0);
            for near in y.saturating_sub(1)..(y + 2).min(height) {
                for beside in x.saturating_sub(1)..(x + 2).min(width) {
                    if (beside, near) != (x, y) {
                        let pixel = seen(film, near * width + beside);
                        sum.brightness += pixel.brightness;
                        sum.variance += pixel.variance;
                        sum.opacity += pixel.opacity;
                        count += 1.0;
                    }
                }
            }
            // A picture of one pixel has none around.
            if count == 0.0 {
                return self.most;
            }
            self.paths(&Around {
                brightness: sum.brightness / count,
                variance: sum.variance / count,
                opacity: sum.opacity / count,
            })
        };
        (0..film.pixels.len()).into_par_iter().map(one).collect()
    }
}

fn seen(film: &Film, index: usize) -> Around {
    let estimates = film.estimates(index);
    let colour =
        |of: fn(&super::Estimate) -> f64| DVec3::from_slice(&estimates.each_ref().map(of)[..3]);
    // As `compare` judges noise: colours of a path are bright together.
    let error = LUMINANCE.dot(colour(|e| e.standard_error));
    Around {
        brightness: LUMINANCE.dot(colour(|e| e.value)),
        variance: error * error * f64::from(film.samples),
        opacity: 1.0 - estimates[3].value,
    }
}

#[cfg(test)]
mod tests {
    use super::super::film::Pixel;
    use super::super::statistics::Moments;
    use super::super::view::Filter;
    use super::super::{Exposure, Random};
    use super::*;
    use crate::scene::Scene;
    use crate::tables::TableSet;

    /// A pixel as bright as stated, with a path's variance in all colours.
    fn pixel(brightness: f64, variance: f64, transmittance: f64) -> Pixel {
        let spread = variance * f64::from(PILOT - 1);
        let mut mean = [brightness; 4];
        mean[3] = transmittance;
        Pixel { mean, spread: [spread; 4] }
    }

    fn film(pixels: impl Fn(u32, u32) -> Pixel) -> Film {
        let mut film = Film::new([9, 7]);
        film.samples = PILOT;
        film.pixels = (0..63).map(|i| pixels(i % 9, i / 9)).collect();
        film
    }

    #[test]
    fn paths_are_as_many_as_the_error_takes() {
        let aim = Aim { standard_error: 0.02, most: 10_000 };
        let allot = |pixel: Pixel| aim.allot(&film(|_, _| pixel))[30];
        // (deviation / brightness / error)^2, to what rounding makes of a whole number.
        assert!(allot(pixel(2.0, 4.0, 0.0)).abs_diff(2500) <= 1);
        assert!(allot(pixel(2.0, 15.9, 0.0)).abs_diff(9938) <= 1);
        // Hopeless, and hardly a cloud: for three times the error.
        assert!(allot(pixel(2.0, 32.0, 0.0)).abs_diff(2222) <= 1);
        assert!(allot(pixel(2.0, 64.0, 0.0)).abs_diff(4444) <= 1);
        // In between no step is a cliff: a hundredth more wanted changes it by a tenth at most.
        let counts = (0..100).map(|i| allot(pixel(2.0, 15.0 * 1.01f64.powi(i), 0.0)));
        let counts: Vec<_> = counts.map(f64::from).collect();
        let steepest =
            counts.windows(2).map(|two| (two[1] / two[0]).ln().abs()).fold(0.0, f64::max);
        assert!(steepest < 0.1, "{steepest}");
        assert!(allot(pixel(2.0, 4.0, 0.9)).abs_diff(278) <= 1);
        assert_eq!(allot(pixel(2.0, 4e9, 0.0)), 10_000);
        // Nothing to find, and nothing at all.
        assert_eq!(allot(pixel(2.0, 0.0, 1.0)), PILOT);
        assert_eq!(allot(pixel(0.0, 0.0, 0.0)), PILOT);
    }

    /// What keeps the mean unbiased.
    #[test]
    fn a_pixels_own_paths_do_not_decide_how_many_it_gets() {
        let aim = Aim { standard_error: 0.02, most: 100_000 };
        let even = aim.allot(&film(|_, _| pixel(2.0, 4.0, 0.0)));
        for (at, moved) in [((4, 3), 8), ((0, 0), 3), ((8, 2), 5)] {
            let other = aim.allot(&film(|x, y| {
                if (x, y) == at { pixel(1.0, 9.0, 1.0) } else { pixel(2.0, 4.0, 0.0) }
            }));
            let own = (at.0 + 9 * at.1) as usize;
            assert_eq!(other[own], even[own]);
            assert_eq!(even.iter().zip(&other).filter(|(a, b)| a != b).count(), moved);
        }
    }

    /// Pixels whose paths are seldom bright, and then very: where a pixel's own pilot decided, those that look dark by
    /// chance would get fewer paths, and their mean counted as much as that of the others.
    #[test]
    fn rare_bright_paths_do_not_make_the_mean_lean() {
        const BRIGHT: f64 = 0.03;
        let aim = Aim { standard_error: 0.3, most: 2000 };
        let mut random = Random::new(7, 0, 0);
        let mut hits = |count: u32| (0..count).filter(|_| random.unit() < BRIGHT).count() as f64;
        // By the pixels around, as it is; and by each pixel's own pilot.
        let (mut around, mut own) = (Moments::default(), Moments::default());
        for _ in 0..500 {
            let pilots: Vec<f64> = (0..63).map(|_| hits(PILOT)).collect();
            let pilot = f64::from(PILOT);
            let pixels = |x: u32, y: u32| {
                let mean = pilots[(x + 9 * y) as usize] / pilot;
                pixel(mean, mean * (1.0 - mean) * pilot / (pilot - 1.0), 0.0)
            };
            let wanted = aim.allot(&film(pixels));
            let mut mean = |index: usize, count: u32| {
                (pilots[index] + hits(count - PILOT)) / f64::from(count) / BRIGHT - 1.0
            };
            for index in 0..pilots.len() {
                around.add(mean(index, wanted[index]));
                let seen = pilots[index] / pilot;
                let alone =
                    Around { brightness: seen, variance: seen * (1.0 - seen), opacity: 1.0 };
                own.add(mean(index, aim.paths(&alone)));
            }
        }
        println!("around {:?}, own {:?}", around.estimate(), own.estimate());
        // A lean of one per cent would be seen here; the other rule has 7.6.
        assert!(around.estimate().standard_error < 0.002);
        assert!(around.estimate().z(0.0, 0.0).abs() < 4.0, "{:?}", around.estimate());
        assert!(own.estimate().z(0.0, 0.0).abs() > 10.0, "{:?}", own.estimate());
    }

    /// Of a scene that ships, against as many paths a pixel: alike within the errors that both
    /// state, without a lean to either side.
    #[test]
    fn means_do_not_lean() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let scene = Scene::load(&folder.join("scenes/sunset.toml")).expect("it ships");
        let tables = TableSet::embedded().expect("tables");
        let expose = |seed: u64, samples: u32, aim: Option<Aim>| {
            let (size, filter) = ([24, 14], Filter::Box);
            let exposure =
                Exposure { size, time: 0.0, shutter: 0.0, lens: None, filter, seed, aim };
            let mut film = Film::new(size);
            exposure.expose(&scene, &tables, &mut film, samples, |_| Ok(())).expect("traced");
            film
        };
        const MOST: u32 = 1000;
        let aim = Aim { standard_error: 0.05, most: MOST };
        let (aimed, even) = (expose(0, MOST, Some(aim)), expose(1, 400, None));
        let counts = |wanted: fn(&u32) -> bool| aimed.wanted.iter().filter(|n| wanted(n)).count();
        assert!(counts(|n| *n == PILOT) > 20 && counts(|n| *n > 300) > 20, "{:?}", aimed.wanted);
        let (mut lean, mut squares) = (Moments::default(), Moments::default());
        for index in 0..aimed.pixels.len() {
            let [a, b] = [&aimed, &even].map(|film| film.estimates(index)[1]);
            let error = a.standard_error.hypot(b.standard_error);
            if error > 1e-6 * b.value {
                let z = (a.value - b.value) / error;
                lean.add(z);
                squares.add(z * z);
            }
        }
        println!("{} pixels, {:?} {:?}", lean.count, lean.estimate(), squares.estimate());
        // Paths' radiance has a long tail: z of a few hundred is not quite normal.
        assert!(lean.count > 150.0 && lean.estimate().z(0.0, 0.0).abs() < 4.0, "{lean:?}");
        assert!(squares.estimate().value < 1.6, "{squares:?}");
    }
}
