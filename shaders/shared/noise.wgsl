// Integer hashes and gradient noise on a lattice of integers: exact wherever the camera is.
// Twin: src/frame/cpu/noise.rs.
#define_import_path cumuli::noise

// Chris Wellons' lowbias32 (2018): a bijection with bias 0.17 of ideal.
fn hash(value: u32) -> u32 {
    var h = value;
    h ^= h >> 16u;
    h *= 0x7feb352du;
    h ^= h >> 15u;
    h *= 0x846ca68bu;
    h ^= h >> 16u;
    return h;
}

fn hash_combine(seed: u32, value: u32) -> u32 {
    return hash(seed ^ (value + 0x9e3779b9u + (seed << 6u) + (seed >> 2u)));
}

// 2^-24: a step of f32 below 1, so the products are exact.
const STEP_OF_24_BITS: f32 = 5.9604645e-8;

// Uniform in [0, 1) from the upper 24 bits.
fn unit_float(h: u32) -> f32 {
    return f32(h >> 8u) * STEP_OF_24_BITS;
}

// Dot product of the offset with a gradient of three components in [-1, 1] taken from a hash.
fn lattice_gradient(h: u32, offset: vec3<f32>) -> f32 {
    let bits = vec3<u32>(h & 1023u, (h >> 10u) & 1023u, (h >> 20u) & 1023u);
    return dot(vec3<f32>(bits) * (2.0 / 1023.0) - 1.0, offset);
}

// Gradient noise at lattice cell `cell` and fraction `f` in [0, 1]^3: continuous, with continuous
// first and second derivatives, mean 0, inside [-1.5, 1.5].
fn gradient_noise(seed: u32, cell: vec3<i32>, f: vec3<f32>) -> f32 {
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let c = bitcast<vec3<u32>>(cell);
    let x0 = hash_combine(seed, c.x);
    let x1 = hash_combine(seed, c.x + 1u);
    let x0y0 = hash_combine(x0, c.y);
    let x0y1 = hash_combine(x0, c.y + 1u);
    let x1y0 = hash_combine(x1, c.y);
    let x1y1 = hash_combine(x1, c.y + 1u);
    let near = mix(
        mix(
            lattice_gradient(hash_combine(x0y0, c.z), f),
            lattice_gradient(hash_combine(x1y0, c.z), f - vec3(1.0, 0.0, 0.0)),
            w.x,
        ),
        mix(
            lattice_gradient(hash_combine(x0y1, c.z), f - vec3(0.0, 1.0, 0.0)),
            lattice_gradient(hash_combine(x1y1, c.z), f - vec3(1.0, 1.0, 0.0)),
            w.x,
        ),
        w.y,
    );
    let far = mix(
        mix(
            lattice_gradient(hash_combine(x0y0, c.z + 1u), f - vec3(0.0, 0.0, 1.0)),
            lattice_gradient(hash_combine(x1y0, c.z + 1u), f - vec3(1.0, 0.0, 1.0)),
            w.x,
        ),
        mix(
            lattice_gradient(hash_combine(x0y1, c.z + 1u), f - vec3(0.0, 1.0, 1.0)),
            lattice_gradient(hash_combine(x1y1, c.z + 1u), f - vec3(1.0, 1.0, 1.0)),
            w.x,
        ),
        w.y,
    );
    return mix(near, far, w.z);
}
