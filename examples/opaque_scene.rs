//! Draws towers and balls as the camera of a scene sees them, for `cumuli render --opaque`: distances, colours, and what
//! sunlight adds to them.
//!
//! `cargo run --example opaque_scene -- scenes/cumulus.toml 640x360 towers.exr`
//! `cumuli render --scene scenes/cumulus.toml --size 640x360 --opaque towers.exr --out towers.png`

use std::error::Error;
use std::path::Path;

use cumuli::frame::{OpaquePicture, Surface};
use cumuli::output::write_opaque;
use cumuli::scene::Scene;
use glam::{DVec2, DVec3};

/// Reflected share of red, green and blue.
const ALBEDO: DVec3 = DVec3::new(0.45, 0.4, 0.35);
/// Radiance of the sky over the sun's irradiance, about that of a clear noon.
const SKY: f64 = 0.02;
/// Share of the sun's light that comes through clear air.
const CLEAR: f64 = 0.8;

/// What a ray from the eye meets, relative to the eye: distance (m) and normal.
type Meeting = (f64, DVec3);

/// A round tower from far below to a height over the eye (m).
fn tower(foot: DVec2, radius: f64, top: f64, dir: DVec3) -> Option<Meeting> {
    let flat = DVec2::new(dir.x, dir.z);
    let (square, along) = (flat.length_squared(), foot.dot(flat));
    let rest = along * along - square * (foot.length_squared() - radius * radius);
    if square == 0.0 || rest <= 0.0 {
        return None;
    }
    let side = (along - rest.sqrt()) / square;
    if side > 0.0 && side * dir.y <= top {
        let normal = (side * flat - foot) / radius;
        return Some((side, DVec3::new(normal.x, 0.0, normal.y)));
    }
    // Its top, from above.
    let over = top / dir.y;
    let meets = dir.y < 0.0 && top < 0.0 && (over * flat - foot).length() < radius;
    meets.then_some((over, DVec3::Y))
}

fn ball(centre: DVec3, radius: f64, dir: DVec3) -> Option<Meeting> {
    let middle = centre.dot(dir);
    let half = radius * radius - (centre - middle * dir).length_squared();
    if half <= 0.0 || middle <= half.sqrt() {
        return None;
    }
    let distance = middle - half.sqrt();
    Some((distance, (distance * dir - centre) / radius))
}

/// The nearest of all, in front of the camera.
fn meet(scene: &Scene, dir: DVec3) -> Option<Surface> {
    let basis = scene.camera.basis();
    let (ahead, aside) = (
        DVec3::new(basis.forward.x, 0.0, basis.forward.z).normalize_or(DVec3::NEG_Z),
        DVec3::new(basis.right.x, 0.0, basis.right.z).normalize_or(DVec3::X),
    );
    let at = |forward: f64, right: f64| forward * ahead + right * aside;
    let foot = |forward: f64, right: f64| {
        let place = at(forward, right);
        DVec2::new(place.x, place.z)
    };
    let ground = -scene.camera.position.y;
    let meetings = [
        tower(foot(1500.0, -500.0), 90.0, 1150.0 + ground, dir),
        tower(foot(2600.0, 300.0), 120.0, 1900.0 + ground, dir),
        tower(foot(4200.0, -900.0), 160.0, 2600.0 + ground, dir),
        ball(at(2200.0, 750.0) + (1250.0 + ground) * DVec3::Y, 260.0, dir),
        ball(at(3600.0, -150.0) + (1500.0 + ground) * DVec3::Y, 420.0, dir),
    ];
    let (distance, normal) =
        meetings.into_iter().flatten().min_by(|(a, _), (b, _)| a.total_cmp(b))?;
    let sun = scene.sun.irradiance;
    let facing = normal.dot(scene.sun.direction).max(0.0);
    Some(Surface {
        distance,
        radiance: ALBEDO * SKY * sun * (0.75 + 0.25 * normal.y),
        sunlit: ALBEDO * (facing * CLEAR * sun / std::f64::consts::PI),
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let [scene, size, out] = arguments.as_slice() else {
        return Err("expected a scene, a size and the EXR file to write".into());
    };
    let scene = Scene::load(Path::new(scene))?;
    let (width, height) = size.split_once('x').ok_or("expected a size as 640x360")?;
    let size = [width.parse()?, height.parse()?];
    let picture = OpaquePicture::cast(&scene.camera, size, |dir| meet(&scene, dir));
    write_opaque(Path::new(out), &picture)?;
    Ok(())
}
