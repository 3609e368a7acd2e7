//! Elements of accessors, out of their bytes into numbers.

use std::borrow::Cow;

use super::Document;
use super::ledger::Ledger;
use crate::codec::draco;
use crate::error::FormatError;

/// The type of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    pub(super) fn from_code(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    /// That of a Draco stream, unless glTF cannot have it.
    pub(super) fn from_draco(component: draco::Component) -> Option<Self> {
        Some(match component {
            draco::Component::I8 => Self::I8,
            draco::Component::U8 => Self::U8,
            draco::Component::I16 => Self::I16,
            draco::Component::U16 => Self::U16,
            draco::Component::U32 => Self::U32,
            draco::Component::F32 => Self::F32,
            draco::Component::I32 => return None,
        })
    }

    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// The elements of an accessor.
pub(super) struct Elements<'a> {
    /// As errors name it: `accessors[3]`.
    pub(super) place: String,
    pub(super) component: Component,
    pub(super) arity: usize,
    pub(super) normalized: bool,
    pub(super) count: usize,
    pub(super) stride: usize,
    /// At least `(count - 1) * stride` and one element.
    pub(super) bytes: Cow<'a, [u8]>,
}

impl Elements<'_> {
    /// Only the elements from `first` on, `count` of them.
    pub(super) fn window(self, first: usize, count: usize) -> Self {
        if first == 0 && count == self.count {
            return self;
        }
        let start = (first * self.stride).min(self.bytes.len());
        let bytes = match self.bytes {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[start..]),
            Cow::Owned(mut bytes) => {
                bytes.drain(..start);
                Cow::Owned(bytes)
            }
        };
        Self {
            bytes,
            count,
            ..self
        }
    }

    /// All elements as floats, integers divided by their largest where they are normalised.
    pub(super) fn floats<const N: usize>(
        &self,
        document: &Document<'_>,
        ledger: &mut Ledger,
    ) -> Result<Vec<[f32; N]>, FormatError> {
        self.made_of_floats(document, ledger, |values| values)
    }

    /// What `make` makes of the floats of every element.
    pub(super) fn made_of_floats<const N: usize, T>(
        &self,
        document: &Document<'_>,
        ledger: &mut Ledger,
        make: impl Fn([f32; N]) -> T,
    ) -> Result<Vec<T>, FormatError> {
        if self.arity != N {
            return Err(document.fault(format!(
                "{}.type: {} components, expected {N} (ACCESSOR_INVALID_FORMAT)",
                self.place, self.arity
            )));
        }
        ledger.take(document.path, &self.place, self.count as u64, 4 * N as u64)?;
        let unit = self.normalized;
        Ok(match self.component {
            Component::F32 => {
                let number = f32::from_le_bytes;
                // Without a way out of the loop, which is some times as fast.
                let all_finite = self.fold(true, |all, v| all & number(v).is_finite());
                if !all_finite {
                    return Err(self.not_finite::<N>(document));
                }
                self.decode::<4, N, _, _>(number, make)
            }
            Component::I8 if unit => {
                self.decode::<1, N, _, _>(|[v]| (f32::from(v as i8) / 127.0).max(-1.0), make)
            }
            Component::I8 => self.decode::<1, N, _, _>(|[v]| f32::from(v as i8), make),
            Component::U8 if unit => self.decode::<1, N, _, _>(|[v]| f32::from(v) / 255.0, make),
            Component::U8 => self.decode::<1, N, _, _>(|[v]| f32::from(v), make),
            Component::I16 if unit => self.decode::<2, N, _, _>(
                |v| (f32::from(i16::from_le_bytes(v)) / 32767.0).max(-1.0),
                make,
            ),
            Component::I16 => self.decode::<2, N, _, _>(|v| f32::from(i16::from_le_bytes(v)), make),
            Component::U16 if unit => {
                self.decode::<2, N, _, _>(|v| f32::from(u16::from_le_bytes(v)) / 65535.0, make)
            }
            Component::U16 => self.decode::<2, N, _, _>(|v| f32::from(u16::from_le_bytes(v)), make),
            Component::U32 => {
                return Err(document.fault(format!(
                    "{}.componentType: 5125 is for indices only (ACCESSOR_INVALID_FORMAT)",
                    self.place
                )));
            }
        })
    }

    /// The error of the first element that is not finite.
    fn not_finite<const N: usize>(&self, document: &Document<'_>) -> FormatError {
        let values = self.decode::<4, N, _, _>(f32::from_le_bytes, |values| values);
        let finite = |value: &[f32; N]| value.iter().all(|v| v.is_finite());
        let i = values.iter().position(|value| !finite(value)).unwrap_or(0);
        document.fault(format!(
            "{}: element {i} is {:?}: expected finite numbers (ACCESSOR_INVALID_FLOAT)",
            self.place, values[i]
        ))
    }

    /// Over every number of every element, as bytes.
    fn fold<const S: usize, A>(&self, start: A, each: impl Fn(A, [u8; S]) -> A) -> A {
        let size = S * self.arity;
        let run = |all, bytes: &[u8]| {
            let (numbers, _) = bytes.as_chunks::<S>();
            numbers.iter().fold(all, |all, &number| each(all, number))
        };
        if self.stride == size {
            return run(start, &self.bytes[..self.count * size]);
        }
        (0..self.count).fold(start, |all, i| {
            run(all, &self.bytes[i * self.stride..i * self.stride + size])
        })
    }

    /// What `make` makes of every element, whose numbers `read` reads.
    fn decode<const S: usize, const N: usize, V, T>(
        &self,
        read: impl Fn([u8; S]) -> V,
        make: impl Fn([V; N]) -> T,
    ) -> Vec<T> {
        let size = S * N;
        let element = |bytes: &[u8]| {
            let (numbers, _) = bytes.as_chunks::<S>();
            make(std::array::from_fn(|i| read(numbers[i])))
        };
        if self.stride == size {
            return self.bytes[..self.count * size]
                .chunks_exact(size)
                .map(element)
                .collect();
        }
        (0..self.count)
            .map(|i| element(&self.bytes[i * self.stride..i * self.stride + size]))
            .collect()
    }

    /// All elements as unsigned integers.
    pub(super) fn integers<const N: usize>(
        &self,
        document: &Document<'_>,
        ledger: &mut Ledger,
    ) -> Result<Vec<[u32; N]>, FormatError> {
        let unsigned = matches!(
            self.component,
            Component::U8 | Component::U16 | Component::U32
        );
        if self.arity != N || !unsigned || self.normalized {
            return Err(document.fault(format!(
                "{}: {} components of type {:?}, expected {N} unsigned integers (ACCESSOR_INVALID_FORMAT)",
                self.place, self.arity, self.component
            )));
        }
        ledger.take(document.path, &self.place, self.count as u64, 4 * N as u64)?;
        Ok(match self.component {
            Component::U8 => self.decode::<1, N, _, _>(|[v]| u32::from(v), |v| v),
            Component::U16 => {
                self.decode::<2, N, _, _>(|v| u32::from(u16::from_le_bytes(v)), |v| v)
            }
            _ => self.decode::<4, N, _, _>(u32::from_le_bytes, |v| v),
        })
    }

    /// Single integers in order, `N` at a time, and how many are left over.
    pub(super) fn groups<const N: usize>(
        mut self,
        document: &Document<'_>,
        ledger: &mut Ledger,
    ) -> Result<(Vec<[u32; N]>, usize), FormatError> {
        let over = self.count % N;
        if self.arity == 1 && self.stride == self.component.size() {
            (self.arity, self.count, self.stride) = (N, self.count / N, self.stride * N);
            return Ok((self.integers(document, ledger)?, over));
        }
        let single = self.integers::<1>(document, ledger)?;
        Ok((single.as_flattened().as_chunks().0.to_vec(), over))
    }
}
