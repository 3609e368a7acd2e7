//! Lossless WebP stream, parsed only for its length: colours are decoded only if later codes depend on them.
//!
//! Source: RFC 9649, 3.4 (header), 3.5 (transforms), 3.6 (prefix-coded data and codes).

/// Bytes that the decoder's code tables may use for a stream of any length, and additional bytes for each byte of the
/// stream.
const MIN_TABLE_BYTES: usize = 32 << 20;
const TABLE_BYTES_PER_INPUT_BYTE: usize = 16;

/// `Some` if a stream with a header is complete.
pub(super) fn check_stream(bytes: &[u8]) -> Option<()> {
    let (head, _) = bytes.split_first_chunk::<5>()?;
    let bits = u32::from_le_bytes(*head[1..].first_chunk()?) as usize;
    let size = [bits & 0x3fff, bits >> 14 & 0x3fff].map(|side| side + 1);
    LosslessValidator::new(&bytes[5..]).check_picture(size)
}

/// Maximum length of the codes that are looked up in a table, in bits.
const FAST_BITS: usize = 8;

/// Prefix code: the number of codes of each length, and their symbols in order. A single symbol takes no bits.
struct HuffmanCode {
    counts: [u16; 16],
    symbols: Vec<u16>,
    /// Length and symbol of the code that begins with the given bits; length 0 if the code is longer. The index consists
    /// of as many bits as the longest code has, but at most [`FAST_BITS`].
    lookup: Vec<(u8, u16)>,
}

/// Prefix code group of a block: the codes of green, lengths and cached colours; of red; of blue; of alpha;
/// of distances.
type CodeGroup = [HuffmanCode; 5];

/// Prefix code groups of an image, and the index of the group that each block uses.
struct CodeGroups {
    groups: Vec<CodeGroup>,
    /// Base-2 logarithm of a block's side in pixels; unused in an image with a single group.
    block_bits: u32,
    /// Index of the prefix code group for each block, row by row, and the number of blocks per row.
    chosen: Vec<u16>,
    across: usize,
}

/// State of reading a stream.
pub(super) struct LosslessValidator<'a> {
    bytes: &'a [u8],
    at: usize,
    ahead: u64,
    count: u32,
    /// Bytes that code tables may still take in the decoder.
    tables: usize,
}

fn block_count(side: usize, bits: u32) -> usize {
    side.div_ceil(1 << bits)
}

impl<'a> LosslessValidator<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, ahead: 0, count: 0, tables: MIN_TABLE_BYTES + TABLE_BYTES_PER_INPUT_BYTE * bytes.len() }
    }

    /// Reads ahead to at least 56 bits if the stream contains that many.
    fn fill(&mut self) {
        if let Some(word) = self.bytes.get(self.at..).and_then(<[u8]>::first_chunk) {
            // If only a part of the last byte fits, the next call reads this byte again.
            self.ahead |= u64::from_le_bytes(*word) << self.count;
            let bytes = (63 - self.count) / 8;
            self.at += bytes as usize;
            self.count += 8 * bytes;
            return;
        }
        while self.count < 56 {
            let Some(&byte) = self.bytes.get(self.at) else { return };
            self.at += 1;
            self.ahead |= u64::from(byte) << self.count;
            self.count += 8;
        }
    }

    fn skip(&mut self, count: u32) -> Option<()> {
        self.count = self.count.checked_sub(count)?;
        self.ahead >>= count;
        Some(())
    }

    /// Reads up to 32 bits as a number.
    fn read_bits(&mut self, count: u32) -> Option<usize> {
        if self.count < count {
            self.fill();
        }
        let bits = self.ahead & ((1 << count) - 1);
        self.skip(count)?;
        Some(bits as usize)
    }

    /// Reads an image of this size completely: its transforms, then its pixels.
    pub(super) fn check_picture(mut self, [columns, rows]: [usize; 2]) -> Option<()> {
        let mut across = columns;
        let mut seen = [false; 4];
        while self.read_bits(1)? == 1 {
            let kind = self.read_bits(2)?;
            // Each kind of transform may occur at most once.
            if std::mem::replace(&mut seen[kind], true) {
                return None;
            }
            match kind {
                0 | 1 => {
                    let bits = self.read_bits(3)? as u32 + 2;
                    self.entropy_image([block_count(across, bits), block_count(rows, bits)], None)?;
                }
                2 => {}
                _ => {
                    let colors = self.read_bits(8)? + 1;
                    self.entropy_image([colors, 1], None)?;
                    // One pixel contains as many colour indices as fit into it.
                    let bits = match colors {
                        1..=2 => 3,
                        3..=4 => 2,
                        5..=16 => 1,
                        _ => 0,
                    };
                    across = block_count(across, bits);
                }
            }
        }
        let size = [across, rows];
        let cache = self.color_cache_bits()?;
        let groups = match self.read_bits(1)? {
            0 => self.read_code_groups(1, cache, [0; 2], Vec::new())?,
            _ => {
                let bits = self.read_bits(3)? as u32 + 2;
                let count = [block_count(across, bits), block_count(rows, bits)];
                let mut colors = Vec::new();
                self.entropy_image(count, Some(&mut colors))?;
                let chosen: Vec<u16> = colors.iter().map(|color| (color >> 8) as u16).collect();
                let most = chosen.iter().max().map_or(1, |&most| usize::from(most) + 1);
                self.read_code_groups(most, cache, [bits as usize, count[0]], chosen)?
            }
        };
        self.entropy_coded_pixels(size, &groups, cache, None)
    }

    /// Reads an image that contains parameters of a larger image, such as the codes of its blocks.
    fn entropy_image(&mut self, size: [usize; 2], colors: Option<&mut Vec<u32>>) -> Option<()> {
        let cache = self.color_cache_bits()?;
        let groups = self.read_code_groups(1, cache, [0; 2], Vec::new())?;
        self.entropy_coded_pixels(size, &groups, cache, colors)
    }

    /// Number of bits of the indices of cached colours, 0 without a cache.
    fn color_cache_bits(&mut self) -> Option<u32> {
        if self.read_bits(1)? == 0 {
            return Some(0);
        }
        let bits = self.read_bits(4)? as u32;
        (1..=11).contains(&bits).then_some(bits)
    }

    fn read_code_groups(
        &mut self,
        count: usize,
        cache: u32,
        [bits, across]: [usize; 2],
        chosen: Vec<u16>,
    ) -> Option<CodeGroups> {
        let cached = if cache == 0 { 0 } else { 1 << cache };
        let mut groups = Vec::new();
        for _ in 0..count {
            groups.push([
                self.read_code(280 + cached)?,
                self.read_code(256)?,
                self.read_code(256)?,
                self.read_code(256)?,
                self.read_code(40)?,
            ]);
        }
        Some(CodeGroups { groups, block_bits: bits as u32, chosen, across })
    }

    /// Reads a prefix code for an alphabet of this number of symbols.
    fn read_code(&mut self, symbols: usize) -> Option<HuffmanCode> {
        if self.read_bits(1)? == 1 {
            let two = self.read_bits(1)? == 1;
            let wide = self.read_bits(1)? as u32;
            let mut found = vec![self.read_bits(1 + 7 * wide)?];
            if two {
                found.push(self.read_bits(8)?);
            }
            found.iter().all(|&symbol| symbol < symbols).then_some(())?;
            let mut counts = [0; 16];
            counts[1] = found.len() as u16;
            return Some(HuffmanCode::of_symbols(counts, found.iter().map(|&symbol| symbol as u16).collect()));
        }
        const ORDER: [usize; 19] = [17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
        let mut lengths = [0; 19];
        for &place in &ORDER[..4 + self.read_bits(4)?] {
            lengths[place] = self.read_bits(3)? as u8;
        }
        let code = HuffmanCode::new(&lengths)?;
        let mut left = symbols;
        if self.read_bits(1)? == 1 {
            let bits = 2 + 2 * self.read_bits(3)? as u32;
            left = self.read_bits(bits)? + 2;
            (left <= symbols).then_some(())?;
        }
        let mut lengths = vec![0_u8; symbols];
        let (mut at, mut last) = (0, 8);
        while at < symbols && left > 0 {
            left -= 1;
            let symbol = self.read_symbol(&code)?;
            let (length, times) = match symbol {
                16 => (last, 3 + self.read_bits(2)?),
                17 => (0, 3 + self.read_bits(3)?),
                18 => (0, 11 + self.read_bits(7)?),
                _ => (symbol as u8, 1),
            };
            if symbol < 16 && length > 0 {
                last = length;
            }
            lengths.get_mut(at..at + times)?.fill(length);
            at += times;
        }
        let code = HuffmanCode::new(&lengths)?;
        // The decoder allocates a table for each code, with at most ten bits per index.
        let longest = code.counts.iter().rposition(|&count| count > 0)?;
        self.tables = self.tables.checked_sub(4 << longest.min(10))?;
        Some(code)
    }

    fn read_symbol(&mut self, code: &HuffmanCode) -> Option<usize> {
        if let [symbol] = code.symbols[..] {
            return Some(symbol.into());
        }
        if self.count < 16 {
            self.fill();
        }
        let (length, symbol) = code.lookup[self.ahead as usize & (code.lookup.len() - 1)];
        if length > 0 {
            self.skip(length.into())?;
            return Some(symbol.into());
        }
        let (mut value, mut first, mut at) = (0, 0, 0);
        for &count in &code.counts[1..] {
            let count = usize::from(count);
            value |= self.read_bits(1)?;
            if value < first + count {
                return code.symbols.get(at + value - first).map(|&symbol| symbol.into());
            }
            at += count;
            first = (first + count) << 1;
            value <<= 1;
        }
        None
    }

    /// Value of a length or distance, from its prefix code and the additional bits.
    fn prefix_value(&mut self, symbol: usize) -> Option<usize> {
        if symbol < 4 {
            return Some(symbol + 1);
        }
        let bits = (symbol as u32 - 2) >> 1;
        Some(((2 + (symbol & 1)) << bits) + self.read_bits(bits)? + 1)
    }

    /// Reads the pixels of an image; writes their colours to `colors` if given.
    fn entropy_coded_pixels(
        &mut self,
        [columns, rows]: [usize; 2],
        groups: &CodeGroups,
        cache: u32,
        mut colors: Option<&mut Vec<u32>>,
    ) -> Option<()> {
        let total = columns * rows;
        let mut cached = vec![0_u32; if cache == 0 { 0 } else { 1 << cache }];
        let insert = |cached: &mut [u32], color: u32| {
            if cache > 0 {
                cached[(0x1e35_a7bd_u32.wrapping_mul(color) >> (32 - cache)) as usize] = color;
            }
        };
        let mut at = 0;
        let mut end = 0;
        let mut group = groups.groups.first()?;
        while at < total {
            if at >= end {
                end = total;
                if !groups.chosen.is_empty() {
                    let (x, y, bits) = (at % columns, at / columns, groups.block_bits);
                    end = y * columns + columns.min(((x >> bits) + 1) << bits);
                    let place = (y >> bits) * groups.across + (x >> bits);
                    group = groups.groups.get(usize::from(groups.chosen[place]))?;
                }
                // If every code of a block has a single symbol, the block takes no bits and is skipped, unless its
                // colours are requested.
                let flat = |code: &HuffmanCode| code.symbols.len() == 1;
                if colors.is_none() && group[..4].iter().all(flat) && group[0].symbols[0] < 256 {
                    at = end;
                    continue;
                }
            }
            let symbol = self.read_symbol(&group[0])?;
            if symbol < 256 {
                let mut color = (symbol as u32) << 8;
                for (code, shift) in group[1..4].iter().zip([16, 0, 24]) {
                    color |= (self.read_symbol(code)? as u32) << shift;
                }
                if let Some(colors) = &mut colors {
                    insert(&mut cached, color);
                    colors.push(color);
                }
                at += 1;
            } else if let Some(number) = symbol.checked_sub(280) {
                if let Some(colors) = &mut colors {
                    colors.push(*cached.get(number)?);
                }
                at += 1;
            } else {
                let length = self.prefix_value(symbol - 256)?;
                let symbol = self.read_symbol(&group[4])?;
                let distance = distance(self.prefix_value(symbol)?, columns);
                (distance <= at && length <= total - at).then_some(())?;
                if let Some(colors) = &mut colors {
                    for _ in 0..length {
                        let color = colors[colors.len() - distance];
                        insert(&mut cached, color);
                        colors.push(color);
                    }
                }
                at += length;
            }
        }
        Some(())
    }
}

impl HuffmanCode {
    /// Prefix code for symbols with these code lengths; length 0 marks a symbol without a code.
    fn new(lengths: &[u8]) -> Option<Self> {
        let mut counts = [0_u16; 16];
        for &length in lengths {
            counts[usize::from(length)] += 1;
        }
        counts[0] = 0;
        let mut symbols = Vec::new();
        for length in 1..16 {
            let of_length = (0_u16..).zip(lengths).filter(|(_, l)| **l == length);
            symbols.extend(of_length.map(|(symbol, _)| symbol));
        }
        // The codes must cover every possible bit sequence.
        let sum: u32 = (1..16).map(|length| u32::from(counts[length]) << (15 - length)).sum();
        (symbols.len() == 1 || sum == 1 << 15).then(|| Self::of_symbols(counts, symbols))
    }

    /// Prefix code with these numbers of codes by length, and their symbols in order.
    fn of_symbols(counts: [u16; 16], symbols: Vec<u16>) -> Self {
        let longest = counts.iter().rposition(|&count| count > 0).unwrap_or(0);
        let bits = longest.min(FAST_BITS);
        let mut lookup = vec![(0, 0); 1 << bits];
        let mut rest = symbols.iter();
        let mut code = 0_usize;
        for (length, &count) in counts.iter().enumerate().take(bits + 1).skip(1) {
            for &symbol in rest.by_ref().take(count.into()) {
                // The first bit of a code is the lowest bit of the stream.
                let first = code.reverse_bits() >> (usize::BITS as usize - length);
                lookup.iter_mut().skip(first).step_by(1 << length).for_each(|entry| *entry = (length as u8, symbol));
                code += 1;
            }
            code <<= 1;
        }
        Self { counts, symbols, lookup }
    }
}

/// Distance in pixels, from its code: the first codes represent the nearest pixels by column and row, other codes the
/// distance itself.
fn distance(code: usize, columns: usize) -> usize {
    let Some(&[right, up]) = DISTANCE_MAP.get(code - 1) else { return code - DISTANCE_MAP.len() };
    let pixels = isize::from(right) + isize::from(up) * columns as isize;
    pixels.max(1) as usize
}

/// For the nearest pixels in order of distance: the number of columns to the left and of rows up (RFC 9649, 3.6.2.2).
#[rustfmt::skip]
const DISTANCE_MAP: [[i8; 2]; 120] = [
    [0, 1], [1, 0], [1, 1], [-1, 1], [0, 2], [2, 0], [1, 2], [-1, 2], [2, 1], [-2, 1], [2, 2], [-2, 2],
    [0, 3], [3, 0], [1, 3], [-1, 3], [3, 1], [-3, 1], [2, 3], [-2, 3], [3, 2], [-3, 2], [0, 4], [4, 0],
    [1, 4], [-1, 4], [4, 1], [-4, 1], [3, 3], [-3, 3], [2, 4], [-2, 4], [4, 2], [-4, 2], [0, 5], [3, 4],
    [-3, 4], [4, 3], [-4, 3], [5, 0], [1, 5], [-1, 5], [5, 1], [-5, 1], [2, 5], [-2, 5], [5, 2], [-5, 2],
    [4, 4], [-4, 4], [3, 5], [-3, 5], [5, 3], [-5, 3], [0, 6], [6, 0], [1, 6], [-1, 6], [6, 1], [-6, 1],
    [2, 6], [-2, 6], [6, 2], [-6, 2], [4, 5], [-4, 5], [5, 4], [-5, 4], [3, 6], [-3, 6], [6, 3], [-6, 3],
    [0, 7], [7, 0], [1, 7], [-1, 7], [5, 5], [-5, 5], [7, 1], [-7, 1], [4, 6], [-4, 6], [6, 4], [-6, 4],
    [2, 7], [-2, 7], [7, 2], [-7, 2], [3, 7], [-3, 7], [7, 3], [-7, 3], [5, 6], [-5, 6], [6, 5], [-6, 5],
    [8, 0], [4, 7], [-4, 7], [7, 4], [-7, 4], [8, 1], [8, 2], [6, 6], [-6, 6], [8, 3], [5, 7], [-5, 7],
    [7, 5], [-7, 5], [8, 4], [6, 7], [-6, 7], [7, 6], [-7, 6], [8, 5], [7, 7], [-7, 7], [8, 6], [8, 7],
];
