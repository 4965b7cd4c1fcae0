// Deep shadow maps: pictures of the clouds from the sun, nested around the camera, whose texels hold
// where along the sun's ray each of a few optical depths is reached (after Lokovic and Veach 2000,
// with the function turned round: its nodes lie where the light fades, wherever that is).
// Twin: src/frame/cpu/shadow.rs.
//
// Depths along the ray count away from the sun, from the plane through the camera.
#define_import_path cumuli::shadow_maps

const MAPS: u32 = 8u;

struct ShadowUniforms {
    axis_u: vec4<f32>,           // xyz: maps' x axis, world
    axis_v: vec4<f32>,           // xyz: maps' y axis, world
    towards: vec4<f32>,          // xyz: towards the sun
    corner: array<vec4<f32>, 8>, // xy: m, corner relative to the camera; z: m, a texel; fine to coarse
    range: array<vec4<f32>, 8>,  // x: m, where each map's nodes begin; y: m, from there to where they end; z, w: m, the same two places where matter lies beyond, else infinitely far
    nearest: f32,                // m, where matter begins
    reach: f32,                  // m, from there to where it ends
    lowest: f32,                 // m, altitudes of what is shadowed, relative to the camera
    highest: f32,
    resolution: u32,             // texels a side
    maps: u32,
    seen_only: u32,              // 1: only what the picture may show is made
    anywhere: u32,               // 1: what is shadowed may lie anywhere behind matter
}

// The air is shadowed so far below the lowest of what else is (m): for rays that meet the ground farther out than a
// flat one would be.
const AIR_BELOW: f32 = 500.0;
// It is no farther from the eye than so many sides of the coarsest map, and all matter along the sun's rays.
const AIR_SIDES: f32 = 4.0;

// Optical depths of a texel's nodes, and from each to the next; before the first and beyond the last
// it goes on as it was. The first is no less than a veil: a thin one far before a cloud would draw
// the node away from where the light fades.
const NODES_LOW = vec4<f32>(0.02, 0.25, 0.6, 1.1);
const NODES_HIGH = vec3<f32>(1.8, 3.0, 5.0);
const STEPS_LOW = vec4<f32>(0.23, 0.35, 0.5, 0.7);
const STEPS_HIGH = vec3<f32>(1.2, 2.0, 3.0);
// Optical depth at which the march ends; where it is reached is the eighth node of deep columns.
const ENOUGH: f32 = 8.0;
// Least distance of two nodes in units of a map's range: half of what a texel can hold.
const LEAST_GAP: f32 = 7.6e-6;
// Depth beyond which there is no sun: least transmittance of f32 is not reached.
const DARKEST: f32 = 80.0;
// Depth of a texel beyond which it counts as no deeper, so that a neighbour in full light keeps some.
#ifdef OCTAVES
// Octaves see light through more.
const MOST_DEPTH: f32 = DARKEST;
#else
const MOST_DEPTH: f32 = 20.0;
#endif
// Texels at the border of a map that the next one shows.
const BORDER: f32 = 1.5;

// Where the nodes lie, in units of the map's range from its begin on. high.w: of columns that reach the seventh
// half the place of the eighth; of the others 1/2 and half the transmittance of all their matter.
struct ShadowNodes {
    low: vec4<f32>,
    high: vec4<f32>,
}

fn pack_nodes(nodes: ShadowNodes) -> vec4<u32> {
    return vec4(
        pack2x16unorm(nodes.low.xy), pack2x16unorm(nodes.low.zw),
        pack2x16unorm(nodes.high.xy), pack2x16unorm(nodes.high.zw),
    );
}

fn unpack_nodes(texel: vec4<u32>) -> ShadowNodes {
    return ShadowNodes(
        vec4(unpack2x16unorm(texel.x), unpack2x16unorm(texel.y)),
        vec4(unpack2x16unorm(texel.z), unpack2x16unorm(texel.w)),
    );
}

// Optical depth at a place of a texel.
fn nodes_depth(nodes: ShadowNodes, at: f32) -> f32 {
    let is_deep = nodes.high.w < 0.5;
    let all = select(-log(max(2.0 * nodes.high.w - 1.0, exp(-DARKEST))), DARKEST, is_deep);
    let next = vec4(nodes.low.yzw, nodes.high.x);
    let gaps_low = max(next - nodes.low, vec4(LEAST_GAP));
    if all <= NODES_LOW.x {
        // A veil: from its beginning to its end.
        return all * saturate((at - nodes.low.x) / gaps_low.x);
    }
    let low = clamp((at - nodes.low) / gaps_low, vec4(-NODES_LOW.x / STEPS_LOW.x, 0.0, 0.0, 0.0), vec4(1.0));
    // Beyond the last node it goes on as before it.
    let gaps = max(vec3(nodes.high.yz, 2.0 * nodes.high.w) - nodes.high.xyz, vec3(LEAST_GAP));
    let high = clamp((at - nodes.high.xyz) / gaps, vec3(0.0), vec3(1.0, 1.0, DARKEST));
    return min(NODES_LOW.x + dot(low, STEPS_LOW) + dot(high, STEPS_HIGH), all);
}
