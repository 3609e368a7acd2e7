//! OpenCV's main model: radial, tangential and thin prism distortion, tilted sensor. Formulas: OpenCV's documentation
//! of `calib3d`.

use std::f64::consts::FRAC_PI_2;

use glam::{DMat3, DVec2, DVec3};

use super::brown::{BrownConrady, BrownTerms};
use crate::counted::counted;
use crate::error::{Result, SceneError};

/// Maximum angle to the axis as a fraction of 90 degrees, where the tangent is infinite.
const MAX_ANGLE_FRACTION: f64 = 2047.0 / 2048.0;

/// The coefficients `k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [τx τy]]]]`.
///
/// The model is used on a disc of the plane at depth 1, less than 90 degrees from the axis, on which it is one-to-one.
/// The sensor's tilt is applied afterwards, as a homography.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OpenCv {
    given: Vec<f64>,
    plane: BrownConrady,
    /// Homography of the tilted sensor, and its inverse.
    tilt: Option<[DMat3; 2]>,
}

impl OpenCv {
    pub(super) fn new(given: &[f64]) -> Result<Self> {
        if ![4, 5, 8, 12, 14].contains(&given.len()) {
            return Err(SceneError::lens(format!(
                "distortion {given:?} has {}; the OpenCV model requires 4 (k1 k2 p1 p2), 5 (and k3), 8 (and k4 k5 \
                 k6), 12 (and s1 s2 s3 s4) or 14 (and tau_x tau_y)",
                counted(given.len(), "coefficient")
            )));
        }
        let mut all = [0.0; 14];
        all[..given.len()].copy_from_slice(given);
        let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y] = all;
        if tau_x.abs() >= FRAC_PI_2 || tau_y.abs() >= FRAC_PI_2 {
            return Err(SceneError::lens(format!(
                "distortion {given:?} tilts the sensor by {tau_x} and {tau_y}; expected radians within ±π/2"
            )));
        }
        let tilt = (tau_x != 0.0 || tau_y != 0.0).then(|| {
            let tilt = tilt_homography(tau_x, tau_y);
            [tilt, tilt.inverse()]
        });
        let terms = BrownTerms {
            numerator: [k1, k2, k3, 0.0, 0.0, 0.0],
            denominator: [k4, k5, k6],
            tangential: [p1, p2],
            prism: [s1, s2, s3, s4],
            tangential_after_radial: false,
        };
        Ok(Self {
            given: given.to_vec(),
            plane: BrownConrady::new(terms, |part| (FRAC_PI_2 * MAX_ANGLE_FRACTION * part).tan()),
            tilt,
        })
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.given
    }

    pub(super) fn distort(&self, direction: DVec3) -> Option<DVec2> {
        if direction.z.is_nan() || direction.z <= 0.0 {
            return None;
        }
        let image = self.plane.distort(direction.truncate() / direction.z)?;
        match self.tilt {
            None => Some(image),
            Some([tilt, _]) => dehomogenize(tilt * image.extend(1.0)),
        }
    }

    /// Point of the plane at depth 1 that has this image.
    pub(super) fn undistort_plane(&self, image: DVec2, near: Option<DVec2>) -> Option<DVec2> {
        let target = match self.tilt {
            None => image,
            Some([_, inverse]) => dehomogenize(inverse * image.extend(1.0))?,
        };
        self.plane.undistort(target, near)
    }
}

/// Homography from a sensor perpendicular to the axis to a sensor tilted about x and y.
fn tilt_homography(tau_x: f64, tau_y: f64) -> DMat3 {
    let r = DMat3::from_rotation_y(-tau_y) * DMat3::from_rotation_x(-tau_x);
    let (across_x, across_y, along) = (r.z_axis.x, r.z_axis.y, r.z_axis.z);
    let projection = DMat3::from_cols(
        DVec3::new(along, 0.0, 0.0),
        DVec3::new(0.0, along, 0.0),
        DVec3::new(-across_x, -across_y, 1.0),
    );
    projection * r
}

/// Point with these homogeneous coordinates, if it is in front of the plane at infinity.
fn dehomogenize(x: DVec3) -> Option<DVec2> {
    (x.z > 0.0).then(|| x.truncate() / x.z)
}
