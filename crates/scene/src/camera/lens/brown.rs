//! Distortion of the image plane: radial (a polynomial, or a ratio of two polynomials), tangential (Brown, "Close-range
//! camera calibration", 1971) and thin prism (Weng, Cohen and Herniou, "Camera calibration with distortion models",
//! 1992). The models differ in the plane that is distorted.

use std::f64::consts::TAU;

use glam::{DMat2, DVec2};

/// Number of radius steps in the search for the radius up to which the model is one-to-one.
const RADIUS_STEPS: u32 = 2048;
/// Number of directions around the axis that are searched if the distortion differs between directions.
const DIRECTIONS: u32 = 32;
/// Maximum error of the inverse's image point, in focal lengths, divided by 1 plus the point's distance from the
/// axis.
const TOLERANCE: f64 = 1e-13;

/// Distortion coefficients; coefficients that a model does not have are 0.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BrownTerms {
    /// Coefficients of r², r⁴, ... in the numerator of the radial factor, and in its denominator.
    pub numerator: [f64; 6],
    pub denominator: [f64; 3],
    pub tangential: [f64; 2],
    /// Thin prism coefficients of r² and r⁴ in x, then in y.
    pub prism: [f64; 4],
    /// True if tangential and prism terms act on the radially distorted point.
    pub tangential_after_radial: bool,
}

/// Distortion on a disc around the principal point. The disc is as large as possible, up to a maximum radius, such that
/// the symmetric part of the Jacobian is positive definite on it. A map with this property on a convex set is
/// one-to-one there; for radial distortion the disc ends exactly where the distorted radius stops growing.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BrownConrady {
    terms: BrownTerms,
    /// Radius of the disc; points at exactly this radius are outside the disc.
    radius: f64,
    /// Upper bound on the distance of the disc's image points from the axis.
    max_image_radius: f64,
}

impl BrownConrady {
    /// Finds the disc on which the model is used, up to the maximum radius `radius(1)`. `radius` is an increasing
    /// function with `radius(0)` = 0.
    pub fn new(terms: BrownTerms, radius: impl Fn(f64) -> f64) -> Self {
        let round = terms.tangential == [0.0; 2] && terms.prism == [0.0; 4];
        let directions = if round { 1 } else { DIRECTIONS };
        let mut lens = Self { terms, radius: radius(1.0), max_image_radius: 0.0 };
        let around = |i| DVec2::from_angle(TAU * f64::from(i) / f64::from(directions));
        for i in 0..directions {
            lens.radius = lens.first_fold_radius(around(i), &radius);
        }
        // The factor 1.01 covers the angles between the searched directions.
        lens.max_image_radius = (0..directions)
            .fold(0.0, |reach: f64, i| reach.max(1.01 * lens.distort_plane(lens.radius * around(i)).0.length()));
        lens
    }

    /// The radius in a direction beyond which the model is no longer one-to-one; at most the disc's radius found so
    /// far.
    fn first_fold_radius(&self, direction: DVec2, radius: impl Fn(f64) -> f64) -> f64 {
        let radius = |step: u32| radius(f64::from(step) / f64::from(RADIUS_STEPS));
        let folds = |radius: f64| self.regular(radius * direction).is_none();
        let within = (1..RADIUS_STEPS).take_while(|&step| radius(step) < self.radius);
        let Some(step) = within.into_iter().find(|&step| folds(radius(step))) else { return self.radius };
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

    /// Image of a point, its Jacobian, and the denominator of the radial factor.
    #[inline(always)]
    fn distort_plane(&self, at: DVec2) -> (DVec2, DMat2, f64) {
        let (radial, radial_jacobian, below) = self.radial(at);
        if self.terms.tangential_after_radial {
            let (moved, jacobian) = self.tangential_and_prism(radial);
            let image = radial + moved;
            return (image, (DMat2::IDENTITY + jacobian) * radial_jacobian, below);
        }
        let (moved, jacobian) = self.tangential_and_prism(at);
        (radial + moved, radial_jacobian + jacobian, below)
    }

    /// Point scaled by the radial factor, with the Jacobian of this scaling.
    #[inline(always)]
    fn radial(&self, at: DVec2) -> (DVec2, DMat2, f64) {
        let (x, y, s) = (at.x, at.y, at.length_squared());
        let (above, above_slope) = polynomial(self.terms.numerator, s);
        let (below, below_slope) = polynomial(self.terms.denominator, s);
        let inverse = 1.0 / below;
        let g = above * inverse;
        let dg = 2.0 * (above_slope - g * below_slope) * inverse;
        let mixed = x * y * dg;
        let jacobian = DMat2::from_cols(DVec2::new(g + x * x * dg, mixed), DVec2::new(mixed, g + y * y * dg));
        (at * g, jacobian, below)
    }

    /// Displacement by the tangential and prism terms, with its Jacobian.
    #[inline(always)]
    fn tangential_and_prism(&self, at: DVec2) -> (DVec2, DMat2) {
        let (x, y, s) = (at.x, at.y, at.length_squared());
        let ([p1, p2], [s1, s2, s3, s4]) = (self.terms.tangential, self.terms.prism);
        let moved = DVec2::new(
            2.0 * p1 * x * y + p2 * (s + 2.0 * x * x) + s * (s1 + s * s2),
            p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y + s * (s3 + s * s4),
        );
        let (prism_x, prism_y) = (2.0 * (s1 + 2.0 * s * s2), 2.0 * (s3 + 2.0 * s * s4));
        let mixed = 2.0 * (p1 * x + p2 * y);
        let jacobian = DMat2::from_cols(
            DVec2::new(2.0 * p1 * y + (6.0 * p2 + prism_x) * x, mixed + prism_y * x),
            DVec2::new(mixed + prism_x * y, (6.0 * p1 + prism_y) * y + 2.0 * p2 * x),
        );
        (moved, jacobian)
    }

    /// Image and Jacobian of a point inside the disc, where the model is one-to-one; `None` outside.
    #[inline(always)]
    fn regular(&self, at: DVec2) -> Option<(DVec2, DMat2)> {
        let inside = at.length_squared() < self.radius * self.radius;
        if !inside {
            return None;
        }
        let (image, jacobian, below) = self.distort_plane(at);
        let (a, d) = (jacobian.x_axis.x, jacobian.y_axis.y);
        let b = 0.5 * (jacobian.x_axis.y + jacobian.y_axis.x);
        (below > 0.0 && a > 0.0 && a * d > b * b).then_some((image, jacobian))
    }

    /// Distorted image of a point of the plane; `None` outside the disc.
    pub fn distort(&self, at: DVec2) -> Option<DVec2> {
        Some(self.regular(at)?.0)
    }

    /// Point of the disc whose image is `target`; `None` if there is no such point. Newton's method starts from the
    /// guess `near`, if given; without a guess, or if that fails, a slower method is used.
    pub fn undistort(&self, target: DVec2, near: Option<DVec2>) -> Option<DVec2> {
        let distance = target.length();
        if distance.is_nan() || distance > self.max_image_radius {
            return None;
        }
        near.and_then(|near| self.newton_from(target, near)).or_else(|| self.solve_inverse(target, distance))
    }

    /// Finds the inverse with a few steps of Newton's method, from a good initial guess; `None` if the method does not
    /// converge.
    fn newton_from(&self, target: DVec2, mut at: DVec2) -> Option<DVec2> {
        for _ in 0..4 {
            let (found, jacobian) = self.regular(at)?;
            let step = jacobian.inverse() * (found - target);
            at -= step;
            // The remaining error is about the square of this step.
            if step.length_squared() <= 1e-16 {
                return (at.length_squared() < self.radius * self.radius).then_some(at);
            }
        }
        None
    }

    /// Finds the inverse without a guess: the steps of Newton's method are shortened until they stay within the disc
    /// and reduce the error.
    fn solve_inverse(&self, target: DVec2, distance: f64) -> Option<DVec2> {
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
        ((found - target).length() <= TOLERANCE * scale).then_some(at)
    }
}

/// `1 + a s + b s² + ...` and its derivative.
#[inline(always)]
fn polynomial<const N: usize>(coefficients: [f64; N], s: f64) -> (f64, f64) {
    let (mut value, mut slope) = (0.0, 0.0);
    for coefficient in coefficients.into_iter().rev() {
        slope = slope * s + value;
        value = value * s + coefficient;
    }
    (1.0 + s * value, value + s * slope)
}
