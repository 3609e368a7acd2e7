//! Conversion of vectors and transforms between the scene and rapier, which use different versions of glam.

use glam::{DAffine3, DMat3, DVec3};
use rapier3d_f64::math::{Pose, Vector};

/// Converts a vector to rapier's type.
pub(crate) fn vector(v: DVec3) -> Vector {
    Vector::from_array(v.to_array())
}

/// Converts a vector to the scene's type.
pub(crate) fn from_vector(v: Vector) -> DVec3 {
    DVec3::from_array(v.to_array())
}

/// Converts a pose to a transform of the scene.
pub(crate) fn affine(pose: &Pose) -> DAffine3 {
    let columns = [Vector::X, Vector::Y, Vector::Z].map(|axis| from_vector(pose.rotation * axis));
    DAffine3::from_mat3_translation(DMat3::from_cols(columns[0], columns[1], columns[2]), from_vector(pose.translation))
}
