//! Images as textures.

use std::path::Path;
use std::sync::Arc;

use raycam_scene::{Image, Texels, Texture, TextureSampler, Wrap};

use crate::budget::Budget;
use crate::error::FormatError;
use crate::image::{ColorUse, decode_image};
use crate::io::asset_root::{Folder, Source};

/// The texture in an image file of any kind that [`decode_image`] knows, as a colour, repeated in both directions.
///
/// Transparency is kept in the texels and gets a notice: what it means is up to the material.
///
/// # Errors
/// See [`decode_image`].
pub fn read_texture(path: &Path, budget: &Budget) -> Result<(Texture, Vec<String>), FormatError> {
    let source = Folder::around(path, budget).read(path)?;
    decode_texture(source.bytes, path, budget)
}

/// The texture in the bytes of an image file, as [`read_texture`]; `path` names it.
///
/// # Errors
/// See [`decode_image`].
pub fn decode_texture(
    bytes: Vec<u8>,
    path: &Path,
    budget: &Budget,
) -> Result<(Texture, Vec<String>), FormatError> {
    let source = Source::new(path, bytes);
    let mut notices = Vec::new();
    let texture = decode(
        &source,
        [Wrap::Repeat; 2],
        ColorUse::Color,
        &mut budget.clone(),
        &mut notices,
    )?;
    Ok((texture, notices))
}

/// The texture in a file that has been read.
pub(crate) fn decode(
    source: &Source,
    wrap: [Wrap; 2],
    color_use: ColorUse,
    budget: &mut Budget,
    notices: &mut Vec<String>,
) -> Result<Texture, FormatError> {
    let Source { path, bytes, .. } = source;
    let image = decode_image(bytes, path, color_use, budget, notices)?;
    if transparent(&image) {
        notices.push(format!(
            "{}: its alpha counts only where its material uses it",
            path.display()
        ));
    }
    Ok(Texture {
        image: Arc::new(image),
        sampler: TextureSampler {
            wrap,
            ..TextureSampler::default()
        },
    })
}

fn transparent(image: &Image) -> bool {
    match &image.texels {
        Texels::Srgb8(texels) | Texels::Linear8(texels) => texels.iter().any(|t| t[3] != 255),
        Texels::Linear16(texels) => texels.iter().any(|t| t[3] != u16::MAX),
        Texels::Float(texels) => texels.iter().any(|t| t[3] != 1.0),
        Texels::Paged(_) => false, // not by a decoder
    }
}
