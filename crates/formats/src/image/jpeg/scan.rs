//! Scan of a JPEG, parsed only for its length: the values of codes are skipped.
//!
//! Source: ITU-T T.81, A.2 (order of blocks), C (Huffman tables), F.2.2 and G.1.2 (codes of a block), E.2.4 (restarts).

/// Component of the image.
pub(super) struct FrameComponent {
    pub id: u8,
    /// Sampling factors H and V: the component's number of blocks, across and down, in an MCU of a scan with
    /// several components.
    factors: [usize; 2],
    /// Indices of the component's Huffman tables of DC and AC coefficients in the scan.
    pub tables: [usize; 2],
    /// For each coefficient: the lowest bit that a scan has contained; `None` if no scan has contained the coefficient.
    pub bits: [Option<u8>; 64],
    /// For each block: bit mask of the coefficients that are known not to be zero, on which refining scans depend.
    nonzero: Vec<u64>,
}

impl FrameComponent {
    pub(super) fn new(id: u8, factors: [usize; 2]) -> Self {
        Self { id, factors, tables: [0; 2], bits: [None; 64], nonzero: Vec::new() }
    }
}

/// Part of each block that a scan contains (spectral selection and successive approximation).
#[derive(Clone, Copy)]
pub(super) enum ScanKind {
    /// The whole block.
    Sequential,
    /// The first bits of the DC coefficient, or its next bit.
    Dc { high: u8, low: u8 },
    /// The first bits of the AC coefficients from `first` to `last` of a single component, or the next bit of these
    /// coefficients.
    Ac { first: u8, last: u8, high: u8, low: u8 },
}

impl ScanKind {
    /// Kind of a progressive scan with these coefficients and bits; `None` if the combination is invalid.
    pub(super) fn progressive([first, last]: [u8; 2], [high, low]: [u8; 2]) -> Option<Self> {
        let bits = low <= 13 && (high == 0 || high == low + 1);
        match (first, last) {
            (0, 0) if bits => Some(Self::Dc { high, low }),
            (1.., ..64) if bits && first <= last => Some(Self::Ac { first, last, high, low }),
            _ => None,
        }
    }

    /// True if scans of this kind have a single component.
    pub(super) fn is_single_component(self) -> bool {
        matches!(self, Self::Ac { .. })
    }
}

/// Codes of a Huffman table.
pub(super) struct HuffmanTable {
    /// For the next [`FAST_BITS`] bits: the length of the code and its value; length 0 for a longer code.
    lookup: Vec<[u8; 2]>,
    /// For each length: the first code, the first code of the next length, and the index of its values.
    lengths: [(u32, u32, usize); 17],
    values: Vec<u8>,
}

const FAST_BITS: u32 = 9;

/// If the scan has at least this number of MCUs, the last MCU may be missing: some programs omit the last bits, which
/// readers reconstruct.
const MAX_MISSING_TAIL: usize = 64;

impl HuffmanTable {
    /// Table for these counts of codes by length, from one bit on, and the values of the codes.
    pub(super) fn new(counts: &[u8; 16], values: &[u8]) -> Option<Self> {
        let mut table =
            Self { lookup: vec![[0; 2]; 1 << FAST_BITS], lengths: [(0, 0, 0); 17], values: values.to_vec() };
        let (mut code, mut at) = (0_u32, 0);
        for (length, &count) in (1_u32..).zip(counts) {
            let count = usize::from(count);
            let end = code + count as u32;
            if end > 1 << length {
                return None;
            }
            table.lengths[length as usize] = (code, end, at);
            if length <= FAST_BITS {
                let width = 1_usize << (FAST_BITS - length);
                for (place, &value) in (code as usize..).zip(&values[at..at + count]) {
                    table.lookup[place * width..][..width].fill([length as u8, value]);
                }
            }
            at += count;
            code = end << 1;
        }
        Some(table)
    }
}

/// Bits of the data between two markers.
struct BitReader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Bits that have been read but not used, from the highest on.
    ahead: u64,
    count: u32,
}

impl BitReader<'_> {
    /// Reads ahead to at least 32 bits if the data contains that many.
    fn fill(&mut self) {
        if let Some(word) = self.bytes.get(self.at..).and_then(<[u8]>::first_chunk) {
            let word = u64::from_be_bytes(*word);
            // True if no byte is 0xff, which means that no byte of the complement is 0.
            let is_plain = (!word).wrapping_sub(u64::MAX / 255) & word & (u64::MAX / 255 * 128) == 0;
            if is_plain && self.count <= 56 {
                // If only a part of the last byte fits, the next call reads this byte again.
                self.ahead |= word >> self.count;
                let bytes = (64 - self.count) / 8;
                self.at += bytes as usize;
                self.count += 8 * bytes;
                return;
            }
        }
        while self.count <= 56 {
            let Some(&byte) = self.bytes.get(self.at) else { return };
            // A data byte 0xff is followed by 0; 0xff before any other byte is a marker.
            if byte == 0xff {
                if self.bytes.get(self.at + 1) != Some(&0) {
                    return;
                }
                self.at += 1;
            }
            self.at += 1;
            self.ahead |= u64::from(byte) << (56 - self.count);
            self.count += 8;
        }
    }

    fn skip(&mut self, count: u32) -> Option<()> {
        if self.count < count {
            self.fill();
        }
        self.count = self.count.checked_sub(count)?;
        self.ahead <<= count;
        Some(())
    }

    /// Reads up to 16 bits as a number.
    fn read_bits(&mut self, count: u32) -> Option<u32> {
        if count == 0 {
            return Some(0);
        }
        if self.count < count {
            self.fill();
        }
        let bits = (self.ahead >> (64 - count)) as u32;
        self.skip(count)?;
        Some(bits)
    }

    fn read_code(&mut self, table: &HuffmanTable) -> Option<u8> {
        self.read_code_and_skip(table, |_| 0)
    }

    /// Reads a code and skips further bits after it. `extra` returns the number of these bits, at most 16, for the code's
    /// value.
    #[inline(always)]
    fn read_code_and_skip(&mut self, table: &HuffmanTable, extra: impl Fn(u8) -> u8) -> Option<u8> {
        if self.count < 32 {
            self.fill();
        }
        let [length, value] = table.lookup[(self.ahead >> (64 - FAST_BITS)) as usize];
        if length > 0 {
            self.skip((length + extra(value)).into())?;
            return Some(value);
        }
        for length in FAST_BITS + 1..=16 {
            let code = (self.ahead >> (64 - length)) as u32;
            let (first, end, at) = table.lengths[length as usize];
            if (first..end).contains(&code) {
                let value = *table.values.get(at + (code - first) as usize)?;
                self.skip(length + u32::from(extra(value)))?;
                return Some(value);
            }
        }
        None
    }

    /// Moves to the marker after the data; remaining bits are skipped.
    fn marker_after(&mut self) -> Option<u8> {
        (self.ahead, self.count) = (0, 0);
        let rest = self.bytes.get(self.at..)?;
        let is_marker = |pair: &[u8]| pair[0] == 0xff && !matches!(pair[1], 0 | 0xff);
        self.at += rest.windows(2).position(is_marker)?;
        Some(self.bytes[self.at + 1])
    }
}

/// Scan of an image.
pub(super) struct Scan<'a> {
    /// Columns and rows of the image.
    pub size: [usize; 2],
    pub kind: ScanKind,
    /// Restart interval: number of MCUs between restart markers, 0 without restart markers.
    pub interval: usize,
    pub tables: &'a [[Option<HuffmanTable>; 4]; 2],
}

impl Scan<'_> {
    /// Returns the number of bytes in the scan, and true if its last MCU is present. An error is text that follows
    /// "scan 1" in a message.
    pub(super) fn read(
        &self,
        components: &mut [FrameComponent],
        chosen: &[usize],
        data: &[u8],
    ) -> Result<(usize, bool), String> {
        let largest = |axis| components.iter().map(|c: &FrameComponent| c.factors[axis]).max();
        let largest = [0, 1].map(|axis| largest(axis).unwrap_or(1));
        // The MCU of a scan with a single component is one block; the MCU of any other scan contains blocks of several
        // components.
        let blocks =
            |factor: [usize; 2]| [0, 1].map(|axis| (self.size[axis] * factor[axis]).div_ceil(8 * largest[axis]));
        let units = match chosen {
            [one] => blocks(components[*one].factors),
            _ => blocks([1, 1]),
        };
        let total = units[0] * units[1];
        for &place in chosen {
            self.note(&mut components[place], total)?;
        }
        let mut bits = BitReader { bytes: data, at: 0, ahead: 0, count: 0 };
        let (mut unit, mut complete) = (0, true);
        while unit < total {
            if unit > 0 {
                if !matches!(bits.marker_after(), Some(0xd0..=0xd7)) {
                    return Err(self.stop_message(unit, units));
                }
                bits.at += 2;
            }
            let end = match self.interval {
                0 => total,
                interval => total.min(unit + interval),
            };
            let mut run = 0;
            while unit < end {
                let read = match self.kind {
                    // Blocks in an end-of-band run have no data in this scan, and are skipped together.
                    ScanKind::Ac { high: 0, .. } if run > 0 => {
                        let passed = (end - unit).min(run as usize);
                        run -= passed as u32;
                        unit += passed;
                        continue;
                    }
                    ScanKind::Ac { .. } => self.ac(&mut components[chosen[0]], unit, &mut run, &mut bits),
                    _ => self.unit(components, chosen, &mut bits),
                };
                complete = read.is_some();
                if !complete && (unit + 1 < total || total < MAX_MISSING_TAIL) {
                    return Err(self.stop_message(unit, units));
                }
                unit += 1;
            }
        }
        bits.marker_after().ok_or("is not followed by a marker")?;
        Ok((bits.at, complete))
    }

    /// Message about a scan that stops at an MCU, with the row of pixels.
    fn stop_message(&self, unit: usize, units: [usize; 2]) -> String {
        let row = unit / units[0] * self.size[1] / units[1];
        format!("stops at row {row} of {}", self.size[1])
    }

    /// Records the coefficient bits that the scan contains for a component with this number of blocks.
    fn note(&self, component: &mut FrameComponent, blocks: usize) -> Result<(), String> {
        let (range, high, low) = match self.kind {
            ScanKind::Sequential => (0..64, 0, 0),
            ScanKind::Dc { high, low } => (0..1, high, low),
            ScanKind::Ac { first, last, high, low } => {
                // The memory consists of zero pages, which the system provides only when they are written.
                if component.nonzero.is_empty() {
                    component.nonzero = vec![0; blocks];
                }
                (usize::from(first)..usize::from(last) + 1, high, low)
            }
        };
        for bits in &mut component.bits[range] {
            // A scan contains either the first bits of a coefficient, or the bit below the lowest bit so far.
            if *bits != (high > 0).then_some(high) {
                return Err("contains coefficient bits in the wrong order".to_owned());
            }
            *bits = Some(low);
        }
        Ok(())
    }

    /// Skips an MCU of a sequential scan or of a scan of the DC coefficient.
    fn unit(&self, components: &[FrameComponent], chosen: &[usize], bits: &mut BitReader<'_>) -> Option<()> {
        for &place in chosen {
            let component = &components[place];
            let blocks = match chosen.len() {
                1 => 1,
                _ => component.factors[0] * component.factors[1],
            };
            if let ScanKind::Dc { high: 1.., .. } = self.kind {
                bits.skip(blocks as u32)?;
                continue;
            }
            let [dc, ac] = component.tables;
            let dc = self.tables[0][dc].as_ref()?;
            for _ in 0..blocks {
                let size = bits.read_code(dc)?;
                (size <= 16).then(|| bits.skip(size.into()))??;
                if let ScanKind::Dc { .. } = self.kind {
                    continue;
                }
                let ac = self.tables[1][ac].as_ref()?;
                let mut k = 1;
                while k < 64 {
                    let code = bits.read_code_and_skip(ac, |code| code & 15)?;
                    match (code >> 4, code & 15) {
                        (15, 0) => k += 16,
                        (_, 0) => break,
                        (zeros, _) => k += zeros + 1,
                    }
                }
                (k <= 64).then_some(())?;
            }
        }
        Some(())
    }

    /// Skips the AC coefficients of a block, or their correction bits. `run` is the end-of-band run: this
    /// number of following blocks have no new nonzero coefficients.
    fn ac(&self, component: &mut FrameComponent, block: usize, run: &mut u32, bits: &mut BitReader<'_>) -> Option<()> {
        let ScanKind::Ac { first, last, high, .. } = self.kind else { return None };
        let table = self.tables[1][component.tables[1]].as_ref()?;
        let nonzero = component.nonzero.get_mut(block)?;
        let refined = high > 0;
        let mut k = first;
        while *run == 0 && k <= last {
            let code = bits.read_code(table)?;
            let (mut zeros, size) = (code >> 4, code & 15);
            if size == 0 && zeros < 15 {
                *run = (1 << zeros) + bits.read_bits(zeros.into())?;
                break;
            }
            bits.skip(size.into())?;
            if refined {
                (size < 2).then_some(())?;
                // The scan leaves this number of zero coefficients unchanged; each nonzero coefficient before the next
                // new one has a correction bit.
                while k <= last {
                    if *nonzero >> k & 1 == 1 {
                        bits.skip(1)?;
                    } else if zeros == 0 {
                        break;
                    } else {
                        zeros -= 1;
                    }
                    k += 1;
                }
            } else {
                k += zeros;
            }
            if size > 0 {
                (k <= last).then_some(())?;
                *nonzero |= 1 << k;
            }
            k += 1;
        }
        if *run > 0 {
            if refined {
                let rest = *nonzero >> k << k & (u64::MAX >> (63 - last));
                let count = rest.count_ones();
                bits.skip(count / 2)?;
                bits.skip(count.div_ceil(2))?;
            }
            *run -= 1;
        }
        Some(())
    }
}
