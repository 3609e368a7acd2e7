//! The folder that a world may read from.

use std::path::{Path, PathBuf};

use crate::budget::Budget;

/// A folder and what may still be read from it: names in files lead only to regular files inside.
#[derive(Debug)]
pub struct Folder {
    root: PathBuf,
    budget: Budget,
}

impl Folder {
    /// Everything inside `root`, symbolic links resolved, within `budget`.
    pub fn new(root: &Path, budget: &Budget) -> Self {
        Self {
            root: root.into(),
            budget: *budget,
        }
    }

    /// Where it is.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// What is left of the budget.
    pub fn budget(&self) -> &Budget {
        &self.budget
    }
}
