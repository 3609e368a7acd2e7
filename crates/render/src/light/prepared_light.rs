//! The lights without a mesh: a closed set, with an arm per member for each question.

use glam::{DVec3, Vec3};
use raycam_scene::{Light, Up};

use crate::light::bounds::Bounds;
use crate::light::disk::Disk;
use crate::light::environment::Environment;
use crate::light::gradient_sky::Sky;
use crate::light::ies::Ies;
use crate::light::point::Bulb;
use crate::light::preetham::Daylight;
use crate::light::rectangle::Area;
use crate::light::spot::Spot;
use crate::light::sun::Sun;
use crate::light::{LightSample, Reference};

/// A light without a mesh.
#[derive(Debug)]
pub(crate) enum Source {
    Sun(Sun),
    Bulb(Bulb),
    Spot(Spot),
    Area(Area),
    Disk(Disk),
    Ies(Ies),
    Sky(Sky),
    Environment(Box<Environment>),
}

impl Source {
    /// Most lights are one source; daylight is two.
    pub fn new(light: &Light, up: Up, origin: DVec3) -> Vec<Self> {
        let local = |position: [f64; 3]| DVec3::from(position) - origin;
        let one = match *light {
            Light::Sun {
                direction,
                irradiance,
                angular_diameter,
            } => Self::Sun(Sun::new(direction, irradiance, angular_diameter)),
            Light::Bulb {
                position,
                power,
                intensity,
                radius,
            } => {
                let intensity = intensity.map(Vec3::from).unwrap_or_else(|| {
                    Vec3::from(power.unwrap_or_default()) / (4.0 * std::f32::consts::PI)
                });
                Self::Bulb(Bulb::new(local(position), intensity, radius))
            }
            Light::Spot {
                position,
                direction,
                power,
                intensity,
                inner,
                outer,
            } => {
                let spot = Spot::new(local(position), direction.into(), inner, outer);
                Self::Spot(match intensity {
                    Some(intensity) => spot.with_intensity(intensity.into()),
                    None => spot.with_power(power.unwrap_or_default().into()),
                })
            }
            Light::Area {
                position,
                u,
                v,
                radiance,
                two_sided,
            } => {
                let edges = [u.into(), v.into()];
                Self::Area(Area::new(
                    local(position),
                    edges,
                    radiance.into(),
                    two_sided,
                ))
            }
            Light::Disk {
                position,
                direction,
                radius,
                radiance,
                two_sided,
            } => Self::Disk(Disk::new(
                local(position),
                direction.into(),
                radius,
                radiance.into(),
                two_sided,
            )),
            Light::Ies {
                ref profile,
                position,
                direction,
                front,
                power,
            } => {
                // A file that is not read was refused by `validate`.
                let Some(profile) = profile.content.clone() else {
                    return vec![];
                };
                let (front, power) = (front.map(DVec3::from), power.map(Vec3::from));
                let position = local(position);
                Self::Ies(Ies::new(position, direction.into(), front, profile, power))
            }
            Light::Sky {
                radiance,
                zenith,
                horizon,
                ground,
            } => {
                let horizon = horizon.or(radiance).unwrap_or_default();
                Self::Sky(Sky {
                    up: up.axis().as_vec3(),
                    zenith: zenith.or(radiance).unwrap_or_default().into(),
                    horizon: horizon.into(),
                    ground: ground.unwrap_or(horizon).into(),
                })
            }
            Light::Daylight {
                direction,
                turbidity,
                scale,
            } => {
                let (sky, sun) = Daylight::new(up, direction.into(), turbidity, scale.into());
                let sky = Environment::of_sky(sky, up);
                return vec![Self::Environment(Box::new(sky)), Self::Sun(sun)];
            }
            Light::Environment {
                ref image,
                yaw,
                scale,
            } => {
                let Some(image) = image.content.clone() else {
                    return vec![];
                };
                Self::Environment(Box::new(Environment::new(image, up, yaw, scale)))
            }
        };
        vec![one]
    }

    pub fn is_infinite(&self) -> bool {
        match self {
            Self::Sun(_) | Self::Sky(_) | Self::Environment(_) => true,
            Self::Bulb(_) | Self::Spot(_) | Self::Area(_) | Self::Disk(_) | Self::Ies(_) => false,
        }
    }

    /// A direction to this light alone, as if there were no other.
    pub fn sample(&self, from: &Reference, random: [f32; 2]) -> Option<LightSample> {
        match self {
            Self::Sun(sun) => Some(sun.sample(random)),
            Self::Bulb(bulb) => bulb.sample(from.position, random),
            Self::Spot(spot) => spot.sample(from.position),
            Self::Area(area) => area.sample(from.position, random),
            Self::Disk(disk) => disk.sample(from.position, random),
            Self::Ies(ies) => ies.sample(from.position),
            Self::Sky(sky) => Some(sky.sample(from.normal, random)),
            Self::Environment(environment) => environment.sample(random),
        }
    }

    /// Of a light that is infinitely far away: the radiance out of a direction, and the density of [`Source::sample`].
    pub fn behind(&self, normal: Vec3, direction: Vec3) -> (Vec3, f32) {
        match self {
            Self::Sun(sun) => (sun.radiance(direction), sun.pdf(direction)),
            Self::Sky(sky) => (sky.radiance(direction), sky.pdf(normal, direction)),
            Self::Environment(environment) => environment.behind(direction),
            Self::Bulb(_) | Self::Spot(_) | Self::Area(_) | Self::Disk(_) | Self::Ies(_) => {
                (Vec3::ZERO, 0.0)
            }
        }
    }

    /// Of a light that is not: where a ray meets it, what it picks up there, and the density of [`Source::sample`].
    pub fn crossed(&self, from: DVec3, direction: Vec3) -> Option<(f64, Vec3, f64)> {
        match self {
            Self::Bulb(bulb) => bulb.crossed(from, direction),
            Self::Area(area) => area.crossed(from, direction),
            Self::Disk(disk) => disk.crossed(from, direction),
            Self::Spot(_) | Self::Ies(_) => None,
            Self::Sun(_) | Self::Sky(_) | Self::Environment(_) => None,
        }
    }

    /// Whether it has a size, so that rays may find it; an even sky not where it is an ambient term.
    pub fn is_found(&self, ambient: bool) -> bool {
        match self {
            Self::Sun(sun) => !sun.is_point(),
            Self::Bulb(bulb) => !bulb.is_point(),
            Self::Sky(sky) => !(ambient && sky.is_even()),
            Self::Spot(_) | Self::Ies(_) => false,
            Self::Area(_) | Self::Disk(_) | Self::Environment(_) => true,
        }
    }

    /// Whether it has a size without being all around.
    pub fn is_thrown(&self) -> bool {
        match self {
            Self::Sky(_) => false,
            other => other.is_found(false),
        }
    }

    /// Where it is, where it shines and how much, where it is not infinitely far away.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Bulb(bulb) => bulb.bounds(),
            Self::Spot(spot) => spot.bounds(),
            Self::Area(area) => area.bounds(),
            Self::Disk(disk) => disk.bounds(),
            Self::Ies(ies) => ies.bounds(),
            Self::Sun(_) | Self::Sky(_) | Self::Environment(_) => Bounds::default(),
        }
    }
}
