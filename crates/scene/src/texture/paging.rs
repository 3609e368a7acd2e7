//! Inserts images into the texture cache, and moves them from memory to the cache's file.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use crate::error::Result;
use crate::texture::cache::paged::{Level, PagedTexels, TILE_SIZE};
use crate::texture::cache::{TextureCache, storage_error};
use crate::texture::image::{Image, Texels};
use crate::texture::texel_weight::TexelWeight;

impl TextureCache {
    /// Adds an image to the cache and returns it; it is moved to the temporary file if it and the images inserted so
    /// far exceed the limit.
    ///
    /// # Errors
    /// The errors of [`Image::validate`] and [`TextureCache::page_out`].
    pub fn insert(self: &Arc<Self>, image: Arc<Image>) -> Result<Arc<Image>> {
        image.validate()?;
        self.count(&image);
        if self.is_exceeded() { self.page_out(&image).map(Arc::new) } else { Ok(image) }
    }

    /// Adds the size of an image to the requested memory.
    pub(crate) fn count(&self, image: &Image) {
        self.requested_bytes.fetch_add(image.bytes(), Ordering::Relaxed);
    }

    /// Returns the image with its texels and mip map in the temporary file.
    ///
    /// # Errors
    /// [`crate::SceneError::Storage`] if the file cannot be written.
    pub fn page_out(self: &Arc<Self>, image: &Image) -> Result<Image> {
        if matches!(image.texels, Texels::Paged(_)) {
            return Ok(image.clone());
        }
        let mut levels = vec![self.write(image)?];
        let mut by_alpha = levels.clone();
        let is_opaque = image.is_opaque();
        for (weight, levels) in [(TexelWeight::Area, &mut levels), (TexelWeight::Alpha, &mut by_alpha)] {
            if weight == TexelWeight::Alpha && is_opaque {
                break;
            }
            let mut next = image.halved(weight);
            while let Some(image) = next {
                levels.push(self.write(&image)?);
                next = image.halved(weight);
            }
        }
        let by_alpha = (!is_opaque).then_some(by_alpha);
        Ok(Image {
            name: image.name.clone(),
            size: image.size,
            texels: Texels::Paged(PagedTexels::new(self.clone(), levels, by_alpha)),
            encoded: image.encoded.clone(),
        })
    }

    /// Writes an image's tiles row by row from the top, and each row from left to right.
    fn write(&self, image: &Image) -> Result<Level> {
        let [width, height] = image.size.map(|n| n as usize);
        let file = self.file()?;
        let (mut offset, mut bytes) = (None, Vec::new());
        for top in (0..height).step_by(TILE_SIZE) {
            bytes.clear();
            for left in (0..width).step_by(TILE_SIZE) {
                let right = (left + TILE_SIZE).min(width);
                for y in top..(top + TILE_SIZE).min(height) {
                    let row = y * width;
                    image.texels.write_bytes(row + left..row + right, &mut bytes);
                }
            }
            let start = file.append(&bytes).map_err(|error| {
                let written = file.len();
                storage_error(&file.folder, &error, "cannot be written", written)
            })?;
            offset.get_or_insert(start);
        }
        Ok(Level { kind: image.texels.kind(), size: image.size, offset: offset.unwrap_or(0) })
    }
}
