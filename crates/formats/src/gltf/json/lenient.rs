//! Elements of a document that are omitted, with a notice, if they are invalid.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};

use crate::gltf::json::objects_only::ObjectsOnly;

/// Element that can be invalid without making the whole document invalid: a light, a camera, an animation.
#[derive(Debug)]
pub(crate) enum Lenient<T> {
    Valid(T),
    /// The JSON reader's error message.
    Faulty(String),
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for Lenient<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = serde_json::Value::deserialize(deserializer)?;
        Ok(match T::deserialize(ObjectsOnly(value)) {
            Ok(element) => Self::Valid(element),
            Err(error) => Self::Faulty(json_words(&error.to_string())),
        })
    }
}

/// Replaces Rust's types by JSON's terms in a message of the JSON reader.
pub(crate) fn json_words(text: &str) -> String {
    let (found, expected) = text.split_once(", expected ").unwrap_or((text, ""));
    let found = found
        .replace("invalid type: sequence", "a list")
        .replace("invalid type: map", "an object")
        .replace("invalid length", "a list of length")
        .replace("invalid type: ", "");
    let (expected, place) = match expected.find(" at line ") {
        Some(at) => expected.split_at(at),
        None => (expected, ""),
    };
    let expected = match expected {
        "" => return text.to_owned(),
        "a sequence" => "a list",
        "a map" => "an object",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of at least 0",
        "f32" | "f64" => "a number",
        "fewer elements in array" => "a shorter list",
        kind if kind.starts_with("struct ") => "an object",
        kind => &kind.replace("an array of length", "a list of length"),
    };
    format!("{found}; expected {expected}{place}")
}
