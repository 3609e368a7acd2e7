//! Texels as they are stored, and their linear values.

use serde::{Deserialize, Serialize};

use crate::color::linear_from_srgb8;

/// Storage format of a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum TexelKind {
    Srgb8,
    Linear8,
    Linear16,
    Float,
}

impl TexelKind {
    /// Bytes per texel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Srgb8 | Self::Linear8 => 4,
            Self::Linear16 => 8,
            Self::Float => 16,
        }
    }

    /// Format of the mip levels of an image in this format.
    pub fn halved(self) -> Self {
        match self {
            Self::Float => Self::Float,
            _ => Self::Linear16,
        }
    }

    /// Decodes texels from the bytes written by `ResidentTexels::write_bytes`.
    pub fn decode(self, bytes: &[u8]) -> ResidentTexels {
        let small = || bytes.as_chunks().0.to_vec();
        match self {
            Self::Srgb8 => ResidentTexels::Srgb8(small()),
            Self::Linear8 => ResidentTexels::Linear8(small()),
            Self::Linear16 => {
                let texel = |b: &[u8; 8]| [0, 2, 4, 6].map(|i| u16::from_le_bytes([b[i], b[i + 1]]));
                ResidentTexels::Linear16(bytes.as_chunks().0.iter().map(texel).collect())
            }
            Self::Float => {
                let value = |b: &[u8; 16], i| f32::from_le_bytes([b[i], b[i + 1], b[i + 2], b[i + 3]]);
                let texel = |b: &[u8; 16]| [0, 4, 8, 12].map(|i| value(b, i));
                ResidentTexels::Float(bytes.as_chunks().0.iter().map(texel).collect())
            }
        }
    }
}

/// Texels in memory, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ResidentTexels {
    Srgb8(Vec<[u8; 4]>),
    Linear8(Vec<[u8; 4]>),
    Linear16(Vec<[u16; 4]>),
    Float(Vec<[f32; 4]>),
}

impl ResidentTexels {
    /// Linear value of a texel.
    #[inline]
    pub fn linear(&self, index: usize) -> [f32; 4] {
        match self {
            Self::Srgb8(texels) => decode_srgb8(texels[index]),
            Self::Linear8(texels) => decode_linear8(texels[index]),
            Self::Linear16(texels) => decode_linear16(texels[index]),
            Self::Float(texels) => texels[index],
        }
    }
}

/// Linear values of two rows of two texels.
pub(crate) type TexelQuad = [[[f32; 4]; 2]; 2];

#[inline]
pub(crate) fn decode_srgb8([r, g, b, a]: [u8; 4]) -> [f32; 4] {
    let [r, g, b] = linear_from_srgb8([r, g, b]);
    [r, g, b, f32::from(a) / 255.0]
}

#[inline]
pub(crate) fn decode_linear8(texel: [u8; 4]) -> [f32; 4] {
    texel.map(|v| f32::from(v) / 255.0)
}

#[inline]
pub(crate) fn decode_linear16(texel: [u16; 4]) -> [f32; 4] {
    texel.map(|v| f32::from(v) / 65535.0)
}
