//! Header of a PLY file (Turk, 1994).

use std::path::Path;

use raycam_scene::{ErrorCode, Message, NoticeCode};

use crate::error::{FormatError, Location, Result};
use crate::io::lexer::{self, Words};
use crate::io::{ByteSource, Diagnostics};
use crate::ply::body::Body;
use crate::ply::scalar::ScalarType;

/// Column of an element.
#[derive(Clone, Debug)]
pub(crate) struct Property {
    pub(crate) name: String,
    /// Type of the list's length, if the property is a list.
    pub(crate) list: Option<ScalarType>,
    pub(crate) kind: ScalarType,
}

/// Table of a file, called an element.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) count: usize,
    pub(crate) properties: Vec<Property>,
}

/// Header of a file: its elements, images and notices.
#[derive(Debug)]
pub(crate) struct Header {
    pub(crate) elements: Vec<Element>,
    /// Images named in comments, as written by MeshLab.
    pub(crate) textures: Vec<Vec<u8>>,
    /// Notices about ignored lines.
    pub(crate) odd: Diagnostics,
}

/// Reads the header of a file from its first bytes, which are the whole file if it is text.
pub(crate) fn parse<'a>(path: &'a Path, bytes: &'a [u8], file: ByteSource<'a>) -> Result<(Header, Body<'a>)> {
    let mut parser = HeaderParser {
        path,
        line: 0,
        elements: Vec::new(),
        textures: Vec::new(),
        odd: Diagnostics::default(),
        encoding: None,
    };
    let at = parser.lines(bytes)?;
    let (line, after) = (parser.line, file.len() - at);
    let Some(encoding) = parser.encoding else {
        return Err(parser.error(ErrorCode::MissingValue.message("no format line before end_header")));
    };
    let body = match encoding {
        Encoding::Ascii => Body::text(path, &bytes[at..], line),
        Encoding::BinaryLittleEndian => Body::binary(path, file, at, false),
        Encoding::BinaryBigEndian => Body::binary(path, file, at, true),
    };
    let header = Header { elements: parser.elements, textures: parser.textures, odd: parser.odd };
    header.check_counts(path, encoding, after)?;
    Ok((header, body))
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    BinaryLittleEndian,
    BinaryBigEndian,
}

impl Header {
    /// Rejects elements with more rows than `after` bytes can contain.
    fn check_counts(&self, path: &Path, encoding: Encoding, after: usize) -> Result<()> {
        for Element { name, count, properties } in &self.elements {
            // In text, each value takes at least a digit and a space or line end.
            let row: usize = match encoding {
                Encoding::Ascii => 2 * properties.len(),
                _ => properties.iter().map(|p| p.list.unwrap_or(p.kind).bytes()).sum(),
            };
            let needed = count.checked_mul(row);
            if *count > 0 && (row == 0 || needed.is_none_or(|needed| needed > after + 1)) {
                let message = format!(
                    "element {name} has {count} rows of at least {row} bytes, but {after} bytes follow the header"
                );
                return Err(FormatError::whole(path, ErrorCode::TruncatedFile.message(message)));
            }
        }
        Ok(())
    }
}

/// State of reading a header line by line.
struct HeaderParser<'a> {
    path: &'a Path,
    line: usize,
    elements: Vec<Element>,
    textures: Vec<Vec<u8>>,
    odd: Diagnostics,
    encoding: Option<Encoding>,
}

impl HeaderParser<'_> {
    fn error(&self, message: impl Into<Message>) -> FormatError {
        FormatError::line(self.path, self.line, message)
    }

    /// Reads up to `end_header`, and returns the offset of the byte after that line.
    fn lines(&mut self, bytes: &[u8]) -> Result<usize> {
        // If the header's lines end in a bare \r, a \n after the last one belongs to the data.
        let end = if bytes.starts_with(b"ply\r") && bytes.get(4) != Some(&b'\n') { b'\r' } else { b'\n' };
        let mut at = 0;
        loop {
            self.line += 1;
            let Some(length) = bytes[at..].iter().position(|&b| b == end) else {
                return Err(self.error(match self.line {
                    1 => ErrorCode::WrongFormat.message("not a PLY file"),
                    _ => ErrorCode::MissingValue.message("end_header is missing"),
                }));
            };
            let text = &bytes[at..at + length];
            at += length + 1;
            let (key, rest) = lexer::split_word(text.strip_suffix(b"\r").unwrap_or(text));
            match key {
                b"ply" if self.line == 1 => {}
                _ if self.line == 1 => {
                    return Err(
                        self.error(ErrorCode::WrongFormat.message("not a PLY file: the first line is not \"ply\""))
                    );
                }
                b"end_header" => return Ok(at),
                _ => self.statement(key, Words(rest))?,
            }
        }
    }

    fn statement(&mut self, key: &[u8], mut words: Words<'_>) -> Result<()> {
        match key {
            b"format" => {
                self.encoding = Some(match words.next().map(<[u8]>::to_ascii_lowercase).as_deref() {
                    Some(b"ascii") => Encoding::Ascii,
                    Some(b"binary_little_endian") => Encoding::BinaryLittleEndian,
                    Some(b"binary_big_endian") => Encoding::BinaryBigEndian,
                    _ => {
                        return Err(self.error(
                            "unknown format; expected the line \"format ascii 1.0\", or binary_little_endian or \
                             binary_big_endian instead of ascii",
                        ));
                    }
                });
                // No other version was ever specified, so files with another number have the layout of version 1.0.
                let version = words.next().unwrap_or_default();
                if version != b"1.0" {
                    let message = format!("version {} is read as 1.0", lexer::for_message(version));
                    self.odd.note(NoticeCode::InvalidFile, Location::Line(self.line), message);
                }
            }
            b"comment" if words.next() == Some(b"TextureFile") => {
                self.textures.push(lexer::name_bytes(words.0));
            }
            b"comment" | b"obj_info" | b"" => {}
            b"element" => {
                let name = words.next().map(lexer::name);
                let count = words.next().and_then(lexer::integer).and_then(|n| usize::try_from(n).ok());
                let (Some(name), Some(count)) = (name, count) else {
                    return Err(self.error("incomplete element; expected element NAME COUNT"));
                };
                self.elements.push(Element { name, count, properties: Vec::new() });
            }
            b"property" => {
                if self.elements.is_empty() {
                    return Err(self.error("a property before the first element"));
                }
                let Some(property) = self.property(words) else {
                    return Err(
                        self.error("incomplete property; expected property TYPE NAME or property list TYPE TYPE NAME")
                    );
                };
                if let Some(element) = self.elements.last_mut() {
                    element.properties.push(property);
                }
            }
            // Some programs write comments without the keyword.
            _ => {
                let message = format!("header lines that begin with {} are ignored", lexer::for_message(key));
                self.odd.note(NoticeCode::IgnoredKey, Location::Line(self.line), message);
            }
        }
        Ok(())
    }

    /// Column declared by the words after `property`. In a text file, a type of any name is a number.
    fn property(&mut self, mut words: Words<'_>) -> Option<Property> {
        let first = words.next()?;
        let (list, kind) = match first {
            b"list" => (Some(self.kind(words.next()?)?), self.kind(words.next()?)?),
            kind => (None, self.kind(kind)?),
        };
        Some(Property { name: lexer::name(words.next()?), list, kind })
    }

    fn kind(&mut self, word: &[u8]) -> Option<ScalarType> {
        let known = ScalarType::parse(word);
        if known.is_none() && self.encoding == Some(Encoding::Ascii) {
            let message = format!("numbers of the unknown type {} are read as float64", lexer::for_message(word));
            self.odd.note(NoticeCode::AssumedConvention, Location::Line(self.line), message);
            return Some(ScalarType::F64);
        }
        known
    }
}
