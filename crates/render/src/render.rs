//! Rendering of one frame.

use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use raycam_scene::{Camera, Notice, NoticeCode, TextureCache, World};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::film::estimator::PixelEstimator;
use crate::film::film::Film;
use crate::film::frame::Frame;
use crate::film::output_plane::{self, OutputPlane};
use crate::film::tile::Tile;
use crate::guiding_switch::install_guiding;
use crate::integrator::bright_path::BrightPath;
use crate::integrator::passes::passes_of;
use crate::motion::shutter::ShutterSlices;
use crate::prepare::world::PreparedWorld;
use crate::settings::{Integrator, Settings};
use crate::thread_pool::{MAX_WORK_HERE, Workers, with_pool};
use crate::tile_renderer::needs::RenderNeeds;
use crate::tile_renderer::sample_plan::{Pilot, SamplePlan, pilot_region, pilot_settings};
use crate::tile_renderer::{ThreadScratch, TileRenderer};

/// Renders a frame.
///
/// Every pixel has the ground truth of the exact ray through its centre, in float64. Its colour is the mean over
/// `settings.samples` rays distributed by the filter, in float32; a single sample is the centre ray itself. Equal
/// arguments give equal bytes for any number of threads, and a region has the same bytes as in the whole image.
///
/// # Errors
/// [`RenderError::Settings`] for invalid settings, [`RenderError::TooLarge`], [`RenderError::Cancelled`], and errors of
/// `with_pool`.
pub fn render(
    world: &PreparedWorld,
    camera: &Camera,
    settings: &Settings,
    control: &Control,
) -> Result<Frame, RenderError> {
    render_to_frame(world, None, camera, settings, control)
}

/// Same as [`render`], for a world that moves while the camera's shutter is open. `prepared` is `world` at its time,
/// the middle of the shutter's time. A world without a time, or a camera without a shutter, is rendered as by
/// [`render`].
///
/// # Errors
/// Errors of [`render`], and [`RenderError::World`] if the world cannot be evaluated at a time.
pub fn render_moving(
    world: &World,
    prepared: &PreparedWorld,
    camera: &Camera,
    settings: &Settings,
    control: &Control,
) -> Result<Frame, RenderError> {
    let shutter = ShutterSlices::new(world, prepared, camera);
    render_to_frame(prepared, shutter.as_ref(), camera, settings, control)
}

/// Same as [`render_moving`], but writes into the caller's memory: one output plane per channel, in order, as large as
/// [`checked_region`] returns. Returns the region and the notices. After an error the planes contain arbitrary values.
///
/// # Errors
/// Errors of [`render_moving`], and [`RenderError::Settings`] if the planes do not match.
pub fn render_into(
    world: &World,
    prepared: &PreparedWorld,
    camera: &Camera,
    settings: &Settings,
    control: &Control,
    targets: Vec<OutputPlane<'_>>,
) -> Result<([u32; 4], Vec<Notice>), RenderError> {
    let shutter = ShutterSlices::new(world, prepared, camera);
    let region = settings.check(camera.size())?;
    let request = RenderRequest { world: prepared, shutter: shutter.as_ref(), camera, settings, region };
    Ok((region, request.render(false, control, targets.into_iter())?))
}

/// Brightest sample of a pixel: its fraction of the light of all the pixel's samples, and the path along which the
/// light arrived, in world coordinates. `None` if every sample is black.
pub type BrightestSample = Option<(f64, BrightPath)>;

/// Returns the brightest samples of pixels of an image that [`render`] created with the same arguments; `None` for
/// integrators that show no light. The world does not move while the shutter is open.
///
/// # Errors
/// Errors of [`render`], and [`RenderError::Settings`] for pixels outside the image.
pub fn brightest_samples(
    world: &PreparedWorld,
    camera: &Camera,
    settings: &Settings,
    pixels: &[[u32; 2]],
    control: &Control,
) -> Result<Vec<BrightestSample>, RenderError> {
    let region = settings.check(camera.size())?;
    let [width, height] = camera.size();
    if pixels.iter().any(|&[x, y]| x >= width || y >= height) {
        return Err(RenderError::settings(format!(
            "pixels: some are outside the image of {width} x {height}; expected columns 0 to {} and rows 0 to {}",
            width - 1,
            height - 1
        )));
    }
    let camera = &world.geometry.camera_outside(camera);
    let request = RenderRequest { world, shutter: None, camera, settings, region };
    with_pool(settings.threads, || {
        let renderer = request.renderer(camera, settings);
        let found = pixels.par_iter().map_init(ThreadScratch::default, |scratch, &pixel| {
            let mut found = renderer.brightest_path(pixel, scratch, control)?;
            if let Some((_, path)) = &mut found {
                path.origin += world.geometry.origin;
            }
            Ok(found)
        });
        found.collect()
    })?
}

/// True if the calling thread alone can render a frame in a fraction of a millisecond: ground truth or unlit colours of
/// few pixels.
pub fn is_brief(world: &World, prepared: &PreparedWorld, camera: &Camera, settings: &Settings) -> bool {
    let Ok(region) = settings.check(camera.size()) else {
        return true;
    };
    let moves = camera.motion().is_some() && world.time.is_some() && world.is_animated();
    let needs = RenderNeeds::new(settings, camera, &prepared.geometry);
    may_run_here(prepared, moves, settings, needs) && estimated_work(settings, region, needs) <= MAX_WORK_HERE
}

/// True if a frame may be rendered without a thread pool: it shows no colours, or only unlit colours while
/// the lights are already prepared; it has no time limit; and nothing moves.
fn may_run_here(world: &PreparedWorld, moves: bool, settings: &Settings, needs: RenderNeeds) -> bool {
    let unlit = !needs.color || (settings.integrator == Integrator::Flat && world.has_lighting());
    unlit && !moves && settings.time_limit.is_none()
}

/// Estimated time of a frame on one thread, in nanoseconds, from its number of rays.
fn estimated_work(settings: &Settings, [_, _, width, height]: [u32; 4], needs: RenderNeeds) -> f64 {
    let ray = match settings.integrator {
        Integrator::Flat => 40.0,
        Integrator::Direct | Integrator::Ao => 200.0,
        Integrator::Path => 600.0,
    };
    let each = match (needs.samples, needs.color) {
        (true, true) => ray * f64::from(settings.samples) + 40.0,
        (true, false) => 40.0 * (f64::from(settings.samples) + 1.0),
        (false, true) => ray,
        (false, false) => 40.0,
    };
    each * f64::from(width) * f64::from(height)
}

/// Estimated time of a frame on one thread, in nanoseconds.
pub(crate) fn estimated_frame_work(
    world: &PreparedWorld,
    camera: &Camera,
    settings: &Settings,
    region: [u32; 4],
) -> f64 {
    estimated_work(settings, region, RenderNeeds::new(settings, camera, &world.geometry))
}

/// Region of a frame and its number of pixels, if the settings are valid and there is enough memory.
///
/// # Errors
/// [`RenderError::Settings`] and [`RenderError::TooLarge`].
pub fn checked_region(camera: &Camera, settings: &Settings) -> Result<([u32; 4], usize), RenderError> {
    let region = settings.check(camera.size())?;
    Ok((region, output_plane::check_size(region, &settings.channels)?))
}

/// Number of progress bar steps of a frame with a time limit.
const PROGRESS_STEPS: f64 = 1000.0;

fn render_to_frame(
    world: &PreparedWorld,
    shutter: Option<&ShutterSlices<'_>>,
    camera: &Camera,
    settings: &Settings,
    control: &Control,
) -> Result<Frame, RenderError> {
    let region = settings.check(camera.size())?;
    let mut planes = with_pool(settings.threads, || output_plane::allocate_planes(region, &settings.channels))??;
    let request = RenderRequest { world, shutter, camera, settings, region };
    let notices = request.render(false, control, planes.iter_mut().map(OutputPlane::zeroed))?;
    Ok(Frame { size: camera.size(), region, planes, notices })
}

/// Validated arguments of a render.
pub(crate) struct RenderRequest<'a> {
    pub world: &'a PreparedWorld,
    pub shutter: Option<&'a ShutterSlices<'a>>,
    pub camera: &'a Camera,
    pub settings: &'a Settings,
    pub region: [u32; 4],
}

impl RenderRequest<'_> {
    /// Renders and returns the notices. If `alone` is true, only the calling thread is used, which may belong to a
    /// pool.
    pub fn render<'t>(
        &self,
        alone: bool,
        control: &Control,
        targets: impl Iterator<Item = OutputPlane<'t>>,
    ) -> Result<Vec<Notice>, RenderError> {
        let RenderRequest { world, shutter, settings, region, .. } = *self;
        passes_of(settings, world)?;
        let camera = &world.geometry.camera_outside(self.camera);
        let film = Film::new(region, targets);
        let film = film.filter(|film| film.has_channels(&settings.channels));
        let film = film
            .ok_or_else(|| RenderError::settings("the output planes do not match the image's region and channels"))?;
        let texture_cache = world.geometry.texture_cache.as_deref();
        let read_before = texture_cache.map(TextureCache::page_in_stats);
        let needs = RenderNeeds::new(settings, camera, &world.geometry);
        let here = may_run_here(world, shutter.is_some(), settings, needs);
        let workers = match alone {
            true => Workers::Here,
            false => Workers::for_work(settings.threads, estimated_work(settings, region, needs), here)?,
        };
        let tiles = Tile::for_threads(region, workers.count());
        let lit = settings.channels.iter().any(|channel| channel.shows_light());
        let mut notices = if lit { crate::integrator::notices(settings.integrator, world) } else { vec![] };
        notices.extend(shutter.filter(|_| lit && needs.samples).and_then(ShutterSlices::notice));
        match settings.time_limit {
            Some(seconds) if needs.samples => {
                let timed = || self.render_for_duration(camera, seconds, &tiles, &film, control, &mut notices);
                with_pool(settings.threads, timed)??;
            }
            _ => {
                let plan = match settings.noise_threshold {
                    Some(threshold) if needs.samples => Some(self.plan_samples(camera, threshold, &workers, control)?),
                    _ => None,
                };
                let renderer = workers.run(|| self.renderer(camera, settings)).with_plan(plan.as_ref());
                control.start(tiles.len() * renderer.batches_per_tile());
                workers.for_each_dynamic(&renderer.tasks(&tiles), |scratch: &mut ThreadScratch, task| {
                    renderer.run_task(task, scratch, &film, control)
                })?;
                renderer.notices(region, &mut notices);
            }
        }
        if let (Some(memory), Some(before)) = (texture_cache, read_before) {
            memory.check().map_err(RenderError::Textures)?;
            notices.extend(memory.page_in_stats().notice_since(&before));
        }
        Ok(notices)
    }

    /// Number of samples of every pixel, determined by a pilot.
    fn plan_samples(
        &self,
        camera: &Camera,
        threshold: f32,
        workers: &Workers,
        control: &Control,
    ) -> Result<SamplePlan, RenderError> {
        let settings = pilot_settings(self.settings);
        let region = pilot_region(self.region, camera.size());
        let request = RenderRequest { settings: &settings, region, ..*self };
        let renderer = workers.run(|| request.renderer(camera, &settings));
        let (tiles, control) = (Tile::for_threads(region, workers.count()), control.part());
        Pilot::new(region, threshold, settings.samples).run(|samples, is_selected| {
            let found = Mutex::new(vec![]);
            workers.for_each_dynamic(&tiles, |scratch: &mut ThreadScratch, tile| {
                let own = renderer.trace_pilot(tile, samples.clone(), is_selected, scratch, &control)?;
                found.lock().unwrap_or_else(PoisonError::into_inner).extend(own);
                Ok(())
            })?;
            Ok(found.into_inner().unwrap_or_else(PoisonError::into_inner))
        })
    }

    /// Creates the renderer of a frame with these settings.
    fn renderer<'s>(&'s self, camera: &'s Camera, settings: &'s Settings) -> TileRenderer<'s> {
        if RenderNeeds::new(settings, camera, &self.world.geometry).color {
            install_guiding(self.world);
            self.world.prepare_light();
        }
        TileRenderer::new(self.world, self.shutter, camera, settings, self.region)
    }

    /// Traces and resolves tiles for about this time, and adds a notice with the number of samples per pixel. The frame
    /// is equal to a frame with exactly this number of samples; the texture filter, the scene and the sample positions
    /// depend on the number.
    fn render_for_duration(
        &self,
        camera: &Camera,
        seconds: f64,
        tiles: &[Tile],
        film: &Film,
        control: &Control,
        notices: &mut Vec<Notice>,
    ) -> Result<(), RenderError> {
        let start = Instant::now();
        control.start(PROGRESS_STEPS as usize);
        // Estimated number of further samples that fit into the remaining time, after `taken` samples.
        let fit = |taken: u32| {
            let spent = start.elapsed().as_secs_f64();
            (seconds - spent) / (spent / f64::from(taken))
        };
        // One sample is timed to determine how many samples fit into the available time. If there is no time for
        // another sample, this frame is the result.
        let one = Settings { samples: 1, ..self.settings.clone() };
        let first = self.renderer(camera, &one);
        tiles.par_iter().try_for_each_init(ThreadScratch::default, |scratch, tile| {
            first.begin_tile(tile, scratch, control)?;
            first.resolve(tile, scratch, film);
            Ok(())
        })?;
        let planned = Settings { samples: self.settings.samples.min(fit(1) as u32), ..self.settings.clone() };
        let mut taken = 1;
        if planned.samples < 2 {
            first.notices(self.region, notices);
        } else {
            let renderer = self.renderer(camera, &planned);
            taken = self.add_rounds(&renderer, fit, tiles, film, control)?;
            renderer.notices(self.region, notices);
        }
        let again = format!("samples = {taken} reproduces the image");
        notices.insert(
            0,
            Notice::new(
                NoticeCode::SamplesUsed,
                format!("{taken} samples per pixel were rendered in time_limit = {seconds}; {again}"),
            ),
        );
        Ok(())
    }

    /// Adds samples while they fit into the time. Stops only at a number of samples for which a frame has the chosen
    /// texture filter and scene. Returns the number.
    fn add_rounds(
        &self,
        renderer: &TileRenderer,
        fit: impl Fn(u32) -> f64,
        tiles: &[Tile],
        film: &Film,
        control: &Control,
    ) -> Result<u32, RenderError> {
        let mut states: Vec<PixelEstimator> = vec![PixelEstimator::default(); tiles.len()];
        let (mut taken, mut reported, mut round) = (0, 0, 1);
        loop {
            let mut until = self.settings.samples.min(taken + round);
            while until > renderer.settings.samples && !renderer.is_frame_of(until) {
                until -= 1;
            }
            if until <= taken {
                return Ok(taken);
            }
            tiles.par_iter().zip(&mut states).try_for_each_init(ThreadScratch::default, |scratch, (tile, state)| {
                if taken > 0 {
                    renderer.continue_tile(tile, scratch, state, control)?;
                } else {
                    renderer.begin_tile(tile, scratch, control)?;
                }
                renderer.add_samples(scratch, taken..until, control)?;
                renderer.resolve(tile, scratch, film);
                std::mem::swap(&mut scratch.estimator, state);
                Ok(())
            })?;
            taken = until;
            // The next round adds the estimated number of samples that fit into the time, but at most as many
            // as have been added so far.
            let more = fit(taken);
            let done = (PROGRESS_STEPS / (1.0 + more.max(0.0) / f64::from(taken))) as usize;
            control.advance_by(done.saturating_sub(reported));
            reported = done.max(reported);
            if more < 1.0 && renderer.continues(taken) {
                return Ok(taken);
            }
            round = taken.min((more as u32).max(1));
        }
    }
}
