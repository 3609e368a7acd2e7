//! One camera's picture of a prepared world.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec2, DVec3, Vec3};
use raycam_bvh::{Coherence, ExactHit, ExactRay, Hit, Ray};
use raycam_scene::Camera;
use rayon::prelude::*;

use crate::channel::Channel;
use crate::control::Control;
use crate::error::RenderError;
use crate::film::{self, Film, Strip};
use crate::filter::PreparedFilter;
use crate::frame::Frame;
use crate::integrator::{self, Batch};
use crate::prepare::PreparedWorld;
use crate::sampler::{Pair, Sampler};
use crate::settings::Settings;
use crate::threads::with_pool;
use crate::tile::Tile;
use crate::truth::{self, Truth, put};

/// Renders what a camera sees.
///
/// Every pixel has the ground truth of the exact ray through its centre, found in float64. Its colour is the mean over
/// `settings.samples` rays spread by the filter, found in float32; a single sample is the exact ray itself. The same
/// arguments give the same bytes, whatever the threads; a region has the bytes it has in the whole picture.
///
/// # Errors
/// [`RenderError::Settings`] for settings that no picture can be made from, [`RenderError::TooLarge`],
/// [`RenderError::Cancelled`], and those of [`with_pool`].
pub fn render(
    world: &PreparedWorld,
    camera: &Camera,
    settings: &Settings,
    control: &Control,
) -> Result<Frame, RenderError> {
    let region = settings.check(camera.size())?;
    let mut planes = film::planes(region, &settings.channels)?;
    let picture = Picture::new(world, camera, settings);
    let tiles = Tile::of_region(region);
    control.start(tiles.len() * picture.passes());
    let film = Film::new(region, &mut planes);
    with_pool(settings.threads, || {
        tiles
            .par_iter()
            .try_for_each_init(Buffers::default, |buffers, tile| {
                picture.trace(tile, buffers, control)?;
                picture.develop(tile, buffers, &film);
                Ok(())
            })
    })??;
    let mut notices = settings.integrator.notices(world);
    let rejected = picture.rejected.into_inner();
    if rejected > 0 {
        notices.push(format!(
            "{rejected} samples were too bright for float32 and count as black"
        ));
    }
    let clamped = picture.clamped.into_inner();
    if let Some(limit) = settings.clamp
        && clamped > 0
    {
        notices.push(format!(
            "{clamped} samples were brighter than clamp = {limit} and count as that: the picture is darker than the world"
        ));
    }
    Ok(Frame {
        size: camera.size(),
        region,
        planes,
        notices,
    })
}

/// All that the tiles of one picture share.
struct Picture<'a> {
    world: &'a PreparedWorld,
    camera: &'a Camera,
    settings: &'a Settings,
    filter: PreparedFilter,
    /// Whether pixel-centre rays are needed, and whether samples are.
    exact: bool,
    sampled: bool,
    colored: bool,
    /// Samples whose radiance is not finite.
    rejected: AtomicU64,
    /// Samples brighter than the settings allow.
    clamped: AtomicU64,
}

/// What a thread needs for a tile; kept from tile to tile.
#[derive(Default)]
struct Buffers {
    pixels: Vec<[u32; 2]>,
    exact_rays: Vec<ExactRay>,
    exact_hits: Vec<ExactHit>,
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    /// Scene-local.
    origins: Vec<DVec3>,
    directions: Vec<Vec3>,
    samplers: Vec<Sampler>,
    radiance: Vec<Vec3>,
    /// Sums over the samples.
    color: Vec<DVec3>,
    same: Vec<u32>,
}

impl<'a> Picture<'a> {
    fn new(world: &'a PreparedWorld, camera: &'a Camera, settings: &'a Settings) -> Self {
        let asked = |channel| settings.channels.contains(&channel);
        let single = settings.samples == 1;
        Self {
            world,
            camera,
            settings,
            filter: PreparedFilter::new(settings.filter),
            exact: single || settings.channels.iter().any(|channel| channel.is_truth()),
            sampled: !single && (asked(Channel::Color) || asked(Channel::Coverage)),
            colored: asked(Channel::Color),
            rejected: AtomicU64::new(0),
            clamped: AtomicU64::new(0),
        }
    }

    /// Batches of rays per tile.
    fn passes(&self) -> usize {
        usize::from(self.exact)
            + if self.sampled {
                self.settings.samples as usize
            } else {
                0
            }
    }

    /// Traces all rays of a tile.
    fn trace(
        &self,
        tile: &Tile,
        buffers: &mut Buffers,
        control: &Control,
    ) -> Result<(), RenderError> {
        tile.pixels(&mut buffers.pixels);
        let count = buffers.pixels.len();
        buffers.color.clear();
        buffers.color.resize(count, DVec3::ZERO);
        buffers.same.clear();
        buffers.same.resize(count, 0);
        if self.exact {
            control.check()?;
            self.trace_exact(buffers);
            if !self.sampled {
                self.shade(buffers, control)?;
            }
            control.advance();
        }
        if self.sampled {
            for sample in 0..self.settings.samples {
                control.check()?;
                self.trace_sample(buffers, sample);
                self.shade(buffers, control)?;
                control.advance();
            }
        }
        Ok(())
    }

    /// The rays through the pixels' centres, in float64. Their hits also are those of the first sample.
    fn trace_exact(&self, buffers: &mut Buffers) {
        let Buffers {
            pixels,
            exact_rays,
            exact_hits,
            hits,
            origins,
            directions,
            samplers,
            ..
        } = buffers;
        exact_rays.clear();
        exact_rays.extend(pixels.iter().map(|&[x, y]| {
            let (origin, direction) = self.camera.ray(self.camera.pixel_center_of(x, y));
            ExactRay {
                origin: origin.to_array(),
                direction: direction.to_array(),
                t_max: f64::INFINITY,
            }
        }));
        exact_hits.clear();
        exact_hits.resize(pixels.len(), ExactHit::MISS);
        self.world
            .scene
            .closest_exact(exact_rays, self.world, exact_hits);
        if !self.sampled {
            hits.clear();
            hits.extend(exact_hits.iter().map(truth::rounded));
            origins.clear();
            origins.extend(
                exact_rays
                    .iter()
                    .map(|ray| DVec3::from(ray.origin) - self.world.origin),
            );
            directions.clear();
            directions.extend(
                exact_rays
                    .iter()
                    .map(|ray| DVec3::from(ray.direction).as_vec3()),
            );
            samplers.clear();
            samplers.extend(pixels.iter().map(|&pixel| self.sampler(pixel, 0)));
        }
    }

    /// One ray per pixel, in float32.
    fn trace_sample(&self, buffers: &mut Buffers, sample: u32) {
        let Buffers {
            pixels,
            rays,
            hits,
            origins,
            directions,
            samplers,
            ..
        } = buffers;
        rays.clear();
        origins.clear();
        directions.clear();
        samplers.clear();
        for &mut [x, y] in pixels {
            let sampler = self.sampler([x, y], sample);
            let offset = self.filter.offset(sampler.pair(Pair::Filter));
            let pixel = self.camera.pixel_center_of(x, y) + DVec2::from(offset);
            let (origin, direction) = self.camera.ray(pixel);
            rays.push(self.world.local_ray(origin, direction, f64::INFINITY).0);
            origins.push(origin - self.world.origin);
            directions.push(direction.as_vec3());
            samplers.push(sampler);
        }
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        self.world.scene.closest(rays, hits, Coherence::Coherent);
    }

    fn sampler(&self, pixel: [u32; 2], sample: u32) -> Sampler {
        Sampler::new(self.settings.seed, self.settings.frame, pixel, sample)
    }

    /// Adds the radiance of the hits at hand to the pixels' sums.
    fn shade(&self, buffers: &mut Buffers, control: &Control) -> Result<(), RenderError> {
        let Buffers {
            exact_hits,
            hits,
            origins,
            directions,
            samplers,
            radiance,
            color,
            same,
            ..
        } = buffers;
        for ((same, hit), exact) in same.iter_mut().zip(&*hits).zip(&*exact_hits) {
            *same += u32::from(hit.instance == exact.instance);
        }
        if !self.colored {
            return Ok(());
        }
        radiance.clear();
        radiance.resize(hits.len(), Vec3::ZERO);
        let batch = Batch {
            origins,
            directions,
            hits,
            samplers,
        };
        integrator::radiance(self.world, self.settings, &batch, control, radiance)?;
        let limit = self.settings.clamp.unwrap_or(f32::INFINITY);
        for (sum, &mut radiance) in color.iter_mut().zip(radiance) {
            if !(radiance.is_finite() && radiance.min_element() >= 0.0) {
                self.rejected.fetch_add(1, Ordering::Relaxed);
                continue;
            }
            let brightest = radiance.max_element();
            if brightest > limit {
                self.clamped.fetch_add(1, Ordering::Relaxed);
                *sum += radiance.as_dvec3() * f64::from(limit / brightest);
            } else {
                *sum += radiance.as_dvec3();
            }
        }
        Ok(())
    }

    /// Writes a tile's pixels to the film.
    fn develop(&self, tile: &Tile, buffers: &Buffers, film: &Film) {
        let samples = self.settings.samples;
        let camera_from_world = self.camera.r();
        let truth = |i: usize| Truth {
            world: self.world,
            camera_from_world,
            origin: buffers.exact_rays[i].origin.into(),
            direction: buffers.exact_rays[i].direction.into(),
            hit: buffers.exact_hits[i],
        };
        let color = |i: usize| (buffers.color[i] / f64::from(samples)).as_vec3().to_array();
        let coverage = |i: usize| (f64::from(buffers.same[i]) / f64::from(samples)) as f32;
        film.write(tile, &buffers.pixels, |channel, strip, places| {
            if truth::write(channel, strip, places, truth) {
                return;
            }
            match (channel, strip) {
                (Channel::Color, Strip::F32(strip)) => put(strip, places, color),
                (Channel::Coverage, Strip::F32(strip)) => put(strip, places, |i| [coverage(i)]),
                (channel, _) => {
                    unreachable!("{channel:?} is stored as its row in the channel table says")
                }
            }
        });
    }
}
