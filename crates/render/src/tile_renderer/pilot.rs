//! Samples of adaptive images: the pilot's samples, and the shown samples.

use std::ops::Range;

use crate::control::Control;
use crate::error::RenderError;
use crate::film::tile::Tile;
use crate::tile_renderer::sample_plan::{SamplePlan, StageVariances};
use crate::tile_renderer::{ThreadScratch, TileRenderer};

impl TileRenderer<'_> {
    /// Traces a stage's samples of the selected pixels in a tile; returns the pixels' variances.
    pub fn trace_pilot(
        &self,
        tile: &Tile,
        samples: Range<u32>,
        is_selected: &(dyn Fn([u32; 2]) -> bool + Sync),
        scratch: &mut ThreadScratch,
        control: &Control,
    ) -> Result<StageVariances, RenderError> {
        self.begin_tile(tile, scratch, control)?;
        let lists = &mut scratch.lists;
        lists.active.retain(|&at| is_selected(lists.pixels[at]));
        if lists.active.is_empty() {
            return Ok(vec![]);
        }
        let count = (samples.end - samples.start) as f32;
        self.add_samples(scratch, samples, control)?;
        let variance = |&at: &usize| (scratch.lists.pixels[at], scratch.estimator.error(at).powi(2) * count);
        Ok(scratch.lists.active.iter().map(variance).collect())
    }

    /// Traces the planned number of samples of every pixel of a tile.
    pub(crate) fn add_planned_samples(
        &self,
        plan: &SamplePlan,
        scratch: &mut ThreadScratch,
        control: &Control,
    ) -> Result<(), RenderError> {
        let counts: Vec<u32> = scratch.lists.pixels.iter().map(|&pixel| plan.samples(pixel)).collect();
        let mut rounds = counts.clone();
        rounds.sort_unstable();
        rounds.dedup();
        let mut taken = 0;
        for until in rounds {
            scratch.lists.active.retain(|&pixel| counts[pixel] > taken);
            self.add_samples(scratch, taken..until, control)?;
            taken = until;
        }
        control.advance_by((self.settings.samples - taken) as usize);
        let (estimator, limit) = (&scratch.estimator, self.settings.samples);
        let is_noisy = |&at: &usize| {
            counts[at] == limit && self.settings.noise_threshold.is_some_and(|noise| estimator.error(at) > noise)
        };
        let noisy = (0..counts.len()).filter(is_noisy).count() as u64;
        let samples = counts.iter().map(|&count| u64::from(count)).sum();
        self.stats.add_samples(samples, noisy);
        Ok(())
    }
}
