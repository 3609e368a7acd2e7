//! The fisheye of Kannala and Brandt, "A generic camera model and calibration method for conventional, wide-angle, and
//! fish-eye lenses" (2006), with the parameters of OpenCV's `cv::fisheye`.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::model::{LensModel, wrong_count};
use crate::error::Result;

/// Number of angle steps in the search for the angle up to which the model is one-to-one.
const ANGLE_STEPS: u32 = 4096;

/// The fisheye model: a direction at the angle θ to the principal axis has the image radius `θ (1 + k1 θ² + k2 θ⁴ +
/// k3 θ⁶ + k4 θ⁸)`. The model covers angles up to 180 degrees (a field of view of 360), or up to the first angle at
/// which the radius stops growing.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Fisheye {
    k: [f64; 4],
    /// Maximum angle in radians, and its image radius; the maximum itself is excluded.
    max_angle: f64,
    max_radius: f64,
}

impl Fisheye {
    pub(super) fn new(coefficients: &[f64]) -> Result<Self> {
        let Ok(k) = <[f64; 4]>::try_from(coefficients) else {
            return Err(wrong_count(coefficients, LensModel::Fisheye, "4 (k1 k2 k3 k4)"));
        };
        let mut lens = Self { k, max_angle: PI, max_radius: 0.0 };
        let angle = |step: u32| PI * f64::from(step) / f64::from(ANGLE_STEPS);
        if let Some(step) = (1..=ANGLE_STEPS).find(|&step| lens.radius(angle(step)).1 <= 0.0) {
            let (mut grows, mut folds) = (angle(step - 1), angle(step));
            for _ in 0..60 {
                let middle = 0.5 * (grows + folds);
                if lens.radius(middle).1 > 0.0 {
                    grows = middle;
                } else {
                    folds = middle;
                }
            }
            lens.max_angle = grows;
        }
        lens.max_radius = lens.radius(lens.max_angle).0;
        Ok(lens)
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.k
    }

    /// Radius of an angle, and its derivative.
    fn radius(&self, angle: f64) -> (f64, f64) {
        let [k1, k2, k3, k4] = self.k;
        let s = angle * angle;
        let value = angle * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4))));
        let slope = 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)));
        (value, slope)
    }

    pub(super) fn distort(&self, direction: DVec3) -> Option<DVec2> {
        let across = direction.truncate().length();
        let angle = across.atan2(direction.z);
        if angle.is_nan() || angle >= self.max_angle || direction == DVec3::ZERO {
            return None;
        }
        if across == 0.0 {
            return Some(DVec2::ZERO);
        }
        Some(direction.truncate() * (self.radius(angle).0 / across))
    }

    pub(super) fn undistort(&self, image: DVec2) -> Option<DVec3> {
        let radius = image.length();
        if radius.is_nan() || radius >= self.max_radius {
            return None;
        }
        if radius == 0.0 {
            return Some(DVec3::Z);
        }
        // Newton's method within an interval that contains the only root, because the radius increases with the angle.
        let (mut low, mut high) = (0.0, self.max_angle);
        let mut angle = radius.min(0.5 * (low + high));
        for _ in 0..100 {
            let (value, slope) = self.radius(angle);
            if value < radius {
                low = angle;
            } else {
                high = angle;
            }
            let mut next = angle - (value - radius) / slope;
            if !(next >= low && next <= high) {
                next = 0.5 * (low + high);
            }
            let step = (next - angle).abs();
            angle = next;
            if step <= f64::EPSILON * angle {
                break;
            }
        }
        Some((image * (angle.sin() / radius)).extend(angle.cos()))
    }
}
