//! Coefficients of a homogeneous medium.

use glam::Vec3;

/// A homogeneous medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Medium {
    /// Per metre.
    pub extinction: Vec3,
    /// Fraction of the extinguished light that is scattered.
    pub albedo: Vec3,
    /// Mean cosine of scattering angles.
    pub g: f32,
}
