//! Reads the schema's structs from spanned values: a serde deserialiser whose errors contain the path and the position
//! in the text.
//!
//! It differs from other deserialisers in the notations that it accepts: an enum with fields is a table with a `type`,
//! a table counts as a list of one, a key with a null value is absent, and whole floats count as whole numbers.

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
/// [`SceneError::Schema`] with the path of the value, its position in the text, the expectation and the nearest name.
pub fn from_value<T: DeserializeOwned>(node: &SpannedValue) -> Result<T> {
    T::deserialize(ValueDeserializer(node)).map_err(|DeError(details)| {
        let path = details.path.iter().rev().map(String::as_str).collect::<String>();
        SceneError::Schema { path: path.trim_start_matches('.').into(), message: details.message, span: details.span }
    })
}
