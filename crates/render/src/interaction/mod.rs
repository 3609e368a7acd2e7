//! Where rays meet triangles.

pub(crate) mod attributes;
pub(crate) mod batch;
pub(crate) mod normal_map;
pub(crate) mod ray_cone;
pub(crate) mod vector;

use glam::{DVec3, Vec3};
use raycam_bvh::Ray;

use crate::interaction::ray_cone::Footprint;
use crate::lobes::shading_frame::ShadingFrame;

/// Where a ray meets a triangle, on the side that is seen.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SurfaceInteraction {
    /// Scene-local.
    pub position: DVec3,
    /// The triangle's normal, on the viewer's side.
    pub geometric_normal: Vec3,
    /// Of the smooth surface that the triangle stands for.
    shading_normal: Vec3,
    /// Whether the viewer is where the triangle's corners run counter-clockwise.
    pub is_front: bool,
    /// How far rays that leave it start from it, on the viewer's side and on the other: beyond all float32 rounding.
    offset_front: Vec3,
    offset_back: Vec3,
    /// What the ray covers of the triangle, where there are textures.
    pub footprint: Footprint,
}

impl SurfaceInteraction {
    /// The directions of the smooth surface, seen along a ray in this direction.
    #[inline]
    pub fn shading_frame(&self, direction: Vec3) -> ShadingFrame {
        ShadingFrame::new(self.geometric_normal, self.shading_normal, -direction)
    }

    /// Where rays in this direction start, scene-local.
    #[inline]
    pub fn offset_ray_origin(&self, direction: Vec3) -> DVec3 {
        let below = self.geometric_normal.dot(direction) < 0.0;
        self.position
            + if below {
                self.offset_back
            } else {
                self.offset_front
            }
            .as_dvec3()
    }

    /// A ray from here into the world.
    #[inline]
    pub fn spawn_ray(&self, direction: Vec3, t_max: f32) -> Ray {
        Ray {
            origin: self.offset_ray_origin(direction).as_vec3().to_array(),
            direction: direction.to_array(),
            t_max,
        }
    }
}

/// A point that is lit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSampleContext {
    /// Scene-local.
    pub position: DVec3,
    /// Of unit length where light arrives on one side of a surface only, towards that side; else zero. It guides the
    /// choice alone: no light is lost for it.
    pub normal: Vec3,
}
