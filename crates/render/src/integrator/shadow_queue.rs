//! Shadow rays, and the light that each ray adds if it is unoccluded.

use glam::Vec3;
use raycam_bvh::{Coherence, Hit, Ray, Scene};

use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::specular::straight_transmittance;
use crate::integrator::camera_ray_batch::is_miss;
use crate::integrator::passes::{PassTag, Passes};
use crate::interaction::SurfaceInteraction;
use crate::interaction::ray_cone::RayCone;
use crate::media::map::{Borders, MediaMap, MediumRay};
use crate::media::nested_dielectrics::InteriorList;
use crate::prepare::geometry::Geometry;

/// Shadow rays in the order in which they were pushed.
#[derive(Debug, Default)]
pub(crate) struct ShadowRayQueue {
    rays: Vec<Ray>,
    occluded: Vec<bool>,
    /// Index of the camera ray, and the light that the shadow ray adds to the camera ray's radiance.
    contribution: Vec<(usize, Vec3)>,
    /// True in a world with media, where every ray has its media in `interiors`.
    pub tracks_media: bool,
    interiors: Vec<InteriorList>,
    /// Rays that are dimmed, with their indices, and the borders of media that they cross.
    media_rays: Vec<(usize, MediumRay)>,
    borders: Borders,
    /// Way and source of the light of every ray, if passes are recorded; otherwise empty.
    tags: Vec<PassTag>,
}

impl ShadowRayQueue {
    /// Adds a ray that starts outside of all media, or in a world without media.
    pub fn push(&mut self, ray: Ray, index: usize, light: Vec3) {
        self.push_within(ray, index, light, InteriorList::default());
    }

    /// Adds a ray that starts in these media, which dim its light in a world with media.
    #[inline]
    pub fn push_within(&mut self, ray: Ray, index: usize, light: Vec3, interior: InteriorList) {
        if self.tracks_media {
            self.interiors.push(interior);
        }
        self.rays.push(ray);
        self.contribution.push((index, light));
    }

    /// Adds a ray that starts outside of all media, with the way and source of its light.
    pub fn push_tagged(&mut self, ray: Ray, index: usize, light: Vec3, tag: Option<PassTag>) {
        self.push(ray, index, light);
        self.tag_last(tag);
    }

    /// Sets the way and source of the light of the last ray.
    pub fn tag_last(&mut self, tag: Option<PassTag>) {
        self.tags.extend(tag);
    }

    /// Every ray, with the index of its camera ray and the light that it adds if it is unoccluded.
    pub fn entries(&self) -> impl Iterator<Item = (Ray, usize, Vec3)> {
        self.rays.iter().zip(&self.contribution).map(|(&ray, &(index, light))| (ray, index, light))
    }

    /// Traces all rays, adds the light of unoccluded rays to `radiance` and to the `passes`, dimmed by `media`, and
    /// empties the queue.
    pub fn trace(
        &mut self,
        geometry: &Geometry,
        scene: &Scene,
        coherence: Coherence,
        media: Option<&MediaMap>,
        passes: Option<Passes>,
        radiance: &mut [Vec3],
    ) {
        // Every entry is overwritten, so the initial values do not matter.
        self.occluded.resize(self.rays.len(), false);
        scene.occluded(&self.rays, &mut self.occluded, coherence);
        if let Some(media) = media {
            self.dim_by_media(media, geometry.has_transparency);
        }
        for (&(index, light), occluded) in self.contribution.iter().zip(&self.occluded) {
            if !occluded {
                radiance[index] += light;
            }
        }
        if let Some(passes) = passes {
            let rays = self.contribution.iter().zip(&self.tags).zip(&self.occluded);
            for ((&(index, light), &tag), _) in rays.filter(|(_, occluded)| !**occluded) {
                passes.add(index, tag, light);
            }
        }
        if geometry.has_transparency {
            let mut occluded = self.occluded.iter();
            self.rays.retain(|_| occluded.next() == Some(&true));
            let mut occluded = self.occluded.iter();
            self.contribution.retain(|_| occluded.next() == Some(&true));
            let mut occluded = self.occluded.iter();
            self.tags.retain(|_| occluded.next() == Some(&true));
            self.trace_transparent(geometry, scene, passes, radiance);
        }
        self.clear();
    }

    /// Dims the light of rays by the media that they pass: of all rays if surfaces may let light through, otherwise
    /// only of the unoccluded rays.
    #[inline(never)]
    fn dim_by_media(&mut self, media: &MediaMap, dims_occluded: bool) {
        let Self { rays, occluded, contribution, interiors, media_rays, borders, .. } = self;
        let is_dimmed = |index: usize| dims_occluded || !occluded[index];
        media_rays.clear();
        let dimmed = rays.iter().enumerate().filter(|(index, _)| is_dimmed(*index));
        media_rays.extend(dimmed.map(|(index, ray)| {
            let direction = Vec3::from(ray.direction).as_dvec3();
            let length = direction.length();
            let through = MediumRay {
                origin: Vec3::from(ray.origin).as_dvec3(),
                direction: direction / length,
                begin: 0.0,
                end: f64::from(ray.t_max) * length,
                is_camera_ray: false,
            };
            (index, through)
        }));
        borders.find(media, media_rays.iter().map(|(_, ray)| ray));
        for (number, (index, ray)) in media_rays.iter().enumerate() {
            contribution[*index].1 *= media.transmittance(interiors[*index], ray, borders.of_ray(number));
        }
    }

    pub fn clear(&mut self) {
        self.rays.clear();
        self.contribution.clear();
        self.interiors.clear();
        self.tags.clear();
    }

    /// Traces rays that transparent surfaces may let through, from surface to surface.
    fn trace_transparent(&mut self, geometry: &Geometry, scene: &Scene, passes: Option<Passes>, radiance: &mut [Vec3]) {
        let mut hits = vec![];
        while !self.rays.is_empty() {
            hits.clear();
            hits.resize(self.rays.len(), Hit::MISS);
            geometry.closest(scene, &self.rays, &mut hits, Coherence::Incoherent, |rays| rays.shadow);
            let mut count = 0;
            for (i, hit) in hits.iter().enumerate() {
                let ((index, light), ray) = (self.contribution[i], self.rays[i]);
                if is_miss(hit) {
                    radiance[index] += light;
                    if let Some(passes) = passes {
                        passes.add(index, self.tags[i], light);
                    }
                    continue;
                }
                let opacity = geometry.opacity(hit);
                let is_straight = geometry.material(hit).is_straight;
                let is_shadowless = !geometry.ray_visibility(hit.instance).shadow;
                if opacity == 1.0 && !is_straight && !is_shadowless {
                    continue;
                }
                // The ray continues from the far side of the surface to the same end point.
                let direction = Vec3::from(ray.direction);
                let length = direction.length();
                let interaction = SurfaceInteraction::new(geometry, direction / length, hit, &RayCone::default());
                let mut transmittance = Vec3::splat(if is_shadowless { 1.0 } else { 1.0 - opacity });
                if is_straight && !is_shadowless {
                    let hit = MaterialHit::new(geometry, hit, &interaction, direction / length);
                    transmittance += opacity * straight_transmittance(&hit);
                }
                let light = light * transmittance;
                if light == Vec3::ZERO {
                    continue;
                }
                let left = (ray.t_max - hit.t) * length;
                self.rays[count] = interaction.ray_beyond(direction / length, left);
                self.contribution[count] = (index, light);
                if passes.is_some() {
                    self.tags[count] = self.tags[i];
                }
                count += 1;
            }
            self.rays.truncate(count);
            self.contribution.truncate(count);
            self.tags.truncate(count);
        }
    }
}
