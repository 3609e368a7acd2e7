//! Deformed meshes: morph targets first, then joints (glTF 2.0, sections 3.7.2.2 and 3.7.3).

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::mesh::Mesh;

/// Displacements that a morph target of weight 1 adds to each vertex.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MorphTarget {
    /// Displacements of the position.
    pub vertices: Option<Vec<[f32; 3]>>,
    /// Displacements of the normal.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Displacements of the tangent.
    pub tangents: Option<Vec<[f32; 3]>>,
    /// Displacements of the first set of texture coordinates.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Displacements of the linear colour.
    pub colors: Option<Vec<[f32; 3]>>,
}

/// Up to four joints of each vertex, and their weights.
pub type JointSet = (Vec<[u16; 4]>, Vec<[f32; 4]>);

/// Mesh that morph targets or joints deform.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeformableMesh {
    /// Undeformed mesh.
    pub mesh: Arc<Mesh>,
    /// Morph targets.
    pub targets: Vec<MorphTarget>,
    /// Joints of each vertex with their weights, whose sum over all sets is 1; empty if no skin deforms the mesh.
    pub joints: Vec<JointSet>,
}

impl DeformableMesh {
    /// Returns the mesh with these morph weights, in addition deformed by `joints` if given: for each joint, the
    /// transform world_from_mesh. Triangles are unchanged.
    pub fn deform(&self, weights: &[f32], joints: Option<&[DAffine3]>) -> Mesh {
        let mut mesh = (*self.mesh).clone();
        for (target, &weight) in self.targets.iter().zip(weights) {
            if weight != 0.0 {
                target.add(&mut mesh, weight);
            }
        }
        if let Some(joints) = joints.filter(|_| !self.joints.is_empty()) {
            self.apply_skin(&mut mesh, joints);
        }
        for normal in mesh.normals.iter_mut().flatten() {
            *normal = Vec3::from_array(*normal).normalize_or_zero().to_array();
        }
        mesh
    }

    fn apply_skin(&self, mesh: &mut Mesh, joints: &[DAffine3]) {
        for vertex in 0..mesh.vertices.len() {
            let mut blend = DAffine3::from_mat3_translation(DMat3::ZERO, DVec3::ZERO);
            for (indices, weights) in &self.joints {
                for (&joint, &weight) in indices[vertex].iter().zip(&weights[vertex]) {
                    let matrix = joints.get(usize::from(joint)).filter(|_| weight != 0.0);
                    if let Some(matrix) = matrix {
                        blend.matrix3 += matrix.matrix3 * f64::from(weight);
                        blend.translation += matrix.translation * f64::from(weight);
                    }
                }
            }
            transform_vertex(mesh, vertex, blend);
        }
    }
}

/// Returns the mesh transformed by an affine map that flattens it. Such a map has no inverse, so it cannot place an
/// object. `None` if only a line or a point remains.
pub fn flattened(mesh: &Mesh, world_from_mesh: DAffine3) -> Option<Mesh> {
    let flat = cofactor_matrix(world_from_mesh.matrix3);
    if !flat.is_finite() || flat == DMat3::ZERO {
        return None;
    }
    let mut mesh = mesh.clone();
    for vertex in 0..mesh.vertices.len() {
        transform_vertex(&mut mesh, vertex, world_from_mesh);
    }
    Some(mesh)
}

/// Transforms a vertex with its normal and tangent.
fn transform_vertex(mesh: &mut Mesh, vertex: usize, by: DAffine3) {
    mesh.vertices[vertex] = by.transform_point3(mesh.vertices[vertex]);
    if let Some(normals) = &mut mesh.normals {
        normals[vertex] = transform_direction(cofactor_matrix(by.matrix3), normals[vertex]);
    }
    if let Some(tangents) = &mut mesh.tangents {
        let [x, y, z, sign] = tangents[vertex];
        let [x, y, z] = transform_direction(by.matrix3, [x, y, z]);
        tangents[vertex] = [x, y, z, sign];
    }
}

/// Cofactor matrix of a linear map, which transforms normals like the inverse transpose does; this matrix always
/// exists.
fn cofactor_matrix(linear: DMat3) -> DMat3 {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}

fn transform_direction(matrix: DMat3, vector: [f32; 3]) -> [f32; 3] {
    let turned = matrix * Vec3::from_array(vector).as_dvec3();
    turned.normalize_or_zero().as_vec3().to_array()
}

impl MorphTarget {
    fn add(&self, mesh: &mut Mesh, weight: f32) {
        for (vertex, by) in mesh.vertices.iter_mut().zip(self.vertices.iter().flatten()) {
            *vertex += Vec3::from_array(*by).as_dvec3() * f64::from(weight);
        }
        let plus = |value: &mut [f32], by: &[f32]| {
            value.iter_mut().zip(by).for_each(|(value, by)| *value += weight * by);
        };
        let normals = mesh.normals.iter_mut().flatten();
        normals.zip(self.normals.iter().flatten()).for_each(|(value, by)| plus(value, by));
        let tangents = mesh.tangents.iter_mut().flatten();
        tangents.zip(self.tangents.iter().flatten()).for_each(|(value, by)| plus(value, by));
        let uvs = mesh.uvs.iter_mut().flatten();
        uvs.zip(self.uvs.iter().flatten()).for_each(|(value, by)| plus(value, by));
        let colors = mesh.vertex_colors.iter_mut().flatten();
        colors.zip(self.colors.iter().flatten()).for_each(|(value, by)| {
            plus(value, by);
            *value = value.map(|v| v.clamp(0.0, 1.0));
        });
    }
}
