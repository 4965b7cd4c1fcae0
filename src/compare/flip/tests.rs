use super::*;
use crate::frame::cpu::tonemap::srgb;
use crate::reference::Random;

const SIZE: [u32; 2] = [67, 45];

/// 8-bit pictures with edges, gradients and noise.
fn picture(seed: u64) -> Vec<[u8; 3]> {
    let mut random = Random::new(seed, 0, 0);
    (0..SIZE[0] * SIZE[1])
        .map(|i| {
            let (x, y) = (i % SIZE[0], i / SIZE[0]);
            let disc = (x as f64 - 30.0).hypot(y as f64 - 20.0 - seed as f64) < 12.0;
            let base = [3 * x, 5 * y, if disc { 220 } else { 40 }];
            let noise = 40.0 * seed as f64 * (random.unit() - 0.5);
            base.map(|v| (f64::from(v) + noise).clamp(0.0, 255.0) as u8)
        })
        .collect()
}

/// The inverse of the sRGB transfer function, by bisection of the forward one.
fn linear(byte: u8) -> f64 {
    let wanted = f64::from(byte) / 255.0;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if srgb(middle) < wanted { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

fn decoded(bytes: &[[u8; 3]]) -> Vec<DVec3> {
    bytes.iter().map(|p| DVec3::from_array(p.map(linear))).collect()
}

#[test]
fn agrees_with_the_authors_implementation() {
    let [a, b] = [picture(1), picture(3)];
    let ours = flip(&decoded(&a), &decoded(&b), SIZE, PIXELS_PER_DEGREE);
    let theirs = nv_flip::flip(
        nv_flip::FlipImageRgb8::with_data(SIZE[0], SIZE[1], b.as_flattened()),
        nv_flip::FlipImageRgb8::with_data(SIZE[0], SIZE[1], a.as_flattened()),
        nv_flip::DEFAULT_PIXELS_PER_DEGREE,
    );
    let mean = ours.iter().sum::<f64>() / ours.len() as f64;
    let pool = nv_flip::FlipPool::from_image(&theirs);
    // Theirs works in f32.
    assert!((mean - f64::from(pool.mean())).abs() < 1e-4, "{mean} {}", pool.mean());
    assert!(mean > 0.05, "the pictures differ: {mean}");
    let values = theirs.to_vec();
    let worst =
        ours.iter().zip(&values).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
    assert!(worst < 2e-3, "{worst}");
}

#[test]
fn the_same_picture_differs_nowhere() {
    let a = decoded(&picture(2));
    assert!(flip(&a, &a, SIZE, PIXELS_PER_DEGREE).iter().all(|e| *e == 0.0));
    let bright: Vec<_> = a.iter().map(|v| *v * 1e4).collect();
    let same = hdr_flip(&bright, &bright, SIZE, PIXELS_PER_DEGREE).expect("light");
    assert!(same.iter().all(|e| *e == 0.0));
}

/// Black against white is as different as can be, wherever there is no edge.
#[test]
fn black_and_white_are_farthest_apart() {
    let count = (SIZE[0] * SIZE[1]) as usize;
    let errors = flip(&vec![DVec3::ZERO; count], &vec![DVec3::ONE; count], SIZE, PIXELS_PER_DEGREE);
    // The scale's end is the distance of pure green and blue, 308; white is 100 from black: by
    // the published formula 0.95 + 0.05 * ((100^0.7 / 308.07^0.7) - 0.4) / 0.6.
    let spaces = Spaces::new();
    let far = hybrid_distance(spaces.hunt_lab(DVec3::Y), spaces.hunt_lab(DVec3::Z));
    let expected = 0.95 + 0.05 * ((100.0 / far).powf(0.7) - 0.4) / 0.6;
    for error in errors {
        assert!((error - expected).abs() < 1e-6, "{error} {expected} {far}");
    }
}

/// The unit of radiance is nobody's business.
#[test]
fn exposures_follow_the_reference() {
    let [a, b] = [decoded(&picture(1)), decoded(&picture(3))];
    let scaled = |v: &[DVec3], by: f64| v.iter().map(|v| *v * by).collect::<Vec<_>>();
    let first = hdr_flip(&a, &b, SIZE, PIXELS_PER_DEGREE).expect("light");
    // A power of two changes no digit; another factor rounds.
    let second =
        hdr_flip(&scaled(&a, 1.0 / 64.0), &scaled(&b, 1.0 / 64.0), SIZE, PIXELS_PER_DEGREE)
            .expect("light");
    for (x, y) in first.iter().zip(&second) {
        assert!((x - y).abs() < 1e-9);
    }
    // What shows in dark parts only shows in a long exposure.
    let ldr = flip(&a, &b, SIZE, PIXELS_PER_DEGREE);
    assert!(first.iter().sum::<f64>() > ldr.iter().sum::<f64>());
    let count = a.len();
    assert!(hdr_flip(&a, &vec![DVec3::ZERO; count], SIZE, PIXELS_PER_DEGREE).is_none());
}
