//! What the built-in tables hold.

use crate::medium::{Phase, ShapeKind, ShapeSpec};

/// The noise shapes of the built-in tables, in the order of their indices from 1 on: both kinds,
/// different seeds. 1.1 MiB each.
pub fn default_shapes() -> Vec<ShapeSpec> {
    let shape = |kind, seed| ShapeSpec { kind, seed };
    vec![
        shape(ShapeKind::Pyroclastic, 1),
        shape(ShapeKind::Pyroclastic, 2),
        shape(ShapeKind::Pyroclastic, 3),
        shape(ShapeKind::Soft, 1),
        shape(ShapeKind::Soft, 4),
    ]
}

/// The media of the built-in scattering tables, phase function and albedo: cloud droplets of 20
/// micrometres, and Henyey-Greenstein for comparisons with others.
pub fn default_media() -> Vec<(Phase, f64)> {
    vec![(Phase::Mie { diameter_um: 20.0 }, 1.0), (Phase::Hg { g: 0.85 }, 1.0)]
}
