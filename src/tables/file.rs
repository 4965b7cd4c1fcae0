//! Table files: safetensors with one metadata entry.
//!
//! The entry `cumuli` holds the [`Description`] as JSON. It is the only one, since safetensors
//! orders several at random and equal tables shall have equal bytes. Tensors:
//!
//! - `density.NAME`, u8, `[z, y, x]`: the density volume of a shape over -1..1, 255 is density 1.
//! - `optical_depth.NAME`, u32, `[direction v, direction u, disc v, disc u]`: texels of
//!   `optical_depth::encoding` at the places of `optical_depth::mapping`.
//! - `scattering.PHASE@ALBEDO`, f16 or f32, `[optical radius, incidence, azimuth, view-sun angle, 2]`:
//!   the values of `scattering`.
//!
//! Nothing is believed before it is checked: sizes against the file, names and shapes against the
//! description, values against their ranges and their fingerprint.

use std::collections::HashMap;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use safetensors::tensor::{Dtype, SafeTensors, TensorView};

use super::TableSet;
use super::description::{Description, MediumDescription};
use super::fingerprint::Fingerprint;
use super::header::{self, ENTRY, LENGTH_BYTES, one_line};
use super::optical_depth::volume::DensityVolume;
use super::optical_depth::{Grid, OpticalDepthTable};
use super::scattering::{Precision, ScatteringTable};
use crate::error::{Error, Result};
use crate::medium::shape::VOLUME_NODES;
use crate::medium::{Phase, ShapeSpec};

/// Largest file that is read: 20 times the largest set worth baking.
const MOST_BYTES: u64 = 1 << 30;
/// Bytes of a value of an optical depth table.
const TEXEL_BYTES: usize = 4;
/// Bytes of a value of a scattering table, in half and in single precision.
const HALF_BYTES: usize = 2;
const SINGLE_BYTES: usize = 4;

/// Reads a file after a look at its size.
pub(super) fn bytes_of(path: &Path) -> Result<Vec<u8>> {
    let place = path.display().to_string();
    let refuse = |message: String| Err(Error::input(place.clone(), message));
    let unreadable = |e: std::io::Error| match e.kind() {
        ErrorKind::NotFound => {
            Error::input(place.clone(), "there is no such file, expected a table file")
        }
        _ => Error::io(path, "read", e),
    };
    let mut file = File::open(path).map_err(unreadable)?;
    let metadata = file.metadata().map_err(unreadable)?;
    if metadata.is_dir() {
        return refuse("is a folder, expected a table file".to_owned());
    }
    if !metadata.is_file() {
        return refuse("is not a plain file, expected a table file".to_owned());
    }
    let whole = metadata.len();
    if whole > MOST_BYTES {
        return refuse(format!("expected at most {MOST_BYTES} bytes, found {whole}"));
    }
    let mut bytes = Vec::new();
    let mut read = |bytes: &mut Vec<u8>, count: u64| {
        bytes.reserve_exact(count as usize);
        // A file that shrinks or grows meanwhile is cut off, and refused as damaged.
        file.by_ref().take(count).read_to_end(bytes).map_err(unreadable)
    };
    // A file that is none of ours is not read any further than needed to know.
    read(&mut bytes, whole.min(LENGTH_BYTES as u64))?;
    let length = header::length(&bytes, whole, &place)?;
    read(&mut bytes, length as u64)?;
    header::description(&bytes[LENGTH_BYTES.min(bytes.len())..], &place)?;
    read(&mut bytes, whole - (LENGTH_BYTES + length) as u64)?;
    Ok(bytes)
}

/// The bytes of a table file; the same for the same tables.
pub(super) fn write(tables: &TableSet) -> Result<Vec<u8>> {
    let mut tensors = Vec::new();
    for table in tables.optical_depth() {
        let mut shape = table.grid().nodes;
        shape.reverse();
        let bytes: Vec<u8> = table.texels().iter().flat_map(|t| t.to_le_bytes()).collect();
        tensors.push((shape_name(table.spec()), Dtype::U32, shape.to_vec(), bytes));
        let volume = table.volumes()[0].bytes().to_vec();
        tensors.push((density_name(table.spec()), Dtype::U8, vec![VOLUME_NODES; 3], volume));
    }
    for table in tables.scattering() {
        let [radii, incidences, azimuths, angles] = table.resolution();
        let shape = vec![radii, incidences, azimuths, angles];
        let (dtype, bytes): (_, Vec<u8>) = match table.precise_values() {
            Some(values) => (Dtype::F32, values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            None => (Dtype::F16, table.values().iter().flat_map(|v| v.to_le_bytes()).collect()),
        };
        let name = scattering_name(table.phase(), table.albedo());
        tensors.push((name, dtype, shape, bytes));
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
    let length = header::length(bytes, bytes.len() as u64, place)?;
    let description = header::description(&bytes[LENGTH_BYTES..LENGTH_BYTES + length], place)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(|e| {
        let message = format!("the safetensors file is damaged: {}", one_line(&e));
        Error::input(place, message)
    })?;
    let mut values = Fingerprint::default();
    let depth = &description.optical_depth;
    let mut optical_depth = Vec::with_capacity(depth.shapes.len());
    for entry in &depth.shapes {
        let name = shape_name(entry.shape);
        let field = |message: String| Error::input(format!("{place}: {name}"), message);
        let (n, m) = (depth.options.disc, depth.options.direction);
        let data = tensor(&tensors, &name, Dtype::U32, &[m, m, n, n]).map_err(field)?;
        values.add(data);
        let (texels, _) = data.as_chunks::<TEXEL_BYTES>();
        let texels = texels.iter().map(|t| u32::from_le_bytes(*t)).collect();
        let grid = Grid { nodes: [n, n, m, m] };
        let name = density_name(entry.shape);
        let field = |message: String| Error::input(format!("{place}: {name}"), message);
        let data = tensor(&tensors, &name, Dtype::U8, &[VOLUME_NODES; 3]).map_err(field)?;
        values.add(data);
        let table = DensityVolume::from_bytes(data.to_vec()).and_then(|volume| {
            let (mean, errors) = (entry.mean_density, entry.errors.clone());
            OpticalDepthTable::from_parts(entry.shape, mean, volume, grid, texels, errors)
        });
        optical_depth.push(table.map_err(|e| Error::input(place, e.to_string()))?);
    }
    let mut scattering = Vec::with_capacity(description.scattering.media.len());
    for medium in description.scattering.media {
        let name = scattering_name(&medium.phase, medium.albedo);
        let field = |message: String| Error::input(format!("{place}: {name}"), message);
        let dtype = match medium.precision {
            Precision::F16 => Dtype::F16,
            Precision::F32 => Dtype::F32,
        };
        let data = tensor(&tensors, &name, dtype, &medium.resolution).map_err(field)?;
        values.add(data);
        let MediumDescription { phase, albedo, resolution, optical_radius, .. } = medium;
        let table = match medium.precision {
            Precision::F16 => {
                let (halves, _) = data.as_chunks::<HALF_BYTES>();
                let v = halves.iter().map(|h| half::f16::from_le_bytes(*h)).collect();
                let report = medium.report;
                ScatteringTable::from_parts(phase, albedo, resolution, optical_radius, v, report)
            }
            Precision::F32 => {
                let (singles, _) = data.as_chunks::<SINGLE_BYTES>();
                let v = singles.iter().map(|s| f32::from_le_bytes(*s)).collect();
                let (range, report) = (optical_radius, medium.report);
                ScatteringTable::from_precise_parts(phase, albedo, resolution, range, v, report)
            }
        };
        scattering.push(table.map_err(|e| Error::input(place, e.to_string()))?);
    }
    if tensors.len() != 2 * optical_depth.len() + scattering.len() {
        return refuse("there are tensors that the description does not name");
    }
    if values.to_string() != description.values {
        return refuse("the values are damaged: their fingerprint differs from the recorded one");
    }
    TableSet::new(optical_depth, depth.options, scattering)
        .map_err(|e| Error::input(place, e.to_string()))
}

/// The bytes of a tensor of this type and shape.
fn tensor<'a>(
    tensors: &SafeTensors<'a>,
    name: &str,
    dtype: Dtype,
    shape: &[usize],
) -> std::result::Result<&'a [u8], String> {
    let tensor = tensors.tensor(name).map_err(|_| "the tensor is missing".to_owned())?;
    if tensor.dtype() != dtype || tensor.shape() != shape {
        return Err(format!(
            "expected {dtype} {shape:?}, found {} {:?}",
            tensor.dtype(),
            tensor.shape()
        ));
    }
    Ok(tensor.data())
}

fn shape_name(shape: ShapeSpec) -> String {
    format!("optical_depth.{shape}")
}

fn density_name(shape: ShapeSpec) -> String {
    format!("density.{shape}")
}

fn scattering_name(phase: &Phase, albedo: f64) -> String {
    format!("scattering.{phase}@{albedo}")
}
