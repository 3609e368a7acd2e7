//! Lights without a mesh, as an enum with one variant per type of light.

use glam::{DVec3, Vec3};
use raycam_bvh::dispatch_simd;
use raycam_scene::{Light, Up};

use crate::interaction::LightSampleContext;
use crate::light::bounds::LightBounds;
use crate::light::disk::DiskLight;
use crate::light::environment::EnvironmentLight;
use crate::light::environment::gradient_sky::GradientSky;
use crate::light::environment::preetham::PreethamSky;
use crate::light::ies::IesLight;
use crate::light::point::{PointLight, SamplePoint};
use crate::light::projector::ProjectorLight;
use crate::light::rectangle::{RectangleLight, SampleRectangle};
use crate::light::samples::{LightLiSample, LightLiSamples};
use crate::light::spot::SpotLight;
use crate::light::sun::SunLight;
use crate::soa::Vec3xN;

/// Light without a mesh, relative to the scene's origin.
#[derive(Debug)]
pub(crate) enum PreparedLight {
    Sun(SunLight),
    Point(PointLight),
    Spot(SpotLight),
    Rectangle(RectangleLight),
    Disk(DiskLight),
    Ies(IesLight),
    Projector(Box<ProjectorLight>),
    GradientSky(GradientSky),
    Environment(Box<EnvironmentLight>),
}

impl PreparedLight {
    /// Prepares a light: one light, or two for daylight (sky and sun). Environment tables are shared with equal `known`
    /// lights.
    pub fn new(light: &Light, up: Up, origin: DVec3, known: &[&EnvironmentLight]) -> Vec<Self> {
        match *light {
            Light::Sun { direction, irradiance, angular_diameter } => {
                let sun = SunLight::new(direction, irradiance, angular_diameter);
                vec![Self::Sun(sun)]
            }
            Light::Sky { radiance, zenith, horizon, ground } => {
                let horizon = horizon.or(radiance).unwrap_or_default();
                vec![Self::GradientSky(GradientSky {
                    up: up.axis().as_vec3(),
                    zenith: zenith.or(radiance).unwrap_or_default().into(),
                    horizon: horizon.into(),
                    ground: ground.unwrap_or(horizon).into(),
                })]
            }
            Light::Preetham { direction, turbidity, scale } => {
                let (sky, sun) = PreethamSky::new(up, direction.into(), turbidity, scale.into());
                let sky = EnvironmentLight::of_sky(sky, up, known);
                vec![Self::Environment(Box::new(sky)), Self::Sun(sun)]
            }
            Light::Environment { ref image, yaw, scale } => {
                let Some(image) = image.content.clone() else {
                    return vec![];
                };
                let environment = EnvironmentLight::new(image, up, yaw, scale, known);
                vec![Self::Environment(Box::new(environment))]
            }
            _ => Self::finite(light, origin).into_iter().collect(),
        }
    }

    /// Prepares a finite light; `None` for an infinite light.
    fn finite(light: &Light, origin: DVec3) -> Option<Self> {
        let local = |position: [f64; 3]| DVec3::from(position) - origin;
        Some(match *light {
            Light::Point { position, power, intensity, radius } => {
                let intensity = intensity
                    .map(Vec3::from)
                    .unwrap_or_else(|| Vec3::from(power.unwrap_or_default()) / (4.0 * std::f32::consts::PI));
                Self::Point(PointLight::new(local(position), intensity, radius))
            }
            Light::Spot { position, direction, power, intensity, inner, outer, radius } => {
                let spot = SpotLight::new(local(position), direction.into(), inner, outer, radius);
                Self::Spot(match intensity {
                    Some(intensity) => spot.with_intensity(intensity.into()),
                    None => spot.with_power(power.unwrap_or_default().into()),
                })
            }
            Light::Rectangle { position, u, v, radiance, two_sided } => {
                let edges = [u.into(), v.into()];
                Self::Rectangle(RectangleLight::new(local(position), edges, radiance.into(), two_sided))
            }
            Light::Disk { position, direction, radius, radiance, two_sided } => {
                Self::Disk(DiskLight::new(local(position), direction.into(), radius, radiance.into(), two_sided))
            }
            Light::Ies { ref profile, position, direction, front, power } => {
                // `validate` has already rejected missing files.
                let profile = profile.content.clone()?;
                let (position, direction) = (local(position), direction.into());
                let (front, power) = (front.map(DVec3::from), power.map(Vec3::from));
                Self::Ies(IesLight::new(position, direction, front, profile, power))
            }
            Light::Projector { ref image, ref camera, power, irradiance } => {
                // `validate` has already rejected missing images and cameras.
                let (image, camera) = (image.content.clone()?, camera.as_deref()?);
                let [power, irradiance] = [power, irradiance].map(|rgb| rgb.map(Vec3::from));
                Self::Projector(Box::new(ProjectorLight::new(camera, origin, image, power, irradiance)))
            }
            Light::Sun { .. } | Light::Sky { .. } | Light::Preetham { .. } | Light::Environment { .. } => return None,
        })
    }

    /// Returns the projector; `None` for other lights.
    pub fn projector(&self) -> Option<&ProjectorLight> {
        match self {
            Self::Projector(projector) => Some(projector),
            _ => None,
        }
    }

    /// Returns the environment light; `None` for other lights.
    pub fn environment(&self) -> Option<&EnvironmentLight> {
        match self {
            Self::Environment(environment) => Some(environment),
            _ => None,
        }
    }

    /// Radiance of a sky that is the same in every direction; `None` for other lights.
    pub fn constant_radiance(&self) -> Option<Vec3> {
        match self {
            Self::GradientSky(sky) if sky.is_constant() => Some(sky.horizon),
            _ => None,
        }
    }

    pub fn is_infinite(&self) -> bool {
        match self {
            Self::Sun(_) | Self::GradientSky(_) | Self::Environment(_) => true,
            Self::Point(_) | Self::Spot(_) | Self::Rectangle(_) | Self::Disk(_) | Self::Ies(_) => false,
            Self::Projector(_) => false,
        }
    }

    /// Samples a direction towards this light.
    pub fn sample(&self, from: &LightSampleContext, random: [f32; 2]) -> Option<LightLiSample> {
        match self {
            Self::Sun(sun) => Some(sun.sample(random)),
            Self::Point(bulb) => bulb.sample(from.position, random),
            Self::Spot(spot) => spot.sample(from.position, random),
            Self::Rectangle(area) => area.sample(from.position, random),
            Self::Disk(disk) => disk.sample(from.position, random),
            Self::Ies(ies) => ies.sample(from.position),
            Self::Projector(projector) => projector.sample(from.position),
            Self::GradientSky(sky) => Some(sky.sample(from.normal, random)),
            Self::Environment(environment) => environment.sample(random),
        }
    }

    /// Same as [`PreparedLight::sample`], for many points. Returns false without samples if the light has no such
    /// method.
    pub fn sample_many<const N: usize>(
        &self,
        points: &Vec3xN<f64, N>,
        random: &[[f32; N]; 2],
        out: &mut LightLiSamples<N>,
    ) -> bool {
        match self {
            Self::Rectangle(light) => dispatch_simd(SampleRectangle { light, points, random, out }),
            Self::Point(light) if light.is_point() => dispatch_simd(SamplePoint { light, points, out }),
            Self::Sun(sun) if sun.is_point() => out.set_all(&sun.sample([0.0; 2])),
            _ => return false,
        }
        true
    }

    /// Radiance of an infinite light from a direction, and the density of [`PreparedLight::sample`].
    pub fn radiance_and_pdf(&self, normal: Vec3, direction: Vec3) -> (Vec3, f32) {
        match self {
            Self::Sun(sun) => (sun.radiance(direction), sun.pdf(direction)),
            Self::GradientSky(sky) => (sky.radiance(direction), sky.pdf(normal, direction)),
            Self::Environment(environment) => environment.radiance_and_pdf(direction),
            Self::Point(_) | Self::Spot(_) | Self::Rectangle(_) | Self::Disk(_) | Self::Ies(_) => (Vec3::ZERO, 0.0),
            Self::Projector(_) => (Vec3::ZERO, 0.0),
        }
    }

    /// Distance at which a ray hits a finite light, the radiance there, and the density of [`PreparedLight::sample`].
    pub fn intersect(&self, from: DVec3, direction: Vec3) -> Option<(f64, Vec3, f64)> {
        match self {
            Self::Point(bulb) => bulb.intersect(from, direction),
            Self::Rectangle(area) => area.intersect(from, direction),
            Self::Disk(disk) => disk.intersect(from, direction),
            Self::Spot(spot) => spot.intersect(from, direction),
            Self::Ies(_) | Self::Projector(_) => None,
            Self::Sun(_) | Self::GradientSky(_) | Self::Environment(_) => None,
        }
    }

    /// True if BSDF samples can hit the light; false for a constant sky that is an ambient term.
    pub fn is_hittable(&self, ambient: bool) -> bool {
        match self {
            Self::Sun(sun) => !sun.is_point(),
            Self::Point(bulb) => !bulb.is_point(),
            Self::GradientSky(sky) => !(ambient && sky.is_constant()),
            Self::Spot(spot) => !spot.is_point(),
            Self::Ies(_) | Self::Projector(_) => false,
            Self::Rectangle(_) | Self::Disk(_) | Self::Environment(_) => true,
        }
    }

    /// True if the light may cast caustics: it has an extent and is not a gradient sky.
    pub fn can_cast_caustics(&self) -> bool {
        match self {
            Self::GradientSky(_) => false,
            other => other.is_hittable(false),
        }
    }

    /// Bounds of the light for the light tree; default values for infinite lights.
    pub fn bounds(&self) -> LightBounds {
        match self {
            Self::Point(bulb) => bulb.bounds(),
            Self::Spot(spot) => spot.bounds(),
            Self::Rectangle(area) => area.bounds(),
            Self::Disk(disk) => disk.bounds(),
            Self::Ies(ies) => ies.bounds(),
            Self::Projector(projector) => projector.bounds(),
            Self::Sun(_) | Self::GradientSky(_) | Self::Environment(_) => LightBounds::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use raycam_scene::Light;

    use super::*;
    use crate::light::tests::{AT_ORIGIN, random, source};
    use crate::soa::{LANES, lane_dvec3, set_lane};

    fn point_light(radius: f64) -> PreparedLight {
        source(Light::Point { position: [0.2, -0.4, 1.0], power: None, intensity: Some([3.0, 2.0, 1.0]), radius })
    }

    fn sun(angular_diameter: f64) -> PreparedLight {
        source(Light::Sun { direction: [0.3, 0.1, -1.0], irradiance: [3.0, 2.0, 1.0], angular_diameter })
    }

    #[test]
    fn samples_of_many_points_equal_samples_of_single_points() {
        let area = source(Light::Rectangle {
            position: [0.2, -0.4, 1.0],
            u: [0.5, 0.0, 0.0],
            v: [0.0, -0.5, 0.1],
            radiance: [3.0, 2.0, 1.0],
            two_sided: false,
        });
        let mut points = [[0.0; LANES]; 3];
        let mut numbers = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let [x, y] = random(lane as u32);
            [numbers[0][lane], numbers[1][lane]] = [x, y];
            // One of the points is the position of the lights.
            let point =
                if lane == 5 { [0.2, -0.4, 1.0] } else { [f64::from(x) - 0.5, f64::from(y), 1.5 * f64::from(x)] };
            set_lane(&mut points, lane, point);
        }
        for light in [area, point_light(0.0), sun(0.0)] {
            let mut found = LightLiSamples::<LANES>::default();
            assert!(light.sample_many(&points, &numbers, &mut found));
            for lane in 0..LANES {
                let from = LightSampleContext { position: lane_dvec3(&points, lane), ..AT_ORIGIN };
                let alone = light.sample(&from, numbers.map(|numbers| numbers[lane]));
                assert_eq!(format!("{:?}", found.get_lane(lane)), format!("{alone:?}"), "{light:?}, lane {lane}");
            }
        }
        for light in [point_light(0.1), sun(0.5)] {
            assert!(!light.sample_many(&points, &numbers, &mut LightLiSamples::<LANES>::default()));
        }
    }
}
