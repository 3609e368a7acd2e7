//! Implementation of [`AssetLoader`] for [`AssetRoot`]: reads the files that a description names, in all formats.

use std::sync::Arc;

use raycam_scene::{AssetLoader, ColorUse, IesProfile, Image, MeshFile, Notice, NoticeCode, Texture, Wrap};

use crate::error::{FormatError, Result};
use crate::ies;
use crate::image::texture;
use crate::io::AssetRoot;
use crate::registry;

impl AssetRoot {
    /// Adds a notice for an environment image whose width is not twice its height.
    pub fn check_environment_shape(&mut self, name: &str, [columns, rows]: [u32; 2]) {
        if u64::from(columns) != 2 * u64::from(rows) {
            let message = format!(
                "an environment image should be twice as wide as high, but has {columns} x {rows} pixels; it is \
                 stretched to cover all directions"
            );
            self.budget_and_notices().1.push(Notice::about(NoticeCode::Implausible, name, message));
        }
    }
}

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

    fn environment(&mut self, file: &str) -> Result<Arc<Image>> {
        self.read_asset(file, |source, assets| {
            let (budget, notices) = assets.budget_and_notices();
            let wrap = [Wrap::Repeat, Wrap::Clamp];
            let image = texture::decode(&source, wrap, ColorUse::Color, budget, notices)?.image;
            assets.check_environment_shape(&source.path.display().to_string(), image.size);
            Ok(image)
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

    fn bytes(&mut self, file: &str) -> Result<Vec<u8>> {
        self.read_asset(file, |source, _| Ok(source.bytes))
    }

    fn in_context(error: FormatError, key: &str) -> FormatError {
        FormatError::Named { place: None, key: key.into(), source: Box::new(error) }
    }
}
