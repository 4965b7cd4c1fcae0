// Optical depth towards the sun at any place, from the deep shadow maps. Its two bindings are the last
// of the group of every pass that imports it. Twin: src/frame/cpu/shadow.rs.
#define_import_path cumuli::sun_depth

#import cumuli::numerics::unfolded
#import cumuli::shadow_maps::{BORDER, MOST_DEPTH, ShadowUniforms, nodes_depth, unpack_nodes}

// Not arguments of functions: a copy of the maps costs more than the look-up.
@group(0) @binding(20) var<uniform> shadow_maps: ShadowUniforms;
@group(0) @binding(21) var<storage, read> shadow_texels: array<vec4<u32>>;

fn texel_depth(index: u32, at: f32) -> f32 {
    return nodes_depth(unpack_nodes(shadow_texels[index]), at);
}

// Scaled optical depth from a point (m, relative to the camera) to the sun; 0 off the maps. Depths, not
// transmittances, are interpolated: the mean of what neighbours let through is brighter than what is
// between them.
fn sun_depth(point: vec3<f32>) -> f32 {
    let place = vec2(dot(point, shadow_maps.axis_u.xyz), dot(point, shadow_maps.axis_v.xyz));
    let along = -dot(point, shadow_maps.towards.xyz);
    let last = f32(shadow_maps.resolution) - 1.0;
    let maps = unfolded(shadow_maps.maps, arrayLength(&shadow_texels) == 0u);
    for (var m = 0u; m < maps; m++) {
        let corner = shadow_maps.corner[m];
        let texel = (place - corner.xy) / corner.z - 0.5;
        let margin = min(texel, last - texel);
        let range = shadow_maps.range[m];
        if min(margin.x, margin.y) >= BORDER && along >= range.z && along <= range.w {
            let at = (along - range.x) / range.y;
            let first = floor(texel);
            let share = texel - first;
            let low = vec2<u32>(first);
            let row = shadow_maps.resolution;
            let index = (m * row + low.y) * row + low.x;
            let depths = min(vec4(
                texel_depth(index, at), texel_depth(index + 1u, at),
                texel_depth(index + row, at), texel_depth(index + row + 1u, at),
            ), vec4(MOST_DEPTH));
            return mix(mix(depths.x, depths.y, share.x), mix(depths.z, depths.w, share.x), share.y);
        }
    }
    return 0.0;
}
