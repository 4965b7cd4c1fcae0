//! What the built-in tables hold.

use crate::medium::{ShapeKind, ShapeSpec};

/// The noise shapes of the built-in tables, in the order of their indices from 1 on: both kinds,
/// different seeds. One MiB each.
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
