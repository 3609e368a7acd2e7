//! Numbers, and arrays of them.

use serde::de::{Error, Visitor};

use crate::schema::deserialize::error::DeError;
use crate::schema::deserialize::value::Numbers;

/// A number to read.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    Integer(i64),
    Float(f64),
}

impl Number {
    pub fn visit<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        match self {
            Self::Integer(v) => visitor.visit_i64(v),
            Self::Float(v) => visitor.visit_f64(v),
        }
    }

    /// A whole float as a whole number: NumPy and TOML writers do not always know the difference.
    #[inline]
    pub fn rounded(self) -> Self {
        match self {
            Self::Float(v) if v == v.trunc() && v.abs() < 9.0e15 => Self::Integer(v as i64),
            _ => self,
        }
    }
}

/// An array of numbers to read, or a part of one, as lists of lists.
#[derive(Clone, Copy)]
pub struct ArrayView<'a> {
    /// Length along each axis; of none where it is a number.
    pub shape: &'a [usize],
    numbers: &'a Numbers,
    /// The number that it begins with.
    start: usize,
}

impl<'a> ArrayView<'a> {
    /// The whole of an array, which has as many numbers as its shape tells.
    pub fn new(shape: &'a [usize], numbers: &'a Numbers) -> Result<Self, DeError> {
        let size = shape.iter().try_fold(1_usize, |size, &length| size.checked_mul(length));
        let count = match numbers {
            Numbers::Integers(data) => data.len(),
            Numbers::Floats(data) => data.len(),
        };
        if size != Some(count) {
            return Err(DeError::custom(format_args!("an array of shape {shape:?} with {count} numbers")));
        }
        Ok(Self { shape, numbers, start: 0 })
    }

    /// Item `i` along the first of its dimensions.
    #[inline]
    pub fn item(&self, i: usize) -> Self {
        let shape = &self.shape[1..];
        Self { shape, start: self.start + i * shape.iter().product::<usize>(), ..*self }
    }

    /// The number of an array without dimensions.
    #[inline]
    pub fn number(&self) -> Number {
        match self.numbers {
            Numbers::Integers(data) => Number::Integer(data[self.start]),
            Numbers::Floats(data) => Number::Float(data[self.start]),
        }
    }
}
