//! Oriented bounding boxes of placed meshes.

use glam::{DAffine3, DMat3, DVec3};

use crate::mesh::Mesh;

/// An oriented box in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// world_from_box: a rotation whose columns are the box's axes.
    pub rotation: DMat3,
    /// The box's centre in the world.
    pub center: DVec3,
    /// The box's full edge lengths along its axes, in metres.
    pub size: DVec3,
}

impl OrientedBox {
    /// Returns the smallest box around a mesh placed by an affine transform, with edges along the mesh's axes. For a
    /// sheared mesh, the edges are along the axes of the rotation nearest to the transform (the orthogonal factor of
    /// the polar decomposition: N. J. Higham, "Computing the Polar Decomposition", 1986), without any mirroring. `None`
    /// without triangles.
    pub fn around(mesh: &Mesh, world_from_mesh: DAffine3) -> Option<Self> {
        let rotation = nearest_rotation(world_from_mesh.matrix3);
        let box_from_mesh = DAffine3::from_mat3(rotation.transpose()) * world_from_mesh;
        let (low, high) = mesh.bounds_in(box_from_mesh)?;
        Some(Self { rotation, center: rotation * (low + (high - low) / 2.0), size: high - low })
    }
}

/// Newton's iteration for the orthogonal polar factor; negated if the factor mirrors.
fn nearest_rotation(linear: DMat3) -> DMat3 {
    const MAX_ITERATIONS: usize = 100;
    let largest = linear.to_cols_array().iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut factor = linear * (1.0 / largest);
    for _ in 0..MAX_ITERATIONS {
        let next = (factor + factor.inverse().transpose()) * 0.5;
        let change = (next - factor).to_cols_array().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        factor = next;
        if change < 1e-15 {
            break;
        }
    }
    if factor.determinant() < 0.0 { factor * -1.0 } else { factor }
}
