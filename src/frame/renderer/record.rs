//! Records the passes that the plan names.

use glam::DVec3;

use super::Renderer;
use crate::Result;
use crate::frame::changes::{FrameKey, Product};
use crate::frame::composer::ComposeInputs;
use crate::frame::gpu_data::FrameUniforms;
use crate::frame::light_grid::{GridWith, GridWork};
use crate::frame::passes::Passes;
use crate::frame::plan::{FramePlan, Pass};
use crate::frame::resources::Resources;
use crate::frame::reuse::{ReuseUniforms, Shading};
use crate::frame::sea::Clouded;
use crate::frame::sky::SkyWork;
use crate::gpu::Gpu;

/// Epochs of light run from 1 to this and over: all of them are exact in f32. Buffers start with
/// 0, which is none.
const LAST_EPOCH: u32 = 1 << 24;

/// What a frame does.
pub(super) struct Work<'a> {
    pub plan: &'a FramePlan,
    pub key: &'a FrameKey,
    pub sky: SkyWork,
    pub grid: &'a GridWork,
    /// Anchor of the light grid relative to the eye, m.
    pub shift: DVec3,
    pub shading: Shading,
}

/// The epoch after this one.
fn next(epoch: u32) -> u32 {
    epoch % LAST_EPOCH + 1
}

impl Renderer {
    /// Records and submits a frame. `before`: how the frame before saw what this one sees.
    pub(super) fn record(
        &mut self,
        resources: &Resources,
        work: &Work<'_>,
        before: Option<ReuseUniforms>,
    ) -> Result<()> {
        let &Work { plan, key, sky, grid, shift, shading } = work;
        if plan.relit() {
            self.light_epoch = next(self.light_epoch);
        }
        let (phase, in_place) = match shading {
            Shading::All => (key.frame.phase, 1),
            Shading::Still(phase) => (phase, 1),
            Shading::Moving(phase) => (phase, 0),
        };
        let frame = FrameUniforms { light_epoch: self.light_epoch, phase, in_place, ..key.frame };
        let gpu = &self.gpu;
        let passes = &self.passes;
        if let (Some(sea), Some(waves)) = (&passes.sea, self.sky.waves()) {
            sea.hold(gpu, &waves);
        }
        self.weather.hold(gpu, key.clouds.as_ref().and_then(|c| c.weather.as_ref()));
        gpu.queue.write_buffer(&resources.frame, 0, bytemuck::bytes_of(&frame));
        resources.write_view(gpu, &key.light);
        gpu.queue.write_buffer(&self.shadow.uniforms, 0, bytemuck::bytes_of(&key.shadow));
        let particles = plan.makes(Product::Particles);
        if particles {
            gpu.queue.write_buffer(&resources.particles, 0, bytemuck::cast_slice(&key.listed));
        }
        if particles && key.clouds.is_none() {
            let count = key.listed.len() as u32;
            gpu.queue.write_buffer(
                &resources.particle_count,
                0,
                bytemuck::cast_slice(&[count, count]),
            );
        }

        let (tables, sky_bindings) = (self.tables.bind_group(), self.sky.bind_group());
        let field = self.grid.bind_group();
        let is_lit = field.is_some() || !key.lighting.has_grid();
        let lit_by: Vec<_> = [tables, sky_bindings].into_iter().chain(field).collect();
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        let screen = plan.makes(Product::ScreenLists);
        if plan.runs(Pass::Project) && screen {
            encoder.clear_buffer(&resources.visible, 0, None);
        }
        if plan.runs(Pass::Blend) {
            encoder.clear_buffer(&resources.blend_counts, 0, None);
        }
        if plan.runs(Pass::Shadow) {
            encoder.clear_buffer(&self.shadow.cut, 0, None);
        }
        let pictures: Vec<_> = [
            screen.then_some((&resources.screen, &passes.screen_project)),
            plan.makes(Product::LightLists)
                .then_some((&resources.light.lists, &passes.light_project)),
        ]
        .into_iter()
        .flatten()
        .collect();
        for pass in Pass::ALL.into_iter().filter(|p| plan.runs(*p)) {
            self.stats.timed(gpu, pass, &mut encoder, |encoder| {
                if pass == Pass::Sky {
                    return self.sky.encode(encoder, sky);
                }
                if pass == Pass::LightGrid {
                    let with = GridWith { passes, weather: &self.weather, tables };
                    return passes.light_grid.encode_solve(gpu, encoder, with, &self.grid, grid);
                }
                if pass == Pass::Blend {
                    if !is_lit {
                        return;
                    }
                    if let (Some(composer), Some(field)) = (&self.composer, field) {
                        let groups = [tables, sky_bindings, field];
                        let inputs =
                            ComposeInputs { resources, shadow: &self.shadow, phase: &self.phase };
                        composer.encode(gpu, &mut compute_pass(encoder, pass), &inputs, groups);
                        return;
                    }
                    return encode_blend(gpu, passes, encoder, resources, work, &before, &lit_by);
                }
                let compute = &mut compute_pass(encoder, pass);
                match pass {
                    Pass::Sky | Pass::LightGrid | Pass::Blend => {}
                    Pass::LightField => {
                        passes.light_grid.encode_field(gpu, compute, &self.grid, grid, shift);
                    }
                    Pass::Rings => {
                        if let (Some(job), Some(clouds)) = (&resources.rings, &key.clouds) {
                            let scan = &passes.lists.scan;
                            passes.rings.encode(gpu, compute, scan, (job, clouds), &self.weather);
                        }
                    }
                    Pass::Opaque => {
                        if let Some(opaque) = &key.opaque {
                            let job = (&resources.opaque, opaque);
                            let size = key.frame.size;
                            passes.opaque.encode(gpu, compute, &resources.frame, size, job);
                        }
                    }
                    Pass::Project => {
                        pictures.iter().for_each(|(lists, p)| lists.encode_project(compute, p));
                    }
                    Pass::Sort => {
                        pictures.iter().for_each(|(l, _)| l.encode_sort(compute, &passes.lists));
                    }
                    Pass::TileLists => {
                        pictures.iter().for_each(|(l, _)| l.encode_lists(compute, &passes.lists));
                    }
                    Pass::Light => {
                        if is_lit {
                            passes.light.encode(compute, &resources.light.job, &lit_by);
                        }
                    }
                    Pass::Shadow => {
                        passes.shadow.encode(
                            compute,
                            &self.shadow,
                            &resources.shadow_bindings,
                            tables,
                            key.shadow.maps,
                        );
                    }
                    Pass::AirShadow => {
                        if let Some(field) = field {
                            let groups = [self.sky.march_group(), sky_bindings, field];
                            let bindings = &resources.air_shadow_bindings;
                            let rays = (key.frame.size, key.frame.ray_block);
                            passes.air_shadow.encode(compute, rays, bindings, groups);
                        }
                    }
                    Pass::Sea => {
                        let sky = self.sky.over_sea();
                        let of_frame = (&passes.sea, &resources.reflected, sky);
                        if let (Some(sea), Some(reflected), Some(view)) = of_frame {
                            let of_grid = self.grid.bind_group().zip(self.grid.sun_mean());
                            let clouds = of_grid
                                .filter(|_| plan.has_clouds())
                                .map(|(field, sun_mean)| Clouded { sun_mean, field });
                            let groups = [self.sky.march_group(), sky_bindings];
                            let of_frame = ([&resources.frame, &self.phase], reflected, view);
                            let rays = (key.frame.size, key.frame.ray_block);
                            sea.encode(gpu, compute, rays, of_frame, groups, clouds);
                        }
                    }
                    Pass::Resolve => {
                        let sea = passes.sea.as_ref().filter(|_| key.is_sea);
                        let resolve = sea.map_or(&passes.resolve, |sea| &sea.resolve);
                        // The host may bring other textures in every frame.
                        let of_opaque = key.opaque.as_ref().map(|opaque| {
                            let [radiance, sunlit] = resources.opaque.radiance(Some(opaque));
                            let views = [&resources.opaque.distances, radiance, sunlit];
                            let (frame, targets) = (&resources.frame, &resources.targets);
                            let of_rays = [
                                Some(&resources.changed_light),
                                resources.reflected.as_ref().map(|r| &r.light),
                            ];
                            resolve.bind(gpu, frame, &self.shadow, of_rays, targets, views)
                        });
                        let bindings = of_opaque.as_ref().unwrap_or(&resources.resolve_bindings);
                        resolve.encode(compute, key.frame.size, bindings, tables, sky_bindings);
                    }
                    Pass::Tonemap => {
                        passes.tonemap.encode(compute, key.frame.size, &resources.tonemap_bindings);
                    }
                }
            })?;
        }
        let of_grid = [self.grid.particle_count(), self.grid.large()];
        let of_grid = if plan.has_clouds() { of_grid } else { [None; 2] };
        let slots = self.grid.slot_counts().filter(|_| plan.has_clouds());
        self.stats.gather(&mut encoder, resources, &self.shadow, of_grid, slots);
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }
}

/// Records the blend, and where it shades one pixel of every block only, what fills in the others.
fn encode_blend(
    gpu: &Gpu,
    passes: &Passes,
    encoder: &mut wgpu::CommandEncoder,
    resources: &Resources,
    work: &Work<'_>,
    before: &Option<ReuseUniforms>,
    groups: &[&wgpu::BindGroup],
) {
    let FrameUniforms { blocks: [columns, rows], stride, .. } = work.key.frame;
    let in_place = &resources.blend_bindings;
    let (bindings, pixels, reuse) = match (work.shading, &resources.reuse, before) {
        (Shading::Moving(_), Some((job, bindings)), Some(before)) => {
            // The others of a block where it is beside an edge of what is opaque.
            let pixels = if work.key.opaque.is_some() { stride * stride } else { 1 };
            (bindings, pixels, Some((job, before)))
        }
        (Shading::All, ..) => (in_place, stride * stride, None),
        _ => (in_place, 1, None),
    };
    let blocks = [columns, rows, pixels];
    passes.blend.encode(gpu, &mut compute_pass(encoder, Pass::Blend), blocks, bindings, groups);
    if let Some((job, before)) = reuse {
        passes.reuse.encode(gpu, encoder, job, &resources.targets, before);
    }
}

fn compute_pass(encoder: &mut wgpu::CommandEncoder, pass: Pass) -> wgpu::ComputePass<'_> {
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(pass.name()),
        timestamp_writes: None,
    })
}
