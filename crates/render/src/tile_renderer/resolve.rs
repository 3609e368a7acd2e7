//! From what the rays of a tile have brought to the pixels of the film.

use crate::control::Control;
use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::film::film::Film;
use crate::film::frame::ImagePlane;
use crate::film::output_plane::{self, OutputPlane};
use crate::film::tile::Tile;
use crate::film::tile_writer::RowWriter;
use crate::ground_truth::center_rays::CenterRays;
use crate::ground_truth::channels::{ChannelReader, TriangleCache};
use crate::integrator;
use crate::settings::Settings;
use crate::tile_renderer::{ThreadScratch, TileRenderer};

/// What a thread does at a time.
pub(crate) enum TileTask {
    /// A tile whose rays are traced.
    Trace(Tile),
    /// So many tiles, as one, that show nothing but the background.
    Background(Tile, usize),
}

impl TileRenderer<'_> {
    /// Writes a tile's pixels to the film.
    pub fn resolve(&self, tile: &Tile, buffers: &ThreadScratch, film: &Film) {
        let estimate = &buffers.estimator;
        let mut turned = vec![];
        if self.camera.motion().is_some() {
            let pixels = buffers.pixels.iter();
            turned.extend(pixels.map(|&pixel| self.camera.rotation_at(self.pixel_center(pixel))));
        }
        let exact = &buffers.center_rays;
        let told = ChannelReader::new(
            exact,
            &self.world.geometry,
            &buffers.pixel_worlds,
            self.camera.r(),
            &turned,
        );
        let background = self
            .screen_mask
            .as_ref()
            .map_or(&[][..], |(_, pixel)| pixel);
        let mut corners = TriangleCache::new(None);
        let write = |channel: Channel, page: &mut RowWriter| {
            use Channel as C;
            match channel {
                C::Color => page.write(|i| estimate.color(i).to_array()),
                C::Albedo => page.write(|i| told.albedo(i)),
                C::Depth => page.write(|i| [told.depth(i)]),
                C::Distance => page.write(|i| [told.distance(i)]),
                C::Position => page.write(|i| told.position(i)),
                C::Normal => page.write(|i| told.normal(i, |n| n.geometric)),
                C::NormalCamera => page.write(|i| told.in_camera(i, |n| n.geometric)),
                C::ShadingNormal => page.write(|i| told.normal(i, |n| n.shading)),
                C::ShadingNormalCamera => page.write(|i| told.in_camera(i, |n| n.shading)),
                C::Instance => page.write(|i| [told.instance(i)]),
                C::Category => page.write(|i| [told.category(i)]),
                C::Triangle => page.write(|i| [told.triangle(i)]),
                C::Barycentric => page.write(|i| told.barycentric(i)),
                C::Uv => page.write(|i| told.uv(i, &mut corners)),
                C::Material => page.write(|i| [told.material(i)]),
                C::Coverage => page.write(|i| [estimate.coverage(i)]),
                C::Alpha => page.write(|i| [estimate.alpha(i)]),
                C::Error => page.write(|i| [estimate.error(i)]),
            }
        };
        film.write(tile, &buffers.blocks, background, write);
    }

    /// What there is to do for tiles: those that anything may be seen in, which take the longest, then the others, which
    /// are written in rows as long as can be.
    pub fn tasks(&self, tiles: &[Tile]) -> Vec<TileTask> {
        let Some((cover, _)) = &self.screen_mask else {
            return tiles.iter().copied().map(TileTask::Trace).collect();
        };
        let seen = |tile: &&Tile| tile.blocks().any(|block| cover.covers(&block));
        let (seen, blank): (Vec<_>, Vec<_>) = tiles.iter().partition(seen);
        let blank = Tile::merge_rows(blank).into_iter();
        let fill = blank.map(|(tile, count)| TileTask::Background(tile, count));
        seen.into_iter().map(TileTask::Trace).chain(fill).collect()
    }

    /// Does it, one part.
    pub fn run_task(
        &self,
        part: &TileTask,
        buffers: &mut ThreadScratch,
        film: &Film,
        control: &Control,
    ) -> Result<(), RenderError> {
        match part {
            TileTask::Trace(tile) => {
                self.trace(tile, buffers, control)?;
                self.resolve(tile, buffers, film);
            }
            TileTask::Background(tile, count) => {
                control.check()?;
                let background = self
                    .screen_mask
                    .as_ref()
                    .map_or(&[][..], |(_, pixel)| pixel);
                film.fill(tile, background);
                control.advance_by(count * self.batches_per_tile());
            }
        }
        Ok(())
    }

    /// A pixel of which all rays meet nothing, where that is the same all over the picture.
    pub(crate) fn background(&self) -> Option<Vec<(Channel, ImagePlane)>> {
        let Settings { time, clamp, .. } = self.settings;
        if self.error || time.is_some() || self.camera.vignetting().is_some() {
            return None;
        }
        let mut buffers = ThreadScratch {
            center_rays: CenterRays::background(),
            ..ThreadScratch::default()
        };
        let estimate = &mut buffers.estimator;
        estimate.reset(1, false);
        estimate.add_sample(0, true);
        estimate.add_miss(0);
        if self.color {
            let radiance = integrator::background(self.world, self.settings)?;
            if !(radiance.is_finite() && radiance.min_element() >= 0.0)
                || radiance.max_element() > clamp.unwrap_or(f32::INFINITY)
            {
                return None;
            }
            estimate.add_radiance(0, 0, radiance);
        }
        let pixel = [0, 0, 1, 1];
        let mut planes = output_plane::allocate_planes(pixel, &self.settings.channels).ok()?;
        let film = Film::new(pixel, planes.iter_mut().map(OutputPlane::zeroed))?;
        for tile in Tile::tiles_of(pixel) {
            self.collect_pixels(&tile, &mut buffers);
            self.resolve(&tile, &buffers, &film);
        }
        drop(film);
        Some(planes)
    }
}
