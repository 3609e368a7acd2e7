//! Cameras: P = K R [I | -C], and cameras whose centre is at infinity (Hartley and Zisserman, Multiple View Geometry,
//! chapter 6), with lens, aperture and shutter.

mod aperture;
mod background_fit;
mod center;
mod constructors;
mod decompose;
mod intrinsics;
mod lens;
mod optics;
mod pixel_center;
mod projection;
mod rig;
pub mod sensor;
mod shutter;
mod undistort_table;
mod validate;
mod vignetting;

pub use self::aperture::Aperture;
pub use self::background_fit::BackgroundFit;
pub use self::center::Center;
pub use self::intrinsics::{intrinsics_from_extent, intrinsics_from_focal, intrinsics_from_fov};
pub use self::lens::{
    Division, DoubleSphere, Eucm, Fisheye, Fov, Lens, LensModel, Omni, OpenCv, PrismFisheye, colmap_from_lens,
    lens_from_colmap,
};
pub use self::pixel_center::PixelCenter;
pub use self::projection::{CameraRay, Pinhole};
pub use self::rig::{NamedCamera, Rig};
pub use self::shutter::{Pose, ReadoutDirection, ShutterMotion};
pub use self::validate::{MAX_PIXELS, MAX_SIDE, ROTATION_TOLERANCE, nearest_rotation};
pub use self::vignetting::Vignetting;

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use self::undistort_table::UndistortTable;
use crate::math::rotation;
use crate::up::Up;

/// Camera: `x = K R (X - C)`, with the lens applied between R and K. Axes: x right, y down, z forward. All values are
/// float64.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    k: DMat3,
    r: DMat3,
    c: DVec3,
    /// `K R [I | -C]`, or the matrix given to [`Camera::from_matrix`], so that an ill-conditioned matrix keeps all its
    /// digits.
    p: [[f64; 4]; 3],
    size: [u32; 2],
    pixel_center: PixelCenter,
    center: Center,
    /// Matrix that the camera was created from, with its original scale and sign.
    matrix: Option<[[f64; 4]; 3]>,
    lens: Lens,
    #[serde(skip)]
    undistort_table: UndistortTable,
    aperture: Option<Aperture>,
    vignetting: Option<Vignetting>,
    /// Motion while the shutter is open; the pose in its middle is the camera's pose.
    motion: Option<ShutterMotion>,
    /// Depth at which the rays of [`Center::Infinity`] start.
    ray_start_depth: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    background: Option<Arc<Background>>,
}

/// Background image of a camera: a photo taken by the real camera, or any other image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Background {
    /// Image file.
    pub image: String,
    /// Fit of the background image.
    pub fit: BackgroundFit,
    /// Camera that took the image, given by its intrinsics and lens; `None` if the photo was taken by the camera that
    /// has the background.
    pub camera: Option<Arc<Camera>>,
}

impl Camera {
    /// Background image, if the camera has one.
    pub fn background(&self) -> Option<&Background> {
        self.background.as_deref()
    }

    /// Intrinsics: upper triangular, `K[2][2] = 1`, in pixels. For parallel rays, focal lengths are in pixels per world
    /// unit. For a matrix with its centre at infinity that is not affine, K is a general homography.
    pub fn k(&self) -> DMat3 {
        self.k
    }

    /// Rotation camera_from_world.
    pub fn r(&self) -> DMat3 {
        self.r
    }

    /// Centre in the world; for parallel rays, see [`Center`].
    pub fn c(&self) -> DVec3 {
        self.c
    }

    /// Translation `-R C`.
    pub fn t(&self) -> DVec3 {
        -(self.r * self.c)
    }

    /// 3x4 camera matrix `K R [I | -C]`, scaled so that the third row of its left 3x3 part has length 1 and points
    /// forward. For parallel rays, the last row is 0 0 0 1, or otherwise has length 1.
    pub fn p(&self) -> [[f64; 4]; 3] {
        self.p
    }

    /// Number of columns and rows.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The convention of pixel coordinates.
    pub fn pixel_center(&self) -> PixelCenter {
        self.pixel_center
    }

    /// Unit principal axis in the world: the third row of R.
    pub fn forward(&self) -> DVec3 {
        self.r.row(2)
    }

    /// Roll, pitch and yaw in degrees (see [`rotation::rpy_from_rotation`] for straight up and down).
    pub fn roll_pitch_yaw(&self, up: Up) -> [f64; 3] {
        let world_from_body = self.r.transpose() * rotation::CAMERA_FROM_BODY;
        rotation::rpy_from_rotation(rotation::world_from_reference(up).transpose() * world_from_body)
    }

    /// Pixel coordinates of a pixel's centre.
    #[inline]
    pub fn pixel_center_of(&self, column: u32, row: u32) -> DVec2 {
        DVec2::new(f64::from(column), f64::from(row)) + self.pixel_center.offset()
    }
}
