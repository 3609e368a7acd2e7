//! Light on its way to the rays of a batch, unless something stands in between.

use glam::Vec3;
use raycam_bvh::{Coherence, Hit, Ray, Scene};

use crate::integrator::is_miss;
use crate::interaction::SurfaceInteraction;
use crate::prepare::world::PreparedWorld;

/// Shadow rays, and what arrives along each.
#[derive(Clone, Debug, Default)]
pub(crate) struct ShadowRayQueue {
    rays: Vec<Ray>,
    occluded: Vec<bool>,
    /// Which ray of the batch it is for, and how much.
    contribution: Vec<(usize, Vec3)>,
}

impl ShadowRayQueue {
    pub fn push(&mut self, ray: Ray, index: usize, light: Vec3) {
        self.rays.push(ray);
        self.contribution.push((index, light));
    }

    /// Answers everything asked since the last time.
    pub fn trace(
        &mut self,
        world: &PreparedWorld,
        scene: &Scene,
        coherence: Coherence,
        radiance: &mut [Vec3],
    ) {
        // All are written; what they were does not matter.
        self.occluded.resize(self.rays.len(), false);
        scene.occluded(&self.rays, &mut self.occluded, coherence);
        for (&(index, light), dark) in self.contribution.iter().zip(&self.occluded) {
            if !dark {
                radiance[index] += light;
            }
        }
        if world.geometry.has_transparency {
            let is_dark = || {
                let mut dark = self.occluded.iter();
                move || dark.next() == Some(&true)
            };
            let (mut of_ray, mut of_light) = (is_dark(), is_dark());
            self.rays.retain(|_| of_ray());
            self.contribution.retain(|_| of_light());
            self.trace_transparent(world, scene, radiance);
        }
        self.clear();
    }

    pub fn clear(&mut self) {
        self.rays.clear();
        self.contribution.clear();
    }

    /// What stands in the way may let light through by its opacity: from one surface to the next.
    fn trace_transparent(&mut self, world: &PreparedWorld, scene: &Scene, radiance: &mut [Vec3]) {
        let mut hits = vec![];
        while !self.rays.is_empty() {
            hits.clear();
            hits.resize(self.rays.len(), Hit::MISS);
            scene.closest(&self.rays, &mut hits, Coherence::Incoherent);
            let mut kept = 0;
            for (i, hit) in hits.iter().enumerate() {
                let ((index, light), ray) = (self.contribution[i], self.rays[i]);
                if is_miss(hit) {
                    radiance[index] += light;
                    continue;
                }
                let light = light * (1.0 - world.geometry.opacity(hit));
                if light == Vec3::ZERO {
                    continue;
                }
                // From the other side of the surface to the same end.
                let direction = Vec3::from(ray.direction);
                let length = direction.length();
                let place = SurfaceInteraction::new(&world.geometry, direction / length, hit, 0.0);
                let left = (ray.t_max - hit.t) * length;
                self.rays[kept] = place.spawn_ray(direction / length, left);
                self.contribution[kept] = (index, light);
                kept += 1;
            }
            self.rays.truncate(kept);
            self.contribution.truncate(kept);
        }
    }
}
