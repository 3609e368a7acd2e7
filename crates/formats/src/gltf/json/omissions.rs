//! Omission of invalid optional values: a node's numbers, a material's properties, the parts of textures. A value of a
//! wrong type or length is removed from the JSON before the document is parsed again, so that a single invalid value does
//! not make the whole document invalid.

use serde::de::DeserializeOwned;
use serde_json::Value;
use serde_path_to_error::Segment;

use crate::gltf::json::lenient::json_words;
use crate::gltf::json::material::Material;
use crate::gltf::json::objects_only::ObjectsOnly;
use crate::gltf::json::{Image, Node, RootExtensions, Sampler, Texture};

/// An invalid value that was removed.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Omission {
    /// Position in the document, such as `nodes[0].translation`.
    pub(crate) place: String,
    /// The JSON reader's error message.
    pub(crate) fault: String,
}

/// Keys of values that are never removed, because they determine which geometry is shown.
const GEOMETRY: [&str; 3] = ["mesh", "children", "EXT_mesh_gpu_instancing"];

/// Removes the invalid optional values of a document; returns them in the order of the document's lists.
pub(crate) fn omit_invalid_values(root: &mut Value) -> Vec<Omission> {
    let mut found = Vec::new();
    omit_in_list::<Node>(root, "nodes", &mut found);
    omit_in_list::<Material>(root, "materials", &mut found);
    omit_in_list::<Texture>(root, "textures", &mut found);
    omit_in_list::<Image>(root, "images", &mut found);
    omit_in_list::<Sampler>(root, "samplers", &mut found);
    if let Some(extensions) = root.get_mut("extensions") {
        omit_in::<RootExtensions>(extensions, "extensions", &mut found);
    }
    found
}

fn omit_in_list<T: DeserializeOwned>(root: &mut Value, list: &str, found: &mut Vec<Omission>) {
    let Some(Value::Array(items)) = root.get_mut(list) else { return };
    for (i, item) in items.iter_mut().enumerate() {
        omit_in::<T>(item, &format!("{list}[{i}]"), found);
    }
}

/// Removes values until the element can be read as a `T`, or until the remaining fault is not an optional value.
fn omit_in<T: DeserializeOwned>(element: &mut Value, place: &str, found: &mut Vec<Omission>) {
    let start = found.len();
    loop {
        let read: Result<T, _> = serde_path_to_error::deserialize(ObjectsOnly(&*element));
        let Err(error) = read else { return };
        // Numbers in a list are removed together with the list.
        let keys: Vec<String> = error
            .path()
            .iter()
            .map_while(|segment| match segment {
                Segment::Map { key } => Some(key.clone()),
                _ => None,
            })
            .collect();
        let removed = !keys.iter().any(|key| GEOMETRY.contains(&&key[..])) && remove(element, &keys);
        if !removed {
            return;
        }
        let mut fault = json_words(&error.into_inner().to_string());
        let place = format!("{place}.{}", keys.join("."));
        // An object without a required value is removed, too; the first fault is its reason.
        while found.len() > start && found.last().is_some_and(|last| last.place.starts_with(&format!("{place}."))) {
            fault = found.pop().map_or(fault, |inner| format!("{}: {}", &inner.place[place.len() + 1..], inner.fault));
        }
        found.push(Omission { place, fault });
    }
}

/// Removes the value at the end of a path of keys; false if the value does not exist.
fn remove(element: &mut Value, keys: &[String]) -> bool {
    let Some((last, parents)) = keys.split_last() else { return false };
    let parent = parents.iter().try_fold(element, |value, key| value.get_mut(key));
    parent.and_then(Value::as_object_mut).is_some_and(|object| object.remove(last).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn omitted(json: &str) -> (Value, Vec<String>) {
        let mut root = serde_json::from_str(json).unwrap();
        let found = omit_invalid_values(&mut root);
        (root, found.into_iter().map(|omission| format!("{}: {}", omission.place, omission.fault)).collect())
    }

    #[test]
    fn invalid_numbers_of_a_node_are_removed_and_others_remain() {
        let (root, found) = omitted(
            r#"{"nodes": [{"translation": [1, 2, 3], "scale": [1, 2]}, {"rotation": [0, "a", 0, 1], "matrix": 7}]}"#,
        );
        assert_eq!(root, serde_json::json!({"nodes": [{"translation": [1, 2, 3]}, {}]}));
        let expected = ["nodes[0].scale: a list of length 2; expected a list of length 3", "nodes[1].", "nodes[1]."];
        assert_eq!(found.len(), 3, "{found:?}");
        assert!(found.iter().zip(expected).all(|(found, start)| found.starts_with(start)), "{found:?}");
    }

    #[test]
    fn object_without_its_required_value_is_removed_with_the_first_reason() {
        let (root, found) = omitted(r#"{"materials": [{"name": "a", "normalTexture": {"index": "b"}}]}"#);
        assert_eq!(root, serde_json::json!({"materials": [{"name": "a"}]}));
        assert_eq!(found, [r#"materials[0].normalTexture: index: string "b"; expected a whole number of at least 0"#]);
    }

    #[test]
    fn values_that_determine_the_geometry_are_not_removed() {
        let json = r#"{"nodes": [{"mesh": "a"}, {"children": [1.5]}], "meshes": 3}"#;
        assert_eq!(omitted(json), (serde_json::from_str(json).unwrap(), vec![]));
    }
}
