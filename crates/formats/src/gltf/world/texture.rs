//! Imported textures: the image, its sampler, and its texture coordinates. An invalid index or value omits the image,
//! never the model.

use std::path::PathBuf;
use std::sync::Arc;

use raycam_scene::{ErrorCode, Image, NoticeCode, TexelFilter, Texture, TextureSampler, TextureSlot, Wrap};

use crate::error::Result;
use crate::gltf::document::{buffers, describe_missing};
use crate::gltf::json::Sampler;
use crate::gltf::json::texture_info::TextureInfo;
use crate::gltf::world::builder::Builder;
use crate::image::decode_image;
use crate::image::udim;
use crate::io::companion;
use raycam_scene::ColorUse;

impl Builder<'_, '_> {
    /// Texture slot for the texture reference at the position `place` of the document.
    pub(crate) fn slot(
        &mut self,
        place: &str,
        info: &Option<TextureInfo>,
        color_use: ColorUse,
    ) -> Result<Option<TextureSlot>> {
        let Some(info) = info else { return Ok(None) };
        let index = &format!("{place}.index");
        let Some(texture) = self.texture(index, info.index, color_use)? else { return Ok(None) };
        Ok(Some(TextureSlot { texture, uv_set: info.uv_set(), image_from_mesh: info.uv_transform().image_from_mesh() }))
    }

    /// Index of the world's texture for a document's texture and its use; `None` if the texture has no image.
    fn texture(&mut self, place: &str, index: usize, color_use: ColorUse) -> Result<Option<usize>> {
        let document = self.document;
        let Some(texture) = self.item_or_notice(&document.root.textures, index, place, "textures") else {
            return Ok(None);
        };
        let key = (index, color_use == ColorUse::Color);
        if let Some(&known) = self.textures.textures.get(&key) {
            return Ok(Some(known));
        }
        let place = format!("textures[{index}]");
        let extensions = &texture.extensions;
        // KTX2 and WebP are alternatives for readers that support them; the image in `source` is for other readers.
        let better =
            [&extensions.basisu, &extensions.webp].into_iter().find_map(|extension| extension.as_ref()?.source);
        let sources: Vec<usize> = better.into_iter().chain(texture.source).collect();
        if sources.is_empty() {
            self.diagnostics.note(
                NoticeCode::MissingValue,
                place,
                "the texture has no image, so the material does \
                not use it",
            );
            return Ok(None);
        }
        let mut image = None;
        for source in sources {
            if image.is_none() {
                image = self.image(&format!("{place}.source"), source, color_use)?;
            }
        }
        let Some(image) = image else { return Ok(None) };
        let sampler = texture.sampler.and_then(|sampler| {
            let json =
                self.item_or_notice(&document.root.samplers, sampler, &format!("{place}.sampler"), "samplers")?;
            Some(self.texture_sampler(&format!("samplers[{sampler}]"), json))
        });
        let usual = TextureSampler { mip: Some(TexelFilter::Linear), ..TextureSampler::default() };
        let sampler = sampler.unwrap_or(usual);
        let added = self.world.add_texture(Texture { image, sampler });
        self.textures.textures.insert(key, added);
        Ok(Some(added))
    }

    /// Item of the list `part`; `place` is the position in the document at which its index is written. `None`, with a
    /// notice, if the item does not exist.
    fn item_or_notice<'b, T>(&mut self, all: &'b [T], index: usize, place: &str, part: &str) -> Option<&'b T> {
        let found = all.get(index);
        if found.is_none() {
            let message = format!("omitted: {}", describe_missing(part, index, all.len()));
            self.diagnostics.note(NoticeCode::IgnoredElement, place.to_owned(), message);
        }
        found
    }

    /// Image with an index; `None`, with a notice, if the image is missing, truncated or has an unknown format.
    fn image(&mut self, place: &str, index: usize, color_use: ColorUse) -> Result<Option<Arc<Image>>> {
        if self.item_or_notice(&self.document.root.images, index, place, "images").is_none() {
            return Ok(None);
        }
        let key = (index, color_use == ColorUse::Color);
        if let Some(known) = self.textures.images.get(&key) {
            return Ok(known.clone());
        }
        let image = match self.decoded_image(index, color_use) {
            Ok(image) => Some(self.assets.store_texture(Arc::new(image))?),
            Err(error) if companion::can_be_left_out(&error) => {
                // The path and the image's index are removed, because the notice adds them.
                let text = error.to_string();
                let text = text.strip_prefix(&format!("{}: ", self.document.path.display())).unwrap_or(&text);
                let text = text.strip_prefix(&format!("images[{index}]: ")).unwrap_or(text);
                self.diagnostics.note(
                    NoticeCode::UnreadableFile,
                    format!("images[{index}]"),
                    format!("omitted: {text}"),
                );
                None
            }
            Err(error) => return Err(error),
        };
        self.textures.images.insert(key, image.clone());
        Ok(image)
    }

    /// Image with an index, from its file, its data URI or its buffer view.
    fn decoded_image(&mut self, index: usize, color_use: ColorUse) -> Result<Image> {
        let document = self.document;
        let image = &document.root.images[index];
        let place = format!("images[{index}]");
        let (bytes, name) = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                let uri_place = format!("{place}.uri");
                if let Some(reason) = udim::reason(document.path, &buffers::percent_decoded(uri), self.assets) {
                    return Err(document.fault(ErrorCode::UnsupportedFeature, format!("{uri_place}: {reason}")));
                }
                let notices = &mut self.world.notices;
                let fetched = buffers::read_uri(document.source, uri, &uri_place, self.assets, notices)?;
                let named = !uri.starts_with("data:");
                (fetched.into(), named.then_some(&uri[..]))
            }
            (None, Some(view)) => {
                let found = document.resources.bytes(view);
                let (bytes, _) = found
                    .map_err(|e| document.fault(ErrorCode::IndexOutOfRange, format!("{place}.bufferView: {e}")))?;
                let bytes = bytes.read().map_err(|error| document.read_error(error))?;
                (bytes, None)
            }
            (None, None) => {
                return Err(document
                    .fault(ErrorCode::MissingValue, format!("{place}: neither uri nor bufferView (ONE_OF_MISMATCH)")));
            }
        };
        let shown = document.path.display();
        let path = PathBuf::from(format!("{shown}: {place}"));
        let mut notices = Vec::new();
        let mut decoded = decode_image(&bytes, &path, color_use, &mut self.assets.budget, &mut notices)?;
        self.world.notices.extend(notices);
        decoded.name = match (&image.name[..], name) {
            ("", Some(name)) => name.into(),
            ("", None) => place,
            (name, _) => name.into(),
        };
        Ok(decoded)
    }

    /// Sampler of a texture. A value that is not in the list causes a notice and is replaced by the default.
    fn texture_sampler(&mut self, place: &str, sampler: &Sampler) -> TextureSampler {
        use TexelFilter::{Linear, Nearest};
        let mut unknown = |name: &str, code: u32, usual: &str| {
            let message = format!("{code} (VALUE_NOT_IN_LIST); treated as {usual}");
            self.diagnostics.note(NoticeCode::ReplacedValue, format!("{place}.{name}"), message);
        };
        let mut wrap = |name, code| match code {
            None | Some(10497) => Wrap::Repeat,
            Some(33071) => Wrap::Clamp,
            Some(33648) => Wrap::Mirror,
            Some(code) => {
                unknown(name, code, "10497, repeat");
                Wrap::Repeat
            }
        };
        let wrap = [wrap("wrapS", sampler.wrap_s), wrap("wrapT", sampler.wrap_t)];
        let magnification = match sampler.mag_filter {
            None | Some(9729) => Linear,
            Some(9728) => Nearest,
            Some(code) => {
                unknown("magFilter", code, "9729, linear");
                Linear
            }
        };
        let (minification, mip) = match sampler.min_filter {
            None | Some(9987) => (Linear, Some(Linear)),
            Some(9728) => (Nearest, None),
            Some(9729) => (Linear, None),
            Some(9984) => (Nearest, Some(Nearest)),
            Some(9985) => (Linear, Some(Nearest)),
            Some(9986) => (Nearest, Some(Linear)),
            Some(code) => {
                unknown("minFilter", code, "9987, linear");
                (Linear, Some(Linear))
            }
        };
        TextureSampler { wrap, magnification, minification, mip }
    }
}
