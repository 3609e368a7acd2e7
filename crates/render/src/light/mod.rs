//! Lights ready to shine: the closed set of [`raycam_scene::Light`], relative to the scene's origin.

mod bulb;
mod sun;

use glam::{DVec3, Vec3};
use raycam_scene::Light;

use bulb::Bulb;
use sun::Sun;

/// All lights of a world.
#[derive(Debug)]
pub(crate) struct Lights {
    /// Lights that shine from a direction or a place.
    pub sources: Vec<Source>,
    /// The radiance of all skies together.
    pub sky: Vec3,
    /// Whether the world has any light at all.
    pub any: bool,
}

/// The sky of a world without lights, where light is needed to see anything.
pub(crate) const DEFAULT_SKY: Vec3 = Vec3::ONE;

/// A light that casts shadows.
#[derive(Debug)]
pub(crate) enum Source {
    Sun(Sun),
    Bulb(Bulb),
}

/// Light that would arrive at a point if nothing stood in its way.
pub(crate) struct Arriving {
    /// Towards the light, unit length.
    pub direction: Vec3,
    /// The scene-local point it comes from; `None` for infinitely far away.
    pub from: Option<DVec3>,
    /// In W/m² on a surface that faces it.
    pub irradiance: Vec3,
}

impl Lights {
    pub fn new(lights: &[Light], origin: DVec3) -> Self {
        let mut prepared = Self {
            sources: vec![],
            sky: Vec3::ZERO,
            any: !lights.is_empty(),
        };
        for light in lights {
            match *light {
                Light::Sun {
                    direction,
                    irradiance,
                } => {
                    prepared
                        .sources
                        .push(Source::Sun(Sun::new(direction, irradiance)));
                }
                Light::Bulb {
                    position,
                    power,
                    intensity,
                    radius,
                } => {
                    let intensity = intensity.map(Vec3::from).unwrap_or_else(|| {
                        Vec3::from(power.unwrap_or_default()) / (4.0 * std::f32::consts::PI)
                    });
                    let center = DVec3::from(position) - origin;
                    prepared.sources.push(Source::Bulb(Bulb {
                        center,
                        intensity,
                        radius,
                    }));
                }
                Light::Sky { radiance } => prepared.sky += Vec3::from(radiance),
            }
        }
        prepared
    }
}

impl Source {
    /// What arrives at a scene-local point, by two random numbers where the light has a size.
    pub fn arriving(&self, point: DVec3, random: impl FnOnce() -> [f32; 2]) -> Option<Arriving> {
        match self {
            Self::Sun(sun) => Some(sun.arriving()),
            Self::Bulb(bulb) => bulb.arriving(point, random),
        }
    }

    /// Whether shadow rays of neighbouring points run alike.
    pub fn is_coherent(&self) -> bool {
        match self {
            Self::Sun(_) => true,
            Self::Bulb(bulb) => bulb.radius == 0.0,
        }
    }
}
