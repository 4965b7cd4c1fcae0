//! Lit uniform spheres from several sides, and where their light of order 1 is off.

use std::f64::consts::PI;

use cumuli::Result;
use cumuli::tables::ScatteringTable;
use cumuli::tables::sample::{SampleRay, Sampler};
use glam::DVec3;

use super::canvas::{Canvas, Tile, grey, signed, srgb};
use crate::verify::order::source;
use crate::verify::quadrature::double_exponential;

/// Optical radii of the rows, those within the table's range.
const OPTICAL_RADII: [f64; 5] = [0.3, 1.0, 4.0, 14.0, 60.0];
/// Angles between the eye's direction and the sun of the columns, degrees: from the sun behind the
/// sphere to the sun behind the eye.
const ANGLES: [f64; 7] = [0.0, 15.0, 45.0, 90.0, 120.0, 150.0, 180.0];
/// Radiance of what is behind the spheres, in units of a white sheet in the sun.
const BACKGROUND: f64 = 0.05;
/// Error of order 1, as a share of all light of the ray, that is shown in full colour.
const FULL_COLOUR: f64 = 0.02;
/// Points of the quadrature in each half of a chord: 1e-6 is enough for a picture.
const HALF_POINTS: i32 = 30;

/// Samples along each side of a pixel where the spheres' edges shall be smooth.
const EDGE_SAMPLES: u32 = 2;

const SIDE: u32 = 150;
const GAP: u32 = 8;
const LEFT: u32 = 130;
const TOP: u32 = 90;

/// Lit spheres.
pub fn lit(sampler: &Sampler<'_>, table: &ScatteringTable, medium: &str) -> Result<Canvas> {
    let title = format!("Uniform spheres in sunlight, {medium}");
    let notes = "brightness 1 - exp(-pi L), L the radiance per unit of sun irradiance; background 0.05; \
                 the sun is behind the sphere on the left, above it, behind the eye on the right";
    grid(table, [&title, notes], EDGE_SAMPLES, |ray| {
        let Some(ray) = ray else { return grey(srgb(shown(BACKGROUND))) };
        let sample = sampler.sample(ray);
        grey(srgb(shown(PI * sample.total() + sample.transmittance * BACKGROUND)))
    })
}

/// Errors of order 1.
pub fn errors(sampler: &Sampler<'_>, table: &ScatteringTable, medium: &str) -> Result<Canvas> {
    let title = format!("Order 1 against integration, {medium}");
    let notes = "as a share of all light of the ray: red +2 %, blue -2 % or more";
    let rule = double_exponential(HALF_POINTS);
    let phase = table.phase().prepare();
    grid(table, [&title, notes], 1, |ray| {
        let Some(ray) = ray else { return [0.9, 0.9, 0.95] };
        let sample = sampler.sample(ray);
        let chord = -2.0 * ray.entry.dot(ray.dir);
        let opaque = -(-ray.optical_radius * chord).exp_m1();
        let exact = opaque * phase.eval(ray.dir.dot(ray.sun)) * source(table.albedo(), ray, &rule);
        let error = (sample.single - exact) / (exact + sample.multiple).max(f64::MIN_POSITIVE);
        signed(error / FULL_COLOUR)
    })
}

/// Maps light in units of a white sheet to 0..1 without a hard end.
fn shown(light: f64) -> f64 {
    -(-light).exp_m1()
}

/// A tile for each optical radius and angle; the colour of a ray, or of none beside the sphere.
fn grid(
    table: &ScatteringTable,
    [title, notes]: [&str; 2],
    samples: u32,
    colour: impl Fn(Option<&SampleRay>) -> [f64; 3] + Sync,
) -> Result<Canvas> {
    let [least, most] = table.optical_radius_range();
    let mut radii: Vec<f64> =
        OPTICAL_RADII.into_iter().filter(|r| (least..=most).contains(r)).collect();
    if radii.is_empty() {
        radii.push((least * most).sqrt());
    }
    let width = LEFT + ANGLES.len() as u32 * (SIDE + GAP);
    let mut canvas = Canvas::new([width, TOP + radii.len() as u32 * (SIDE + GAP)]);
    canvas.text(title, [GAP, 8], 22)?;
    canvas.text(notes, [GAP, 36], 14)?;
    for (column, angle) in ANGLES.into_iter().enumerate() {
        let x = LEFT + column as u32 * (SIDE + GAP);
        canvas.text(&format!("{angle} deg to sun"), [x, TOP - 22], 14)?;
    }
    for (row, optical_radius) in radii.into_iter().enumerate() {
        let y = TOP + row as u32 * (SIDE + GAP);
        canvas.text("optical radius", [GAP, y + SIDE / 2 - 18], 14)?;
        canvas.text(&format!("{optical_radius:.3}"), [GAP, y + SIDE / 2], 18)?;
        for (column, angle) in ANGLES.into_iter().enumerate() {
            let tile = Tile { x: LEFT + column as u32 * (SIDE + GAP), y, side: SIDE };
            let (sin, cos) = angle.to_radians().sin_cos();
            // The eye looks along z, the sun is turned from there upwards.
            let sun = DVec3::new(0.0, sin, cos);
            canvas.fill(tile, samples, |u, v| {
                let (x, y) = (1.04 * u, 1.04 * v);
                let across = x * x + y * y;
                if across >= 1.0 {
                    return colour(None);
                }
                let entry = DVec3::new(x, y, -(1.0 - across).sqrt());
                let ray = SampleRay { entry, dir: DVec3::Z, sun, optical_radius, part: [0.0, 1.0] };
                colour(Some(&ray))
            });
        }
    }
    Ok(canvas)
}
