//! Rows of a binary PLY table without lists: because all rows have the same length, several threads read them at a
//! time.

use crate::io::{ByteSource, parallel};
use crate::ply::body::Body;
use crate::ply::columns::{Columns, PropertyRole};
use crate::ply::scalar::ScalarType;

/// Rows that one thread reads at a time.
pub(crate) const BLOCK_ROWS: usize = 1 << 15;

/// Rows of an element in a binary file, all of the same length.
pub(crate) struct FixedTable<'a> {
    bytes: ByteSource<'a>,
    stride: usize,
    big_endian: bool,
    places: Vec<(PropertyRole, ScalarType, usize)>,
}

impl<'a> FixedTable<'a> {
    /// Rows of `stride` bytes; `places` contains the role, type and byte offset of each column.
    pub(crate) fn new(
        bytes: ByteSource<'a>,
        stride: usize,
        big_endian: bool,
        places: Vec<(PropertyRole, ScalarType, usize)>,
    ) -> Self {
        Self { bytes, stride, big_endian, places }
    }

    /// The `count` rows of the next element; `None` if they are text, have lists, or are truncated.
    pub(crate) fn peek(columns: &Columns<'_>, count: usize, body: &'a Body<'_>) -> Option<Self> {
        let stride = columns.stride()?;
        let (bytes, big_endian) = body.peek(count.checked_mul(stride)?)?;
        Some(Self::new(bytes, stride, big_endian, columns.column_offsets()))
    }

    /// Size of the rows in bytes.
    pub(crate) fn length(&self) -> usize {
        self.bytes.len()
    }

    /// Results of `make` for these columns of each row; `None` if a column is missing, or if `make` returns `None` for
    /// any row.
    pub(crate) fn read<const N: usize, T, const M: usize>(
        &self,
        columns: [PropertyRole; N],
        make: impl Fn([f64; N]) -> Option<[T; M]> + Sync,
    ) -> Option<Vec<[T; M]>>
    where
        T: Copy + Default + Send,
    {
        // If several columns have the role, the last column is used.
        let place = |role| self.places.iter().rev().find(|(m, ..)| *m == role);
        let mut places = [(ScalarType::F64, 0); N];
        for (to, role) in places.iter_mut().zip(columns) {
            let &(_, kind, at) = place(role)?;
            *to = (kind, at);
        }
        let little = |kind| !self.big_endian && places.iter().all(|&(k, _)| k == kind);
        if little(ScalarType::F32) {
            return self.rows(|row| {
                make(places.map(|(_, at)| {
                    row.get(at..).and_then(<[u8]>::first_chunk).map_or(0.0, |&four| f32::from_le_bytes(four).into())
                }))
            });
        }
        self.rows(|row| make(places.map(|(kind, at)| kind.number(&row[at..], self.big_endian))))
    }

    fn rows<T: Copy + Default + Send, const M: usize>(
        &self,
        make: impl Fn(&[u8]) -> Option<[T; M]> + Sync,
    ) -> Option<Vec<[T; M]>> {
        let mut made = vec![[T::default(); M]; self.bytes.len() / self.stride];
        let block = |first: usize, block: &mut [[T; M]]| {
            let (start, count) = (first * self.stride, block.len());
            let mut all = true;
            let window = |number: usize, bytes: &[u8]| {
                let rows = bytes.chunks_exact(self.stride);
                for (to, row) in block[number..].iter_mut().zip(rows) {
                    match make(row) {
                        Some(made) => *to = made,
                        None => {
                            all = false;
                            return;
                        }
                    }
                }
            };
            // A failed read is reported when the rows are read one by one.
            let read = (self.bytes).for_each_window(start, count, self.stride, self.stride, window);
            if all && read.is_ok() { Ok(()) } else { Err(()) }
        };
        parallel::fill_blocks(&mut made, BLOCK_ROWS, block).ok()?;
        Some(made)
    }
}
