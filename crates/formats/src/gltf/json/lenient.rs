//! Elements of a document that are omitted, with a notice, if they are invalid.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};

/// Element whose fault invalidates only the element instead of the whole document: a light, a camera, an animation.
#[derive(Debug)]
pub(crate) enum Lenient<T> {
    Valid(T),
    /// The fault, in the words of the JSON reader.
    Faulty(String),
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for Lenient<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = serde_json::Value::deserialize(deserializer)?;
        Ok(match T::deserialize(value) {
            Ok(element) => Self::Valid(element),
            Err(error) => Self::Faulty(error.to_string()),
        })
    }
}
