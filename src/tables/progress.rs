//! How a long computation tells how far it is.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Hears of the steps of a long computation, from any of its threads.
pub trait Progress: Sync {
    /// A stage begins: `total` steps of `what`, in a few words ("optical depth of soft-1").
    /// It replaces the stage before.
    fn start(&self, total: u64, what: &str);

    /// The stage goes on with something else, in a few words.
    fn rename(&self, _what: &str) {}

    /// `steps` more steps of the stage are done.
    fn advance(&self, steps: u64);
}

/// Nobody listens.
pub struct Silent;

impl Progress for Silent {
    fn start(&self, _total: u64, _what: &str) {}

    fn advance(&self, _steps: u64) {}
}

/// Steps in which the progress of several stages together is told.
const STEPS: u64 = 10_000;

/// Puts the stages of a computation together to one: "2/7 optical depth of soft-1", with steps of
/// the whole, so that a bar knows the time that remains for all of it.
pub struct Whole<'a> {
    inner: &'a dyn Progress,
    works: Vec<f64>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Stages begun.
    begun: usize,
    /// Steps of the stage: done and all.
    done: u64,
    total: u64,
    /// Steps of the whole that were told.
    told: u64,
}

impl<'a> Whole<'a> {
    /// Tells `inner` of stages whose shares of the work are in the proportions of `works`.
    pub fn new(inner: &'a dyn Progress, works: Vec<f64>) -> Self {
        Self { inner, works, state: Mutex::default() }
    }

    /// The next stage begins.
    pub fn next(&self) {
        let mut state = self.lock();
        state.begun += 1;
        (state.done, state.total) = (0, 0);
        self.tell(&mut state);
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tells what is done and was not told yet; it never goes back.
    fn tell(&self, state: &mut State) {
        let of_stage = state.done.min(state.total) as f64 / state.total.max(1) as f64;
        let stage = state.begun.saturating_sub(1).min(self.works.len());
        let current = self.works.get(stage).copied().unwrap_or(0.0);
        let done: f64 = self.works[..stage].iter().sum::<f64>() + of_stage * current;
        let all = self.works.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let position = (done / all * STEPS as f64) as u64;
        let more = position.min(STEPS).saturating_sub(state.told);
        if more > 0 {
            state.told += more;
            self.inner.advance(more);
        }
    }
}

impl Progress for Whole<'_> {
    fn start(&self, total: u64, what: &str) {
        let mut state = self.lock();
        (state.done, state.total) = (0, total);
        let what = format!("{}/{} {what}", state.begun, self.works.len());
        if state.told == 0 {
            // Nothing is lost where a stage without work went before.
            self.inner.start(STEPS, &what);
        } else {
            self.inner.rename(&what);
        }
    }

    fn advance(&self, steps: u64) {
        let mut state = self.lock();
        state.done += steps;
        self.tell(&mut state);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Heard(Mutex<(Vec<String>, u64)>);

    impl Progress for Heard {
        fn start(&self, total: u64, what: &str) {
            assert_eq!(total, STEPS);
            self.rename(what);
        }

        fn rename(&self, what: &str) {
            self.0.lock().expect("unpoisoned").0.push(what.to_owned());
        }

        fn advance(&self, steps: u64) {
            self.0.lock().expect("unpoisoned").1 += steps;
        }
    }

    #[test]
    fn stages_add_up_to_the_whole_by_their_work() {
        let heard = Heard::default();
        let whole = Whole::new(&heard, vec![0.0, 1.0, 3.0]);
        let position = || heard.0.lock().expect("unpoisoned").1;
        whole.next();
        whole.next();
        whole.start(4, "a");
        whole.advance(2);
        assert_eq!(position(), STEPS / 8);
        whole.advance(5);
        assert_eq!(position(), STEPS / 4, "no further than its end");
        whole.next();
        whole.start(10, "b");
        whole.advance(5);
        assert_eq!(position(), STEPS / 4 + STEPS * 3 / 8);
        whole.start(10, "b again");
        whole.advance(1);
        assert_eq!(position(), STEPS / 4 + STEPS * 3 / 8, "never back");
        whole.advance(9);
        assert_eq!(position(), STEPS);
        assert_eq!(heard.0.into_inner().expect("unpoisoned").0, ["2/3 a", "3/3 b", "3/3 b again"]);
    }
}
