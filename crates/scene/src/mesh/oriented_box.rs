//! Boxes around objects, turned as the objects are.

use glam::{DAffine3, DMat3, DVec3};

use crate::world::World;

/// A box in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// world_from_box: a rotation whose columns are the box's axes.
    pub rotation: DMat3,
    /// Its middle in the world.
    pub center: DVec3,
    /// Its full edges along its axes, in metres.
    pub size: DVec3,
}

impl World {
    /// The smallest box around an object whose edges run along the axes of its mesh; of a sheared object, along those of
    /// the rotation nearest to its transform (the orthogonal factor of the polar decomposition: N. J. Higham, "Computing
    /// the Polar Decomposition", 1986), less any mirroring. `None` for an object there is not.
    pub fn oriented_box(&self, object: usize) -> Option<OrientedBox> {
        let object = self.objects.get(object)?;
        let rotation = nearest_rotation(object.world_from_mesh.matrix3);
        let box_from_mesh = DAffine3::from_mat3(rotation.transpose()) * object.world_from_mesh;
        let (low, high) = self.meshes[object.mesh].bounds_in(box_from_mesh)?;
        Some(OrientedBox {
            rotation,
            center: rotation * (low + (high - low) / 2.0),
            size: high - low,
        })
    }
}

/// Newton's iteration for the orthogonal polar factor; the negative of one that mirrors.
fn nearest_rotation(linear: DMat3) -> DMat3 {
    const STEPS: usize = 100;
    let largest = linear
        .to_cols_array()
        .iter()
        .fold(0.0f64, |m, v| m.max(v.abs()));
    let mut factor = linear * (1.0 / largest);
    for _ in 0..STEPS {
        let next = (factor + factor.inverse().transpose()) * 0.5;
        let change = (next - factor)
            .to_cols_array()
            .iter()
            .fold(0.0f64, |m, v| m.max(v.abs()));
        factor = next;
        if change < 1e-15 {
            break;
        }
    }
    if factor.determinant() < 0.0 {
        factor * -1.0
    } else {
        factor
    }
}
