//! Vectors and names in files: exact lengths, so that a forgotten or a surplus number is an error.

use glam::{DQuat, DVec3};

/// The unit vector along `v`, for every finite length but 0, without overflow on the way.
pub(super) fn unit(v: DVec3) -> Option<DVec3> {
    unit_components(v.to_array()).map(DVec3::from_array)
}

/// The unit quaternion along `q`.
pub(super) fn unit_quaternion(q: DQuat) -> Option<DQuat> {
    unit_components(q.to_array()).map(DQuat::from_array)
}

fn unit_components<const N: usize>(v: [f64; N]) -> Option<[f64; N]> {
    let largest = v.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    if largest == 0.0 || v.iter().any(|c| !c.is_finite()) {
        return None;
    }
    // What is a unit vector already is left alone, to the bit: writing and reading a scene again
    // and again doesn't change it.
    const ROUNDING: f64 = 8.0 * f64::EPSILON;
    let squared: f64 = v.iter().map(|c| c * c).sum();
    if (squared - 1.0).abs() <= ROUNDING {
        return Some(v);
    }
    let scaled = v.map(|c| c / largest);
    let length = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
    Some(scaled.map(|c| c / length))
}

/// Reads exactly `N` numbers.
mod exact {
    use serde::de::{Deserializer, Error, SeqAccess, Visitor};

    struct Numbers<const N: usize>;

    impl<'de, const N: usize> Visitor<'de> for Numbers<N> {
        type Value = [f64; N];

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write!(f, "a list of {N} numbers")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<[f64; N], A::Error> {
            let mut numbers = [0.0; N];
            for (index, number) in numbers.iter_mut().enumerate() {
                *number =
                    seq.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
            }
            if seq.next_element::<f64>()?.is_some() {
                return Err(A::Error::custom(format!(
                    "expected a list of {N} numbers, found more"
                )));
            }
            Ok(numbers)
        }
    }

    pub fn deserialize<'de, const N: usize, D: Deserializer<'de>>(
        d: D,
    ) -> Result<[f64; N], D::Error> {
        d.deserialize_seq(Numbers::<N>)
    }
}

/// `#[serde(with)]` of two numbers: `[x, z]`.
pub(super) mod two {
    use glam::DVec2;
    use serde::{Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(v: &DVec2, s: S) -> Result<S::Ok, S::Error> {
        v.to_array().serialize(s)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<DVec2, D::Error> {
        super::exact::deserialize(d).map(DVec2::from_array)
    }
}

/// `#[serde(with)]` of a vector: `[x, y, z]`.
pub(super) mod three {
    use glam::DVec3;
    use serde::{Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(v: &DVec3, s: S) -> Result<S::Ok, S::Error> {
        v.to_array().serialize(s)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<DVec3, D::Error> {
        super::exact::deserialize(d).map(DVec3::from_array)
    }
}

/// `#[serde(with)]` of a quaternion: `[x, y, z, w]`.
pub(super) mod quaternion {
    use glam::DQuat;
    use serde::{Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(q: &DQuat, s: S) -> Result<S::Ok, S::Error> {
        q.to_array().serialize(s)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<DQuat, D::Error> {
        super::exact::deserialize(d).map(DQuat::from_array)
    }
}

/// `#[serde(with)]` of a vector that may be missing.
pub(super) mod some_three {
    use glam::DVec3;
    use serde::{Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(v: &Option<DVec3>, s: S) -> Result<S::Ok, S::Error> {
        v.map(|v| v.to_array()).serialize(s)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Option<DVec3>, D::Error> {
        super::three::deserialize(d).map(Some)
    }
}

/// `#[serde(with)]` of a quaternion that may be missing.
pub(super) mod some_quaternion {
    use glam::DQuat;
    use serde::{Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(q: &Option<DQuat>, s: S) -> Result<S::Ok, S::Error> {
        q.map(|q| q.to_array()).serialize(s)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Option<DQuat>, D::Error> {
        super::quaternion::deserialize(d).map(Some)
    }
}

/// `#[serde(with)]` of what is written as its own text.
pub(super) mod text {
    use std::fmt::Display;
    use std::str::FromStr;

    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<T: Display, S: Serializer>(value: &T, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(value)
    }

    pub fn deserialize<'de, T, D>(d: D) -> Result<T, D::Error>
    where
        T: FromStr<Err: Display>,
        D: Deserializer<'de>,
    {
        String::deserialize(d)?.parse().map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_vectors_at_the_ends_of_the_range() {
        for v in [
            DVec3::new(3.0, 4.0, 0.0),
            DVec3::splat(f64::MAX),
            DVec3::new(0.0, -1e-320, 0.0),
            DVec3::new(1e-300, 1e300, -1.0),
        ] {
            let u = unit(v).expect("not zero");
            assert!((u.length() - 1.0).abs() < 1e-15, "{v} gave {u}");
            assert_eq!(unit(u), Some(u), "normalising again must change nothing");
        }
        assert_eq!(unit(DVec3::ZERO), None);
        assert_eq!(unit(DVec3::new(f64::NAN, 1.0, 0.0)), None);
        assert_eq!(unit(DVec3::new(f64::INFINITY, 1.0, 0.0)), None);
    }
}
