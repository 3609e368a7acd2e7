//! Reads TOML as a tree.

use std::path::Path;

use raycam_formats::{FormatError, Result};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::document::world_file::is_world_file;
use crate::document::{DocumentNode, MAX_DEPTH, Value};

/// Maximum length of a text that is parsed; calibrations have kilobytes.
const MAX_BYTES: usize = 4 << 20;

/// Parses a text to a tree.
pub(crate) fn parse(text: &str, path: &Path) -> Result<DocumentNode> {
    if text.len() > MAX_BYTES {
        return Err(FormatError::whole(path, "the TOML file is larger than 4 MiB, the limit for a calibration"));
    }
    let line = |byte: usize| 1 + text[..byte.min(text.len())].bytes().filter(|b| *b == b'\n').count();
    let table = DeTable::parse(text)
        .map_err(|error| FormatError::line(path, line(error.span().map_or(0, |span| span.start)), error.message()))?;
    table_node(table, &line, 0).ok_or_else(|| {
        FormatError::whole(
            path,
            "the file is nested too deeply for a \
        calibration",
        )
    })
}

/// True for a text whose first line of content is a section or a key with `=`, as in TOML and INI files. raycam's world
/// files, which are TOML too, do not count.
pub(crate) fn is_toml(text: &str) -> bool {
    let mut lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    let Some(first) = lines.find(|line| !line.is_empty() && !line.starts_with(['#', ';'])) else { return false };
    let is_name = |name: &str| {
        !name.is_empty() && name.trim().chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '"'))
    };
    let section = first.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let is_section = section.is_some_and(|name| is_name(name) && name.parse::<f64>().is_err());
    !is_world_file(text)
        && (is_section && text.contains('=') || first.split_once('=').is_some_and(|(key, _)| is_name(key)))
}

fn table_node(table: Spanned<DeTable<'_>>, line: &dyn Fn(usize) -> usize, depth: usize) -> Option<DocumentNode> {
    let place = line(table.span().start);
    let entries = table
        .into_inner()
        .into_iter()
        .map(|(key, value)| Some((key.into_inner().into_owned(), node(value, line, depth)?)));
    Some(DocumentNode { value: Value::Map(entries.collect::<Option<_>>()?), line: place })
}

fn node(spanned: Spanned<DeValue<'_>>, line: &dyn Fn(usize) -> usize, depth: usize) -> Option<DocumentNode> {
    if depth > MAX_DEPTH {
        return None;
    }
    let span = spanned.span();
    let value = match spanned.into_inner() {
        DeValue::String(text) => Value::Scalar(text.into_owned()),
        DeValue::Integer(number) => Value::Scalar(number.as_str().into()),
        DeValue::Float(number) => Value::Scalar(number.as_str().into()),
        DeValue::Boolean(value) => Value::Scalar(value.to_string()),
        DeValue::Datetime(date) => Value::Scalar(date.to_string()),
        DeValue::Array(items) => {
            Value::List(items.into_iter().map(|item| node(item, line, depth + 1)).collect::<Option<_>>()?)
        }
        DeValue::Table(table) => return table_node(Spanned::new(span, table), line, depth + 1),
    };
    Some(DocumentNode { value, line: line(span.start) })
}
