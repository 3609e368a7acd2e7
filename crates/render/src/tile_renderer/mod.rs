//! Tile renderer: centre rays, filtered samples and shading of one tile at a time.
//!
//! ```text
//! tile ──> centre rays ──> ground truth ─────────────┐
//! └──> camera rays ──> hits ──> integrator ──> estimators ──> resolve ──> film
//! ```
//!
//! [`camera_rays`] generates samples, [`bright_paths`] traces the samples of one pixel again, [`resolve`] writes the
//! film, [`rolling_shutter`] splits batches by the time of their rays, [`screen_mask`] culls empty blocks, and
//! [`needs`] decides which stages run. This folder uses all lower folders; only `render` uses this folder.

pub(crate) mod bright_paths;
pub(crate) mod camera_rays;
pub(crate) mod needs;
pub(crate) mod pilot;
pub(crate) mod resolve;
pub(crate) mod rolling_shutter;
pub(crate) mod sample_plan;
pub(crate) mod screen_mask;
pub(crate) mod stats;

use std::sync::Arc;

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, INVALID_ID, Ray, Scene};
use raycam_scene::{Camera, Notice};

use crate::control::Control;
use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::film::estimator::PixelEstimator;
use crate::film::film::PixelBlock;
use crate::film::image_plane::ImagePlane;
use crate::film::tile::Tile;
use crate::ground_truth::center_rays::CenterRays;
use crate::ground_truth::convert::to_float_hit;
use crate::guiding_switch::install_guiding;
use crate::integrator;
use crate::integrator::camera_ray_batch::CameraRayBatch;
use crate::integrator::passes::{Pass, passes_of};
use crate::integrator::path::PathScratch;
use crate::integrator::requirements::{effective_lights, traces_secondary_rays};
use crate::interaction::ray_cone::{PixelCones, RayCone, sample_share};
use crate::motion::shutter::{RowWorlds, ShutterSlices};
use crate::prepare::world::PreparedWorld;
use crate::sampling::filter::FilterSampler;
use crate::sampling::sampler::Sampler;
use crate::settings::{Integrator, Settings};
use crate::tile_renderer::needs::RenderNeeds;
use crate::tile_renderer::sample_plan::SamplePlan;
use crate::tile_renderer::screen_mask::ScreenMask;
use crate::tile_renderer::stats::RenderStats;

/// Renderer of the tiles of one frame.
pub(crate) struct TileRenderer<'a> {
    world: &'a PreparedWorld,
    /// Scene in which sample rays are traced.
    scene: &'a Scene,
    /// World states while the shutter is open, if the world moves.
    shutter: Option<&'a ShutterSlices<'a>>,
    camera: &'a Camera,
    pub settings: &'a Settings,
    pub needs: RenderNeeds,
    /// Requested parts of the colour, in the order of the channels.
    pub passes: Vec<Pass>,
    filter: FilterSampler,
    /// Ray cones of the image's pixels.
    cones: PixelCones<'a>,
    /// Index of a pixel's first sample that is a late sample of path guiding.
    first_late_sample: u32,
    pub stats: RenderStats,
    /// Number of samples of every pixel; `None` if all pixels have the same number.
    plan: Option<&'a SamplePlan>,
    /// Blocks that any object can project to, and the pixel value of all other blocks; `None` if every block is traced.
    screen_mask: Option<(ScreenMask, Vec<(Channel, ImagePlane)>)>,
}

/// Buffers of one thread, reused for every tile.
#[derive(Default)]
pub(crate) struct ThreadScratch {
    lists: PixelLists,
    rays: RayBatchBuffers,
    truth: GroundTruthBuffers,
    pub estimator: PixelEstimator,
}

/// Pixels of the tile, and pixels of the current batch.
#[derive(Default)]
struct PixelLists {
    /// Image coordinates of every traced pixel.
    pixels: Vec<[u32; 2]>,
    blocks: Vec<PixelBlock>,
    /// Indices of the pixels that still receive samples.
    active: Vec<usize>,
    /// Index of the pixel and of the sample, for each ray of the batch.
    batch: Vec<(usize, u32)>,
}

/// Camera rays of a batch, their hits and radiance.
#[derive(Default)]
struct RayBatchBuffers {
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    /// Scene-local origins of the rays.
    origins: Vec<DVec3>,
    directions: Vec<Vec3>,
    cones: Vec<RayCone>,
    samplers: Vec<Sampler>,
    /// Random numbers that select positions in the pixels.
    offsets: Vec<[f32; 2]>,
    paths: PathScratch,
    radiance: Vec<Vec3>,
    misses: Vec<bool>,
}

/// Centre rays of a tile.
#[derive(Default)]
struct GroundTruthBuffers {
    center_rays: CenterRays,
    /// The world at the time of each pixel's centre ray; empty unless the camera has a rolling shutter.
    pixel_worlds: Vec<Arc<PreparedWorld>>,
    row_worlds: RowWorlds,
}

/// Maximum number of path segments that are counted for each sample in a closed room.
const MAX_SEGMENTS: u32 = 8;

/// Work of a frame: the number of its samples. In a closed room, this number is multiplied by the number of path
/// segments, because no path leaves the room. With more work, a flattened scene is justified sooner.
pub(crate) fn traced_samples(world: &PreparedWorld, camera: &Camera, settings: &Settings, samples: u32) -> u64 {
    let is_dark = || effective_lights(settings.integrator, world).constant_environment() == Some(Vec3::ZERO);
    let is_closed = settings.integrator == Integrator::Path && world.geometry.is_room() && is_dark();
    let segments = if is_closed { settings.max_depth.map_or(MAX_SEGMENTS, |depth| depth.min(MAX_SEGMENTS)) } else { 1 };
    camera.size().into_iter().chain([samples, segments]).map(u64::from).product()
}

impl<'a> TileRenderer<'a> {
    pub fn new(
        world: &'a PreparedWorld,
        shutter: Option<&'a ShutterSlices<'a>>,
        camera: &'a Camera,
        settings: &'a Settings,
        region: [u32; 4],
    ) -> Self {
        let geometry = &world.geometry;
        let needs = RenderNeeds::new(settings, camera, geometry);
        // Few rays belong to each slice of the shutter's time, so a flattened scene per slice is not justified.
        let many = needs.samples && needs.color && traces_secondary_rays(settings.integrator) && shutter.is_none();
        let pixels = u64::from(region[2]) * u64::from(region[3]);
        if needs.center_rays && shutter.is_none() {
            geometry.note_rays(pixels);
            geometry.note_exact_rays(pixels);
        }
        if needs.samples && !many && shutter.is_none() {
            geometry.note_rays(pixels * u64::from(settings.samples));
        }
        let guiding = install_guiding(world).filter(|_| needs.color);
        if let Some(guiding) = guiding {
            guiding.learn(geometry, effective_lights(settings.integrator, world), settings);
        }
        let first_late_sample = guiding.and_then(|guiding| guiding.first_late_sample(settings, camera.size()));
        let mut renderer = Self {
            world,
            scene: match many {
                true => geometry.scene_for_samples(traced_samples(world, camera, settings, settings.samples)),
                false => geometry.two_level(),
            },
            shutter,
            camera,
            settings,
            needs,
            passes: passes_of(settings, world).unwrap_or_default(),
            filter: FilterSampler::new(settings.filter),
            cones: PixelCones::new(camera, settings.samples, !geometry.textures.is_empty()),
            first_late_sample: first_late_sample.unwrap_or(u32::MAX),
            stats: RenderStats::default(),
            plan: None,
            screen_mask: None,
        };
        renderer.screen_mask = ScreenMask::new(&geometry.object_bounds, camera, region)
            .and_then(|mask| Some((mask, renderer.background()?)));
        renderer
    }

    /// Returns the renderer with a number of samples for every pixel.
    pub fn with_plan(self, plan: Option<&'a SamplePlan>) -> Self {
        Self { plan, ..self }
    }

    /// Appends notices about the samples for the user.
    pub fn notices(&self, [_, _, width, height]: [u32; 4], notices: &mut Vec<Notice>) {
        let pixels = u64::from(width) * u64::from(height);
        let pilot = self.plan.map(|plan| plan.pilot_samples);
        self.stats.notices(self.settings, pilot, pixels, notices);
        self.stats.coplanar_notice(notices);
    }

    /// True if a frame of this many samples has the same texture filter and scene as this renderer.
    pub fn is_frame_of(&self, samples: u32) -> bool {
        let planned = self.settings.samples;
        let traced = |samples| traced_samples(self.world, self.camera, self.settings, samples);
        let pays = |samples| self.world.geometry.flattening_pays(traced(samples));
        let is_flat = self.scene.is_single_level() && !self.world.geometry.scene.is_single_level();
        let same_scene = pays(samples) == is_flat || pays(planned) != is_flat;
        let same_filter = || sample_share(samples) == sample_share(planned);
        same_scene && (self.world.geometry.textures.is_empty() || same_filter())
    }

    /// True if a tile with this many samples can be continued up to the renderer's number: its samples are the first
    /// samples of a frame with that number.
    pub fn continues(&self, samples: u32) -> bool {
        let is_single = |samples| samples == 1;
        is_single(samples) == is_single(self.settings.samples) && self.is_frame_of(samples)
    }

    /// Scene against which rays of a world are traced: the renderer's scene for its own world, otherwise the world's
    /// two-level scene.
    fn scene_of<'w>(&self, world: &'w PreparedWorld) -> &'w Scene
    where
        'a: 'w,
    {
        match std::ptr::eq(world, self.world) {
            true => self.scene,
            false => world.geometry.two_level(),
        }
    }

    /// Number of progress units per tile: one for the centre rays, and one per sample.
    pub fn batches_per_tile(&self) -> usize {
        usize::from(self.needs.center_rays) + if self.needs.samples { self.settings.samples as usize } else { 0 }
    }

    /// Traces and shades all rays of a tile.
    pub fn trace(&self, tile: &Tile, scratch: &mut ThreadScratch, control: &Control) -> Result<(), RenderError> {
        self.begin_tile(tile, scratch, control)?;
        if !self.needs.samples {
            return Ok(());
        }
        match self.plan {
            Some(plan) => self.add_planned_samples(plan, scratch, control),
            None => self.add_samples(scratch, 0..self.settings.samples, control),
        }
    }

    /// Resumes a tile of an earlier round.
    pub fn continue_tile(
        &self,
        tile: &Tile,
        scratch: &mut ThreadScratch,
        state: &mut PixelEstimator,
        control: &Control,
    ) -> Result<(), RenderError> {
        self.collect_pixels(tile, scratch);
        let PixelLists { active, pixels, .. } = &mut scratch.lists;
        active.clear();
        active.extend(0..pixels.len());
        std::mem::swap(&mut scratch.estimator, state);
        // Centre rays are not traced again for the coverage, because the estimator already contains its data.
        let is_rolling = self.shutter.is_some_and(ShutterSlices::is_rolling);
        if self.needs.truth || is_rolling { self.trace_center_rays(scratch, control) } else { Ok(()) }
    }

    /// Collects the blocks of a tile, and the pixels of the blocks that any object can project to.
    fn collect_pixels(&self, tile: &Tile, scratch: &mut ThreadScratch) {
        let PixelLists { pixels, blocks, .. } = &mut scratch.lists;
        pixels.clear();
        blocks.clear();
        for block in tile.blocks() {
            let mask = self.screen_mask.as_ref();
            let traced = mask.is_none_or(|(mask, _)| mask.covers(&block));
            blocks.push(PixelBlock { block, first_pixel: traced.then_some(pixels.len()) });
            if traced {
                block.push_rows(pixels);
            }
        }
        blocks.sort_unstable_by_key(|one| (one.block.y, one.block.x));
    }

    /// Resets the buffers for a tile and traces its centre rays if required.
    pub fn begin_tile(&self, tile: &Tile, scratch: &mut ThreadScratch, control: &Control) -> Result<(), RenderError> {
        self.collect_pixels(tile, scratch);
        let count = scratch.lists.pixels.len();
        scratch.estimator.reset(count, self.passes.len(), self.needs.error);
        scratch.lists.active.clear();
        scratch.lists.active.extend(0..count);
        control.check()?;
        self.trace_center_rays(scratch, control)?;
        if self.needs.shading && self.needs.center_rays && !self.needs.samples {
            self.for_each_row_world(scratch, |world, scratch| {
                self.center_rays_as_samples(world, scratch);
                self.shade(world, scratch, control)
            })?;
        }
        if self.needs.center_rays && self.settings.time_limit.is_none() {
            control.advance();
        }
        Ok(())
    }

    /// Traces the centre rays if required.
    fn trace_center_rays(&self, scratch: &mut ThreadScratch, control: &Control) -> Result<(), RenderError> {
        scratch.truth.pixel_worlds.clear();
        if !self.needs.center_rays {
            return Ok(());
        }
        match self.shutter {
            Some(shutter) if shutter.is_rolling() => self.trace_center_rays_by_row(shutter, scratch, control)?,
            _ => {
                let (geometry, pixels) = (&self.world.geometry, &scratch.lists.pixels);
                let center_rays = &mut scratch.truth.center_rays;
                center_rays.trace(geometry, self.camera, pixels, self.settings, self.needs.skip_transparent);
            }
        }
        for &i in &scratch.truth.center_rays.coplanar {
            scratch.estimator.mark_coplanar(i, scratch.truth.center_rays.hits[i].instance);
        }
        if self.needs.coverage && self.needs.samples {
            let hits = scratch.truth.center_rays.ground_truth_hits();
            scratch.estimator.set_centers(hits.iter().map(|hit| hit.instance));
        }
        Ok(())
    }

    /// Uses the centre rays of the active pixels as their first samples.
    fn center_rays_as_samples(&self, world: &PreparedWorld, scratch: &mut ThreadScratch) {
        let PixelLists { pixels, active, batch, .. } = &mut scratch.lists;
        let RayBatchBuffers { hits, origins, directions, samplers, .. } = &mut scratch.rays;
        let center_rays = &scratch.truth.center_rays;
        let rays = || active.iter().map(|&i| &center_rays.rays[i]);
        hits.clear();
        hits.extend(active.iter().map(|&i| to_float_hit(&center_rays.hits[i])));
        origins.clear();
        origins.extend(rays().map(|ray| DVec3::from(ray.origin) - world.geometry.origin));
        directions.clear();
        directions.extend(rays().map(|ray| DVec3::from(ray.direction).as_vec3()));
        samplers.clear();
        samplers.extend(active.iter().map(|&i| self.sampler_for(self.sampler_for_pixel(pixels[i]), 0)));
        batch.clear();
        batch.extend(active.iter().map(|&i| (i, 0)));
    }

    /// Shades the batch and adds the radiance to the estimators.
    fn shade(&self, world: &PreparedWorld, scratch: &mut ThreadScratch, control: &Control) -> Result<(), RenderError> {
        self.count_samples(world, scratch);
        if !self.needs.color {
            return Ok(());
        }
        let RayBatchBuffers { hits, origins, directions, cones, samplers, paths, radiance, misses, .. } =
            &mut scratch.rays;
        let PixelLists { pixels, batch, .. } = &scratch.lists;
        self.cones.of_pixels(batch.iter().map(|&(at, _)| pixels[at]), cones);
        radiance.clear();
        radiance.resize(hits.len(), Vec3::ZERO);
        misses.clear();
        misses.resize(hits.len(), false);
        let is_late = self.prepare_guiding(world, &scratch.lists.batch);
        let (scene, ray_cones) = (self.scene_of(world), &**cones);
        let start_depth = self.camera.ray_start_depth();
        let batch = CameraRayBatch { scene, ray_cones, origins, directions, hits, samplers, start_depth, is_late };
        integrator::radiance(world, self.settings, &batch, control, paths, &self.passes, (radiance, misses))?;
        self.add_radiance(scratch);
        Ok(())
    }

    /// Counts the samples of the batch, and the samples that hit the same instance as the centre ray of their pixel.
    fn count_samples(&self, world: &PreparedWorld, scratch: &mut ThreadScratch) {
        let RayBatchBuffers { hits, origins, directions, .. } = &scratch.rays;
        let RenderNeeds { samples, coverage, skip_transparent, .. } = self.needs;
        let behind = match skip_transparent && samples && coverage {
            true => world.geometry.visible_instances(origins, directions, hits),
            false => vec![],
        };
        for (at, (&(pixel, _), hit)) in scratch.lists.batch.iter().zip(hits).enumerate() {
            let seen = behind.get(at).unwrap_or(&hit.instance);
            let is_out = *seen != INVALID_ID && world.geometry.is_left_out(self.settings.catchers, *seen);
            let seen = if is_out { &INVALID_ID } else { seen };
            // A single sample is the centre ray itself, so it always hits the same instance.
            let same = !samples || scratch.estimator.is_center(pixel, *seen);
            scratch.estimator.add_sample(pixel, same);
        }
    }

    /// Adds the radiance of the batch to the estimators, with vignetting and clamping applied.
    fn add_radiance(&self, scratch: &mut ThreadScratch) {
        let ThreadScratch { lists, rays, estimator, .. } = scratch;
        let RayBatchBuffers { radiance, misses, paths, .. } = rays;
        let count = self.passes.len();
        for (&(pixel, _), _) in lists.batch.iter().zip(misses).filter(|(_, miss)| **miss) {
            estimator.add_miss(pixel);
        }
        let limit = self.settings.clamp.unwrap_or(f32::INFINITY);
        // The samples of one pixel are consecutive.
        let mut last = None;
        for (index, (&(pixel, sample), &mut radiance)) in lists.batch.iter().zip(radiance).enumerate() {
            if !(radiance.is_finite() && radiance.min_element() >= 0.0) {
                estimator.rejected += 1;
                continue;
            }
            let gain = match last {
                Some((known, gain)) if known == pixel => gain,
                _ => {
                    let center = self.pixel_center(lists.pixels[pixel]);
                    self.camera.vignetting_factor(center) as f32
                }
            };
            last = Some((pixel, gain));
            let brightest = radiance.max_element();
            let mut factor = gain;
            if brightest > limit {
                estimator.clamped += 1;
                factor = gain * limit / brightest;
            }
            estimator.add_radiance(pixel, sample, radiance * factor);
            if count > 0 {
                estimator.add_passes(pixel, &paths.passes[index * count..][..count], factor);
            }
        }
    }
}
