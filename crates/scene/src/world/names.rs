//! Unique names.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Names in use.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Names {
    /// For each name in use, the number to try next for a duplicate.
    next: BTreeMap<String, usize>,
}

impl Names {
    /// Creates the set of these names, all in use.
    pub fn from_used<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let mut known = Self::default();
        for name in names {
            known.unique(name);
        }
        known
    }

    /// Returns the name if it is free, otherwise with the first free number appended: `box`, `box-2`, `box-3`.
    pub fn unique(&mut self, wanted: &str) -> String {
        let Some(next) = self.next.get(wanted).copied() else {
            self.next.insert(wanted.into(), 2);
            return wanted.into();
        };
        let mut number = next;
        let name = loop {
            let name = format!("{wanted}-{number}");
            number += 1;
            if !self.next.contains_key(&name) {
                break name;
            }
        };
        self.next.insert(wanted.into(), number);
        self.next.insert(name.clone(), 2);
        name
    }
}
