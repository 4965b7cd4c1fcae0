//! The frame's lookups on the device against those of the host, and lookups of strange rays.

use std::f64::consts::PI;

use cumuli::Result;
use cumuli::gpu::Gpu;
use cumuli::reference::Random;
use cumuli::tables::sample::{Sample, SampleRay, Sampler};
use cumuli::tables::{ScatteringTable, TableSet};
use glam::DVec3;

use super::row::{Row, Worst};
use super::{Effort, draws};

/// A step of f16 next to any value: both sides read the same stored numbers.
const STEP: f64 = 1.0 / 1024.0;
/// What f32 makes of the optical depth of a chord, for each unit of optical radius.
const ROUNDING: f64 = 2e-7;
/// Radiance that f32 may lose: it ends at 1e-38, before a phase function of up to 1e4.
const DARK: f64 = 1e-33;
/// How far f32 misplaces the sun's path of order 1 in a table, radii; the light follows with the
/// optical radius times that. A step of f16 in the stored path is thirty times as much.
const PLACE: f64 = 1.5e-5;
/// Least optical radius of the rays: thinner than tables begin, where the nearest is used. The
/// greatest is the table's.
const LEAST_OPTICAL_RADIUS: f64 = 1e-3;

type Field = (&'static str, fn(&Sample) -> f64);

/// The quantities that are compared.
const FIELDS: [Field; 4] = [
    ("optical depth", |s| s.optical_depth),
    ("transmittance", |s| s.transmittance),
    ("order 1", |s| s.single),
    ("orders from 2 on", |s| s.multiple),
];

/// Rays of all kinds, each tenth one degenerate: grazing, through the centre, into the sun, away
/// from it.
pub(super) fn rays(effort: &Effort, table: &ScatteringTable) -> Vec<SampleRay> {
    let count = effort.chords;
    let make = |number: u64| {
        let mut random = Random::new(effort.seed, 4, number);
        let mut entry = draws::on_sphere(&mut random);
        let mut dir = draws::on_sphere(&mut random);
        if dir.dot(entry) > 0.0 {
            dir = -dir;
        }
        let mut sun = draws::on_sphere(&mut random);
        match number % 40 {
            0 => dir = entry.any_orthonormal_vector(),
            1 => dir = -entry,
            2 => sun = dir,
            3 => sun = -dir,
            // Within the lobe of cloud droplets.
            4..10 => sun = (dir + 0.01 * sun).normalize(),
            10 => (entry, dir, sun) = (DVec3::Z, DVec3::NEG_Z, DVec3::Z),
            _ => {}
        }
        let [_, most] = table.optical_radius_range();
        let least = LEAST_OPTICAL_RADIUS.min(most);
        let optical_radius = least * (most / least).powf(random.unit());
        let (a, b) = (random.unit(), random.unit());
        let part = if number.is_multiple_of(2) { [0.0, 1.0] } else { [a.min(b), a.max(b)] };
        SampleRay { entry, dir, sun, optical_radius, part }
    };
    (0..count).map(make).collect()
}

/// All rows; without a device only those of the host.
pub fn rows(tables: &TableSet, gpu: Option<&Gpu>, effort: &Effort) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    // Values that are stored more precisely than the device takes them are rounded first: how
    // much that costs is no matter of lookups.
    let tables = &tables.rounded();
    let Some(first) = tables.scattering().first() else { return Ok(rows) };
    let shapes = tables.shape_names().map(|shape| (shape, first));
    // The uniform shape with every medium, the others with one: media do not know of shapes.
    let media = tables.scattering().iter().skip(1).map(|table| ("uniform", table));
    for (shape, table) in shapes.chain(media) {
        let name = format!("{shape} in {}", super::medium(table));
        let sampler = Sampler::new(tables, shape, table.phase(), table.albedo())?;
        let rays = rays(effort, table);
        let host: Vec<Sample> = rays.iter().map(|ray| sampler.sample(ray)).collect();
        let wrong = host.iter().filter(|sample| !is_sound(sample)).count();
        let title = format!("answers not finite or out of range, {name}");
        rows.push(Row::absolute(title, 0.0, wrong as f64, 0.0));
        let Some(gpu) = gpu else { continue };
        let device = sampler.sample_on(gpu, &rays)?;
        for (field, value) in FIELDS {
            let mut worst = Worst::NONE;
            for ((ray, host), device) in rays.iter().zip(&host).zip(&device) {
                let values = [value(host), value(device)];
                let depth = ROUNDING * ray.optical_radius.max(1.0);
                // Light is in proportion to the optical depth where that is small.
                let source = |s: &Sample| value(s) / s.optical_depth.max(f64::MIN_POSITIVE);
                let rounding = match field {
                    "optical depth" | "transmittance" => depth,
                    _ => {
                        let place = PLACE * ray.optical_radius * values[0].abs();
                        depth * source(host).max(source(device)) + place + DARK
                    }
                };
                let tolerance = STEP * values[0].abs() + rounding;
                worst.add(values, (values[1] - values[0]).abs(), tolerance);
            }
            rows.push(worst.row(format!("device against host: {field}, {name}")));
        }
    }
    Ok(rows)
}

/// Whether an answer can be one: the radiance of a sphere in sunlight of irradiance 1 is bounded by
/// its phase function, which is below 1e6 / (4 pi) for any that is accepted.
fn is_sound(sample: &Sample) -> bool {
    let light = 0.0..1e6 / (4.0 * PI);
    sample.optical_depth >= 0.0
        && sample.optical_depth.is_finite()
        && (0.0..=1.0).contains(&sample.transmittance)
        && light.contains(&sample.single)
        && light.contains(&sample.multiple)
}
