//! Prepared textures: mip maps and anisotropic lookups over ray footprints.
//!
//! T. Akenine-Möller et al., "Improved Shader and Texture Level of Detail Using Ray Cones", JCGT 10(1), 2021. A cone
//! is as wide as the part of a pixel that a sample stands for. Its footprint on a triangle is an ellipse: the short
//! axis selects the mip level, and several lookups cover the long axis. Scattered rays use the full-resolution image,
//! which their many samples average without bias.

use std::sync::{Arc, OnceLock};

use glam::Vec2;
use raycam_scene::{TexelFilter, Texture, TextureSampler, World};

use crate::error::RenderError;
use crate::prepare::family::{BuiltPart, SharedParts};

/// Largest number of lookups along the long axis.
const MAX_ANISOTROPY: f32 = 16.0;

/// Texture, and its mip map once requested.
#[derive(Debug)]
pub(crate) struct PreparedTexture {
    texture: Arc<Texture>,
    /// Mip levels, the full image first.
    levels: OnceLock<Vec<Texture>>,
}

/// Prepares the textures of a world; `known` ones keep their mip maps. New ones are checked.
///
/// # Errors
/// [`RenderError::World`] for a texture whose texels do not fit its size or are not finite.
pub(crate) fn prepare_textures(
    world: &World,
    known: &SharedParts<PreparedTexture>,
) -> Result<Vec<Arc<PreparedTexture>>, RenderError> {
    let prepare = |texture: &Arc<Texture>| match known.built_of(texture) {
        Some(known) => Ok(known),
        None => {
            texture.validate().map_err(RenderError::world)?;
            Ok(Arc::new(PreparedTexture::new(texture.clone())))
        }
    };
    world.textures.iter().map(prepare).collect()
}

impl PreparedTexture {
    pub fn new(texture: Arc<Texture>) -> Self {
        Self { texture, levels: OnceLock::new() }
    }

    /// Value at a point.
    pub fn lookup(&self, uv: [f32; 2]) -> [f32; 4] {
        self.texture.lookup(uv)
    }

    /// Mean over a footprint around a point, given by its axes.
    pub fn mean(&self, uv: [f32; 2], axes: [Vec2; 2]) -> [f32; 4] {
        let size = Vec2::from(self.texture.image.size.map(|n| n as f32));
        let [p, q] = axes.map(|axis| (axis * size).length());
        let (long, major, minor) = if p >= q { (axes[0], p, q) } else { (axes[1], q, p) };
        // Non-finite coordinates are left to the texture's sampler.
        if self.texture.sampler.mip.is_none() || !(major > 1.0 && major.is_finite()) {
            return self.lookup(uv);
        }
        let count = (major / minor.max(1.0)).ceil().clamp(1.0, MAX_ANISOTROPY);
        let level = minor.max(major / count).max(1.0).log2();
        let mut sum = [0.0; 4];
        for i in 0..count as u32 {
            let at = Vec2::from(uv) + long * ((i as f32 + 0.5) / count - 0.5);
            let texel = self.trilinear(at.to_array(), level);
            for (sum, value) in sum.iter_mut().zip(texel) {
                *sum += value / count;
            }
        }
        sum
    }

    /// Trilinear lookup between mip levels.
    fn trilinear(&self, uv: [f32; 2], level: f32) -> [f32; 4] {
        let levels = self.levels.get_or_init(|| mip_levels(&self.texture));
        let last = levels.len() - 1;
        let first = (level as usize).min(last);
        let fine = levels[first].lookup(uv);
        let between = level - first as f32;
        if first == last || between <= 0.0 {
            return fine;
        }
        let coarse = levels[first + 1].lookup(uv);
        [0, 1, 2, 3].map(|i| fine[i] + (coarse[i] - fine[i]) * between)
    }
}

impl BuiltPart for PreparedTexture {
    type Input = Texture;

    fn input(&self) -> &Arc<Texture> {
        &self.texture
    }
}

/// Mip map with bilinear filtering.
fn mip_levels(texture: &Texture) -> Vec<Texture> {
    let sampler = TextureSampler { magnification: TexelFilter::Linear, ..texture.sampler };
    let levels = texture.image.mip_map().into_iter();
    levels.map(|image| Texture { image, sampler }).collect()
}

#[cfg(test)]
mod tests {
    use raycam_scene::{Image, Texels};

    use super::*;

    fn gray(size: [u32; 2], of: impl Fn(u32, u32) -> f32) -> Image {
        let texels = (0..size[0] * size[1]).map(|i| [of(i % size[0], i / size[0]); 4]).collect();
        Image::new("", size, Texels::Float(texels))
    }

    #[test]
    fn wide_footprints_return_the_mean_and_narrow_ones_the_texel() {
        let image = gray([64, 64], |x, y| ((x + y) % 2) as f32);
        let texture = PreparedTexture::new(Arc::new(Texture {
            image: Arc::new(image),
            sampler: TextureSampler { mip: Some(TexelFilter::Linear), ..TextureSampler::default() },
        }));
        let at = [10.5 / 64.0, 20.5 / 64.0];
        assert_eq!(texture.mean(at, [Vec2::splat(1e-4); 2])[0], 0.0);
        for axes in [[Vec2::X * 0.2, Vec2::Y * 0.2], [Vec2::X * 0.4, Vec2::Y * 0.03]] {
            let found = texture.mean(at, axes)[0];
            assert!((found - 0.5).abs() < 0.01, "{found}");
        }
    }
}
