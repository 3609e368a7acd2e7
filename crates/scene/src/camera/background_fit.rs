//! Fit of a background image to a camera's image.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Fit of a background image to a camera's image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BackgroundFit {
    /// The image is used pixel by pixel, or is warped from the camera that took it.
    #[default]
    Exact,
    /// The image is scaled and cropped without distortion so that it fills the camera's image.
    Cover,
}
