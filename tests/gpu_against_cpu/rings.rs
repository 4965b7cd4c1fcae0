//! The particles that `rings.wgsl` makes against those of its twin.

use cumuli::frame::cpu;
use cumuli::frame::gpu_data::{CloudUniforms, Particle, ParticleCount};
use cumuli::frame::rings::{FieldShape, PlacedField, RingPass, particle_count_buffer};
use cumuli::frame::scan::ScanPass;
use cumuli::frame::weather::WeatherBuffer;
use cumuli::gpu::buffers;
use cumuli::scene::CloudField;
use glam::DVec3;

use crate::common::{gpu, library, submit};

pub const SHAPES: [FieldShape; 3] = [
    FieldShape { index: 1, mean_density: 0.3 },
    FieldShape { index: 0, mean_density: 1.0 },
    FieldShape { index: 4, mean_density: 0.17 },
];
/// Slots before the field's own, and a mark in them and behind the last.
pub const FIRST_SLOT: u32 = 3;
const UNTOUCHED: u32 = 0xabad_cafe;
const TEN_YEARS: f64 = 10.0 * 365.25 * 86400.0;

fn on_device(field: &PlacedField) -> (ParticleCount, Vec<Particle>) {
    let clouds = &field.uniforms;
    let mut weather = WeatherBuffer::new(gpu());
    weather.hold(gpu(), field.weather.as_ref());
    let scan = ScanPass::new(gpu(), library()).expect("the scan");
    let rings = RingPass::new(gpu(), library(), weather.layout()).expect("the rings");
    // One slot more than the pass may fill.
    let slots = clouds.capacity as usize + 1;
    let marks = vec![UNTOUCHED; slots * size_of::<Particle>() / size_of::<u32>()];
    let particles = buffers::storage_with(gpu(), "particles", &marks);
    let count = particle_count_buffer(gpu(), 0);
    let job = rings.job(gpu(), &scan, clouds.columns, &particles, &count);
    submit(|pass| rings.encode(gpu(), pass, &scan, (&job, field), &weather));
    let count = gpu().read_buffer::<ParticleCount>(&count, 1).expect("the count")[0];
    (count, gpu().read_buffer(&particles, slots).expect("particles"))
}

pub fn small_field() -> CloudField {
    CloudField { cells: 24, rings: 3, layers: 5, coverage: 0.4, ..CloudField::default() }
}

/// Largest difference of two particles of the same cell, each part in units of what it may be.
fn difference(clouds: &CloudUniforms, a: &Particle, b: &Particle) -> f32 {
    // The coverage noise has a rounding of some 1e-6 (see noise.rs). It becomes a height by the
    // factor 2 x thickness x inverse_range, and growth by that over the height of a layer.
    let height = 4e-6 * 2.0 * clouds.thickness * clouds.inverse_range;
    let growth = height / clouds.ring[0].layer_height + 1e-6;
    // Radius goes with the square root of growth, which is above 0.2, and as 0.6 of the height.
    let radius = clouds.particle_size * clouds.ring[2].cell_size * 1.2 * growth + 0.6 * height;
    // Places come from sums of numbers up to the reach of the field, or from the altitude of the
    // base below the camera; where the radius lifts the centre, from it.
    let place = 4e-7 * (clouds.ring[2].fade_out[1] + clouds.base.abs()) + radius;
    // smoothstep rises by 1.5 over the share of growth, or of the radius, where it acts; at least
    // a quarter of the largest.
    let smallest = clouds.particle_size * clouds.ring[0].cell_size;
    let opacity = 1.5 * (growth / 0.25 + radius / (0.25 * smallest)) + 1e-5;
    let far = |a: &[f32], b: &[f32], unit: f32| {
        a.iter().zip(b).map(|(a, b)| (a - b).abs() / unit).fold(0.0, f32::max)
    };
    far(&a.centre, &b.centre, place)
        .max(far(&[a.radius], &[b.radius], radius))
        // As explained for `uniform_rotation` in numerics.rs.
        .max(far(&a.orientation, &b.orientation, 1e-5))
        .max(far(&[a.extinction], &[b.extinction], opacity * clouds.extinction))
        .max(far(
            &[a.optical_radius],
            &[b.optical_radius],
            opacity * clouds.extinction * b.radius + radius * b.extinction,
        ))
}

/// Compares a field's particles from the device with those of the twin.
pub fn compare(name: &str, field: &PlacedField) {
    let clouds = &field.uniforms;
    let (count, slots) = on_device(field);
    let twins = cpu::rings::particles(field);
    assert!(twins.len() > 200, "{name}: too few particles to tell: {}", twins.len());
    let found = count.particles as usize;
    assert_eq!(count.particles, count.wanted, "{name}");
    let mark = |p: &Particle| bytemuck::bytes_of(p) == bytemuck::bytes_of(&[UNTOUCHED; 12]);
    assert!(slots[..FIRST_SLOT as usize].iter().all(mark), "{name}: wrote before its first slot");
    assert!(slots[found..].iter().all(mark), "{name}: wrote behind its last particle");

    // Same particles in the same order. One at the very edge of being left out may be in one list
    // alone: growth, radius and cross-fade all let extinction vanish there.
    let faint = 1e-3 * clouds.extinction;
    let mut missing = 0_u32;
    let mut own = slots[FIRST_SLOT as usize..found].iter().peekable();
    let mut twins = twins.iter().peekable();
    while let (Some(&a), Some(&b)) = (own.peek(), twins.peek()) {
        if a.id == b.id {
            assert_eq!(a.shape, b.shape, "{name}: shape of {:#x}", a.id);
            let off = difference(clouds, a, b);
            assert!(off <= 1.0, "{name}: {off} times what may be: {a:?} for {b:?}");
            own.next();
            twins.next();
        } else {
            let fainter = if a.extinction < b.extinction { own.next() } else { twins.next() };
            let fainter = fainter.expect("peeked");
            assert!(fainter.extinction < faint, "{name}: {fainter:?} stands alone");
            missing += 1;
        }
    }
    assert!(own.chain(twins).all(|p| p.extinction < faint), "{name}: the lists end differently");
    // The share of particles this close to an edge is the rounding of growth itself, 1e-5 to 3e-4 (see `difference`).
    let most = (1e-4 * (found - FIRST_SLOT as usize) as f64).max(2.0);
    assert!(f64::from(missing) <= most, "{name}: {missing} particles of {found} in one list alone");
}

#[test]
fn particles_are_those_of_the_twin() {
    let default = small_field();
    let other = CloudField {
        seed: 0xdead_beef,
        base: 300.0,
        thickness: 2500.0,
        feature_size: 700.0,
        cell_size: 90.0,
        wind: DVec3::new(-17.0, 0.0, 8.0),
        ..small_field()
    };
    let origin = DVec3::new(0.0, 1.7, 0.0);
    let cases = [
        ("at the origin", &default, origin, 0.0),
        ("another field in a storm", &other, DVec3::new(-123.4, 900.0, 77.7), 3600.5),
        ("10,000 km away", &default, DVec3::new(1e7, 500.0, -7e6), 12.0),
        ("ten years later", &default, origin, TEN_YEARS),
        ("before time began", &other, origin, -TEN_YEARS),
        // Cell numbers pass 2^31 and wrap.
        ("beyond all cell numbers", &default, DVec3::new(-2e11, 0.0, 3e11), 1.0),
        ("above the clouds", &default, DVec3::new(5.0, 12_000.0, 9.0), 60.0),
    ];
    for (name, field, camera, time) in cases {
        compare(name, &PlacedField::new(field, camera, time, &SHAPES, FIRST_SLOT, 1 << 13));
    }
}

#[test]
fn noise_that_is_given_up_would_have_made_nothing() {
    // The device ends a sum of octaves that cannot reach what grows at an altitude; the twin ends none. Clear, half and
    // wholly covered skies of flat, plain and tall clouds, with one layer and many.
    for coverage in [0.1, 0.5, 1.0] {
        for (thickness, layers) in [(60.0, 1), (60.0, 3), (700.0, 3), (4000.0, 16)] {
            let feature_size = 500.0 + 3.0 * thickness;
            let field = CloudField {
                coverage,
                thickness,
                layers,
                feature_size,
                cells: 96,
                ..small_field()
            };
            let name = format!("coverage {coverage}, {layers} layers of {thickness} m");
            let eye = DVec3::new(10.0, 30.0, 5.0);
            compare(&name, &PlacedField::new(&field, eye, 40.0, &SHAPES, FIRST_SLOT, 1 << 18));
        }
    }
}

#[test]
fn capacity_cuts_and_is_reported() {
    let all = PlacedField::new(&small_field(), DVec3::Y, 0.0, &SHAPES, FIRST_SLOT, 1 << 13);
    let (whole, slots) = on_device(&all);
    let room = whole.particles / 2;
    let uniforms = CloudUniforms { capacity: room, ..all.uniforms };
    let (cut, few) = on_device(&PlacedField { uniforms, ..all });
    assert_eq!((cut.particles, cut.wanted), (room, whole.wanted));
    assert_eq!(few[..room as usize], slots[..room as usize], "the first ones stay as they are");
    let behind = bytemuck::cast_slice::<_, u32>(&few[room as usize..]);
    assert!(behind.iter().all(|w| *w == UNTOUCHED), "wrote beyond the capacity");
}
