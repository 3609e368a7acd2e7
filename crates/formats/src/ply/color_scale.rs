//! Colours of a PLY file whose range is known only after all colours have been read.
//!
//! Whole numbers are sRGB with 8 bits or, for ushort, 16; floating-point numbers are linear, 0..=1. Files with other
//! ranges are common: ushort and float with 0..=255.

use raycam_scene::color::{Rgb, linear_from_srgb, linear_from_srgb8};
use raycam_scene::{NoticeCode, counted};

use crate::ply::scalar::ScalarType;

/// Colours as in the file.
pub(crate) struct PlyColors {
    kind: ScalarType,
    has_alpha: bool,
    values: Vec<[f64; 3]>,
    least_alpha: f64,
}

/// Range of colours.
struct Scale {
    white: f64,
    linear: bool,
    /// Description of a guessed range, for a notice.
    guess: Option<&'static str>,
}

impl PlyColors {
    pub(crate) fn new(kind: ScalarType, has_alpha: bool) -> Self {
        Self { kind, has_alpha, values: Vec::new(), least_alpha: f64::INFINITY }
    }

    /// Adds red, green, blue and alpha of a row.
    pub(crate) fn push(&mut self, [red, green, blue, alpha]: [f64; 4]) {
        self.values.push([red, green, blue]);
        if self.has_alpha {
            self.least_alpha = self.least_alpha.min(alpha);
        }
    }

    /// Range of the colours, determined from their type and values; `None` if no range fits.
    fn scale(&self) -> Option<Scale> {
        let most = self.values.as_flattened().iter().fold(0.0, |most: f64, &value| most.max(value));
        let whole = |white, guess| Some(Scale { white, linear: false, guess });
        match self.kind {
            ScalarType::F32 | ScalarType::F64 if most <= 1.01 => Some(Scale { white: 1.0, linear: true, guess: None }),
            ScalarType::F32 | ScalarType::F64 if most <= 255.0 => {
                whole(255.0, Some("floating-point colours are treated as 0 to 255, because some are greater than 1"))
            }
            ScalarType::U16 if most <= 255.0 => {
                whole(255.0, Some("ushort colours are treated as 0 to 255, because none is greater than 255"))
            }
            ScalarType::U16 => whole(65535.0, None),
            _ if most <= 255.0 => whole(255.0, None),
            _ if most <= 65535.0 => {
                whole(65535.0, Some("colours are treated as 0 to 65535, because some are greater than 255"))
            }
            _ => None,
        }
    }

    /// Linear colours, and true if some colours are translucent. Returns no colours if they cannot be interpreted.
    /// `note` receives the notices.
    pub(crate) fn settle(self, mut note: impl FnMut(NoticeCode, String)) -> (Option<Vec<Rgb>>, bool) {
        let Some(Scale { white, linear, guess }) = self.scale() else {
            note(NoticeCode::IgnoredColors, "the colours are ignored, because their range is unknown".into());
            return (None, false);
        };
        if let Some(guess) = guess {
            note(NoticeCode::AssumedConvention, guess.into());
        }
        let numbers = self.values.as_flattened();
        let odd = numbers.iter().filter(|value| !(0.0..=white).contains(*value)).count();
        if odd > 0 {
            note(
                NoticeCode::ClampedValue,
                format!("colour values outside 0 to {white} are clamped ({})", counted(odd, "value")),
            );
        }
        if white == 255.0 && odd == 0 && !self.kind.is_float() {
            let colors = self.values.iter().map(|color| linear_from_srgb8(color.map(|value| value as u8)));
            return (Some(colors.collect()), self.least_alpha < white);
        }
        let value = |value: f64| {
            // The conversion maps NaN to 0.
            let share = (value.max(0.0) / white).min(1.0) as f32;
            if linear { share } else { linear_from_srgb(share) }
        };
        let colors = self.values.iter().map(|color| color.map(value)).collect();
        (Some(colors), self.least_alpha < white)
    }
}
