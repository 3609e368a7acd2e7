//! The header of a PLY file (Turk, 1994).

use std::path::Path;

use crate::error::FormatError;
use crate::io::byte_source::ByteSource;
use crate::io::lexer::{self, Words};
use crate::ply::body::Body;
use crate::ply::scalar::ScalarType;

/// A column of an element.
#[derive(Clone, Debug)]
pub(crate) struct Property {
    pub(crate) name: String,
    /// The kind of the length, where it is a list.
    pub(crate) list: Option<ScalarType>,
    pub(crate) kind: ScalarType,
}

/// A table.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) count: usize,
    pub(crate) properties: Vec<Property>,
}

/// The tables of a file.
#[derive(Debug)]
pub(crate) struct Header {
    pub(crate) elements: Vec<Element>,
    /// The images named in comments, as MeshLab does it.
    pub(crate) textures: Vec<String>,
}

/// Reads the header of a file from its first bytes, which are all of them where the file is text.
pub(crate) fn parse<'a>(
    path: &'a Path,
    bytes: &'a [u8],
    file: ByteSource<'a>,
) -> Result<(Header, Body<'a>), FormatError> {
    // In a header whose lines end in a bare \r, a \n after the last belongs to the data.
    let end = if bytes.starts_with(b"ply\r") && bytes.get(4) != Some(&b'\n') {
        b'\r'
    } else {
        b'\n'
    };
    let fail = |line, message: &str| Err(FormatError::line(path, line, message));
    let (mut elements, mut textures) = (Vec::<Element>::new(), Vec::new());
    let (mut encoding, mut at, mut line) = (None, 0, 0);
    loop {
        line += 1;
        let Some(length) = bytes[at..].iter().position(|&b| b == end) else {
            return fail(
                line,
                if line == 1 {
                    "not a PLY file"
                } else {
                    "no end_header"
                },
            );
        };
        let text = bytes[at..at + length]
            .strip_suffix(b"\r")
            .unwrap_or(&bytes[at..at + length]);
        at += length + 1;
        let (key, rest) = lexer::split_word(text);
        let mut words = Words(rest);
        match key {
            b"ply" if line == 1 => {}
            _ if line == 1 => return fail(line, "not a PLY file: the first line is not \"ply\""),
            b"format" => {
                encoding = Some(match (words.next(), words.next()) {
                    (Some(b"ascii"), Some(b"1.0")) => None,
                    (Some(b"binary_little_endian"), Some(b"1.0")) => Some(false),
                    (Some(b"binary_big_endian"), Some(b"1.0")) => Some(true),
                    _ => {
                        return fail(
                            line,
                            "expected format ascii, binary_little_endian or binary_big_endian 1.0",
                        );
                    }
                });
            }
            b"comment" if words.next() == Some(b"TextureFile") => {
                textures.push(lexer::name(words.0))
            }
            b"comment" | b"obj_info" | b"" => {}
            b"element" => {
                let name = words.next().map(lexer::name);
                let count = words
                    .next()
                    .and_then(lexer::integer)
                    .and_then(|n| usize::try_from(n).ok());
                let (Some(name), Some(count)) = (name, count) else {
                    return fail(line, "expected element NAME COUNT");
                };
                elements.push(Element {
                    name,
                    count,
                    properties: Vec::new(),
                });
            }
            b"property" => {
                let Some(element) = elements.last_mut() else {
                    return fail(line, "a property before the first element");
                };
                let Some(property) = property(words) else {
                    return fail(
                        line,
                        "expected property KIND NAME or property list KIND KIND NAME",
                    );
                };
                element.properties.push(property);
            }
            b"end_header" => break,
            _ => {
                return fail(
                    line,
                    &format!("unknown keyword {}", lexer::for_message(key)),
                );
            }
        }
    }
    let after = file.len() - at;
    let Some(encoding) = encoding else {
        return fail(line, "no format line before end_header");
    };
    let body = match encoding {
        None => Body::text(path, &bytes[at..], line),
        Some(big_endian) => Body::binary(path, file, at, big_endian),
    };
    for Element {
        name,
        count,
        properties,
    } in &elements
    {
        // At least a digit and a space or line end for each value of a text.
        let row: usize = match encoding {
            None => 2 * properties.len(),
            Some(_) => properties
                .iter()
                .map(|p| p.list.unwrap_or(p.kind).bytes())
                .sum(),
        };
        let needed = count.checked_mul(row);
        if *count > 0 && (row == 0 || needed.is_none_or(|needed| needed > after + 1)) {
            let message = format!(
                "element {name} has {count} rows of at least {row} bytes, but {after} bytes follow the header"
            );
            return Err(FormatError::whole(path, message));
        }
    }
    Ok((Header { elements, textures }, body))
}

fn property(mut words: Words<'_>) -> Option<Property> {
    let first = words.next()?;
    let (list, kind) = match first {
        b"list" => (
            Some(ScalarType::parse(words.next()?)?),
            ScalarType::parse(words.next()?)?,
        ),
        kind => (None, ScalarType::parse(kind)?),
    };
    if list.is_some_and(ScalarType::is_float) {
        return None;
    }
    Some(Property {
        name: lexer::name(words.next()?),
        list,
        kind,
    })
}
