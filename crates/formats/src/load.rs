//! One table of everything that can be loaded.

use std::path::Path;

use raycam_scene::World;

use crate::budget::Budget;
use crate::error::FormatError;

/// The world in a file: `.toml`, `.obj`, `.ply`, `.stl`, `.off`, in capitals or not.
///
/// A mesh file becomes a world of its parts, without lights and cameras, z up.
///
/// # Errors
/// See [`FormatError`]; an unknown extension lists the known ones.
pub fn load(path: &Path, _budget: &Budget) -> Result<World, FormatError> {
    Err(FormatError::unsupported(path, "no reader yet"))
}
