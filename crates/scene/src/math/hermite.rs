//! Cubic Hermite segments of locations and rotations.

use glam::{DQuat, DVec3};

/// A value whose differences (steps) are vectors: for a location, displacements; for a rotation, rotation vectors in
/// its own axes.
pub trait Interpolate: Copy {
    /// Step from this value to another; for rotations, along the shorter arc.
    fn delta_to(self, there: Self) -> DVec3;
    /// Value after a step.
    fn offset_by(self, step: DVec3) -> Self;
}

/// Point at the fraction `s` of the curve from one value to another. `velocities` are the velocities at both ends, as
/// steps per whole segment. A cubic Bézier curve in cumulative form has the same formula for vectors and for rotations
/// (Kim, Kim and Shin, "A general construction scheme for unit quaternion curves", SIGGRAPH 1995).
pub fn hermite<T: Interpolate>(from: T, to: T, velocities: [DVec3; 2], s: f64) -> T {
    let [first, last] = velocities.map(|velocity| velocity / 3.0);
    let middle = from.offset_by(first).delta_to(to.offset_by(-last));
    from.offset_by(first * (1.0 - (1.0 - s).powi(3)))
        .offset_by(middle * (s * s * (3.0 - 2.0 * s)))
        .offset_by(last * s.powi(3))
}

impl Interpolate for DVec3 {
    fn delta_to(self, there: Self) -> DVec3 {
        there - self
    }

    fn offset_by(self, step: DVec3) -> Self {
        self + step
    }
}

impl Interpolate for DQuat {
    fn delta_to(self, there: Self) -> DVec3 {
        let turn = self.conjugate() * there;
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let sine = turn.xyz().length();
        if sine == 0.0 { DVec3::ZERO } else { turn.xyz() * (2.0 * sine.atan2(turn.w) / sine) }
    }

    fn offset_by(self, step: DVec3) -> Self {
        (self * DQuat::from_scaled_axis(step)).normalize()
    }
}
