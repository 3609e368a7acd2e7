//! Air light: the light that fog scatters towards the camera along a ray that hits no surface, in closed
//! form.
//!
//! Single scattering of the light from infinity: H. Koschmieder, "Theorie der horizontalen Sichtweite", 1924. The
//! approximation assumes that the light which fog removes from suns and skies equals the light that is scattered more
//! than once.

use glam::Vec3;

use crate::light::prepared_light::PreparedLight;
use crate::lobes::henyey_greenstein::henyey_greenstein;

/// Number of directions over which the radiance of a sky is averaged, in each of two dimensions.
const MEAN_SAMPLES: usize = 64;

/// Light from infinity that fog scatters.
#[derive(Clone, Debug, Default)]
pub(crate) struct AirLight {
    /// Mean radiance of the skies over all directions.
    sky: Vec3,
    /// Directions to the suns, and their irradiances.
    suns: Vec<(Vec3, Vec3)>,
}

impl AirLight {
    /// Collects the light of these infinite lights.
    pub fn new<'a>(lights: impl Iterator<Item = &'a PreparedLight>) -> Self {
        let mut light = Self::default();
        for source in lights {
            match source {
                PreparedLight::Sun(sun) => light.suns.push(sun.direction_and_irradiance()),
                sky => light.sky += mean_radiance(sky),
            }
        }
        light
    }

    /// Radiance along an infinite ray, computed from the fog's albedo and mean cosine `g`.
    pub fn radiance(&self, direction: Vec3, albedo: Vec3, g: f32) -> Vec3 {
        let suns =
            self.suns.iter().map(|&(towards, irradiance)| irradiance * henyey_greenstein(direction.dot(towards), g));
        albedo * (self.sky + suns.sum::<Vec3>())
    }
}

/// Mean radiance over all directions, estimated with the sky's own samples at the centres of a grid.
fn mean_radiance(sky: &PreparedLight) -> Vec3 {
    let from = crate::interaction::LightSampleContext { position: glam::DVec3::ZERO, normal: Vec3::ZERO };
    let center = |i: usize| (i as f32 + 0.5) / MEAN_SAMPLES as f32;
    let samples = (0..MEAN_SAMPLES * MEAN_SAMPLES).filter_map(|i| {
        let sample = sky.sample(&from, [center(i % MEAN_SAMPLES), center(i / MEAN_SAMPLES)])?;
        Some(sample.radiance / sample.pdf)
    });
    let total: Vec3 = samples.sum();
    total / (4.0 * std::f32::consts::PI * (MEAN_SAMPLES * MEAN_SAMPLES) as f32)
}
