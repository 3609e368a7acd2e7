//! The two containers: GLB chunks (glTF 2.0, chapter 4), and plain JSON.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use raycam_scene::{ErrorCode, NoticeCode, counted};
use serde::Deserialize;
use serde::de::{DeserializeOwned, IgnoredAny};

use crate::error::{FormatError, Result};
use crate::gltf::document::memory_allowance::MemoryAllowance;
use crate::gltf::json::Root;
use crate::gltf::json::lenient::json_words;
use crate::gltf::json::objects_only::ObjectsOnly;
use crate::gltf::json::omissions::{Omission, omit_invalid_values};
use crate::io::{Diagnostics, InputFile};

const MAGIC: &[u8; 4] = b"glTF";
const JSON: &[u8; 4] = b"JSON";
const BIN: &[u8; 4] = b"BIN\0";

/// Byte ranges of the document and of the binary chunk in a file.
pub(crate) struct Container {
    pub(crate) json: Range<usize>,
    /// Bytes of the buffer that has no URI: the binary chunk of a GLB file.
    pub(crate) binary: Option<Range<usize>>,
}

/// Number of bytes before the content of a GLB file's binary chunk, if that chunk extends to the end of the file.
pub(crate) fn head(mut file: &File, size: u64) -> Option<u64> {
    let (mut start, mut chunk) = ([0; 20], [0; 8]);
    file.read_exact(&mut start).ok()?;
    let (words, _) = start.as_chunks::<4>();
    let word = |i: usize| u64::from(u32::from_le_bytes(words[i]));
    let json = 20 + word(3);
    if words[0] != *MAGIC || words[4] != *JSON || word(2) != size || json > size {
        return None;
    }
    file.seek(SeekFrom::Start(json)).ok()?;
    file.read_exact(&mut chunk).ok()?;
    let (words, _) = chunk.as_chunks::<4>();
    let binary = u64::from(u32::from_le_bytes(words[0]));
    (words[1] == *BIN && json + 8 + binary == size).then_some(json + 8)
}

impl Container {
    /// Opens a GLB file, which is recognised by its magic number, or a JSON file.
    pub(crate) fn open(source: &InputFile, diagnostics: &mut Diagnostics) -> Result<Self> {
        let bytes = &source.bytes;
        if bytes.starts_with(MAGIC) {
            let length = glb_length(source, diagnostics)?;
            return Self::from_chunks(source, length, diagnostics);
        }
        let start = if bytes.starts_with(b"\xef\xbb\xbf") {
            diagnostics.note(
                NoticeCode::InvalidFile,
                "the file",
                "the JSON begins with a byte order mark \
                (INVALID_JSON)",
            );
            3
        } else {
            0
        };
        Ok(Self { json: start..bytes.len(), binary: None })
    }

    /// Finds the chunks of a GLB file of `length` bytes.
    fn from_chunks(source: &InputFile, length: usize, diagnostics: &mut Diagnostics) -> Result<Self> {
        let InputFile { path, bytes, .. } = source;
        let fault = |code: ErrorCode, at: usize, message: &str| Err(FormatError::byte(path, at, code.message(message)));
        let truncated = |at: usize, message: &str| fault(ErrorCode::TruncatedFile, at, message);
        let (mut json, mut binary) = (None, None);
        let mut at = 12;
        while at < length {
            let (Some(size), Some(kind)) = (word(bytes, at), bytes.get(at + 4..at + 8)) else {
                return truncated(at, "the file ends inside a chunk's header (GLB_UNEXPECTED_END_OF_CHUNK_HEADER)");
            };
            let start = at + 8;
            let end = start + size as usize;
            if end > length {
                let message = format!(
                    "a chunk declares {size} bytes, but {} are left (GLB_UNEXPECTED_END_OF_CHUNK_DATA)",
                    length.saturating_sub(start)
                );
                return truncated(at, &message);
            }
            match (kind, json.is_none()) {
                (kind, true) if kind == JSON => json = Some(start..end),
                (_, true) => {
                    return fault(ErrorCode::Syntax, at, "the first chunk is not JSON (GLB_UNEXPECTED_FIRST_CHUNK)");
                }
                (kind, false) if kind == BIN && binary.is_none() => binary = Some(start..end),
                (kind, false) if kind == BIN || kind == JSON => {
                    return fault(
                        ErrorCode::DuplicateName,
                        at,
                        "a second chunk of the same type (GLB_DUPLICATE_CHUNK)",
                    );
                }
                _ => {
                    let message = "chunks of unknown types are ignored (GLB_UNKNOWN_CHUNK_TYPE)";
                    diagnostics.note(NoticeCode::IgnoredElement, "the file", message);
                }
            }
            at = end;
        }
        match json {
            Some(json) => Ok(Self { json, binary }),
            None => fault(ErrorCode::MissingValue, length, "no JSON chunk (GLB_UNEXPECTED_FIRST_CHUNK)"),
        }
    }

    /// Parses the document: JSON text of a supported glTF version. Invalid optional values are omitted, with a notice for
    /// each.
    pub(crate) fn document(
        &self,
        bytes: &[u8],
        path: &Path,
        diagnostics: &mut Diagnostics,
        allowance: &MemoryAllowance,
    ) -> Result<Root> {
        let text = std::str::from_utf8(&bytes[self.json.clone()]).map_err(|error| {
            let at = self.json.start + error.valid_up_to();
            FormatError::byte(path, at, ErrorCode::NotText.message("invalid UTF-8 (INVALID_JSON)"))
        })?;
        // Some programs pad the chunk with zeros instead of spaces.
        let text = text.trim_end_matches('\0');
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        // Tracking the JSON path takes time, so the path is determined only for errors.
        let root = match parse_objects::<Root>(text) {
            Ok(root) => root,
            Err(error) => {
                // Other versions of glTF have different keys, so the version is checked first.
                let root = serde_json::from_str::<AnyVersion>(text);
                root.map_or(Ok(()), |root| {
                    let version = &root.asset.version;
                    let text = version.as_str().map_or(version.to_string(), str::to_owned);
                    check_version(&text, path)
                })?;
                // If the syntax is invalid or the repair needs too much memory, the original error is reported.
                let can_be_repaired = serde_json::from_str::<IgnoredAny>(text).is_ok()
                    && allowance.charge(path, "the JSON", values_of(text), 64).is_ok();
                let root = can_be_repaired.then(|| without_invalid_values(text, diagnostics)).flatten();
                root.ok_or_else(|| json_error(text, path, &error))?
            }
        };
        let Some(asset) = &root.asset else {
            return Err(FormatError::whole(
                path,
                ErrorCode::WrongFormat.message("asset: missing (UNDEFINED_PROPERTY); is this a glTF file?"),
            ));
        };
        check_version(&asset.version, path)?;
        if let Some(least) = asset.min_version.as_ref().filter(|v| *v != "2.0") {
            let message = format!(
                "asset.minVersion {least:?} is not supported; expected glTF 2.0 \
                    (ASSET_MIN_VERSION_GREATER_THAN_VERSION)"
            );
            return Err(FormatError::unsupported(path, message));
        }
        Ok(root)
    }
}

/// Little-endian number at a byte offset, if the file contains it.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at + 4)?.try_into().ok()?;
    Some(u32::from_le_bytes(word))
}

/// Length declared by the header of a GLB file, after validation.
fn glb_length(source: &InputFile, diagnostics: &mut Diagnostics) -> Result<usize> {
    let InputFile { path, bytes, .. } = source;
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        let message = "the file ends inside its header (GLB_UNEXPECTED_END_OF_HEADER)";
        return Err(FormatError::byte(path, bytes.len(), ErrorCode::TruncatedFile.message(message)));
    };
    if version != 2 {
        let message = format!("GLB version {version} is not supported (GLB_INVALID_VERSION); expected version 2");
        return Err(FormatError::unsupported(path, message));
    }
    let length = length as usize;
    if length > source.len() || length < 12 {
        let message = format!("{length} bytes declared, but the file has {} (GLB_LENGTH_MISMATCH)", source.len());
        return Err(FormatError::byte(path, 8, ErrorCode::TruncatedFile.message(message)));
    }
    if length < source.len() {
        let extra = counted(source.len() - length, "byte");
        let message = format!("{extra} after the declared end ignored (GLB_LENGTH_MISMATCH)");
        diagnostics.note(NoticeCode::TrailingData, "the file", message);
    }
    Ok(length)
}

/// Keys common to documents of every version.
#[derive(Deserialize)]
struct AnyVersion {
    asset: AnyAsset,
}

#[derive(Deserialize)]
struct AnyAsset {
    /// The version: a string in glTF 2.0, a number in drafts of glTF 1.0.
    version: serde_json::Value,
}

/// Rejects glTF versions other than 2.
fn check_version(version: &str, path: &Path) -> Result<()> {
    if version.split('.').next() == Some("2") {
        return Ok(());
    }
    let message = format!(
        "asset.version {version:?} is not supported (UNKNOWN_ASSET_MAJOR_VERSION); expected glTF \
        2.0"
    );
    Err(FormatError::unsupported(path, message))
}

/// Parses a document. A list in place of an object is an error, although serde would accept it as the object's fields.
fn parse_objects<T: DeserializeOwned>(text: &str) -> serde_json::Result<T> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let root = T::deserialize(ObjectsOnly(&mut reader))?;
    reader.end()?;
    Ok(root)
}

/// Codes of the glTF Validator for values of another type or length, and for missing values.
const INVALID_VALUE: &str = "TYPE_MISMATCH, ARRAY_LENGTH_NOT_IN_LIST or UNDEFINED_PROPERTY";

/// Upper limit of the number of values in a JSON text, apart from the root.
fn values_of(text: &str) -> u64 {
    text.bytes().filter(|byte| matches!(byte, b',' | b'[' | b'{')).count() as u64
}

/// Parses a document without its invalid optional values; `None` if other values are invalid as well.
fn without_invalid_values(text: &str, diagnostics: &mut Diagnostics) -> Option<Root> {
    let mut json = serde_json::from_str(text).ok()?;
    let omitted = omit_invalid_values(&mut json);
    let root = Root::deserialize(ObjectsOnly(&json)).ok()?;
    for Omission { place, fault } in omitted {
        diagnostics.note(NoticeCode::IgnoredElement, place, format!("omitted: {fault} ({INVALID_VALUE})"));
    }
    Some(root)
}

/// Error with its position in the document.
fn json_error(text: &str, path: &Path, error: &serde_json::Error) -> FormatError {
    let reader = &mut serde_json::Deserializer::from_str(text);
    let found: Result<Root, _> = serde_path_to_error::deserialize(ObjectsOnly(reader));
    let (code, issue) = match error.classify() {
        serde_json::error::Category::Data => (ErrorCode::WrongType, INVALID_VALUE),
        _ => (ErrorCode::Syntax, "INVALID_JSON"),
    };
    match found {
        Err(found) if found.path().to_string() != "." => {
            let (place, inner) = (found.path().to_string(), found.into_inner());
            let message = format!("{place}: {} ({issue})", json_words(&inner.to_string()));
            FormatError::line(path, inner.line(), code.message(message))
        }
        _ => {
            let message = format!("{} ({issue})", json_words(&error.to_string()));
            FormatError::line(path, error.line().max(1), code.message(message))
        }
    }
}
