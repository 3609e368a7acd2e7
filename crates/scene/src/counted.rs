//! Counted nouns in messages.

/// Returns a number with its noun, such as "1 camera" or "0 vertices".
///
/// Plurals end with s, apart from the plurals of nouns such as "vertex" and "matrix".
pub fn counted(number: usize, noun: &str) -> String {
    let stem = noun.strip_suffix("ex").or_else(|| noun.strip_suffix("ix"));
    match (number, stem) {
        (1, _) => format!("1 {noun}"),
        (_, Some(stem)) => format!("{number} {stem}ices"),
        (_, None) => format!("{number} {noun}s"),
    }
}
