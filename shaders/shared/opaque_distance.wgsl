// How far the host's opaque things are: in every pixel along its ray, as opaque.wgsl has written it. Its binding
// lies before those of sun_depth in every pass that imports both.
#define_import_path cumuli::opaque_distance

#import cumuli::gpu_data::block_pixel

// Where there is nothing; no real distance comes near it.
const NOTHING: f32 = 1e30;
// Distances of two pixels that differ by more than this share of the smaller one are of two things: what is between
// them is not to be taken from both.
const EDGE: f32 = 0.05;

// One texel of NOTHING where the host has no opaque things.
@group(0) @binding(19) var opaque_distances: texture_2d<f32>;

// m.
fn opaque_distance(pixel: vec2<u32>) -> f32 {
    return textureLoad(opaque_distances, min(pixel, textureDimensions(opaque_distances) - 1u), 0).r;
}

// Whether one of the four pixels of this phase around a pixel is of another thing than the pixel itself.
fn beside_edge(pixel: vec2<u32>, size: vec2<u32>, stride: u32, phase: u32) -> bool {
    let first = block_pixel(phase);
    let last = vec2<i32>((size - 1u - first) / stride);
    let low = vec2<i32>(floor((vec2<f32>(pixel) - vec2<f32>(first)) / f32(stride)));
    let own = opaque_distance(pixel);
    var result = false;
    for (var corner = 0; corner < 4; corner++) {
        let block = clamp(low + vec2(corner & 1, corner >> 1u), vec2(0), last);
        let there = opaque_distance(vec2<u32>(block) * stride + first);
        result = result || abs(there - own) > EDGE * min(there, own);
    }
    return result;
}
