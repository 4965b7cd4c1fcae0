//! What is in a set of tables, in lines for people.

use super::TableSet;

/// Bytes of a value of an optical depth table.
const TEXEL_BYTES: usize = 4;

impl TableSet {
    /// Shapes, parameters, bytes and the errors measured when the tables were baked.
    pub fn summary(&self) -> Vec<String> {
        let description = self.description();
        let depth = &description.optical_depth;
        let options = &depth.options;
        let mut lines = vec![
            format!("format {}, made by {}", description.format, description.generator),
            format!("parameters {}", description.parameters),
            format!(
                "optical depth: {} noise shapes and uniform; mapping {}, {} x {} x {} x {} nodes",
                depth.shapes.len(),
                depth.mapping,
                options.direction,
                options.direction,
                options.disc,
                options.disc,
            ),
            format!(
                "  {}; fitted to {} random chords a cell in {} steps, seed {}",
                depth.encoding, options.rays_per_cell, options.iterations, options.seed
            ),
        ];
        for (table, shape) in self.optical_depth().iter().zip(&depth.shapes) {
            lines.push(format!(
                "  {}: mean density {:.4}, {:.2} MiB; error of transmittance on {} random chords:",
                shape.shape,
                shape.mean_density,
                mib(table.texels().len() * TEXEL_BYTES),
                shape.errors.rays,
            ));
            for e in &shape.errors.depths {
                lines.push(format!(
                    "    central optical depth {:>2}: RMS {:.4}, 99 % below {:.4}; parts of chords RMS {:.4} (shared by length {:.4})",
                    e.central_depth, e.rms, e.p99, e.part_rms, e.part_rms_by_length
                ));
            }
        }
        lines
    }
}

fn mib(bytes: usize) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}
