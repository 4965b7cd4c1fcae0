//! Which chord of the unit sphere stands at which place of a 4D table.
//!
//! A chord is an undirected line through the sphere: exchanging its ends changes the order of its
//! parts, not the matter on it. [`HemisphereDisc`] stores every line once: its direction, turned
//! into the hemisphere z >= 0 and unfolded to a square by the octahedral map, and the point of the
//! line that is nearest to the centre, in the plane perpendicular to the direction. Mappings that
//! name two ends, or an end and a direction, hold every line twice.
//!
//! Both halves preserve the measure of isotropic lines (up to the octahedral map's factor of 5),
//! so texels lie where rays are. The axes of the plane are those of Duff et al., "Building an
//! Orthonormal Basis, Revisited" (JCGT 2017), continuous over the open hemisphere; on its rim the
//! table has an edge, and a line there is stored at both ends of it.

use glam::{DVec2, DVec3};

/// A chord's place in a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Coordinates in 0..1, the fastest of the table first.
    pub at: [f64; 4],
    /// Whether the table's chord runs from the exit to the entry.
    pub reversed: bool,
}

/// A mapping between chords of the unit sphere and the unit 4-cube.
pub trait ChordMapping: Sync {
    /// Name in table files.
    fn name(&self) -> &'static str;

    /// Place of the chord between two points of the unit sphere; always inside 0..1.
    fn place(&self, entry: DVec3, exit: DVec3) -> Place;

    /// Entry and exit of the chord at a place, the inverse of [`Self::place`] on chords that are
    /// not reversed; none where a place has no chord.
    fn chord(&self, at: [f64; 4]) -> Option<[DVec3; 2]>;

    /// Measure of isotropic lines per volume of the 4-cube, up to a constant.
    fn density(&self, at: [f64; 4]) -> f64;
}

/// Name of [`HemisphereDisc`] in table files.
pub const NAME: &str = "hemisphere-disc";

/// The mapping of the table files and of `shaders/tables/optical_depth.wgsl`.
#[derive(Clone, Copy, Debug, Default)]
pub struct HemisphereDisc;

/// A chord shorter than this, in radii, has no direction in f32; it holds no matter worth a look.
pub const SHORTEST_CHORD: f64 = 1e-6;

impl ChordMapping for HemisphereDisc {
    fn name(&self) -> &'static str {
        NAME
    }

    fn place(&self, entry: DVec3, exit: DVec3) -> Place {
        let chord = exit - entry;
        let length = chord.length();
        // A point of the sphere: any tangent is as good as another.
        let ray =
            if length > SHORTEST_CHORD { chord / length } else { entry.any_orthonormal_vector() };
        let reversed = ray.z < 0.0;
        let d = if reversed { -ray } else { ray };
        let middle = (entry + exit) * 0.5;
        let disc = middle.truncate() - d.truncate() * (middle.z / (1.0 + d.z));
        let direction = hemisphere_to_square(d);
        let at = [disc.x, disc.y, direction.x, direction.y];
        Place { at: at.map(|c| (0.5 + 0.5 * c).clamp(0.0, 1.0)), reversed }
    }

    fn chord(&self, at: [f64; 4]) -> Option<[DVec3; 2]> {
        let [x, y, u, v] = at.map(|c| 2.0 * c - 1.0);
        let d = hemisphere_from_square(DVec2::new(u, v));
        let half = 1.0 - x * x - y * y;
        if half < 0.0 {
            return None;
        }
        let a = 1.0 / (1.0 + d.z);
        let tangent = DVec3::new(1.0 - d.x * d.x * a, -d.x * d.y * a, -d.x);
        let bitangent = DVec3::new(-d.x * d.y * a, 1.0 - d.y * d.y * a, -d.y);
        let middle = tangent * x + bitangent * y;
        let reach = d * half.sqrt();
        Some([middle - reach, middle + reach])
    }

    fn density(&self, at: [f64; 4]) -> f64 {
        let d = hemisphere_from_square(DVec2::new(2.0 * at[2] - 1.0, 2.0 * at[3] - 1.0));
        octahedral_density(d)
    }
}

/// Octahedral map of the hemisphere z >= 0 to the square -1..1.
pub(super) fn hemisphere_to_square(d: DVec3) -> DVec2 {
    let p = d.truncate() / (d.x.abs() + d.y.abs() + d.z.abs());
    DVec2::new(p.x + p.y, p.x - p.y)
}

/// Inverse of [`hemisphere_to_square`].
pub(super) fn hemisphere_from_square(s: DVec2) -> DVec3 {
    let p = DVec2::new(s.x + s.y, s.x - s.y) * 0.5;
    p.extend((1.0 - p.x.abs() - p.y.abs()).max(0.0)).normalize()
}

/// Solid angle per area of the octahedral square, 1 at the poles.
pub(super) fn octahedral_density(d: DVec3) -> f64 {
    (d.x.abs() + d.y.abs() + d.z.abs()).powi(3)
}
