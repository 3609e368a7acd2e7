//! Reads the schema's structs from nodes: a serde deserialiser whose errors know their place.

use serde::de::DeserializeOwned;

use super::node::Node;
use crate::error::SceneError;

/// Reads a `T` from a description.
///
/// # Errors
/// [`SceneError::Schema`] with the path of the value, its place in the text, what was expected and the nearest name.
pub fn from_node<T: DeserializeOwned>(_node: &Node) -> Result<T, SceneError> {
    Err(SceneError::World("not built yet".into()))
}
