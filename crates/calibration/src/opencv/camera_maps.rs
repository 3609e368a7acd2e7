//! The maps of a document that may be cameras, at any depth, with the maps that enclose them.

use std::rc::Rc;

use raycam_formats::Result;

use crate::document::lens_keys::plain;
use crate::document::{Cursor, Value};
use crate::opencv::camera;
use crate::opencv::key_view::KeyView;
use crate::opencv::keys;

/// Keys of a map with the parameters of one camera; the camera's name is the key of the enclosing map.
const PARAMETERS: [&str; 5] = ["param", "params", "parameters", "calibration", "values"];

/// True if a map contains K.
pub(super) fn has_camera(at: &Cursor<'_>) -> bool {
    let view = KeyView::new(at.clone());
    at.is_map()
        && (view.all(&keys::K).iter().any(keys::is_matrix)
            || keys::FOCALS.iter().all(|names| !view.all(names).is_empty())
            || camera::has_focal_pair(&view))
}

/// Maximum nesting level of the maps of cameras below the root.
const MAX_CAMERA_DEPTH: usize = 5;

/// True if a map contains cameras at most `depth` levels below it.
fn contains_cameras(at: &Cursor<'_>, depth: usize) -> bool {
    let below = |at: &Cursor<'_>| has_camera(at) || depth > 0 && at.is_map() && contains_cameras(at, depth - 1);
    let in_list = |at: &Cursor<'_>| at.list().is_ok_and(|items| items.iter().any(below));
    at.entries().is_ok_and(|entries| entries.iter().any(|(_, at)| below(at) || in_list(at)))
}

/// The camera of a list's item, with its name if the item contains only the name and the camera, as in `[{"front":
/// {...}}, {"back": {...}}]`.
fn item_of_list(at: Cursor<'_>) -> (Option<String>, Cursor<'_>) {
    match &at.entries().unwrap_or_default()[..] {
        [(name, inner)] if !has_camera(&at) && has_camera(inner) => (Some((*name).to_owned()), inner.clone()),
        _ => (None, at),
    }
}

/// The maps directly below the root, named by their key or by their index in a list.
pub(super) fn list_of_cameras<'a>(root: &Cursor<'a>) -> Result<Vec<(String, KeyView<'a>)>> {
    let mut found = Vec::new();
    if let Ok(items) = root.list() {
        let named = |(i, at): (usize, Cursor<'a>)| {
            let (name, at) = item_of_list(at);
            (name.unwrap_or_else(|| format!("camera{i}")), KeyView::new(at))
        };
        return Ok(items.into_iter().enumerate().map(named).collect());
    }
    append_cameras(root, "", &[], &mut found)?;
    Ok(found)
}

/// Appends the cameras of one map, whose key is `parent`.
fn append_cameras<'a>(
    at: &Cursor<'a>,
    parent: &str,
    above: &[Rc<KeyView<'a>>],
    found: &mut Vec<(String, KeyView<'a>)>,
) -> Result<()> {
    let own: Vec<_> = [Rc::new(KeyView::new(at.clone()))].into_iter().chain(above.iter().cloned()).collect();
    let below = |at: Cursor<'a>| KeyView::below(at, own.clone());
    for (name, inner) in at.entries()? {
        match inner.node.value {
            Value::List(_) => {
                let before = found.len();
                for (i, item) in inner.list()?.into_iter().enumerate().filter(|(_, item)| item.is_map()) {
                    let (own, item) = item_of_list(item);
                    found.push((own.unwrap_or_else(|| format!("{name}{i}")), below(item)));
                }
                if found.len() == before {
                    found.push((name.to_owned(), below(inner)));
                }
            }
            Value::Map(_) if above.len() < MAX_CAMERA_DEPTH && !has_camera(&inner) && contains_cameras(&inner, 3) => {
                append_cameras(&inner, name, &own, found)?;
            }
            _ => {
                let holder = has_camera(&inner) && !parent.is_empty() && PARAMETERS.contains(&&plain(name)[..]);
                found.push((if holder { parent } else { name }.to_owned(), below(inner)));
            }
        }
    }
    Ok(())
}
