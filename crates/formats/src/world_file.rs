//! World files: TOML to a [`World`].

use std::ops::Range;
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
    let mut node = node(text, path)?;
    end_at_nothing(&mut node);
    let file: WorldFile =
        schema::from_node(&node).map_err(|e| located(e.into(), &node, text, path))?;
    file.build(folder)
        .map_err(|error| located(error, &node, text, path))
}

/// Leaves out the objects after one that says nothing. That one is an error, and a file of little else would take memory
/// for all that an object can say, hundreds of times its own size.
fn end_at_nothing(node: &mut Node) {
    let Value::Table(entries) = &mut node.value else {
        return;
    };
    let objects = entries.iter_mut().find(|entry| entry.key == "object");
    if let Some(Entry { node, .. }) = objects
        && let Value::List(items) = &mut node.value
        && let Some(first) = (items.iter())
            .position(|item| matches!(&item.value, Value::Table(said) if said.is_empty()))
    {
        items.truncate(first + 1);
        items.shrink_to_fit();
    }
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
    let span = table.span();
    table_node(table.into_inner(), span, path, text)
}

fn table_node(
    table: DeTable<'_>,
    span: Range<usize>,
    path: &Path,
    text: &str,
) -> Result<Node, FormatError> {
    let mut entries = Vec::with_capacity(table.len());
    for (key, value) in table {
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
        span: Some(span),
    })
}

/// Takes the value, so that not all of them are there twice.
fn value_node(spanned: Spanned<DeValue<'_>>, path: &Path, text: &str) -> Result<Node, FormatError> {
    let span = spanned.span();
    let fail = |message: String| {
        let line = line_of(text.as_bytes(), span.start);
        Err(FormatError::line(path, line, message))
    };
    let value = match spanned.into_inner() {
        DeValue::String(text) => Value::String(text.into_owned()),
        DeValue::Boolean(value) => Value::Bool(value),
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
                .into_iter()
                .map(|item| value_node(item, path, text))
                .collect();
            Value::List(items?)
        }
        DeValue::Table(table) => {
            return table_node(table, span, path, text);
        }
    };
    Ok(Node {
        value,
        span: Some(span),
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
