//! `sky.wgsl`, function by function, against the same in f64 with the very tables that the device has.

use std::f64::consts::PI;

use cumuli::frame::cpu::atmosphere::{
    TOP_ALTITUDE, air_place, air_span, air_spread, altitude_place, direction_place,
    distance_to_ground, sun_place, texel_centre,
};
use cumuli::frame::sky::gpu_data::{DISC_RIM, PLANET_RADIUS, SkyUniforms, disc_profile};
use cumuli::frame::sky::tables::{AIR_SIZE, ALTITUDE_SIZE, GROUND_SIZE, VIEW_SIZE};
use cumuli::frame::sky::{SkyInputs, SkyKind, SkyPass};
use glam::{DVec2, DVec3, DVec4, Vec3};
use half::f16;

use super::{Four, Function, magnitude, many, one};
use crate::common::{Group, Random, gpu, library};

/// As in the shader.
pub const TABLE_SCALE: f64 = 1024.0;
/// Product of the level parts of two directions below which one is straight up; as in the shader.
const LEAST_LEVEL: f64 = 1e-12;
/// A device may place a fetch so far beside, in texels.
const SHIFT: f64 = 1.0 / 256.0;
/// Axes of the largest of the textures.
const SHIFTS: usize = 3;

/// A sky on the device with all its tables.
pub struct Made {
    pub pass: SkyPass,
}

impl Made {
    pub fn new(inputs: &SkyInputs) -> Self {
        let mut pass = SkyPass::new(gpu(), library()).expect("passes");
        let work = pass.update(gpu(), inputs);
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        pass.encode(&mut encoder, work);
        gpu().queue.submit([encoder.finish()]);
        Self { pass }
    }

    /// What a march through the air reads.
    pub fn march(&self) -> [Group<'_>; 1] {
        [(self.pass.march_layout(), self.pass.march_group())]
    }

    pub fn groups(&self) -> [Group<'_>; 2] {
        let [march] = self.march();
        [march, (self.pass.layout(), self.pass.bind_group())]
    }

    pub fn texels(&self, texture: &wgpu::Texture) -> Vec<DVec4> {
        let texels: Vec<[u16; 4]> = gpu().read_texture(texture).expect("a table");
        let four = |t: [u16; 4]| DVec4::from_array(t.map(|bits| f16::from_bits(bits).to_f64()));
        texels.into_iter().map(four).collect()
    }

    fn texture(&self, texture: &wgpu::Texture) -> Texture {
        let size = texture.size();
        let size = [size.width, size.height, size.depth_or_array_layers].map(|n| n as usize);
        Texture { size, texels: self.texels(texture) }
    }
}

pub fn air_inputs(sun_degrees: f32, camera_altitude: f64) -> SkyInputs {
    let e = sun_degrees.to_radians();
    SkyInputs {
        kind: SkyKind::Atmosphere,
        sun_direction: Vec3::new(e.cos() * 0.6, e.sin(), e.cos() * 0.8).normalize(),
        sun_irradiance: 1.7,
        angular_diameter: 0.0093,
        camera_altitude,
        ground_albedo: Vec3::new(0.09, 0.11, 0.06),
        has_ground: true,
        sea_wind: None,
    }
}

/// A texture as the sampler reads it.
struct Texture {
    size: [usize; 3],
    texels: Vec<DVec4>,
}

impl Texture {
    /// At texture coordinates; of `shift` 1 to 3 a little farther along an axis.
    fn at(&self, place: [f64; 3], shift: usize) -> DVec3 {
        let axis = |i: usize| {
            let n = self.size[i];
            let beside = if shift == i + 1 { SHIFT } else { 0.0 };
            let at = (place[i] * n as f64 - 0.5 + beside).clamp(0.0, (n - 1) as f64);
            let low = (at as usize).min(n.saturating_sub(2));
            (low, (low + 1).min(n - 1), at - low as f64)
        };
        let [x, y, z] = [0, 1, 2].map(axis);
        let texel = |x, y, z| self.texels[(z * self.size[1] + y) * self.size[0] + x];
        let row = |j, k| DVec4::lerp(texel(x.0, j, k), texel(x.1, j, k), x.2);
        let plane = |k| DVec4::lerp(row(y.0, k), row(y.1, k), y.2);
        plane(z.0).lerp(plane(z.1), z.2).truncate()
    }
}

/// The functions of the shader in f64.
pub struct Twin {
    pub sky: SkyUniforms,
    ground: Texture,
    by_altitude: Texture,
    view: Texture,
    air_sources: Texture,
    air_depths: Texture,
}

impl Twin {
    pub fn new(made: &Made, inputs: &SkyInputs) -> Self {
        let t = made.pass.tables();
        Self {
            sky: SkyUniforms::new(inputs),
            ground: made.texture(&t.ground),
            by_altitude: made.texture(&t.altitude),
            view: made.texture(&t.view),
            air_sources: made.texture(&t.air_sources),
            air_depths: made.texture(&t.air_depths),
        }
    }

    pub fn sun(&self) -> DVec3 {
        let [x, y, z, _] = self.sky.sun.map(f64::from);
        DVec3::new(x, y, z)
    }

    pub fn irradiance(&self) -> f64 {
        self.sky.sun[3].into()
    }

    pub fn altitude(&self) -> f64 {
        self.sky.camera_altitude.into()
    }

    fn spans(&self) -> [f64; 2] {
        [self.sky.disc[2].into(), self.sky.disc[3].into()]
    }

    fn direction(&self, dir: DVec3) -> [f64; 2] {
        let (level, sun) = (DVec2::new(dir.x, dir.z), DVec2::new(self.sun().x, self.sun().z));
        let lengths = level.length() * sun.length();
        let azimuth = (level.dot(sun) / lengths.max(LEAST_LEVEL)).clamp(-1.0, 1.0);
        [azimuth, dir.y.atan2(level.length()) + f64::from(self.sky.horizon_dip)]
    }

    fn place(&self, dir: DVec3, size: [u32; 2]) -> DVec2 {
        let [azimuth, above] = self.direction(dir);
        let size = DVec2::new(size[0].into(), size[1].into());
        direction_place(azimuth, above, self.spans(), size)
    }

    fn radiance(&self, dir: DVec3, shift: usize) -> DVec3 {
        let place = self.place(dir, VIEW_SIZE);
        self.view.at([place.x, place.y, 0.0], shift) * self.irradiance() / TABLE_SCALE
    }

    fn disc(&self, dir: DVec3, shift: usize) -> DVec3 {
        let x = dir.distance(self.sun()) / f64::from(self.sky.disc[0]);
        if x >= 1.0 + DISC_RIM || self.direction(dir)[1] < 0.0 {
            return DVec3::ZERO;
        }
        let place = self.place(dir, [AIR_SIZE[0], AIR_SIZE[1]]);
        let last = texel_centre(1.0, AIR_SIZE[2].into());
        let depth = self.air_depths.at([place.y, last, 0.0], shift);
        (-depth).exp() * disc_profile(x) * f64::from(self.sky.disc[1]) * self.irradiance()
    }

    pub fn light_at(&self, altitude: f64, row: f64, shift: usize) -> DVec3 {
        let x = texel_centre(altitude_place(altitude), ALTITUDE_SIZE[0].into());
        let y = (row + 0.5) / f64::from(ALTITUDE_SIZE[1]);
        self.by_altitude.at([x, y, 0.0], shift) * self.irradiance() / TABLE_SCALE
    }

    fn below(&self, altitude: f64, shares: [f64; 2], shift: usize) -> DVec3 {
        let of = |row| self.light_at(altitude, row, shift);
        of(2.0) + shares[0] * of(3.0) + shares[1] * of(4.0)
    }

    /// Transmittance, and light.
    fn air(&self, dir: DVec3, distance: f64, shift: usize) -> [DVec3; 2] {
        let place = self.place(dir, [AIR_SIZE[0], AIR_SIZE[1]]);
        let outside = self.altitude() > TOP_ALTITUDE;
        let before = if outside { air_span(self.altitude(), dir.y).0 } else { 0.0 };
        let downwards = self.direction(dir)[1] < 0.0;
        let spread = air_spread(self.altitude(), dir.y, before, downwards);
        let w = air_place(distance - before, spread);
        let z = texel_centre(w, AIR_SIZE[2].into());
        // Axes of the flat table are the second and third of the other.
        let flat = if shift < 2 { 0 } else { shift - 1 };
        let depth = w * w * self.air_depths.at([place.y, z, 0.0], flat);
        let source = self.air_sources.at([place.x, place.y, z], shift);
        let opaque = DVec3::from_array(depth.to_array().map(|t| -(-t).exp_m1()));
        [(-depth).exp(), source * opaque * self.irradiance() / TABLE_SCALE]
    }

    /// Irradiance of the sun and of the sky where a ray meets the ground, and the cosine of the sun's zenith angle there.
    pub fn ground_light(&self, dir: DVec3, distance: f64, shift: usize) -> ([DVec3; 2], f64) {
        let turned =
            (PLANET_RADIUS + self.altitude()) * self.sun().y + distance * dir.dot(self.sun());
        let sun_mu = (turned / PLANET_RADIUS).clamp(-1.0, 1.0);
        let place = if sun_mu == 0.0 { 0.5 } else { sun_place(sun_mu) };
        let x = texel_centre(place, GROUND_SIZE[0].into());
        let scale = self.irradiance() / TABLE_SCALE;
        let row = |row: f64| {
            self.ground.at([x, (row + 0.5) / f64::from(GROUND_SIZE[1]), 0.0], shift) * scale
        };
        ([row(1.0), row(2.0)], sun_mu)
    }

    fn on_ground(&self, dir: DVec3, distance: f64, light: [f64; 3], shift: usize) -> DVec3 {
        let [direct, diffuse] = self.ground_light(dir, distance, shift).0;
        let by_clouds = self.light_at(0.0, 0.0, shift) * light[1];
        self.colour() / PI * (direct * light[0] + diffuse * light[2] + by_clouds)
    }

    pub fn colour(&self) -> DVec3 {
        let [r, g, b, _] = self.sky.ground_colour.map(f64::from);
        DVec3::new(r, g, b)
    }
}

fn rgb(v: DVec3) -> Four {
    [v.x, v.y, v.z, 0.0]
}

/// Directions everywhere, straight up and down, with the sun's azimuth and against it, near the horizon.
fn direction(random: &mut Random, sun: Vec3, dip: f64) -> [f32; 3] {
    let any = random.direction();
    let level = DVec3::new(any.x, 0.0, any.z).normalize();
    // Closer to it f32 decides on which side a ray is: a fiftieth of a pixel of the largest pictures.
    let beside = f64::from(magnitude(random, 3e-6, 1e-2));
    let near = dip + if random.bits().is_multiple_of(2) { beside } else { -beside };
    let v = match random.bits() % 16 {
        0 => DVec3::Y,
        1 => DVec3::NEG_Y,
        2 => sun.as_dvec3(),
        3 => -sun.as_dvec3(),
        4..=6 => level * near.cos() - DVec3::Y * near.sin(),
        _ => any,
    };
    v.as_vec3().to_array()
}

/// Altitudes by magnitude, and the ends of the air.
fn altitude(random: &mut Random) -> f32 {
    match random.bits() % 16 {
        0 => 0.0,
        1 => 1e5,
        2 => -10.0,
        _ => magnitude(random, 1e-3, 1e6),
    }
}

const DIR: &str = "vec3(x[0], x[1], x[2])";

fn vector(x: &[f64]) -> DVec3 {
    DVec3::new(x[0], x[1], x[2])
}

/// All functions for an eye at this altitude, the sun so high (degrees).
fn compare(sun_degrees: f32, eye: f64) {
    println!("sun {sun_degrees} degrees, eye {eye} m");
    let inputs = air_inputs(sun_degrees, eye);
    let made = Made::new(&inputs);
    let (twin, groups) = (Twin::new(&made, &inputs), made.groups());
    let dip = f64::from(twin.sky.horizon_dip);
    let directions = many(210, |r| direction(r, inputs.sun_direction, dip));
    Function::new(
        "sky::sky_direction",
        "#import cumuli::sky::sky_direction",
        &format!("vec4(sky_direction({DIR}), 0.0, 0.0)"),
    )
    .of_terms(1.0)
    .reading(&groups)
    .agrees(&directions, 16.0, |x| {
        let [azimuth, above] = twin.direction(vector(&x));
        [azimuth, above, 0.0, 0.0]
    });
    Function::new(
        "sky::sky_radiance",
        "#import cumuli::sky::sky_radiance",
        &format!("vec4(sky_radiance({DIR}), 0.0)"),
    )
    .reading(&groups)
    .agrees_filtered(&directions, 1024.0, SHIFTS, |i, x| rgb(twin.radiance(vector(&x), i)));
    Function::new(
        "sky::ground_distance",
        "#import cumuli::sky::ground_distance",
        &format!("vec4(ground_distance({DIR}), 0.0, 0.0, 0.0)"),
    )
    .reading(&groups)
    .agrees(&directions, 16.0, |x| one(distance_to_ground(twin.altitude(), x[1])));
    // Over the disc, its rim, and around it.
    let sun = inputs.sun_direction.as_dvec3();
    let discs = many(211, |r| {
        let away = r.direction() * r.between(0.0, 1.5) * f64::from(twin.sky.disc[0]);
        (sun + away).normalize().as_vec3().to_array()
    });
    Function::new(
        "sky::sun_disc_radiance",
        "#import cumuli::sky::sun_disc_radiance",
        &format!("vec4(sun_disc_radiance({DIR}), 0.0)"),
    )
    .reading(&groups)
    .agrees_filtered(&discs, 256.0, SHIFTS, |i, x| rgb(twin.disc(vector(&x), i)));
    let heights = many(212, |r| [altitude(r), (r.bits() % 5) as f32]);
    Function::new(
        "sky::light_at",
        "#import cumuli::sky::light_at",
        "vec4(light_at(x[0], x[1]), 0.0)",
    )
    .reading(&groups)
    .agrees_filtered(&heights, 256.0, SHIFTS, |i, [h, row]| rgb(twin.light_at(h, row.round(), i)));
    let ways: [(&str, &str, usize); 3] = [
        ("sky::sun_irradiance_at", "sun_irradiance_at", 0),
        ("sky::sky_ambient_above", "sky_ambient_above", 1),
        ("sky::sky_ambient_below", "sky_ambient_below", 2),
    ];
    for (name, function_name, row) in ways {
        let import = format!("#import cumuli::sky::{function_name}");
        let call = format!("vec4({function_name}(x[0]), 0.0)");
        Function::new(name, &import, &call).reading(&groups).agrees_filtered(
            &heights,
            256.0,
            SHIFTS,
            |i, [h, _]| {
                rgb(if row == 2 {
                    twin.below(h, [1.0; 2], i)
                } else {
                    twin.light_at(h, row as f64, i)
                })
            },
        );
    }
    let shares = many(213, |r| [altitude(r), r.uniform() as f32, r.uniform() as f32]);
    Function::new(
        "sky::sky_below",
        "#import cumuli::sky::sky_below",
        "vec4(sky_below(x[0], vec2(x[1], x[2])), 0.0)",
    )
    .reading(&groups)
    .agrees_filtered(&shares, 256.0, SHIFTS, |i, [h, a, b]| rgb(twin.below(h, [a, b], i)));
    let far = many(214, |r| {
        let [x, y, z] = direction(r, inputs.sun_direction, dip);
        let ground = distance_to_ground(twin.altitude(), y.into()) as f32;
        let distance = match r.bits() % 8 {
            0 => 0.0,
            1 => 1e30,
            2..=4 if ground > 0.0 => ground * r.uniform() as f32,
            _ => magnitude(r, 1e-2, 1e8),
        };
        [x, y, z, distance]
    });
    for (i, field) in ["transmittance", "inscatter"].into_iter().enumerate() {
        Function::new(
            &format!("sky::air_between, {field}"),
            "#import cumuli::sky::air_between",
            &format!("vec4(air_between({DIR}, x[3]).{field}, 0.0)"),
        )
        .reading(&groups)
        .agrees_filtered(&far, 1024.0, SHIFTS, |shift, x| {
            rgb(twin.air(vector(&x), x[3], shift)[i])
        });
    }
    let grounds = many(215, |r| {
        let [x, y, z] = direction(r, inputs.sun_direction, dip);
        let ground = distance_to_ground(twin.altitude(), y.into()) as f32;
        let distance = if ground > 0.0 { ground } else { magnitude(r, 1.0, 1e6) };
        [x, y, z, distance, r.uniform() as f32, r.uniform() as f32, r.uniform() as f32]
    });
    Function::new(
        "sky::ground_radiance",
        "#import cumuli::sky::ground_radiance",
        &format!("vec4(ground_radiance({DIR}, x[3], vec3(x[4], x[5], x[6])), 0.0)"),
    )
    .reading(&groups)
    .agrees_filtered(&grounds, 256.0, SHIFTS, |i, x| {
        rgb(twin.on_ground(vector(&x), x[3], [x[4], x[5], x[6]], i))
    });
}

#[test]
fn the_sky_from_the_air() {
    compare(12.0, 700.0);
}

#[test]
fn the_sky_from_orbit() {
    compare(40.0, 4e5);
}

#[test]
fn the_sky_after_sunset() {
    compare(-4.0, 2.0);
}

#[test]
fn a_uniform_sky() {
    let radiance = 0.37;
    let kind = SkyKind::Uniform { radiance };
    let inputs = SkyInputs { kind, sea_wind: Some(7.0), ..air_inputs(12.0, 700.0) };
    let made = Made::new(&inputs);
    let (twin, groups) = (Twin::new(&made, &inputs), made.groups());
    let (radiance, irradiance) = (f64::from(radiance), twin.irradiance());
    let directions = many(216, |r| {
        let [x, y, z] = direction(r, inputs.sun_direction, 0.0);
        [x, y, z, altitude(r)]
    });
    Function::new(
        "sky, uniform: is_uniform, sky_radiance, sun_irradiance_at, sky_ambient_above",
        "#import cumuli::sky::{is_uniform, sky_ambient_above, sky_radiance, sun_irradiance_at}",
        &format!(
            "vec4(f32(is_uniform(x[1])), sky_radiance({DIR}).g, sun_irradiance_at(x[3]).b,
                sky_ambient_above(x[3]).r)"
        ),
    )
    .reading(&groups)
    .agrees(&directions, 0.0, |_| [1.0, radiance, irradiance, radiance]);
    Function::new(
        "sky, uniform: air_between",
        "#import cumuli::sky::air_between",
        &format!(
            "vec4(air_between({DIR}, x[3]).transmittance, air_between({DIR}, x[3]).inscatter.g)"
        ),
    )
    .reading(&groups)
    .agrees(&directions, 0.0, |_| [1.0, 1.0, 1.0, 0.0]);
    let sea = twin.sky.sea.map(f64::from);
    let shares = many(217, |r| [altitude(r), r.uniform() as f32, r.uniform() as f32]);
    Function::new(
        "sky, uniform: sky_below",
        "#import cumuli::sky::sky_below",
        "vec4(sky_below(x[0], vec2(x[1], x[2])), 0.0)",
    )
    .reading(&groups)
    .agrees(&shares, 16.0, |[_, a, b]| {
        let (sun, sky) = (a * irradiance * twin.sun().y.max(0.0) / PI, b * radiance);
        rgb(twin.colour() * (sun + sky) + (1.0 - twin.colour()) * (sea[2] * sun + sea[1] * sky))
    });
    let grounds = many(218, |r| {
        let [x, y, z] = direction(r, inputs.sun_direction, 0.0);
        [
            x,
            y,
            z,
            magnitude(r, 1.0, 1e6),
            r.uniform() as f32,
            r.uniform() as f32,
            r.uniform() as f32,
        ]
    });
    Function::new(
        "sky, uniform: ground_radiance",
        "#import cumuli::sky::ground_radiance",
        &format!("vec4(ground_radiance({DIR}, x[3], vec3(x[4], x[5], x[6])), 0.0)"),
    )
    .reading(&groups)
    .agrees(&grounds, 16.0, |x| {
        let turned =
            (PLANET_RADIUS + twin.altitude()) * twin.sun().y + x[3] * vector(&x).dot(twin.sun());
        let level = (turned / PLANET_RADIUS).clamp(0.0, 1.0) * x[4] + x[5];
        rgb(twin.colour() * (irradiance / PI * level + radiance * x[6]))
    });
}
