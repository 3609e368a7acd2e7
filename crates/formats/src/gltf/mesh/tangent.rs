//! Tangents for files without them (glTF 2.0, section 3.7.2.1): MikkTSpace (Mikkelsen, "Simulation of Wrinkled Surfaces
//! Revisited", 2008), by `bevy_mikktspace`.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace};
use glam::Vec3;
use raycam_scene::Mesh;

/// Mesh to whose corners tangents are added.
struct Corners<'a> {
    mesh: &'a Mesh,
    /// Vertices in single precision, because each vertex is read many times.
    points: Vec<Vec3>,
    uvs: &'a [[f32; 2]],
    tangents: Vec<[f32; 4]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }

    fn point(&self, face: usize, corner: usize) -> Vec3 {
        self.points[self.vertex(face, corner)]
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.point(face, corner).to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        match &self.mesh.normals {
            Some(normals) => normals[self.vertex(face, corner)],
            None => {
                let [a, b, c] = [0, 1, 2].map(|corner| self.point(face, corner));
                (b - a).cross(c - a).normalize_or_zero().to_array()
            }
        }
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // In MikkTSpace, v increases upwards; in glTF, v increases downwards.
        let [u, v] = self.uvs[self.vertex(face, corner)];
        [u, -v]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(tangent) = tangent {
            self.tangents[3 * face + corner] = tangent.tangent_encoded();
        }
    }
}

/// Adds tangents along one of the mesh's sets of texture coordinates. Vertices whose corners have different tangents
/// are split; returns the source vertex of each vertex.
pub(crate) fn generate(mesh: &mut Mesh, set: usize) -> Vec<u32> {
    let unchanged = || (0..mesh.vertices.len() as u32).collect();
    let Some(uvs) = mesh.uv_set(set) else { return unchanged() };
    let points = mesh.vertices.iter().map(|point| point.as_vec3()).collect();
    let mut corners = Corners { tangents: vec![[1.0, 0.0, 0.0, 1.0]; 3 * mesh.triangles.len()], points, uvs, mesh };
    // The library's error type has no variants yet; if an error is added, the mesh stays unchanged.
    if bevy_mikktspace::generate_tangents(&mut corners).is_err() {
        return unchanged();
    }
    let tangents = corners.tangents;
    let mut sources: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    let mut own: Vec<Option<[f32; 4]>> = vec![None; mesh.vertices.len()];
    let mut split: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    for (corner, &tangent) in mesh.triangles.as_flattened_mut().iter_mut().zip(&tangents) {
        match own[*corner as usize] {
            None => own[*corner as usize] = Some(tangent),
            Some(first) if first == tangent => {}
            Some(_) => {
                let vertex = *corner;
                *corner = *split.entry((vertex, tangent.map(f32::to_bits))).or_insert_with(|| {
                    sources.push(vertex);
                    own.push(Some(tangent));
                    sources.len() as u32 - 1
                });
            }
        }
    }
    resample(&mut mesh.vertices, &sources);
    for uvs in mesh.uvs.iter_mut().chain(&mut mesh.more_uvs) {
        resample(uvs, &sources);
    }
    mesh.normals.iter_mut().for_each(|all| resample(all, &sources));
    mesh.vertex_colors.iter_mut().for_each(|all| resample(all, &sources));
    mesh.vertex_opacities.iter_mut().for_each(|all| resample(all, &sources));
    let unused = [1.0, 0.0, 0.0, 1.0];
    mesh.tangents = Some(own.into_iter().map(|t| t.unwrap_or(unused)).collect());
    sources
}

/// Appends, for each new vertex, the value of its source vertex.
pub(crate) fn resample<T: Copy>(values: &mut Vec<T>, sources: &[u32]) {
    let before = values.len();
    for &source in sources.iter().skip(before) {
        values.push(values[source as usize]);
    }
}
