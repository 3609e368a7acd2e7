//! Bytes of a file, in memory or on disk. Bytes on disk are read window by window if possible.
//!
//! Accessing memory for the first time takes several times as long as reading from the file cache into memory that is
//! in use. Data that is decoded into arrays therefore need not be in memory as a whole.

use std::borrow::Cow;
use std::fs::File;
use std::io;
use std::ops::Range;

/// Bytes of a window on the stack: less than a core's first-level cache.
const WINDOW_BYTES: usize = 1 << 14;

/// Bytes in memory or on disk.
#[derive(Debug)]
pub(crate) enum ByteSource<'a> {
    Memory(Cow<'a, [u8]>),
    /// `length` bytes of a file from `start` on.
    Disk {
        file: &'a File,
        start: u64,
        length: usize,
    },
}

impl<'a> ByteSource<'a> {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Memory(bytes) => bytes.len(),
            Self::Disk { length, .. } => *length,
        }
    }

    /// Part of the bytes; the range must be inside the source.
    pub(crate) fn part(self, range: Range<usize>) -> Self {
        match self {
            Self::Memory(Cow::Borrowed(bytes)) => Self::Memory(Cow::Borrowed(&bytes[range])),
            Self::Memory(Cow::Owned(mut bytes)) => {
                bytes.truncate(range.end);
                bytes.drain(..range.start);
                Self::Memory(Cow::Owned(bytes))
            }
            Self::Disk { file, start, .. } => {
                Self::Disk { file, start: start + range.start as u64, length: range.len() }
            }
        }
    }

    /// The same bytes, without a copy.
    pub(crate) fn borrowed(&self) -> ByteSource<'_> {
        match self {
            Self::Memory(bytes) => ByteSource::Memory(Cow::Borrowed(bytes)),
            &Self::Disk { file, start, length } => ByteSource::Disk { file, start, length },
        }
    }

    /// Returns all bytes in memory; bytes on disk are read.
    pub(crate) fn read(self) -> io::Result<Cow<'a, [u8]>> {
        match self {
            Self::Memory(bytes) => Ok(bytes),
            Self::Disk { file, start, length } => {
                let mut bytes = vec![0; length];
                read_exact_at(file, &mut bytes, start)?;
                Ok(bytes.into())
            }
        }
    }

    /// Calls `each` for windows over `count` elements of `size` bytes (at most 64), `stride` bytes apart, from byte
    /// `first` on. `each` receives the index of the window's first element, and the bytes up to the end of its last
    /// element.
    pub(crate) fn for_each_window(
        &self,
        first: usize,
        count: usize,
        stride: usize,
        size: usize,
        mut each: impl FnMut(usize, &[u8]),
    ) -> io::Result<()> {
        // Without elements nothing is read, because the source may be empty.
        if count == 0 {
            return Ok(());
        }
        let span = |count: usize| (count - 1) * stride + size;
        let (file, start) = match self {
            Self::Memory(bytes) => {
                each(0, &bytes[first..first + span(count)]);
                return Ok(());
            }
            Self::Disk { file, start, .. } => (file, start + first as u64),
        };
        let mut window = [0; WINDOW_BYTES];
        let step = (WINDOW_BYTES / stride).max(1);
        for number in (0..count).step_by(step) {
            let bytes = &mut window[..span(step.min(count - number))];
            read_exact_at(file, bytes, start + (number * stride) as u64)?;
            each(number, bytes);
        }
        Ok(())
    }
}

/// True if several threads can read one file at different positions.
pub(crate) const HAS_POSITIONED_READ: bool = cfg!(unix);

/// Fills `bytes` from a file, from `start` on. If the file ends earlier, it has changed since its size was read.
#[cfg(unix)]
pub(crate) fn read_exact_at(file: &File, bytes: &mut [u8], start: u64) -> io::Result<()> {
    use std::os::unix::fs::FileExt;

    file.read_exact_at(bytes, start).map_err(|error| match error.kind() {
        io::ErrorKind::UnexpectedEof => file_changed_error(),
        _ => error,
    })
}

/// Never called, because [`HAS_POSITIONED_READ`] is false on this system; required only for compilation.
#[cfg(not(unix))]
pub(crate) fn read_exact_at(_: &File, _: &mut [u8], _: u64) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Error of a file whose length has changed.
pub(crate) fn file_changed_error() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "the file's size changed while it was read")
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;

    /// Tests the same bytes in memory and on disk. The file is named after the test, because tests run in parallel.
    fn both(name: &str, test: impl Fn(&ByteSource<'_>, &[u8])) {
        let bytes: Vec<u8> = (0..70_000_u64).map(|i| ((i * i) >> 7) as u8).collect();
        let name = format!("raycam-{name}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, [&[9; 5][..], &bytes].concat()).unwrap();
        let file = File::open(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        test(&ByteSource::Memory(Cow::Borrowed(&bytes)), &bytes);
        test(&ByteSource::Memory(Cow::Owned(bytes.clone())), &bytes);
        let (start, length) = (5, bytes.len());
        let disk = ByteSource::Disk { file: &file, start, length };
        test(&disk, &bytes);
    }

    #[test]
    fn windows_contain_every_element_once() {
        both("windows", |bytes, expected| {
            for (first, count, stride, size) in [(0, 17_500, 4, 4), (7, 5_000, 12, 12), (3, 900, 76, 12), (0, 0, 4, 4)]
            {
                let mut found = Vec::new();
                let each = |number: usize, window: &[u8]| {
                    assert_eq!(number, found.len());
                    found.extend(window.chunks(stride).map(|element| element[..size].to_vec()));
                    found.truncate(count);
                };
                bytes.for_each_window(first, count, stride, size, each).unwrap();
                let at = |i: usize| first + i * stride;
                let expected: Vec<_> = (0..count).map(|i| expected[at(i)..at(i) + size].to_vec()).collect();
                assert_eq!(found, expected);
            }
        });
    }

    #[test]
    fn reading_a_range_returns_its_bytes() {
        both("parts", |bytes, expected| {
            assert_eq!(bytes.len(), expected.len());
            let part = bytes.borrowed().part(100..30_000);
            assert_eq!(*part.borrowed().read().unwrap(), expected[100..30_000]);
            assert_eq!(*part.part(50..70).read().unwrap(), expected[150..170]);
        });
    }

    #[test]
    fn reading_a_file_that_became_shorter_returns_an_error() {
        let file = File::open(std::env::current_exe().unwrap()).unwrap();
        let (start, length) = (1 << 40, 8);
        let disk = ByteSource::Disk { file: &file, start, length };
        let error = disk.for_each_window(0, 2, 4, 4, |_, _| ());
        assert!(error.unwrap_err().to_string().contains("size changed"));
        assert!(disk.read().is_err());
    }
}
