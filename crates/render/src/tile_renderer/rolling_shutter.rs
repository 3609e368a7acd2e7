//! Tiles of a moving world: centre rays by row, samples by time slice.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::control::Control;
use crate::error::RenderError;
use crate::film::tile::TILE_SIZE;
use crate::motion::shutter::ShutterSlices;
use crate::prepare::world::PreparedWorld;
use crate::sampling::dimension::Dimension;
use crate::tile_renderer::{GroundTruthBuffers, ThreadScratch, TileRenderer};

impl TileRenderer<'_> {
    /// Traces the centre rays of a rolling shutter, each in the world of its row.
    pub(crate) fn trace_center_rays_by_row(
        &self,
        shutter: &ShutterSlices<'_>,
        scratch: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        let pixels = &scratch.lists.pixels;
        let GroundTruthBuffers { center_rays, pixel_worlds, row_worlds } = &mut scratch.truth;
        for &pixel in pixels {
            let (center, capacity) = (self.pixel_center(pixel), 2 * TILE_SIZE as usize);
            pixel_worlds.push(shutter.cached_row_world(self.camera, center, row_worlds, capacity, control)?);
        }
        center_rays.trace_per_world(pixel_worlds, self.camera, pixels, self.settings, self.needs.skip_transparent);
        Ok(())
    }

    /// Runs `each` for every row's world, with the pixels of that world active.
    pub(crate) fn for_each_row_world(
        &self,
        scratch: &mut ThreadScratch,
        mut each: impl FnMut(&PreparedWorld, &mut ThreadScratch) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        if scratch.truth.pixel_worlds.is_empty() {
            return each(self.world, scratch);
        }
        let all = std::mem::take(&mut scratch.lists.active);
        // The groups are in order of first appearance, so that the order does not depend on addresses.
        let mut groups: Vec<(Arc<PreparedWorld>, Vec<usize>)> = Vec::new();
        for &i in &all {
            let world = &scratch.truth.pixel_worlds[i];
            match groups.iter_mut().find(|(other, _)| Arc::ptr_eq(other, world)) {
                Some((_, pixels)) => pixels.push(i),
                None => groups.push((world.clone(), vec![i])),
            }
        }
        for (world, pixels) in groups {
            scratch.lists.active = pixels;
            each(&world, scratch)?;
        }
        scratch.lists.active = all;
        Ok(())
    }

    /// Traces and shades the batch, each sample in the world of its time slice.
    pub(crate) fn shade_by_time_slice(
        &self,
        shutter: &ShutterSlices<'_>,
        scratch: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        let mut slices: BTreeMap<usize, Vec<(usize, u32)>> = BTreeMap::new();
        for (i, sample) in std::mem::take(&mut scratch.lists.batch) {
            let sampler = self.sampler_for(self.sampler_for_pixel(scratch.lists.pixels[i]), sample);
            let pixel = self.film_position(scratch.lists.pixels[i], sampler.get_2d(Dimension::PixelFilter));
            let (_, part) = self.lens_and_time(&sampler);
            let slice = shutter.slice_index(self.camera, pixel, part);
            slices.entry(slice).or_default().push((i, sample));
        }
        for (slice, some) in slices {
            scratch.lists.batch = some;
            let world = shutter.world_in_slice(slice, control)?;
            self.trace_batch(world, scratch);
            self.shade(world, scratch, control)?;
        }
        Ok(())
    }
}
