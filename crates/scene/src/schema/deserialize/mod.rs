//! Reads the schema's structs from spanned values: a serde deserialiser whose errors have the path and the place in the text.
//!
//! It differs from others in what people may write: an enum with fields is a table with a `type`, a table stands for a
//! list of one, a key whose value is null is absent, and whole floats are whole numbers.

mod deserializer;
mod error;
mod list;
mod number;
pub(crate) mod value;

use serde::de::DeserializeOwned;

use crate::error::{Result, SceneError};
use crate::schema::deserialize::deserializer::ValueDeserializer;
use crate::schema::deserialize::error::DeError;
use crate::schema::deserialize::value::SpannedValue;

/// Reads a `T` from a description.
///
/// # Errors
/// [`SceneError::Schema`] with the path of the value, its place in the text, what was expected and the nearest name.
pub fn from_value<T: DeserializeOwned>(node: &SpannedValue) -> Result<T> {
    T::deserialize(ValueDeserializer(node)).map_err(|DeError(details)| {
        let path = details.path.iter().rev().map(String::as_str).collect::<String>();
        SceneError::Schema { path: path.trim_start_matches('.').into(), message: details.message, span: details.span }
    })
}
