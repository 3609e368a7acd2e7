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
        let estimate = &buffers.estimate;
        let mut turned = vec![];
        if self.camera.motion().is_some() {
            let pixels = buffers.pixels.iter();
            turned.extend(pixels.map(|&pixel| self.camera.rotation_at(self.center_of(pixel))));
        }
        let exact = &buffers.exact;
        let told = ChannelReader::new(exact, self.world, &buffers.seen, self.camera.r(), &turned);
        let background = self.cover.as_ref().map_or(&[][..], |(_, pixel)| pixel);
        let mut corners = TriangleCache::new(None);
        let write = |channel: Channel, page: &mut RowWriter| {
            use Channel as C;
            match channel {
                C::Color => page.put(|i| estimate.color(i).to_array()),
                C::Albedo => page.put(|i| told.albedo(i)),
                C::Depth => page.put(|i| [told.depth(i)]),
                C::Distance => page.put(|i| [told.distance(i)]),
                C::Position => page.put(|i| told.position(i)),
                C::Normal => page.put(|i| told.normal(i, |n| n.geometric)),
                C::NormalCamera => page.put(|i| told.in_camera(i, |n| n.geometric)),
                C::ShadingNormal => page.put(|i| told.normal(i, |n| n.shading)),
                C::ShadingNormalCamera => page.put(|i| told.in_camera(i, |n| n.shading)),
                C::Instance => page.put(|i| [told.instance(i)]),
                C::Category => page.put(|i| [told.category(i)]),
                C::Triangle => page.put(|i| [told.triangle(i)]),
                C::Barycentric => page.put(|i| told.barycentric(i)),
                C::Uv => page.put(|i| told.uv(i, &mut corners)),
                C::Material => page.put(|i| [told.material(i)]),
                C::Coverage => page.put(|i| [estimate.coverage(i)]),
                C::Alpha => page.put(|i| [estimate.alpha(i)]),
                C::Error => page.put(|i| [estimate.error(i)]),
            }
        };
        film.write(tile, &buffers.blocks, background, write);
    }

    /// What there is to do for tiles: those that anything may be seen in, which take the longest, then the others, which
    /// are written in rows as long as can be.
    pub fn tasks(&self, tiles: &[Tile]) -> Vec<TileTask> {
        let Some((cover, _)) = &self.cover else {
            return tiles.iter().copied().map(TileTask::Trace).collect();
        };
        let seen = |tile: &&Tile| tile.blocks().any(|block| cover.covers(&block));
        let (seen, blank): (Vec<_>, Vec<_>) = tiles.iter().partition(seen);
        let blank = Tile::joined(blank).into_iter();
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
                let background = self.cover.as_ref().map_or(&[][..], |(_, pixel)| pixel);
                film.fill(tile, background);
                control.advance_by(count * self.passes());
            }
        }
        Ok(())
    }

    /// A pixel of which all rays meet nothing, where that is the same all over the picture.
    pub(crate) fn background(&self) -> Option<Vec<(Channel, ImagePlane)>> {
        let Settings { time, clamp, .. } = self.settings;
        if self.estimated || time.is_some() || self.camera.vignetting().is_some() {
            return None;
        }
        let mut buffers = ThreadScratch {
            exact: CenterRays::nothing(),
            ..ThreadScratch::default()
        };
        let estimate = &mut buffers.estimate;
        estimate.reset(1, false);
        estimate.count(0, true);
        estimate.see_sky(0);
        if self.colored {
            let radiance = integrator::background(self.world, self.settings)?;
            if !(radiance.is_finite() && radiance.min_element() >= 0.0)
                || radiance.max_element() > clamp.unwrap_or(f32::INFINITY)
            {
                return None;
            }
            estimate.add(0, 0, radiance);
        }
        let pixel = [0, 0, 1, 1];
        let mut planes = output_plane::planes(pixel, &self.settings.channels).ok()?;
        let film = Film::new(pixel, planes.iter_mut().map(OutputPlane::of))?;
        for tile in Tile::of_region(pixel) {
            self.lay_out(&tile, &mut buffers);
            self.resolve(&tile, &buffers, &film);
        }
        drop(film);
        Some(planes)
    }
}
