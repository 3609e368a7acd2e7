//! Point light, or a sphere of uniform radiance.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use raycam_bvh::WithSimd;

use crate::light::bounds::LightBounds;
use crate::light::samples::{LightLiSample, LightLiSamples};
use crate::sampling::direction_cone::DirectionCone;
use crate::soa::{Vec3xN, get_lane, set_lane};

#[derive(Debug)]
pub(crate) struct PointLight {
    /// Scene-local centre of the light.
    center: DVec3,
    /// Radiant intensity in W/sr, for each colour.
    intensity: Vec3,
    radius: f64,
}

/// Squared sine of the half angle below which a sphere is sampled as a point, because the density would overflow
/// float32.
const MIN_SIN2: f64 = 1e-30;

impl PointLight {
    pub fn new(center: DVec3, intensity: Vec3, radius: f64) -> Self {
        Self { center, intensity, radius }
    }

    pub fn bounds(&self) -> LightBounds {
        let reach = DVec3::splat(self.radius);
        LightBounds::isotropic(self.center - reach, self.center + reach, self.intensity)
    }

    pub fn is_point(&self) -> bool {
        self.radius == 0.0
    }

    /// Samples the light: inverse square law for a point, a uniform direction in the subtended cone for a sphere. A
    /// sphere does not emit inwards.
    pub fn sample(&self, point: DVec3, random: [f32; 2]) -> Option<LightLiSample> {
        let offset = self.center - point;
        let distance = offset.length();
        if distance <= self.radius || distance == 0.0 {
            return None;
        }
        let axis = offset / distance;
        let sin2 = (self.radius / distance).powi(2);
        if sin2 < MIN_SIN2 {
            return Some(LightLiSample {
                direction: axis.as_vec3(),
                p_light: Some(self.center),
                radiance: (self.intensity.as_dvec3() / (distance * distance)).as_vec3(),
                pdf: 1.0,
                is_delta: true,
            });
        }
        let cone = DirectionCone::new(axis, sin2);
        let direction = cone.sample(random);
        let near = self.front_distance(offset, direction);
        Some(LightLiSample {
            direction: direction.as_vec3(),
            p_light: Some(point + direction * near),
            radiance: self.radiance(),
            pdf: (1.0 / cone.solid_angle()) as f32,
            is_delta: false,
        })
    }

    /// Radiance of the sphere: the intensity is L pi r^2 in every direction.
    fn radiance(&self) -> Vec3 {
        (self.intensity.as_dvec3() / (PI * self.radius.powi(2))).as_vec3()
    }

    /// Cone that the sphere subtends at a point; `None` inside the sphere and for a point light.
    fn cone(&self, point: DVec3) -> Option<DirectionCone> {
        let offset = self.center - point;
        let distance = offset.length();
        let sin2 = (self.radius / distance).powi(2);
        (distance > self.radius && sin2 >= MIN_SIN2).then(|| DirectionCone::new(offset / distance, sin2))
    }

    /// Distance at which a ray hits the sphere, the radiance there, and the density of [`PointLight::sample`].
    pub fn intersect(&self, point: DVec3, direction: Vec3) -> Option<(f64, Vec3, f64)> {
        let cone = self.cone(point)?;
        let direction = direction.as_dvec3();
        cone.contains(direction).then(|| {
            let near = self.front_distance(self.center - point, direction);
            (near, self.radiance(), 1.0 / cone.solid_angle())
        })
    }

    /// Distance along a direction to the front of the sphere, or to its rim if the direction misses the sphere because
    /// of rounding.
    fn front_distance(&self, offset: DVec3, direction: DVec3) -> f64 {
        let along = direction.dot(offset);
        let height2 = self.radius.powi(2) - (offset - direction * along).length_squared();
        along - height2.max(0.0).sqrt()
    }
}

/// Same as [`PointLight::sample`], for many points and a light without a size.
pub(crate) struct SamplePoint<'a, const N: usize> {
    pub light: &'a PointLight,
    pub points: &'a Vec3xN<f64, N>,
    pub out: &'a mut LightLiSamples<N>,
}

impl<const N: usize> WithSimd for SamplePoint<'_, N> {
    #[inline(always)]
    fn run(self) {
        // The data is copied to the stack so that it can stay in registers.
        let (light, points, mut lanes) = (self.light, *self.points, LightLiSamples::<N>::default());
        for lane in 0..N {
            let offset = light.center - DVec3::from(get_lane(&points, lane));
            let distance = offset.length();
            let radiance = light.intensity.as_dvec3() / (distance * distance);
            set_lane(&mut lanes.direction, lane, (offset / distance).as_vec3().to_array());
            set_lane(&mut lanes.p_light, lane, light.center.to_array());
            set_lane(&mut lanes.radiance, lane, radiance.as_vec3().to_array());
            lanes.pdf[lane] = if distance > 0.0 { 1.0 } else { 0.0 };
        }
        lanes.is_delta = [true; N];
        *self.out = lanes;
    }
}
