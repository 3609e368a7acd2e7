//! Keys that a table contains, for rules about their combination.

use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;

/// Lists pairs of a field's key and the result of a method call on the field. The key is the field's name, or the
/// string before the field.
macro_rules! by_key {
    ($table:ident, $method:ident: $($($key:literal)? $field:ident),+ $(,)?) => {
        [$((by_key!(@key $($key)? $field), $table.$field.$method())),+]
    };
    (@key $key:literal $field:ident) => {
        $key
    };
    (@key $field:ident) => {
        stringify!($field)
    };
}
pub(crate) use by_key;

/// Optional keys of a table, each with true if the table contains it.
pub struct Keys<const N: usize>(pub [(&'static str, bool); N]);

impl<const N: usize> Keys<N> {
    /// The keys among `keys` that are present.
    pub fn given(&self, keys: &[&str]) -> Vec<&'static str> {
        self.0.iter().filter(|(key, given)| *given && keys.contains(key)).map(|(key, _)| *key).collect()
    }

    /// Number of keys present.
    pub fn count(&self) -> usize {
        self.0.iter().filter(|(_, given)| *given).count()
    }

    /// Rejects the keys among `keys` that are present, because they cannot be combined with another key; `reason`
    /// completes the message.
    pub fn refuse(&self, keys: &[&str], reason: &str) -> Result<()> {
        self.refuse_as(ErrorCode::ConflictingValues, keys, reason)
    }

    /// Rejects the keys among `keys` that are present, because they require the key `required`, which is missing.
    pub fn refuse_without(&self, required: &str, keys: &[&str]) -> Result<()> {
        self.refuse_as(ErrorCode::MissingValue, keys, &format!("requires {required}, which is missing"))
    }

    /// Rejects the keys among `keys` that are present, with an error of the kind `code`.
    pub fn refuse_as(&self, code: ErrorCode, keys: &[&str], reason: &str) -> Result<()> {
        match self.given(keys).first() {
            Some(key) => Err(SceneError::schema(code, *key, reason)),
            None => Ok(()),
        }
    }

    /// Returns the key that is present among alternative `keys`; an error if none or several are present.
    pub fn exactly_one(&self, what: &str, keys: &[&str]) -> Result<&'static str> {
        match self.given(keys)[..] {
            [key] => Ok(key),
            [] => Err(SceneError::schema(
                ErrorCode::MissingValue,
                "",
                format!("no {what} given; expected one of {}", keys.join(", ")),
            )),
            [first, second, ..] => Err(SceneError::schema(
                ErrorCode::ConflictingValues,
                second,
                format!(
                    "cannot be combined with {first:?}; expected only one of the keys for the {what}: {}",
                    keys.join(", ")
                ),
            )),
        }
    }
}
