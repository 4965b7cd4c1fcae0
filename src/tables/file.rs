//! Table files: safetensors with one metadata entry.
//!
//! The entry `cumuli` holds the [`Description`] as JSON. It is the only one, since safetensors
//! orders several at random and equal tables shall have equal bytes. Tensors:
//!
//! - `optical_depth.NAME`, u32, `[direction v, direction u, disc v, disc u]`: texels of
//!   `optical_depth::encoding` at the places of `optical_depth::mapping`.
//!
//! Nothing is believed before it is checked: sizes against the file, names and shapes against the
//! description, values against their ranges and their fingerprint.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use safetensors::tensor::{Dtype, SafeTensors, TensorView};

use super::TableSet;
use super::description::{Description, FORMAT};
use super::fingerprint::Fingerprint;
use super::optical_depth::{Grid, OpticalDepthTable};
use crate::error::{Error, Result};

/// Name of the metadata entry.
const ENTRY: &str = "cumuli";
/// Largest file that is read: 20 times the largest set worth baking.
const MOST_BYTES: u64 = 1 << 30;
/// Longest header: the description of a hundred shapes takes 100 KiB.
const MOST_HEADER_BYTES: u64 = 4 << 20;
/// Bytes of the header's length, at the beginning of a file.
const LENGTH_BYTES: usize = 8;
/// Bytes of a value of an optical depth table.
const TEXEL_BYTES: usize = 4;

/// Reads a file after a look at its size.
pub(super) fn bytes_of(path: &Path) -> Result<Vec<u8>> {
    let file = File::open(path).map_err(|e| Error::io(path, "read", e))?;
    let metadata = file.metadata().map_err(|e| Error::io(path, "read", e))?;
    let place = path.display().to_string();
    if !metadata.is_file() {
        return Err(Error::input(place, "expected a table file, found something else"));
    }
    if metadata.len() > MOST_BYTES {
        return Err(Error::input(
            place,
            format!("expected at most {MOST_BYTES} bytes, found {}", metadata.len()),
        ));
    }
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    // A file that grows meanwhile is cut off, and refused as damaged.
    file.take(MOST_BYTES).read_to_end(&mut bytes).map_err(|e| Error::io(path, "read", e))?;
    Ok(bytes)
}

/// The bytes of a table file; the same for the same tables.
pub(super) fn write(tables: &TableSet) -> Result<Vec<u8>> {
    let mut tensors = Vec::new();
    for table in tables.optical_depth() {
        let mut shape = table.grid().nodes;
        shape.reverse();
        let bytes: Vec<u8> = table.texels().iter().flat_map(|t| t.to_le_bytes()).collect();
        tensors.push((tensor_name(table), Dtype::U32, shape.to_vec(), bytes));
    }
    let mut values = Fingerprint::default();
    let mut views = Vec::new();
    for (name, dtype, shape, bytes) in &tensors {
        values.add(bytes);
        let view = TensorView::new(*dtype, shape.clone(), bytes)
            .map_err(|e| Error::input(name.as_str(), e.to_string()))?;
        views.push((name.as_str(), view));
    }
    let description = Description { values: values.to_string(), ..tables.description() };
    let text = serde_json::to_string(&description)
        .map_err(|e| Error::input("description of the tables", e.to_string()))?;
    safetensors::serialize(views, Some(HashMap::from([(ENTRY.to_owned(), text)])))
        .map_err(|e| Error::input("tables", e.to_string()))
}

/// Reads the bytes of a table file. `place` names it in errors.
pub(super) fn read(bytes: &[u8], place: &str) -> Result<TableSet> {
    let refuse = |message: &str| Err(Error::input(place, message));
    let Some(length) = bytes.first_chunk::<LENGTH_BYTES>() else {
        return refuse("expected a table file, found fewer than 8 bytes");
    };
    let length = u64::from_le_bytes(*length);
    if length > MOST_HEADER_BYTES || length > (bytes.len() - LENGTH_BYTES) as u64 {
        return refuse("expected a table file, found no safetensors header (truncated or foreign)");
    }
    let header = SafeTensors::read_metadata(bytes);
    let (_, metadata) = match header {
        Ok(header) => header,
        Err(e) => return refuse(&format!("the safetensors file is damaged: {e}")),
    };
    let Some(text) = metadata.metadata().as_ref().and_then(|m| m.get(ENTRY)) else {
        return refuse("expected tables made by precompute, found a foreign safetensors file");
    };
    let description = parse(text, place)?;
    let tensors = SafeTensors::deserialize(bytes)
        .map_err(|e| Error::input(place, format!("the safetensors file is damaged: {e}")))?;
    let mut values = Fingerprint::default();
    let mut optical_depth = Vec::new();
    let depth = &description.optical_depth;
    for entry in &depth.shapes {
        let name = format!("optical_depth.{}", entry.shape);
        let field = |message: String| Error::input(format!("{place}: {name}"), message);
        let tensor =
            tensors.tensor(&name).map_err(|_| field("the tensor is missing".to_owned()))?;
        let (n, m) = (depth.options.disc, depth.options.direction);
        let expected = [m, m, n, n];
        if tensor.dtype() != Dtype::U32 || tensor.shape() != expected {
            return Err(field(format!(
                "expected u32 {expected:?}, found {:?} {:?}",
                tensor.dtype(),
                tensor.shape()
            )));
        }
        values.add(tensor.data());
        let (texels, _) = tensor.data().as_chunks::<TEXEL_BYTES>();
        let texels = texels.iter().map(|t| u32::from_le_bytes(*t)).collect();
        let grid = Grid { nodes: [n, n, m, m] };
        let table = OpticalDepthTable::from_parts(
            entry.shape,
            entry.mean_density,
            grid,
            texels,
            entry.errors.clone(),
        );
        optical_depth.push(table.map_err(|e| field(e.to_string()))?);
    }
    if tensors.len() != optical_depth.len() {
        return refuse("there are tensors that the description does not name");
    }
    if values.to_string() != description.values {
        return refuse("the values are damaged: their fingerprint differs from the recorded one");
    }
    TableSet::new(optical_depth, depth.options).map_err(|e| Error::input(place, e.to_string()))
}

fn parse(text: &str, place: &str) -> Result<Description> {
    /// What all versions have.
    #[derive(serde::Deserialize)]
    struct Version {
        format: u32,
    }
    let refuse = |e: serde_json::Error| Error::input(format!("{place}: metadata"), e.to_string());
    let version: Version = serde_json::from_str(text).map_err(refuse)?;
    if version.format != FORMAT {
        return Err(Error::input(
            format!("{place}: format"),
            format!(
                "expected version {FORMAT}, found {}; bake the tables anew with precompute",
                version.format
            ),
        ));
    }
    let description: Description = serde_json::from_str(text).map_err(refuse)?;
    description.check(place)?;
    Ok(description)
}

fn tensor_name(table: &OpticalDepthTable) -> String {
    format!("optical_depth.{}", table.spec())
}
