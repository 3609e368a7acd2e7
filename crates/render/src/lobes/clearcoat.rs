//! A clear layer on top of the others.

use glam::Vec3;

use crate::bsdf::Value;
use crate::lobes::albedo_tables::Energy;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::{Ggx, microfacets};
use crate::lobes::shading_frame::Frame;

/// How much of a surface it covers, and how rough it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coat {
    pub weight: f32,
    pub ggx: Ggx,
    /// It may have normals of its own.
    pub frame: Frame,
}

/// The index of a coat is 1.5.
pub(crate) const COAT: Fresnel = Fresnel::Schlick {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::tests::{over_the_hemisphere, seen_from};

    #[test]
    fn it_takes_what_it_reflects() {
        // What lies below gets what `reflected` leaves, so that is to be the integral of `evaluate`.
        for (roughness, cosine) in [(0.5f32, 0.9f32), (0.5, 0.5), (0.8, 0.7), (0.8, 0.3)] {
            let view = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let coat = Coat {
                weight: 0.6,
                ggx: Ggx::isotropic(roughness),
                frame: seen_from(view),
            };
            let sent = over_the_hemisphere(|light| coat.evaluate(view, light).value.x);
            let ratio = sent / f64::from(coat.reflected(cosine));
            assert!((ratio - 1.0).abs() < 4e-3, "{roughness}, {cosine}: {ratio}");
        }
    }
}
