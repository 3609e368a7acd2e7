//! OpenCV's main model: radial distortion as a polynomial or a ratio of two (Brown, "Close-range camera calibration",
//! 1971), tangential distortion, thin prism, tilted sensor. Formulas: OpenCV's documentation of `calib3d`.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DMat2, DMat3, DVec2, DVec3};

use crate::error::SceneError;

/// Steps of the angle from the axis in which the radius where the model folds over is looked for.
const STEPS: u32 = 2048;
/// Directions around the axis in which it is looked for where the distortion is not the same in all of them.
const DIRECTIONS: u32 = 32;
/// What an inverse may be off, in focal lengths, relative to 1 + its distance from the axis.
const TOLERANCE: f64 = 1e-13;

/// The coefficients `k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [τx τy]]]]`.
///
/// The model is used on a disc around the principal axis: the largest one, less than 90 degrees from the axis, on which
/// the symmetric part of the Jacobian of the distortion (before the tilt, which is a homography) is positive definite.
/// A map with this property on a convex set is one-to-one there; for radial distortion the disc ends exactly where the
/// distorted radius stops growing.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenCv {
    given: Vec<f64>,
    /// k1 to k3, and k4 to k6.
    numerator: [f64; 3],
    denominator: [f64; 3],
    tangential: [f64; 2],
    prism: [f64; 4],
    /// The homography of the tilted sensor, and its inverse.
    tilt: Option<[DMat3; 2]>,
    /// The radius of the disc; not reached.
    radius: f64,
    /// No image of the disc, before the tilt, is farther from the axis.
    reach: f64,
}

impl OpenCv {
    pub(super) fn new(given: &[f64]) -> Result<Self, SceneError> {
        if ![4, 5, 8, 12, 14].contains(&given.len()) {
            return Err(SceneError::Camera(format!(
                "distortion {given:?} has {} coefficients: the OpenCV model has 4 (k1 k2 p1 p2), 5 (and k3), 8 (and \
                 k4 k5 k6), 12 (and s1 s2 s3 s4) or 14 (and tau_x tau_y)",
                given.len()
            )));
        }
        let mut all = [0.0; 14];
        all[..given.len()].copy_from_slice(given);
        let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y] = all;
        if tau_x.abs() >= FRAC_PI_2 || tau_y.abs() >= FRAC_PI_2 {
            return Err(SceneError::Camera(format!(
                "distortion {given:?} tilts the sensor by {tau_x} and {tau_y}: expected radians within ±π/2"
            )));
        }
        let tilt = (tau_x != 0.0 || tau_y != 0.0).then(|| {
            let tilt = tilt(tau_x, tau_y);
            [tilt, tilt.inverse()]
        });
        let mut lens = Self {
            given: given.to_vec(),
            numerator: [k1, k2, k3],
            denominator: [k4, k5, k6],
            tangential: [p1, p2],
            prism: [s1, s2, s3, s4],
            tilt,
            radius: (FRAC_PI_2 * f64::from(STEPS - 1) / f64::from(STEPS)).tan(),
            reach: 0.0,
        };
        let round = lens.tangential == [0.0; 2] && lens.prism == [0.0; 4];
        let directions = if round { 1 } else { DIRECTIONS };
        let around = |i| DVec2::from_angle(TAU * f64::from(i) / f64::from(directions));
        for i in 0..directions {
            lens.radius = lens.first_fold(around(i));
        }
        // One per cent more for what lies between the directions.
        lens.reach = (0..directions).fold(0.0, |reach: f64, i| {
            reach.max(1.01 * lens.bend(lens.radius * around(i)).0.length())
        });
        Ok(lens)
    }

    pub(super) fn coefficients(&self) -> &[f64] {
        &self.given
    }

    /// The first radius in a direction where the model folds over, or the radius of the disc so far.
    fn first_fold(&self, direction: DVec2) -> f64 {
        let radius = |step: u32| (0.5 * PI * f64::from(step) / f64::from(STEPS)).tan();
        let folds = |radius: f64| self.regular(radius * direction).is_none();
        let within = (1..STEPS).take_while(|&step| radius(step) < self.radius);
        let Some(step) = within.into_iter().find(|&step| folds(radius(step))) else {
            return self.radius;
        };
        let (mut grows, mut turned) = (radius(step - 1), radius(step));
        for _ in 0..60 {
            let middle = 0.5 * (grows + turned);
            if folds(middle) {
                turned = middle;
            } else {
                grows = middle;
            }
        }
        grows
    }

    /// The image of a point of the undistorted plane before the tilt, its Jacobian, and the radial denominator.
    fn bend(&self, at: DVec2) -> (DVec2, DMat2, f64) {
        let (x, y, s) = (at.x, at.y, at.length_squared());
        let value = |[a, b, c]: [f64; 3]| 1.0 + s * (a + s * (b + s * c));
        let slope = |[a, b, c]: [f64; 3]| a + s * (2.0 * b + s * 3.0 * c);
        let ([p1, p2], [s1, s2, s3, s4]) = (self.tangential, self.prism);
        let below = value(self.denominator);
        let g = value(self.numerator) / below;
        let dg = 2.0 * (slope(self.numerator) - g * slope(self.denominator)) / below;
        let image = DVec2::new(
            x * g + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x) + s * (s1 + s * s2),
            y * g + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y + s * (s3 + s * s4),
        );
        let (prism_x, prism_y) = (2.0 * (s1 + 2.0 * s * s2), 2.0 * (s3 + 2.0 * s * s4));
        let mixed = x * y * dg + 2.0 * (p1 * x + p2 * y);
        let jacobian = DMat2::from_cols(
            DVec2::new(
                g + x * x * dg + 2.0 * p1 * y + (6.0 * p2 + prism_x) * x,
                mixed + prism_y * x,
            ),
            DVec2::new(
                mixed + prism_x * y,
                g + y * y * dg + (6.0 * p1 + prism_y) * y + 2.0 * p2 * x,
            ),
        );
        (image, jacobian, below)
    }

    /// The same within the disc, where the model is one-to-one.
    fn regular(&self, at: DVec2) -> Option<(DVec2, DMat2)> {
        let inside = at.length() < self.radius;
        if !inside {
            return None;
        }
        let (image, jacobian, below) = self.bend(at);
        let (a, d) = (jacobian.x_axis.x, jacobian.y_axis.y);
        let b = 0.5 * (jacobian.x_axis.y + jacobian.y_axis.x);
        (below > 0.0 && a > 0.0 && a * d > b * b).then_some((image, jacobian))
    }

    pub(super) fn distort(&self, direction: DVec3) -> Option<DVec2> {
        if direction.z.is_nan() || direction.z <= 0.0 {
            return None;
        }
        let (image, _) = self.regular(direction.truncate() / direction.z)?;
        match self.tilt {
            None => Some(image),
            Some([tilt, _]) => dehomogenize(tilt * image.extend(1.0)),
        }
    }

    pub(super) fn undistort(&self, image: DVec2) -> Option<DVec3> {
        let target = match self.tilt {
            None => image,
            Some([_, inverse]) => dehomogenize(inverse * image.extend(1.0))?,
        };
        let distance = target.length();
        if distance.is_nan() || distance > self.reach {
            return None;
        }
        // Newton's method, with steps shortened until they stay in the disc and come nearer.
        let scale = 1.0 + distance;
        let mut at = target * (0.9 * self.radius / distance).min(1.0);
        if distance == 0.0 {
            at = DVec2::ZERO;
        }
        let (mut found, mut jacobian) = self.regular(at)?;
        for _ in 0..100 {
            let off = (found - target).length();
            if off <= 0.5 * f64::EPSILON * scale {
                break;
            }
            let mut step = jacobian.inverse() * (found - target);
            let halvings = if off <= TOLERANCE * scale { 1 } else { 30 };
            let next = (0..halvings).find_map(|_| {
                let there = at - step;
                step *= 0.5;
                let (found, jacobian) = self.regular(there)?;
                ((found - target).length() < off).then_some((there, found, jacobian))
            });
            let Some(next) = next else { break };
            (at, found, jacobian) = next;
        }
        ((found - target).length() <= TOLERANCE * scale).then(|| at.extend(1.0))
    }
}

/// The homography from a sensor at right angles to the axis to one tilted about x and y.
fn tilt(tau_x: f64, tau_y: f64) -> DMat3 {
    let r = DMat3::from_rotation_y(-tau_y) * DMat3::from_rotation_x(-tau_x);
    let (across_x, across_y, along) = (r.z_axis.x, r.z_axis.y, r.z_axis.z);
    let projection = DMat3::from_cols(
        DVec3::new(along, 0.0, 0.0),
        DVec3::new(0.0, along, 0.0),
        DVec3::new(-across_x, -across_y, 1.0),
    );
    projection * r
}

/// The point of homogeneous coordinates in front of the plane at infinity.
fn dehomogenize(x: DVec3) -> Option<DVec2> {
    (x.z > 0.0).then(|| x.truncate() / x.z)
}
