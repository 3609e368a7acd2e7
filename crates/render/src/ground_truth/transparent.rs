//! Ground truth behind transparent surfaces and hidden objects.

use glam::{DVec3, Vec3};
use raycam_bvh::{Coherence, ExactHit, ExactRay, Hit, HitDetail, HitFilter, INVALID_ID, Ray, Scene, Tie};
use raycam_scene::{Material, MaterialModel};

use crate::ground_truth::convert::{exact_ray, to_float_hit};
use crate::interaction::SurfaceInteraction;
use crate::interaction::ray_cone::RayCone;
use crate::prepare::geometry::Geometry;

/// Surfaces with less opacity than this are skipped; materials with at least this transmission count as
/// refractive.
pub(crate) const OPACITY_THRESHOLD: f32 = 0.5;
/// Relative distance behind a skipped surface at which a ray restarts; larger than float64 rounding errors.
const RESTART_OFFSET: f64 = 1e-12;
/// Maximum number of surfaces skipped per ray; the next surface is never skipped.
const MAX_SKIPS: usize = 1000;

/// Indices of the rays that hit several objects at the same distance, in ascending order.
fn rays_of(ties: &[Tie]) -> Vec<u32> {
    ties.iter().map(|tie| tie.ray).collect()
}

impl Geometry {
    /// True if [`Geometry::skip_transparent`] may skip any surface.
    pub(crate) fn has_skippable(&self) -> bool {
        let passable = |material: &Material| {
            is_refractive(material) || !material.double_sided || material.alpha != raycam_scene::material::Alpha::Opaque
        };
        self.materials.iter().any(|prepared| passable(&prepared.material))
    }

    /// First hits of camera rays; hidden objects are skipped. Returns the rays that hit several objects at
    /// the same distance, up to rounding, in ascending order of the rays.
    pub(crate) fn closest_visible(&self, rays: &[ExactRay], hits: &mut [ExactHit]) -> Vec<Tie> {
        let ties = self.closest_exact(rays, hits);
        self.prefer_opaque(rays, hits, &ties, |rays| rays.camera);
        if self.has_camera_hidden {
            self.skip_hits(rays, hits, rays_of(&ties), |_, hit| !self.ray_visibility(hit.instance).camera);
        }
        ties
    }

    /// Replaces float32 hits of camera rays on hidden objects by the first hits on visible objects. The rays have unit
    /// directions.
    pub(crate) fn skip_hidden(&self, scene: &Scene, rays: &[Ray], hits: &mut [Hit]) {
        let is_hidden = |hit: &Hit| hit.instance != INVALID_ID && !self.ray_visibility(hit.instance).camera;
        let mut pending: Vec<usize> = (0..hits.len()).filter(|&i| is_hidden(&hits[i])).collect();
        for _ in 0..MAX_SKIPS {
            if pending.is_empty() {
                return;
            }
            let onward = |&i: &usize| {
                let direction = Vec3::from(rays[i].direction);
                SurfaceInteraction::new(self, direction, &hits[i], &RayCone::default())
                    .ray_beyond(direction, f32::INFINITY)
            };
            let onward: Vec<Ray> = pending.iter().map(onward).collect();
            let mut found = vec![Hit::MISS; onward.len()];
            self.closest(scene, &onward, &mut found, Coherence::Incoherent, |rays| rays.camera);
            for ((&i, hit), ray) in pending.iter().zip(found).zip(&onward) {
                let passed = Vec3::from(ray.origin) - Vec3::from(rays[i].origin);
                hits[i] = Hit { t: hit.t + passed.dot(Vec3::from(ray.direction)), ..hit };
            }
            pending.retain(|&i| is_hidden(&hits[i]));
        }
    }

    /// Replaces hits on transparent surfaces by the first hits on other surfaces behind them, or in the
    /// same plane.
    pub(crate) fn skip_transparent(&self, rays: &[ExactRay], hits: &mut [ExactHit], ties: &[Tie]) {
        self.skip_hits(rays, hits, rays_of(ties), |ray, hit| {
            self.is_skippable(&to_float_hit(hit), ray.direction.into())
        });
    }

    /// Replaces hits that are skipped by the first hits behind them, or in the same plane. `tied` are the indices of
    /// the rays that hit several objects at the same distance, in ascending order.
    fn skip_hits(
        &self,
        rays: &[ExactRay],
        hits: &mut [ExactHit],
        mut tied: Vec<u32>,
        is_skipped: impl Fn(&ExactRay, &ExactHit) -> bool,
    ) {
        let passed = |(ray, hit): (&ExactRay, &ExactHit)| hit.instance != INVALID_ID && is_skipped(ray, hit);
        let mut pending: Vec<usize> = (0..hits.len()).filter(|&i| passed((&rays[i], &hits[i]))).collect();
        for _ in 0..MAX_SKIPS {
            if pending.is_empty() {
                return;
            }
            if !tied.is_empty() {
                pending.retain(|&i| {
                    let is_tied = tied.binary_search(&(i as u32)).is_ok();
                    if is_tied {
                        self.closest_unskipped(&rays[i], &mut hits[i], &is_skipped);
                    }
                    !is_tied
                });
            }
            let starts: Vec<f64> = pending.iter().map(|&i| self.restart_t(&rays[i], &hits[i])).collect();
            let onward: Vec<ExactRay> = pending
                .iter()
                .zip(&starts)
                .map(|(&i, start)| {
                    let origin = DVec3::from(rays[i].origin) + *start * DVec3::from(rays[i].direction);
                    ExactRay { origin: origin.to_array(), ..rays[i] }
                })
                .collect();
            let mut found = vec![ExactHit::MISS; onward.len()];
            let ties = self.closest_exact(&onward, &mut found);
            tied = ties.iter().map(|tie| pending[tie.ray as usize] as u32).collect();
            for ((&i, hit), start) in pending.iter().zip(&found).zip(starts) {
                hits[i] = ExactHit { t: start + hit.t, ..*hit };
            }
            pending.retain(|&i| passed((&rays[i], &hits[i])));
        }
    }

    /// Replaces a skipped hit by the first hit that is not skipped.
    fn closest_unskipped(
        &self,
        ray: &ExactRay,
        hit: &mut ExactHit,
        is_skipped: &impl Fn(&ExactRay, &ExactHit) -> bool,
    ) {
        let filter = UnskippedFilter { ray, is_skipped };
        self.exact_scene().closest_exact_with(
            &[*ray],
            self,
            Some(&filter),
            HitDetail::Intersection,
            std::slice::from_mut(hit),
        );
    }

    /// Instances that scene-local rays hit first if hidden objects and transparent surfaces are skipped.
    /// `hits` are the first hits of the rays, without skipping.
    pub(crate) fn visible_instances(&self, origins: &[DVec3], directions: &[Vec3], hits: &[Hit]) -> Vec<u32> {
        let mut seen: Vec<u32> = hits.iter().map(|hit| hit.instance).collect();
        let passed: Vec<usize> = (0..hits.len())
            .filter(|&i| hits[i].instance != INVALID_ID && self.is_skippable(&hits[i], directions[i].as_dvec3()))
            .collect();
        let rays: Vec<ExactRay> =
            passed.iter().map(|&i| exact_ray((origins[i] + self.origin, directions[i].as_dvec3()))).collect();
        let mut found = vec![ExactHit::MISS; rays.len()];
        let ties = self.closest_visible(&rays, &mut found);
        self.skip_transparent(&rays, &mut found, &ties);
        for (i, hit) in passed.into_iter().zip(found) {
            seen[i] = hit.instance;
        }
        seen
    }

    /// Ray parameter just behind a hit, at which the ray restarts.
    fn restart_t(&self, ray: &ExactRay, hit: &ExactHit) -> f64 {
        let reach = DVec3::from(ray.origin).abs().max_element() + hit.t + self.origin.abs().max_element();
        hit.t + RESTART_OFFSET * reach
    }

    /// True if the ground truth skips the surface: it refracts, its opacity is too low, its object is hidden
    /// from camera rays, or it is one-sided and seen from behind.
    pub(crate) fn is_skippable(&self, hit: &Hit, direction: DVec3) -> bool {
        let material = &self.material(hit).material;
        is_refractive(material)
            || !self.ray_visibility(hit.instance).camera
            || self.opacity(hit) < OPACITY_THRESHOLD
            || !material.double_sided && self.is_culled_back_face(hit, direction)
    }

    /// True if the ray hits the back of the surface at the hit.
    fn is_culled_back_face(&self, hit: &Hit, direction: DVec3) -> bool {
        let [a, b, c] = self.corners(hit.instance, hit.triangle);
        let away = (b - a).cross(c - a).dot(direction) > 0.0;
        away != self.instances[hit.instance as usize].flips_orientation
    }
}

/// Filter for the hits of one ray: accepts hits that are not skipped.
struct UnskippedFilter<'a, F> {
    ray: &'a ExactRay,
    is_skipped: &'a F,
}

impl<F: Fn(&ExactRay, &ExactHit) -> bool> HitFilter for UnskippedFilter<'_, F> {
    fn accepts_instance(&self, _: usize, _: u32) -> bool {
        true
    }

    fn accepts(&self, _: usize, hit: &ExactHit) -> bool {
        !(self.is_skipped)(self.ray, hit)
    }
}

/// True for glass, and for principled materials whose transmission is at least [`OPACITY_THRESHOLD`].
fn is_refractive(material: &Material) -> bool {
    match &material.model {
        MaterialModel::Glass(_) => true,
        MaterialModel::Principled(principled) => principled.transmission.value >= OPACITY_THRESHOLD,
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) | MaterialModel::Boundary => false,
    }
}
