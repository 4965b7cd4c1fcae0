//! Sky: the Earth's clear atmosphere after Hillaire (2020), as tables that few passes fill and all
//! passes read, or a uniform sky without air.
//!
//! The tables depend on less and less: optical depth on nothing, multiple scattering and the
//! ground's light on its albedo, light by altitude on the sun's height too, the view and the air
//! before things on the camera's altitude too. Only what a change touches is made again; the
//! sun's azimuth and irradiance touch no table.

pub mod gpu_data;
pub mod spectrum;
pub mod tables;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use bytemuck::Zeroable;
use glam::Vec3;

use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::medium::Sea;
use gpu_data::{SkyUniforms, seen_from};
use tables::SkyTables;

/// What kind of sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SkyKind {
    /// The same radiance from everywhere, and no air.
    Uniform {
        /// In the unit of the sun's irradiance, per sr.
        radiance: f32,
    },
    /// The Earth's clear atmosphere.
    Atmosphere,
}

/// All that the sky depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyInputs {
    /// What kind of sky.
    pub kind: SkyKind,
    /// Unit vector towards the sun.
    pub sun_direction: Vec3,
    /// Outside of the air, on a surface that faces the sun.
    pub sun_irradiance: f32,
    /// Of the sun's disc, rad.
    pub angular_diameter: f32,
    /// m; below 0 the sky is that at 0.
    pub camera_altitude: f64,
    /// Linear sRGB, 0 to 1.
    pub ground_albedo: Vec3,
    /// Whether there is a ground under a uniform sky; under an atmosphere there always is.
    pub has_ground: bool,
    /// The wind (m/s) over the ground, where it is a sea.
    pub sea_wind: Option<f64>,
}

impl SkyInputs {
    /// The waves of the ground, where it is a sea.
    pub fn sea(&self) -> Option<Arc<Sea>> {
        self.sea_wind.map(Sea::new)
    }

    /// What sees the sky from the surface of the ground.
    pub fn at_the_ground(&self) -> Self {
        Self { camera_altitude: 0.0, ..*self }
    }
}

/// What has to be made again. Each kind includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SkyWork {
    /// Nothing changed.
    None,
    /// Values that no table depends on: they are on the device already.
    Uniforms,
    /// The tables that depend on the camera's altitude.
    Camera,
    /// Those that depend on the sun's height.
    Sun,
    /// Those that depend on the ground's albedo.
    Ground,
    /// All.
    All,
}

/// One pipeline with what it reads and writes.
struct Stage {
    kernel: Kernel,
    entry: &'static str,
    needed_from: SkyWork,
    groups: [u32; 2],
    output: wgpu::BindGroup,
    sources: wgpu::BindGroup,
}

/// The tables, the passes that fill them, and the bind group the other passes read them through.
pub struct SkyPass {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    march: wgpu::BindGroupLayout,
    march_group: wgpu::BindGroup,
    uniforms: wgpu::Buffer,
    tables: SkyTables,
    stages: Vec<Stage>,
    last: Option<SkyInputs>,
    /// What the tables were made for.
    made: Option<SkyInputs>,
    sampler: wgpu::Sampler,
    over_sea: Option<OverSea>,
}

/// The sky as the surface of a sea sees it: the view's stage with an eye there.
struct OverSea {
    uniforms: wgpu::Buffer,
    view: wgpu::TextureView,
    output: wgpu::BindGroup,
    sources: wgpu::BindGroup,
    bytes: u64,
}

/// The entry of the stage that makes the view.
const VIEW_ENTRY: &str = "sky_view";

impl SkyPass {
    /// Compiles the passes; the tables are filled by the first frame that needs them.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary) -> Result<Self> {
        const FLAT: wgpu::TextureViewDimension = wgpu::TextureViewDimension::D2;
        const SOLID: wgpu::TextureViewDimension = wgpu::TextureViewDimension::D3;
        let t = SkyTables::new(gpu);
        let uniforms = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("sky uniforms"),
            size: size_of::<SkyUniforms>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("sky"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let march = tables::layout(gpu, "sky march", &[FLAT; 3]);
        let sources =
            |made: [&wgpu::Texture; 3]| tables::bind(gpu, &march, &uniforms, &sampler, &made);
        let stage = |file, entry, needed_from, made, written: &[&wgpu::Texture], groups| {
            let kernel = Kernel::new(gpu, library, file, &[], &[&march])?;
            let views: Vec<_> =
                written.iter().map(|w| w.create_view(&Default::default())).collect();
            let resources: Vec<_> = views.iter().map(wgpu::BindingResource::TextureView).collect();
            let output = kernel.bind(gpu, &resources);
            Ok(Stage { kernel, entry, needed_from, groups, output, sources: sources(made) })
        };
        let over = |[w, h]: [u32; 2], side: [u32; 2]| [w.div_ceil(side[0]), h.div_ceil(side[1])];
        let all = [&t.depth, &t.multiple, &t.ground];
        let none = &t.nothing;
        let stages: Result<Vec<Stage>> = [
            stage(
                crate::shader_file!("frame/sky_depth.wgsl"),
                "sky_depth",
                SkyWork::All,
                [none; 3],
                &[&t.depth],
                over(tables::DEPTH_SIZE, [8, 8]),
            ),
            stage(
                crate::shader_file!("frame/sky_multiple.wgsl"),
                "sky_multiple",
                SkyWork::Ground,
                [&t.depth, none, none],
                &[&t.multiple],
                over(tables::MULTIPLE_SIZE, [8, 8]),
            ),
            stage(
                crate::shader_file!("frame/sky_ground.wgsl"),
                "sky_ground",
                SkyWork::Ground,
                [&t.depth, &t.multiple, none],
                &[&t.ground],
                over([tables::GROUND_SIZE[0], 1], [64, 1]),
            ),
            stage(
                crate::shader_file!("frame/sky_altitude.wgsl"),
                "sky_altitude",
                SkyWork::Sun,
                all,
                &[&t.altitude],
                over(tables::ALTITUDE_SIZE, [64, 1]),
            ),
            stage(
                crate::shader_file!("frame/sky_view.wgsl"),
                VIEW_ENTRY,
                SkyWork::Camera,
                all,
                &[&t.view],
                over(tables::VIEW_SIZE, [8, 8]),
            ),
            stage(
                crate::shader_file!("frame/sky_air.wgsl"),
                "sky_air",
                SkyWork::Camera,
                all,
                &[&t.air_sources, &t.air_depths],
                over([tables::AIR_SIZE[0], tables::AIR_SIZE[1]], [8, 8]),
            ),
        ]
        .into_iter()
        .collect();
        let layout = tables::layout(gpu, "sky", &[FLAT, FLAT, FLAT, SOLID, FLAT]);
        let read = [&t.ground, &t.altitude, &t.view, &t.air_sources, &t.air_depths];
        let group = tables::bind(gpu, &layout, &uniforms, &sampler, &read);
        let march_group = sources(all);
        Ok(Self {
            layout,
            group,
            march,
            march_group,
            uniforms,
            tables: t,
            stages: stages?,
            last: None,
            made: None,
            sampler,
            over_sea: None,
        })
    }

    /// Layout of the bind group that passes read the sky through (group 2).
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// That bind group.
    pub fn bind_group(&self) -> &wgpu::BindGroup {
        &self.group
    }

    /// Layout of the bind group of the tables that don't depend on the view (group 1 of passes that march
    /// through the air).
    pub fn march_layout(&self) -> &wgpu::BindGroupLayout {
        &self.march
    }

    /// That bind group.
    pub fn march_group(&self) -> &wgpu::BindGroup {
        &self.march_group
    }

    /// The tables.
    pub fn tables(&self) -> &SkyTables {
        &self.tables
    }

    /// Takes the frame's inputs and says what `encode` has to make before other passes read.
    pub fn update(&mut self, gpu: &Gpu, inputs: &SkyInputs) -> SkyWork {
        if self.last == Some(*inputs) {
            return SkyWork::None;
        }
        self.last = Some(*inputs);
        if inputs.sea_wind.is_some() {
            let over_sea = self.over_sea.take().or_else(|| self.new_over_sea(gpu));
            if let Some(over_sea) = &over_sea {
                let seen = SkyUniforms::new(&inputs.at_the_ground());
                gpu.queue.write_buffer(&over_sea.uniforms, 0, bytemuck::bytes_of(&seen));
            }
            self.over_sea = over_sea;
        }
        gpu.queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&SkyUniforms::new(inputs)));
        if inputs.kind != SkyKind::Atmosphere {
            return SkyWork::Uniforms;
        }
        let work = self.made.as_ref().map_or(SkyWork::All, |made| work_between(made, inputs));
        self.made = Some(*inputs);
        work
    }

    fn new_over_sea(&self, gpu: &Gpu) -> Option<OverSea> {
        let stage = self.stages.iter().find(|s| s.entry == VIEW_ENTRY)?;
        let texture = tables::sky_over_sea(gpu);
        let uniforms = buffers::uniform(gpu, "sky over sea", &SkyUniforms::zeroed());
        let view = texture.create_view(&Default::default());
        let t = &self.tables;
        let all = [&t.depth, &t.multiple, &t.ground];
        Some(OverSea {
            output: stage.kernel.bind(gpu, &[wgpu::BindingResource::TextureView(&view)]),
            sources: tables::bind(gpu, &self.march, &uniforms, &self.sampler, &all),
            bytes: tables::bytes_of(&texture) + uniforms.size(),
            uniforms,
            view,
        })
    }

    /// The sky as a sea's surface sees it, once there has been a sea.
    pub fn over_sea(&self) -> Option<&wgpu::TextureView> {
        self.over_sea.as_ref().map(|over_sea| &over_sea.view)
    }

    /// The waves of the last frame's ground, where it is a sea.
    pub fn waves(&self) -> Option<Arc<Sea>> {
        self.last.and_then(|inputs| inputs.sea())
    }

    /// Records the passes that this work needs.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, work: SkyWork) {
        if work <= SkyWork::Uniforms {
            return;
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("sky"),
            timestamp_writes: None,
        });
        for stage in self.stages.iter().filter(|s| work >= s.needed_from) {
            pass.set_pipeline(stage.kernel.pipeline(stage.entry));
            pass.set_bind_group(0, &stage.output, &[]);
            pass.set_bind_group(1, &stage.sources, &[]);
            pass.dispatch_workgroups(stage.groups[0], stage.groups[1], 1);
            // It does not depend on the camera's altitude.
            let is_sea = self.last.is_some_and(|inputs| inputs.sea_wind.is_some());
            let over_sea = self.over_sea.as_ref().filter(|_| is_sea && work >= SkyWork::Sun);
            if let Some(over_sea) = over_sea.filter(|_| stage.entry == VIEW_ENTRY) {
                pass.set_bind_group(0, &over_sea.output, &[]);
                pass.set_bind_group(1, &over_sea.sources, &[]);
                pass.dispatch_workgroups(stage.groups[0], stage.groups[1], 1);
            }
        }
    }

    /// Device memory of the tables, bytes.
    pub fn bytes(&self) -> u64 {
        let over_sea = self.over_sea.as_ref().map_or(0, |over_sea| over_sea.bytes);
        self.tables.bytes() + size_of::<SkyUniforms>() as u64 + over_sea
    }
}

/// What of the tables differs between two atmospheres.
fn work_between(made: &SkyInputs, inputs: &SkyInputs) -> SkyWork {
    if (made.ground_albedo, made.sea_wind) != (inputs.ground_albedo, inputs.sea_wind) {
        SkyWork::Ground
    } else if made.sun_direction.y != inputs.sun_direction.y {
        SkyWork::Sun
    } else if seen_from(made.camera_altitude) != seen_from(inputs.camera_altitude) {
        SkyWork::Camera
    } else {
        SkyWork::Uniforms
    }
}
