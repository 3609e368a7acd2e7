//! Surface interactions: position, normals and attributes at a hit.
//!
//! Uses only the geometry and the shading frame; BSDFs and lights are built on top.

pub(crate) mod attributes;
pub(crate) mod batch;
pub(crate) mod height_map;
pub(crate) mod normal_map;
pub(crate) mod ray_cone;
pub(crate) mod vector;

use glam::{DVec3, Vec3};
use raycam_bvh::Ray;

use crate::interaction::ray_cone::Footprint;
use crate::lobes::shading_frame::ShadingFrame;

/// Point where a ray hits a triangle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SurfaceInteraction {
    /// Scene-local position of the point.
    pub position: DVec3,
    /// Unit normal that separates reflection from transmission, on the viewer's side: the triangle's normal or, on a
    /// curved surface that only reflects, the interpolated normal. Light that reaches the smooth surface from below a
    /// triangle's plane is then limited by occluders, not by the plane.
    pub side_normal: Vec3,
    /// Interpolated unit normal, on the viewer's side.
    shading_normal: Vec3,
    /// True if the vertices are in counter-clockwise order as seen by the viewer.
    pub is_front: bool,
    /// Offsets from the point to the origins of rays that leave on the viewer's side and on the far side; they exceed
    /// all float32 errors.
    offset_front: Vec3,
    offset_back: Vec3,
    /// Footprint of the ray cone, in scenes with textures.
    pub footprint: Footprint,
}

impl SurfaceInteraction {
    /// Shading frame for a viewer whose ray arrives in this direction.
    #[inline]
    pub fn shading_frame(&self, direction: Vec3) -> ShadingFrame {
        ShadingFrame::new(self.side_normal, self.shading_normal, -direction)
    }

    /// Scene-local origin of a ray that leaves the point in this direction.
    #[inline]
    pub fn offset_ray_origin(&self, direction: Vec3) -> DVec3 {
        let below = self.side_normal.dot(direction) < 0.0;
        self.position + if below { self.offset_back } else { self.offset_front }.as_dvec3()
    }

    /// Ray that continues behind the point without being scattered.
    #[inline]
    pub fn ray_beyond(&self, direction: Vec3, t_max: f32) -> Ray {
        let origin = self.position + self.offset_back.as_dvec3();
        Ray { origin: origin.as_vec3().to_array(), direction: direction.to_array(), t_max }
    }

    /// Ray that leaves the point.
    #[inline]
    pub fn spawn_ray(&self, direction: Vec3, t_max: f32) -> Ray {
        Ray { origin: self.offset_ray_origin(direction).as_vec3().to_array(), direction: direction.to_array(), t_max }
    }
}

/// Point for which lights are sampled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSampleContext {
    /// Scene-local position of the point.
    pub position: DVec3,
    /// Unit normal towards the lit side if light arrives only on one side of a surface, otherwise zero. This normal
    /// only affects light selection; no light is lost.
    pub normal: Vec3,
}
