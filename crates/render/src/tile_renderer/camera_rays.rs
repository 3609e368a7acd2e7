//! Camera rays of samples, generated and traced in batches.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};
use raycam_bvh::{Coherence, Hit, Ray, WithSimd, dispatch_simd};
use raycam_scene::camera::Pinhole;

use crate::control::Control;
use crate::error::RenderError;
use crate::film::estimator::REPLICATIONS;
use crate::guiding_switch::install_guiding;
use crate::integrator::requirements::effective_lights;
use crate::prepare::world::PreparedWorld;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;
use crate::settings::Settings;
use crate::soa::{LANES, get_lane, set_lane};
use crate::thread_pool::give_turn;
use crate::tile_renderer::{PixelLists, RayBatchBuffers, ThreadScratch, TileRenderer};

/// Approximate number of rays per batch.
const BATCH_RAYS: usize = 4096;
/// Maximum number of samples of a pixel in a batch. Rays of fewer pixels stay coherent longer.
const SAMPLES_PER_PIXEL_PER_BATCH: u32 = 64;

impl TileRenderer<'_> {
    /// Adds samples to every active pixel.
    pub fn add_samples(
        &self,
        scratch: &mut ThreadScratch,
        samples: Range<u32>,
        control: &Control,
    ) -> Result<(), RenderError> {
        let mut first = samples.start;
        while first < samples.end {
            let next = self.end_of_batch(first..samples.end, SAMPLES_PER_PIXEL_PER_BATCH);
            let pixels = BATCH_RAYS / (next - first) as usize;
            let all = std::mem::take(&mut scratch.lists.active);
            for some in all.chunks(pixels) {
                give_turn();
                control.check()?;
                scratch.lists.batch.clear();
                let of_pixel = |&pixel| (first..next).map(move |sample| (pixel, sample));
                scratch.lists.batch.extend(some.iter().flat_map(of_pixel));
                match self.shutter {
                    None => {
                        self.trace_batch(self.world, scratch);
                        self.shade(self.world, scratch, control)?;
                    }
                    Some(shutter) => self.shade_by_time_slice(shutter, scratch, control)?,
                }
            }
            scratch.lists.active = all;
            if self.settings.time_limit.is_none() {
                control.advance_by((next - first) as usize);
            }
            first = next;
        }
        Ok(())
    }

    /// End of the next batch of these samples. Either all or none of the samples in a batch are late samples of path
    /// guiding.
    pub(crate) fn end_of_batch(&self, samples: Range<u32>, most: u32) -> u32 {
        let until = samples.end.min(samples.start + most);
        if samples.start < self.first_late_sample { until.min(self.first_late_sample) } else { until }
    }

    /// Prepares path guiding for a batch; returns true if the batch consists of late samples.
    pub(crate) fn prepare_guiding(&self, world: &PreparedWorld, batch: &[(usize, u32)]) -> bool {
        let guiding = install_guiding(world);
        let is_late = batch.first().is_some_and(|&(_, sample)| sample >= self.first_late_sample);
        if is_late && let Some(guiding) = guiding {
            guiding.learn_late(&world.geometry, effective_lights(self.settings.integrator, world));
        }
        is_late
    }

    /// Generates and traces the rays of the batch, in float32.
    pub(crate) fn trace_batch(&self, world: &PreparedWorld, scratch: &mut ThreadScratch) {
        let PixelLists { pixels, batch, .. } = &scratch.lists;
        let RayBatchBuffers { rays, hits, origins, directions, samplers, offsets, .. } = &mut scratch.rays;
        rays.clear();
        origins.clear();
        directions.clear();
        samplers.clear();
        let mut last = None;
        samplers.extend(batch.iter().map(|&(i, sample)| {
            let of_pixel = match last {
                Some((pixel, of_pixel)) if pixel == i => of_pixel,
                _ => self.sampler_for_pixel(pixels[i]),
            };
            last = Some((i, of_pixel));
            self.sampler_for(of_pixel, sample)
        }));
        Sampler::get_2d_many(samplers, 0..samplers.len(), [Dimension::PixelFilter], [offsets]);
        let pinhole = self.camera.pinhole();
        if let Some(pinhole) = pinhole.filter(|at| !world.geometry.is_far(at.center - world.geometry.origin)) {
            let start = pinhole.center - world.geometry.origin;
            origins.resize(batch.len(), start);
            dispatch_simd(GeneratePinholeRays {
                pinhole,
                pixels: batch.iter().zip(&*offsets).map(|(&(i, _), &offset)| self.film_position(pixels[i], offset)),
                origin: start,
                rays,
                directions,
            });
        } else {
            for ((&(i, _), sampler), &mut offset) in batch.iter().zip(&*samplers).zip(offsets) {
                let (lens, part) = self.lens_and_time(sampler);
                let ray = self.camera.generate_ray(self.film_position(pixels[i], offset), lens, part);
                let (origin, direction) = (ray.origin, ray.direction);
                rays.push(world.geometry.local_ray(origin, direction, f64::INFINITY).0);
                origins.push(origin - world.geometry.origin);
                directions.push(direction.as_vec3());
            }
        }
        // Every hit is overwritten, so earlier values do not matter.
        hits.resize(rays.len(), Hit::MISS);
        let scene = self.scene_of(world);
        let ties = world.geometry.closest(scene, rays, hits, Coherence::Coherent, |rays| rays.camera);
        for tie in ties.iter().filter(|tie| tie.is_coplanar) {
            let ray = tie.ray as usize;
            scratch.estimator.mark_coplanar(batch[ray].0, hits[ray].instance);
        }
        if world.geometry.has_camera_hidden {
            world.geometry.skip_hidden(scene, rays, hits);
        }
    }

    /// Image coordinates of a sample in a pixel, from the random numbers of [`Dimension::PixelFilter`].
    pub(crate) fn film_position(&self, [x, y]: [u32; 2], numbers: [f32; 2]) -> DVec2 {
        self.camera.pixel_center_of(x, y) + DVec2::from(self.filter.sample(numbers))
    }

    /// Lens position and fraction of the exposure of a sample.
    pub(crate) fn lens_and_time(&self, sampler: &Sampler) -> ([f64; 2], f64) {
        if !self.needs.lens_or_time {
            return ([0.5; 2], 0.5);
        }
        let lens = sampler.get_2d(Dimension::Lens).map(f64::from);
        (lens, f64::from(sampler.get_2d(Dimension::Time)[0]))
    }

    pub(crate) fn pixel_center(&self, [x, y]: [u32; 2]) -> DVec2 {
        self.camera.pixel_center_of(x, y)
    }

    /// Sampler of a pixel's first sample.
    pub(crate) fn sampler_for_pixel(&self, pixel: [u32; 2]) -> Sampler {
        let Settings { seed, frame, .. } = *self.settings;
        Sampler::for_pixel(seed, frame, pixel)
    }

    /// Sampler of the sample with this index in a pixel.
    pub(crate) fn sampler_for(&self, of_pixel: Sampler, sample: u32) -> Sampler {
        if self.needs.error { of_pixel.with_replication(sample, REPLICATIONS) } else { of_pixel.with_sample(sample) }
    }
}

/// Loop that generates rays of a pinhole camera near the scene.
struct GeneratePinholeRays<'a, P> {
    pinhole: Pinhole,
    pixels: P,
    /// Scene-local position of the pinhole.
    origin: DVec3,
    rays: &'a mut Vec<Ray>,
    directions: &'a mut Vec<Vec3>,
}

impl<P: Iterator<Item = DVec2>> WithSimd for GeneratePinholeRays<'_, P> {
    #[inline(always)]
    fn run(mut self) {
        let origin = self.origin.as_vec3().to_array();
        loop {
            let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
            let mut count = 0;
            while count < LANES
                && let Some(pixel) = self.pixels.next()
            {
                (x[count], y[count]) = (pixel.x, pixel.y);
                count += 1;
            }
            let mut directions = [[0.0; LANES]; 3];
            for lane in 0..LANES {
                let direction = self.pinhole.direction(DVec2::new(x[lane], y[lane]));
                set_lane(&mut directions, lane, direction.as_vec3().to_array());
            }
            self.directions.extend((0..count).map(|lane| Vec3::from(get_lane(&directions, lane))));
            self.rays.extend((0..count).map(|lane| Ray {
                origin,
                direction: get_lane(&directions, lane),
                t_max: f32::INFINITY,
            }));
            if count < LANES {
                return;
            }
        }
    }
}
