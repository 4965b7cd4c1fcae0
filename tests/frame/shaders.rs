//! Every shader file of the tree composes, and passes naga's validation.

use std::fs;
use std::path::{Path, PathBuf};

use cumuli::gpu::ShaderLibrary;
use naga::valid::{Capabilities, ValidationFlags, Validator};

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the shaders' folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "wgsl") {
            found.push(path);
        }
    }
}

#[test]
fn all_files_compose_and_validate() {
    let library = ShaderLibrary::new().expect("modules");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut paths = Vec::new();
    files(&root, &mut paths);
    paths.sort();
    let mut entry_points = 0;
    for path in &paths {
        let name = path.display().to_string();
        let text = fs::read_to_string(path).expect(&name);
        let module = text.lines().find_map(|line| line.strip_prefix("#define_import_path "));
        // A module is composed as part of an empty pass, which fails where no list names it.
        let text = match module {
            Some(module) => format!("#import {module}\n@compute @workgroup_size(1) fn main() {{}}"),
            None => text,
        };
        let composed = library.compose(&name, &text, &[("STEPS", 4), ("SCREEN_TILE", 8)]);
        let composed = composed.unwrap_or_else(|e| panic!("{name}: {e}"));
        for lighting in ["OCTAVES", "ALONE", "GRIDLESS"] {
            let defs = [("STEPS", 4), ("SCREEN_TILE", 8), (lighting, 1)];
            library.compose(&name, &text, &defs).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
        // No capability beyond WebGPU's core, which has f16 packed in u32.
        let core = Capabilities::SHADER_FLOAT16_IN_FLOAT32;
        let mut validator = Validator::new(ValidationFlags::all(), core);
        validator.validate(&composed).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        assert!(!composed.entry_points.is_empty(), "{name} has neither entry point nor path");
        entry_points += composed.entry_points.len();
    }
    assert!(paths.len() > 20 && entry_points >= paths.len(), "{paths:?}");
}

/// lavapipe of Mesa 22.3 overwrites memory where a branch depends on a shader's eighth uniform buffer or a
/// later one (`last_level` in shaders/shared/light_field.wgsl).
#[test]
fn uniform_buffers_are_few() {
    let library = ShaderLibrary::new().expect("modules");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut paths = Vec::new();
    files(&root, &mut paths);
    let mut most = 0;
    for path in &paths {
        let name = path.display().to_string();
        let text = fs::read_to_string(path).expect(&name);
        if text.contains("#define_import_path ") {
            continue;
        }
        let composed =
            library.compose(&name, &text, &[("STEPS", 4), ("SCREEN_TILE", 8), ("LIT", 1)]);
        let composed = composed.unwrap_or_else(|e| panic!("{name}: {e}"));
        let core = Capabilities::SHADER_FLOAT16_IN_FLOAT32;
        let mut validator = Validator::new(ValidationFlags::all(), core);
        let info = validator.validate(&composed).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        for entry in 0..composed.entry_points.len() {
            let uses = info.get_entry_point(entry);
            let uniforms = composed.global_variables.iter().filter(|(handle, global)| {
                global.space == naga::AddressSpace::Uniform && !uses[*handle].is_empty()
            });
            let count = uniforms.count();
            // The marcher's eighth is the light grid's, last of all, whose loops are kept from it.
            let bound = if name.ends_with("bench/march.wgsl") { 8 } else { 7 };
            assert!(count <= bound, "{name}: {count} uniform buffers");
            most = most.max(count);
        }
    }
    assert_eq!(most, 8, "the marcher lit by the frame");
}

/// A number that keeps others from being divided by 0 or from overflowing has a name, with its unit
/// and the limit in which it is exact beside it.
#[test]
fn guards_have_names() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut paths = Vec::new();
    files(&root, &mut paths);
    let guards = include_str!("../../docs/numeric-guards.md");
    let (mut nameless, mut unlisted) = (Vec::new(), Vec::new());
    for path in &paths {
        let text = fs::read_to_string(path).expect("readable");
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or_default();
            // Written with an exponent: nothing but guards and scales is.
            let exponent =
                code.split(|c: char| !(c.is_ascii_alphanumeric() || c == '.' || c == '-'));
            let exponent = exponent.map(|word| word.trim_start_matches('-')).any(|word| {
                word.starts_with(|c: char| c.is_ascii_digit())
                    && !word.starts_with("0x")
                    && word.contains('e')
            });
            let constant = code.trim_start().strip_prefix("const ");
            let name = constant.and_then(|rest| rest.split([':', ' ']).next());
            if let Some(name) =
                name.filter(|name| exponent && !guards.contains(&format!("`{name}`")))
            {
                unlisted.push(name.to_owned());
            }
            if exponent && constant.is_none() {
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                nameless.push(format!("{name}:{}: {}", number + 1, code.trim()));
            }
        }
    }
    assert!(nameless.is_empty(), "{}:\n{}", nameless.len(), nameless.join("\n"));
    assert!(unlisted.is_empty(), "not in docs/numeric-guards.md: {unlisted:?}");
}
