//! Camera rays of a tile and their hits.

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, INVALID_ID, Scene};

use crate::interaction::ray_cone::RayCone;
use crate::sampling::sampler::Sampler;

/// Camera rays and their hits, in arrays with one entry per ray.
pub(crate) struct CameraRayBatch<'a> {
    /// Scene in which shadow rays and scattered rays are traced.
    pub scene: &'a Scene,
    /// Scene-local origins of the rays.
    pub origins: &'a [DVec3],
    /// Ray cones of the rays' pixels.
    pub ray_cones: &'a [RayCone],
    /// Unit directions of the rays.
    pub directions: &'a [Vec3],
    pub hits: &'a [Hit],
    pub samplers: &'a [Sampler],
    /// Depth at which the rays start: see [`raycam_scene::Camera::ray_start_depth`].
    pub start_depth: f64,
    /// True if these are late samples of path guiding: see `PathGuiding::first_late_sample`.
    pub is_late: bool,
}

/// True for a ray that hit nothing.
pub(crate) fn is_miss(hit: &Hit) -> bool {
    hit.instance == INVALID_ID
}
