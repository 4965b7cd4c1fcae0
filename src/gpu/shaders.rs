//! WGSL, composed with naga_oil from `shaders/`: small modules with an import path, and one file
//! per pass that imports them.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Mutex;

use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, NagaModuleDescriptor, ShaderDefValue,
};

use crate::error::{Error, Result};

macro_rules! shader_files {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_str!(concat!("../../shaders/", $path)))),*]
    };
}

/// Modules that others import, each after the modules it imports itself.
const MODULES: &[(&str, &str)] = shader_files![
    "shared/gpu_data.wgsl",
    "shared/opaque_distance.wgsl",
    "shared/numerics.wgsl",
    "shared/noise.wgsl",
    "shared/weather.wgsl",
    "shared/quaternion.wgsl",
    "shared/light_view.wgsl",
    "shared/shadow_maps.wgsl",
    "shared/sun_depth.wgsl",
    "shared/ray_blocks.wgsl",
    "shared/air_shadow_place.wgsl",
    "shared/air_shadow.wgsl",
    "shared/light_grid_data.wgsl",
    "shared/light_field.wgsl",
    "shared/lighting.wgsl",
    "shared/octaves.wgsl",
    "medium/phase.wgsl",
    "tables/sampler.wgsl",
    "tables/optical_depth.wgsl",
    "tables/scattering.wgsl",
    "shared/light_lists.wgsl",
    "shared/atmosphere.wgsl",
    "shared/sky_march.wgsl",
    "shared/sky.wgsl",
    "shared/sea.wgsl",
    "shared/sea_light.wgsl",
];

/// Composes the shaders of the passes; the modules are parsed once.
pub struct ShaderLibrary {
    composer: Mutex<Composer>,
}

impl ShaderLibrary {
    /// Parses all shared modules.
    pub fn new() -> Result<Self> {
        // f16 packed in u32 is part of WGSL; adapters without it are of OpenGL ES 3.0.
        let mut composer = Composer::default().with_capabilities(
            naga::valid::Capabilities::default()
                | naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32,
        );
        for (path, source) in MODULES {
            let added = composer.add_composable_module(ComposableModuleDescriptor {
                source,
                file_path: path,
                ..Default::default()
            });
            if let Err(e) = added {
                return Err(Error::Gpu(format!("{path}: {}", e.emit_to_string(&composer))));
            }
        }
        Ok(Self { composer: Mutex::new(composer) })
    }

    /// Composes one shader into a validated naga module. `defs` are constants of the pipeline
    /// that the text names as `#{NAME}` or tests with `#ifdef`.
    pub fn compose(&self, path: &str, source: &str, defs: &[(&str, u32)]) -> Result<naga::Module> {
        let mut composer = self.composer.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let shader_defs: HashMap<String, ShaderDefValue> = defs
            .iter()
            .map(|(name, value)| ((*name).to_owned(), ShaderDefValue::UInt(*value)))
            .collect();
        let made = composer.make_naga_module(NagaModuleDescriptor {
            source,
            file_path: path,
            shader_defs,
            ..Default::default()
        });
        made.map_err(|e| Error::Gpu(format!("{path}: {}", e.emit_to_string(&composer))))
    }

    /// Composes one shader and hands it to the device.
    pub fn shader_module(
        &self,
        device: &wgpu::Device,
        path: &str,
        source: &str,
        defs: &[(&str, u32)],
    ) -> Result<wgpu::ShaderModule> {
        let module = self.compose(path, source, defs)?;
        Ok(device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(path),
            source: wgpu::ShaderSource::Naga(Cow::Owned(module)),
        }))
    }
}
