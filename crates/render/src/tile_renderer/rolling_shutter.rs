//! The pixels of a tile, of a world that moves while the shutter is open.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::control::Control;
use crate::error::RenderError;
use crate::film::tile::TILE_SIZE;
use crate::motion::shutter::ShutterSlices;
use crate::prepare::world::PreparedWorld;
use crate::sampling::dimension::Dimension;
use crate::tile_renderer::{ThreadScratch, TileRenderer};

impl TileRenderer<'_> {
    /// The exact rays of pixels whose lines open one after another.
    pub(crate) fn trace_center_rays_by_row(
        &self,
        moments: &ShutterSlices<'_>,
        buffers: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        let ThreadScratch {
            pixels,
            center_rays: exact,
            pixel_worlds: seen,
            row_worlds: lines,
            ..
        } = buffers;
        for &pixel in &*pixels {
            let (at, most) = (self.pixel_center(pixel), 2 * TILE_SIZE as usize);
            seen.push(moments.cached_row_world(self.camera, at, lines, most, control)?);
        }
        exact.trace_per_world(
            seen,
            self.camera,
            pixels,
            self.settings,
            self.skip_transparent,
        );
        Ok(())
    }

    /// Does the same to the active pixels of each world in turn that their exact rays see.
    pub(crate) fn for_each_row_world(
        &self,
        buffers: &mut ThreadScratch,
        mut each: impl FnMut(&PreparedWorld, &mut ThreadScratch) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        if buffers.pixel_worlds.is_empty() {
            return each(self.world, buffers);
        }
        let all = std::mem::take(&mut buffers.active);
        // In the order in which they come, so that it does not depend on addresses.
        let mut groups: Vec<(Arc<PreparedWorld>, Vec<usize>)> = Vec::new();
        for &i in &all {
            let world = &buffers.pixel_worlds[i];
            match groups
                .iter_mut()
                .find(|(other, _)| Arc::ptr_eq(other, world))
            {
                Some((_, pixels)) => pixels.push(i),
                None => groups.push((world.clone(), vec![i])),
            }
        }
        for (world, pixels) in groups {
            buffers.active = pixels;
            each(&world, buffers)?;
        }
        buffers.active = all;
        Ok(())
    }

    /// The batch at hand, each sample of the world in the slice of time in which it sees it.
    pub(crate) fn shade_by_time_slice(
        &self,
        moments: &ShutterSlices<'_>,
        buffers: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        let mut slices: BTreeMap<usize, Vec<(usize, u32)>> = BTreeMap::new();
        for (i, sample) in std::mem::take(&mut buffers.batch) {
            let sampler = self.sampler_for(self.sampler_for_pixel(buffers.pixels[i]), sample);
            let pixel =
                self.film_position(buffers.pixels[i], sampler.get_2d(Dimension::PixelFilter));
            let (_, part) = self.lens_and_time(&sampler);
            let slice = moments.slice_index(self.camera, pixel, part);
            slices.entry(slice).or_default().push((i, sample));
        }
        for (slice, some) in slices {
            buffers.batch = some;
            let world = moments.world_in_slice(slice, control)?;
            self.trace_batch(world, buffers);
            self.shade(world, buffers, control)?;
        }
        Ok(())
    }
}
