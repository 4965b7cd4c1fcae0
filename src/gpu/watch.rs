//! What the kernels are bound to, with the meaning of every number in it: for checks of all buffers
//! and textures of a frame. The layout is read from the shaders, so it cannot fall behind them.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use naga::{ArraySize, Handle, ImageClass, Module, ScalarKind, Type, TypeInner};

/// One number or vector in a buffer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// `Struct.field`, or `kernel.binding` where there is no struct.
    pub name: String,
    /// Bytes from the begin of an element.
    pub offset: usize,
    /// Numbers of 4 bytes.
    pub components: usize,
    /// Floats; integers otherwise.
    pub is_float: bool,
}

/// What a buffer holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BufferValues {
    /// Bytes from one element to the next.
    pub stride: usize,
    /// The numbers of an element.
    pub leaves: Vec<Leaf>,
}

/// What is bound.
#[derive(Clone, Debug)]
pub enum Resource {
    /// A buffer and what the shader takes it for.
    Buffer(wgpu::Buffer, Arc<BufferValues>),
    /// A texture that the kernel writes.
    Texture(wgpu::Texture),
}

/// A binding of a kernel.
#[derive(Clone, Debug)]
pub struct Binding {
    /// `kernel.binding`.
    pub name: String,
    /// What is bound.
    pub resource: Resource,
}

/// What a kernel knows of one of its bindings.
#[derive(Clone, Debug)]
pub(super) struct Declared {
    binding: u32,
    name: String,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Buffer(Arc<BufferValues>),
    /// A texture that is written.
    Written,
    /// A texture that is read: the kernel that writes it has it too.
    Read,
}

/// Bindings by the part of the renderer that made them: what a part makes anew replaces what it
/// made before.
#[derive(Debug, Default)]
struct Bindings {
    part: &'static str,
    bindings: Vec<(&'static str, Binding)>,
}

/// A list of bindings that a device's kernels add to.
#[derive(Clone, Debug, Default)]
pub struct Watch(Arc<Mutex<Bindings>>);

impl Watch {
    fn lock(&self) -> MutexGuard<'_, Bindings> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn clear(&self) {
        self.lock().bindings.clear();
    }

    pub(super) fn begin(&self, part: &'static str) {
        let mut list = self.lock();
        list.part = part;
        list.bindings.retain(|(of, _)| *of != part);
    }

    pub(super) fn add(&self, declared: &[Declared], resources: &[wgpu::BindingResource<'_>]) {
        let mut list = self.lock();
        for (declared, resource) in declared.iter().zip(resources) {
            let resource = match (resource, &declared.kind) {
                (wgpu::BindingResource::Buffer(bound), Kind::Buffer(values)) => {
                    Resource::Buffer(bound.buffer.clone(), values.clone())
                }
                (wgpu::BindingResource::TextureView(view), Kind::Written) => {
                    Resource::Texture(view.texture().clone())
                }
                _ => continue,
            };
            let part = list.part;
            list.bindings.push((part, Binding { name: declared.name.clone(), resource }));
        }
    }

    /// All buffers and written textures there are; one that several kernels take for the same, once.
    pub fn bindings(&self) -> Vec<Binding> {
        let mut result: Vec<Binding> = Vec::new();
        for (_, binding) in &self.lock().bindings {
            let known = result.iter().any(|b| match (&b.resource, &binding.resource) {
                (Resource::Buffer(a, x), Resource::Buffer(b, y)) => a == b && x == y,
                (Resource::Texture(a), Resource::Texture(b)) => a == b,
                _ => false,
            });
            if !known {
                result.push(binding.clone());
            }
        }
        result
    }
}

/// The stem of a shader file's path.
fn stem(path: &str) -> &str {
    let name = path.rsplit('/').next().unwrap_or(path);
    name.strip_suffix(".wgsl").unwrap_or(name)
}

/// A name without what the composer adds to those of other modules.
fn plain(name: &str) -> &str {
    name.split_once("X_naga_oil_").map_or(name, |(before, _)| before)
}

/// The bindings of group 0 of a shader, sorted.
pub(super) fn declared(path: &str, module: &Module) -> Vec<Declared> {
    let mut result: Vec<_> = module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| {
            let binding = variable.binding.as_ref().filter(|b| b.group == 0)?;
            let name = format!("{}.{}", stem(path), plain(variable.name.as_deref()?));
            let kind = match &module.types[variable.ty].inner {
                TypeInner::Image { class: ImageClass::Storage { .. }, .. } => Kind::Written,
                TypeInner::Image { .. } => Kind::Read,
                _ => Kind::Buffer(Arc::new(buffer_values(module, variable.ty, &name))),
            };
            Some(Declared { binding: binding.binding, name, kind })
        })
        .collect();
    result.sort_by_key(|d| d.binding);
    result
}

fn buffer_values(module: &Module, ty: Handle<Type>, name: &str) -> BufferValues {
    let (element, stride) = match &module.types[ty].inner {
        TypeInner::Array { base, stride, .. } => (*base, *stride),
        inner => (ty, inner.size(module.to_ctx())),
    };
    let mut leaves = Vec::new();
    collect(module, element, 0, name, &mut leaves);
    BufferValues { stride: stride as usize, leaves }
}

fn collect(module: &Module, ty: Handle<Type>, offset: usize, name: &str, to: &mut Vec<Leaf>) {
    let mut leaf = |components, kind| {
        let is_float = kind == ScalarKind::Float;
        to.push(Leaf { name: name.to_owned(), offset, components, is_float });
    };
    match &module.types[ty].inner {
        TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => leaf(1, scalar.kind),
        TypeInner::Vector { size, scalar } => leaf(*size as usize, scalar.kind),
        TypeInner::Array { base, size: ArraySize::Constant(count), stride } => {
            for i in 0..count.get() as usize {
                collect(module, *base, offset + i * *stride as usize, name, to);
            }
        }
        TypeInner::Struct { members, .. } => {
            let of = module.types[ty].name.as_deref().map_or(name, plain);
            for member in members {
                let field = member.name.as_deref().unwrap_or_default();
                let at = offset + member.offset as usize;
                collect(module, member.ty, at, &format!("{of}.{field}"), to);
            }
        }
        // Nothing else can stand in a buffer that the host shares.
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_a_buffer_is_named_and_placed() {
        let source = "
            struct Inner { a: vec3<f32>, b: u32 }
            struct Outer { inner: array<Inner, 2>, c: f32 }
            @group(0) @binding(1) var<storage, read> outers: array<Outer>;
            @group(0) @binding(0) var<storage, read_write> words: array<atomic<u32>>;
            @group(1) @binding(0) var<storage, read> other: array<f32>;
            @group(0) @binding(2) var made: texture_storage_2d<r32float, write>;
            @compute @workgroup_size(1) fn main() {
                atomicAdd(&words[0], outers[0].inner[0].b);
                textureStore(made, vec2(0), vec4(other[0]));
            }";
        let module = naga::front::wgsl::parse_str(source).expect("WGSL");
        let found = declared("frame/some.wgsl", &module);
        let names: Vec<_> = found.iter().map(|d| d.name.as_str()).collect();
        assert_eq!(names, ["some.words", "some.outers", "some.made"]);
        let values = |i: usize| match &found[i].kind {
            Kind::Buffer(values) => values,
            kind => panic!("{kind:?}"),
        };
        assert_eq!(values(1).stride, 48);
        let leaf = |name: &str, offset, components, is_float| Leaf {
            name: name.to_owned(),
            offset,
            components,
            is_float,
        };
        assert_eq!(
            values(1).leaves,
            [
                leaf("Inner.a", 0, 3, true),
                leaf("Inner.b", 12, 1, false),
                leaf("Inner.a", 16, 3, true),
                leaf("Inner.b", 28, 1, false),
                leaf("Outer.c", 32, 1, true),
            ]
        );
        assert_eq!(values(0).stride, 4);
        assert_eq!(values(0).leaves, [leaf("some.words", 0, 1, false)]);
        assert!(matches!(found[2].kind, Kind::Written));
    }
}
