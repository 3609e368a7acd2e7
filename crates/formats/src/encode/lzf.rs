//! LZF compression, as in compressed PCD files.
//!
//! A byte n below 32 is followed by n + 1 literal bytes. Other bytes start a copy of earlier output: the upper three
//! bits are the copy's length minus 2 (7: the next byte is added), the lower five bits and the next byte are the copy's
//! distance minus 1. Source: LibLZF (M. Lehmann), `lzf.h`.

/// Bits of the hash of three bytes.
const HASH_BITS: u32 = 16;
/// Largest distance of a copy.
const MAX_DISTANCE: usize = 1 << 13;
/// Largest length of a copy.
const MAX_COPY: usize = 264;
/// Shortest length of a copy.
const MIN_COPY: usize = 3;
/// Largest number of literal bytes in a row.
const MAX_LITERALS: usize = 32;

/// Returns compressed bytes; they are at most 1/32 longer than `data`, plus one byte.
pub fn compress(data: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(data.len() / 2 + 16);
    let mut places = vec![usize::MAX; 1 << HASH_BITS];
    let (mut at, mut literals) = (0, 0);
    while at < data.len() {
        let copy = find_copy(data, at, &mut places);
        let Some((distance, length)) = copy else {
            at += 1;
            continue;
        };
        push_literals(&data[literals..at], &mut out);
        let (short, far) = (length - 2, distance - 1);
        out.push(((short.min(7) as u8) << 5) | (far >> 8) as u8);
        if short >= 7 {
            out.push((short - 7) as u8);
        }
        out.push(far as u8);
        at += length;
        literals = at;
    }
    push_literals(&data[literals..], &mut out);
    out
}

/// Distance and length of the earlier bytes that equal the bytes at `at`, if there are any; stores `at` in `places`.
fn find_copy(data: &[u8], at: usize, places: &mut [usize]) -> Option<(usize, usize)> {
    let &[a, b, c] = data.get(at..at + MIN_COPY)? else { return None };
    let hash = (u32::from_le_bytes([a, b, c, 0]).wrapping_mul(2_654_435_761) >> (32 - HASH_BITS)) as usize;
    let from = std::mem::replace(&mut places[hash], at);
    let distance = at.checked_sub(from).filter(|distance| (1..=MAX_DISTANCE).contains(distance))?;
    let most = MAX_COPY.min(data.len() - at);
    let length = (0..most).take_while(|&i| data[from + i] == data[at + i]).count();
    (length >= MIN_COPY).then_some((distance, length))
}

fn push_literals(bytes: &[u8], out: &mut Vec<u8>) {
    for part in bytes.chunks(MAX_LITERALS) {
        out.push((part.len() - 1) as u8);
        out.extend_from_slice(part);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decompressed(data: &[u8]) -> Vec<u8> {
        let (mut out, mut at) = (vec![], 0);
        while at < data.len() {
            let control = usize::from(data[at]);
            at += 1;
            if control < 32 {
                out.extend_from_slice(&data[at..=at + control]);
                at += control + 1;
                continue;
            }
            let mut length = (control >> 5) + 2;
            if control >> 5 == 7 {
                length += usize::from(data[at]);
                at += 1;
            }
            let distance = ((control & 31) << 8 | usize::from(data[at])) + 1;
            at += 1;
            for _ in 0..length {
                out.push(out[out.len() - distance]);
            }
        }
        out
    }

    #[test]
    fn decompression_restores_repeated_and_random_bytes() {
        let mut state = 1u32;
        let mut random = |limit: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % limit
        };
        for size in [0, 1, 2, 3, 31, 32, 33, 300, 20_000] {
            for limit in [1, 2, 5, 256] {
                let data: Vec<u8> = (0..size).map(|_| random(limit) as u8).collect();
                assert_eq!(decompressed(&compress(&data)), data, "{size} bytes below {limit}");
            }
        }
    }

    #[test]
    fn constant_bytes_become_a_fraction_of_their_size() {
        assert!(compress(&[7; 10_000]).len() < 150);
    }
}
