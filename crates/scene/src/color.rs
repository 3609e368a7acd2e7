//! Colour: linear Rec. 709 float32 inside, sRGB bytes outside.

use std::sync::LazyLock;

/// Linear Rec. 709 red, green, blue.
pub type Rgb = [f32; 3];

/// One sRGB channel in 0..=1 to linear (IEC 61966-2-1).
pub fn linear_from_srgb(v: f32) -> f32 {
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// One linear channel to sRGB in 0..=1 (IEC 61966-2-1); the argument is not clamped.
pub fn srgb_from_linear(v: f32) -> f32 {
    if v <= 0.003_130_8 {
        v * 12.92
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

/// An 8-bit sRGB colour to linear.
pub fn linear_from_srgb8(rgb: [u8; 3]) -> Rgb {
    static LINEAR: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|v| linear_from_srgb(v as f32 / 255.0)));
    rgb.map(|v| LINEAR[usize::from(v)])
}

/// A linear colour to 8-bit sRGB, rounded to nearest, out-of-range values at the ends.
pub fn srgb8_from_linear(rgb: Rgb) -> [u8; 3] {
    rgb.map(|v| (srgb_from_linear(v).clamp(0.0, 1.0) * 255.0).round() as u8)
}
