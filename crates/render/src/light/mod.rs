//! Lights ready to shine: the closed set of [`raycam_scene::Light`], relative to the scene's origin.

mod bulb;
mod sun;

use glam::{DVec3, Vec3};
use raycam_scene::{Light, Up};

use bulb::Bulb;
use sun::Sun;

/// All lights of a world.
#[derive(Debug)]
pub(crate) struct Lights {
    /// Lights that shine from a direction or a place.
    pub sources: Vec<Source>,
    /// The radiance of all skies together.
    pub sky: Vec3,
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
