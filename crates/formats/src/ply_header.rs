//! The header of a PLY file (Turk, 1994), and its values one by one.

use std::path::Path;

use crate::bytes::Bytes;
use crate::error::FormatError;
use crate::ply_kind::Kind;
use crate::text::{self, Lines, Words};

/// A column of an element.
#[derive(Clone, Debug)]
pub(crate) struct Property {
    pub(crate) name: String,
    /// The kind of the length, where it is a list.
    pub(crate) list: Option<Kind>,
    pub(crate) kind: Kind,
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

/// What comes after the header.
pub(crate) struct Body<'a> {
    path: &'a Path,
    form: Form<'a>,
}

enum Form<'a> {
    /// One row a line.
    Text {
        lines: Lines<'a>,
        words: Words<'a>,
        header: usize,
        line: usize,
    },
    /// The whole file.
    Binary {
        bytes: Bytes<'a>,
        at: usize,
        big_endian: bool,
    },
}

/// Reads the header of a file from its first bytes, which are all of them where the file is text.
pub(crate) fn parse<'a>(
    path: &'a Path,
    bytes: &'a [u8],
    file: Bytes<'a>,
) -> Result<(Header, Body<'a>), FormatError> {
    // In a header whose lines end in a bare \r, a \n after the last belongs to the data.
    let end = if bytes.starts_with(b"ply\r") && bytes.get(4) != Some(&b'\n') {
        b'\r'
    } else {
        b'\n'
    };
    let fail = |line, message: &str| Err(FormatError::line(path, line, message));
    let (mut elements, mut textures) = (Vec::<Element>::new(), Vec::new());
    let (mut form, mut at, mut line) = (None, 0, 0);
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
        let (key, rest) = text::split_word(text);
        let mut words = Words(rest);
        match key {
            b"ply" if line == 1 => {}
            _ if line == 1 => return fail(line, "not a PLY file: the first line is not \"ply\""),
            b"format" => {
                form = Some(match (words.next(), words.next()) {
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
                textures.push(text::name(words.0))
            }
            b"comment" | b"obj_info" | b"" => {}
            b"element" => {
                let name = words.next().map(text::name);
                let count = words
                    .next()
                    .and_then(text::integer)
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
            _ => return fail(line, &format!("unknown keyword {}", text::shown(key))),
        }
    }
    let after = file.len() - at;
    let Some(form) = form else {
        return fail(line, "no format line before end_header");
    };
    let form = match form {
        None => Form::Text {
            lines: Lines::new(&bytes[at..]),
            words: Words(&[]),
            header: line,
            line,
        },
        Some(big_endian) => Form::Binary {
            bytes: file,
            at,
            big_endian,
        },
    };
    for Element {
        name,
        count,
        properties,
    } in &elements
    {
        // At least a digit and a space or line end for each value of a text.
        let row: usize = match form {
            Form::Text { .. } => 2 * properties.len(),
            Form::Binary { .. } => properties
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
    Ok((Header { elements, textures }, Body { path, form }))
}

fn property(mut words: Words<'_>) -> Option<Property> {
    let first = words.next()?;
    let (list, kind) = match first {
        b"list" => (
            Some(Kind::parse(words.next()?)?),
            Kind::parse(words.next()?)?,
        ),
        kind => (None, Kind::parse(kind)?),
    };
    if list.is_some_and(Kind::is_float) {
        return None;
    }
    Some(Property {
        name: text::name(words.next()?),
        list,
        kind,
    })
}

/// All bytes of a file, which are read where they are not in memory yet.
fn in_memory<'b>(path: &Path, bytes: &'b mut Bytes<'_>) -> Result<&'b [u8], FormatError> {
    if let Bytes::Disk { .. } = bytes {
        let read = bytes.borrowed().read().map_err(|source| FormatError::Io {
            path: path.into(),
            source,
        })?;
        *bytes = Bytes::Memory(read.into_owned().into());
    }
    match bytes {
        Bytes::Memory(bytes) => Ok(bytes),
        Bytes::Disk { .. } => Ok(&[]), // was just read
    }
}

impl Body<'_> {
    /// An error where reading has got to.
    pub(crate) fn error(&self, message: impl Into<String>) -> FormatError {
        match self.form {
            Form::Text { line, .. } => FormatError::line(self.path, line, message),
            Form::Binary { at, .. } => FormatError::byte(self.path, at, message),
        }
    }

    /// Where reading has got to, for a notice.
    pub(crate) fn place(&self) -> String {
        match self.form {
            Form::Text { line, .. } => format!("line {line}"),
            Form::Binary { at, .. } => format!("the row that ends at byte {at}"),
        }
    }

    fn cut(&self) -> FormatError {
        self.error("ends before the rows that its header declares")
    }

    /// Begins a row.
    pub(crate) fn row(&mut self) -> Result<(), FormatError> {
        if let Form::Text {
            lines,
            words,
            header,
            line,
        } = &mut self.form
        {
            let next = lines.find(|(_, text)| !text::trim(text).is_empty());
            let Some((number, text)) = next else {
                return Err(self.cut());
            };
            *line = *header + number;
            *words = Words(text);
        }
        Ok(())
    }

    /// Ends a row: nothing may be left of it.
    pub(crate) fn end_row(&mut self) -> Result<(), FormatError> {
        if let Form::Text { words, .. } = &mut self.form
            && let Some(word) = words.next()
        {
            let message = format!(
                "{} after the values that the header declares",
                text::shown(word)
            );
            return Err(self.error(message));
        }
        Ok(())
    }

    /// The next value of the row. All kinds fit a float64.
    pub(crate) fn value(&mut self, kind: Kind) -> Result<f64, FormatError> {
        match &mut self.form {
            Form::Text { words, .. } => {
                let Some(word) = words.next() else {
                    return Err(self.error("fewer values than the header declares"));
                };
                match text::number(word) {
                    Some(value) if kind.is_float() || value.fract() == 0.0 => Ok(value),
                    _ => {
                        let expected = if kind.is_float() {
                            "a number"
                        } else {
                            "a whole number"
                        };
                        Err(self.error(format!("{} is not {expected}", text::shown(word))))
                    }
                }
            }
            Form::Binary {
                bytes,
                at,
                big_endian,
            } => {
                let size = kind.bytes();
                let Some(found) = in_memory(self.path, bytes)?.get(*at..*at + size) else {
                    return Err(self.cut());
                };
                *at += size;
                Ok(kind.number(found, *big_endian))
            }
        }
    }

    /// The next values of the row.
    pub(crate) fn values(
        &mut self,
        kind: Kind,
        count: usize,
        values: &mut Vec<f64>,
    ) -> Result<(), FormatError> {
        if let Form::Binary {
            bytes,
            at,
            big_endian,
        } = &mut self.form
        {
            let size = kind.bytes();
            let end = count.checked_mul(size).and_then(|n| at.checked_add(n));
            let bytes = in_memory(self.path, bytes)?;
            let Some(found) = end.and_then(|end| bytes.get(*at..end)) else {
                return Err(self.cut());
            };
            *at += found.len();
            let numbers = found.chunks_exact(size);
            values.extend(numbers.map(|number| kind.number(number, *big_endian)));
            return Ok(());
        }
        for _ in 0..count {
            values.push(self.value(kind)?);
        }
        Ok(())
    }

    /// The next bytes of a binary file, if there are so many, and whether their numbers begin with the highest.
    pub(crate) fn ahead(&self, count: usize) -> Option<(Bytes<'_>, bool)> {
        let Form::Binary {
            bytes,
            at,
            big_endian,
        } = &self.form
        else {
            return None;
        };
        let end = at.checked_add(count).filter(|&end| end <= bytes.len())?;
        Some((bytes.borrowed().part(*at..end), *big_endian))
    }

    /// How many bytes are before, of a binary file.
    pub(crate) fn at(&self) -> Option<usize> {
        match self.form {
            Form::Binary { at, .. } => Some(at),
            Form::Text { .. } => None,
        }
    }

    /// Passes over bytes that were looked at [`ahead`](Self::ahead).
    pub(crate) fn skip(&mut self, count: usize) {
        if let Form::Binary { at, .. } = &mut self.form {
            *at += count;
        }
    }

    /// The length of a list.
    pub(crate) fn length(&mut self, kind: Kind) -> Result<usize, FormatError> {
        let length = self.value(kind)?;
        // The items are read one by one, so that a length alone takes no memory.
        if length < 0.0 {
            Err(self.error(format!("a list of {length} items")))
        } else {
            Ok(length as usize)
        }
    }

    /// What is wrong with how the file ends, once all rows are read.
    pub(crate) fn ending(mut self) -> Option<String> {
        let path = self.path.display();
        match &mut self.form {
            Form::Text { lines, .. } => {
                if lines.any(|(_, text)| !text::trim(text).is_empty()) {
                    return Some(format!("{path}: the lines after the last row are not used"));
                }
                (!lines.ended()).then(|| {
                    format!("{path}: the last line has no line end; the file may be cut off")
                })
            }
            Form::Binary { bytes, at, .. } => {
                let left = bytes.len() - *at;
                (left > 0).then(|| format!("{path}: {left} bytes after the last row are not used"))
            }
        }
    }
}
