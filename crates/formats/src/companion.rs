//! Files that a mesh file names and can do without: where one is missing or may not be read, the mesh is shown without it
//! and a notice says so.

use std::path::Path;

use raycam_scene::{Files, Model, Texture, Wrap};

use crate::error::FormatError;
use crate::folder::{Folder, Source};
use crate::image::ColorUse;
use crate::texture;

/// The file of this name, as written in the file `from`.
pub(crate) fn file(
    from: &Path,
    name: &str,
    folder: &mut Folder,
    notices: &mut Vec<String>,
) -> Result<Option<Source>, FormatError> {
    match folder.follow(from, name) {
        Err(error @ (FormatError::Io { .. } | FormatError::Reference { .. })) => {
            notices.push(format!("{}: left out: {error}", from.display()));
            Ok(None)
        }
        source => source.map(Some),
    }
}

/// The image of this name as a texture of the model; its index.
pub(crate) fn texture(
    from: &Path,
    name: &str,
    wrap: Wrap,
    color_use: ColorUse,
    folder: &mut Folder,
    model: &mut Model,
) -> Result<Option<usize>, FormatError> {
    // Files from Windows have the other slash.
    let name = name.replace('\\', "/");
    let Some(source) = file(from, &name, folder, &mut model.notices)? else {
        return Ok(None);
    };
    match texture::decode(
        &source,
        [wrap; 2],
        color_use,
        &mut folder.budget,
        &mut model.notices,
    ) {
        Ok(texture) => model.textures.push(Texture {
            image: folder.keep(texture.image)?,
            ..texture
        }),
        Err(error @ FormatError::Unsupported { .. }) => {
            model
                .notices
                .push(format!("{}: left out: {error}", from.display()));
            return Ok(None);
        }
        Err(error) => return Err(error),
    }
    Ok(Some(model.textures.len() - 1))
}
