//! Names of channels that show the light of one source.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// Prefix of the channel names.
pub(crate) const LIGHT_PREFIX: &str = "light:";

/// Maximum number of names, and maximum length of a name in bytes. Names are never freed.
const MAX_NAMES: usize = 1 << 16;
const MAX_LENGTH: usize = 256;

/// Channel name `light:NAME`. Equal names share one string, which exists until the process ends, so that
/// channels can be copied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LightName(&'static str);

static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

impl LightName {
    /// Returns the name of a channel; `None` if the prefix is missing, if no name follows, or if a limit is exceeded.
    pub fn from_channel(name: &str) -> Option<Self> {
        let light = name.strip_prefix(LIGHT_PREFIX)?;
        if light.is_empty() || light.len() > MAX_LENGTH {
            return None;
        }
        let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = names.get(name) {
            return Some(Self(known));
        }
        if names.len() >= MAX_NAMES {
            return None;
        }
        let name: &'static str = Box::leak(name.into());
        names.insert(name);
        Some(Self(name))
    }

    /// Name of the channel, with its prefix.
    pub fn channel(self) -> &'static str {
        self.0
    }

    /// Name of the light, without the prefix.
    pub fn light(self) -> &'static str {
        self.0.strip_prefix(LIGHT_PREFIX).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_names_have_a_prefix_and_a_limited_length() {
        let name = LightName::from_channel("light:key lamp").unwrap();
        assert_eq!((name.channel(), name.light()), ("light:key lamp", "key lamp"));
        assert_eq!(LightName::from_channel("light:key lamp"), Some(name));
        let long = format!("light:{}", "x".repeat(MAX_LENGTH + 1));
        for wrong in ["color", "light", "light:", &long] {
            assert_eq!(LightName::from_channel(wrong), None);
        }
    }
}
