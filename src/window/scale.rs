//! Resolution that adapts to hold a frame rate.

/// Smallest and largest side of the picture as a part of the window's.
pub(super) const SCALES: std::ops::RangeInclusive<f32> = 0.1..=1.0;
/// Frame rates that can be asked for, 1/s.
pub(super) const RATES: std::ops::RangeInclusive<f64> = 1.0..=240.0;
/// Scales are multiples of this: buffers are not made anew for a pixel.
const STEP: f32 = 1.0 / 32.0;
/// Frames whose median counts: one that makes new light or shaders is no reason to change.
const FRAMES: usize = 3;
/// Quotients of wanted and measured time between which nothing changes.
const GOOD_ENOUGH: std::ops::RangeInclusive<f64> = 0.85..=1.25;
/// Smaller pictures are no help where the pixels take less than this share of the time.
const PIXELS_COUNT: f64 = 0.35;
/// Least and most that a side changes by at once.
const CHANGES: std::ops::RangeInclusive<f64> = 0.6..=1.5;

/// The picture's sides as a part of the window's.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Resolution {
    /// Whether it adapts.
    pub automatic: bool,
    /// Pictures a second that are wanted, in [`RATES`].
    pub rate: f64,
    /// Where it is, in [`SCALES`].
    pub scale: f32,
    /// What the last pictures at this scale took, s.
    times: Vec<f64>,
    /// Another scale and what pictures took there, s.
    before: Option<(f32, f64)>,
}

impl Resolution {
    /// Begins at a scale.
    pub fn new(rate: f64, scale: f32) -> Self {
        Self { automatic: true, rate, scale, times: Vec::new(), before: None }
    }

    /// A picture at the present scale took so many seconds.
    pub fn took(&mut self, seconds: f64) {
        if !self.automatic || !seconds.is_finite() || seconds <= 0.0 {
            return;
        }
        self.times.push(seconds);
        if self.times.len() < FRAMES {
            return;
        }
        self.times.sort_by(f64::total_cmp);
        let median = self.times[FRAMES / 2];
        self.times.clear();
        let quotient = 1.0 / (self.rate * median);
        if GOOD_ENOUGH.contains(&quotient) {
            return;
        }
        let shares = self.before.and_then(|before| pixels_share(before, (self.scale, median)));
        if quotient < 1.0 && shares.is_some_and(|share| share < PIXELS_COUNT) {
            return;
        }
        self.before = Some((self.scale, median));
        // Time grows at most with the number of pixels, so this never comes out too slow on the way
        // up; on the way down it may take more than one change.
        let change = quotient.sqrt().clamp(*CHANGES.start(), *CHANGES.end());
        let wanted = f64::from(self.scale) * change / f64::from(STEP);
        let whole = if change > 1.0 { wanted.floor() } else { wanted.ceil() };
        let mut scale = whole as f32 * STEP;
        if change < 1.0 && scale >= self.scale {
            scale = self.scale - STEP;
        }
        self.scale = scale.clamp(*SCALES.start(), *SCALES.end());
    }

    /// Forgets what pictures took: those to come are of another kind.
    pub fn forget(&mut self) {
        self.times.clear();
    }

    /// Forgets all that was measured: preset or scene have changed.
    pub fn begin(&mut self) {
        self.times.clear();
        self.before = None;
    }
}

/// The pixels' share of what a picture takes at the second scale, from times at both, s.
fn pixels_share(a: (f32, f64), b: (f32, f64)) -> Option<f64> {
    let [pixels_a, pixels_b] = [a.0, b.0].map(|scale| f64::from(scale).powi(2));
    let each = (a.1 - b.1) / (pixels_a - pixels_b);
    (pixels_a != pixels_b).then(|| (each * pixels_b / b.1).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What pictures take: a part for every picture, and one for its pixels at full scale, s.
    fn settle(resolution: &mut Resolution, fixed: f64, all_pixels: f64, pictures: u32) -> f64 {
        let mut seconds = 0.0;
        for _ in 0..pictures {
            seconds = fixed + all_pixels * f64::from(resolution.scale).powi(2);
            resolution.took(seconds);
        }
        seconds
    }

    #[test]
    fn it_comes_to_the_rate_and_stays() {
        for (fixed, all_pixels, rate) in
            [(0.0, 0.5, 10.0), (0.02, 1.5, 8.0), (0.001, 0.03, 60.0), (0.05, 0.2, 10.0)]
        {
            let mut resolution = Resolution::new(rate, 0.25);
            let seconds = settle(&mut resolution, fixed, all_pixels, 60);
            let scale = resolution.scale;
            // A step of 1/32 at a quarter of the side is a fourth of the pixels.
            assert!((0.7..1.3).contains(&(rate * seconds)), "{seconds} s at {scale}");
            settle(&mut resolution, fixed, all_pixels, 300);
            assert_eq!(resolution.scale, scale, "no swinging");
        }
    }

    #[test]
    fn it_stays_within_its_range() {
        let mut resolution = Resolution::new(60.0, 0.5);
        settle(&mut resolution, 1e-3, 100.0, 100);
        assert_eq!(resolution.scale, *SCALES.start());
        settle(&mut resolution, 1e-6, 1e-6, 100);
        assert_eq!(resolution.scale, *SCALES.end());
    }

    #[test]
    fn where_pixels_are_not_what_takes_long_they_stay() {
        let mut resolution = Resolution::new(60.0, 0.5);
        settle(&mut resolution, 1.0, 1.0, 100);
        let share =
            f64::from(resolution.scale).powi(2) / (1.0 + f64::from(resolution.scale).powi(2));
        assert!(share < PIXELS_COUNT && resolution.scale > 0.25, "{}", resolution.scale);
    }

    #[test]
    fn single_slow_pictures_change_nothing() {
        let mut resolution = Resolution::new(10.0, 0.5);
        for picture in 0..60 {
            resolution.took(if picture % 3 == 0 { 3.0 } else { 0.1 });
        }
        assert_eq!(resolution.scale, 0.5);
        for nonsense in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            (0..9).for_each(|_| resolution.took(nonsense));
        }
        assert_eq!(resolution.scale, 0.5);
        resolution.automatic = false;
        settle(&mut resolution, 9.0, 9.0, 9);
        assert_eq!(resolution.scale, 0.5, "not asked to adapt");
    }
}
