//! Ground-truth channels, evaluated at the hits of centre rays.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use raycam_bvh::{ExactHit, INVALID_ID};

use crate::ground_truth::center_rays::{CenterRays, Normals};
use crate::ground_truth::convert::{signed_id, to_f32_normal, to_float_hit};
use crate::ground_truth::triangle_cache::TriangleCache;
use crate::interaction::ray_cone::Footprint;
use crate::media::map::{MediaMap, MediumRay};
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;

/// Hits of a tile's centre rays, read channel by channel.
pub(crate) struct ChannelReader<'a> {
    exact: &'a CenterRays,
    hits: &'a [ExactHit],
    world: &'a Geometry,
    prepared: &'a PreparedWorld,
    /// World of each pixel if rows show different worlds; otherwise empty.
    pixel_worlds: &'a [Arc<PreparedWorld>],
    /// Rotation camera_from_world and, for a moving camera, the rotation of each pixel.
    shared_rotation: DMat3,
    pixel_rotations: &'a [DMat3],
}

impl<'a> ChannelReader<'a> {
    pub fn new(
        exact: &'a CenterRays,
        prepared: &'a PreparedWorld,
        seen: &'a [Arc<PreparedWorld>],
        still: DMat3,
        turned: &'a [DMat3],
    ) -> Self {
        Self {
            exact,
            hits: exact.ground_truth_hits(),
            world: &prepared.geometry,
            prepared,
            pixel_worlds: seen,
            shared_rotation: still,
            pixel_rotations: turned,
        }
    }

    /// Hit of a pixel; `None` if its ray missed.
    #[inline]
    fn hit(&self, i: usize) -> Option<&ExactHit> {
        Some(&self.hits[i]).filter(|hit| hit.instance != INVALID_ID)
    }

    #[inline]
    fn geometry(&self, i: usize) -> &Geometry {
        self.pixel_worlds.get(i).map_or(self.world, |world| &world.geometry)
    }

    #[inline]
    fn rotation(&self, i: usize) -> &DMat3 {
        self.pixel_rotations.get(i).unwrap_or(&self.shared_rotation)
    }

    pub fn albedo(&self, i: usize) -> [f32; 3] {
        self.hit(i).map_or([0.0; 3], |hit| {
            let color = self.geometry(i).base_color(&to_float_hit(hit), &Footprint::default());
            color.to_array()
        })
    }

    #[inline]
    pub fn depth(&self, i: usize) -> f32 {
        self.hit(i).map_or(f32::INFINITY, |hit| {
            let direction = DVec3::from(self.exact.rays[i].direction);
            (hit.t * direction.dot(self.rotation(i).row(2))) as f32
        })
    }

    #[inline]
    pub fn distance(&self, i: usize) -> f32 {
        self.hit(i).map_or(f32::INFINITY, |hit| hit.t as f32)
    }

    #[inline]
    pub fn position(&self, i: usize) -> [f64; 3] {
        let ray = &self.exact.rays[i];
        let at = |hit: &ExactHit| DVec3::from(ray.origin) + hit.t * DVec3::from(ray.direction);
        self.hit(i).map_or(DVec3::NAN, at).to_array()
    }

    /// Normal at pixel `i` in world coordinates; `normal` selects the geometric or the shading normal.
    #[inline]
    pub fn normal(&self, i: usize, normal: impl Fn(&Normals) -> DVec3) -> [f32; 3] {
        to_f32_normal(normal(self.exact.normals(i)))
    }

    /// Normal at pixel `i` in camera axes; `normal` selects the geometric or the shading normal.
    #[inline]
    pub fn in_camera(&self, i: usize, normal: impl Fn(&Normals) -> DVec3) -> [f32; 3] {
        to_f32_normal(*self.rotation(i) * normal(self.exact.normals(i)))
    }

    /// Fraction of light that fog and other media let pass between the camera and the surface at pixel `i`.
    #[inline]
    pub fn transmittance(&self, i: usize) -> [f32; 3] {
        let geometry = self.geometry(i);
        let Some(media) = MediaMap::new(geometry) else {
            return [1.0; 3];
        };
        let ray = &self.exact.rays[i];
        let origin = DVec3::from(ray.origin) - geometry.origin;
        let end = self.hit(i).map_or(f64::INFINITY, |hit| hit.t);
        let through = MediumRay { origin, direction: ray.direction.into(), begin: 0.0, end, is_camera_ray: true };
        media.transmittance(geometry.interior_at(origin), &through, &media.borders(&through)).to_array()
    }

    /// World that pixel `i` shows.
    fn prepared_world(&self, i: usize) -> &PreparedWorld {
        self.pixel_worlds.get(i).map_or(self.prepared, |world| world)
    }

    /// Image coordinates in the world's first projector, if it illuminates the surface at pixel `i` directly; otherwise
    /// NaN.
    pub fn projector_uv(&self, i: usize) -> [f32; 2] {
        let pixel = || {
            let (hit, ray, world) = (self.hit(i)?, &self.exact.rays[i], self.prepared_world(i));
            let (geometry, lights) = (&world.geometry, &world.lighting().lights);
            let projector = lights.projector()?;
            let point = DVec3::from(ray.origin) + hit.t * DVec3::from(ray.direction) - geometry.origin;
            let pixel = projector.pixel_of(point)?;
            geometry.is_lit_from(ray, hit, projector.position()).then_some(pixel)
        };
        pixel().map_or([f32::NAN; 2], |pixel| pixel.as_vec2().to_array())
    }

    pub fn roughness(&self, i: usize) -> f32 {
        self.hit(i).map_or(0.0, |hit| self.geometry(i).roughness(&to_float_hit(hit)))
    }

    pub fn metallic(&self, i: usize) -> f32 {
        self.hit(i).map_or(0.0, |hit| self.geometry(i).metallic(&to_float_hit(hit)))
    }

    /// Normalised object coordinates of the surface point at pixel `i`; NaN for the background.
    pub fn nocs(&self, i: usize) -> [f32; 3] {
        let Some(hit) = self.hit(i) else {
            return [f32::NAN; 3];
        };
        let instance = &self.geometry(i).instances[hit.instance as usize];
        let mesh = &instance.mesh.mesh;
        let [a, b, c] = mesh.triangles[hit.triangle as usize].map(|vertex| mesh.vertices[vertex as usize]);
        let point = a + (b - a) * hit.u + (c - a) * hit.v;
        instance.normalized_coordinates(point).as_vec3().to_array()
    }

    /// Index of the object at pixel `i`; -1 for the background.
    #[inline]
    pub fn instance(&self, i: usize) -> i32 {
        signed_id(self.hits[i].instance)
    }

    #[inline]
    pub fn triangle(&self, i: usize) -> i32 {
        signed_id(self.hits[i].triangle)
    }

    #[inline]
    pub fn barycentric(&self, i: usize) -> [f32; 3] {
        self.hit(i).map_or([0.0; 3], |&ExactHit { u, v, .. }| [1.0 - u - v, u, v].map(|weight| weight as f32))
    }

    #[inline]
    pub fn uv(&self, i: usize, corners: &mut TriangleCache<Option<[[f64; 2]; 3]>>) -> [f32; 2] {
        let Some(hit) = self.hit(i) else {
            return [f32::NAN; 2];
        };
        let find = || self.geometry(i).uv_corners(hit.instance, hit.triangle, 0);
        let corners = corners.get_or_insert(hit, find).as_ref();
        corners.map_or([f32::NAN; 2], |corners| Geometry::interpolate_uv(corners, [hit.u, hit.v]))
    }

    #[inline]
    pub fn category(&self, i: usize) -> i32 {
        self.hit(i).map_or(-1, |hit| self.geometry(i).instances[hit.instance as usize].category)
    }

    #[inline]
    pub fn material(&self, i: usize) -> i32 {
        let index = |hit: &ExactHit| self.geometry(i).material_index(hit.instance, hit.triangle);
        let index = self.hit(i).map(index);
        index.map_or(-1, |index| i32::try_from(index).unwrap_or(-1))
    }
}
