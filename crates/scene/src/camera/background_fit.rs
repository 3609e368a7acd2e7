//! Fit of a background image to a camera's image.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Fit of a background image to a camera's image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BackgroundFit {
    /// Pixel by pixel, or warped from the camera that took the image.
    #[default]
    Exact,
    /// Scaled up and cropped to fill the frame without distortion.
    Cover,
}
