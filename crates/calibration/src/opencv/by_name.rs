//! Calibrations as maps of matrices by camera name, `{"K": {"left": ..., "right": ...}, "D": {"left": ...}}`. Such a
//! document becomes a document with a map for each camera, `{"left": {"K": ..., "D": ...}, "right": {...}}`.

use std::collections::HashMap;
use std::path::Path;

use raycam_scene::{Notice, NoticeCode, suggestion};

use crate::document::lens_keys::looks_like_lens;
use crate::document::{Cursor, DocumentNode, Value};
use crate::opencv::keys;

/// Rearranges a document whose map of camera matrices contains only matrices; returns other documents unchanged. The
/// notices report missing and unknown cameras in the other maps.
///
/// # Errors
/// A message about lens coefficients of a camera without a camera matrix.
pub(super) fn split(node: DocumentNode) -> Result<(DocumentNode, Vec<Notice>), String> {
    let Value::Map(entries) = &node.value else { return Ok((node, vec![])) };
    let Some((key_of_k, names)) = entries.iter().find_map(names_of_matrices) else { return Ok((node, vec![])) };
    let places: HashMap<&str, usize> = names.iter().enumerate().map(|(place, name)| (&name[..], place)).collect();
    let mut cameras = vec![vec![]; names.len()];
    let mut missing: Vec<Vec<&str>> = vec![vec![]; names.len()];
    let mut shared = vec![];
    let mut notices = vec![];
    for (key, value) in entries {
        let Value::Map(inner) = &value.value else {
            shared.push((key.clone(), value.clone()));
            continue;
        };
        if !inner.iter().any(|(name, _)| places.contains_key(&name[..])) {
            shared.push((key.clone(), value.clone()));
            continue;
        }
        let mut is_given = vec![false; names.len()];
        for (name, value) in inner {
            let Some(&place) = places.get(&name[..]) else {
                if looks_like_lens(key) {
                    let hint = suggestion(name, names.iter().map(String::as_str));
                    return Err(format!("{key}.{name}: {key_of_k} contains no camera {name:?}{hint}"));
                }
                let text = format!("ignored, because {key_of_k} contains no camera of this name");
                notices.push(Notice::about(NoticeCode::IgnoredKey, format!("{key}.{name}"), text));
                continue;
            };
            is_given[place] = true;
            cameras[place].push((key.clone(), value.clone()));
        }
        let lacking = missing.iter_mut().zip(is_given).filter(|(_, is_given)| !is_given);
        lacking.for_each(|(missing, _)| missing.push(key));
    }
    for (name, missing) in names.iter().zip(missing).filter(|(_, missing)| !missing.is_empty()) {
        let text = format!("no entry in {}", missing.join(", "));
        notices.push(Notice::about(NoticeCode::MissingValue, name.clone(), text));
    }
    let camera = |(name, own)| (name, DocumentNode { value: Value::Map(own), line: node.line });
    let cameras = names.iter().cloned().zip(cameras).map(camera);
    Ok((DocumentNode { value: Value::Map(shared.into_iter().chain(cameras).collect()), line: node.line }, notices))
}

/// The key and the camera names of an entry whose key means K and whose value is a map of matrices.
fn names_of_matrices((key, node): &(String, DocumentNode)) -> Option<(&str, Vec<String>)> {
    let Value::Map(inner) = &node.value else { return None };
    let at = Cursor::root(node, Path::new(""));
    let is_matrix = |at: &Cursor<'_>| at.list().is_ok() && at.numbers().is_ok_and(|m| matches!(m.len(), 4 | 9));
    let values = at.entries().ok()?;
    let is_own = keys::is_camera_matrix(key) && keys::is_keyed(&at) && values.iter().all(|(_, at)| is_matrix(at));
    (is_own && !inner.is_empty()).then(|| (&key[..], inner.iter().map(|(name, _)| name.clone()).collect()))
}
