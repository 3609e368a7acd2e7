//! Limit on the memory of a world's textures.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use crate::error::{Result, SceneError};
use crate::texture::cache::mebibytes;
use crate::texture::{Image, Texels, Texture, TextureCache};
use crate::world::World;

impl World {
    /// Returns the world with its images paged within `texture_memory`.
    ///
    /// # Errors
    /// The errors of [`World::page_textures`].
    pub fn with_texture_cache(mut self, memory: TextureCache) -> Result<Self> {
        let mut known = HashSet::new();
        for texture in &self.textures {
            if known.insert(Arc::as_ptr(&texture.image)) {
                memory.count(&texture.image);
            }
        }
        self.texture_cache = Some(Arc::new(memory));
        self.page_textures()?;
        Ok(self)
    }

    /// Checks that all textures fit into their memory.
    ///
    /// # Errors
    /// [`SceneError::World`] if they do not fit.
    pub fn check_textures_in_memory(&self) -> Result<()> {
        match &self.texture_cache {
            Some(memory) if memory.is_exceeded() => Err(SceneError::world(format!(
                "the textures require {}, more than texture_memory = {}; videos, data sets and workers need a copy of all \
                 textures, so raise texture_memory or render the images one by one",
                mebibytes(memory.requested_bytes.load(Ordering::Relaxed)),
                mebibytes(memory.limit)
            ))),
            _ => Ok(()),
        }
    }

    /// If the images exceed the texture memory, moves all of them to the temporary file and adds a notice.
    ///
    /// # Errors
    /// [`SceneError::Storage`] if the file cannot be written.
    pub fn page_textures(&mut self) -> Result<()> {
        let Some(memory) = &self.texture_cache else { return Ok(()) };
        if !memory.is_exceeded() {
            return Ok(());
        }
        let mut paged: HashMap<*const Image, Arc<Image>> = HashMap::new();
        for i in 0..self.textures.len() {
            let Texture { image, sampler } = &*self.textures[i];
            if matches!(image.texels, Texels::Paged(_)) {
                continue;
            }
            let (key, sampler) = (Arc::as_ptr(image), *sampler);
            let image = match paged.get(&key) {
                Some(known) => known.clone(),
                None => Arc::new(memory.page_out(image)?),
            };
            paged.insert(key, image.clone());
            self.textures[i] = Arc::new(Texture { image, sampler });
        }
        let notice = memory.notice();
        let new = notice.filter(|notice| !self.notices.contains(notice));
        self.notices.extend(new);
        Ok(())
    }
}
