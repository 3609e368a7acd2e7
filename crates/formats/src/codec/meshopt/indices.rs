//! Modes 1 and 2: indices predicted from previous triangles or indices.

use crate::codec::meshopt::stream::Stream;

/// The last sixteen edges or vertices (the specification's edge FIFO and vertex FIFO).
struct RecentRing<T> {
    entries: [Option<T>; 16],
    next: usize,
}

impl<T: Copy> RecentRing<T> {
    fn new() -> Self {
        Self { entries: [None; 16], next: 0 }
    }

    fn push(&mut self, entry: T) {
        self.entries[self.next] = Some(entry);
        self.next = (self.next + 1) % 16;
    }

    /// Entry that was pushed `age` pushes before the newest entry.
    fn get(&self, age: u8) -> Result<T, String> {
        let entry = self.entries[(self.next + 15 - usize::from(age & 15)) % 16];
        entry.ok_or_else(|| "an index refers to a vertex or edge before the first one".into())
    }
}

/// State of decoding triangles.
struct Triangles<'a> {
    data: Stream<'a>,
    /// Next vertex that no triangle has used.
    next: u32,
    /// Last vertex that was encoded as a difference.
    last: u32,
    edges: RecentRing<[u32; 2]>,
    vertices: RecentRing<u32>,
}

/// Codes of the second and third vertex of a triangle without a known edge: the next new vertex, and a vertex
/// that is stored as a difference. Any other code is 1 plus the vertex's age in the vertex FIFO.
const NEXT_VERTEX: u8 = 0;
const EXPLICIT: u8 = 15;

/// Decodes the indices of `count` triangles, of `stride` bytes each.
pub(super) fn triangles(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let (header, mut stream, table) = Stream::open(bytes, |_| 16)?;
    if header != 0xe1 {
        return Err(format!("header {header:#04x}; expected 0xe1"));
    }
    if table[14..] != [0; 2] || table.iter().any(|b| b >> 4 == 15 || b & 15 == 15) {
        return Err("invalid code table at the end of the meshopt stream".into());
    }
    let codes = stream.read_bytes(count)?;
    let mut state = Triangles { data: stream, next: 0, last: 0, edges: RecentRing::new(), vertices: RecentRing::new() };
    let mut out = Vec::with_capacity(3 * count * stride);
    for &code in codes {
        for index in state.triangle(code, table)? {
            out.extend(&index.to_le_bytes()[..stride]);
        }
    }
    state.data.finish()?;
    Ok(out)
}

impl Triangles<'_> {
    fn triangle(&mut self, code: u8, table: &[u8]) -> Result<[u32; 3], String> {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            let [a, b] = self.edges.get(high)?;
            let c = match low {
                0 => self.fresh(),
                1..13 => self.vertices.get(low)?,
                13 => self.beside(1_u32.wrapping_neg()),
                14 => self.beside(1),
                _ => self.explicit()?,
            };
            if !(1..13).contains(&low) {
                self.vertices.push(c);
            }
            self.edges.push([c, b]);
            self.edges.push([a, c]);
            return Ok([a, b, c]);
        }
        let pair = match low {
            0..14 => table[usize::from(low)],
            _ => self.data.byte()?,
        };
        if low >= 14 && pair == 0 {
            self.next = 0;
        }
        let (second, third) = (pair >> 4, pair & 15);
        let a = if low == 15 { self.explicit()? } else { self.fresh() };
        let b = self.free(second)?;
        let c = self.free(third)?;
        self.vertices.push(a);
        for (how, vertex) in [(second, b), (third, c)] {
            if matches!(how, NEXT_VERTEX | EXPLICIT) {
                self.vertices.push(vertex);
            }
        }
        for edge in [[b, a], [c, b], [a, c]] {
            self.edges.push(edge);
        }
        Ok([a, b, c])
    }

    fn free(&mut self, how: u8) -> Result<u32, String> {
        match how {
            NEXT_VERTEX => Ok(self.fresh()),
            EXPLICIT => self.explicit(),
            age => self.vertices.get(age - 1),
        }
    }

    fn fresh(&mut self) -> u32 {
        let index = self.next;
        self.next = index.wrapping_add(1);
        index
    }

    fn beside(&mut self, step: u32) -> u32 {
        self.last = self.last.wrapping_add(step);
        self.last
    }

    fn explicit(&mut self) -> Result<u32, String> {
        let value = self.data.varint()?;
        Ok(self.beside(value >> 1 ^ (value & 1).wrapping_neg()))
    }
}

/// Decodes `count` indices of `stride` bytes each, as differences from one of two previous indices.
pub(super) fn sequence(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let (header, mut stream, _padding) = Stream::open(bytes, |_| 4)?;
    if header != 0xd1 {
        return Err(format!("header {header:#04x}; expected 0xd1"));
    }
    let mut last = [0_u32; 2];
    let mut out = Vec::with_capacity(count * stride);
    for _ in 0..count {
        let value = stream.varint()?;
        let last = &mut last[(value & 1) as usize];
        *last = last.wrapping_add(value >> 2 ^ (value >> 1 & 1).wrapping_neg());
        out.extend(&last.to_le_bytes()[..stride]);
    }
    stream.finish()?;
    Ok(out)
}
