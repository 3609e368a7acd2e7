//! Brightest samples of a pixel.

use crate::control::Control;
use crate::error::RenderError;
use crate::integrator;
use crate::integrator::bright_path::BrightPath;
use crate::integrator::camera_ray_batch::CameraRayBatch;
use crate::tile_renderer::{RayBatchBuffers, ThreadScratch, TileRenderer};

/// Maximum number of samples of a pixel that are traced again.
const MAX_BRIGHT_PATH_SAMPLES: u32 = 4096;
/// Number of samples per batch.
const BATCH_SAMPLES: u32 = 256;

impl TileRenderer<'_> {
    /// Brightest path of a pixel, with its fraction of the light of all the pixel's samples; `None` for a black pixel.
    pub fn brightest_path(
        &self,
        pixel: [u32; 2],
        scratch: &mut ThreadScratch,
        control: &Control,
    ) -> Result<Option<(f64, BrightPath)>, RenderError> {
        let samples = self.settings.samples.min(MAX_BRIGHT_PATH_SAMPLES);
        scratch.lists.pixels.clear();
        scratch.lists.pixels.push(pixel);
        let (mut brightest, mut sum) = (BrightPath::default(), 0.0);
        let mut until = 0;
        while until < samples {
            let first = until;
            until = self.end_of_batch(first..samples, BATCH_SAMPLES);
            scratch.lists.batch.clear();
            scratch.lists.batch.extend((first..until).map(|sample| (0, sample)));
            self.trace_batch(self.world, scratch);
            let is_late = self.prepare_guiding(self.world, &scratch.lists.batch);
            let RayBatchBuffers { hits, origins, directions, cones, samplers, paths, .. } = &mut scratch.rays;
            self.cones.of_pixels(std::iter::repeat_n(pixel, hits.len()), cones);
            let (scene, ray_cones) = (self.scene, &**cones);
            let start_depth = self.camera.ray_start_depth();
            let batch = CameraRayBatch { scene, ray_cones, origins, directions, hits, samplers, start_depth, is_late };
            for found in integrator::bright_paths(self.world, self.settings, &batch, control, paths)? {
                sum += f64::from(found.radiance);
                if found.radiance > brightest.radiance {
                    brightest = found;
                }
            }
        }
        Ok((sum > 0.0 && sum.is_finite()).then(|| (f64::from(brightest.radiance) / sum, brightest)))
    }
}
