//! Numbers as every reader of YAML, JSON and text takes them.

use glam::{DMat3, DVec3};

/// The shortest decimal that gives the same float64, with the point and the signed exponent that YAML 1.1 asks for.
pub(crate) fn yaml_float(value: f64) -> String {
    let text = format!("{value:?}");
    let Some((mantissa, exponent)) = text.split_once('e') else { return text };
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// Numbers with something between them.
pub(crate) fn joined(values: &[f64], between: &str) -> String {
    let words: Vec<String> = values.iter().map(|v| yaml_float(*v)).collect();
    words.join(between)
}

/// The numbers of a 3x3 matrix, row by row.
pub(crate) fn matrix_rows3(m: DMat3) -> [f64; 9] {
    m.transpose().to_cols_array()
}

/// The numbers of a 3x4 matrix [R | t], row by row.
pub(crate) fn matrix_rows34(r: DMat3, t: DVec3) -> [[f64; 4]; 3] {
    [0, 1, 2].map(|i| [r.row(i).x, r.row(i).y, r.row(i).z, t[i]])
}

/// A text in quotes, for YAML and JSON alike.
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
