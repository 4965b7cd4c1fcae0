// Tone map: linear radiance to display values. Twin: src/frame/cpu/tonemap.rs.
//
// Workgroup contract: one invocation owns one pixel.
#import cumuli::gpu_data::FrameUniforms
#import cumuli::noise::{hash, hash_combine, unit_float}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var display: texture_storage_2d<rgba8unorm, write>;

// ACES reference rendering transform and sRGB output transform, in Stephen Hill's fit (2016).
fn aces(linear: vec3<f32>) -> vec3<f32> {
    let input = mat3x3<f32>(
        vec3(0.59719, 0.07600, 0.02840),
        vec3(0.35458, 0.90834, 0.13383),
        vec3(0.04823, 0.01566, 0.83777),
    );
    let output = mat3x3<f32>(
        vec3(1.60475, -0.10208, -0.00327),
        vec3(-0.53108, 1.10813, -0.07276),
        vec3(-0.07367, -0.00605, 1.07602),
    );
    let v = input * linear;
    let a = v * (v + 0.0245786) - 0.000090537;
    let b = v * (0.983729 * v + 0.4329510) + 0.238081;
    return saturate(output * (a / b));
}

fn srgb(linear: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3(0.0031308));
}

@compute @workgroup_size(8, 8)
fn tonemap(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= frame.size) {
        return;
    }
    // Radiance beyond f16 is far in the shoulder of the curve: the bound keeps v * v finite.
    let linear = clamp(textureLoad(picture, id.xy, 0).rgb * frame.exposure, vec3(0.0), vec3(65504.0));
    // Triangular dither of one 8-bit step hides the steps of smooth skies.
    let h = hash_combine(hash_combine(0u, id.x), id.y);
    let dither = (unit_float(h) + unit_float(hash(h)) - 1.0) / 255.0;
    textureStore(display, id.xy, vec4(saturate(srgb(aces(linear)) + dither), 1.0));
}
