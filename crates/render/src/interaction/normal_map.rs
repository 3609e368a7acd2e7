//! Tangents and normal maps (glTF 2.0, 3.7.2.1 and 3.9.3).

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;
use raycam_scene::NormalMap;

use crate::interaction::ray_cone::Footprint;
use crate::prepare::geometry::Geometry;

impl Geometry {
    /// World-space directions of increasing u and v at a hit: the mesh's tangents or, without them, tangents computed
    /// from a set of texture coordinates; `None` if the mesh has neither.
    pub(crate) fn tangents(&self, hit: &Hit, uv_set: usize) -> Option<[Vec3; 2]> {
        let object = &self.instances[hit.instance as usize];
        let mesh = &*object.mesh.mesh;
        let corners = mesh.triangles[hit.triangle as usize].map(|i| i as usize);
        let linear = object.world_from_mesh.matrix3;
        let unit = |v: DVec3| (linear * v).try_normalize().map(|v| v.as_vec3());
        if let (Some(tangents), Some(normals), 0) = (&mesh.tangents, &mesh.normals, uv_set) {
            let (u, v) = (hit.u, hit.v);
            let weights = [1.0 - u - v, u, v];
            let (mut tangent, mut normal) = (Vec3::ZERO, Vec3::ZERO);
            for (&corner, weight) in corners.iter().zip(weights) {
                tangent += Vec3::from_slice(&tangents[corner]) * weight;
                normal += Vec3::from(normals[corner]) * weight;
            }
            let bitangent = normal.cross(tangent) * tangents[corners[0]][3];
            return Some([unit(tangent.as_dvec3())?, unit(bitangent.as_dvec3())?]);
        }
        let uvs = mesh.uv_set(uv_set)?;
        let [a, b, c] = corners.map(|i| mesh.vertices[i]);
        let [p, q, r] = corners.map(|i| uvs[i].map(f64::from));
        let [[u1, v1], [u2, v2]] = [q, r].map(|x| [x[0] - p[0], x[1] - p[1]]);
        // In an image, v increases downwards, but the second axis of tangent space points upwards.
        let turned = (u1 * v2 - u2 * v1).signum();
        let tangent = ((b - a) * v2 - (c - a) * v1) * turned;
        let down = ((c - a) * u1 - (b - a) * u2) * turned;
        Some([unit(tangent)?, unit(-down)?])
    }

    /// Normal of a normal map at a hit, on the side of `normal`.
    pub(crate) fn mapped_normal(
        &self,
        map: &NormalMap,
        hit: &Hit,
        footprint: &Footprint,
        normal: Vec3,
        front: bool,
    ) -> Option<Vec3> {
        let [red, green, blue, _] = self.filtered_texel(&map.texture, hit, footprint)?;
        let [tangent, bitangent] = self.tangents(hit, map.texture.uv_set)?;
        let side = if front { 1.0 } else { -1.0 };
        let [x, y, z] = [red, green, blue].map(|v| 2.0 * v - 1.0);
        let bent = (tangent * x + bitangent * y) * (map.scale * side) + normal * z.max(0.0);
        bent.try_normalize()
    }
}
