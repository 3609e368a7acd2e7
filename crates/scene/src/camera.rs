//! The finite projective camera, P = K R [I | -C] (Hartley and Zisserman, chapter 6).

use glam::{DMat3, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the centre of the first pixel lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PixelCenter {
    /// At (0, 0), as in OpenCV.
    #[default]
    Integer,
    /// At (0.5, 0.5), as in COLMAP and OpenGL.
    Half,
}

/// A pinhole camera: `x = K R (X - C)`, axes x right, y down, z forward. All float64.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    k: DMat3,
    r: DMat3,
    c: DVec3,
    size: [u32; 2],
    pixel_center: PixelCenter,
}
