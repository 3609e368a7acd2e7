//! Cones of directions: the set that a sphere or the sun's disk subtends.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::lobes::shading_frame::sincos_turns;

/// All directions within an angle of an axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DirectionCone {
    /// Unit direction of the cone's axis.
    pub axis: DVec3,
    /// 1 - cos of the half angle; this form keeps precision for narrow cones.
    pub one_minus_cos: f64,
}

impl DirectionCone {
    /// Returns the cone with this squared sine of the half angle; the angle is at most 90 degrees.
    pub fn new(axis: DVec3, sin2: f64) -> Self {
        Self { axis, one_minus_cos: sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt()) }
    }

    /// Samples a direction uniformly (P. Shirley, C. Wang and K. Zimmerman, "Monte Carlo techniques for direct
    /// lighting calculations", 1996).
    pub fn sample(&self, [x, y]: [f32; 2]) -> DVec3 {
        let cap = f64::from(x) * self.one_minus_cos;
        let (sin, cos) = ((cap * (2.0 - cap)).sqrt(), 1.0 - cap);
        let (right, up) = self.axis.any_orthonormal_pair();
        let (turn_sin, turn_cos) = sincos_turns(y);
        let around = right * f64::from(turn_cos) + up * f64::from(turn_sin);
        self.axis * cos + around * sin
    }

    /// True if a unit direction lies in the cone.
    pub fn contains(&self, direction: DVec3) -> bool {
        // 1 - cos = |a - b|^2 / 2, without cancellation.
        (direction - self.axis).length_squared() <= 2.0 * self.one_minus_cos
    }

    /// Solid angle in steradians.
    pub fn solid_angle(&self) -> f64 {
        TAU * self.one_minus_cos
    }
}
