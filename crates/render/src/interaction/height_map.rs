//! Height maps: shading normals bent by the slopes of a texture.

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;
use raycam_scene::{HeightMap, HeightUnit};

use crate::interaction::ray_cone::Footprint;
use crate::prepare::geometry::Geometry;

impl Geometry {
    /// Bends a normal by the slopes of a height map. `bent` is the normal at a hit, or the normal of a normal map;
    /// `normal` is the shading normal without maps. Both are on the viewer's side. `None` if the mesh lacks the texture
    /// coordinates.
    ///
    /// J. Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978: the normal of the surface p + h n is the
    /// cross product of its derivatives p_u + h_u n and p_v + h_v n, without the terms in h itself, which are
    /// small for flat relief. The tangents p_u and p_v are the triangle's, projected onto the plane
    /// perpendicular to the shading normal. With the gradient g of the height in the triangle's plane and the
    /// triangle's normal m, this product is
    ///
    /// (n.m) n - ((n.m) g - (n.g) m).
    pub(crate) fn bumped_normal(
        &self,
        map: &HeightMap,
        hit: &Hit,
        footprint: &Footprint,
        [normal, bent]: [Vec3; 2],
        front: bool,
    ) -> Option<Vec3> {
        let (gradient, cross) = self.height_gradient(map, hit, footprint)?;
        let geometric = cross.normalize().as_vec3();
        let cosine = normal.dot(geometric);
        // The slope is multiplied by the sign of the cosine, because the triangle's normal may be on either side.
        let side = if front { cosine.signum() } else { -cosine.signum() };
        let gradient = gradient.as_vec3();
        let slope = gradient * cosine - geometric * normal.dot(gradient);
        (bent * cosine.abs() - slope * side).try_normalize()
    }

    /// World-space gradient of a height map on the hit triangle, and the cross product of the triangle's edges.
    fn height_gradient(&self, map: &HeightMap, hit: &Hit, footprint: &Footprint) -> Option<(DVec3, DVec3)> {
        let [by_u, by_v] = self.texel_gradient(&map.texture, hit, footprint)?.map(f64::from);
        let [p, q, r] = self.uv_corners(hit.instance, hit.triangle, map.texture.uv_set)?;
        let [[a, b, _], [c, d, _]] = map.texture.image_from_mesh.map(|row| row.map(f64::from));
        // Converts an edge from texture coordinates of the mesh to image coordinates.
        let in_image = |[x, y]: [f64; 2]| [a * x + b * y, c * x + d * y];
        let [[u1, v1], [u2, v2]] = [q, r].map(|end| in_image([end[0] - p[0], end[1] - p[1]]));
        let corners = self.corners(hit.instance, hit.triangle);
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let cross = e1.cross(e2);
        let gradient = match map.unit {
            HeightUnit::Metre => {
                let [first, second] = [[u1, v1], [u2, v2]].map(|[u, v]| by_u * u + by_v * v);
                (e2.cross(cross) * first + cross.cross(e1) * second) / cross.length_squared()
            }
            HeightUnit::Texel => {
                let [columns, rows] = self.textures[map.texture.texture].size().map(f64::from);
                let turned = (u1 * v2 - u2 * v1).signum();
                let right = ((e1 * v2 - e2 * v1) * turned).normalize();
                let down = ((e2 * u1 - e1 * u2) * turned).normalize();
                right * (by_u / columns) + down * (by_v / rows)
            }
        };
        let gradient = gradient * f64::from(map.scale);
        gradient.is_finite().then_some((gradient, cross))
    }
}
