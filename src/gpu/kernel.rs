//! A compute shader with its pipelines. The layout of its own bind group is read from the shader,
//! so host and shader cannot drift apart in it.

use naga::{AddressSpace, ImageClass, ImageDimension, StorageAccess, TypeInner};

use super::pipelines::Pipelines;
use super::watch::{self, Declared};
use super::{Gpu, ShaderLibrary};
use crate::error::{Error, Result};

/// A shader file of a pass: its path below `shaders/` and its text.
pub type ShaderFile = (&'static str, &'static str);

/// Names a shader file of the tree and embeds its text.
#[macro_export]
macro_rules! shader_file {
    ($path:literal) => {
        ($path, include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/", $path)))
    };
}

/// Pipelines for the entry points of one shader file.
pub struct Kernel {
    label: &'static str,
    layout: wgpu::BindGroupLayout,
    bindings: Vec<u32>,
    declared: Vec<Declared>,
    pipelines: Vec<(String, wgpu::ComputePipeline)>,
}

impl Kernel {
    /// Composes the shader and makes a pipeline for each of its entry points. `shared` are the
    /// layouts of bind groups 1, 2, … (tables, sky) for shaders that use them; `defs` are
    /// constants of the pipeline.
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        file: ShaderFile,
        defs: &[(&str, u32)],
        shared: &[&wgpu::BindGroupLayout],
    ) -> Result<Self> {
        let (path, source) = file;
        let module = library.compose(path, source, defs)?;
        let entries = own_bindings(path, &module)?;
        let declared = watch::declared(path, &module);
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(path),
            entries: &entries,
        });
        let layouts: Vec<_> =
            std::iter::once(&layout).chain(shared.iter().copied()).map(Some).collect();
        let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(path),
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let names: Vec<String> = module.entry_points.iter().map(|e| e.name.clone()).collect();
        let shader = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(path),
            source: wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(module)),
        });
        let pipelines = names
            .into_iter()
            .map(|name| {
                let pipeline =
                    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                        label: Some(path),
                        layout: Some(&pipeline_layout),
                        module: &shader,
                        entry_point: Some(&name),
                        compilation_options: Default::default(),
                        cache: gpu.pipelines().map(Pipelines::cache),
                    });
                (name, pipeline)
            })
            .collect();
        gpu.note_compiled();
        Ok(Self {
            label: path,
            layout,
            bindings: entries.iter().map(|e| e.binding).collect(),
            declared,
            pipelines,
        })
    }

    /// The pipeline of an entry point.
    ///
    /// # Panics
    /// Where the shader has no such entry point: a mistake in a pass, not in any input.
    pub fn pipeline(&self, entry_point: &str) -> &wgpu::ComputePipeline {
        match self.pipelines.iter().find(|(name, _)| name == entry_point) {
            Some((_, pipeline)) => pipeline,
            None => unreachable!("{} has no entry point {entry_point}", self.label),
        }
    }

    /// Binds the kernel's own resources, in the order of their binding numbers.
    pub fn bind(&self, gpu: &Gpu, resources: &[wgpu::BindingResource<'_>]) -> wgpu::BindGroup {
        debug_assert_eq!(resources.len(), self.bindings.len(), "{}", self.label);
        if let Some(watch) = gpu.watch() {
            watch.add(&self.declared, resources);
        }
        let entries: Vec<_> = self
            .bindings
            .iter()
            .zip(resources)
            .map(|(&binding, resource)| wgpu::BindGroupEntry {
                binding,
                resource: resource.clone(),
            })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.label),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

/// Layout entries of group 0, sorted by binding.
fn own_bindings(path: &str, module: &naga::Module) -> Result<Vec<wgpu::BindGroupLayoutEntry>> {
    let mut entries = Vec::new();
    for (_, variable) in module.global_variables.iter() {
        let Some(binding) = variable.binding.as_ref().filter(|b| b.group == 0) else { continue };
        let inner = &module.types[variable.ty].inner;
        let ty = binding_type(variable.space, inner).ok_or_else(|| {
            Error::Gpu(format!("{path}: binding {} has a kind that no pass uses", binding.binding))
        })?;
        entries.push(wgpu::BindGroupLayoutEntry {
            binding: binding.binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        });
    }
    entries.sort_by_key(|e| e.binding);
    Ok(entries)
}

fn binding_type(space: AddressSpace, inner: &TypeInner) -> Option<wgpu::BindingType> {
    let buffer =
        |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    Some(match (space, inner) {
        (AddressSpace::Uniform, _) => buffer(wgpu::BufferBindingType::Uniform),
        (AddressSpace::Storage { access }, _) => buffer(wgpu::BufferBindingType::Storage {
            read_only: !access.contains(StorageAccess::STORE),
        }),
        (AddressSpace::Handle, TypeInner::Image { dim, arrayed, class }) => {
            let view_dimension = match (dim, arrayed) {
                (ImageDimension::D2, false) => wgpu::TextureViewDimension::D2,
                (ImageDimension::D2, true) => wgpu::TextureViewDimension::D2Array,
                (ImageDimension::D3, false) => wgpu::TextureViewDimension::D3,
                _ => return None,
            };
            match class {
                // Passes read pixels one by one: no filtering is asked of 32-bit formats.
                ImageClass::Sampled { kind: naga::ScalarKind::Float, multi: false } => {
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: false },
                        view_dimension,
                        multisampled: false,
                    }
                }
                ImageClass::Sampled { kind: naga::ScalarKind::Uint, multi: false } => {
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Uint,
                        view_dimension,
                        multisampled: false,
                    }
                }
                ImageClass::Storage { format, .. } => wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format: storage_format(*format)?,
                    view_dimension,
                },
                _ => return None,
            }
        }
        _ => return None,
    })
}

fn storage_format(format: naga::StorageFormat) -> Option<wgpu::TextureFormat> {
    Some(match format {
        naga::StorageFormat::R32Float => wgpu::TextureFormat::R32Float,
        naga::StorageFormat::R32Uint => wgpu::TextureFormat::R32Uint,
        naga::StorageFormat::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
        naga::StorageFormat::Rgba32Uint => wgpu::TextureFormat::Rgba32Uint,
        naga::StorageFormat::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
        naga::StorageFormat::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
        _ => return None,
    })
}
