//! What every number of a frame's buffers and textures may be. Names are those of the shaders
//! (`Struct.field`, or `kernel.binding`); a number without a rule is refused, and a test tells of
//! rules without a number, so the list can't fall behind the shaders.

/// What a float may be, besides finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Float {
    /// Anything.
    Any,
    /// Radiance, irradiance, depth, length: not negative.
    NotNegative,
    /// Transmittance, opacity, weight: 0 to 1.
    Share,
}

/// What a number or vector may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Integers, whose meaning the passes' own tests check.
    Whole,
    /// Floats, component by component.
    Floats([Float; 4]),
    /// Words of two 16-bit floats, light of the light grid: not negative where its solution is whole. On its
    /// way a relaxed step may pass its goal.
    Solved,
    /// Words of two 16-bit floats, finite.
    Halves,
    /// A texel of a deep shadow map: places of [`NODES`] nodes along the sun's ray, 16 bits each, and one
    /// number more, which may be any.
    Nodes,
}

use Float::{Any, NotNegative, Share};

const ANY: Rule = Rule::Floats([Any; 4]);
const POSITIVE: Rule = Rule::Floats([NotNegative; 4]);
const SHARE: Rule = Rule::Floats([Share; 4]);
const COLOUR: Rule = Rule::Floats([NotNegative, NotNegative, NotNegative, Any]);
const COLOUR_AND_SHARE: Rule = Rule::Floats([NotNegative, NotNegative, NotNegative, Share]);

/// Shares that are sums of products of rounded weights pass 1 by some steps of f32.
pub const SHARE_ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Nodes of a texel of a shadow map.
pub const NODES: usize = 7;
/// By so many steps of 16 bits a node may lie before the last: both are rounded, from places that f32
/// rounds too.
pub const NODE_ROUNDING: i64 = 1;

/// Floats.
pub const FLOATS: &[(&str, Rule)] = &[
    ("Particle.centre", ANY),
    ("Particle.radius", POSITIVE),
    ("Particle.orientation", ANY),
    ("Particle.extinction", POSITIVE),
    ("Particle.optical_radius", POSITIVE),
    ("ParticleLight.sun_irradiance", COLOUR),
    ("ParticleLight.ambient_above", POSITIVE),
    ("ParticleLight.ambient_below", COLOUR_AND_SHARE),
    ("FrameUniforms.right", ANY),
    ("FrameUniforms.up", ANY),
    ("FrameUniforms.forward", ANY),
    ("FrameUniforms.sun", ANY),
    ("FrameUniforms.camera_altitude", ANY),
    ("FrameUniforms.albedo", SHARE),
    ("FrameUniforms.delta_scale", SHARE),
    ("FrameUniforms.transmittance_stop", SHARE),
    ("FrameUniforms.exposure", POSITIVE),
    ("FrameUniforms.halo_share", POSITIVE),
    ("FrameUniforms.grid_shift", ANY),
    ("LightView.axis_u", ANY),
    ("LightView.axis_v", ANY),
    ("LightView.towards", ANY),
    ("LightView.origin", ANY),
    ("LightView.tile_size", POSITIVE),
    ("LightView.inverse_tile_size", POSITIVE),
    ("LightView.warp", POSITIVE),
    ("Ring.corner", ANY),
    ("Ring.cell_size", POSITIVE),
    ("Ring.layer_height", POSITIVE),
    ("Ring.fade_in", ANY),
    ("Ring.fade_out", ANY),
    ("CloudUniforms.base", ANY),
    ("CloudUniforms.thickness", POSITIVE),
    ("CloudUniforms.threshold", ANY),
    ("CloudUniforms.inverse_range", POSITIVE),
    ("CloudUniforms.extinction", POSITIVE),
    ("CloudUniforms.particle_size", POSITIVE),
    ("CloudUniforms.evolution", SHARE),
    ("MapUniforms.texels", POSITIVE),
    ("MapUniforms.coverage", SHARE),
    ("MapUniforms.noise", SHARE),
    ("GridLevel.low", ANY),
    ("GridLevel.cell", POSITIVE),
    ("LightGridUniforms.sun", ANY),
    ("LightGridUniforms.moment_first", ANY),
    ("LightGridUniforms.moment_second", ANY),
    ("LightGridUniforms.albedo", SHARE),
    ("LightGridUniforms.quantum", POSITIVE),
    ("GridEye.position", ANY),
    ("ShadowUniforms.axis_u", ANY),
    ("ShadowUniforms.axis_v", ANY),
    ("ShadowUniforms.towards", ANY),
    ("ShadowUniforms.corner", ANY),
    ("ShadowUniforms.range", ANY),
    ("ShadowUniforms.nearest", ANY),
    ("ShadowUniforms.reach", POSITIVE),
    ("ShadowUniforms.lowest", ANY),
    ("ShadowUniforms.highest", ANY),
    ("PhaseParams.hg_scale", POSITIVE),
    ("PhaseParams.hg_base", POSITIVE),
    ("PhaseParams.hg_slope", POSITIVE),
    ("PhaseParams.hg_sign", ANY),
    ("PhaseParams.draine_scale", POSITIVE),
    ("PhaseParams.draine_base", POSITIVE),
    ("PhaseParams.draine_slope", POSITIVE),
    ("PhaseParams.draine_alpha", POSITIVE),
    ("light_grid.extinction", POSITIVE),
    ("light_grid.sun_mean", SHARE),
    ("light_grid.sources", Rule::Solved),
    ("light_grid.lights", Rule::Solved),
    ("light_grid_matter.spread", SHARE),
    ("light_grid_matter.extinction", POSITIVE),
    ("light_ground.extinction", POSITIVE),
    ("light_ground.sun_mean", SHARE),
    ("light_ground.lights", Rule::Solved),
    ("light_ground.fallen", POSITIVE),
    ("light_ground.shares", POSITIVE),
    ("light_field.shares", POSITIVE),
    ("GridStage.relaxation", POSITIVE),
    ("light_field.lights", Rule::Solved),
    // Bound to the passes that read it as whole words, too.
    ("shadow.texels", Rule::Nodes),
    ("air_shadow.changed_light", Rule::Halves),
    ("ReuseUniforms.right", ANY),
    ("ReuseUniforms.up", ANY),
    ("ReuseUniforms.forward", ANY),
    ("ReuseUniforms.motion", ANY),
    // Textures. What reuse writes are the blend's own.
    ("sky_depth.table", POSITIVE),
    ("sky_multiple.table", POSITIVE),
    ("sky_ground.table", POSITIVE),
    ("sky_altitude.table", POSITIVE),
    ("sky_view.table", POSITIVE),
    ("sky_air.sources", POSITIVE),
    ("sky_air.depths_over", POSITIVE),
    ("light_field.field", POSITIVE),
    ("blend.radiance_out", COLOUR_AND_SHARE),
    ("blend.distance_out", POSITIVE),
    ("resolve.picture", COLOUR_AND_SHARE),
    ("tonemap.display", SHARE),
];

/// Integers.
pub const WHOLE: &[&str] = &[
    "Particle.shape",
    "Particle.id",
    "FrameUniforms.size",
    "FrameUniforms.tiles",
    "FrameUniforms.has_air",
    "FrameUniforms.has_ground",
    "FrameUniforms.particle_capacity",
    "FrameUniforms.has_clouds",
    "FrameUniforms.light_epoch",
    "FrameUniforms.has_shadows",
    "FrameUniforms.blocks",
    "FrameUniforms.stride",
    "FrameUniforms.phase",
    "FrameUniforms.in_place",
    "FrameUniforms.padding_c",
    "FrameUniforms.has_air_shadow",
    "FrameUniforms.padding_b",
    "LightView.tiles",
    "LightView.padding_a",
    "Ring.first_cell",
    "Ring.layers",
    "Ring.first_column",
    "Ring.map_first",
    "Ring.map_first_share",
    "Ring.map_step",
    "Ring.map_step_share",
    "MapUniforms.size",
    "MapUniforms.outside",
    "MapUniforms.padding_a",
    "CloudUniforms.seed",
    "CloudUniforms.rings",
    "CloudUniforms.cells",
    "CloudUniforms.columns",
    "CloudUniforms.octaves",
    "CloudUniforms.largest_shift",
    "CloudUniforms.shapes",
    "CloudUniforms.capacity",
    "CloudUniforms.first_slot",
    "CloudUniforms.padding_a",
    "CloudUniforms.evolution_cell",
    "CloudUniforms.shape_list",
    "ParticleCount.particles",
    "ParticleCount.wanted",
    "GridLevel.size",
    "LightGridUniforms.levels",
    "LightGridUniforms.cells",
    "LightGridUniforms.spreads",
    "LightGridUniforms.longest",
    "GridStage.level",
    "GridStage.is_last",
    "GridStage.padding_c",
    "ShadowUniforms.resolution",
    "ShadowUniforms.maps",
    "ShadowUniforms.seen_only",
    "ShadowUniforms.padding_b",
    "SortUniforms.length",
    "SortUniforms.shift",
    "SortUniforms.blocks",
    "SortUniforms.pad0",
    "ScanUniforms.length",
    "ScanUniforms.pad0",
    "ScanUniforms.pad1",
    "ScanUniforms.pad2",
    "ListUniforms.tiles",
    "ListUniforms.bins",
    "ListUniforms.chunks",
    "ListUniforms.bin_capacity",
    "ListUniforms.tile_capacity",
    "ListUniforms.length_index",
    "ListUniforms.chunk",
    "ListUniforms.padding_a",
    "screen_project.keys",
    "screen_project.values",
    "screen_project.rectangles",
    "screen_project.particle_count",
    "screen_project.visible",
    "light_project.keys",
    "light_project.values",
    "light_project.rectangles",
    "light_project.particle_count",
    "sort.keys_in",
    "sort.values_in",
    "sort.keys_out",
    "sort.values_out",
    "sort.histograms",
    "sort.offsets",
    "scan.counts",
    "scan.offsets",
    "tile_lists.lengths",
    "tile_lists.order",
    "tile_lists.rectangles",
    "tile_lists.counts",
    "tile_lists.bin_offsets",
    "tile_lists.bin_entries",
    "tile_lists.tile_entries",
    "light_grid_matter.matter",
    "light_grid_matter.large",
    "light.tile_offsets",
    "light.tile_entries",
    "light.visible",
    "light.order",
    "shadow.tile_offsets",
    "shadow.tile_entries",
    "shadow.cut",
    "blend.shadow_texels",
    "resolve.shadow_texels",
    "air_shadow.shadow_texels",
    "resolve.changed_light",
    "blend.tile_offsets",
    "blend.tile_entries",
    "blend.counts",
    "rings.column_counts",
    "rings.column_offsets",
];

/// The rule of a number.
pub fn rule(name: &str) -> Option<Rule> {
    if WHOLE.contains(&name) {
        return Some(Rule::Whole);
    }
    FLOATS.iter().find(|(n, _)| *n == name).map(|(_, rule)| *rule)
}
