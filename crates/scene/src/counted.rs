//! Counted nouns in messages.

/// Returns a number with its noun in the singular or plural, such as "1 camera" or "0 vertices".
///
/// The plural ends with s; nouns such as "vertex" and "matrix", "mesh", and "entry" have their own plurals.
pub fn counted(number: usize, noun: &str) -> String {
    if number == 1 {
        return format!("1 {noun}");
    }
    if let Some(stem) = noun.strip_suffix("ex").or_else(|| noun.strip_suffix("ix")) {
        return format!("{number} {stem}ices");
    }
    if let Some(stem) = noun.strip_suffix("ry") {
        return format!("{number} {stem}ries");
    }
    format!("{number} {noun}{}", if noun.ends_with("sh") { "es" } else { "s" })
}
