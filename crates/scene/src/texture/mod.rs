//! Textures: images, and how surfaces look them up.

pub(crate) mod cache;
mod encoded;
mod gradient;
mod image;
mod mip;
mod paging;
pub(crate) mod serde_shared;
pub(crate) mod texel;
pub(crate) mod texel_weight;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

pub use self::encoded::{ByteString, EncodedImage};
pub use self::image::{ColorUse, Image, Texels};
use crate::error::Result;
pub use crate::texture::cache::paged::PagedTexels;
pub use crate::texture::cache::{PageInStats, TextureCache};
use crate::texture::texel::TexelQuad;
pub use crate::texture::texel_weight::AlphaMean;

/// Wrap mode of texture coordinates outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The border texels continue.
    Clamp,
    /// The image repeats, mirrored every other time.
    Mirror,
}

/// Filter between texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "TextureFilter")]
pub enum TexelFilter {
    /// The nearest texel.
    Nearest,
    /// Interpolation between the four nearest texels.
    #[default]
    Linear,
}

/// Texture lookup, as in glTF samplers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, Deserialize)]
pub struct TextureSampler {
    /// Wrap modes of u and v.
    pub wrap: [Wrap; 2],
    /// The filter if a texel covers more than a pixel.
    pub magnification: TexelFilter,
    /// The filter if a pixel covers more than a texel.
    pub minification: TexelFilter,
    /// The filter between the levels of a mip map; `None` uses only the image.
    pub mip: Option<TexelFilter>,
}

impl Default for TextureSampler {
    /// Repeated, linear, with mip maps.
    fn default() -> Self {
        Self {
            wrap: [Wrap::Repeat; 2],
            magnification: TexelFilter::Linear,
            minification: TexelFilter::Linear,
            mip: Some(TexelFilter::Linear),
        }
    }
}

/// An image and its lookup options. Several textures may share an image.
#[derive(Clone, Debug, PartialEq, serde::Serialize, Deserialize)]
pub struct Texture {
    /// The image.
    pub image: Arc<Image>,
    /// Lookup options.
    pub sampler: TextureSampler,
}

/// Reference from a material to a texture.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, Deserialize)]
pub struct TextureSlot {
    /// Index into the world's textures.
    pub texture: usize,
    /// Index of the mesh's texture coordinates: 0 refers to [`Mesh::uvs`](crate::Mesh::uvs), other numbers refer to the
    /// sets in [`Mesh::more_uvs`](crate::Mesh::more_uvs).
    pub uv_set: usize,
    /// Matrix by which the mesh's coordinates (u, v, 1) are multiplied, row by row, as in `KHR_texture_transform`.
    pub image_from_mesh: [[f32; 3]; 2],
}

impl TextureSlot {
    /// Returns a slot for a texture that uses the mesh's first texture coordinates unchanged.
    pub fn plain(texture: usize) -> Self {
        Self { texture, uv_set: 0, image_from_mesh: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] }
    }

    /// Converts the mesh's coordinates to coordinates in the image.
    pub fn coordinates(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        self.image_from_mesh
            .map(|[a, b, c]| (f64::from(a) * f64::from(u) + f64::from(b) * f64::from(v) + f64::from(c)) as f32)
    }
}

impl Texture {
    /// Creates a texture from an opaque image in 8-bit sRGB.
    pub fn from_srgb8(
        name: impl Into<String>,
        size: [u32; 2],
        texels: impl IntoIterator<Item = [u8; 3]>,
        wrap: [Wrap; 2],
    ) -> Self {
        let texels = texels.into_iter().map(|[r, g, b]| [r, g, b, 255]).collect();
        Self {
            image: Arc::new(Image::new(name, size, Texels::Srgb8(texels))),
            sampler: TextureSampler { wrap, ..TextureSampler::default() },
        }
    }

    /// Checks the texture's image.
    ///
    /// # Errors
    /// The errors of [`Image::validate`].
    pub fn validate(&self) -> Result<()> {
        self.image.validate()
    }

    /// Value at texture coordinates (u right, v down), linear, with alpha. Texel centres are at half integers, and a
    /// lookup at a texel's centre returns exactly that texel. Linear values are interpolated with the filter
    /// `magnification`.
    pub fn lookup(&self, uv: [f32; 2]) -> [f32; 4] {
        match self.fetch(uv) {
            Fetched::Texel(texel) => texel,
            Fetched::Quad(quad, fractions) => mix_quad(&quad, fractions),
        }
    }

    /// [`Texture::lookup`] for a texture whose alpha is the opacity: colours are averaged in proportion to their alpha,
    /// so that the arbitrary colour of transparent texels is not visible at their edges (T. Porter and T. Duff,
    /// "Compositing Digital Images", SIGGRAPH 1984). The returned colour is not multiplied by alpha.
    pub fn lookup_by_alpha(&self, uv: [f32; 2]) -> [f32; 4] {
        let (quad, fractions) = match self.fetch(uv) {
            Fetched::Texel(texel) => return texel,
            Fetched::Quad(quad, fractions) => (quad, fractions),
        };
        let plain = mix_quad(&quad, fractions);
        let [u, v] = fractions;
        let weights = [[(1.0 - u) * (1.0 - v), u * (1.0 - v)], [(1.0 - u) * v, u * v]];
        let texels = || quad.iter().flatten().zip(weights.iter().flatten()).filter(|(_, weight)| **weight > 0.0);
        let mut alphas = texels().map(|(texel, _)| texel[3]);
        let first = alphas.next();
        if alphas.all(|alpha| Some(alpha) == first) {
            return plain;
        }
        let mut mean = AlphaMean::default();
        texels().for_each(|(&texel, &weight)| mean.add(texel, weight));
        mean.texel()
    }

    fn fetch(&self, uv: [f32; 2]) -> Fetched {
        let Image { size, texels, .. } = &*self.image;
        let [u, v] = [0, 1].map(|axis| Axis::new(uv[axis], size[axis], self.sampler.wrap[axis]));
        let width = size[0] as usize;
        if self.sampler.magnification == TexelFilter::Nearest {
            return Fetched::Texel(texels.linear(v.nearest() * width + u.nearest()));
        }
        Fetched::Quad(texels.fetch_quad(width, u.texels, v.texels), [u.fraction, v.fraction])
    }
}

/// The texels that a lookup requires.
enum Fetched {
    Texel([f32; 4]),
    /// Four texels, row by row, and the fractions along u and v.
    Quad(TexelQuad, [f32; 2]),
}

/// The two texels on either side of a coordinate along one axis, and the fraction from the first to the second.
struct Axis {
    texels: [usize; 2],
    fraction: f32,
}

impl Axis {
    fn new(coordinate: f32, size: u32, wrap: Wrap) -> Self {
        let (first, fraction) = Self::locate(coordinate, size);
        Self { texels: [first, first + 1].map(|i| wrap.index(i, i64::from(size))), fraction: fraction as f32 }
    }

    /// The texels on both sides of a coordinate, and the reciprocal of their distance in texels. At a texel's centre,
    /// these are the texel's two neighbours.
    fn around(coordinate: f32, size: u32, wrap: Wrap) -> ([usize; 2], f32) {
        let (first, fraction) = Self::locate(coordinate, size);
        let (sides, per_texel) =
            if fraction == 0.0 { ([first - 1, first + 1], 0.5) } else { ([first, first + 1], 1.0) };
        (sides.map(|i| wrap.index(i, i64::from(size))), per_texel)
    }

    /// The texel whose centre is at or before a coordinate, and the fraction of the way to the next texel.
    #[inline(always)]
    fn locate(coordinate: f32, size: u32) -> (i64, f64) {
        let length = f64::from(size);
        let position = f64::from(coordinate) * length - 0.5;
        // Float32 coordinates of a texel's centre have rounding errors, which in a large image become a visible
        // fraction of the distance to the neighbouring texel. Positions this close to a centre therefore count as the
        // centre.
        let rounding = (4.0 * f64::from(f32::EPSILON) * length * f64::from(coordinate.abs())).min(1.0 / 256.0);
        // Beyond 2^52 there are no fractions; NaN counts as 0. Casts are used, because rounding to whole numbers may be
        // a function call.
        let position = position.clamp(-4.5e15, 4.5e15);
        let whole = position as i64;
        let mut first = whole - i64::from(position < whole as f64);
        let mut fraction = position - first as f64;
        if 1.0 - fraction <= rounding {
            (first, fraction) = (first + 1, 0.0);
        } else if fraction <= rounding || fraction.is_nan() {
            fraction = 0.0;
        }
        (first, fraction)
    }

    fn nearest(&self) -> usize {
        self.texels[usize::from(self.fraction >= 0.5)]
    }
}

impl Wrap {
    /// Index of the texel at position `i` along an axis of `size` texels; `i` may be outside the image.
    #[inline]
    fn index(self, i: i64, size: i64) -> usize {
        // In this usual case, the division is avoided, which would take longer than the rest of the function.
        if (0..size).contains(&i) {
            return i as usize;
        }
        (match self {
            Wrap::Repeat => i.rem_euclid(size),
            Wrap::Clamp => i.clamp(0, size - 1),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * size);
                i.min(2 * size - 1 - i)
            }
        }) as usize
    }
}

fn mix_quad([above, below]: &TexelQuad, [u, v]: [f32; 2]) -> [f32; 4] {
    let row = |[left, right]: &[[f32; 4]; 2]| mix(*left, *right, u);
    mix(row(above), row(below), v)
}

fn mix(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    [0, 1, 2, 3].map(|i| a[i] + (b[i] - a[i]) * t)
}
