//! Per-pixel estimators of mean radiance and of its error.
//!
//! Points of one low-discrepancy sequence depend on each other, so their variance does not estimate the error of their
//! mean. With an error estimate, a pixel's samples therefore come from several independently scrambled replications.
//! The means of the replications are independent, and their variance estimates the error (A. Owen, "Quasi-Monte Carlo
//! Sampling", 2003).

use glam::{DVec3, Vec3};

/// Number of independent replications per pixel.
pub(crate) const REPLICATIONS: u32 = 16;

/// Luminance weights of linear Rec. 709.
const LUMINANCE_WEIGHTS: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// Sums over the samples of every pixel of a tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct PixelEstimator {
    color: Vec<DVec3>,
    /// For each pixel: the instance that the centre ray hits; empty unless coverage is requested.
    centers: Vec<u32>,
    /// For each pixel: number of samples that hit the same instance as the centre ray.
    same_instance: Vec<u32>,
    /// For each pixel: number of samples that escape to the environment.
    misses: Vec<u32>,
    count: Vec<u32>,
    /// Number of samples whose radiance is negative or not finite, and number of samples that are brighter
    /// than the settings allow.
    pub rejected: u64,
    pub clamped: u64,
    /// For each pixel that shows coplanar surfaces of several objects: the smallest index of a shown object. Empty
    /// without such pixels.
    coplanar: Vec<Option<u32>>,
    /// Sums of the passes, pixel by pixel.
    passes: Vec<DVec3>,
    /// For each pixel: sums of luminance per replication; empty without an error estimate.
    replications: Vec<[f64; REPLICATIONS as usize]>,
}

impl PixelEstimator {
    /// Clears all sums.
    pub fn reset(&mut self, pixels: usize, pass_count: usize, with_error: bool) {
        self.passes.clear();
        self.passes.resize(pixels * pass_count, DVec3::ZERO);
        self.color.clear();
        self.color.resize(pixels, DVec3::ZERO);
        self.centers.clear();
        self.same_instance.clear();
        self.same_instance.resize(pixels, 0);
        self.misses.clear();
        self.misses.resize(pixels, 0);
        self.count.clear();
        self.count.resize(pixels, 0);
        (self.rejected, self.clamped) = (0, 0);
        self.coplanar.clear();
        self.replications.clear();
        if with_error {
            self.replications.resize(pixels, [0.0; REPLICATIONS as usize]);
        }
    }

    /// Marks a pixel that shows an object whose surface is coplanar with another object's surface.
    #[cold]
    pub fn mark_coplanar(&mut self, pixel: usize, object: u32) {
        self.coplanar.resize(self.count.len(), None);
        let shown = &mut self.coplanar[pixel];
        *shown = Some(shown.map_or(object, |known| known.min(object)));
    }

    /// Number of pixels that show coplanar surfaces.
    pub fn coplanar_pixels(&self) -> u64 {
        self.coplanar.iter().flatten().count() as u64
    }

    /// Smallest index of an object that is shown by a pixel with coplanar surfaces; `None` without such pixels.
    pub fn coplanar_object(&self) -> Option<u32> {
        self.coplanar.iter().flatten().min().copied()
    }

    /// Stores the instances that the centre rays hit.
    pub fn set_centers(&mut self, instances: impl Iterator<Item = u32>) {
        self.centers.clear();
        self.centers.extend(instances);
    }

    /// True if the pixel's centre ray hits this instance.
    pub fn is_center(&self, pixel: usize, instance: u32) -> bool {
        self.centers.get(pixel) == Some(&instance)
    }

    /// Counts a sample; `same` is true if it hits the same instance as the pixel's centre ray.
    pub fn add_sample(&mut self, pixel: usize, same: bool) {
        self.count[pixel] += 1;
        self.same_instance[pixel] += u32::from(same);
    }

    /// Counts a sample that escapes to the environment.
    pub fn add_miss(&mut self, pixel: usize) {
        self.misses[pixel] += 1;
    }

    /// Adds the radiance of the sample with this index.
    pub fn add_radiance(&mut self, pixel: usize, sample: u32, radiance: Vec3) {
        let radiance = radiance.as_dvec3();
        self.color[pixel] += radiance;
        if let Some(sequences) = self.replications.get_mut(pixel) {
            sequences[(sample % REPLICATIONS) as usize] += LUMINANCE_WEIGHTS.dot(radiance);
        }
    }

    /// Adds the passes of a sample, times a factor.
    pub fn add_passes(&mut self, pixel: usize, passes: &[Vec3], factor: f32) {
        let sums = &mut self.passes[pixel * passes.len()..][..passes.len()];
        for (sum, pass) in sums.iter_mut().zip(passes) {
            *sum += (*pass * factor).as_dvec3();
        }
    }

    /// Mean radiance of a pass, given by its index.
    pub fn pass(&self, pixel: usize, index: usize) -> Vec3 {
        let count = self.passes.len() / self.count.len();
        (self.passes[pixel * count + index] / f64::from(self.count[pixel].max(1))).as_vec3()
    }

    /// Mean radiance of a pixel.
    pub fn color(&self, pixel: usize) -> Vec3 {
        let (sum, count) = (self.color[pixel], self.count[pixel]);
        // A division takes longer than the rest of this function, so single samples skip it.
        let mean = if count > 1 { sum / f64::from(count) } else { sum };
        mean.as_vec3()
    }

    /// Fraction of a pixel's samples that hit the same instance as the centre ray.
    pub fn coverage(&self, pixel: usize) -> f32 {
        (f64::from(self.same_instance[pixel]) / f64::from(self.count[pixel].max(1))) as f32
    }

    /// Fraction of a pixel's samples that hit a surface.
    pub fn alpha(&self, pixel: usize) -> f32 {
        (1.0 - f64::from(self.misses[pixel]) / f64::from(self.count[pixel].max(1))) as f32
    }

    /// Estimated standard error of the mean luminance; infinite below two samples.
    pub fn error(&self, pixel: usize) -> f32 {
        let count = self.count[pixel];
        let used = count.min(REPLICATIONS);
        if used < 2 {
            return f32::INFINITY;
        }
        let mean = |r: u32| {
            // Sample s belongs to replication s % REPLICATIONS.
            let samples = (count - r).div_ceil(REPLICATIONS);
            self.replications[pixel][r as usize] / f64::from(samples)
        };
        let whole = (0..used).map(mean).sum::<f64>() / f64::from(used);
        let scatter: f64 = (0..used).map(|r| (mean(r) - whole).powi(2)).sum();
        (scatter / f64::from(used - 1) / f64::from(used)).sqrt() as f32
    }
}
