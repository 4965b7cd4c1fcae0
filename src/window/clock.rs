//! The scene's time: it runs, stands, and goes faster or slower than ours.

use crate::scene::limits;

/// Least and most pace that can be chosen.
pub(super) const PACES: std::ops::RangeInclusive<f64> = 0.01..=10_000.0;

/// The scene's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clock {
    /// s.
    pub time: f64,
    /// Whether it runs.
    pub running: bool,
    /// Seconds of the scene in one of ours.
    pub pace: f64,
}

impl Clock {
    /// Runs from `time` at our own pace.
    pub fn new(time: f64) -> Self {
        Self { time, running: true, pace: 1.0 }
    }

    /// Runs quicker by a factor.
    pub fn change_pace(&mut self, factor: f64) {
        self.pace = (self.pace * factor).clamp(*PACES.start(), *PACES.end());
    }

    /// `seconds` of ours go by.
    pub fn step(&mut self, seconds: f64) {
        if self.running {
            let time = self.time + seconds * self.pace;
            self.time = time.clamp(limits::TIME.least, limits::TIME.most);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_runs_at_its_pace_and_stands() {
        let mut clock = Clock::new(10.0);
        clock.step(0.5);
        clock.pace = 60.0;
        clock.step(0.5);
        assert_eq!(clock.time, 40.5);
        clock.running = false;
        clock.step(100.0);
        assert_eq!(clock.time, 40.5);
    }

    #[test]
    fn it_stays_in_the_range_of_a_scene() {
        let mut clock = Clock::new(limits::TIME.most);
        clock.step(1.0);
        assert_eq!(clock.time, limits::TIME.most);
    }
}
