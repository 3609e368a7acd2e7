//! How the pixels of a tile are seen: exact rays through their centres, samples around them, sums of what these bring.

pub(crate) mod camera_rays;
pub(crate) mod resolve;
pub(crate) mod rolling_shutter;
pub(crate) mod screen_mask;
pub(crate) mod stats;

use std::sync::Arc;

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, Ray, Scene};
use raycam_scene::Camera;

use crate::control::Control;
use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::film::estimator::PixelEstimator;
use crate::film::film::Block;
use crate::film::frame::ImagePlane;
use crate::film::tile::Tile;
use crate::ground_truth::center_rays::{self, CenterRays};
use crate::integrator::path::PathScratch;
use crate::integrator::{self, CameraRayBatch};
use crate::interaction::ray_cone::RayCone;
use crate::motion::shutter::{RowWorlds, ShutterSlices};
use crate::prepare::world::PreparedWorld;
use crate::sampling::filter::FilterSampler;
use crate::sampling::sampler::Sampler;
use crate::settings::{Settings, TruthSurface};
use crate::tile_renderer::screen_mask::ScreenMask;
use crate::tile_renderer::stats::RenderStats;

/// All that the tiles of one picture share.
pub(crate) struct TileRenderer<'a> {
    world: &'a PreparedWorld,
    /// What the rays of samples are traced against.
    scene: &'a Scene,
    /// Where the world moves while the shutter is open.
    shutter: Option<&'a ShutterSlices<'a>>,
    camera: &'a Camera,
    pub settings: &'a Settings,
    filter: FilterSampler,
    /// The part of the middle pixel that a sample stands for.
    cone: RayCone,
    /// Whether pixel-centre rays are needed, whether samples are, and whether either are looked at for more than the
    /// ground truth.
    center_rays: bool,
    pub samples: bool,
    shading: bool,
    /// Whether the samples that see what the centre sees are asked for.
    coverage: bool,
    color: bool,
    /// Whether the ground truth may pass what it meets first.
    skip_transparent: bool,
    /// Whether samples go through all of an aperture or an exposure.
    lens_or_time: bool,
    /// Whether the error of the colour is estimated.
    error: bool,
    stats: RenderStats,
    /// Which blocks show anything, and what a pixel of the others is; `None` where all are to be traced.
    screen_mask: Option<(ScreenMask, Vec<(Channel, ImagePlane)>)>,
}

/// What a thread needs for a tile; kept from tile to tile.
#[derive(Default)]
pub(crate) struct ThreadScratch {
    pixels: Vec<[u32; 2]>,
    blocks: Vec<Block>,
    center_rays: CenterRays,
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    /// Scene-local.
    origins: Vec<DVec3>,
    directions: Vec<Vec3>,
    samplers: Vec<Sampler>,
    /// The numbers that say where in the pixel.
    offsets: Vec<[f32; 2]>,
    /// Of the paths of a batch.
    paths: PathScratch,
    radiance: Vec<Vec3>,
    misses: Vec<bool>,
    /// The pixels that get more samples.
    active: Vec<usize>,
    /// What the rays at hand are: pixel, and number of the sample.
    batch: Vec<(usize, u32)>,
    /// Of worlds that move, the world that the exact ray of each pixel sees.
    pixel_worlds: Vec<Arc<PreparedWorld>>,
    row_worlds: RowWorlds,
    pub estimator: PixelEstimator,
}

/// Samples after which a pixel may stop, and then each power of two: enough to trust the estimated error.
const FIRST_ADAPTIVE_CHECK: u32 = 64;

impl<'a> TileRenderer<'a> {
    pub fn new(
        world: &'a PreparedWorld,
        moments: Option<&'a ShutterSlices<'a>>,
        camera: &'a Camera,
        settings: &'a Settings,
        region: [u32; 4],
    ) -> Self {
        let asked = |channel| settings.channels.contains(&channel);
        let single = settings.samples == 1;
        let colored = asked(Channel::Color) || asked(Channel::Alpha) || asked(Channel::Error);
        let covered = asked(Channel::Coverage);
        let shaded = colored || covered;
        let estimated = asked(Channel::Error) || settings.noise.is_some();
        let sampled = !single && shaded;
        // A moment that is seen by few rays is not worth a tree of its own.
        let many =
            sampled && colored && settings.integrator.traces_secondary_rays() && moments.is_none();
        let [width, height] = camera.size().map(u64::from);
        let exact = single
            || settings
                .channels
                .iter()
                .any(|channel| channel.is_ground_truth());
        if exact && moments.is_none() {
            world
                .geometry
                .note_exact_rays(u64::from(region[2]) * u64::from(region[3]));
        }
        if colored {
            integrator::build_caustic_maps(world, settings);
        }
        let mut picture = Self {
            world,
            scene: match many {
                true => world
                    .geometry
                    .scene_for_samples(width * height * u64::from(settings.samples)),
                false => &world.geometry.scene,
            },
            shutter: moments,
            camera,
            settings,
            filter: FilterSampler::new(settings.filter),
            cone: RayCone::for_pixel(camera, settings.samples),
            center_rays: exact,
            samples: sampled,
            shading: shaded,
            skip_transparent: settings.surface == TruthSurface::Solid
                && world.geometry.has_skippable(),
            coverage: covered,
            color: colored,
            lens_or_time: camera.aperture().is_some() || camera.motion().is_some(),
            error: estimated,
            stats: RenderStats::default(),
            screen_mask: None,
        };
        picture.screen_mask = ScreenMask::new(&world.geometry.object_bounds, camera, region)
            .and_then(|cover| Some((cover, picture.background()?)));
        picture
    }

    /// What the one who looks at the picture should know of its samples.
    pub fn notices(&self, [_, _, width, height]: [u32; 4], notices: &mut Vec<String>) {
        let pixels = u64::from(width) * u64::from(height);
        self.stats.notices(self.settings, pixels, notices);
    }

    /// What rays in a world are traced against: in another one than the picture's, at another moment, in its own scene.
    fn scene_of<'w>(&self, world: &'w PreparedWorld) -> &'w Scene
    where
        'a: 'w,
    {
        match std::ptr::eq(world, self.world) {
            true => self.scene,
            false => &world.geometry.scene,
        }
    }

    /// Batches of rays per tile.
    pub fn batches_per_tile(&self) -> usize {
        usize::from(self.center_rays)
            + if self.samples {
                self.settings.samples as usize
            } else {
                0
            }
    }

    /// Traces all rays of a tile.
    pub fn trace(
        &self,
        tile: &Tile,
        buffers: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        self.begin_tile(tile, buffers, control)?;
        if !self.samples {
            return Ok(());
        }
        let samples = self.settings.samples;
        let (mut taken, mut barrier) = (0, FIRST_ADAPTIVE_CHECK);
        while taken < samples {
            let until = match self.settings.noise {
                Some(_) => barrier.min(samples),
                None => samples,
            };
            self.add_samples(buffers, taken..until, control)?;
            taken = until;
            barrier = barrier.saturating_mul(2);
            if let Some(noise) = self.settings.noise {
                let ThreadScratch {
                    active,
                    estimator: estimate,
                    ..
                } = &mut *buffers;
                // Every pixel by itself, so that it does not depend on the tile.
                active.retain(|&pixel| estimate.error(pixel) > noise);
                if active.is_empty() {
                    control.advance_by((samples - taken) as usize);
                    break;
                }
            }
        }
        if let Some(noise) = self.settings.noise {
            let pixels = 0..buffers.pixels.len();
            let estimate = &buffers.estimator;
            let spent = pixels.map(|pixel| u64::from(estimate.samples(pixel))).sum();
            let noisy = |&&pixel: &&usize| estimate.error(pixel) > noise;
            let unfinished = buffers.active.iter().filter(noisy).count() as u64;
            self.stats.add_samples(spent, unfinished);
        }
        Ok(())
    }

    /// Goes on with a tile where an earlier round has left it.
    pub fn continue_tile(
        &self,
        tile: &Tile,
        buffers: &mut ThreadScratch,
        state: &mut PixelEstimator,
        control: &Control,
    ) -> Result<(), RenderError> {
        self.collect_pixels(tile, buffers);
        buffers.active.clear();
        buffers.active.extend(0..buffers.pixels.len());
        std::mem::swap(&mut buffers.estimator, state);
        self.trace_center_rays(buffers, control)
    }

    /// The blocks of a tile, and the pixels of those that anything may be seen in.
    fn collect_pixels(
        &self,
        tile: &Tile,
        ThreadScratch { pixels, blocks, .. }: &mut ThreadScratch,
    ) {
        pixels.clear();
        blocks.clear();
        for block in tile.blocks() {
            let cover = self.screen_mask.as_ref();
            let seen = cover.is_none_or(|(cover, _)| cover.covers(&block));
            blocks.push((block, seen.then_some(pixels.len())));
            if seen {
                block.push_rows(pixels);
            }
        }
        blocks.sort_unstable_by_key(|(block, _)| (block.y, block.x));
    }

    /// Prepares a tile's buffers, with the rays through its pixels' centres where they are needed.
    pub fn begin_tile(
        &self,
        tile: &Tile,
        buffers: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        self.collect_pixels(tile, buffers);
        let count = buffers.pixels.len();
        buffers.estimator.reset(count, self.error);
        buffers.active.clear();
        buffers.active.extend(0..count);
        control.check()?;
        self.trace_center_rays(buffers, control)?;
        if self.shading && self.center_rays && !self.samples {
            self.for_each_row_world(buffers, |world, buffers| {
                self.center_rays_as_samples(world, buffers);
                self.shade(world, buffers, control)
            })?;
        }
        if self.center_rays && self.settings.time.is_none() {
            control.advance();
        }
        Ok(())
    }

    /// The exact rays, where they are needed.
    fn trace_center_rays(
        &self,
        buffers: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        buffers.pixel_worlds.clear();
        if !self.center_rays {
            return Ok(());
        }
        match self.shutter {
            Some(moments) if moments.is_rolling() => {
                self.trace_center_rays_by_row(moments, buffers, control)
            }
            _ => {
                let ThreadScratch {
                    pixels,
                    center_rays: exact,
                    ..
                } = buffers;
                exact.trace(
                    &self.world.geometry,
                    self.camera,
                    pixels,
                    self.settings,
                    self.skip_transparent,
                );
                Ok(())
            }
        }
    }

    /// The exact rays of the active pixels as those of the first sample.
    fn center_rays_as_samples(&self, world: &PreparedWorld, buffers: &mut ThreadScratch) {
        let ThreadScratch {
            pixels,
            center_rays: exact,
            hits,
            origins,
            directions,
            samplers,
            active,
            batch,
            ..
        } = buffers;
        let rays = || active.iter().map(|&i| &exact.rays[i]);
        hits.clear();
        hits.extend(
            active
                .iter()
                .map(|&i| center_rays::to_float_hit(&exact.hits[i])),
        );
        origins.clear();
        origins.extend(rays().map(|ray| DVec3::from(ray.origin) - world.geometry.origin));
        directions.clear();
        directions.extend(rays().map(|ray| DVec3::from(ray.direction).as_vec3()));
        samplers.clear();
        samplers.extend(
            active
                .iter()
                .map(|&i| self.sampler_for(self.sampler_for_pixel(pixels[i]), 0)),
        );
        batch.clear();
        batch.extend(active.iter().map(|&i| (i, 0)));
    }

    /// Adds the radiance of the hits at hand to their pixels' sums.
    fn shade(
        &self,
        world: &PreparedWorld,
        buffers: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        let ThreadScratch {
            center_rays: exact,
            hits,
            origins,
            directions,
            samplers,
            pixels,
            paths: room,
            radiance,
            misses: sky,
            batch: of,
            estimator: estimate,
            ..
        } = buffers;
        let behind = match self.skip_transparent && self.samples && self.coverage {
            true => world.geometry.visible_instances(origins, directions, hits),
            false => vec![],
        };
        let told = exact.ground_truth_hits();
        for (at, (&(pixel, _), hit)) in of.iter().zip(&*hits).enumerate() {
            let seen = behind.get(at).unwrap_or(&hit.instance);
            // A single sample is the ray through the centre itself.
            let same = !self.samples || told.get(pixel).is_some_and(|hit| hit.instance == *seen);
            estimate.add_sample(pixel, same);
        }
        if !self.color {
            return Ok(());
        }
        radiance.clear();
        radiance.resize(hits.len(), Vec3::ZERO);
        sky.clear();
        sky.resize(hits.len(), false);
        let batch = CameraRayBatch {
            scene: self.scene_of(world),
            ray_cone: self.cone,
            origins,
            directions,
            hits,
            samplers,
        };
        integrator::radiance(world, self.settings, &batch, control, room, radiance, sky)?;
        for (&(pixel, _), _) in of.iter().zip(sky).filter(|(_, sky)| **sky) {
            estimate.add_miss(pixel);
        }
        let limit = self.settings.clamp.unwrap_or(f32::INFINITY);
        // Of one pixel there are many in a row.
        let mut last = None;
        for (&(pixel, sample), &mut radiance) in of.iter().zip(radiance) {
            if !(radiance.is_finite() && radiance.min_element() >= 0.0) {
                self.stats.reject();
                continue;
            }
            let gain = match last {
                Some((known, gain)) if known == pixel => gain,
                _ => self
                    .camera
                    .vignetting_factor(self.pixel_center(pixels[pixel]))
                    as f32,
            };
            last = Some((pixel, gain));
            let brightest = radiance.max_element();
            if brightest > limit {
                self.stats.clamp();
                estimate.add_radiance(pixel, sample, radiance * (gain * limit / brightest));
            } else {
                estimate.add_radiance(pixel, sample, radiance * gain);
            }
        }
        Ok(())
    }
}
