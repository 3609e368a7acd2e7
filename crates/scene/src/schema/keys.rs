//! Keys that a table contains, for rules about their combination.

use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;

/// Implements a method that returns fields of a struct with their keys: the fields' names, or the string before them.
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

/// Optional keys of a table, each with true if present.
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

    /// Rejects keys that cannot be combined with another key, for a reason.
    pub fn refuse(&self, keys: &[&str], reason: &str) -> Result<()> {
        self.refuse_as(ErrorCode::ConflictingValues, keys, reason)
    }

    /// Rejects keys that require another key, which is missing.
    pub fn refuse_without(&self, required: &str, keys: &[&str]) -> Result<()> {
        self.refuse_as(ErrorCode::MissingValue, keys, &format!("requires {required}, which is missing"))
    }

    /// Rejects the given keys with an error of this kind.
    pub fn refuse_as(&self, code: ErrorCode, keys: &[&str], reason: &str) -> Result<()> {
        match self.given(keys).first() {
            Some(key) => Err(SceneError::schema(code, *key, reason)),
            None => Ok(()),
        }
    }

    /// Returns the only present key of several alternative keys.
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
                format!("{first:?} is given too; expected only one of the keys for the {what}: {}", keys.join(", ")),
            )),
        }
    }
}
