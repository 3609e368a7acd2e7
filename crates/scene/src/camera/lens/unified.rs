//! The unified model and related models: a sphere, viewed from a point other than its centre.
//!
//! - `omni`: Mei and Rives, "Single view point omnidirectional camera calibration from planar grids" (ICRA 2007), with
//!   radial and tangential distortion: OpenCV's `omnidir`, Kalibr's `omni` with `radtan`.
//! - `eucm`: Khomutenko, Garcia and Martinet, "An enhanced unified camera model" (RA-L 2016).
//! - `ds`: Usenko, Demmel and Cremers, "The double sphere camera model" (3DV 2018).

use glam::{DVec2, DVec3};

use super::brown::{BrownConrady, BrownTerms};
use super::model::{LensModel, wrong_count};
use crate::error::{Result, SceneError};

/// Maximum angle for models whose image plane is unbounded, as a fraction of the angle whose image is at infinity.
const MAX_ANGLE_FRACTION: f64 = 2047.0 / 2048.0;

/// Projects a direction of length d to `(x, y) / (a d + b z)`, b >= 0.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct UnifiedSphere {
    a: f64,
    b: f64,
}

impl UnifiedSphere {
    /// The radius increases with the angle while the divisor and `a z + b d` (the radius's derivative up to positive
    /// factors) are positive.
    fn distort(self, direction: DVec3) -> Option<DVec2> {
        let d = direction.length();
        let below = self.a * d + self.b * direction.z;
        (below > 0.0 && self.a * direction.z + self.b * d > 0.0).then(|| direction.truncate() / below)
    }

    /// Unit direction.
    fn undistort(self, image: DVec2) -> Option<DVec3> {
        let Self { a, b } = self;
        let s = image.length_squared();
        let square = 1.0 - s * (a * a - b * b);
        if square.is_nan() || square <= 0.0 {
            return None;
        }
        let z = (square.sqrt() - a * b * s) / (1.0 + b * b * s);
        Some((image * (a + b * z)).extend(z))
    }

    /// Radius at the fraction `part` of the maximum angle.
    fn radius(self, part: f64) -> f64 {
        let Self { a, b } = self;
        let angle = if a > b { -b / a } else { -a / b }.acos() * part;
        if a > b {
            angle.sin() / (a + b * angle.cos())
        } else {
            let angle = angle * MAX_ANGLE_FRACTION;
            angle.sin() / (a + b * angle.cos())
        }
    }
}

/// The unified model with the coefficients `ξ [k1 k2 p1 p2]`: `x = X / (Z + ξ d)`, where d is the distance, followed by
/// radial and tangential distortion.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Omni {
    given: Vec<f64>,
    sphere: UnifiedSphere,
    plane: Option<BrownConrady>,
}

impl Omni {
    pub(super) fn new(given: &[f64]) -> Result<Self> {
        let (xi, [k1, k2, p1, p2]) = match *given {
            [xi] => (xi, [0.0; 4]),
            [xi, k1, k2, p1, p2] => (xi, [k1, k2, p1, p2]),
            _ => return Err(wrong_count(given, LensModel::Omni, "1 (xi) or 5 (xi k1 k2 p1 p2)")),
        };
        if xi <= -1.0 {
            return Err(SceneError::lens(format!("distortion {given:?}: the omni model requires xi > -1")));
        }
        let sphere = UnifiedSphere { a: xi, b: 1.0 };
        let terms =
            BrownTerms { numerator: [k1, k2, 0.0, 0.0, 0.0, 0.0], tangential: [p1, p2], ..BrownTerms::default() };
        let plane = (terms != BrownTerms::default()).then(|| BrownConrady::new(terms, |part| sphere.radius(part)));
        Ok(Self { given: given.to_vec(), sphere, plane })
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.given
    }

    pub(super) fn distort(&self, direction: DVec3) -> Option<DVec2> {
        let at = self.sphere.distort(direction)?;
        match &self.plane {
            None => Some(at),
            Some(plane) => plane.distort(at),
        }
    }

    /// Point of the undistorted plane that has this image.
    pub(super) fn undistort_plane(&self, image: DVec2, near: Option<DVec2>) -> Option<DVec2> {
        match &self.plane {
            None => Some(image),
            Some(plane) => plane.undistort(image, near),
        }
    }

    /// Direction of a point of the undistorted plane.
    pub(super) fn plane_direction(&self, at: DVec2) -> Option<DVec3> {
        self.sphere.undistort(at)
    }
}

/// The enhanced unified model with the coefficients `α β`: `x = X / (α sqrt(β (X² + Y²) + Z²) + (1 - α) Z)`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Eucm {
    given: [f64; 2],
    sphere: UnifiedSphere,
    /// The square root of β.
    sqrt_beta: f64,
}

impl Eucm {
    pub(super) fn new(given: &[f64]) -> Result<Self> {
        let Ok(given @ [alpha, beta]) = <[f64; 2]>::try_from(given) else {
            return Err(wrong_count(given, LensModel::Eucm, "2 (alpha beta)"));
        };
        if !(0.0..=1.0).contains(&alpha) || beta <= 0.0 {
            return Err(SceneError::lens(format!(
                "distortion {given:?}: the eucm model requires alpha within 0..1 and beta > 0"
            )));
        }
        Ok(Self { given, sphere: UnifiedSphere { a: alpha, b: 1.0 - alpha }, sqrt_beta: beta.sqrt() })
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.given
    }

    pub(super) fn distort(&self, direction: DVec3) -> Option<DVec2> {
        let stretched = (direction.truncate() * self.sqrt_beta).extend(direction.z);
        Some(self.sphere.distort(stretched)? / self.sqrt_beta)
    }

    pub(super) fn undistort(&self, image: DVec2) -> Option<DVec3> {
        let stretched = self.sphere.undistort(image * self.sqrt_beta)?;
        Some((stretched.truncate() / self.sqrt_beta).extend(stretched.z))
    }
}

/// The double sphere model with the coefficients `ξ α`: the direction is shifted by ξ along the axis, `Z' = Z + ξ d`,
/// then `x = X / (α d' + (1 - α) Z')`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DoubleSphere {
    given: [f64; 2],
    first: UnifiedSphere,
    second: UnifiedSphere,
}

impl DoubleSphere {
    pub(super) fn new(given: &[f64]) -> Result<Self> {
        let Ok(given @ [xi, alpha]) = <[f64; 2]>::try_from(given) else {
            return Err(wrong_count(given, LensModel::DoubleSphere, "2 (xi alpha)"));
        };
        if !(0.0..=1.0).contains(&alpha) || xi <= -1.0 {
            return Err(SceneError::lens(format!(
                "distortion {given:?}: the double sphere model requires xi > -1 and alpha within 0..1"
            )));
        }
        Ok(Self { given, first: UnifiedSphere { a: xi, b: 1.0 }, second: UnifiedSphere { a: alpha, b: 1.0 - alpha } })
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.given
    }

    pub(super) fn distort(&self, direction: DVec3) -> Option<DVec2> {
        let d = direction.length();
        let xi = self.first.a;
        if direction.z * xi + d <= 0.0 {
            return None;
        }
        self.second.distort(direction.truncate().extend(direction.z + xi * d))
    }

    pub(super) fn undistort(&self, image: DVec2) -> Option<DVec3> {
        let moved = self.second.undistort(image)?;
        // The inverse of the second sphere's shift: |shifted - (0, 0, ξ d)| = d has one solution d > 0 in the valid
        // region.
        let (xi, z) = (self.first.a, moved.z);
        let square = 1.0 - (1.0 - z * z) * xi * xi;
        if square <= 0.0 {
            return None;
        }
        let scale = xi * z + square.sqrt();
        let direction = (moved.truncate() * scale).extend(z * scale - xi);
        (xi * direction.z + 1.0 > 0.0).then_some(direction)
    }
}
