//! [`AssetLoader`] for [`AssetRoot`]: the files that a description names, by the readers of all formats.

use std::sync::Arc;

use raycam_scene::{AssetLoader, ColorUse, IesProfile, Image, MeshFile, Texture, Wrap};

use crate::error::{FormatError, Result};
use crate::ies;
use crate::image::texture;
use crate::io::AssetRoot;
use crate::registry;

impl AssetLoader for AssetRoot {
    type Error = FormatError;

    fn mesh(&mut self, file: &str) -> Result<MeshFile> {
        self.read_asset(file, registry::read_mesh_file)
    }

    fn texture(&mut self, file: &str, wrap: [Wrap; 2], color_use: ColorUse) -> Result<Texture> {
        self.read_asset(file, |source, assets| {
            let (budget, notices) = assets.budget_and_notices();
            texture::decode(&source, wrap, color_use, budget, notices)
        })
    }

    fn profile(&mut self, file: &str) -> Result<IesProfile> {
        self.read_asset(file, |source, assets| ies::read(&source, &mut assets.budget))
    }

    fn store_texture(&mut self, image: Arc<Image>) -> Result<Arc<Image>> {
        Self::store_texture(self, image)
    }

    fn picture(&mut self, file: &str) -> Result<String> {
        let path = self.read_asset(file, |source, _| Ok(source.path))?;
        let whole = std::path::absolute(&path).map_err(|source| FormatError::Io { path, source })?;
        Ok(whole.to_string_lossy().into_owned())
    }

    fn in_context(error: FormatError, key: &str) -> FormatError {
        FormatError::Named { place: None, key: key.into(), source: Box::new(error) }
    }
}
