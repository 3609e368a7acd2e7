//! Calibrations as maps of matrices by camera name, `{"K": {"left": ..., "right": ...}, "D": {"left": ...}}`. Such a
//! document becomes a document with a map for each camera, `{"left": {"K": ..., "D": ...}, "right": {...}}`.

use std::collections::HashMap;
use std::path::Path;

use crate::document::{Cursor, DocumentNode, Value};
use crate::opencv::keys;

/// Rearranges a document whose map of camera matrices contains only matrices; returns other documents unchanged.
pub(super) fn split(node: DocumentNode) -> DocumentNode {
    let Value::Map(entries) = &node.value else { return node };
    let Some(names) = entries.iter().find_map(names_of_matrices) else { return node };
    let places: HashMap<&str, usize> = names.iter().enumerate().map(|(place, name)| (&name[..], place)).collect();
    let mut cameras = vec![vec![]; names.len()];
    let mut shared = vec![];
    for (key, value) in entries {
        match &value.value {
            Value::Map(inner) if !inner.is_empty() && inner.iter().all(|(name, _)| places.contains_key(&name[..])) => {
                for (name, value) in inner {
                    cameras[places[&name[..]]].push((key.clone(), value.clone()));
                }
            }
            _ => shared.push((key.clone(), value.clone())),
        }
    }
    let camera = |(name, own)| (name, DocumentNode { value: Value::Map(own), line: node.line });
    let cameras = names.iter().cloned().zip(cameras).map(camera);
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
