//! Numbers in a form that every reader of YAML, JSON and text accepts.

use glam::{DMat3, DVec3};

/// Shortest decimal number that is read back as the same float64, with the decimal point and the signed exponent that
/// YAML 1.1 requires.
pub(crate) fn yaml_float(value: f64) -> String {
    let text = format!("{value:?}");
    let Some((mantissa, exponent)) = text.split_once('e') else { return text };
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// Formats numbers with a separator between them.
pub(crate) fn joined(values: &[f64], between: &str) -> String {
    let words: Vec<String> = values.iter().map(|v| yaml_float(*v)).collect();
    words.join(between)
}

/// Numbers of a 3x3 matrix, row by row.
pub(crate) fn matrix_rows3(m: DMat3) -> [f64; 9] {
    m.transpose().to_cols_array()
}

/// Numbers of a 3x4 matrix [R | t], row by row.
pub(crate) fn matrix_rows34(r: DMat3, t: DVec3) -> [[f64; 4]; 3] {
    [0, 1, 2].map(|i| [r.row(i).x, r.row(i).y, r.row(i).z, t[i]])
}

/// Returns the text in quotes, valid in YAML and in JSON.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if (c as u32) < 0x20 => out.push_str(&format!("\\u{:04x}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
