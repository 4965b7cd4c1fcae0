//! Views of the insides of a frame: what the passes hold, as pictures.

use glam::DVec3;

use super::order::{Inside, Order};
use crate::Result;
use crate::compare::error_image::heat;
use crate::frame::cpu::rings;
use crate::frame::gpu_data::Particle;
use crate::frame::population::Shapes;
use crate::frame::{Picture, Renderer};
use crate::scene::{Camera, Scene};
use crate::tables::TableSet;

/// Colours of the rings from the innermost on; the last is that of listed particles too.
const RING_COLOURS: [[u8; 3]; 8] = [
    [228, 26, 28],
    [255, 127, 0],
    [255, 221, 51],
    [77, 175, 74],
    [55, 126, 184],
    [152, 78, 163],
    [247, 129, 191],
    [166, 86, 40],
];
/// What is behind discs.
const BACKGROUND: [u8; 4] = [24, 26, 32, 255];
/// Share of a disc's radius from where on its rim is dark.
const RIM: f64 = 0.92;

/// A picture of the insides, and what its colours mean.
pub(super) struct View {
    pub pixels: Vec<[u8; 4]>,
    pub legend: String,
}

/// The view of the renderer's last frame, made of `order` and its scene.
pub(super) fn view(
    inside: Inside,
    renderer: &mut Renderer,
    tables: &TableSet,
    scene: &Scene,
    order: &Order,
) -> Result<View> {
    let size = order.size;
    Ok(match inside {
        Inside::Lists => {
            let counts = renderer.tile_entries()?;
            let side = renderer.tile_side();
            let columns = size[0].div_ceil(side);
            let of_pixel = |x: u32, y: u32| {
                let tile = (y / side * columns + x / side) as usize;
                counts.get(tile).copied().unwrap_or(0) as f32
            };
            heat_map(size, of_pixel, "particles in a tile's list")
        }
        Inside::Steps => {
            let steps = renderer.distance()?;
            let of_pixel = |x: u32, y: u32| steps[(y * size[0] + x) as usize];
            heat_map(size, of_pixel, "steps and look-ups of a pixel")
        }
        Inside::Light => {
            let (particles, _) = renderer.particles()?;
            let centre =
                |p: &Particle| scene.camera.position + DVec3::from_array(p.centre.map(f64::from));
            let centres: Vec<_> = particles.iter().map(centre).collect();
            // A frame that sees nothing that sunlight falls on knows nothing of it, and has no discs in view.
            let through = renderer.sun_transmittance_if_known(&centres)?;
            let through = through.unwrap_or_else(|| vec![1.0; centres.len()]);
            let discs = particles.iter().zip(&through).map(|(particle, through)| {
                Disc::of(particle.centre, particle.radius, grey(f64::from(*through)))
            });
            let pixels = splat(&scene.camera, size, discs.collect());
            let legend = "sunlight that reaches each particle's middle: black 0, white 1";
            View { pixels, legend: legend.to_owned() }
        }
        Inside::Rings => {
            let pixels = splat(&scene.camera, size, by_ring(scene, tables, order.time)?);
            View {
                pixels,
                legend: "particles by ring: red is the innermost; listed ones brown".to_owned(),
            }
        }
    })
}

/// A particle as it is drawn.
struct Disc {
    /// Relative to the camera, m.
    centre: DVec3,
    radius: f64,
    colour: [u8; 3],
}

impl Disc {
    fn of(centre: [f32; 3], radius: f32, colour: [u8; 3]) -> Self {
        Self { centre: DVec3::from_array(centre.map(f64::from)), radius: radius.into(), colour }
    }
}

/// All particles, the field's by the host's twin of the rings' pass, which tells the ring.
fn by_ring(scene: &Scene, tables: &TableSet, time: f64) -> Result<Vec<Disc>> {
    let shapes = Shapes::new(tables);
    let listed = shapes.listed(&scene.particles, scene.camera.position)?;
    let last = RING_COLOURS[RING_COLOURS.len() - 1];
    let mut discs: Vec<_> = listed.iter().map(|p| Disc::of(p.centre, p.radius, last)).collect();
    if let Some(clouds) = shapes.field(scene, time, 0, u32::MAX)? {
        for index in 0..clouds.uniforms.rings {
            let colour = RING_COLOURS[index as usize % RING_COLOURS.len()];
            let particles = rings::particles_of_ring(&clouds, index);
            discs.extend(particles.iter().map(|p| Disc::of(p.centre, p.radius, colour)));
        }
    }
    Ok(discs)
}

/// Draws discs, the nearest over the others.
fn splat(camera: &Camera, size: [u32; 2], mut discs: Vec<Disc>) -> Vec<[u8; 4]> {
    let mut pixels = vec![BACKGROUND; Picture::pixel_count(size)];
    let basis = camera.basis();
    let pixels_a_tangent = 0.5 * f64::from(size[0]) / camera.half_width();
    let middle = size.map(|side| 0.5 * f64::from(side));
    discs.sort_by(|a, b| b.centre.length_squared().total_cmp(&a.centre.length_squared()));
    for disc in &discs {
        let ahead = disc.centre.dot(basis.forward);
        // Those that the eye is in, or nearly, would hide all others.
        if ahead <= disc.radius {
            continue;
        }
        let scale = pixels_a_tangent / ahead;
        let x = middle[0] + disc.centre.dot(basis.right) * scale;
        let y = middle[1] - disc.centre.dot(basis.up) * scale;
        let radius = disc.radius * scale;
        let range = |at: f64, side: u32| {
            let end = |v: f64| v.clamp(0.0, f64::from(side)) as u32;
            end((at - radius).floor())..end((at + radius).ceil())
        };
        for row in range(y, size[1]) {
            for column in range(x, size[0]) {
                let off = (f64::from(column) + 0.5 - x).hypot(f64::from(row) + 0.5 - y) / radius;
                if off <= 1.0 {
                    let dark = if off > RIM { 2 } else { 1 };
                    let [r, g, b] = disc.colour.map(|v| v / dark);
                    pixels[(row * size[0] + column) as usize] = [r, g, b, 255];
                }
            }
        }
    }
    pixels
}

/// A number for every pixel from black over red and yellow to white.
fn heat_map(size: [u32; 2], of_pixel: impl Fn(u32, u32) -> f32, what: &str) -> View {
    let places = || (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    let most = places().map(|(x, y)| of_pixel(x, y)).fold(0.0, f32::max);
    let pixels = places()
        .map(|(x, y)| {
            let t = f64::from(of_pixel(x, y) / most.max(1.0));
            let [r, g, b] = heat(t).to_array().map(|v| (255.0 * v).round() as u8);
            [r, g, b, 255]
        })
        .collect();
    View { pixels, legend: format!("{what}: black 0, red and yellow, white {most:.0}") }
}

fn grey(share: f64) -> [u8; 3] {
    [(255.0 * share.clamp(0.0, 1.0)).round() as u8; 3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn discs_lie_where_the_camera_sees_them_and_the_nearest_is_in_front() {
        let camera = Camera {
            position: DVec3::ZERO,
            target: DVec3::NEG_Z,
            fov_x: 90.0,
            ..Camera::default()
        };
        let disc = |x: f32, z: f32, radius: f32, colour| Disc::of([x, 0.0, z], radius, colour);
        let (far, near, beside) = ([10; 3], [90; 3], [200; 3]);
        let behind = disc(0.0, 50.0, 10.0, [1; 3]);
        let around = disc(0.0, -1.0, 5.0, [2; 3]);
        // At 90 degrees a tangent is half the width: 50 pixels.
        let discs = vec![
            disc(0.0, -10.0, 1.0, near),
            disc(0.0, -20.0, 8.0, far),
            disc(8.0, -10.0, 0.5, beside),
            behind,
            around,
        ];
        let pixels = splat(&camera, [100, 60], discs);
        let at = |x: usize, y: usize| pixels[y * 100 + x][0];
        assert_eq!(at(50, 30), 90);
        assert_eq!(at(60, 30), 10, "5 pixels of radius, then the one behind it");
        assert_eq!(at(90, 30), 200, "50 + 0.8 * 50");
        assert_eq!(at(90, 40), BACKGROUND[0]);
        assert_eq!(at(5, 5), BACKGROUND[0]);
    }

    #[test]
    fn heat_goes_to_the_largest_number() {
        let view = heat_map([4, 1], |x, _| x as f32 * 10.0, "things");
        assert_eq!((view.pixels[0], view.pixels[3]), ([0, 0, 0, 255], [255; 4]));
        assert!(view.pixels[1][0] > 0 && view.pixels[1][2] == 0, "{:?}", view.pixels[1]);
        assert!(view.legend.contains("things") && view.legend.contains("30"), "{}", view.legend);
        let empty = heat_map([2, 1], |_, _| 0.0, "things");
        assert_eq!(empty.pixels, [[0, 0, 0, 255]; 2]);
    }
}
