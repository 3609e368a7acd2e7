//! What is counted while a picture is made, and what its user is told of it.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::settings::Settings;

#[derive(Default)]
pub(crate) struct RenderStats {
    /// Samples whose radiance is not finite.
    rejected: AtomicU64,
    /// Samples brighter than the settings allow.
    clamped: AtomicU64,
    /// Samples of all pixels together, and pixels that are still too noisy.
    samples: AtomicU64,
    noisy_pixels: AtomicU64,
}

impl RenderStats {
    pub fn reject(&self) {
        self.rejected.fetch_add(1, Ordering::Relaxed);
    }

    pub fn clamp(&self) {
        self.clamped.fetch_add(1, Ordering::Relaxed);
    }

    /// Samples of some pixels, and how many of these are still too noisy.
    pub fn add_samples(&self, samples: u64, unfinished: u64) {
        self.samples.fetch_add(samples, Ordering::Relaxed);
        self.noisy_pixels.fetch_add(unfinished, Ordering::Relaxed);
    }

    /// What the one who looks at a picture of so many pixels should know of its samples.
    pub fn notices(&self, settings: &Settings, pixels: u64, notices: &mut Vec<String>) {
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        if let Some(noise) = settings.noise {
            let mean = of(&self.samples) / pixels;
            let mut notice = format!("{mean} samples per pixel in the mean for noise = {noise}");
            if of(&self.noisy_pixels) > 0 {
                notice += &format!(
                    "; {} pixels have not reached it with samples = {}",
                    of(&self.noisy_pixels),
                    settings.samples
                );
            }
            notices.push(notice);
        }
        if of(&self.rejected) > 0 {
            notices.push(format!(
                "{} samples were too bright for float32 and count as black",
                of(&self.rejected)
            ));
        }
        if let Some(limit) = settings.clamp
            && of(&self.clamped) > 0
        {
            notices.push(format!(
                "{} samples were brighter than clamp = {limit} and count as that: the picture is darker than the world",
                of(&self.clamped)
            ));
        }
    }
}
