//! Lenses: where light of a given direction meets the image plane at focal length 1, before K is applied.

mod brown;
mod colmap;
mod division;
mod fisheye;
mod fov;
mod model;
mod opencv;
mod panorama;
mod prism_fisheye;
mod unified;

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

pub use self::colmap::{colmap_from_lens, lens_from_colmap};
pub use self::division::Division;
pub use self::fisheye::Fisheye;
pub use self::fov::Fov;
pub use self::model::LensModel;
use self::model::wrong_count;
pub use self::opencv::OpenCv;
pub use self::prism_fisheye::PrismFisheye;
pub use self::unified::{DoubleSphere, Eucm, Omni};
use crate::camera::intrinsics::intrinsics_from_focal;
use crate::camera::pixel_center::PixelCenter;
use crate::error::{Result, SceneError};

/// Projection of directions by a lens. Each model is used on the region on which it is one-to-one, and projects nothing
/// outside that region.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Lens {
    /// No lens: straight lines stay straight.
    #[default]
    Pinhole,
    /// See [`OpenCv`].
    OpenCv(Box<OpenCv>),
    /// See [`Fisheye`].
    Fisheye(Fisheye),
    /// See [`PrismFisheye`].
    ThinPrismFisheye(Box<PrismFisheye>),
    /// See [`PrismFisheye`].
    RadTanThinPrismFisheye(Box<PrismFisheye>),
    /// See [`Fov`].
    Fov(Fov),
    /// See [`Division`].
    Division(Division),
    /// See [`Omni`].
    Omni(Box<Omni>),
    /// See [`Eucm`].
    Eucm(Eucm),
    /// See [`DoubleSphere`].
    DoubleSphere(DoubleSphere),
    /// Equirectangular panorama: x is `atan2(X, Z)` and y is `atan2(Y, sqrt(X² + Z²))`, in radians.
    Equirectangular,
    /// Cylindrical panorama: x is `atan2(X, Z)` in radians, y is `Y / sqrt(X² + Z²)`.
    Cylindrical,
}

impl Lens {
    /// Creates the lens of a model and its coefficients. Zero coefficients give a pinhole for [`LensModel::OpenCv`] and
    /// [`LensModel::Division`], and the equidistant fisheye for [`LensModel::Fisheye`].
    ///
    /// # Errors
    /// [`SceneError::Camera`] if the model does not have this number of coefficients, or if values are not finite or
    /// outside the model's range.
    pub fn new(model: LensModel, coefficients: &[f64]) -> Result<Self> {
        if !coefficients.iter().all(|v| v.is_finite()) {
            return Err(SceneError::lens(format!(
                "distortion {coefficients:?} is not finite; every coefficient must be \
                finite"
            )));
        }
        let zero = coefficients.iter().all(|v| *v == 0.0);
        Ok(match model {
            LensModel::OpenCv => match OpenCv::new(coefficients)? {
                _ if zero => Lens::Pinhole,
                lens => Lens::OpenCv(Box::new(lens)),
            },
            LensModel::Fisheye => Lens::Fisheye(Fisheye::new(coefficients)?),
            LensModel::ThinPrismFisheye => Lens::ThinPrismFisheye(Box::new(PrismFisheye::thin_prism(coefficients)?)),
            LensModel::RadTanThinPrismFisheye => {
                Lens::RadTanThinPrismFisheye(Box::new(PrismFisheye::rad_tan_thin_prism(coefficients)?))
            }
            LensModel::Fov => Lens::Fov(Fov::new(coefficients)?),
            LensModel::Division => match Division::new(coefficients)? {
                _ if zero => Lens::Pinhole,
                lens => Lens::Division(lens),
            },
            LensModel::Omni => Lens::Omni(Box::new(Omni::new(coefficients)?)),
            LensModel::Eucm => Lens::Eucm(Eucm::new(coefficients)?),
            LensModel::DoubleSphere => Lens::DoubleSphere(DoubleSphere::new(coefficients)?),
            LensModel::Equirectangular | LensModel::Cylindrical if !coefficients.is_empty() => {
                return Err(wrong_count(coefficients, model, "none"));
            }
            LensModel::Equirectangular => Lens::Equirectangular,
            LensModel::Cylindrical => Lens::Cylindrical,
        })
    }

    /// Model and coefficients as given; `None` for a pinhole.
    pub fn coefficients(&self) -> Option<(LensModel, &[f64])> {
        Some(match self {
            Lens::Pinhole => return None,
            Lens::OpenCv(lens) => (LensModel::OpenCv, lens.coefficients()),
            Lens::Fisheye(lens) => (LensModel::Fisheye, lens.coefficients()),
            Lens::ThinPrismFisheye(lens) => (LensModel::ThinPrismFisheye, lens.coefficients()),
            Lens::RadTanThinPrismFisheye(lens) => (LensModel::RadTanThinPrismFisheye, lens.coefficients()),
            Lens::Fov(lens) => (LensModel::Fov, lens.coefficients()),
            Lens::Division(lens) => (LensModel::Division, lens.coefficients()),
            Lens::Omni(lens) => (LensModel::Omni, lens.coefficients()),
            Lens::Eucm(lens) => (LensModel::Eucm, lens.coefficients()),
            Lens::DoubleSphere(lens) => (LensModel::DoubleSphere, lens.coefficients()),
            Lens::Equirectangular => (LensModel::Equirectangular, &[]),
            Lens::Cylindrical => (LensModel::Cylindrical, &[]),
        })
    }

    /// Point of the image plane at focal length 1 for a direction in camera axes, of any length. `None` if the lens
    /// does not image this direction. Directions perpendicular to the axis and behind the camera are supported too.
    pub fn distort(&self, direction: DVec3) -> Option<DVec2> {
        match self {
            Lens::Pinhole => (direction.z > 0.0).then(|| direction.truncate() / direction.z),
            Lens::OpenCv(lens) => lens.distort(direction),
            Lens::Fisheye(lens) => lens.distort(direction),
            Lens::ThinPrismFisheye(lens) | Lens::RadTanThinPrismFisheye(lens) => lens.distort(direction),
            Lens::Fov(lens) => lens.distort(direction),
            Lens::Division(lens) => lens.distort(direction),
            Lens::Omni(lens) => lens.distort(direction),
            Lens::Eucm(lens) => lens.distort(direction),
            Lens::DoubleSphere(lens) => lens.distort(direction),
            Lens::Equirectangular => panorama::equirectangular(direction),
            Lens::Cylindrical => panorama::cylindrical(direction),
        }
    }

    /// Direction in camera axes, of any length, that meets the image plane at a point: the inverse of
    /// [`Lens::distort`]. `None` if there is no such direction.
    pub fn undistort(&self, image: DVec2) -> Option<DVec3> {
        match self {
            Lens::Pinhole => Some(image.extend(1.0)),
            Lens::Fisheye(lens) => lens.undistort(image),
            Lens::Fov(lens) => lens.undistort(image),
            Lens::Division(lens) => lens.undistort(image),
            Lens::Eucm(lens) => lens.undistort(image),
            Lens::DoubleSphere(lens) => lens.undistort(image),
            Lens::Equirectangular => panorama::from_equirectangular(image),
            Lens::Cylindrical => panorama::from_cylindrical(image),
            Lens::OpenCv(_) | Lens::ThinPrismFisheye(_) | Lens::RadTanThinPrismFisheye(_) | Lens::Omni(_) => {
                self.plane_direction(self.undistort_plane(image, None)?)
            }
        }
    }

    /// K of a panorama that fills an image: it covers 360 degrees, and its height follows from the width. The left and
    /// right edges show the direction straight behind the camera; the top and bottom edges of an equirectangular
    /// panorama show straight up and straight down. A cylindrical panorama has square pixels and its horizon in the
    /// middle.
    pub fn full_panorama(&self, size: [u32; 2], center: PixelCenter) -> Option<DMat3> {
        let [width, height] = size.map(f64::from);
        let mut k = intrinsics_from_focal(width / TAU, size, center);
        match self {
            Lens::Equirectangular => k.y_axis.y = height / PI,
            Lens::Cylindrical => {}
            _ => return None,
        }
        Some(k)
    }

    /// True if the lens images a plane perpendicular to the axis, and therefore no directions at 90 degrees and beyond.
    pub(super) fn is_planar(&self) -> bool {
        matches!(self, Lens::Pinhole | Lens::OpenCv(_) | Lens::Fov(_))
    }

    /// True if the inverse is iterative. It is then computed by [`Lens::undistort_plane`] and
    /// [`Lens::plane_direction`].
    pub(super) fn has_iterative_inverse(&self) -> bool {
        matches!(self, Lens::OpenCv(_) | Lens::ThinPrismFisheye(_) | Lens::RadTanThinPrismFisheye(_) | Lens::Omni(_))
    }

    /// Point of the undistorted plane that has this image, for a lens with an iterative inverse; `near` is an initial
    /// guess. Returns `None` for lenses of other models.
    pub(super) fn undistort_plane(&self, image: DVec2, near: Option<DVec2>) -> Option<DVec2> {
        match self {
            Lens::OpenCv(lens) => lens.undistort_plane(image, near),
            Lens::ThinPrismFisheye(lens) | Lens::RadTanThinPrismFisheye(lens) => lens.undistort_plane(image, near),
            Lens::Omni(lens) => lens.undistort_plane(image, near),
            _ => None,
        }
    }

    /// Direction of a point of the undistorted plane.
    pub(super) fn plane_direction(&self, at: DVec2) -> Option<DVec3> {
        match self {
            Lens::ThinPrismFisheye(_) | Lens::RadTanThinPrismFisheye(_) => Some(prism_fisheye::from_equidistant(at)),
            Lens::Omni(lens) => lens.plane_direction(at),
            _ => Some(at.extend(1.0)),
        }
    }
}
