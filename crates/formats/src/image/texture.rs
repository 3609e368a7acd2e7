//! Reading of image files as textures.

use std::path::Path;
use std::sync::Arc;

use raycam_scene::{Notice, NoticeCode, Texture, TextureSampler, Wrap};

use crate::budget::Budget;
use crate::error::Result;
use crate::image::decode_image;
use crate::image::udim;
use crate::io::{AssetRoot, InputFile, companion, reference};
use raycam_scene::ColorUse;

/// Reads the texture in an image file of any format that [`decode_image`] supports, as a colour, repeated in both
/// directions.
///
/// Transparency is kept in the texels and causes a notice; the material determines its meaning.
///
/// # Errors
/// See [`decode_image`].
pub fn read_texture(path: &Path, budget: &Budget) -> Result<(Texture, Vec<Notice>)> {
    let source = AssetRoot::containing(path, budget).read(path)?;
    decode_texture(source.bytes, path, budget)
}

/// Reads the texture in the bytes of an image file, like [`read_texture`]; `path` is its name.
///
/// # Errors
/// See [`decode_image`].
pub fn decode_texture(bytes: Vec<u8>, path: &Path, budget: &Budget) -> Result<(Texture, Vec<Notice>)> {
    let source = InputFile::new(path, bytes);
    let mut notices = Vec::new();
    let texture = decode(&source, [Wrap::Repeat; 2], ColorUse::Color, &mut budget.clone(), &mut notices)?;
    notices.extend(alpha_notice(path, &texture));
    Ok((texture, notices))
}

/// Texture in a file that has been read.
pub(crate) fn decode(
    source: &InputFile,
    wrap: [Wrap; 2],
    color_use: ColorUse,
    budget: &mut Budget,
    notices: &mut Vec<Notice>,
) -> Result<Texture> {
    let InputFile { path, bytes, .. } = source;
    let image = decode_image(bytes, path, color_use, budget, notices)?;
    Ok(Texture { image: Arc::new(image), sampler: TextureSampler { wrap, ..TextureSampler::default() } })
}

/// Texture in an image file that a mesh file refers to; `None`, with a notice, if the file is missing, truncated or not
/// an image.
pub(crate) fn optional_texture(
    from: &Path,
    name: &[u8],
    wrap: Wrap,
    color_use: ColorUse,
    assets: &mut AssetRoot,
    notices: &mut Vec<Notice>,
) -> Result<Option<Texture>> {
    let name = match udim::single_image(from, &reference::with_slashes(name), assets) {
        Ok(name) => name,
        Err(reason) => {
            notices
                .push(Notice::new(NoticeCode::IgnoredFeature, format!("{}: image omitted: {reason}", from.display())));
            return Ok(None);
        }
    };
    let Some(source) = companion::optional_file(from, &name, assets, notices)? else { return Ok(None) };
    notices.extend(udim::notice(from, &name, assets));
    match decode(&source, [wrap; 2], color_use, &mut assets.budget, notices) {
        Ok(texture) => {
            if !assets.uses_alpha_as_written {
                notices.extend(alpha_notice(&source.path, &texture));
            }
            Ok(Some(Texture { image: assets.store_texture(texture.image)?, ..texture }))
        }
        Err(error) if companion::can_be_left_out(&error) => {
            notices
                .push(Notice::new(NoticeCode::UnreadableFile, format!("{}: image omitted: {error}", from.display())));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// Notice about alpha, which is used only if the mesh file specifies it.
fn alpha_notice(path: &Path, texture: &Texture) -> Option<Notice> {
    texture.image.texels.has_alpha().then(|| {
        let message = format!(
            "{}: the alpha channel is ignored, because no material uses it; set map_d in an MTL file, or alpha = \
             \"blend\" for the object",
            path.display()
        );
        Notice::new(NoticeCode::UnusedAlpha, message)
    })
}
