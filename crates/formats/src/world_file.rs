//! World files: TOML to a [`World`].

use std::path::Path;

use raycam_scene::schema::{self, Entry, Node, Value, WorldFile};
use raycam_scene::{SceneError, World};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::budget::Budget;
use crate::error::FormatError;
use crate::folder::{Folder, Source};

/// The world that `text` describes. `path` names it in errors; the files it names are read from `folder` and nowhere
/// else.
///
/// # Errors
/// See [`FormatError`]; one in the text itself has the line and the key.
pub fn parse(
    text: &str,
    folder: &Path,
    path: &Path,
    budget: &Budget,
) -> Result<World, FormatError> {
    let mut folder = Folder::new(folder, budget);
    let mut world = build(text, path, &mut folder)?;
    folder.finish(&mut world)?;
    Ok(world)
}

/// The world in a file.
pub(crate) fn read(source: &Source, folder: &mut Folder) -> Result<World, FormatError> {
    let Source { path, bytes, .. } = source;
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = line_of(bytes, error.valid_up_to());
        FormatError::line(path, line, "not UTF-8 text")
    })?;
    build(text, path, folder)
}

fn build(text: &str, path: &Path, folder: &mut Folder) -> Result<World, FormatError> {
    let node = node(text, path)?;
    let file: WorldFile =
        schema::from_node(&node).map_err(|e| located(e.into(), &node, text, path))?;
    file.build(folder)
        .map_err(|error| located(error, &node, text, path))
}

/// The tree of a TOML text.
fn node(text: &str, path: &Path) -> Result<Node, FormatError> {
    let table = DeTable::parse(text).map_err(|error| {
        let at = error.span().map_or(text.len(), |span| span.start);
        FormatError::line(
            path,
            line_of(text.as_bytes(), at),
            error.message().trim_end(),
        )
    })?;
    table_node(&table, path, text)
}

fn table_node(table: &Spanned<DeTable<'_>>, path: &Path, text: &str) -> Result<Node, FormatError> {
    let mut entries = Vec::new();
    for (key, value) in table.get_ref() {
        let node = value_node(value, path, text)?;
        entries.push(Entry {
            key: key.get_ref().to_string(),
            key_span: Some(key.span()),
            node,
        });
    }
    // As written, not by name.
    entries.sort_by_key(|entry| entry.key_span.as_ref().map(|span| span.start));
    Ok(Node {
        value: Value::Table(entries),
        span: Some(table.span()),
    })
}

fn value_node(
    spanned: &Spanned<DeValue<'_>>,
    path: &Path,
    text: &str,
) -> Result<Node, FormatError> {
    let fail = |message: String| {
        let line = line_of(text.as_bytes(), spanned.span().start);
        Err(FormatError::line(path, line, message))
    };
    let value = match spanned.get_ref() {
        DeValue::String(text) => Value::String(text.to_string()),
        DeValue::Boolean(value) => Value::Bool(*value),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(value) => Value::Integer(value),
            Err(_) => return fail(format!("{number} is beyond 64 bits")),
        },
        DeValue::Float(number) => match number.as_str().parse() {
            Ok(value) => Value::Float(value),
            Err(_) => return fail(format!("{number} is not a number")),
        },
        DeValue::Datetime(_) => return fail("a date; expected text in quotes".into()),
        DeValue::Array(items) => {
            let items: Result<_, _> = items
                .iter()
                .map(|item| value_node(item, path, text))
                .collect();
            Value::List(items?)
        }
        DeValue::Table(table) => {
            return table_node(&Spanned::new(spanned.span(), table.clone()), path, text);
        }
    };
    Ok(Node {
        value,
        span: Some(spanned.span()),
    })
}

/// An error of the schema with the line it is about.
fn located(error: FormatError, node: &Node, text: &str, file: &Path) -> FormatError {
    match error {
        FormatError::Scene {
            path: None,
            source:
                SceneError::Schema {
                    path: key,
                    message,
                    span,
                },
        } => {
            let at = span
                .or_else(|| node.span_at(&key))
                .map_or(0, |span| span.start);
            FormatError::Schema {
                path: file.into(),
                line: line_of(text.as_bytes(), at),
                key,
                message,
            }
        }
        FormatError::Named {
            place: None,
            key,
            source,
        } => {
            let at = node.span_at(&key).map_or(0, |span| span.start);
            FormatError::Named {
                place: Some((file.into(), line_of(text.as_bytes(), at))),
                key,
                source,
            }
        }
        FormatError::Scene { path: None, source } => FormatError::Scene {
            path: Some(file.into()),
            source,
        },
        other => other,
    }
}

/// The number, from 1, of the line with this byte.
fn line_of(text: &[u8], at: usize) -> usize {
    1 + text[..at.min(text.len())]
        .iter()
        .filter(|&&b| b == b'\n')
        .count()
}
