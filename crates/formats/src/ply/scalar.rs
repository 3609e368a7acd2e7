//! Number types of PLY files.

/// Number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ScalarType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl ScalarType {
    pub(crate) fn parse(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"int64" => Self::I64,
            b"uint64" => Self::U64,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Reads a number from the first bytes of a slice; 0 if the slice is too short.
    #[inline]
    pub(crate) fn number(self, bytes: &[u8], big_endian: bool) -> f64 {
        #[inline]
        fn first<const N: usize>(bytes: &[u8], big_endian: bool) -> [u8; N] {
            let mut first = bytes.first_chunk().copied().unwrap_or([0; N]);
            if big_endian {
                first.reverse();
            }
            first
        }
        match self {
            Self::I8 => i8::from_le_bytes(first(bytes, big_endian)).into(),
            Self::U8 => u8::from_le_bytes(first(bytes, big_endian)).into(),
            Self::I16 => i16::from_le_bytes(first(bytes, big_endian)).into(),
            Self::U16 => u16::from_le_bytes(first(bytes, big_endian)).into(),
            Self::I32 => i32::from_le_bytes(first(bytes, big_endian)).into(),
            Self::U32 => u32::from_le_bytes(first(bytes, big_endian)).into(),
            // Whole numbers up to 2^53 are exact.
            Self::I64 => i64::from_le_bytes(first(bytes, big_endian)) as f64,
            Self::U64 => u64::from_le_bytes(first(bytes, big_endian)) as f64,
            Self::F32 => f32::from_le_bytes(first(bytes, big_endian)).into(),
            Self::F64 => f64::from_le_bytes(first(bytes, big_endian)),
        }
    }

    pub(crate) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}
