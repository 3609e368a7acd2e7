//! View transforms: from linear radiance to display values.
//!
//! All transforms convert linear Rec. 709 with white point D65 to linear Rec. 709 values in 0..=1, which are then
//! encoded as sRGB. No view transform balances white: light with the radiance (1, 1, 1) becomes the display's white,
//! and coloured lights tint the image.

use crate::color::Rgb;
use crate::named_enum::named_enum;
use glam::{Mat3, Vec3};

named_enum! {
    /// View transforms.
    #[derive(Default)]
    #[schemars(rename = "View")]
    pub enum ViewTransform {
        /// Unchanged radiance, clipped at 1.
        #[default]
        Standard = "standard",
        /// AgX: film-like, with soft, desaturated highlights, for scenes of high contrast.
        Agx = "agx",
        /// Khronos PBR Neutral: base colours unchanged and highlights compressed, for product images.
        PbrNeutral = "pbr_neutral",
    }
}

impl ViewTransform {
    /// Converts linear radiance to the linear display value. `Standard` may return values outside 0..=1.
    pub fn apply(self, rgb: Rgb) -> Rgb {
        match self {
            Self::Standard => rgb,
            Self::Agx => agx(rgb.into()).into(),
            Self::PbrNeutral => pbr_neutral(rgb.into()).into(),
        }
    }
}

/// T. Sobotka's AgX (2019) in the approximation of B. Wrensch, "Minimal AgX Implementation", 2024: inset of the
/// primaries, 16.5 stops of log2, a sigmoid, and the inverse inset. Its curve is designed for a display with exponent
/// 2.2.
fn agx(rgb: Vec3) -> Vec3 {
    const INSET: Mat3 = Mat3::from_cols(
        Vec3::new(0.842_479_06, 0.042_328_242, 0.042_375_655),
        Vec3::new(0.078_433_6, 0.878_468_64, 0.078_433_6),
        Vec3::new(0.079_223_745, 0.079_166_13, 0.879_143),
    );
    const OUTSET: Mat3 = Mat3::from_cols(
        Vec3::new(1.196_879, -0.052_896_85, -0.052_971_636),
        Vec3::new(-0.098_020_88, 1.151_903_1, -0.098_043_45),
        Vec3::new(-0.099_029_74, -0.098_961_18, 1.151_073_7),
    );
    const STOPS: [f32; 2] = [-12.473_93, 4.026_069];
    let curve = |v: f32| {
        let x = (v.max(1e-10).log2().clamp(STOPS[0], STOPS[1]) - STOPS[0]) / (STOPS[1] - STOPS[0]);
        let coefficients = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.002_32];
        coefficients.into_iter().fold(0.0, |sum, c| sum * x + c)
    };
    let inside = INSET * rgb.max(Vec3::ZERO);
    let formed = OUTSET * Vec3::new(curve(inside.x), curve(inside.y), curve(inside.z));
    formed.clamp(Vec3::ZERO, Vec3::ONE).powf(2.2)
}

/// The Khronos PBR Neutral Tone Mapper, specification 1.0 (2024).
fn pbr_neutral(rgb: Vec3) -> Vec3 {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let rgb = rgb.max(Vec3::ZERO).min(Vec3::MAX);
    let least = rgb.min_element();
    // Fresnel reflection of a dielectric under white light, which rendered images contain in addition to the base
    // colour.
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let rgb = rgb - offset;
    let peak = rgb.max_element();
    if peak < START {
        return rgb;
    }
    let d = 1.0 - START;
    let compressed = 1.0 - d * d / (peak + d - START);
    let grey = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    (rgb * (compressed / peak)).lerp(Vec3::splat(compressed), grey)
}
