//! A clear layer on top of the others.

use glam::Vec3;

use super::Value;
use super::energy::Energy;
use super::frame::Frame;
use super::fresnel::Fresnel;
use super::ggx::{Ggx, microfacets};

/// How much of a surface it covers, and how rough it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coat {
    pub weight: f32,
    pub ggx: Ggx,
    /// It may have normals of its own.
    pub frame: Frame,
}

/// The index of a coat is 1.5.
pub(super) const COAT: Fresnel = Fresnel::Schlick {
    f0: Vec3::splat(0.04),
    f90: Vec3::ONE,
    inside: None,
};

impl Coat {
    /// What it reflects of white light at a cosine.
    pub fn reflected(&self, cosine: f32) -> f32 {
        let direction = Vec3::Z * cosine.max(0.0);
        let energy = Energy::new(&self.ggx);
        self.weight * energy.albedo(COAT.ends(), direction).single.x
    }

    pub fn evaluate(&self, view: Vec3, light: Vec3) -> Value {
        let (v, l) = (self.frame.local(view), self.frame.local(light));
        if self.ggx.is_smooth() || l.z <= 0.0 || v.z <= 0.0 {
            return Value::default();
        }
        let (value, pdf) = microfacets(&self.ggx, &COAT, v, l);
        Value {
            value: value * self.weight,
            pdf,
        }
    }
}
