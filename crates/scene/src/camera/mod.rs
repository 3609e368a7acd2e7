//! Cameras: P = K R [I | -C], and those whose centre lies at infinity (Hartley and Zisserman, Multiple View Geometry,
//! chapter 6), with what their lens, aperture and shutter do.

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

/// A camera: `x = K R (X - C)`, with what its lens does between R and K. Axes x right, y down, z forward. All float64.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    k: DMat3,
    r: DMat3,
    c: DVec3,
    /// `K R [I | -C]`, or what [`Camera::from_matrix`] was given: an ill-conditioned matrix survives to the last
    /// digits.
    p: [[f64; 4]; 3],
    size: [u32; 2],
    pixel_center: PixelCenter,
    center: Center,
    /// The matrix that the camera was created from.
    matrix: Option<[[f64; 4]; 3]>,
    lens: Lens,
    #[serde(skip)]
    undistort_table: UndistortTable,
    aperture: Option<Aperture>,
    vignetting: Option<Vignetting>,
    /// Its middle is the pose.
    motion: Option<ShutterMotion>,
    /// Depth at which the rays of [`Center::Infinity`] start.
    ray_start_depth: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    background: Option<Arc<Background>>,
}

/// Background image of a camera: a photo taken by the real camera, or any other image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Background {
    /// The image file.
    pub image: String,
    /// Fit of the background image.
    pub fit: BackgroundFit,
    /// The camera that took it, by its intrinsics and lens; `None` for the camera that has it.
    pub camera: Option<Arc<Camera>>,
}

impl Camera {
    /// The background image.
    pub fn background(&self) -> Option<&Background> {
        self.background.as_deref()
    }

    /// Intrinsics: upper triangular, `K[2][2] = 1`, in pixels. Of parallel rays, focal lengths are in pixels per unit
    /// of the world; of a matrix with its centre at infinity that is not affine, K is any homography.
    pub fn k(&self) -> DMat3 {
        self.k
    }

    /// camera_from_world.
    pub fn r(&self) -> DMat3 {
        self.r
    }

    /// The centre in the world; of parallel rays, what [`Center`] says.
    pub fn c(&self) -> DVec3 {
        self.c
    }

    /// `-R C`.
    pub fn t(&self) -> DVec3 {
        -(self.r * self.c)
    }

    /// The 3x4 camera matrix `K R [I | -C]`, scaled so that its left 3x3 part has a third row of length 1 that points
    /// forward; of parallel rays, with a last row of 0 0 0 1, or else of length 1.
    pub fn p(&self) -> [[f64; 4]; 3] {
        self.p
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The convention of pixel coordinates.
    pub fn pixel_center(&self) -> PixelCenter {
        self.pixel_center
    }

    /// The principal axis in the world, unit length: the third row of R.
    pub fn forward(&self) -> DVec3 {
        self.r.row(2)
    }

    /// Roll, pitch and yaw in degrees (see [`rotation::rpy_from_rotation`] for straight up and down).
    pub fn roll_pitch_yaw(&self, up: Up) -> [f64; 3] {
        let world_from_body = self.r.transpose() * rotation::CAMERA_FROM_BODY;
        rotation::rpy_from_rotation(rotation::world_from_reference(up).transpose() * world_from_body)
    }

    /// The pixel coordinates of the centre of a pixel.
    #[inline]
    pub fn pixel_center_of(&self, column: u32, row: u32) -> DVec2 {
        DVec2::new(f64::from(column), f64::from(row)) + self.pixel_center.offset()
    }
}
