//! Elements of an accessor, decoded to numbers.

use raycam_scene::ErrorCode;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::codec::draco;
use crate::error::{FormatError, Result};
use crate::gltf::document::Document;
use crate::io::{ByteSource, parallel};

/// Number of elements that one thread decodes at a time.
const BLOCK_ELEMENTS: usize = 1 << 15;

/// Component type of an accessor (glTF's `componentType`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    pub(crate) fn from_code(code: u32) -> Option<Self> {
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

    /// Type of a Draco attribute; `None` for a type that glTF does not have.
    pub(crate) fn from_draco(component: draco::ComponentType) -> Option<Self> {
        Some(match component {
            draco::ComponentType::I8 => Self::I8,
            draco::ComponentType::U8 => Self::U8,
            draco::ComponentType::I16 => Self::I16,
            draco::ComponentType::U16 => Self::U16,
            draco::ComponentType::U32 => Self::U32,
            draco::ComponentType::F32 => Self::F32,
            draco::ComponentType::I32 => return None,
        })
    }

    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// Elements of an accessor.
pub(crate) struct AccessorView<'a> {
    pub(crate) document: &'a Document<'a>,
    /// Name in errors, such as `accessors[3]`.
    pub(crate) place: String,
    /// glTF-Validator's code for an accessor of the wrong type.
    pub(crate) wrong_format: &'static str,
    pub(crate) component: Component,
    pub(crate) arity: usize,
    pub(crate) normalized: bool,
    pub(crate) count: usize,
    pub(crate) stride: usize,
    /// The bytes contain at least `(count - 1) * stride` bytes plus one element.
    pub(crate) bytes: ByteSource<'a>,
}

impl AccessorView<'_> {
    /// Returns only `count` elements from `first` on.
    pub(crate) fn slice(self, first: usize, count: usize) -> Self {
        if first == 0 && count == self.count {
            return self;
        }
        let start = (first * self.stride).min(self.bytes.len());
        let end = self.bytes.len();
        Self { bytes: self.bytes.part(start..end), count, ..self }
    }

    /// All elements as floats; normalised integers are divided by their maximum.
    pub(crate) fn floats<const N: usize>(&self) -> Result<Vec<[f32; N]>> {
        self.map_floats(|values| values)
    }

    /// Applies `make` to the floats of every element, and returns the results.
    pub(crate) fn map_floats<const N: usize, T: Copy + Default + Send>(
        &self,
        make: impl Fn([f32; N]) -> [T; N] + Sync,
    ) -> Result<Vec<[T; N]>> {
        let (made, finite) = self.map_any_floats(make)?;
        if finite { Ok(made) } else { Err(self.non_finite_error::<N>()) }
    }

    /// Same as `map_floats`, but also accepts floats that are not finite; also returns true if all floats are finite.
    pub(crate) fn map_any_floats<const N: usize, T: Copy + Default + Send>(
        &self,
        make: impl Fn([f32; N]) -> [T; N] + Sync,
    ) -> Result<(Vec<[T; N]>, bool)> {
        if self.arity != N {
            return Err(self.document.fault(
                ErrorCode::WrongShape,
                format!("{}.type: {} components; expected {N} ({})", self.place, self.arity, self.wrong_format),
            ));
        }
        self.document.charge(&self.place, self.count as u64, 4 * N as u64)?;
        let unit = self.normalized;
        let made = match self.component {
            Component::F32 => {
                // The loop has no early exit, so that the compiler vectorises it.
                let finite = |bytes: &[u8]| {
                    let numbers = bytes.as_chunks::<4>().0.iter();
                    numbers.fold(true, |all, &v| all & f32::from_le_bytes(v).is_finite())
                };
                self.decode_checked::<4, N, _, _>(f32::from_le_bytes, finite, make)
            }
            Component::I8 if unit => self.decode::<1, N, _, _>(|[v]| (f32::from(v as i8) / 127.0).max(-1.0), make),
            Component::I8 => self.decode::<1, N, _, _>(|[v]| f32::from(v as i8), make),
            Component::U8 if unit => self.decode::<1, N, _, _>(|[v]| f32::from(v) / 255.0, make),
            Component::U8 => self.decode::<1, N, _, _>(|[v]| f32::from(v), make),
            Component::I16 if unit => {
                self.decode::<2, N, _, _>(|v| (f32::from(i16::from_le_bytes(v)) / 32767.0).max(-1.0), make)
            }
            Component::I16 => self.decode::<2, N, _, _>(|v| f32::from(i16::from_le_bytes(v)), make),
            Component::U16 if unit => self.decode::<2, N, _, _>(|v| f32::from(u16::from_le_bytes(v)) / 65535.0, make),
            Component::U16 => self.decode::<2, N, _, _>(|v| f32::from(u16::from_le_bytes(v)), make),
            Component::U32 => {
                let message = format!(
                    "{}.componentType: 5125 (32-bit integer) is allowed only for indices ({})",
                    self.place, self.wrong_format
                );
                return Err(self.document.fault(ErrorCode::WrongType, message));
            }
        };
        made.map_err(|error| self.document.read_error(error))
    }

    /// Error for the first element that is not finite.
    fn non_finite_error<const N: usize>(&self) -> FormatError {
        let all = self.decode::<4, N, _, _>(f32::from_le_bytes, |values| values);
        let values = match all {
            Ok((values, _)) => values,
            Err(error) => return self.document.read_error(error),
        };
        let finite = |value: &[f32; N]| value.iter().all(|v| v.is_finite());
        let i = values.iter().position(|value| !finite(value)).unwrap_or(0);
        self.document.fault(
            ErrorCode::OutOfRange,
            format!("{}: element {i} is {:?}; expected finite numbers (ACCESSOR_INVALID_FLOAT)", self.place, values[i]),
        )
    }

    /// Decodes the components of every element by `read`, applies `make` to them, and returns the results. The second
    /// value of the result is true, because all bytes are valid.
    fn decode<const S: usize, const N: usize, V, T: Copy + Default + Send>(
        &self,
        read: impl Fn([u8; S]) -> V + Sync,
        make: impl Fn([V; N]) -> [T; N] + Sync,
    ) -> io::Result<(Vec<[T; N]>, bool)> {
        self.decode_checked::<S, N, V, T>(read, |_| true, make)
    }

    /// Same as `decode`, but the second value of the result is true only if `valid` returns true for the bytes of all
    /// elements. The function runs on several threads.
    fn decode_checked<const S: usize, const N: usize, V, T: Copy + Default + Send>(
        &self,
        read: impl Fn([u8; S]) -> V + Sync,
        valid: impl Fn(&[u8]) -> bool + Sync,
        make: impl Fn([V; N]) -> [T; N] + Sync,
    ) -> io::Result<(Vec<[T; N]>, bool)> {
        let size = S * N;
        let element = |bytes: &[u8]| {
            let (numbers, _) = bytes.as_chunks::<S>();
            make(std::array::from_fn(|i| read(numbers[i])))
        };
        let mut made = vec![[T::default(); N]; self.count];
        let (bytes, stride, all_valid) = (&self.bytes, self.stride, AtomicBool::new(true));
        let block = |first: usize, block: &mut [[T; N]]| {
            let count = block.len();
            let window = |number: usize, bytes: &[u8]| {
                let block = &mut block[number..];
                let all = if stride == size {
                    let elements = bytes.chunks_exact(size);
                    block.iter_mut().zip(elements).for_each(|(to, from)| *to = element(from));
                    valid(bytes)
                } else {
                    let elements = bytes.chunks(stride);
                    block.iter_mut().zip(elements).fold(true, |all, (to, from)| {
                        *to = element(from);
                        all & valid(&from[..size])
                    })
                };
                if !all {
                    all_valid.store(false, Ordering::Relaxed);
                }
            };
            bytes.for_each_window(first * stride, count, stride, size, window)
        };
        parallel::fill_blocks(&mut made, BLOCK_ELEMENTS, block)?;
        Ok((made, all_valid.into_inner()))
    }

    /// All elements as unsigned integers.
    pub(crate) fn integers<const N: usize>(&self) -> Result<Vec<[u32; N]>> {
        self.check_unsigned(N)?;
        self.document.charge(&self.place, self.count as u64, 4 * N as u64)?;
        let made = match self.component {
            Component::U8 => self.decode::<1, N, _, _>(|[v]| u32::from(v), |v| v),
            Component::U16 => self.decode::<2, N, _, _>(|v| u32::from(u16::from_le_bytes(v)), |v| v),
            _ => self.decode::<4, N, _, _>(u32::from_le_bytes, |v| v),
        };
        let (made, _) = made.map_err(|error| self.document.read_error(error))?;
        Ok(made)
    }

    /// Rejects elements that are not `expected` unsigned integers each.
    fn check_unsigned(&self, expected: usize) -> Result<()> {
        let kind = self.component;
        let unsigned = matches!(kind, Component::U8 | Component::U16 | Component::U32);
        if self.arity == expected && unsigned && !self.normalized {
            return Ok(());
        }
        let normalized = if self.normalized { ", normalised" } else { "" };
        Err(self.document.fault(
            ErrorCode::WrongType,
            format!(
                "{}: {} components of type {kind:?}{normalized}; expected {expected} unsigned integers, not normalised \
                 ({})",
                self.place, self.arity, self.wrong_format
            ),
        ))
    }

    /// Returns single integers in groups of `N`, and the number of integers after the last complete group.
    pub(crate) fn chunks<const N: usize>(mut self) -> Result<(Vec<[u32; N]>, usize)> {
        self.check_unsigned(1)?;
        let over = self.count % N;
        if self.arity == 1 && self.stride == self.component.size() {
            (self.arity, self.count, self.stride) = (N, self.count / N, self.stride * N);
            return Ok((self.integers()?, over));
        }
        let single = self.integers::<1>()?;
        Ok((single.as_flattened().as_chunks().0.to_vec(), over))
    }
}
