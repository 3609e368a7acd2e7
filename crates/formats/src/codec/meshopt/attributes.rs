//! Mode 0: elements as byte-wise differences from the previous element.

use crate::codec::meshopt::stream::Stream;

/// Number of elements that share the bit widths of their differences.
const GROUP_ELEMENTS: usize = 16;
const MAX_BLOCK_ELEMENTS: usize = 256;

/// Maximum number of elements in a block.
pub(super) fn block_elements(stride: usize) -> usize {
    ((8192 / stride) & !(GROUP_ELEMENTS - 1)).min(MAX_BLOCK_ELEMENTS)
}

/// Encoding of the differences of a four-byte channel.
#[derive(Clone, Copy)]
enum ChannelMode {
    /// Four differences of one byte each.
    Bytes,
    /// Two differences of 16 bits each.
    Words,
    /// XOR with the previous 32-bit integer, rotated to the right by this number of bits.
    Xor(u32),
}

impl ChannelMode {
    fn new(mode: u8) -> Result<Self, String> {
        match (mode & 15, mode >> 4) {
            (0, 0) => Ok(Self::Bytes),
            (1, 0) => Ok(Self::Words),
            (2, rotation) => Ok(Self::Xor(rotation.into())),
            _ => Err(format!("unknown channel mode {mode:#04x}")),
        }
    }
}

/// Decodes `count` elements of `stride` bytes; both numbers have been validated.
pub(super) fn decode(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let tail_size = |header| match header {
        0xa0 => stride.max(32),
        _ => (stride + stride / 4).max(24),
    };
    let (header, mut stream, tail) = Stream::open(bytes, tail_size)?;
    let channels = stride / 4;
    let (baseline, modes) = match header {
        0xa0 => (&tail[tail.len() - stride..], vec![ChannelMode::Bytes; channels]),
        0xa1 => {
            let (baseline, modes) = tail[tail.len() - stride - channels..].split_at(stride);
            let modes: Result<_, _> = modes.iter().map(|&mode| ChannelMode::new(mode)).collect();
            (baseline, modes?)
        }
        other => return Err(format!("header {other:#04x}; expected 0xa0 or 0xa1")),
    };
    let mut last = baseline.to_vec();
    let mut out = Vec::new();
    let mut deltas = [[0; MAX_BLOCK_ELEMENTS]; 4];
    let mut left = count;
    while left > 0 {
        let elements = left.min(block_elements(stride));
        let start = out.len();
        out.resize(start + elements * stride, 0);
        let target = &mut out[start..];
        let controls: &[u8] = match header {
            0xa0 => &[],
            _ => stream.read_bytes(channels)?,
        };
        for (channel, &mode) in modes.iter().enumerate() {
            for (byte, deltas) in deltas.iter_mut().enumerate() {
                let control = controls.get(channel).map(|c| c >> (2 * byte) & 3);
                read_deltas(&mut stream, control, elements, deltas)?;
            }
            add_deltas(mode, &deltas, &mut target[4 * channel..], stride, &mut last[4 * channel..][..4]);
        }
        left -= elements;
    }
    stream.finish()?;
    Ok(out)
}

/// Decodes the differences of one byte of a block's elements. `control` is present from version 1 on.
fn read_deltas(
    stream: &mut Stream<'_>,
    control: Option<u8>,
    elements: usize,
    deltas: &mut [u8; MAX_BLOCK_ELEMENTS],
) -> Result<(), String> {
    let widths = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => {
            deltas.fill(0);
            return Ok(());
        }
        Some(_) => {
            deltas[..elements].copy_from_slice(stream.read_bytes(elements)?);
            return Ok(());
        }
    };
    let groups = elements.div_ceil(GROUP_ELEMENTS);
    let headers = stream.read_bytes(groups.div_ceil(4))?;
    for (group, deltas) in deltas.as_chunks_mut::<GROUP_ELEMENTS>().0[..groups].iter_mut().enumerate() {
        let width = widths[usize::from(headers[group / 4] >> (2 * (group % 4)) & 3)];
        match width {
            0 => deltas.fill(0),
            8 => deltas.copy_from_slice(stream.read_bytes(GROUP_ELEMENTS)?),
            _ => read_packed(stream, width, deltas)?,
        }
    }
    Ok(())
}

/// Decodes a group of differences of 1, 2 or 4 bits; if all bits are set, the difference follows as a byte.
fn read_packed(stream: &mut Stream<'_>, width: usize, deltas: &mut [u8; GROUP_ELEMENTS]) -> Result<(), String> {
    let packed = stream.read_bytes(2 * width)?;
    let per_byte = 8 / width;
    let sentinel = (1 << width) - 1;
    for (i, delta) in deltas.iter_mut().enumerate() {
        // Groups of single bits start with the lowest bit; groups of wider values start with the highest bits.
        let place = match width {
            1 => i % 8,
            _ => 8 - width * (1 + i % per_byte),
        };
        *delta = packed[i / per_byte] >> place & sentinel;
        if *delta == sentinel {
            *delta = stream.byte()?;
        }
    }
    Ok(())
}

/// Converts the differences of four bytes to elements. `target[0]` is the first of these bytes in the first element.
fn add_deltas(
    mode: ChannelMode,
    deltas: &[[u8; MAX_BLOCK_ELEMENTS]; 4],
    target: &mut [u8],
    stride: usize,
    last: &mut [u8],
) {
    let mut before = [last[0], last[1], last[2], last[3]];
    for (i, element) in target.chunks_mut(stride).enumerate() {
        let delta = [deltas[0][i], deltas[1][i], deltas[2][i], deltas[3][i]];
        before = match mode {
            ChannelMode::Bytes => [0, 1, 2, 3].map(|b: usize| {
                let delta = delta[b] >> 1 ^ (delta[b] & 1).wrapping_neg();
                before[b].wrapping_add(delta)
            }),
            ChannelMode::Words => {
                let word = |low: usize| {
                    let delta = u16::from_le_bytes([delta[low], delta[low + 1]]);
                    let delta = delta >> 1 ^ (delta & 1).wrapping_neg();
                    u16::from_le_bytes([before[low], before[low + 1]]).wrapping_add(delta).to_le_bytes()
                };
                let ([a, b], [c, d]) = (word(0), word(2));
                [a, b, c, d]
            }
            ChannelMode::Xor(rotation) => {
                let delta = u32::from_le_bytes(delta).rotate_right(rotation);
                (u32::from_le_bytes(before) ^ delta).to_le_bytes()
            }
        };
        element[..4].copy_from_slice(&before);
    }
    last.copy_from_slice(&before);
}
