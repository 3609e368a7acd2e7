//! Ways of laying a picture behind what a camera sees.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The way in which a picture is laid behind what a camera sees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BackgroundFit {
    /// Pixel by pixel, or warped from the camera that took it.
    #[default]
    Exact,
    /// Enlarged and cut evenly until it covers the frame.
    Cover,
}
