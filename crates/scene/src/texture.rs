//! Textures: images, and how surfaces look them up.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::color::linear_from_srgb8;
use crate::error::SceneError;

/// What a texture does beyond 0..1.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Wrap {
    /// Starts again.
    #[default]
    Repeat,
    /// Keeps its border.
    Clamp,
    /// Turns back.
    Mirror,
}

/// What lies between texels.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "TextureFilter")]
pub enum Interpolation {
    /// The nearest texel.
    Nearest,
    /// Between the four nearest.
    #[default]
    Linear,
}

/// How an image is looked up, as glTF's samplers say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, Deserialize)]
pub struct TextureSampler {
    /// Wrap modes of u and v.
    pub wrap: [Wrap; 2],
    /// Where a texel covers more than a pixel.
    pub magnification: Interpolation,
    /// Where a pixel covers more than a texel.
    pub minification: Interpolation,
    /// Between the levels of a mip map; `None` uses the image alone.
    pub mip: Option<Interpolation>,
}

impl Default for TextureSampler {
    /// Repeated, linear, with mip maps.
    fn default() -> Self {
        Self {
            wrap: [Wrap::Repeat; 2],
            magnification: Interpolation::Linear,
            minification: Interpolation::Linear,
            mip: Some(Interpolation::Linear),
        }
    }
}

/// The texels of an image, row-major, row 0 at the top: red, green, blue and alpha. Alpha is always linear.
#[derive(Clone, Debug, PartialEq, serde::Serialize, Deserialize)]
pub enum Texels {
    /// Colours in sRGB.
    Srgb8(Vec<[u8; 4]>),
    /// Linear values, 255 stands for 1.
    Linear8(Vec<[u8; 4]>),
    /// Linear values, 65535 stands for 1.
    Linear16(Vec<[u16; 4]>),
    /// Linear values of any size: high dynamic range.
    Float(Vec<[f32; 4]>),
}

impl Texels {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Srgb8(texels) | Self::Linear8(texels) => texels.len(),
            Self::Linear16(texels) => texels.len(),
            Self::Float(texels) => texels.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The linear value of one.
    pub fn linear(&self, index: usize) -> [f32; 4] {
        match self {
            Self::Srgb8(texels) => {
                let [r, g, b, a] = texels[index];
                let [r, g, b] = linear_from_srgb8([r, g, b]);
                [r, g, b, f32::from(a) / 255.0]
            }
            Self::Linear8(texels) => texels[index].map(|v| f32::from(v) / 255.0),
            Self::Linear16(texels) => texels[index].map(|v| f32::from(v) / 65535.0),
            Self::Float(texels) => texels[index],
        }
    }
}

/// An image.
#[derive(Clone, Debug, PartialEq, serde::Serialize, Deserialize)]
pub struct Image {
    /// The file it came from, or empty.
    #[serde(serialize_with = "last_part")]
    pub name: String,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Row-major, row 0 at the top.
    pub texels: Texels,
}

/// A file without its folder: the same image is the same data wherever it was read from.
fn last_part<S: serde::Serializer>(name: &str, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(name.rsplit(['/', '\\']).next().unwrap_or(name))
}

/// An image and how it is looked up. Several textures may share an image.
#[derive(Clone, Debug, PartialEq, serde::Serialize, Deserialize)]
pub struct Texture {
    /// The image.
    pub image: Arc<Image>,
    /// How it is looked up.
    pub sampler: TextureSampler,
}

/// Textures as serde's data, an image that several of them share only once.
pub(crate) mod sharing_images {
    use std::collections::HashMap;
    use std::sync::Arc;

    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{Image, Texture, TextureSampler};

    #[derive(Serialize)]
    struct Shown<'a> {
        images: Vec<&'a Image>,
        textures: Vec<(usize, TextureSampler)>,
    }

    #[derive(Deserialize)]
    struct Found {
        images: Vec<Arc<Image>>,
        textures: Vec<(usize, TextureSampler)>,
    }

    pub(crate) fn serialize<S: Serializer>(
        textures: &[Arc<Texture>],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut images: Vec<&Image> = Vec::new();
        let mut known = HashMap::new();
        let textures = textures
            .iter()
            .map(|texture| {
                let index = *known.entry(Arc::as_ptr(&texture.image)).or_insert_with(|| {
                    images.push(&texture.image);
                    images.len() - 1
                });
                (index, texture.sampler)
            })
            .collect();
        Shown { images, textures }.serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<Arc<Texture>>, D::Error> {
        let Found { images, textures } = Found::deserialize(deserializer)?;
        let texture = |(index, sampler): (usize, TextureSampler)| match images.get(index) {
            Some(image) => Ok(Arc::new(Texture {
                image: image.clone(),
                sampler,
            })),
            None => Err(D::Error::custom(format_args!(
                "image {index} of {}",
                images.len()
            ))),
        };
        textures.into_iter().map(texture).collect()
    }
}

/// Where a material takes a value from a texture.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, Deserialize)]
pub struct TextureSlot {
    /// Index into the world's textures.
    pub texture: usize,
    /// Which texture coordinates of the mesh: 0 for [`Mesh::uvs`](crate::Mesh::uvs), others for those in
    /// [`Mesh::more_uvs`](crate::Mesh::more_uvs).
    pub uv_set: usize,
    /// What the mesh's coordinates (u, v, 1) are multiplied by, row by row, as `KHR_texture_transform` says.
    pub image_from_mesh: [[f32; 3]; 2],
}

impl TextureSlot {
    /// The texture as the mesh's first coordinates have it.
    pub fn plain(texture: usize) -> Self {
        Self {
            texture,
            uv_set: 0,
            image_from_mesh: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        }
    }

    /// The coordinates in the image of coordinates of the mesh.
    pub fn coordinates(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        self.image_from_mesh.map(|[a, b, c]| {
            (f64::from(a) * f64::from(u) + f64::from(b) * f64::from(v) + f64::from(c)) as f32
        })
    }
}

impl Texture {
    /// An opaque sRGB image.
    pub fn from_srgb8(
        name: impl Into<String>,
        size: [u32; 2],
        texels: impl IntoIterator<Item = [u8; 3]>,
        wrap: [Wrap; 2],
    ) -> Self {
        let texels = texels.into_iter().map(|[r, g, b]| [r, g, b, 255]).collect();
        Self {
            image: Arc::new(Image {
                name: name.into(),
                size,
                texels: Texels::Srgb8(texels),
            }),
            sampler: TextureSampler {
                wrap,
                ..TextureSampler::default()
            },
        }
    }

    /// Whether it has the texels that its size says.
    ///
    /// # Errors
    /// [`SceneError::World`] where it has not, has none, or has some that are not finite.
    pub fn validate(&self) -> Result<(), SceneError> {
        let Image { name, size, texels } = &*self.image;
        let [width, height] = *size;
        if texels.is_empty() || texels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(SceneError::World(format!(
                "texture {name:?} has {} texels, expected {width} x {height}, and at least one",
                texels.len()
            )));
        }
        if let Texels::Float(texels) = texels
            && let Some(i) = texels
                .iter()
                .position(|texel| texel.iter().any(|v| !v.is_finite()))
        {
            return Err(SceneError::World(format!(
                "texture {name:?} has a texel {:?} at {i}: expected finite numbers",
                texels[i]
            )));
        }
        Ok(())
    }

    /// The value at texture coordinates (u right, v down), linear, with alpha; texel centres lie at half integers, and
    /// a texel at its centre comes back exactly. Interpolation is of linear values, as `magnification` says.
    pub fn lookup(&self, uv: [f32; 2]) -> [f32; 4] {
        let Image { size, texels, .. } = &*self.image;
        let [u, v] = [0, 1].map(|axis| Axis::new(uv[axis], size[axis], self.sampler.wrap[axis]));
        let texel = |x: usize, y: usize| texels.linear(y * size[0] as usize + x);
        if self.sampler.magnification == Interpolation::Nearest {
            return texel(u.nearest(), v.nearest());
        }
        let row = |y: usize| mix(texel(u.texels[0], y), texel(u.texels[1], y), u.fraction);
        mix(row(v.texels[0]), row(v.texels[1]), v.fraction)
    }
}

/// Between which two texels a coordinate lies along one axis, and how far from the first towards the second.
struct Axis {
    texels: [usize; 2],
    fraction: f32,
}

impl Axis {
    fn new(coordinate: f32, size: u32, wrap: Wrap) -> Self {
        let length = f64::from(size);
        let position = f64::from(coordinate) * length - 0.5;
        // Float32 coordinates of a texel's centre miss it by their rounding error, which a large image magnifies to a
        // visible share of the neighbour: that close to a centre is at it.
        let rounding =
            (4.0 * f64::from(f32::EPSILON) * length * f64::from(coordinate.abs())).min(1.0 / 256.0);
        let nearest = position.round();
        let position = if (position - nearest).abs() <= rounding {
            nearest
        } else {
            position
        };
        // Beyond 2^52 there are no fractions; the cast is then exact and takes NaN to 0.
        let first = position.floor().clamp(-4.5e15, 4.5e15) as i64;
        Self {
            texels: [first, first + 1].map(|i| wrap.index(i, i64::from(size))),
            fraction: (position - position.floor()) as f32,
        }
    }

    fn nearest(&self) -> usize {
        self.texels[usize::from(self.fraction >= 0.5)]
    }
}

impl Wrap {
    /// The texel that stands at position `i` of an axis of `size` texels.
    fn index(self, i: i64, size: i64) -> usize {
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

fn mix(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    [0, 1, 2, 3].map(|i| a[i] + (b[i] - a[i]) * t)
}
