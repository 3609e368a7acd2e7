//! Counters of a render, and the notices created from them.

use std::sync::atomic::{AtomicU64, Ordering};

use raycam_scene::{Notice, NoticeCode, counted};

use crate::film::estimator::PixelEstimator;
use crate::settings::Settings;

/// Counters of a render, updated by all threads.
#[derive(Default)]
pub(crate) struct RenderStats {
    /// Number of samples whose radiance is negative or not finite.
    rejected: AtomicU64,
    /// Number of samples that are brighter than the settings allow.
    clamped: AtomicU64,
    /// Total number of samples, and number of pixels above the noise threshold.
    samples: AtomicU64,
    noisy_pixels: AtomicU64,
    /// Number of pixels that show coplanar surfaces of several objects, and the bitwise complement of the smallest
    /// index of an object there.
    coplanar_pixels: AtomicU64,
    coplanar_object: AtomicU64,
}

impl RenderStats {
    /// Adds the counts of a tile.
    pub fn take_counts(&self, tile: &mut PixelEstimator) {
        self.rejected.fetch_add(std::mem::take(&mut tile.rejected), Ordering::Relaxed);
        self.clamped.fetch_add(std::mem::take(&mut tile.clamped), Ordering::Relaxed);
        if let Some(object) = tile.coplanar_object() {
            self.coplanar_pixels.fetch_add(tile.coplanar_pixels(), Ordering::Relaxed);
            self.coplanar_object.fetch_max(u64::from(!object), Ordering::Relaxed);
        }
    }

    /// Adds the samples of some pixels, and the number of pixels above the noise threshold.
    pub fn add_samples(&self, samples: u64, unfinished: u64) {
        self.samples.fetch_add(samples, Ordering::Relaxed);
        self.noisy_pixels.fetch_add(unfinished, Ordering::Relaxed);
    }

    /// Appends a notice about pixels that show coplanar surfaces of several objects.
    pub fn coplanar_notice(&self, notices: &mut Vec<Notice>) {
        let pixels = self.coplanar_pixels.load(Ordering::Relaxed);
        if pixels == 0 {
            return;
        }
        let object = !self.coplanar_object.load(Ordering::Relaxed) as u32;
        let message = format!(
            "surfaces of several objects, for example of object {object}, lie in the same plane at {}; the object with \
             the highest index is shown; move the objects apart",
            counted(pixels as usize, "pixel")
        );
        notices.push(Notice::new(NoticeCode::CoplanarSurfaces, message));
    }

    /// Appends notices about the samples of an image of this many pixels; `pilot` is the pilot's mean number of
    /// samples.
    pub fn notices(&self, settings: &Settings, pilot: Option<u64>, pixels: u64, notices: &mut Vec<Notice>) {
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        if let (Some(noise), Some(pilot)) = (settings.noise_threshold, pilot) {
            let mean = of(&self.samples) / pixels;
            let message = format!(
                "noise_threshold = {noise} used {mean} samples per pixel on average, and {pilot} additional \
                 samples per pixel to determine this number"
            );
            notices.push(Notice::new(NoticeCode::SamplesUsed, message));
            let noisy = of(&self.noisy_pixels);
            if noisy > 0 {
                let limit = settings.samples;
                let message = format!(
                    "noise_threshold = {noise} was not reached at {} with samples = {limit}",
                    counted(noisy as usize, "pixel")
                );
                notices.push(Notice::new(NoticeCode::NoiseLeft, message));
            }
        }
        if of(&self.rejected) > 0 {
            let message = format!(
                "samples that exceed float32 are replaced by black ({}); reduce the brightness of the lights",
                counted(of(&self.rejected) as usize, "sample")
            );
            notices.push(Notice::new(NoticeCode::TooBrightSamples, message));
        }
        if let Some(limit) = settings.clamp
            && of(&self.clamped) > 0
        {
            notices.push(Notice::new(
                NoticeCode::ClampedSamples,
                format!(
                    "samples brighter than clamp = {limit} were reduced to this limit ({}), so the image is darker \
                     than without clamp",
                    counted(of(&self.clamped) as usize, "sample")
                ),
            ));
        }
    }
}
