//! Reads back all that the kernels are bound to, and counts what breaks its rule.

use half::f16;
use serde::Serialize;

use super::rules::{Float, NODE_ROUNDING, NODES, Rule, SHARE_ROUNDING, rule};
use crate::error::{Error, Result};
use crate::frame::renderer::sky_inputs;
use crate::frame::sky::gpu_data::SkyUniforms;
use crate::gpu::Gpu;
use crate::gpu::watch::{BufferValues, Resource};
use crate::scene::Scene;

/// Counts over all numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Audit {
    /// Floats that were looked at.
    pub numbers: u64,
    /// Not a number.
    pub nan: u64,
    /// Infinite.
    pub infinite: u64,
    /// Negative where only positive numbers have a meaning, radiance above all.
    pub negative: u64,
    /// Transmittances and other shares outside of 0 to 1, and nodes of shadow maps that lie before the
    /// node before them.
    pub outside: u64,
    /// The first of all these.
    pub first: Option<String>,
}

impl Audit {
    /// Adds what was found elsewhere.
    pub fn add(&mut self, other: Self) {
        self.numbers += other.numbers;
        self.nan += other.nan;
        self.infinite += other.infinite;
        self.negative += other.negative;
        self.outside += other.outside;
        self.first = self.first.take().or(other.first);
    }

    /// Nodes of a shadow map's texel, two a word, must follow each other.
    fn nodes(&mut self, words: &[u32], place: impl Fn() -> String) {
        let node = |i: usize| i64::from(words[i / 2] >> (16 * (i % 2)) & 0xffff);
        self.numbers += NODES as u64;
        for i in 1..NODES {
            if node(i) < node(i - 1) - NODE_ROUNDING {
                self.outside += 1;
                self.first.get_or_insert_with(|| {
                    format!(
                        "{} node {i} at {} lies before the last at {}",
                        place(),
                        node(i),
                        node(i - 1)
                    )
                });
            }
        }
    }

    fn take(&mut self, value: f32, float: Float, place: impl FnOnce() -> String) {
        self.numbers += 1;
        let (count, what) = if value.is_nan() {
            (&mut self.nan, "is NaN")
        } else if value.is_infinite() {
            (&mut self.infinite, "is infinite")
        } else if float == Float::Share && !(0.0..=1.0 + SHARE_ROUNDING).contains(&value) {
            (&mut self.outside, "is outside of 0 to 1")
        } else if float == Float::NotNegative && value < 0.0 {
            (&mut self.negative, "is negative")
        } else {
            return;
        };
        *count += 1;
        if self.first.is_none() {
            self.first = Some(format!("{} {what}: {value:e}", place()));
        }
    }

    fn buffer(
        &mut self,
        gpu: &Gpu,
        buffer: &wgpu::Buffer,
        values: &BufferValues,
        is_solved: bool,
    ) -> Result<()> {
        let of_light = if is_solved { Float::NotNegative } else { Float::Any };
        let mut checked = Vec::new();
        for leaf in &values.leaves {
            let rule = rule_of(&leaf.name)?;
            if leaf.is_float != matches!(rule, Rule::Floats(_)) {
                return Err(Error::Failed(format!(
                    "the rule of {} is for other numbers",
                    leaf.name
                )));
            }
            if rule != Rule::Whole {
                checked.push((leaf, rule));
            }
        }
        if checked.is_empty() {
            return Ok(());
        }
        let words = gpu.read_buffer::<u32>(buffer, buffer.size() as usize / 4)?;
        for (index, element) in words.chunks_exact(values.stride / 4).enumerate() {
            for (leaf, rule) in &checked {
                let first = leaf.offset / 4;
                if *rule == Rule::Nodes {
                    let texel = &element[first..first + leaf.components];
                    self.nodes(texel, || format!("{}[{index}]:", leaf.name));
                    continue;
                }
                for (component, word) in element[first..first + leaf.components].iter().enumerate()
                {
                    let place = || format!("{}[{index}], number {component},", leaf.name);
                    match rule {
                        Rule::Whole | Rule::Nodes => {}
                        Rule::Floats(floats) => {
                            self.take(f32::from_bits(*word), floats[component.min(3)], place);
                        }
                        Rule::Solved | Rule::Halves => {
                            let may_be = if *rule == Rule::Halves { Float::Any } else { of_light };
                            for half in [*word as u16, (*word >> 16) as u16] {
                                self.take(f16::from_bits(half).to_f32(), may_be, place);
                            }
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn texture(&mut self, gpu: &Gpu, name: &str, texture: &wgpu::Texture) -> Result<()> {
        let rule = rule_of(name)?;
        if rule == Rule::Whole && texture.format() == wgpu::TextureFormat::R32Uint {
            return Ok(());
        }
        let Rule::Floats(floats) = rule else {
            return Err(Error::Failed(format!("the rule of {name} is for other numbers")));
        };
        let mut texel = |index: usize, values: &[f32]| {
            for (component, value) in values.iter().enumerate() {
                let place = || format!("{name}, texel {index}, number {component},");
                self.take(*value, floats[component], place);
            }
        };
        match texture.format() {
            wgpu::TextureFormat::Rgba32Float => {
                let texels = gpu.read_texture::<[f32; 4]>(texture)?;
                texels.iter().enumerate().for_each(|(i, t)| texel(i, t));
            }
            wgpu::TextureFormat::R32Float => {
                let texels = gpu.read_texture::<f32>(texture)?;
                texels.iter().enumerate().for_each(|(i, t)| texel(i, &[*t]));
            }
            wgpu::TextureFormat::Rgba16Float => {
                let texels = gpu.read_texture::<[f16; 4]>(texture)?;
                texels.iter().enumerate().for_each(|(i, t)| texel(i, &t.map(f16::to_f32)));
            }
            wgpu::TextureFormat::Rgba8Unorm => {
                let texels = gpu.read_texture::<[u8; 4]>(texture)?;
                let share = |t: &[u8; 4]| t.map(|v| f32::from(v) / 255.0);
                texels.iter().enumerate().for_each(|(i, t)| texel(i, &share(t)));
            }
            other => {
                return Err(Error::Failed(format!(
                    "{name} is of format {other:?}, not known here"
                )));
            }
        }
        Ok(())
    }
}

fn rule_of(name: &str) -> Result<Rule> {
    rule(name).ok_or_else(|| Error::Failed(format!("there is no rule for the numbers of {name}")))
}

/// Judges all that the kernels of this device are bound to, and the sky's uniforms for `scene`. `solved`: the
/// light grid's buffers whose solution is whole.
pub fn audit(gpu: &Gpu, scene: &Scene, solved: &[&wgpu::Buffer]) -> Result<Audit> {
    let Some(watch) = gpu.watch() else {
        return Err(Error::Failed("the device does not note its bindings".to_owned()));
    };
    let mut audit = Audit::default();
    for binding in watch.bindings() {
        match &binding.resource {
            Resource::Buffer(buffer, values) => {
                audit.buffer(gpu, buffer, values, solved.contains(&buffer))?;
            }
            Resource::Texture(texture) => audit.texture(gpu, &binding.name, texture)?,
        }
    }
    // The sky's shaders share one layout, which no kernel reflects. Its integers are finite floats.
    let sky = SkyUniforms::new(&sky_inputs(scene));
    let words: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&sky));
    for (i, value) in words.iter().enumerate() {
        audit.take(*value, Float::Any, || format!("SkyUniforms, number {i},"));
    }
    Ok(audit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fault_is_counted_once_and_the_first_is_told() {
        let mut audit = Audit::default();
        let none = || "some".to_owned();
        audit.take(f32::MAX, Float::NotNegative, none);
        audit.take(-1.0, Float::Any, none);
        assert_eq!(audit, Audit { numbers: 2, ..Audit::default() });
        audit.take(-1.0, Float::NotNegative, || "first".to_owned());
        audit.take(f32::NAN, Float::Any, none);
        audit.take(f32::NEG_INFINITY, Float::NotNegative, none);
        audit.take(1.01, Float::Share, none);
        audit.take(-0.01, Float::Share, none);
        audit.take(-0.0, Float::Share, none);
        let (numbers, nan, infinite, negative, outside) = (8, 1, 1, 1, 2);
        let first = Some("first is negative: -1e0".to_owned());
        assert_eq!(audit, Audit { numbers, nan, infinite, negative, outside, first });
    }

    #[test]
    fn nodes_must_not_fall() {
        let word = |low: u32, high: u32| low | (high << 16);
        let mut audit = Audit::default();
        // Two that round to each other, and the eighth number, which is none.
        audit.nodes(&[word(5, 4), word(9, 9), word(10, 700), word(65535, 3)], String::new);
        assert_eq!(audit, Audit { numbers: 7, ..Audit::default() });
        audit.nodes(&[word(5, 9), word(7, 9), word(10, 11), word(12, 3)], || "texel".to_owned());
        let first = Some("texel node 2 at 7 lies before the last at 9".to_owned());
        assert_eq!(audit, Audit { numbers: 14, outside: 1, first, ..Audit::default() });
        let mut sum = Audit { numbers: 1, nan: 2, ..Audit::default() };
        sum.add(audit.clone());
        assert_eq!(sum, Audit { numbers: 15, nan: 2, ..audit });
    }
}
