//! Float32 numbers as short decimals.

use serde_json::Value;

/// Shortest decimal that reads back as this number in float32.
pub(crate) fn shortest_f32(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// Shortest decimals of several numbers.
pub(crate) fn shortest_f32s(values: &[f32]) -> Value {
    values.iter().map(|&value| shortest_f32(value)).collect()
}
