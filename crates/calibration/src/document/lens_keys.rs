//! Check that no lens is lost silently: a key that looks like a lens but is not read is an error.

use crate::document::{Cursor, DocumentNode, Value};
use raycam_formats::Result;

/// Key in lower case, without `_`, `-`, `.` and spaces, so that `dist_coeffs`, `distCoeffs` and `Dist.Coeffs` are
/// equal.
pub(crate) fn plain(key: &str) -> String {
    key.chars().filter(|c| !matches!(c, '_' | '-' | '.' | ' ')).flat_map(char::to_lowercase).collect()
}

/// True if a key has the name of a lens or of coefficients.
pub(crate) fn looks_like_lens(key: &str) -> bool {
    let key = plain(key);
    let starts = |words: &[&str]| words.iter().any(|word| key.starts_with(word));
    let has = |words: &[&str]| words.iter().any(|word| key.contains(word));
    let distortion = starts(&["dist"]) && !starts(&["distance", "distrib", "distric"]);
    // A list of names of coefficients, such as k1k2p1p2k3.
    let listed = key.len() >= 4 && key.as_bytes().chunks(2).all(|two| matches!(two, [b'k' | b'p' | b's', b'1'..=b'6']));
    let named = has(&["distort", "coef", "radial", "tangential", "fisheye"]) || starts(&["lens", "kappa"]);
    distortion || named || listed || matches!(&key[..], "d" | "xi" | "kc")
}

/// True if a key is the name of a single coefficient.
fn is_coefficient(key: &str) -> bool {
    let key = plain(key);
    let (letter, number) = key.split_at(key.chars().next().map_or(0, char::len_utf8));
    matches!((letter, number), ("k", "0" | "1" | "2" | "3" | "4" | "5" | "6") | ("p", "1" | "2" | "3" | "4"))
        || matches!(&key[..], "s1" | "s2" | "s3" | "s4" | "taux" | "tauy" | "omega" | "xi")
}

/// Returns the reason why a key without a value is an error: it belongs to a lens, or is the second half of a number
/// with a decimal comma. `None` if the key may be empty.
pub(crate) fn refused_without_value(key: &str) -> Option<String> {
    let own = key.rsplit('.').next().unwrap_or(key);
    if key.parse::<f64>().is_ok() {
        return Some(format!("{key}: a number without a key; use a decimal point instead of a comma"));
    }
    let other = plain(own).contains("model") || plain(own).starts_with("lens");
    let lens = is_coefficient(own) || looks_like_lens(own) && !other;
    lens.then(|| format!("{key} is empty; expected numbers (0 for no distortion), or remove the key"))
}

/// True if a node contains a number other than 0, or a pickled object, at any depth.
fn has_value(node: &DocumentNode) -> bool {
    match &node.value {
        Value::Scalar(word) => word.parse::<f64>().map_or(word.starts_with("a pickled object"), |v| v != 0.0),
        Value::List(items) => items.iter().any(has_value),
        Value::Map(entries) => {
            // Only the key `data` of a matrix counts, because its numbers of rows and columns are not values.
            let data = entries.iter().find(|(key, _)| key == "data");
            data.map_or_else(|| entries.iter().any(|(_, node)| has_value(node)), |(_, node)| has_value(node))
        }
    }
}

impl Cursor<'_> {
    /// Rejects a key with the name of a lens, and every such key below it, unless all numbers of the key are 0.
    ///
    /// # Errors
    /// `crate::FormatError::Syntax` names the key.
    pub(crate) fn refuse_lens(&self, key: &str) -> Result<()> {
        let scalar = matches!(self.node.value, Value::Scalar(_));
        let lens = looks_like_lens(key) || scalar && is_coefficient(key);
        if lens && has_value(self.node) {
            return Err(self.fail(
                "this key looks like lens coefficients, but this format has no such key; without the key, the camera \
                 would be a pinhole. Use distortion_coefficients or the format's own key, or remove the key if it does \
                 not contain lens coefficients",
            ));
        }
        match &self.node.value {
            Value::Map(entries) => {
                for (key, node) in entries {
                    self.child(key, node).refuse_lens(key)?;
                }
                Ok(())
            }
            Value::List(items) if items.iter().any(|item| matches!(item.value, Value::Map(_))) => {
                self.list()?.iter().try_for_each(|item| item.refuse_lens(""))
            }
            _ => Ok(()),
        }
    }
}
