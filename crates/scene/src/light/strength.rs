//! Strength of a light in descriptions.

use serde::de::{Deserialize, Deserializer, Error, SeqAccess};

use crate::written::{written, written_schema};

/// Strength of a light: linear red, green and blue, written as three numbers, or as one number for grey.
pub(crate) struct Strength([f32; 3]);

written! {
    Strength: "a list of 3 numbers (red, green, blue) or one number (grey)",

    fn visit_f64<E: Error>(self, v: f64) -> Result<Strength, E> {
        Ok(Strength([v as f32; 3]))
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<Strength, E> {
        self.visit_f64(v as f64)
    }

    fn visit_u64<E: Error>(self, v: u64) -> Result<Strength, E> {
        self.visit_f64(v as f64)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Strength, A::Error> {
        let mut rgb = [0.0; 3];
        for (i, value) in rgb.iter_mut().enumerate() {
            *value = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
        }
        Ok(Strength(rgb))
    }
}

written_schema!(Strength, "Strength", |_| schemars::json_schema!({ "anyOf": [
    { "type": "number" },
    { "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3 },
] }));

/// Reads the strength of a light.
pub(crate) fn strength<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f32; 3], D::Error> {
    Strength::deserialize(deserializer).map(|Strength(rgb)| rgb)
}

/// Reads the strength of a light under an optional key.
pub(crate) fn optional_strength<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[f32; 3]>, D::Error> {
    Ok(Option::<Strength>::deserialize(deserializer)?.map(|Strength(rgb)| rgb))
}
