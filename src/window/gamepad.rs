//! Flying with a gamepad.
//!
//! What sticks mean is tested in every build; the pads themselves are only there with the feature
//! `gamepad`.

#[cfg(feature = "gamepad")]
mod pads;

#[cfg(any(feature = "gamepad", test))]
use glam::DVec3;

#[cfg(feature = "gamepad")]
pub(super) use pads::{News, Pads};

#[cfg(any(feature = "gamepad", test))]
use super::camera::Lean;

/// A stick that leans less than this stands: worn ones come to rest a tenth beside their middle.
#[cfg(any(feature = "gamepad", test))]
const DEAD: f64 = 0.15;

/// Where sticks and triggers are.
#[cfg(any(feature = "gamepad", test))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sticks {
    /// The left stick: right and up, each from -1 to 1.
    pub left: [f64; 2],
    /// The right one.
    pub right: [f64; 2],
    /// How far the triggers are pulled, left and right: from 0 to 1.
    pub triggers: [f64; 2],
}

#[cfg(any(feature = "gamepad", test))]
impl Sticks {
    /// The left stick flies ahead and aside, the triggers down and up, the right stick looks around.
    pub fn lean(self) -> Lean {
        let [right, ahead] = beyond_dead_zone(self.left);
        let [sink, climb] = self.triggers.map(|pulled| beyond_dead_zone([pulled, 0.0])[0]);
        let [aside, up] = beyond_dead_zone(self.right);
        // Squared, small turns are easy.
        let far = aside.hypot(up);
        Lean { way: DVec3::new(right, climb - sink, ahead), turn: [aside * far, up * far] }
    }
}

/// A stick's place from the edge of its dead zone on, of length 0 to 1.
#[cfg(any(feature = "gamepad", test))]
fn beyond_dead_zone(place: [f64; 2]) -> [f64; 2] {
    let length = place[0].hypot(place[1]);
    // A broken driver's NaN moves nothing.
    if !length.is_finite() || length <= DEAD {
        return [0.0; 2];
    }
    let beyond = (length.min(1.0) - DEAD) / (1.0 - DEAD);
    place.map(|v| v * beyond / length)
}

/// The gamepad, for people; nothing where there is none in the build.
pub(super) const HELP: &[(&str, &str)] = if cfg!(feature = "gamepad") {
    &[
        ("left, right stick", "fly, look around"),
        ("triggers", "down, up"),
        ("A / Y", "faster / back to the start"),
        ("cross up, down", "speed"),
        ("cross left, right", "slower, quicker time"),
        ("start / select", "pause / panel"),
    ]
} else {
    &[]
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sticks_at_rest_move_nothing() {
        for place in [[0.0, 0.0], [0.1, -0.1], [-DEAD, 0.0], [f64::NAN, 1.0], [0.0, f64::INFINITY]]
        {
            let sticks = Sticks { left: place, right: place, triggers: [place[0]; 2] };
            assert_eq!(sticks.lean(), Lean::default(), "{place:?}");
        }
    }

    #[test]
    fn every_stick_moves_what_it_should() {
        let left = |place| Sticks { left: place, ..Sticks::default() }.lean();
        let right = |place| Sticks { right: place, ..Sticks::default() }.lean();
        assert_eq!(left([0.0, 1.0]).way, DVec3::Z, "ahead");
        assert_eq!(left([-1.0, 0.0]).way, DVec3::NEG_X, "to the left");
        assert_eq!(left([0.0, 1.0]).turn, [0.0; 2]);
        assert_eq!(right([1.0, 0.0]).turn, [1.0, 0.0]);
        assert_eq!(right([0.0, -1.0]).turn, [0.0, -1.0]);
        assert_eq!(right([0.0, -1.0]).way, DVec3::ZERO);
        let pulled = |triggers| Sticks { triggers, ..Sticks::default() }.lean().way;
        assert_eq!(pulled([0.0, 1.0]), DVec3::Y);
        assert_eq!(pulled([1.0, 0.0]), DVec3::NEG_Y);
        assert_eq!(pulled([1.0, 1.0]), DVec3::ZERO);
    }

    #[test]
    fn from_the_dead_zone_on_it_grows_without_a_jump_to_all() {
        let ahead = |place: f64| Sticks { left: [0.0, place], ..Sticks::default() }.lean().way.z;
        assert!(ahead(DEAD + 1e-6) < 2e-6);
        let half = ahead(0.5 * (1.0 + DEAD));
        assert!((half - 0.5).abs() < 1e-12, "{half}");
        let mut last = 0.0;
        for step in 0..=100 {
            let now = ahead(f64::from(step) / 100.0);
            assert!(now >= last && now <= 1.0);
            last = now;
        }
        // Corners of square sticks are no faster than their sides.
        let corner = Sticks { left: [1.0, 1.0], right: [1.0, 1.0], ..Sticks::default() }.lean();
        assert!((corner.way.length() - 1.0).abs() < 1e-12);
        assert!((corner.turn[0].hypot(corner.turn[1]) - 1.0).abs() < 1e-12);
    }
}
