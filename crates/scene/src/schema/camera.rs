//! `[camera]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::words::Splat;
use crate::camera::{Camera, PixelCenter};
use crate::error::SceneError;
use crate::world::Up;

/// A camera: its size, its intrinsics (exactly one of `focal`, `fov`, `K`) and its pose (`location` with angles or a
/// `target`, or `R` with `C` or `t`), or all of it as one `matrix`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSpec {
    /// What it is asked for by; `camera` where not given.
    pub name: Option<String>,
    /// Columns and rows of the picture; 640 x 480 where not given.
    pub size: Option<[u32; 2]>,
    /// The focal length in pixels, or those of x and y.
    pub focal: Option<Splat<2>>,
    /// The vertical field of view in degrees, with square pixels.
    pub fov: Option<f64>,
    /// The intrinsic matrix [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in pixels.
    #[serde(rename = "K")]
    pub k: Option<[[f64; 3]; 3]>,
    /// The whole 3x4 camera matrix P, of any scale and sign.
    pub matrix: Option<[[f64; 4]; 3]>,
    /// The skew of `focal` or `fov`, in pixels; 0 where not given.
    pub skew: Option<f64>,
    /// The principal point of `focal` or `fov`, in pixels; the image's centre where not given.
    pub principal_point: Option<[f64; 2]>,
    /// Where the centre of the first pixel lies: "integer" at (0, 0) as in OpenCV, "half" at (0.5, 0.5) as in COLMAP.
    pub pixel_center: PixelCenter,
    /// The camera centre in the world.
    pub location: Option<[f64; 3]>,
    /// Leaning to the right, in degrees; 0 where not given.
    pub roll: Option<f64>,
    /// Looking down, in degrees; 0 where not given.
    pub pitch: Option<f64>,
    /// Turning left, in degrees; 0 looks along +x of a z-up world, along -z of a y-up one.
    pub yaw: Option<f64>,
    /// A point to look at, instead of angles.
    pub target: Option<[f64; 3]>,
    /// What points up in the picture, with `target`; the world's up where not given.
    pub up: Option<[f64; 3]>,
    /// The rotation camera_from_world, camera axes x right, y down, z forward.
    #[serde(rename = "R")]
    pub r: Option<[[f64; 3]; 3]>,
    /// The camera centre in the world, with `R`.
    #[serde(rename = "C")]
    pub c: Option<[f64; 3]>,
    /// The translation -R C, with `R`.
    pub t: Option<[f64; 3]>,
}

impl CameraSpec {
    /// The camera it describes.
    ///
    /// # Errors
    /// [`SceneError`] where intrinsics or pose are missing or given twice, and those of [`Camera`]'s constructors.
    pub fn build(&self, _up: Up) -> Result<Camera, SceneError> {
        Err(SceneError::World("not built yet".into()))
    }
}
