//! The header of a table file: what can be refused before the values are read.
//!
//! A safetensors file begins with the length of its header and the header, JSON that names every
//! tensor. Only the header decides whether a file is one of ours, so a foreign file of any size
//! costs no more than its header.

use std::collections::{HashMap, HashSet};
use std::fmt;

use serde::de::{Deserialize, Deserializer, IgnoredAny, MapAccess, Visitor};

use super::description::{Description, FORMAT};
use crate::error::{Error, Result};

/// Name of the metadata entry.
pub(super) const ENTRY: &str = "cumuli";
/// Key of the metadata in a safetensors header.
const METADATA: &str = "__metadata__";
/// Longest header: the description of a hundred shapes takes 100 KiB.
const MOST_BYTES: u64 = 4 << 20;
/// Bytes of the header's length, at the beginning of a file.
pub(super) const LENGTH_BYTES: usize = 8;

/// Length of the header by the first bytes of a file of `whole` bytes. `place` names it in errors.
pub(super) fn length(first: &[u8], whole: u64, place: &str) -> Result<usize> {
    let refuse = |message: &str| Err(Error::input(place, message));
    let Some(length) = first.first_chunk::<LENGTH_BYTES>() else {
        return refuse("expected a table file, found fewer than 8 bytes");
    };
    let length = u64::from_le_bytes(*length);
    if length > MOST_BYTES || length > whole.saturating_sub(LENGTH_BYTES as u64) {
        return refuse("expected a table file, found no safetensors header (truncated or foreign)");
    }
    Ok(length as usize)
}

/// What a header says of the tables.
pub(super) fn description(header: &[u8], place: &str) -> Result<Description> {
    let header: Header = serde_json::from_slice(header).map_err(|e| {
        Error::input(format!("{place}: header"), format!("is damaged: {}", one_line(&e)))
    })?;
    let Some(text) = header.metadata.as_ref().and_then(|m| m.get(ENTRY)) else {
        let message = "expected tables made by precompute, found a foreign safetensors file";
        return Err(Error::input(place, message));
    };
    parse(text, place)
}

fn parse(text: &str, place: &str) -> Result<Description> {
    /// What all versions have.
    #[derive(serde::Deserialize)]
    struct Version {
        format: u32,
    }
    let refuse = |e: serde_json::Error| Error::input(format!("{place}: metadata"), one_line(&e));
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
    let mut json = serde_json::Deserializer::from_str(text);
    let description: Description = serde_path_to_error::deserialize(&mut json).map_err(|e| {
        let field = format!("{place}: metadata.{}", one_line(e.path()));
        Error::input(field, one_line(&e.into_inner()))
    })?;
    description.check(place)?;
    Ok(description)
}

/// Messages, and paths of fields, quote what was found, line ends included.
pub(super) fn one_line(error: &impl ToString) -> String {
    let line: String =
        error.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    // Names out of a hostile file may be of any length.
    line.chars().take(300).collect()
}

/// The keys of a header, each once, and its metadata.
struct Header {
    metadata: Option<HashMap<String, String>>,
}

impl<'de> Deserialize<'de> for Header {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_map(Keys)
    }
}

struct Keys;

impl<'de> Visitor<'de> for Keys {
    type Value = Header;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the header of a safetensors file")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Header, A::Error> {
        let mut header = Header { metadata: None };
        let mut seen = HashSet::new();
        while let Some(key) = map.next_key::<String>()? {
            if key == METADATA {
                header.metadata = Some(map.next_value()?);
            } else {
                map.next_value::<IgnoredAny>()?;
            }
            if let Some(twice) = seen.replace(key) {
                return Err(serde::de::Error::custom(format!("{twice} is in it twice")));
            }
        }
        Ok(header)
    }
}
