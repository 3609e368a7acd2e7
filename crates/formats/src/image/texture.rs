//! Images as textures.

use std::path::Path;
use std::sync::Arc;

use raycam_scene::{Image, Texels, Texture, TextureSampler, Wrap};

use crate::budget::Budget;
use crate::error::FormatError;
use crate::image::decode_image;
use crate::image::decoder::ColorUse;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;
use crate::io::optional_asset;

/// The texture in an image file of any kind that [`decode_image`] knows, as a colour, repeated in both directions.
///
/// Transparency is kept in the texels and gets a notice: what it means is up to the material.
///
/// # Errors
/// See [`decode_image`].
pub fn read_texture(path: &Path, budget: &Budget) -> Result<(Texture, Vec<String>), FormatError> {
    let source = AssetRoot::containing(path, budget).read(path)?;
    decode_texture(source.bytes, path, budget)
}

/// The texture in the bytes of an image file, as [`read_texture`]; `path` names it.
///
/// # Errors
/// See [`decode_image`].
pub fn decode_texture(bytes: Vec<u8>, path: &Path, budget: &Budget) -> Result<(Texture, Vec<String>), FormatError> {
    let source = InputFile::new(path, bytes);
    let mut notices = Vec::new();
    let texture = decode(&source, [Wrap::Repeat; 2], ColorUse::Color, &mut budget.clone(), &mut notices)?;
    Ok((texture, notices))
}

/// The texture in a file that has been read.
pub(crate) fn decode(
    source: &InputFile,
    wrap: [Wrap; 2],
    color_use: ColorUse,
    budget: &mut Budget,
    notices: &mut Vec<String>,
) -> Result<Texture, FormatError> {
    let InputFile { path, bytes, .. } = source;
    let image = decode_image(bytes, path, color_use, budget, notices)?;
    if has_transparency(&image) {
        notices.push(format!("{}: its alpha counts only where its material uses it", path.display()));
    }
    Ok(Texture { image: Arc::new(image), sampler: TextureSampler { wrap, ..TextureSampler::default() } })
}

/// The texture in an image file that a mesh file names; `None`, with a notice, where it is missing or not supported.
pub(crate) fn optional_texture(
    from: &Path,
    name: &str,
    wrap: Wrap,
    color_use: ColorUse,
    assets: &mut AssetRoot,
    notices: &mut Vec<String>,
) -> Result<Option<Texture>, FormatError> {
    let Some(source) = optional_asset::optional_file(from, name, assets, notices)? else {
        return Ok(None);
    };
    let budget = &mut assets.budget;
    match decode(&source, [wrap; 2], color_use, budget, notices) {
        Ok(texture) => Ok(Some(Texture { image: assets.store_texture(texture.image)?, ..texture })),
        Err(error @ FormatError::Unsupported { .. }) => {
            notices.push(format!("{}: left out: {error}", from.display()));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

fn has_transparency(image: &Image) -> bool {
    match &image.texels {
        Texels::Srgb8(texels) | Texels::Linear8(texels) => texels.iter().any(|t| t[3] != 255),
        Texels::Linear16(texels) => texels.iter().any(|t| t[3] != u16::MAX),
        Texels::Float(texels) => texels.iter().any(|t| t[3] != 1.0),
        Texels::Paged(_) => false, // not by a decoder
    }
}
