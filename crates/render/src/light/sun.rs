//! The sun: parallel light.

use glam::{DVec3, Vec3};

use super::Arriving;

#[derive(Debug)]
pub(crate) struct Sun {
    /// Unit length.
    towards: Vec3,
    irradiance: Vec3,
}

impl Sun {
    /// `direction` is the way the light travels.
    pub fn new(direction: [f64; 3], irradiance: [f32; 3]) -> Self {
        let towards = (-DVec3::from(direction)).normalize_or_zero().as_vec3();
        Self {
            towards,
            irradiance: irradiance.into(),
        }
    }

    pub fn arriving(&self) -> Arriving {
        Arriving {
            direction: self.towards,
            from: None,
            irradiance: self.irradiance,
        }
    }
}
