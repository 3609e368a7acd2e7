//! Calibrations as maps of matrices by camera name, `{"K": {"left": ..., "right": ...}, "D": {"left": ...}}`. Such a
//! document becomes a document with a map for each camera, `{"left": {"K": ..., "D": ...}, "right": {...}}`.

use std::path::Path;

use crate::document::{Cursor, DocumentNode, Value};
use crate::opencv::keys;

/// Rearranges a document whose map of camera matrices contains only matrices; returns other documents unchanged.
pub(super) fn split(node: DocumentNode) -> DocumentNode {
    let Value::Map(entries) = &node.value else { return node };
    let Some(names) = entries.iter().find_map(names_of_matrices) else { return node };
    let is_by_name = |value: &DocumentNode| matches!(&value.value, Value::Map(inner) if inner.iter().all(|(key, _)| names.contains(key)) && !inner.is_empty());
    let (by_name, shared): (Vec<_>, Vec<_>) = entries.iter().cloned().partition(|(_, value)| is_by_name(value));
    let camera = |name: &String| {
        let own = by_name.iter().filter_map(|(key, value)| {
            let Value::Map(inner) = &value.value else { return None };
            inner.iter().find(|(key, _)| key == name).map(|(_, value)| (key.clone(), value.clone()))
        });
        (name.clone(), DocumentNode { value: Value::Map(own.collect()), line: node.line })
    };
    let cameras: Vec<_> = names.iter().map(camera).collect();
    DocumentNode { value: Value::Map(shared.into_iter().chain(cameras).collect()), line: node.line }
}

/// The camera names in an entry whose key means K and whose value is a map of matrices.
fn names_of_matrices((key, node): &(String, DocumentNode)) -> Option<Vec<String>> {
    let Value::Map(inner) = &node.value else { return None };
    let at = Cursor::root(node, Path::new(""));
    let is_matrix = |at: &Cursor<'_>| at.list().is_ok() && at.numbers().is_ok_and(|m| matches!(m.len(), 4 | 9));
    let values = at.entries().ok()?;
    let is_own = keys::is_camera_matrix(key) && keys::is_keyed(&at) && values.iter().all(|(_, at)| is_matrix(at));
    (is_own && !inner.is_empty()).then(|| inner.iter().map(|(name, _)| name.clone()).collect())
}
