//! Images: texels, in memory or in a file.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Arc, LazyLock};

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::color::linear_from_srgb;
use crate::error::{Result, SceneError};
use crate::texture::cache::paged::PagedTexels;
use crate::texture::encoded::{ByteString, EncodedImage};
use crate::texture::texel::{ResidentTexels, TexelKind, TexelQuad, decode_linear8, decode_linear16, decode_srgb8};

/// Texels of an image, row-major, row 0 at the top: red, green, blue and alpha. Alpha is always linear.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Colours in sRGB.
    Srgb8(Vec<[u8; 4]>),
    /// Linear values; 255 represents 1.
    Linear8(Vec<[u8; 4]>),
    /// Linear values; 65535 represents 1.
    Linear16(Vec<[u16; 4]>),
    /// Linear values without a limit: high dynamic range.
    Float(Vec<[f32; 4]>),
    /// Any of these formats, in the temporary file of a [`TextureCache`](super::TextureCache).
    Paged(PagedTexels),
}

/// Use of an image. It determines how integers are interpreted; float images are always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorUse {
    /// Colours, stored in sRGB.
    Color,
    /// Anything else (normals, roughness, occlusion), stored without conversion.
    Data,
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
    /// Converts 16-bit sRGB colours to linear texels.
    pub fn from_srgb16(mut texels: Vec<[u16; 4]>) -> Self {
        static LINEAR: LazyLock<Vec<u16>> = LazyLock::new(|| {
            let linear = |v: u16| (65535.0 * linear_from_srgb(f32::from(v) / 65535.0)).round();
            (0..=u16::MAX).map(|v| linear(v) as u16).collect()
        });
        let table = &*LINEAR;
        for color in texels.iter_mut().flat_map(|texel| &mut texel[..3]) {
            *color = table[usize::from(*color)];
        }
        Self::Linear16(texels)
    }

    /// Number of texels.
    pub fn len(&self) -> usize {
        match self {
            Self::Srgb8(texels) | Self::Linear8(texels) => texels.len(),
            Self::Linear16(texels) => texels.len(),
            Self::Float(texels) => texels.len(),
            Self::Paged(texels) => texels.len(),
        }
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        self.len() * self.kind().bytes()
    }

    /// True if any texel in memory is not opaque.
    pub fn has_alpha(&self) -> bool {
        match self {
            Self::Srgb8(texels) | Self::Linear8(texels) => texels.iter().any(|texel| texel[3] != u8::MAX),
            Self::Linear16(texels) => texels.iter().any(|texel| texel[3] != u16::MAX),
            Self::Float(texels) => texels.iter().any(|texel| texel[3] != 1.0),
            Self::Paged(_) => false,
        }
    }

    /// True if there are no texels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Linear value of a texel.
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

    /// Linear values of the four texels in two columns and two rows of an image with this width, row by row.
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

    /// Returns the same texels, all in memory.
    ///
    /// # Errors
    /// [`SceneError::Storage`] if their file cannot be read.
    pub fn in_memory(&self) -> Result<Cow<'_, Texels>> {
        Ok(match self {
            Self::Paged(texels) => Cow::Owned(texels.read_all()?.into()),
            texels => Cow::Borrowed(texels),
        })
    }

    /// Returns the same texels, all in memory; texels that are already in memory are not copied.
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

    /// Appends the bytes of some texels, which must be in memory.
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
#[derive(Clone, Debug, Deserialize)]
pub struct Image {
    /// Source file; empty for images without a file.
    pub name: String,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Row-major, row 0 at the top. Empty in the bytes of a world that contain `encoded` instead.
    pub texels: Texels,
    /// File that the texels were decoded from, if they are unchanged and the file is smaller.
    #[serde(default)]
    pub encoded: Option<Arc<EncodedImage>>,
}

/// Images are equal if their file names, sizes and texels are equal; `encoded` is not compared.
impl PartialEq for Image {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name && self.size == other.size && self.texels == other.texels
    }
}

/// The form of an [`Image`] in the bytes of a world: the image's file if it exists, otherwise the texels. The file's
/// name has no folder, so that equal images are equal data wherever they were read from and wherever their texels are.
#[derive(Serialize)]
struct StoredImage<'a> {
    name: &'a str,
    size: [u32; 2],
    texels: Cow<'a, Texels>,
    #[serde(skip_serializing_if = "Option::is_none")]
    encoded: Option<&'a EncodedImage>,
}

impl Serialize for Image {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let texels = match self.encoded {
            Some(_) => Cow::Owned(Texels::Srgb8(Vec::new())),
            None => self.texels.in_memory().map_err(serde::ser::Error::custom)?,
        };
        let name = self.name.rsplit(['/', '\\']).next().unwrap_or(&self.name);
        StoredImage { name, size: self.size, texels, encoded: self.encoded.as_deref() }.serialize(serializer)
    }
}

impl Serialize for Texels {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let texels = self.in_memory().map_err(serde::ser::Error::custom)?;
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(texels.bytes()).map_err(serde::ser::Error::custom)?;
        texels.write_bytes(0..texels.len(), &mut bytes);
        (texels.kind(), ByteString(bytes)).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Texels {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (kind, ByteString(bytes)) = <(TexelKind, ByteString)>::deserialize(deserializer)?;
        if bytes.len() % kind.bytes() != 0 {
            return Err(D::Error::custom(format_args!(
                "{} bytes of texels; expected a multiple of {}",
                bytes.len(),
                kind.bytes()
            )));
        }
        Ok(kind.decode(&bytes).into())
    }
}

impl Image {
    /// Creates an image of texels without a file.
    pub fn new(name: impl Into<String>, size: [u32; 2], texels: Texels) -> Self {
        Self { name: name.into(), size, texels, encoded: None }
    }

    /// Checks that the number of texels matches the size.
    ///
    /// # Errors
    /// [`SceneError::World`] if it does not, if the image is empty, or if a texel is not finite.
    pub fn validate(&self) -> Result<()> {
        let Image { name, size, texels, .. } = self;
        let [width, height] = *size;
        if texels.is_empty() {
            return Err(SceneError::world(format!("texture {name:?} is empty; expected at least one texel")));
        }
        if texels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(SceneError::world(format!(
                "texture {name:?} has {} texels; expected {width} x {height}",
                texels.len()
            )));
        }
        if let Texels::Float(texels) = texels
            && let Some(i) = texels.iter().position(|texel| texel.iter().any(|v| !v.is_finite()))
        {
            return Err(SceneError::world(format!(
                "texture {name:?} has a texel {:?} at {i}; expected finite numbers",
                texels[i]
            )));
        }
        Ok(())
    }
}
