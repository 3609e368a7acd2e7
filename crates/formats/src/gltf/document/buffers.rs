//! Buffers, their views and images: in the GLB file, in data URIs, and in files of the same folder.

use std::borrow::Cow;
use std::io;
use std::ops::Range;
use std::path::Path;

use raycam_scene::{ErrorCode, Notice, NoticeCode};

use crate::codec::meshopt::{self, Filter, Mode, ViewHeader};
use crate::error::{FormatError, Result};
use crate::gltf::document::container::Container;
use crate::gltf::document::memory_allowance::MemoryAllowance;
use crate::gltf::json::extensions::MeshoptView;
use crate::gltf::json::{BufferView, Root};
use crate::io::{AssetRoot, ByteSource, Diagnostics, InputFile, companion};

/// All buffers and buffer views of a document.
pub(crate) struct Resources<'a> {
    buffers: Vec<ByteSource<'a>>,
    views: Vec<View>,
}

struct View {
    bytes: ViewStorage,
    stride: Option<usize>,
}

enum ViewStorage {
    /// Index of the buffer that contains the view, and the view's byte range in this buffer.
    Plain(usize, Range<usize>),
    /// Bytes of a view that has been decompressed.
    Decoded(Vec<u8>),
}

impl<'a> Resources<'a> {
    /// Reads every buffer and decompresses the compressed views.
    pub(crate) fn read(
        source: &'a InputFile,
        container: &Container,
        root: &Root,
        assets: &mut AssetRoot,
        diagnostics: &mut Diagnostics,
        allowance: &MemoryAllowance,
    ) -> Result<Self> {
        let mut buffers = Vec::new();
        for (i, buffer) in root.buffers.iter().enumerate() {
            let place = format!("buffers[{i}]");
            let fault = |code: ErrorCode, message: String| {
                FormatError::whole(&source.path, code.message(format!("{place}{message}")))
            };
            // A buffer is not required if all its views are compressed, because their bytes come from another buffer.
            let mut views = root.buffer_views.iter();
            let unused = views.all(|view| view.buffer != i || is_compressed(view));
            let bytes = match (&buffer.uri, &container.binary) {
                (Some(uri), _) => {
                    let mut notices = Vec::new();
                    let bytes = read_uri(source, uri, &format!("{place}.uri"), assets, &mut notices)?;
                    assets.budget_and_notices().1.append(&mut notices);
                    allowance.grant(bytes.len());
                    ByteSource::Memory(bytes.into())
                }
                (None, Some(range)) if i == 0 => {
                    let bytes = source.part(range.clone());
                    if buffers_hold_only_accessors(root) {
                        bytes
                    } else {
                        let bytes = bytes.read().map_err(|error| read_error(&source.path, error))?;
                        ByteSource::Memory(bytes)
                    }
                }
                (None, _) if unused => {
                    buffers.push(ByteSource::Memory(Cow::Borrowed(&[])));
                    continue;
                }
                (None, _) => {
                    let message = ".uri: missing, and the file has no binary chunk for this buffer \
                        (BUFFER_MISSING_GLB_DATA)";
                    return Err(fault(ErrorCode::MissingValue, message.into()));
                }
            };
            if (bytes.len() as u64) < buffer.byte_length {
                return Err(fault(
                    ErrorCode::TruncatedFile,
                    format!(
                        ".byteLength: {} declared, but there are only {} bytes (BUFFER_BYTE_LENGTH_MISMATCH)",
                        buffer.byte_length,
                        bytes.len()
                    ),
                ));
            }
            buffers.push(bytes);
        }
        let mut resources = Self { buffers, views: Vec::new() };
        for (i, view) in root.buffer_views.iter().enumerate() {
            let view = resources.view(i, view, source, assets, diagnostics, allowance)?;
            resources.views.push(view);
        }
        Ok(resources)
    }

    fn view(
        &self,
        i: usize,
        view: &BufferView,
        source: &InputFile,
        assets: &mut AssetRoot,
        diagnostics: &mut Diagnostics,
        allowance: &MemoryAllowance,
    ) -> Result<View> {
        let fault = |code: ErrorCode, message: String| {
            FormatError::whole(&source.path, code.message(format!("bufferViews[{i}]{message}")))
        };
        // glTF 1.0 used 0 for elements without gaps.
        let stride = view.byte_stride.map(|stride| stride as usize);
        let stride = stride.filter(|&stride| stride > 0);
        if let Some(stride) = view.byte_stride.filter(|s| !(4..=252).contains(s) || s % 4 != 0) {
            let message = match stride {
                0 => "0 is read as no stride (VALUE_NOT_IN_RANGE)".into(),
                _ => format!("{stride}; expected a multiple of 4 from 4 to 252 (VALUE_NOT_IN_RANGE)"),
            };
            diagnostics.note(NoticeCode::ReplacedValue, format!("bufferViews[{i}].byteStride"), message);
        }
        let extensions = &view.extensions;
        let compressed = [
            ("KHR_meshopt_compression", &extensions.khr_meshopt),
            ("EXT_meshopt_compression", &extensions.ext_meshopt),
        ];
        if let Some((name, compressed)) =
            compressed.iter().find_map(|(name, compressed)| compressed.as_ref().map(|compressed| (name, compressed)))
        {
            let place = format!(".extensions.{name}");
            let range = self
                .range(compressed.buffer, compressed.byte_offset, compressed.byte_length)
                .map_err(|(code, message)| fault(code, format!("{place}{message}")))?;
            let header = view_header(compressed).map_err(|(code, message)| fault(code, format!("{place}{message}")))?;
            let packed_stride = compressed.byte_stride as usize;
            let compressed = self.buffers[compressed.buffer].borrowed().part(range).read();
            let bytes = meshopt::decode(
                &compressed.map_err(|error| read_error(&source.path, error))?,
                header,
                &source.path,
                &mut assets.budget,
            )?;
            if (bytes.len() as u64) < view.byte_length {
                return Err(fault(
                    ErrorCode::WrongShape,
                    format!(".byteLength: {}, but the compressed data has {} bytes", view.byte_length, bytes.len()),
                ));
            }
            allowance.grant(bytes.len());
            return Ok(View { bytes: ViewStorage::Decoded(bytes), stride: stride.or(Some(packed_stride)) });
        }
        let range = self.range(view.buffer, view.byte_offset, view.byte_length);
        let range = range.map_err(|(code, message)| fault(code, message))?;
        Ok(View { bytes: ViewStorage::Plain(view.buffer, range), stride })
    }

    fn range(&self, buffer: usize, offset: u64, length: u64) -> Result<Range<usize>, (ErrorCode, String)> {
        let Some(bytes) = self.buffers.get(buffer) else {
            let count = self.buffers.len();
            let message = format!(".buffer: {buffer}, but there are {count} buffers (UNRESOLVED_REFERENCE)");
            return Err((ErrorCode::IndexOutOfRange, message));
        };
        match offset.checked_add(length) {
            Some(end) if end <= bytes.len() as u64 => Ok(offset as usize..end as usize),
            _ => {
                let held = bytes.len();
                let message = format!(
                    ": {length} bytes from offset {offset}, but buffers[{buffer}] has {held} bytes (BUFFER_VIEW_TOO_LONG)"
                );
                Err((ErrorCode::TruncatedFile, message))
            }
        }
    }

    /// A view's bytes and stride, or the reason why they cannot be read.
    pub(crate) fn bytes(&self, view: usize) -> Result<(ByteSource<'_>, Option<usize>), String> {
        match self.views.get(view) {
            Some(View { bytes, stride }) => Ok((
                match bytes {
                    ViewStorage::Plain(buffer, range) => self.buffers[*buffer].borrowed().part(range.clone()),
                    ViewStorage::Decoded(bytes) => ByteSource::Memory(bytes[..].into()),
                },
                *stride,
            )),
            None => Err(format!("{view}, but there are {} buffer views (UNRESOLVED_REFERENCE)", self.views.len())),
        }
    }
}

/// True if the bytes of a view are decompressed from other bytes.
fn is_compressed(BufferView { extensions, .. }: &BufferView) -> bool {
    extensions.ext_meshopt.is_some() || extensions.khr_meshopt.is_some()
}

/// True if every buffer contains only accessors that are decoded directly from its bytes; such a buffer need not be in
/// memory.
fn buffers_hold_only_accessors(root: &Root) -> bool {
    let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    root.images.iter().all(|image| image.buffer_view.is_none())
        && root.accessors.iter().all(|accessor| accessor.sparse.is_none())
        && !root.buffer_views.iter().any(is_compressed)
        && primitives.all(|primitive| primitive.extensions.draco.is_none())
}

/// Error for bytes that cannot be read.
pub(crate) fn read_error(path: &Path, source: io::Error) -> FormatError {
    FormatError::Io { path: path.into(), source }
}

fn view_header(view: &MeshoptView) -> Result<ViewHeader, (ErrorCode, String)> {
    let filter = match &view.filter[..] {
        "NONE" => Filter::None,
        "OCTAHEDRAL" => Filter::Octahedral,
        "QUATERNION" => Filter::Quaternion,
        "EXPONENTIAL" => Filter::Exponential,
        "COLOR" => Filter::Color,
        other => {
            let message = format!(".filter: {other:?}; expected NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL or COLOR");
            return Err((ErrorCode::UnknownName, message));
        }
    };
    let mode = match &view.mode[..] {
        "ATTRIBUTES" => Mode::Attributes(filter),
        "TRIANGLES" => Mode::Triangles,
        "INDICES" => Mode::Indices,
        other => {
            let message = format!(".mode: {other:?}; expected ATTRIBUTES, TRIANGLES or INDICES");
            return Err((ErrorCode::UnknownName, message));
        }
    };
    let whole = |name, value: u64| {
        let too_large = |_| (ErrorCode::TooLarge, format!(".{name}: {value} is too large"));
        usize::try_from(value).map_err(too_large)
    };
    Ok(ViewHeader { mode, count: whole("count", view.count)?, stride: whole("byteStride", view.byte_stride)? })
}

/// Bytes to which a URI refers: the data in a data URI, or a file.
pub(crate) fn read_uri(
    source: &InputFile,
    uri: &str,
    place: &str,
    assets: &mut AssetRoot,
    notices: &mut Vec<Notice>,
) -> Result<Vec<u8>> {
    let fault =
        |message: &str| FormatError::whole(&source.path, ErrorCode::InvalidUri.message(format!("{place}: {message}")));
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((head, data)) = data.split_once(',') else {
            return Err(fault("a data URI without a comma (INVALID_URI)"));
        };
        // In both encodings, the decoded text is not longer than the encoded text.
        assets.budget.take_bytes(&source.path, data.len() as u64)?;
        let bytes = match head.strip_suffix(";base64") {
            Some(_) => base64(&percent_decoded(data)),
            None => Some(percent_decoded(data).into_owned()),
        };
        return bytes.ok_or_else(|| fault("invalid base64 (INVALID_URI)"));
    }
    let name = percent_decoded(uri);
    let file = companion::companion_file(&source.path, &name, assets, notices);
    let named = |error| FormatError::Named {
        place: None,
        key: format!("{}: {place}", source.path.display()),
        source: Box::new(error),
    };
    Ok(file.map_err(named)?.bytes)
}

/// Replaces `%` and two hexadecimal digits by the byte that they represent (RFC 3986, section 2.1). A percent sign
/// without two digits is kept.
pub(crate) fn percent_decoded(text: &str) -> Cow<'_, [u8]> {
    if !text.contains('%') {
        return text.as_bytes().into();
    }
    let digit = |byte: Option<&u8>| byte.and_then(|&byte| (byte as char).to_digit(16));
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        at += 1;
        match (byte, digit(bytes.get(at)), digit(bytes.get(at + 1))) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((16 * high + low) as u8);
                at += 2;
            }
            _ => decoded.push(byte),
        }
    }
    decoded.into()
}

/// Decodes base64 (RFC 4648, section 4), with or without padding; `None` if the text is invalid.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    const INVALID: u8 = 0xff;
    const VALUES: [u8; 256] = {
        let mut values = [INVALID; 256];
        let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let mut i = 0;
        while i < 64 {
            values[alphabet[i] as usize] = i as u8;
            i += 1;
        }
        values
    };
    let end = text.iter().rposition(|&byte| byte != b'=').map_or(0, |i| i + 1);
    let text = (text.len() - end <= 2).then_some(&text[..end])?;
    if text.len() % 4 == 1 {
        return None;
    }
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0;
        for i in 0..4 {
            let value = group.get(i).map_or(0, |&byte| VALUES[usize::from(byte)]);
            if value == INVALID {
                return None;
            }
            bits = bits << 6 | u32::from(value);
        }
        bytes.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_decodes_the_examples_of_rfc_4648() {
        for (text, bytes) in
            [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm8", "fo"), ("Zm9v", "foo"), ("Zm9vYmFy", "foobar")]
        {
            assert_eq!(base64(text.as_bytes()).unwrap(), bytes.as_bytes());
        }
        for bad in ["A", "Z===", "Zg=g", "Z g=", "Zm9v-"] {
            assert_eq!(base64(bad.as_bytes()), None, "{bad}");
        }
    }

    #[test]
    fn percent_escapes_in_uris_are_decoded_and_other_percent_signs_kept() {
        for (text, bytes) in [("a%20b", "a b"), ("%2E%2e/", "../"), ("50%", "50%"), ("%4", "%4"), ("%zz", "%zz")] {
            assert_eq!(&*percent_decoded(text), bytes.as_bytes());
        }
    }
}
