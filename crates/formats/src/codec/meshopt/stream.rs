//! Byte stream between the header and the tail of a compressed view. A stream does not contain its length: the tail is
//! located from the end, and all bytes before it must be consumed.

/// Reader of a stream: the bytes that have not been read.
pub(crate) struct Stream<'a> {
    rest: &'a [u8],
}

impl<'a> Stream<'a> {
    /// Splits the bytes of a view into the first byte, the stream and its tail. `tail` returns the tail's length, given
    /// the first byte.
    pub(crate) fn open(bytes: &'a [u8], tail: impl Fn(u8) -> usize) -> Result<(u8, Self, &'a [u8]), String> {
        let (&header, rest) = bytes.split_first().ok_or("the stream is empty")?;
        let start = rest.len().checked_sub(tail(header));
        let (rest, tail) = rest.split_at(start.ok_or("the stream ends before its tail")?);
        Ok((header, Self { rest }, tail))
    }

    pub(crate) fn read_bytes(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or("the stream is truncated")?;
        self.rest = rest;
        Ok(taken)
    }

    pub(crate) fn byte(&mut self) -> Result<u8, String> {
        let (&byte, rest) = self.rest.split_first().ok_or("the stream is truncated")?;
        self.rest = rest;
        Ok(byte)
    }

    /// Unsigned integer in one to five bytes of seven bits, the lowest first (LEB128).
    pub(crate) fn varint(&mut self) -> Result<u32, String> {
        let mut value = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err("an index has more than five bytes".into())
    }

    pub(crate) fn finish(self) -> Result<(), String> {
        match self.rest.len() {
            0 => Ok(()),
            left => Err(format!("{left} unused bytes before the tail of the stream")),
        }
    }
}
