//! Resolve: converts the hits and estimators of a tile to the pixels of the film.

use glam::Vec3;

use crate::control::Control;
use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::film::estimator::PixelEstimator;
use crate::film::film::Film;
use crate::film::image_plane::ImagePlane;
use crate::film::output_plane::{self, OutputPlane};
use crate::film::tile::Tile;
use crate::film::tile_writer::RowWriter;
use crate::ground_truth::center_rays::CenterRays;
use crate::ground_truth::channels::ChannelReader;
use crate::ground_truth::triangle_cache::TriangleCache;
use crate::integrator;
use crate::integrator::passes::Pass;
use crate::settings::Settings;
use crate::tile_renderer::{ThreadScratch, TileRenderer};

/// Unit of work that one thread takes at a time.
pub(crate) enum TileTask {
    /// Tile to be traced.
    Trace(Tile),
    /// Wide tile of background, and the number of tiles that were merged into it.
    Background(Tile, usize),
}

impl TileRenderer<'_> {
    /// Writes a tile's pixels to the film, and adds the tile's counts to the statistics.
    pub fn resolve(&self, tile: &Tile, scratch: &mut ThreadScratch, film: &Film) {
        self.stats.take_counts(&mut scratch.estimator);
        let estimator = &scratch.estimator;
        let mut rotations = vec![];
        if self.camera.motion().is_some() {
            let pixels = scratch.lists.pixels.iter();
            rotations.extend(pixels.map(|&pixel| self.camera.rotation_at(self.pixel_center(pixel))));
        }
        let center_rays = &scratch.truth.center_rays;
        let truth =
            ChannelReader::new(center_rays, self.world, &scratch.truth.pixel_worlds, self.camera.r(), &rotations);
        let background = self.screen_mask.as_ref().map_or(&[][..], |(_, pixel)| pixel);
        let mut corners = TriangleCache::new(None);
        let write = |channel: Channel, rows: &mut RowWriter| {
            use Channel as C;
            let pass =
                || self.settings.channels.iter().filter(|c| c.is_pass()).position(|&c| c == channel).unwrap_or(0);
            match channel {
                C::Color => rows.write(|i| estimator.color(i).to_array()),
                C::Albedo => rows.write(|i| truth.albedo(i)),
                C::Depth => rows.write(|i| [truth.depth(i)]),
                C::Distance => rows.write(|i| [truth.distance(i)]),
                C::Position => rows.write(|i| truth.position(i)),
                C::Normal => rows.write(|i| truth.normal(i, |n| n.geometric)),
                C::NormalCamera => rows.write(|i| truth.in_camera(i, |n| n.geometric)),
                C::ShadingNormal => rows.write(|i| truth.normal(i, |n| n.shading)),
                C::ShadingNormalCamera => rows.write(|i| truth.in_camera(i, |n| n.shading)),
                C::Instance => rows.write(|i| [truth.instance(i)]),
                C::Category => rows.write(|i| [truth.category(i)]),
                C::Triangle => rows.write(|i| [truth.triangle(i)]),
                C::Barycentric => rows.write(|i| truth.barycentric(i)),
                C::Uv => rows.write(|i| truth.uv(i, &mut corners)),
                C::Material => rows.write(|i| [truth.material(i)]),
                C::Coverage => rows.write(|i| [estimator.coverage(i)]),
                C::Alpha => rows.write(|i| [estimator.alpha(i)]),
                C::Shadow => rows.write(|_| [1.0_f32; 3]),
                C::Transmittance => rows.write(|i| truth.transmittance(i)),
                C::Emission | C::Direct | C::Indirect | C::Diffuse | C::Specular | C::Volume | C::Light(_) => {
                    let index = pass();
                    rows.write(|i| estimator.pass(i, index).to_array());
                }
                C::Roughness => rows.write(|i| [truth.roughness(i)]),
                C::Metallic => rows.write(|i| [truth.metallic(i)]),
                C::Nocs => rows.write(|i| truth.nocs(i)),
                C::ProjectorUv => rows.write(|i| truth.projector_uv(i)),
                C::Error => rows.write(|i| [estimator.error(i)]),
            }
        };
        film.write(tile, &scratch.lists.blocks, background, write);
    }

    /// Writes the pixels of a tile whose samples are stored elsewhere.
    pub fn resolve_samples(&self, tile: &Tile, samples: &PixelEstimator, scratch: &mut ThreadScratch, film: &Film) {
        self.collect_pixels(tile, scratch);
        scratch.estimator.clone_from(samples);
        self.resolve(tile, scratch, film);
    }

    /// Returns the tasks of a frame: first the tiles that any object can project to, because they take longest; then
    /// the background tiles, merged into long rows.
    pub fn tasks(&self, tiles: &[Tile]) -> Vec<TileTask> {
        let Some((mask, _)) = &self.screen_mask else {
            return tiles.iter().copied().map(TileTask::Trace).collect();
        };
        let seen = |tile: &&Tile| tile.blocks().any(|block| mask.covers(&block));
        let (seen, blank): (Vec<_>, Vec<_>) = tiles.iter().partition(seen);
        let blank = Tile::merge_rows(blank).into_iter();
        let fill = blank.map(|(tile, count)| TileTask::Background(tile, count));
        seen.into_iter().map(TileTask::Trace).chain(fill).collect()
    }

    /// Runs one task.
    pub fn run_task(
        &self,
        part: &TileTask,
        scratch: &mut ThreadScratch,
        film: &Film,
        control: &Control,
    ) -> Result<(), RenderError> {
        match part {
            TileTask::Trace(tile) => {
                self.trace(tile, scratch, control)?;
                self.resolve(tile, scratch, film);
            }
            TileTask::Background(tile, count) => {
                control.check()?;
                let background = self.screen_mask.as_ref().map_or(&[][..], |(_, pixel)| pixel);
                film.fill(tile, background);
                control.advance_by(count * self.batches_per_tile());
            }
        }
        Ok(())
    }

    /// Channel values of a background pixel, if all background pixels of the image are equal.
    pub(crate) fn background(&self) -> Option<Vec<(Channel, ImagePlane)>> {
        let Settings { time_limit, clamp, .. } = self.settings;
        let has_transmittance = self.settings.channels.contains(&Channel::Transmittance);
        let is_foggy = has_transmittance && self.world.geometry.has_media();
        if self.needs.error || time_limit.is_some() || self.camera.vignetting().is_some() || is_foggy {
            return None;
        }
        let mut scratch = ThreadScratch::default();
        scratch.truth.center_rays = CenterRays::background();
        let estimator = &mut scratch.estimator;
        estimator.reset(1, self.passes.len(), false);
        estimator.add_sample(0, true);
        estimator.add_miss(0);
        if self.needs.color {
            let radiance = integrator::background(self.world, self.settings)?;
            if !(radiance.is_finite() && radiance.min_element() >= 0.0)
                || radiance.max_element() > clamp.unwrap_or(f32::INFINITY)
            {
                return None;
            }
            estimator.add_radiance(0, 0, radiance);
            let own = |pass: &Pass| if *pass == Pass::Emission { radiance } else { Vec3::ZERO };
            estimator.add_passes(0, &self.passes.iter().map(own).collect::<Vec<_>>(), 1.0);
        }
        let pixel = [0, 0, 1, 1];
        let mut planes = output_plane::allocate_planes(pixel, &self.settings.channels).ok()?;
        let film = Film::new(pixel, planes.iter_mut().map(OutputPlane::zeroed))?;
        for tile in Tile::tiles_of(pixel) {
            self.collect_pixels(&tile, &mut scratch);
            self.resolve(&tile, &mut scratch, &film);
        }
        drop(film);
        Some(planes)
    }
}
