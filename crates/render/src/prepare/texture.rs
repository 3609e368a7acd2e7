//! Prepared textures: mip maps and anisotropic lookups over ray footprints.
//!
//! T. Akenine-Möller et al., "Improved Shader and Texture Level of Detail Using Ray Cones", JCGT 10(1), 2021. A cone is
//! as wide as the part of a pixel that a sample represents. Its footprint on a triangle is an ellipse: the short axis
//! selects the mip level, and several lookups cover the long axis. Scattered rays use the full-resolution image, which
//! their many samples average without bias.

use std::collections::HashMap;
use std::iter;
use std::sync::{Arc, OnceLock};

use glam::Vec2;
use raycam_scene::texture::AlphaMean;
use raycam_scene::{Image, TexelFilter, Texture, TextureSampler, World};

use crate::error::RenderError;
use crate::prepare::family::{BuiltPart, SharedParts};

/// Largest number of lookups along the long axis.
const MAX_ANISOTROPY: f32 = 16.0;
/// Tolerance of footprint sizes. A footprint that is wider than a texel by at most this fraction counts as one texel
/// wide. An ellipse that exceeds a whole number of lookups by at most this fraction of a lookup needs no additional
/// lookup. A ray that hits a texel's centre therefore returns exactly that texel.
const ROUNDING: f32 = 1.0 / 16.0;

/// Image, and its mip maps after they have been requested. Textures of all worlds of a family that show the same image
/// share these maps.
#[derive(Debug)]
pub(crate) struct PreparedImage {
    image: Arc<Image>,
    /// Mip levels, the largest first, without the image itself, which exists only while a texture uses it.
    smaller: OnceLock<Vec<Arc<Image>>>,
    /// Mip levels for [`TexelWeight::Alpha`]; `None` for an opaque image, whose levels equal `smaller`.
    smaller_by_alpha: OnceLock<Option<Vec<Arc<Image>>>>,
}

/// Texture, and its mip map after it has been requested.
#[derive(Debug)]
pub(crate) struct PreparedTexture {
    texture: Arc<Texture>,
    pub image: Arc<PreparedImage>,
    /// Mip levels, the full image first.
    levels: OnceLock<Vec<Texture>>,
    /// Mip map for [`TexelWeight::Alpha`]; `None` for an opaque image, for which this map would be equal to `levels`.
    levels_by_alpha: OnceLock<Option<Vec<Texture>>>,
}

/// Lookups whose mean covers a footprint.
struct Lookups {
    /// Long axis of the footprint, along which the lookups are spread.
    long: Vec2,
    /// Number of lookups.
    count: f32,
    /// Mip level, which may be between two levels.
    level: f32,
}

/// Weight of a texel's colour in lookups.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TexelWeight {
    /// All texels have the same weight.
    Uniform,
    /// Colours are weighted by alpha, the opacity, so that transparent texels do not contribute.
    Alpha,
}

/// Prepares the textures of a world. Known textures and images keep their mip maps; new images are validated.
///
/// # Errors
/// [`RenderError::World`] for an image whose texels do not match its size or are not finite.
pub(crate) fn prepare_textures(
    world: &World,
    known: &SharedParts<PreparedTexture>,
    images: &SharedParts<PreparedImage>,
) -> Result<Vec<Arc<PreparedTexture>>, RenderError> {
    let mut new: HashMap<*const Image, Arc<PreparedImage>> = HashMap::new();
    let mut prepare_image = |image: &Arc<Image>| -> Result<Arc<PreparedImage>, RenderError> {
        if let Some(known) = new.get(&Arc::as_ptr(image)).cloned().or_else(|| images.built_of(image)) {
            return Ok(known);
        }
        image.validate().map_err(RenderError::world)?;
        let prepared = Arc::new(PreparedImage::new(image.clone()));
        new.insert(Arc::as_ptr(image), prepared.clone());
        Ok(prepared)
    };
    let prepare = |texture: &Arc<Texture>| match known.built_of(texture) {
        Some(known) => Ok(known),
        None => Ok(Arc::new(PreparedTexture::new(texture.clone(), prepare_image(&texture.image)?))),
    };
    world.textures.iter().map(prepare).collect()
}

impl PreparedImage {
    pub fn new(image: Arc<Image>) -> Self {
        Self { image, smaller: OnceLock::new(), smaller_by_alpha: OnceLock::new() }
    }

    /// Mip levels, the image itself first.
    fn levels(&self) -> Vec<Arc<Image>> {
        self.with_image(self.smaller.get_or_init(|| self.image.mip_map().split_off(1)))
    }

    /// Mip levels for [`TexelWeight::Alpha`], the image itself first; `None` for an opaque image.
    fn levels_by_alpha(&self) -> Option<Vec<Arc<Image>>> {
        let smaller = self
            .smaller_by_alpha
            .get_or_init(|| (!self.image.is_opaque()).then(|| self.image.mip_map_by_alpha().split_off(1)));
        smaller.as_ref().map(|smaller| self.with_image(smaller))
    }

    fn with_image(&self, smaller: &[Arc<Image>]) -> Vec<Arc<Image>> {
        iter::once(&self.image).chain(smaller).cloned().collect()
    }
}

impl PreparedTexture {
    pub fn new(texture: Arc<Texture>, image: Arc<PreparedImage>) -> Self {
        Self { texture, image, levels: OnceLock::new(), levels_by_alpha: OnceLock::new() }
    }

    /// Number of columns and rows of the image.
    pub fn size(&self) -> [u32; 2] {
        self.texture.image.size
    }

    /// True if enlarged texels are interpolated.
    pub fn is_interpolated(&self) -> bool {
        self.texture.sampler.magnification == TexelFilter::Linear
    }

    /// Value of the texture at texture coordinates.
    pub fn lookup(&self, uv: [f32; 2], weight: TexelWeight) -> [f32; 4] {
        lookup(&self.texture, uv, weight)
    }

    /// Mean over a footprint around a point, given by its axes.
    pub fn mean(&self, uv: [f32; 2], axes: [Vec2; 2], weight: TexelWeight) -> [f32; 4] {
        let Some(Lookups { long, count, level }) = self.lookups_over(axes) else {
            return self.lookup(uv, weight);
        };
        let (mut sum, mut by_alpha) = ([0.0; 4], AlphaMean::default());
        for i in 0..count as u32 {
            let at = Vec2::from(uv) + long * ((i as f32 + 0.5) / count - 0.5);
            let texel = self.trilinear(at.to_array(), level, weight);
            match weight {
                TexelWeight::Uniform => sum.iter_mut().zip(texel).for_each(|(sum, value)| *sum += value / count),
                TexelWeight::Alpha => by_alpha.add(texel, 1.0 / count),
            }
        }
        if weight == TexelWeight::Alpha { by_alpha.texel() } else { sum }
    }

    /// Mean of [`Texture::gradient`] over a footprint around a point, given by its axes.
    pub fn mean_gradient(&self, uv: [f32; 2], axes: [Vec2; 2]) -> [f32; 2] {
        let Some(Lookups { long, count, level }) = self.lookups_over(axes) else {
            return self.texture.gradient(uv);
        };
        let levels = self.levels(TexelWeight::Uniform);
        let last = levels.len() - 1;
        let first = (level as usize).min(last);
        let between = if first == last { 0.0 } else { level - first as f32 };
        let mut sum = Vec2::ZERO;
        for i in 0..count as u32 {
            let at = (Vec2::from(uv) + long * ((i as f32 + 0.5) / count - 0.5)).to_array();
            let fine = Vec2::from(levels[first].gradient(at));
            sum += match between > 0.0 {
                true => fine.lerp(levels[first + 1].gradient(at).into(), between),
                false => fine,
            };
        }
        (sum / count).to_array()
    }

    /// The lookups whose mean covers a footprint; `None` for a footprint within a texel, and without a mip map.
    #[inline]
    fn lookups_over(&self, axes: [Vec2; 2]) -> Option<Lookups> {
        let size = Vec2::from(self.texture.image.size.map(|n| n as f32));
        let (long, minor) = principal_axes(axes.map(|axis| axis * size));
        let (major, long) = (long.length(), long / size);
        // Footprints that are not finite are left to the texture's sampler.
        if self.texture.sampler.mip.is_none() || !(major > 1.0 + ROUNDING && major.is_finite()) {
            return None;
        }
        let count = (major / minor.max(1.0) - ROUNDING).ceil().clamp(1.0, MAX_ANISOTROPY);
        let level = minor.max(major / count).max(1.0).log2();
        Some(Lookups { long, count, level })
    }

    /// Trilinear lookup between mip levels.
    fn trilinear(&self, uv: [f32; 2], level: f32, weight: TexelWeight) -> [f32; 4] {
        let levels = self.levels(weight);
        let last = levels.len() - 1;
        let first = (level as usize).min(last);
        let fine = lookup(&levels[first], uv, weight);
        let between = level - first as f32;
        if first == last || between <= 0.0 {
            return fine;
        }
        let coarse = lookup(&levels[first + 1], uv, weight);
        if weight == TexelWeight::Alpha && fine[3] != coarse[3] {
            let mut mean = AlphaMean::default();
            mean.add(fine, 1.0 - between);
            mean.add(coarse, between);
            return mean.texel();
        }
        [0, 1, 2, 3].map(|i| fine[i] + (coarse[i] - fine[i]) * between)
    }

    fn levels(&self, weight: TexelWeight) -> &[Texture] {
        let of_texture = |levels| mip_levels(&self.texture, levels);
        let plain = || self.levels.get_or_init(|| of_texture(self.image.levels()));
        if weight == TexelWeight::Uniform {
            return plain();
        }
        let by_alpha = self.levels_by_alpha.get_or_init(|| self.image.levels_by_alpha().map(of_texture));
        by_alpha.as_ref().unwrap_or_else(|| plain())
    }
}

impl BuiltPart for PreparedImage {
    type Input = Image;

    fn input(&self) -> &Arc<Image> {
        &self.image
    }
}

impl BuiltPart for PreparedTexture {
    type Input = Texture;

    fn input(&self) -> &Arc<Texture> {
        &self.texture
    }
}

/// Mip map with bilinear filtering.
fn mip_levels(texture: &Texture, levels: Vec<Arc<Image>>) -> Vec<Texture> {
    let sampler = TextureSampler { magnification: TexelFilter::Linear, ..texture.sampler };
    levels.into_iter().map(|image| Texture { image, sampler }).collect()
}

fn lookup(texture: &Texture, uv: [f32; 2], weight: TexelWeight) -> [f32; 4] {
    match weight {
        TexelWeight::Uniform => texture.lookup(uv),
        TexelWeight::Alpha => texture.lookup_by_alpha(uv),
    }
}

/// The long axis of an ellipse with these conjugate diameters, and the length of the short axis: the singular value
/// decomposition of a 2 x 2 matrix.
fn principal_axes([a, b]: [Vec2; 2]) -> (Vec2, f32) {
    let (xx, yy, xy) = (a.x * a.x + b.x * b.x, a.y * a.y + b.y * b.y, a.x * a.y + b.x * b.y);
    let (mean, half) = ((xx + yy) / 2.0, (xx - yy) / 2.0);
    let square = mean + half.hypot(xy);
    // The direction of the long axis is the longer column of the matrix that projects to this axis.
    let direction = if half >= 0.0 { Vec2::new(square - yy, xy) } else { Vec2::new(xy, square - xx) };
    let major = square.sqrt();
    // The short axis is computed from the determinant, which is the product of both axes, to avoid cancellation.
    (direction.try_normalize().unwrap_or(Vec2::X) * major, a.perp_dot(b).abs() / major)
}

#[cfg(test)]
mod tests {
    use raycam_scene::Texels;

    use super::*;

    fn gray(size: [u32; 2], of: impl Fn(u32, u32) -> f32) -> Image {
        let texels = (0..size[0] * size[1]).map(|i| [of(i % size[0], i / size[0]); 4]).collect();
        Image::new("", size, Texels::Float(texels))
    }

    fn prepared(image: Arc<Image>) -> PreparedTexture {
        let sampler = TextureSampler { mip: Some(TexelFilter::Linear), ..TextureSampler::default() };
        let known = Arc::new(PreparedImage::new(image.clone()));
        PreparedTexture::new(Arc::new(Texture { image, sampler }), known)
    }

    /// Prepares a world with one texture per image, and records the prepared images in `known`.
    fn prepare(images: &[&Arc<Image>], known: &SharedParts<PreparedImage>) -> Vec<Arc<PreparedTexture>> {
        let mut world = World::default();
        for &image in images {
            world.add_texture(Texture { image: image.clone(), sampler: TextureSampler::default() });
        }
        let textures = prepare_textures(&world, &SharedParts::default(), known).unwrap();
        known.keep(textures.iter().map(|texture| &texture.image));
        textures
    }

    #[test]
    fn textures_of_one_image_share_its_mip_maps_in_all_worlds() {
        let image = Arc::new(gray([16, 8], |x, y| ((x ^ y) % 3) as f32 / 2.0));
        let equal = Arc::new(Image::clone(&image));
        let known = SharedParts::default();
        let first = prepare(&[&image, &image, &equal], &known);
        let second = prepare(&[&image], &known);
        for weight in [TexelWeight::Uniform, TexelWeight::Alpha] {
            let levels = |texture: &PreparedTexture| -> Vec<_> {
                texture.levels(weight).iter().map(|level| level.image.clone()).collect()
            };
            let expected = match weight {
                TexelWeight::Uniform => image.mip_map(),
                TexelWeight::Alpha => image.mip_map_by_alpha(),
            };
            assert_eq!(levels(&first[0]), expected);
            for same in [&first[1], &second[0]] {
                let pairs = levels(&first[0]).into_iter().zip(levels(same));
                assert!(pairs.clone().count() == 5 && pairs.into_iter().all(|(a, b)| Arc::ptr_eq(&a, &b)));
            }
            assert!(
                !Arc::ptr_eq(&levels(&first[0])[1], &levels(&first[2])[1]),
                "equal but separate images must not share mip maps"
            );
        }
    }

    #[test]
    fn mip_maps_are_freed_with_the_last_image() {
        let image = Arc::new(gray([8, 8], |x, _| x as f32));
        let known = SharedParts::default();
        let textures = prepare(&[&image], &known);
        let level = Arc::downgrade(&textures[0].levels(TexelWeight::Uniform)[1].image);
        drop(textures);
        known.keep([].into_iter());
        assert!(level.upgrade().is_some(), "mip maps are kept while another world may use the image");
        drop(image);
        known.keep([].into_iter());
        assert!(level.upgrade().is_none());
    }

    #[test]
    fn wide_footprints_return_the_mean_and_narrow_footprints_a_texel() {
        let image = gray([64, 64], |x, y| ((x + y) % 2) as f32);
        let texture = prepared(Arc::new(image));
        let at = [10.5 / 64.0, 20.5 / 64.0];
        assert_eq!(texture.mean(at, [Vec2::splat(1e-4); 2], TexelWeight::Uniform)[0], 0.0);
        for axes in [[Vec2::X * 0.2, Vec2::Y * 0.2], [Vec2::X * 0.4, Vec2::Y * 0.03]] {
            let found = texture.mean(at, axes, TexelWeight::Uniform)[0];
            assert!((found - 0.5).abs() < 0.01, "{found}");
        }
    }
}
