//! Colour: linear Rec. 709 float32 internally, sRGB bytes in files.

pub mod view_transform;

use std::sync::LazyLock;

/// Linear Rec. 709 red, green, blue.
pub type Rgb = [f32; 3];

/// Converts one sRGB channel in 0..=1 to linear (IEC 61966-2-1).
pub fn linear_from_srgb(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Converts one linear channel to sRGB in 0..=1 (IEC 61966-2-1); the argument is not clamped.
pub fn srgb_from_linear(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// Converts an 8-bit sRGB colour to linear.
pub fn linear_from_srgb8(rgb: [u8; 3]) -> Rgb {
    static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|v| linear_from_srgb(v as f32 / 255.0)));
    rgb.map(|v| LINEAR[usize::from(v)])
}

/// Converts a linear colour to 8-bit sRGB, rounded to nearest; out-of-range values are clamped, and NaN becomes 0.
pub fn srgb8_from_linear(rgb: Rgb) -> [u8; 3] {
    static BYTES: LazyLock<SrgbTable> = LazyLock::new(SrgbTable::new);
    let bytes = &*BYTES;
    rgb.map(|v| bytes.encode(v))
}

/// Converts one linear channel to a byte by the sRGB formula.
fn srgb_byte(v: f32) -> u8 {
    (srgb_from_linear(v).clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Table with the same results as [`srgb_byte`]. The upper half of a float32 number from [`TABLE_START`] to 1 selects
/// a bin, 128 in each octave: narrow enough that the byte changes at most once per bin. The byte is the upper half of
/// the sum of the bin's entry and the number's lower half.
struct SrgbTable([u32; BINS]);

/// Smallest number in the table, 2^-13; its byte is still 0.
const TABLE_START: f32 = 1.0 / 8192.0;
const FIRST_BIN: u32 = TABLE_START.to_bits() >> 16;
const BINS: usize = ((1f32.to_bits() >> 16) - FIRST_BIN) as usize + 1;

impl SrgbTable {
    fn new() -> Self {
        Self(std::array::from_fn(|bin| {
            let number = |lower: u32| f32::from_bits((FIRST_BIN + bin as u32) << 16 | lower);
            let byte = u32::from(srgb_byte(number(0)));
            // Binary search for the first lower half that gives the next byte; 0x10000 if no lower half does.
            let (mut below, mut next) = (0, 0x1_0000);
            while below + 1 < next {
                let middle = (below + next) / 2;
                if u32::from(srgb_byte(number(middle))) > byte {
                    next = middle;
                } else {
                    below = middle;
                }
            }
            (byte << 16) + 0x1_0000 - next
        }))
    }

    fn encode(&self, v: f32) -> u8 {
        // `max` is not used, because it may keep NaN.
        let v = if v > TABLE_START { v } else { TABLE_START };
        let bits = v.min(1.0).to_bits();
        ((self.0[(bits >> 16) as usize - FIRST_BIN as usize] + (bits & 0xffff)) >> 16) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_table_equals_the_curve() {
        let same = |v: f32| assert_eq!(srgb8_from_linear([v; 3]), [srgb_byte(v); 3], "{v:e}");
        let odd = [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -0.0, 0.0];
        let more = [f32::MIN_POSITIVE, 1e-40, TABLE_START, 1.0, 1.5, f32::MAX];
        odd.into_iter().chain(more).for_each(same);
        // The test compares every number near a change of the byte, and many other numbers.
        let mut last = TABLE_START.to_bits();
        let mut changes = 0;
        for bits in (TABLE_START.to_bits()..1f32.to_bits()).step_by(97) {
            same(f32::from_bits(bits));
            if srgb_byte(f32::from_bits(bits)) != srgb_byte(f32::from_bits(last)) {
                (last - 97..bits + 97).map(f32::from_bits).for_each(same);
                changes += 1;
            }
            last = bits;
        }
        assert_eq!(changes, 255);
    }
}
