//! Progressive frame: samples are added in slices while the image is shown.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use raycam_scene::{Camera, Notice, World};

use crate::control::Control;
use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::film::estimator::PixelEstimator;
use crate::film::film::Film;
use crate::film::output_plane::OutputPlane;
use crate::film::tile::Tile;
use crate::guiding_switch::install_guiding;
use crate::integrator::passes::passes_of;
use crate::motion::shutter::ShutterSlices;
use crate::prepare::world::PreparedWorld;
use crate::settings::{Catchers, Settings};
use crate::thread_pool::Workers;
use crate::tile_renderer::{ThreadScratch, TileRenderer};

/// Number of samples after each of the first rounds of [`Progressive::add_for`]. These rounds are small,
/// because a round up to 16 samples may change the texture filter and the BVH, so that tiles start from
/// scratch.
const FIRST_ROUNDS: [u32; 4] = [2, 4, 8, 16];
/// Maximum number of samples that a later round adds. Each round doubles the number of samples up to this maximum,
/// because larger rounds trace more rays through the same triangles.
const LARGEST_ROUND: u32 = 64;

/// Frame to which samples are added. Each tile has its own number of samples. At any time, its pixels are bit-identical
/// to the pixels of an image by [`render`](crate::render()) with this number of samples, for any slices, regions,
/// cancellations and threads.
pub struct Progressive {
    world: Arc<World>,
    prepared: Arc<PreparedWorld>,
    camera: Camera,
    settings: Settings,
    region: [u32; 4],
    /// Tiles from the centre outwards.
    tiles: Vec<Mutex<ProgressiveTile>>,
}

/// Tile and its number of samples.
struct ProgressiveTile {
    tile: Tile,
    samples: u32,
    estimator: PixelEstimator,
}

impl Progressive {
    /// Returns a frame without samples. `settings.samples` is the number at which [`Progressive::add_for`] ends.
    ///
    /// # Errors
    /// [`RenderError::Settings`] for invalid settings, for a noise threshold or a time limit, for shadow catchers that
    /// are not shown as surfaces, and for channels that do not depend on samples, such as ground truth.
    pub fn new(
        world: Arc<World>,
        prepared: Arc<PreparedWorld>,
        camera: &Camera,
        settings: Settings,
    ) -> Result<Self, RenderError> {
        let fail = |message: &str| Err(RenderError::settings(message));
        let region = settings.check(camera.size())?;
        if settings.noise_threshold.is_some() || settings.time_limit.is_some() {
            return fail(
                "noise_threshold and time_limit are not supported by progressive images, to which the caller adds \
                 samples; use render",
            );
        }
        if settings.catchers != Catchers::Show {
            return fail("progressive images do not support shadow catchers; use render");
        }
        for channel in &settings.channels {
            if !channel.depends_on_samples() {
                let name = channel.name();
                return fail(&format!(
                    "channel {name:?} does not depend on samples and cannot be progressive; use render"
                ));
            }
        }
        passes_of(&settings, &prepared)?;
        let camera = prepared.geometry.camera_outside(camera);
        let workers = Workers::for_work(settings.threads, f64::INFINITY, false)?;
        let mut tiles = Tile::for_threads(region, workers.count());
        let [x, y, width, height] = region;
        let middle = [2 * x + width, 2 * y + height];
        tiles.sort_by_key(|tile| {
            let [dx, dy] = [2 * tile.x + tile.width, 2 * tile.y + tile.height].map(u64::from);
            dx.abs_diff(u64::from(middle[0])).pow(2) + dy.abs_diff(u64::from(middle[1])).pow(2)
        });
        let empty = |tile| Mutex::new(ProgressiveTile { tile, samples: 0, estimator: PixelEstimator::default() });
        let tiles = tiles.into_iter().map(empty).collect();
        Ok(Self { world, prepared, camera, settings, region, tiles })
    }

    /// Rectangle of the image that is rendered: x, y, width, height.
    pub fn region(&self) -> [u32; 4] {
        self.region
    }

    /// Channels of the frame.
    pub fn channels(&self) -> &[Channel] {
        &self.settings.channels
    }

    /// The smallest number of samples among the pixels of a region (default: the whole image).
    pub fn samples(&self, region: Option<[u32; 4]>) -> u32 {
        self.tiles_in(region).map(|one| one.samples).min().unwrap_or(0)
    }

    fn tiles_in(&self, region: Option<[u32; 4]>) -> impl Iterator<Item = MutexGuard<'_, ProgressiveTile>> {
        let tiles = self.tiles.iter().map(|one| one.lock().unwrap_or_else(PoisonError::into_inner));
        tiles.filter(move |one| region.is_none_or(|region| one.tile.overlaps(region)))
    }

    /// Adds samples to every tile of a region (default: the whole image) that has fewer than `until` samples.
    ///
    /// # Errors
    /// [`RenderError::Cancelled`], after which each tile keeps the samples that it has; errors of [`crate::render()`].
    pub fn add(&mut self, until: u32, region: Option<[u32; 4]>, control: &Control) -> Result<(), RenderError> {
        Settings { samples: until.max(1), ..self.settings.clone() }.check(self.camera.size())?;
        self.add_until(until, region, None, control)
    }

    /// Adds samples for about this time, first to the tiles that have the fewest. Stops after a complete tile, and at
    /// the settings' number of samples. Returns the smallest number of samples among the tiles.
    ///
    /// # Errors
    /// Errors of [`Progressive::add`].
    pub fn add_for(&mut self, time: Duration, control: &Control) -> Result<u32, RenderError> {
        let end = Instant::now().checked_add(time);
        loop {
            let least = self.samples(None);
            if least >= self.settings.samples {
                return Ok(least);
            }
            let first = FIRST_ROUNDS.into_iter().find(|&round| round > least);
            let until = first.unwrap_or(least.saturating_add(least.min(LARGEST_ROUND))).min(self.settings.samples);
            self.add_until(until, None, end, control)?;
            if end.is_some_and(|end| Instant::now() >= end) {
                return Ok(self.samples(None));
            }
        }
    }

    fn add_until(
        &mut self,
        until: u32,
        region: Option<[u32; 4]>,
        end: Option<Instant>,
        control: &Control,
    ) -> Result<(), RenderError> {
        let wanted =
            |one: &ProgressiveTile| one.samples < until && region.is_none_or(|region| one.tile.overlaps(region));
        let locked = |one: &Mutex<ProgressiveTile>| wanted(&one.lock().unwrap_or_else(PoisonError::into_inner));
        let tiles: Vec<&Mutex<ProgressiveTile>> = self.tiles.iter().filter(|one| locked(one)).collect();
        if tiles.is_empty() {
            return Ok(());
        }
        let settings = Settings { samples: until, ..self.settings.clone() };
        let shutter = ShutterSlices::new(&self.world, &self.prepared, &self.camera);
        let workers = Workers::for_work(settings.threads, f64::INFINITY, false)?;
        let renderer = workers.run(|| {
            install_guiding(&self.prepared);
            self.prepared.prepare_light();
            TileRenderer::new(&self.prepared, shutter.as_ref(), &self.camera, &settings, self.region)
        });
        // Each thread completes at least one tile, so that even a short time makes progress.
        let begun = AtomicUsize::new(0);
        workers.for_each_dynamic(&tiles, |scratch: &mut ThreadScratch, one| {
            let is_first = begun.fetch_add(1, Ordering::Relaxed) < workers.count();
            match end {
                Some(end) if !is_first && Instant::now() >= end => Ok(()),
                _ => one.lock().unwrap_or_else(PoisonError::into_inner).add(&renderer, scratch, control),
            }
        })?;
        self.prepared
            .geometry
            .texture_cache
            .as_deref()
            .map_or(Ok(()), |memory| memory.check().map_err(RenderError::Textures))
    }

    /// Writes the image into the caller's memory: an output plane per channel, in order, as large as the region.
    /// Returns the notices.
    ///
    /// # Errors
    /// [`RenderError::Settings`] if a pixel has no sample, or if the planes do not match.
    pub fn develop(&self, targets: Vec<OutputPlane<'_>>) -> Result<Vec<Notice>, RenderError> {
        let fail = |message: &str| Err(RenderError::settings(message));
        let samples = self.samples(None);
        if samples == 0 {
            return fail("a part of the image has no samples yet; add samples first");
        }
        let film = Film::new(self.region, targets.into_iter());
        let Some(film) = film.filter(|film| film.has_channels(&self.settings.channels)) else {
            return fail(
                "the output planes do not match the image's region and channels; expected one plane of that \
                size per channel",
            );
        };
        let settings = Settings { samples, ..self.settings.clone() };
        let shutter = ShutterSlices::new(&self.world, &self.prepared, &self.camera);
        let workers = Workers::for_work(settings.threads, f64::INFINITY, false)?;
        let renderer =
            workers.run(|| TileRenderer::new(&self.prepared, shutter.as_ref(), &self.camera, &settings, self.region));
        workers.for_each_dynamic(&self.tiles, |scratch: &mut ThreadScratch, one| {
            let one = one.lock().unwrap_or_else(PoisonError::into_inner);
            renderer.resolve_samples(&one.tile, &one.estimator, scratch, &film);
            Ok(())
        })?;
        let lit = self.channels().iter().any(|channel| channel.shows_light());
        let mut notices = if lit { crate::integrator::notices(settings.integrator, &self.prepared) } else { vec![] };
        renderer.notices(self.region, &mut notices);
        Ok(notices)
    }
}

impl ProgressiveTile {
    /// Adds samples up to the number in the renderer's settings. A tile starts from scratch if its samples
    /// are not among the samples of a frame with that number: a single sample is the centre ray, a few
    /// samples have a wider texture filter, and a larger number may justify another BVH. After an error the
    /// tile is unchanged.
    fn add(
        &mut self,
        renderer: &TileRenderer,
        scratch: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        let until = renderer.settings.samples;
        let kept = if self.samples > 0 && renderer.continues(self.samples) { self.samples } else { 0 };
        if kept > 0 {
            renderer.continue_tile(&self.tile, scratch, &mut self.estimator.clone(), control)?;
        } else {
            renderer.begin_tile(&self.tile, scratch, control)?;
        }
        if renderer.needs.samples {
            renderer.add_samples(scratch, kept..until, control)?;
        }
        self.estimator = std::mem::take(&mut scratch.estimator);
        self.samples = until;
        Ok(())
    }
}
