//! The pixels of a tile, of a world that moves while the shutter is open.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::control::Control;
use crate::error::RenderError;
use crate::film::tile::TILE;
use crate::motion::shutter::Moments;
use crate::prepare::PreparedWorld;
use crate::sampling::sampler::Pair;
use crate::tile_renderer::{Buffers, Picture};

impl Picture<'_> {
    /// The exact rays of pixels whose lines open one after another.
    pub(crate) fn look_by_lines(
        &self,
        moments: &Moments<'_>,
        buffers: &mut Buffers,
        control: &Control,
    ) -> Result<(), RenderError> {
        let Buffers {
            pixels,
            exact,
            seen,
            lines,
            ..
        } = buffers;
        for &pixel in &*pixels {
            let (at, most) = (self.center_of(pixel), 2 * TILE as usize);
            seen.push(moments.of_line(self.camera, at, lines, most, control)?);
        }
        exact.find_each(seen, self.camera, pixels, self.settings, self.passing);
        Ok(())
    }

    /// Does the same to the active pixels of each world in turn that their exact rays see.
    pub(crate) fn by_lines(
        &self,
        buffers: &mut Buffers,
        mut each: impl FnMut(&PreparedWorld, &mut Buffers) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        if buffers.seen.is_empty() {
            return each(self.world, buffers);
        }
        let all = std::mem::take(&mut buffers.active);
        // In the order in which they come, so that it does not depend on addresses.
        let mut groups: Vec<(Arc<PreparedWorld>, Vec<usize>)> = Vec::new();
        for &i in &all {
            let world = &buffers.seen[i];
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
    pub(crate) fn shade_moving(
        &self,
        moments: &Moments<'_>,
        buffers: &mut Buffers,
        control: &Control,
    ) -> Result<(), RenderError> {
        let mut slices: BTreeMap<usize, Vec<(usize, u32)>> = BTreeMap::new();
        for (i, sample) in std::mem::take(&mut buffers.batch) {
            let sampler = self.sample_of(self.sampler(buffers.pixels[i]), sample);
            let pixel = self.spread(buffers.pixels[i], sampler.pair(Pair::Filter));
            let (_, part) = self.scatter(&sampler);
            let slice = moments.slice(self.camera, pixel, part);
            slices.entry(slice).or_default().push((i, sample));
        }
        for (slice, some) in slices {
            buffers.batch = some;
            let world = moments.of_slice(slice, control)?;
            self.trace_batch(world, buffers);
            self.shade(world, buffers, control)?;
        }
        Ok(())
    }
}
