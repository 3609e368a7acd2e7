//! World files: conversion of TOML to a [`World`].

use std::ops::Range;
use std::path::Path;

use raycam_scene::schema::{self, Entry, SpannedValue, Value, WorldFile};
use raycam_scene::{ErrorCode, SceneError, World};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::io::{AssetRoot, InputFile};

/// Reads the world that `text` describes. `path` is the world file's name in errors; the files to which the world
/// refers must be in `folder`.
///
/// # Errors
/// See [`FormatError`]; an error in the text itself has the line and the key.
pub fn parse(text: &str, folder: &Path, path: &Path, budget: &Budget) -> Result<World> {
    let mut assets = AssetRoot::new(folder, budget);
    let mut world = build(text, path, &mut assets)?;
    assets.finish_world(&mut world)?;
    Ok(world)
}

/// Reads the world in a world file.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<World> {
    let InputFile { path, bytes, .. } = source;
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = line_of(bytes, error.valid_up_to());
        FormatError::line(path, line, ErrorCode::NotText.message("not UTF-8 text"))
    })?;
    build(text, path, assets)
}

fn build(text: &str, path: &Path, assets: &mut AssetRoot) -> Result<World> {
    let mut node = parse_tree(text, path)?;
    truncate_after_empty(&mut node);
    let file: WorldFile = schema::from_value(&node).map_err(|e| with_line(e.into(), &node, text, path))?;
    file.build(assets).map_err(|error| with_line(error, &node, text, path))
}

/// Drops the objects after the first empty object. An empty object is an error. Without this rule, a file with many
/// empty objects would take hundreds of times its own size in memory, because each object has many fields.
fn truncate_after_empty(node: &mut SpannedValue) {
    let Value::Table(entries) = &mut node.value else { return };
    let objects = entries.iter_mut().find(|entry| entry.key == "object");
    if let Some(Entry { value: node, .. }) = objects
        && let Value::List(items) = &mut node.value
        && let Some(first) =
            (items.iter()).position(|item| matches!(&item.value, Value::Table(said) if said.is_empty()))
    {
        items.truncate(first + 1);
        items.shrink_to_fit();
    }
}

/// Tree of a TOML text.
fn parse_tree(text: &str, path: &Path) -> Result<SpannedValue> {
    match parse_in_pieces(text, path) {
        Some(node) => Ok(node),
        // The text is parsed as a whole if it is short, or to report an error with its position in the whole text.
        None => parse_piece(text, 0..text.len(), path),
    }
}

/// Number of bytes of a text with many objects that are parsed at a time. The parser takes more than a kilobyte for
/// each table, several times the memory of the result.
const PIECE_BYTES: usize = 1 << 16;

/// Tree of a text whose objects are parsed a few at a time; `None` if the text is short or cannot be divided in this
/// way.
fn parse_in_pieces(text: &str, path: &Path) -> Option<SpannedValue> {
    const OBJECT: &str = "[[object]]";
    if text.len() < 2 * PIECE_BYTES {
        return None;
    }
    // A line inside a multi-line string may look like a header. In that case, the piece that ends at this line is
    // incomplete, and so is the text after it.
    let mut headers = text.match_indices(OBJECT).map(|(at, _)| at);
    let mut start = headers.find(|&at| begins_line(text, at))?;
    let mut root = parse_piece(text, 0..start, path).ok()?;
    let Value::Table(entries) = &mut root.value else { return None };
    if entries.iter().any(|entry| entry.key == "object") {
        return None;
    }
    while start < text.len() {
        let end = headers.find(|&at| at >= start + PIECE_BYTES && begins_line(text, at));
        let end = end.unwrap_or(text.len());
        let Value::Table(more) = parse_piece(text, start..end, path).ok()?.value else { return None };
        for entry in more {
            match entries.iter_mut().find(|known| known.key == entry.key) {
                None => entries.push(entry),
                Some(known) if known.key == "object" => match (&mut known.value.value, entry.value.value) {
                    (Value::List(items), Value::List(more)) => items.extend(more),
                    _ => return None,
                },
                Some(_) => return None,
            }
        }
        start = end;
    }
    root.span = Some(0..text.len());
    Some(root)
}

/// True if only white space precedes this byte in its line.
fn begins_line(text: &str, at: usize) -> bool {
    let line = text[..at].rsplit('\n').next().unwrap_or_default();
    line.bytes().all(|byte| matches!(byte, b' ' | b'\t'))
}

/// Tree of a piece of a TOML text; the piece must be valid TOML by itself.
fn parse_piece(text: &str, range: Range<usize>, path: &Path) -> Result<SpannedValue> {
    let start = range.start;
    let table = DeTable::parse(&text[range.clone()]).map_err(|error| {
        let at = error.span().map_or(range.end, |span| start + span.start);
        FormatError::line(path, line_of(text.as_bytes(), at), error.message().trim_end())
    })?;
    let span = table.span();
    let read = TextPiece { text, start, path };
    read.table(table.into_inner(), span)
}

/// Part of a text that is converted to a tree.
struct TextPiece<'a> {
    text: &'a str,
    /// Offset of the piece in the whole text, in bytes.
    start: usize,
    path: &'a Path,
}

impl TextPiece<'_> {
    fn shift_span(&self, span: Range<usize>) -> Range<usize> {
        self.start + span.start..self.start + span.end
    }

    fn table(&self, table: DeTable<'_>, span: Range<usize>) -> Result<SpannedValue> {
        let mut entries = Vec::with_capacity(table.len());
        for (key, value) in table {
            entries.push(Entry {
                key: key.get_ref().to_string(),
                key_span: Some(self.shift_span(key.span())),
                value: self.value(value)?,
            });
        }
        // The entries are put in the order of the file; the parser sorts them by name.
        entries.sort_by_key(|entry| entry.key_span.as_ref().map(|span| span.start));
        Ok(SpannedValue { value: Value::Table(entries), span: Some(self.shift_span(span)) })
    }

    /// Consumes the value, so that no value is in memory twice.
    fn value(&self, spanned: Spanned<DeValue<'_>>) -> Result<SpannedValue> {
        let span = spanned.span();
        let place = self.shift_span(span.clone());
        let fail = |code: ErrorCode, message: String| {
            let line = line_of(self.text.as_bytes(), place.start);
            Err(FormatError::line(self.path, line, code.message(message)))
        };
        let value = match spanned.into_inner() {
            DeValue::String(text) => Value::String(text.into_owned()),
            DeValue::Boolean(value) => Value::Bool(value),
            DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
                Ok(value) => Value::Integer(value),
                Err(_) => return fail(ErrorCode::OutOfRange, format!("{number} does not fit into 64 bits")),
            },
            DeValue::Float(number) => match number.as_str().parse() {
                Ok(value) => Value::Float(value),
                Err(_) => return fail(ErrorCode::WrongType, format!("{number} is not a number")),
            },
            DeValue::Datetime(_) => return fail(ErrorCode::WrongType, "a date; expected a string in quotes".into()),
            DeValue::Array(items) => {
                let items: Result<_, _> = items.into_iter().map(|item| self.value(item)).collect();
                Value::List(items?)
            }
            DeValue::Table(table) => return self.table(table, span),
        };
        Ok(SpannedValue { value, span: Some(place) })
    }
}

/// Adds the world file's path and the line to an error of the schema or of a file.
fn with_line(error: FormatError, node: &SpannedValue, text: &str, file: &Path) -> FormatError {
    match error {
        FormatError::Scene { path: None, source: SceneError::Schema { path: key, message, span } } => {
            let at = span.or_else(|| node.span_at(&key)).map_or(0, |span| span.start);
            FormatError::Schema { path: file.into(), line: line_of(text.as_bytes(), at), key, message }
        }
        FormatError::Named { place: None, key, source } => {
            let at = node.span_at(&key).map_or(0, |span| span.start);
            FormatError::Named { place: Some((file.into(), line_of(text.as_bytes(), at))), key, source }
        }
        FormatError::Scene { path: None, source } => FormatError::Scene { path: Some(file.into()), source },
        other => other,
    }
}

/// Number, from 1, of the line that contains this byte.
fn line_of(text: &[u8], at: usize) -> usize {
    1 + text[..at.min(text.len())].iter().filter(|&&b| b == b'\n').count()
}
