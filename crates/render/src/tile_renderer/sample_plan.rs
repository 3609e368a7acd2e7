//! Adaptive sampling: a pilot determines the number of samples of every pixel.
//!
//! The pilot traces samples that are not shown. Their variance determines the number of samples that each pixel needs.
//! Only then are the shown samples traced, with other random numbers. The number is therefore independent of the shown
//! samples, so that their mean is unbiased and their scatter is an unbiased estimate of its error (D. Kirk and J. Arvo,
//! "Unbiased Sampling Techniques for Image Synthesis", SIGGRAPH 1991). The proof is in `docs/design.md`.
//!
//! The pilot has stages of 32, 32, 64, 128, ... samples. A pixel takes part in the next stage if its pilot is short
//! compared with the number of samples that it needs. All decisions use the variance of a window around the pixel:
//! light that arrives rarely is missing from the pilot of some pixels, but not from the pilots of all their neighbours.

use std::ops::Range;

use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::settings::Settings;

/// Total number of samples after each stage of the pilot.
const PILOT_STAGES: [u32; 6] = [32, 64, 128, 256, 512, 1024];
/// A pilot is long enough if the pixel needs at most this multiple of the pilot's samples.
const MAX_EXTRAPOLATION: f64 = 8.0;
/// Minimum number of shown samples: with fewer, the error is not estimated reliably.
const MIN_SAMPLES: u32 = 64;
/// Radius in pixels of the window over which the variance is averaged.
const WINDOW_RADIUS: u32 = 2;
/// Radius in pixels of the window over which the maximum variance is taken, so that neighbours of a noisy pixel
/// continue.
const NEIGHBOR_RADIUS: u32 = 1;
/// Planned variance relative to the squared threshold; below 1, because both estimates scatter.
const TARGET_VARIANCE: f64 = 0.75;
/// Width in pixels of the border around a region that affects the region's plan: one window radius for each stage of
/// the pilot.
const MARGIN: u32 = WINDOW_RADIUS * PILOT_STAGES.len() as u32;
/// Changes the seed of the pilot, so that its random numbers are independent of the shown samples.
const PILOT_SEED: u64 = 0x5851_f42d_4c95_7f2d;

/// Settings of the pilot of an image.
pub(crate) fn pilot_settings(settings: &Settings) -> Settings {
    let channels = vec![Channel::Error];
    Settings { seed: settings.seed ^ PILOT_SEED, noise_threshold: None, channels, ..settings.clone() }
}

/// Region of the pilot: an image's region and the pixels around it, so that a part of an image equals the same part of
/// the whole image.
pub(crate) fn pilot_region([x, y, width, height]: [u32; 4], size: [u32; 2]) -> [u32; 4] {
    let extend = |start: u32, length: u32, limit: u32| {
        let first = start.saturating_sub(MARGIN);
        (first, (start + length).saturating_add(MARGIN).min(limit) - first)
    };
    let ([x, width], [y, height]) = (extend(x, width, size[0]).into(), extend(y, height, size[1]).into());
    [x, y, width, height]
}

/// Variances measured by a pilot.
pub(crate) struct Pilot {
    region: [u32; 4],
    /// For each pixel: variance of the mean luminance, times the number of samples.
    variances: Vec<f32>,
    /// For each pixel: number of samples that the pilot traced.
    counts: Vec<u32>,
    threshold: f64,
    max_samples: u32,
}

/// Pixels, each with the variance of its samples in a stage.
pub(crate) type StageVariances = Vec<([u32; 2], f32)>;

/// Number of samples of every pixel of a region.
pub(crate) struct SamplePlan {
    region: [u32; 4],
    counts: Vec<u32>,
    /// Mean number of samples per pixel that the pilot traced.
    pub pilot_samples: u64,
}

impl Pilot {
    pub fn new(region: [u32; 4], threshold: f32, max_samples: u32) -> Self {
        let count = region[2] as usize * region[3] as usize;
        Self { region, variances: vec![0.0; count], counts: vec![0; count], threshold: threshold.into(), max_samples }
    }

    /// Runs all stages. `trace` returns the variances of a range of samples for the selected pixels.
    pub fn run(
        mut self,
        mut trace: impl FnMut(Range<u32>, &(dyn Fn([u32; 2]) -> bool + Sync)) -> Result<StageVariances, RenderError>,
    ) -> Result<SamplePlan, RenderError> {
        let mut taken = 0;
        for until in PILOT_STAGES {
            if self.max_samples <= MIN_SAMPLES {
                break;
            }
            let active: Vec<bool> = match taken {
                0 => vec![true; self.counts.len()],
                _ => self
                    .needed()
                    .into_iter()
                    .zip(&self.counts)
                    .map(|(n, &count)| self.continues(n, count, taken))
                    .collect(),
            };
            if !active.contains(&true) {
                break;
            }
            let found = trace(taken..until, &|pixel| active[index(self.region, pixel)])?;
            for (pixel, variance) in found {
                let (at, more) = (index(self.region, pixel), until - taken);
                let [before, all] = [self.counts[at], self.counts[at] + more].map(|count| count as f32);
                self.variances[at] = (self.variances[at] * before + variance * more as f32) / all;
                self.counts[at] += more;
            }
            taken = until;
        }
        let pilot: u64 = self.counts.iter().map(|&count| u64::from(count)).sum();
        let counts = self.needed().into_iter().map(|needed| self.planned(needed)).collect();
        Ok(SamplePlan { region: self.region, counts, pilot_samples: pilot / self.counts.len().max(1) as u64 })
    }

    /// True if a pixel takes part in the next stage.
    fn continues(&self, needed: f64, count: u32, taken: u32) -> bool {
        let needed = needed.min(self.max_samples.into());
        count == taken && needed > MAX_EXTRAPOLATION * f64::from(count)
    }

    /// Number of samples that every pixel needs to reach the noise threshold.
    fn needed(&self) -> Vec<f64> {
        let [_, _, width, height] = self.region;
        let mut needed = Vec::with_capacity(self.counts.len());
        for y in 0..height {
            for x in 0..width {
                let mean = self.window([x, y], WINDOW_RADIUS, |all| all.iter().sum::<f64>() / all.len() as f64);
                let largest = self.window([x, y], NEIGHBOR_RADIUS, |all| all.iter().copied().fold(0.0, f64::max));
                needed.push(mean.max(largest) / (TARGET_VARIANCE * self.threshold * self.threshold));
            }
        }
        needed
    }

    /// Applies `of` to the variances in a window around a pixel of the region.
    fn window(&self, [x, y]: [u32; 2], radius: u32, of: impl Fn(&[f64]) -> f64) -> f64 {
        const SIDE: usize = 2 * WINDOW_RADIUS as usize + 1;
        let [_, _, width, height] = self.region;
        let (mut all, mut count) = ([0.0; SIDE * SIDE], 0);
        for v in y.saturating_sub(radius)..(y + radius + 1).min(height) {
            for u in x.saturating_sub(radius)..(x + radius + 1).min(width) {
                all[count] = f64::from(self.variances[v as usize * width as usize + u as usize]);
                count += 1;
            }
        }
        of(&all[..count])
    }

    /// Number of shown samples: one of a few values, so that pixels are traced together, and equal for all
    /// replications.
    fn planned(&self, needed: f64) -> u32 {
        let mut count = MIN_SAMPLES;
        let mut step = MIN_SAMPLES / 2;
        while f64::from(count) < needed && count < self.max_samples {
            // The planned numbers are 64, 96, 128, 192, 256, 384, ...
            count += step;
            step = if count.is_power_of_two() { count / 2 } else { step };
        }
        count.min(self.max_samples)
    }
}

impl SamplePlan {
    /// Number of samples of a pixel.
    pub fn samples(&self, pixel: [u32; 2]) -> u32 {
        self.counts[index(self.region, pixel)]
    }
}

fn index([x, y, width, _]: [u32; 4], [u, v]: [u32; 2]) -> usize {
    (v - y) as usize * width as usize + (u - x) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plan of a row of pixels whose samples have these variances, and the number of pilot samples of each pixel.
    fn plan(variances: &[f32], threshold: f32, max_samples: u32) -> (Vec<u32>, Vec<u32>) {
        let region = [7, 3, variances.len() as u32, 1];
        let mut taken = vec![0; variances.len()];
        let plan = Pilot::new(region, threshold, max_samples).run(|samples, is_selected| {
            let pixels = (0..variances.len()).filter(|&x| is_selected([7 + x as u32, 3]));
            let found: StageVariances = pixels.map(|x| ([7 + x as u32, 3], variances[x])).collect();
            found.iter().for_each(|([x, _], _)| taken[(x - 7) as usize] += samples.end - samples.start);
            Ok(found)
        });
        (plan.unwrap().counts, taken)
    }

    #[test]
    fn quiet_pixels_next_to_noisy_pixels_receive_more_samples() {
        let mut variances = [0.0; 16];
        variances[8] = 4.0;
        // The noisy pixel needs 4 / (0.75 * 0.05^2) = 2,133 samples, rounded up to a planned number.
        let (counts, pilot) = plan(&variances, 0.05, 1 << 14);
        assert_eq!(counts[7..10], [3072; 3], "{counts:?}");
        // Next to the noisy pixel, the mean variance of the window of five pixels is a fifth: 427 samples are needed.
        assert_eq!([counts[6], counts[10]], [512; 2], "{counts:?}");
        assert_eq!(counts[..6], [MIN_SAMPLES; 6], "{counts:?}");
        assert_eq!(pilot[7..10], [512; 3], "a pilot is at least an eighth of the samples: {pilot:?}");
        assert_eq!(pilot[0], PILOT_STAGES[0], "{pilot:?}");
    }

    #[test]
    fn planned_samples_stay_within_the_maximum() {
        let (counts, _) = plan(&[1e6; 3], 1e-3, 1000);
        assert_eq!(counts, [1000; 3]);
        let (counts, pilot) = plan(&[1e6; 3], 1e-3, 48);
        assert_eq!((counts, pilot), (vec![48; 3], vec![0; 3]));
    }
}
