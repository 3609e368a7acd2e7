//! Where the samples of a pixel go.

use glam::DVec2;

use super::Picture;
use crate::estimate::SEQUENCES;
use crate::sampler::{Pair, Sampler};
use crate::settings::Settings;

impl Picture<'_> {
    /// Where a sample of a pixel is.
    pub(super) fn spread(&self, [x, y]: [u32; 2], sampler: &Sampler) -> DVec2 {
        let offset = self.filter.offset(sampler.pair(Pair::Filter));
        self.camera.pixel_center_of(x, y) + DVec2::from(offset)
    }

    /// The point of the aperture and the part of the exposure of a sample.
    pub(super) fn scatter(&self, sampler: &Sampler) -> ([f64; 2], f64) {
        if !self.scattered {
            return ([0.5; 2], 0.5);
        }
        let lens = sampler.pair(Pair::Aperture).map(f64::from);
        (lens, f64::from(sampler.pair(Pair::Exposure)[0]))
    }

    pub(super) fn center_of(&self, [x, y]: [u32; 2]) -> DVec2 {
        self.camera.pixel_center_of(x, y)
    }

    pub(super) fn sampler(&self, pixel: [u32; 2], sample: u32) -> Sampler {
        let Settings { seed, frame, .. } = *self.settings;
        if self.estimated {
            Sampler::of_sequences(seed, frame, pixel, sample, SEQUENCES)
        } else {
            Sampler::new(seed, frame, pixel, sample)
        }
    }
}
