//! Position of pixel centres in pixel coordinates.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Pixel coordinates of the first pixel's centre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PixelCenter {
    /// The centre of the first pixel is at (0, 0), as in OpenCV.
    #[default]
    Integer,
    /// The centre of the first pixel is at (0.5, 0.5), as in COLMAP and OpenGL.
    Half,
}

impl PixelCenter {
    /// Coordinate of a pixel's centre minus its column or row: 0 or 0.5.
    pub fn offset(self) -> f64 {
        match self {
            PixelCenter::Integer => 0.0,
            PixelCenter::Half => 0.5,
        }
    }
}
