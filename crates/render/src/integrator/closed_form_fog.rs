//! Fog in closed form, for `flat` and `direct`: objects fade into the fog's own light with their distance.
//!
//! H. Koschmieder, "Theorie der horizontalen Sichtweite", 1924: radiance * T + air light * (1 - T), with the
//! transmittance T of the ray's part in the fog.

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;

use crate::integrator::camera_ray_batch::{CameraRayBatch, is_miss};
use crate::integrator::path_state::PathState;
use crate::integrator::path_tracer::PathTracer;
use crate::light::air_light::AirLight;
use crate::media::map::{ClosedForm, MediaMap, MediumRay};
use crate::prepare::geometry::Geometry;
use crate::prepare::medium::Medium;
use crate::settings::Catchers;

/// For each path, the point that scattered it last, and the distance from this point at which its current ray
/// begins. The distance is greater than 0 after surfaces that let the path through without scattering it.
#[derive(Debug, Default)]
pub(super) struct RayBegins(Vec<(DVec3, f64)>);

impl RayBegins {
    /// Returns the distance at which the current ray of a path begins. The ray ends at `hit`; the next ray
    /// begins there unless something scatters the path. `start_depth` is [`CameraRayBatch::start_depth`].
    pub fn advance(&mut self, geometry: &Geometry, index: usize, path: &PathState, hit: &Hit, start_depth: f64) -> f64 {
        let scattered = path.prev_context.position;
        if self.0.len() <= index {
            self.0.resize(index + 1, (DVec3::NAN, 0.0));
        }
        let own = if path.is_camera_ray { -start_depth } else { 0.0 };
        let known = if self.0[index].0 == scattered { self.0[index].1 } else { own };
        let begin = known.max(f64::from(path.passed_distance));
        let end = geometry.ray_length(scattered, path.direction.as_dvec3(), hit);
        self.0[index] = (scattered, end.max(begin));
        begin
    }

    /// Removes the data of the previous batch.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}

impl Geometry {
    /// The scene-local position of a hit on the float64 triangle.
    pub(super) fn hit_position(&self, hit: &Hit) -> DVec3 {
        let [a, b, c] = self.corners(hit.instance, hit.triangle);
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        a + (b - a) * u + (c - a) * v - self.origin
    }

    /// The length of a ray with a unit direction to its hit; infinite for a miss.
    pub(super) fn ray_length(&self, start: DVec3, direction: DVec3, hit: &Hit) -> f64 {
        if is_miss(hit) { f64::INFINITY } else { (self.hit_position(hit) - start).dot(direction) }
    }
}

impl PathTracer<'_> {
    /// Dims a path by the media of its ray and adds the media's own light. After a scattering that is not
    /// specular, only the path's list of media is updated. `begin` is the distance at which the ray begins.
    pub(super) fn apply_closed_form(
        &self,
        (media, air_light): (&MediaMap, &AirLight),
        path: &mut PathState,
        hit: &Hit,
        begin: f64,
        out: &mut Vec3,
    ) {
        let is_out = |hit: &Hit| is_miss(hit) || self.geometry.is_left_out(self.settings.catchers, hit.instance);
        let is_hidden = self.settings.catchers == Catchers::Only || self.settings.hide_environment && is_out(hit);
        let (origin, direction) = (path.prev_context.position, path.direction.as_dvec3());
        let end = self.geometry.ray_length(origin, direction, hit);
        let ray = MediumRay { origin, direction, begin, end, is_camera_ray: path.is_camera_ray };
        let air_light = |medium: &Medium| air_light.radiance(path.direction, medium.albedo, medium.g);
        let ClosedForm { passed, added, interior } = media.closed_form(path.interior_list, &ray, air_light);
        if path.specular_bounce {
            if !(path.is_camera_ray && is_hidden) {
                *out += path.throughput * added;
                if self.settings.passes.is_some() {
                    self.record_air_light(media, path, &ray);
                }
            }
            path.throughput *= passed;
        }
        path.interior_list = interior;
    }
}

/// Adds the fog in front of an unlit image: every object is as bright as its base colour, and media as their albedos.
pub(super) fn fade_unlit(
    media: &MediaMap,
    geometry: &Geometry,
    batch: &CameraRayBatch,
    index: usize,
    radiance: &mut Vec3,
) {
    let (origin, direction) = (batch.origins[index], batch.directions[index].as_dvec3());
    let end = geometry.ray_length(origin, direction, &batch.hits[index]);
    let ray = MediumRay { origin, direction, begin: -batch.start_depth, end, is_camera_ray: true };
    let interior = geometry.interior_at(origin - direction * batch.start_depth);
    let ClosedForm { passed, added, .. } = media.closed_form(interior, &ray, |medium| medium.albedo);
    *radiance = *radiance * passed + added;
}
