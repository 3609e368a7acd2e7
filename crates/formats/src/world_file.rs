//! World files: TOML to a [`World`].

use std::path::Path;

use raycam_scene::World;

use crate::budget::Budget;
use crate::error::FormatError;

/// The world that `text` describes. `path` names it in errors; what it refers to is read from `folder` and nowhere else.
///
/// # Errors
/// See [`FormatError`].
pub fn parse(
    _text: &str,
    _folder: &Path,
    path: &Path,
    _budget: &Budget,
) -> Result<World, FormatError> {
    Err(FormatError::unsupported(path, "no reader yet"))
}
