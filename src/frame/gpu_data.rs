//! What crosses from the host to the shaders. The WGSL structs of the same names are in
//! `shaders/shared/gpu_data.wgsl` and `shaders/shared/shadow_maps.wgsl`, with the meaning and unit
//! of every field; a test compares names, sizes and offsets.

use bytemuck::{Pod, Zeroable};

/// Most octaves of coverage noise, most rings, most shapes of one cloud field.
pub const FIELD_SLOTS: usize = 8;

/// Most levels of the light grid.
pub const GRID_LEVELS: usize = 10;
/// Most pairs of opposite directions that the light grid's light travels in.
pub const MOST_AXES: usize = 16;

/// Declares a host struct together with the list of its fields that the layout test compares.
macro_rules! gpu_struct {
    ($(#[$meta:meta])* $name:ident { $($(#[$field_meta:meta])* $field:ident: $ty:ty,)* }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
        pub struct $name { $($(#[$field_meta])* pub $field: $ty,)* }

        impl $name {
            /// Name and offset in bytes of every field.
            pub const FIELDS: &'static [(&'static str, usize)] =
                &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*];
        }
    };
}

pub(crate) use gpu_struct;

gpu_struct! {
    /// One spherical particle.
    Particle {
        /// m, relative to the camera.
        centre: [f32; 3],
        /// m.
        radius: f32,
        /// Unit quaternion (x, y, z, w) from world axes to the particle's own.
        orientation: [f32; 4],
        /// 1/m at density 1.
        extinction: f32,
        /// Index in the tables; 0 is uniform.
        shape: u32,
        /// A hash that stays with the particle.
        id: u32,
        /// Extinction times radius times mean density.
        optical_radius: f32,
    }
}

gpu_struct! {
    /// Light that reaches one particle.
    ParticleLight {
        /// Perpendicular irradiance after the air, rgb; epoch.
        sun_irradiance: [f32; 4],
        /// Mean radiance of the sky above, rgb; optical depth of the others from the centre to the sun, where it is
        /// alone at all (`ambient_below[3]` above 0); a part of it elsewhere.
        ambient_above: [f32; 4],
        /// Mean radiance of what lies below, rgb; how much it is alone.
        ambient_below: [f32; 4],
    }
}

gpu_struct! {
    /// Constant for a frame.
    FrameUniforms {
        /// Image x axis scaled by tan(fov_x / 2).
        right: [f32; 4],
        /// Image y axis, upwards, scaled by tan(fov_y / 2).
        up: [f32; 4],
        /// View axis.
        forward: [f32; 4],
        /// Towards the sun.
        sun: [f32; 4],
        /// Pixels.
        size: [u32; 2],
        /// Screen tiles.
        tiles: [u32; 2],
        /// m.
        camera_altitude: f32,
        /// Single-scattering albedo.
        albedo: f32,
        /// Extinction of the particles here over the true one: 1 - albedo * peak.
        delta_scale: f32,
        /// A pixel is finished below this transmittance.
        transmittance_stop: f32,
        /// Factor on radiance before the tone curve.
        exposure: f32,
        /// 1: atmosphere, 0: vacuum.
        has_air: u32,
        /// 1: there is a ground.
        has_ground: u32,
        /// Slots in the particle buffers.
        particle_capacity: u32,
        /// 1: the blend has run.
        has_clouds: u32,
        /// Changes whenever the light of any particle does; below 2^24.
        light_epoch: u32,
        /// Optical depth of forward-peak scatterings over the scaled one.
        halo_share: f32,
        /// 1: there are shadow maps.
        has_shadows: u32,
        /// m, anchor of the light grid relative to the camera.
        grid_shift: [f32; 4],
        /// Blocks of pixels.
        blocks: [u32; 2],
        /// Sides of a block, pixels: 1 or 2.
        stride: u32,
        /// Which pixel of its block the blend shades; all of them where there is no such pixel.
        phase: u32,
        /// 1: the blend writes to the pixels, 0: to the blocks.
        in_place: u32,
        /// 1: it is known what sunlight clouds take from the air.
        has_air_shadow: u32,
        /// Of the phase function without the peak that delta_scale takes out.
        mean_cosine: f32,
        /// Sides of the blocks of pixels whose corners have rays.
        ray_block: u32,
    }
}

gpu_struct! {
    /// A set of parallel lines seen as a picture: from the sun.
    LightView {
        /// Picture x axis.
        axis_u: [f32; 4],
        /// Picture y axis.
        axis_v: [f32; 4],
        /// Towards the light.
        towards: [f32; 4],
        /// m, corner of tile (0, 0) in the warped picture.
        origin: [f32; 2],
        /// m.
        tile_size: f32,
        /// 1/m.
        inverse_tile_size: f32,
        /// Tiles across and up.
        tiles: [u32; 2],
        /// m, distance from the camera from which on tiles grow with it; 0: never.
        warp: f32,
        /// Unused.
        padding_a: u32,
    }
}

gpu_struct! {
    /// One ring of cells around the camera.
    Ring {
        /// Cell coordinates of its corner, x and z.
        first_cell: [i32; 2],
        /// m, the same corner relative to the camera.
        corner: [f32; 2],
        /// m.
        cell_size: f32,
        /// m.
        layer_height: f32,
        /// m, where it begins and where it is fully there.
        fade_in: [f32; 2],
        /// m, where it begins to fade and where it has gone.
        fade_out: [f32; 2],
        /// Layers of cells.
        layers: u32,
        /// Index of its first column among all rings'.
        first_column: u32,
        /// Weather map: texel of the corner of the first cell.
        map_first: [i32; 2],
        /// 2^-32 texels more.
        map_first_share: [u32; 2],
        /// Texels from cell to cell.
        map_step: [i32; 2],
        /// 2^-32 texels more.
        map_step_share: [u32; 2],
    }
}

gpu_struct! {
    /// A weather map.
    MapUniforms {
        /// Pixels.
        size: [u32; 2],
        /// Texels in an innermost cell.
        texels: [f32; 2],
        /// Where it is white.
        coverage: f32,
        /// Share of the coverage noise.
        noise: f32,
        /// Beyond its edges: 0 again, 1 its outermost pixels, 2 clear.
        outside: u32,
        /// Unused.
        padding_a: u32,
    }
}

gpu_struct! {
    /// The cloud field, constant for a frame.
    CloudUniforms {
        /// Of all hashes.
        seed: u32,
        /// Number of rings.
        rings: u32,
        /// Cells per side.
        cells: u32,
        /// Columns of cells in all rings.
        columns: u32,
        /// m, relative to the camera.
        base: f32,
        /// m, of the tallest clouds.
        thickness: f32,
        /// Coverage noise above this is cloud.
        threshold: f32,
        /// 1 / range of the noise above the threshold.
        inverse_range: f32,
        /// 1/m.
        extinction: f32,
        /// Radius in cells.
        particle_size: f32,
        /// Octaves of the coverage noise.
        octaves: u32,
        /// log2 of its largest wavelength in innermost cells.
        largest_shift: u32,
        /// Shapes in use.
        shapes: u32,
        /// Slots for particles.
        capacity: u32,
        /// Slots before it hold the scene's own particles.
        first_slot: u32,
        /// Unused.
        padding_a: u32,
        /// The weather map, where there is one.
        map: MapUniforms,
        /// x: lattice cell in time, per octave.
        evolution_cell: [[i32; 4]; FIELD_SLOTS],
        /// x: fraction of that cell, per octave.
        evolution: [[f32; 4]; FIELD_SLOTS],
        /// x: index of the shape in the tables, y: bits of its mean density.
        shape_list: [[u32; 4]; FIELD_SLOTS],
        /// The rings.
        ring: [Ring; FIELD_SLOTS],
    }
}

gpu_struct! {
    /// How many particles there are, listed ones and those of the rings.
    ParticleCount {
        /// In the buffer.
        particles: u32,
        /// Before the capacity cut them.
        wanted: u32,
    }
}

gpu_struct! {
    /// One level of the light grid.
    GridLevel {
        /// x, y, z: m, lowest corner relative to the anchor; w: first slice in the field texture.
        low: [f32; 4],
        /// x, y, z: m, side of a cell; w: index of its first word of 32 cells among all levels'.
        cell: [f32; 4],
        /// x, y, z: cells; w: index of its first cell among all levels'.
        size: [u32; 4],
    }
}

gpu_struct! {
    /// The light grid.
    LightGridUniforms {
        /// Towards the sun; w: height of the ground relative to the anchor, m.
        sun: [f32; 4],
        /// Levels in use, fine to coarse.
        levels: u32,
        /// Cells of all levels.
        cells: u32,
        /// First Legendre moment of the scaled phase function.
        moment_first: f32,
        /// Second Legendre moment.
        moment_second: f32,
        /// Scaled single-scattering albedo.
        albedo: f32,
        /// 1/m, extinction of one count of matter.
        quantum: f32,
        /// Entries of the table of spreads.
        spreads: u32,
        /// Most cells along an axis of a level.
        longest: u32,
        /// Words of 32 cells of a row, of all levels.
        words: u32,
        /// Slots of cells with matter that there are buffers for.
        matter_room: u32,
        /// Slots of all cells that keep light, with these.
        kept_room: u32,
        /// Pairs of opposite directions of travel.
        axes: u32,
        /// The last level whose light is looked up.
        widest: u32,
        /// 1: there may be matter above and below the clouds of a field, of listed particles.
        has_above: u32,
        /// 1: levels of listed particles alone, all of which the finest one holds.
        of_list: u32,
        /// Unused.
        padding_a: u32,
        /// Light from above by pairs of directions, over that of an even sky, less 1.
        sky: [[f32; 4]; MOST_AXES / 4],
        /// x, y, z: the first direction of a pair; w: share of the sphere that each of both stands for.
        axis: [[f32; 4]; MOST_AXES],
        /// The levels.
        level: [GridLevel; GRID_LEVELS],
    }
}

gpu_struct! {
    /// The eye that the light field is made for.
    GridEye {
        /// x, y, z: m, relative to the anchor.
        position: [f32; 4],
    }
}

gpu_struct! {
    /// Which level a dispatch works on.
    GridStage {
        /// The level.
        level: u32,
        /// Step from the sources of before towards the new ones.
        relaxation: f32,
        /// 1: the last turn of the level.
        is_last: u32,
        /// First of the rows of slanted planes that `sweep` walks.
        first_row: u32,
        /// The one behind the last.
        end_row: u32,
        /// Unused.
        padding_a: u32,
        /// Unused.
        padding_b: u32,
        /// Unused.
        padding_c: u32,
    }
}

/// Most deep shadow maps; as in the shader.
pub const SHADOW_MAPS: usize = 8;

gpu_struct! {
    /// Where the deep shadow maps lie; see `shaders/shared/shadow_maps.wgsl`.
    ShadowUniforms {
        /// Maps' x axis.
        axis_u: [f32; 4],
        /// Maps' y axis.
        axis_v: [f32; 4],
        /// Towards the sun.
        towards: [f32; 4],
        /// x, y: corner (m, relative to the camera); z: a texel, m; fine to coarse.
        corner: [[f32; 4]; SHADOW_MAPS],
        /// x: m, where each map's nodes begin; y: m, from there to where they end; z, w: m, the same two places
        /// where matter lies beyond, else infinitely far.
        range: [[f32; 4]; SHADOW_MAPS],
        /// m, where matter begins on the sun's way, from the plane through the camera.
        nearest: f32,
        /// m, from there to where it ends.
        reach: f32,
        /// m, lowest altitude of what is shadowed, relative to the camera.
        lowest: f32,
        /// m, highest.
        highest: f32,
        /// Texels a side.
        resolution: u32,
        /// Maps in use.
        maps: u32,
        /// 1: only what the picture may show is made.
        seen_only: u32,
        /// 1: what is shadowed may lie anywhere behind matter.
        anywhere: u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Struct of this name in the WGSL text: size, and names and offsets of its fields.
    fn wgsl_struct(module: &naga::Module, name: &str) -> (usize, Vec<(String, usize)>) {
        let found = module.types.iter().find_map(|(_, ty)| match (&ty.name, &ty.inner) {
            (Some(n), naga::TypeInner::Struct { members, span }) if n == name => Some((
                *span as usize,
                members
                    .iter()
                    .map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize))
                    .collect(),
            )),
            _ => None,
        });
        found.unwrap_or_else(|| panic!("no WGSL struct {name}"))
    }

    #[test]
    fn layouts_agree_with_wgsl() {
        let text = |source: &str| {
            // Without what stands between #ifdef and #else.
            let mut left_out = false;
            let kept = source.lines().filter(|line| {
                left_out = line.starts_with("#ifdef") || (left_out && !line.starts_with("#else"));
                !left_out && !line.starts_with('#')
            });
            let plain: String = kept.collect::<Vec<_>>().join("\n");
            naga::front::wgsl::parse_str(&plain).expect("the module stands alone")
        };
        let data = text(include_str!("../../shaders/shared/gpu_data.wgsl"));
        let shadow = text(include_str!("../../shaders/shared/shadow_maps.wgsl"));
        macro_rules! check {
            ($module:expr, $($name:ident),*) => {$(
                let (size, fields) = wgsl_struct($module, stringify!($name));
                assert_eq!(size, size_of::<$name>(), "size of {}", stringify!($name));
                let host: Vec<_> =
                    $name::FIELDS.iter().map(|(n, o)| ((*n).to_owned(), *o)).collect();
                assert_eq!(fields, host, "fields of {}", stringify!($name));
            )*};
        }
        check!(
            &data,
            Particle,
            ParticleLight,
            FrameUniforms,
            LightView,
            Ring,
            MapUniforms,
            CloudUniforms,
            ParticleCount
        );
        check!(&shadow, ShadowUniforms);
        let grid = text(include_str!("../../shaders/shared/light_grid_data.wgsl"));
        check!(&grid, GridLevel, LightGridUniforms, GridEye, GridStage);
    }
}
