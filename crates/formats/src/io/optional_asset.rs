//! Files that a mesh file names and can do without: where one is missing or may not be read, the mesh is shown without it
//! and a notice says so.

use std::path::Path;

use raycam_scene::{Files, Texture, Wrap};

use crate::error::FormatError;
use crate::image::ColorUse;
use crate::image::texture;
use crate::io::asset_root::{Folder, Source};

/// The file of this name, as written in the file `from`.
pub(crate) fn file(
    from: &Path,
    name: &str,
    folder: &mut Folder,
    notices: &mut Vec<String>,
) -> Result<Option<Source>, FormatError> {
    // Files from Windows have the other slash; before a space it is that of a shell.
    let name = name.replace("\\ ", " ").replace('\\', "/");
    match folder.follow(from, &name) {
        Err(error @ (FormatError::Io { .. } | FormatError::Reference { .. })) => {
            notices.push(format!("{}: left out: {error}", from.display()));
            Ok(None)
        }
        source => source.map(Some),
    }
}

/// The image of this name as a texture.
pub(crate) fn texture(
    from: &Path,
    name: &str,
    wrap: Wrap,
    color_use: ColorUse,
    folder: &mut Folder,
    notices: &mut Vec<String>,
) -> Result<Option<Texture>, FormatError> {
    let Some(source) = file(from, name, folder, notices)? else {
        return Ok(None);
    };
    let budget = &mut folder.budget;
    match texture::decode(&source, [wrap; 2], color_use, budget, notices) {
        Ok(texture) => Ok(Some(Texture {
            image: folder.keep(texture.image)?,
            ..texture
        })),
        Err(error @ FormatError::Unsupported { .. }) => {
            notices.push(format!("{}: left out: {error}", from.display()));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}
