//! Lights ready to shine: the closed set of [`raycam_scene::Light`] and the surfaces that shine, relative to the scene's
//! origin.
//!
//! A light without a mesh is seen where it has a size, but stands in nobody's way: rays pass through it and pick up its
//! radiance. What a ray picks up is the sum of
//!
//! * [`Lights::crossed`]: lights without a mesh between its start and what it meets,
//! * [`Lights::emitted`]: what the surface that it meets shines by itself,
//! * [`Lights::sky`]: what lies behind everything, where it meets nothing.
//!
//! [`Lights::sample`] draws a direction to any of these, and each of these says what density `sample` has for its
//! direction: that is all that multiple importance sampling needs (E. Veach, "Robust Monte Carlo Methods for Light
//! Transport Simulation", 1997, chapter 9).

mod bulb;
mod cone;
mod sky;
mod sun;

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;
use raycam_scene::{Light, Up};

use crate::prepare::{PreparedMaterial, PreparedWorld};
use bulb::Bulb;
use sky::Sky;
use sun::Sun;

/// A point that is lit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reference {
    /// Scene-local.
    pub position: DVec3,
    /// Of unit length where light arrives on one side of a surface only, towards that side; else zero. It guides the
    /// choice alone: no light is lost for it.
    pub normal: Vec3,
}

/// A direction to a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    /// Of unit length.
    pub direction: Vec3,
    /// The scene-local point it comes from; `None` for infinitely far away.
    pub end: Option<DVec3>,
    /// What arrives if nothing stands in between: radiance; for a delta light irradiance on a surface that faces it.
    pub radiance: Vec3,
    /// The density of the direction by solid angle, times the probability that this light was chosen; for a delta light
    /// that probability alone. Greater than 0.
    pub pdf: f32,
    /// Whether its direction is the only one: nothing else finds this light.
    pub delta: bool,
}

/// All lights of a world.
#[derive(Debug)]
pub(crate) struct Lights {
    /// Lights without a mesh, in the order of the world.
    pub sources: Vec<Source>,
    /// The radiance of all even skies together, in the integrators that take it for an ambient term.
    pub ambient: Vec3,
    /// Which of `sources` are infinitely far, and which are not.
    infinite: Vec<usize>,
    finite: Vec<usize>,
}

/// What a world without lights gets where light is needed to see anything: a sky, and a sun that stands high to the
/// left of the default camera, because a sky alone shows no shape. A white floor then has a radiance of about 1.
pub(crate) fn default_lights(up: Up) -> [Light; 2] {
    let direction = match up {
        Up::Z => [1.0, 2.0, -3.0],
        Up::Y => [1.0, -3.0, -2.0],
    };
    [
        Light::Sky { radiance: [0.4; 3] },
        Light::Sun {
            direction,
            irradiance: [2.4; 3],
        },
    ]
}

/// A light without a mesh.
#[derive(Debug)]
pub(crate) enum Source {
    Sun(Sun),
    Bulb(Bulb),
    Sky(Sky),
}

impl Lights {
    pub fn new(lights: &[Light], origin: DVec3) -> Self {
        let sources: Vec<Source> = lights
            .iter()
            .map(|light| Source::new(light, origin))
            .collect();
        let (infinite, finite) = (0..sources.len()).partition(|&i| sources[i].is_infinite());
        let even = |source: &Source| match source {
            Source::Sky(sky) => sky.radiance,
            _ => Vec3::ZERO,
        };
        Self {
            ambient: sources.iter().map(even).sum(),
            sources,
            infinite,
            finite,
        }
    }

    /// One light chosen for this point, and a direction to it. Lights infinitely far away count as one where their
    /// directions meet: their radiance and densities are sums.
    pub fn sample(
        &self,
        _world: &PreparedWorld,
        from: &Reference,
        [choice, x, y]: [f32; 3],
    ) -> Option<LightSample> {
        let count = self.sources.len();
        let index = ((choice * count as f32) as usize).min(count.checked_sub(1)?);
        let source = &self.sources[index];
        let mut sample = source.sample(from, [x, y])?;
        sample.pdf /= count as f32;
        if !sample.delta && source.is_infinite() {
            sample.radiance = self.sky(sample.direction);
            sample.pdf = self.sky_pdf(from, sample.direction);
        }
        (sample.pdf > 0.0).then_some(sample)
    }

    /// Whether rays that are scattered may find light that [`Lights::sample`] finds too; even skies do not count where
    /// they are an ambient term.
    pub fn is_found(&self, world: &PreparedWorld, ambient: bool) -> bool {
        let shines = |material: &PreparedMaterial| material.material.emission.value != [0.0; 3];
        let found = |source: &Source| source.is_found(ambient);
        self.sources.iter().any(found) || world.materials.iter().any(shines)
    }

    /// The radiance from infinitely far away, out of a direction of unit length: what a ray that meets nothing sees.
    pub fn sky(&self, direction: Vec3) -> Vec3 {
        self.infinite
            .iter()
            .map(|&i| self.sources[i].radiance(direction))
            .sum()
    }

    /// The density with which [`Lights::sample`] finds this direction for the sake of the sky.
    pub fn sky_pdf(&self, from: &Reference, direction: Vec3) -> f32 {
        let choice = 1.0 / self.sources.len() as f32;
        self.infinite
            .iter()
            .map(|&i| choice * self.sources[i].pdf(from, direction))
            .sum()
    }

    /// What the surface at a hit shines by itself against `direction`, in W/(m² sr).
    pub fn emitted(&self, world: &PreparedWorld, hit: &Hit, direction: Vec3) -> Vec3 {
        world.emission(hit, direction)
    }

    /// The density with which [`Lights::sample`] finds this hit, `distance` away from `from`.
    pub fn emitted_pdf(
        &self,
        _from: &Reference,
        _world: &PreparedWorld,
        _hit: &Hit,
        _direction: Vec3,
        _distance: f64,
    ) -> f32 {
        0.0
    }

    /// Tells of every light without a mesh that a ray from `from` picks up on its way of at most `distance`: its
    /// radiance, and the density with which [`Lights::sample`] finds it there.
    pub fn crossed(
        &self,
        from: &Reference,
        direction: Vec3,
        distance: f64,
        mut tell: impl FnMut(Vec3, f32),
    ) {
        let choice = 1.0 / self.sources.len() as f32;
        for &i in &self.finite {
            if let Some(radiance) = self.sources[i].crossed(from.position, direction, distance) {
                tell(radiance, choice * self.sources[i].pdf(from, direction));
            }
        }
    }
}

impl Source {
    fn new(light: &Light, origin: DVec3) -> Self {
        match *light {
            Light::Sun {
                direction,
                irradiance,
            } => Self::Sun(Sun::new(direction, irradiance, 0.0)),
            Light::Bulb {
                position,
                power,
                intensity,
                radius,
            } => {
                let intensity = intensity.map(Vec3::from).unwrap_or_else(|| {
                    Vec3::from(power.unwrap_or_default()) / (4.0 * std::f32::consts::PI)
                });
                Self::Bulb(Bulb::new(DVec3::from(position) - origin, intensity, radius))
            }
            Light::Sky { radiance } => Self::Sky(Sky {
                radiance: radiance.into(),
            }),
        }
    }

    fn is_infinite(&self) -> bool {
        match self {
            Self::Sun(_) | Self::Sky(_) => true,
            Self::Bulb(_) => false,
        }
    }

    /// A direction to this light alone, as if there were no other.
    pub fn sample(&self, from: &Reference, random: [f32; 2]) -> Option<LightSample> {
        match self {
            Self::Sun(sun) => Some(sun.sample(random)),
            Self::Bulb(bulb) => bulb.sample(from.position, random),
            Self::Sky(sky) => Some(sky.sample(from.normal, random)),
        }
    }

    /// The density of [`Source::sample`] by solid angle; 0 for delta lights.
    fn pdf(&self, from: &Reference, direction: Vec3) -> f32 {
        match self {
            Self::Sun(sun) => sun.pdf(direction),
            Self::Bulb(bulb) => bulb.pdf(from.position, direction),
            Self::Sky(sky) => sky.pdf(from.normal, direction),
        }
    }

    /// What comes from infinitely far away.
    fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Sun(sun) => sun.radiance(direction),
            Self::Sky(sky) => sky.radiance,
            Self::Bulb(_) => Vec3::ZERO,
        }
    }

    /// What a ray picks up from a light that is not infinitely far away.
    fn crossed(&self, from: DVec3, direction: Vec3, distance: f64) -> Option<Vec3> {
        match self {
            Self::Sun(_) | Self::Sky(_) => None,
            Self::Bulb(bulb) => bulb.crossed(from, direction, distance),
        }
    }

    /// Whether it has a size, so that rays may find it.
    fn is_found(&self, ambient: bool) -> bool {
        match self {
            Self::Sun(sun) => !sun.is_point(),
            Self::Bulb(bulb) => !bulb.is_point(),
            Self::Sky(_) => !ambient,
        }
    }
}
