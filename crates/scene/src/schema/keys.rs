//! Which keys of a table were written, for the rules about what goes with what.

use crate::error::{Result, SceneError};

/// A method's value of fields of a struct, with their keys: the fields' names, or what stands before them.
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

/// The optional keys of a table, each with whether it is there.
pub struct Keys<const N: usize>(pub [(&'static str, bool); N]);

impl<const N: usize> Keys<N> {
    /// The keys among `keys` that were written.
    pub fn given(&self, keys: &[&str]) -> Vec<&'static str> {
        self.0.iter().filter(|(key, given)| *given && keys.contains(key)).map(|(key, _)| *key).collect()
    }

    /// How many keys were written.
    pub fn count(&self) -> usize {
        self.0.iter().filter(|(_, given)| *given).count()
    }

    /// Refuses some keys, for a reason.
    pub fn refuse(&self, keys: &[&str], reason: &str) -> Result<()> {
        match self.given(keys).first() {
            Some(key) => Err(SceneError::schema(*key, reason)),
            None => Ok(()),
        }
    }

    /// The one of some keys that is there.
    pub fn exactly_one(&self, what: &str, keys: &[&str]) -> Result<&'static str> {
        match self.given(keys)[..] {
            [key] => Ok(key),
            [] => Err(SceneError::schema("", format!("no {what}: expected one of {}", keys.join(", ")))),
            [first, second, ..] => Err(SceneError::schema(
                second,
                format!("{first:?} is given too: expected one {what}, of {}", keys.join(", ")),
            )),
        }
    }
}
