//! What is in a set of tables, in lines for people.

use super::TableSet;
use super::scattering::RadiusReport;

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
                "  {}: mean density {:.4}, 4D table {:.2} MiB, density volume {:.2} MiB; error of \
                 transmittance on {} random chords:",
                shape.shape,
                shape.mean_density,
                mib(table.texels().len() * TEXEL_BYTES),
                mib(table.volumes()[0].bytes().len()),
                shape.errors.rays,
            ));
            for (way, depths) in [("volume", &shape.errors.depths), ("table", &shape.errors.table)]
            {
                lines.extend(depths.iter().map(|e| format!(
                    "    {way:>6}, central optical depth {:>2}: RMS {:.4}, 99 % below {:.4}; parts \
                     of chords RMS {:.4} (shared by length {:.4})",
                    e.central_depth, e.rms, e.p99, e.part_rms, e.part_rms_by_length
                )));
            }
        }
        for (table, medium) in self.scattering().iter().zip(&description.scattering.media) {
            let [radii, incidences, azimuths, angles] = medium.resolution;
            let [least, most] = medium.optical_radius;
            lines.push(format!(
                "scattering: {}, albedo {}, {}; {radii} optical radii {least} to {most} x {incidences} \
                 incidences x {azimuths} azimuths x {angles} view-sun angles, {:.2} MiB",
                medium.phase,
                medium.albedo,
                medium.precision,
                mib(table.precise_values().map_or(size_of_val(table.values()), size_of_val)),
            ));
            lines.extend(medium.report.radii.iter().map(radius_line));
        }
        lines
    }
}

fn radius_line(radius: &RadiusReport) -> String {
    let energy = radius.conservation.map_or(String::new(), |[low, high]| {
        format!(", energy out over energy in {low:.4} to {high:.4} before it was balanced")
    });
    format!(
        "  optical radius {:8.3}: {} steps, last change {:.1e}{energy}",
        radius.optical_radius, radius.steps, radius.residual
    )
}

fn mib(bytes: usize) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}
