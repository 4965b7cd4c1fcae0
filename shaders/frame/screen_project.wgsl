// Screen projection: which particles are in view, which screen tiles they touch, and the key that
// sorts them from the eye. Twin: src/frame/cpu/screen_project.rs.
//
// What lies behind all that is opaque in its tiles is not in view.
//
// Workgroup contract: one invocation owns one particle slot and writes its key, value and rectangle.
#import cumuli::gpu_data::{FrameUniforms, Particle}
#import cumuli::numerics::sortable

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<storage, read> particles: array<Particle>;
@group(0) @binding(2) var<storage, read_write> keys: array<u32>;
@group(0) @binding(3) var<storage, read_write> values: array<u32>;
@group(0) @binding(4) var<storage, read_write> rectangles: array<vec2<u32>>; // x: first tile, y: one past the last; x in the low half
@group(0) @binding(5) var<storage, read> particle_count: array<u32>; // ParticleCount: its first word
@group(0) @binding(6) var<storage, read_write> visible: array<atomic<u32>>; // a sum: its order cannot matter
@group(0) @binding(7) var<storage, read_write> nearest: array<u32>;  // the key, which stays where it is when keys are sorted
@group(0) @binding(8) var tile_limits: texture_2d<u32>;              // keys beyond which nothing is seen; one texel where that is nowhere
@group(0) @binding(9) var bin_limits: texture_2d<u32>;

const NOT_SEEN: u32 = 0xffffffffu;
const BIN: u32 = 8u; // tiles a side
// Tiles of a rectangle up to which each of them is asked; of larger ones their bins.
const FEW_TILES: u32 = 64u;
const TILE: f32 = f32(#{SCREEN_TILE}); // blocks a side
// A tangent beyond every picture's edge: the widest field of view ends at 115.
const EVERYTHING: f32 = 1e30;

// Bounds of a sphere's picture along one image axis, in tangents of the angle from the view axis:
// the lines through the eye that touch the circle (x, z, radius).
fn tangent_bounds(x: f32, z: f32, radius: f32) -> vec2<f32> {
    let reach2 = x * x + z * z - radius * radius;
    if reach2 <= 0.0 {
        return vec2(-EVERYTHING, EVERYTHING);
    }
    let reach = sqrt(reach2);
    let low = z * reach + x * radius;
    let high = z * reach - x * radius;
    // A denominator that is not positive: the touching line lies beside or behind the eye.
    return vec2(
        select(-EVERYTHING, (x * reach - z * radius) / low, low > 0.0),
        select(EVERYTHING, (x * reach + z * radius) / high, high > 0.0),
    );
}

// Whether all tiles of a rectangle end before this key.
fn is_hidden(first: vec2<u32>, last: vec2<u32>, key: u32) -> bool {
    let size = last - first;
    let few = size.x * size.y <= FEW_TILES;
    let side = select(BIN, 1u, few);
    let end = (last - 1u) / side;
    for (var y = first.y / side; y <= end.y; y++) {
        for (var x = first.x / side; x <= end.x; x++) {
            let of_tile = textureLoad(tile_limits, min(vec2(x, y), textureDimensions(tile_limits) - 1u), 0).r;
            let of_bin = textureLoad(bin_limits, min(vec2(x, y), textureDimensions(bin_limits) - 1u), 0).r;
            if key <= select(of_bin, of_tile, few) {
                return false;
            }
        }
    }
    return true;
}

@compute @workgroup_size(64)
fn project(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.particle_capacity {
        return;
    }
    values[id.x] = id.x;
    keys[id.x] = NOT_SEEN;
    rectangles[id.x] = vec2(0u, 0u);
    if id.x >= particle_count[0] {
        return;
    }
    let particle = particles[id.x];
    let c = particle.centre;
    let r = particle.radius;
    let tan_x = length(frame.right.xyz);
    let tan_y = length(frame.up.xyz);
    let z = dot(c, frame.forward.xyz);
    if z + r <= 0.0 || particle.extinction <= 0.0 {
        return;
    }
    let bx = tangent_bounds(dot(c, frame.right.xyz) / tan_x, z, r) / tan_x;
    let by = tangent_bounds(dot(c, frame.up.xyz) / tan_y, z, r) / tan_y;
    if bx.x >= 1.0 || bx.y <= -1.0 || by.x >= 1.0 || by.y <= -1.0 {
        return;
    }
    let size = vec2<f32>(frame.size) / f32(frame.stride); // blocks
    let ndc_low = clamp(vec2(bx.x, -by.y), vec2(-1.0), vec2(1.0));
    let ndc_high = clamp(vec2(bx.y, -by.x), vec2(-1.0), vec2(1.0));
    let low = floor((ndc_low * 0.5 + 0.5) * size / TILE);
    let high = floor((ndc_high * 0.5 + 0.5) * size / TILE) + 1.0;
    let first = min(vec2<u32>(low), frame.tiles);
    let last = min(vec2<u32>(high), frame.tiles);
    if any(first >= last) {
        return;
    }
    let key = sortable(max(length(c) - r, 0.0));
    if is_hidden(first, last, key) {
        return;
    }
    nearest[id.x] = key;
    rectangles[id.x] = vec2(first.x | (first.y << 16u), last.x | (last.y << 16u));
    keys[id.x] = key;
    atomicAdd(&visible[0], 1u);
}
