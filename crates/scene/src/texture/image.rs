//! Images: texels, wherever they lie.

use std::borrow::Cow;
use std::ops::Range;

use serde::{Deserialize, Serialize, Serializer};

use crate::error::{Result, SceneError};
use crate::texture::cache::paged::PagedTexels;
use crate::texture::texel::{ResidentTexels, TexelKind, TexelQuad, decode_linear8, decode_linear16, decode_srgb8};

/// The texels of an image, row-major, row 0 at the top: red, green, blue and alpha. Alpha is always linear.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Texels {
    /// Colours in sRGB.
    Srgb8(Vec<[u8; 4]>),
    /// Linear values, 255 stands for 1.
    Linear8(Vec<[u8; 4]>),
    /// Linear values, 65535 stands for 1.
    Linear16(Vec<[u16; 4]>),
    /// Linear values of any size: high dynamic range.
    Float(Vec<[f32; 4]>),
    /// Any of these, in the temporary file of a [`TextureMemory`](super::TextureMemory).
    #[serde(skip)]
    Paged(PagedTexels),
}

impl From<ResidentTexels> for Texels {
    fn from(texels: ResidentTexels) -> Self {
        match texels {
            ResidentTexels::Srgb8(texels) => Self::Srgb8(texels),
            ResidentTexels::Linear8(texels) => Self::Linear8(texels),
            ResidentTexels::Linear16(texels) => Self::Linear16(texels),
            ResidentTexels::Float(texels) => Self::Float(texels),
        }
    }
}

impl Texels {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Srgb8(texels) | Self::Linear8(texels) => texels.len(),
            Self::Linear16(texels) => texels.len(),
            Self::Float(texels) => texels.len(),
            Self::Paged(texels) => texels.len(),
        }
    }

    /// True if some texel in memory is not opaque.
    pub fn has_alpha(&self) -> bool {
        match self {
            Self::Srgb8(texels) | Self::Linear8(texels) => texels.iter().any(|texel| texel[3] != u8::MAX),
            Self::Linear16(texels) => texels.iter().any(|texel| texel[3] != u16::MAX),
            Self::Float(texels) => texels.iter().any(|texel| texel[3] != 1.0),
            Self::Paged(_) => false,
        }
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The linear value of one.
    #[inline]
    pub fn linear(&self, index: usize) -> [f32; 4] {
        match self {
            Self::Srgb8(texels) => decode_srgb8(texels[index]),
            Self::Linear8(texels) => decode_linear8(texels[index]),
            Self::Linear16(texels) => decode_linear16(texels[index]),
            Self::Float(texels) => texels[index],
            Self::Paged(texels) => texels.linear(index),
        }
    }

    /// The linear values where two columns meet two rows, row by row, of an image of this width.
    #[inline]
    pub(super) fn fetch_quad(&self, width: usize, [x0, x1]: [usize; 2], rows: [usize; 2]) -> TexelQuad {
        fn fetch<T: Copy>(texels: &[T], all: [[usize; 2]; 2], linear: impl Fn(T) -> [f32; 4]) -> TexelQuad {
            all.map(|row| row.map(|index| linear(texels[index])))
        }
        let all = rows.map(|y| [y * width + x0, y * width + x1]);
        match self {
            Self::Srgb8(texels) => fetch(texels, all, decode_srgb8),
            Self::Linear8(texels) => fetch(texels, all, decode_linear8),
            Self::Linear16(texels) => fetch(texels, all, decode_linear16),
            Self::Float(texels) => fetch(texels, all, |texel| texel),
            Self::Paged(texels) => texels.fetch_quad([x0, x1], rows),
        }
    }

    /// The same texels, all in memory.
    ///
    /// # Errors
    /// [`SceneError::Storage`] where the file that they are in cannot be read.
    pub fn in_memory(&self) -> Result<Cow<'_, Texels>> {
        Ok(match self {
            Self::Paged(texels) => Cow::Owned(texels.read_all()?.into()),
            texels => Cow::Borrowed(texels),
        })
    }

    /// The same texels, all in memory, without a copy of those that are there already.
    ///
    /// # Errors
    /// The errors of [`Texels::in_memory`].
    pub(crate) fn into_memory(self) -> Result<Texels> {
        match self {
            Self::Paged(texels) => Ok(texels.read_all()?.into()),
            texels => Ok(texels),
        }
    }

    pub(super) fn kind(&self) -> TexelKind {
        match self {
            Self::Srgb8(_) => TexelKind::Srgb8,
            Self::Linear8(_) => TexelKind::Linear8,
            Self::Linear16(_) => TexelKind::Linear16,
            Self::Float(_) => TexelKind::Float,
            Self::Paged(texels) => texels.kind(),
        }
    }

    /// Appends the bytes of some, which are in memory.
    pub(super) fn write_bytes(&self, range: Range<usize>, bytes: &mut Vec<u8>) {
        match self {
            Self::Srgb8(texels) | Self::Linear8(texels) => {
                bytes.extend_from_slice(texels[range].as_flattened());
            }
            Self::Linear16(texels) => {
                let values = texels[range].as_flattened().iter();
                bytes.extend(values.flat_map(|v| v.to_le_bytes()));
            }
            Self::Float(texels) => {
                let values = texels[range].as_flattened().iter();
                bytes.extend(values.flat_map(|v| v.to_le_bytes()));
            }
            Self::Paged(_) => {}
        }
    }
}

/// An image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Image {
    /// The file it came from, or empty.
    #[serde(serialize_with = "file_name")]
    pub name: String,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Row-major, row 0 at the top.
    #[serde(serialize_with = "in_memory")]
    pub texels: Texels,
}

/// A file without its folder: the same image is the same data wherever it was read from.
fn file_name<S: Serializer>(name: &str, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(name.rsplit(['/', '\\']).next().unwrap_or(name))
}

/// The same image is the same data wherever its texels lie.
fn in_memory<S: Serializer>(texels: &Texels, serializer: S) -> Result<S::Ok, S::Error> {
    texels.in_memory().map_err(serde::ser::Error::custom)?.serialize(serializer)
}

impl Image {
    /// Checks that the number of texels matches the size.
    ///
    /// # Errors
    /// [`SceneError::World`] if it differs, the image is empty, or a texel is not finite.
    pub fn validate(&self) -> Result<()> {
        let Image { name, size, texels } = self;
        let [width, height] = *size;
        if texels.is_empty() || texels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(SceneError::world(format!(
                "texture {name:?} has {} texels, expected {width} x {height}, and at least one",
                texels.len()
            )));
        }
        if let Texels::Float(texels) = texels
            && let Some(i) = texels.iter().position(|texel| texel.iter().any(|v| !v.is_finite()))
        {
            return Err(SceneError::world(format!(
                "texture {name:?} has a texel {:?} at {i}: expected finite numbers",
                texels[i]
            )));
        }
        Ok(())
    }
}
