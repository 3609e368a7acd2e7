//! A clear layer on top of the others.

use glam::Vec3;

use crate::bsdf::BsdfEval;
use crate::lobes::albedo_tables::DirectionalAlbedo;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::{Ggx, eval_reflection};
use crate::lobes::shading_frame::ShadingFrame;

/// How much of a surface it covers, and how rough it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clearcoat {
    pub weight: f32,
    pub ggx: Ggx,
    /// It may have normals of its own.
    pub frame: ShadingFrame,
}

/// The index of a coat is 1.5.
pub(crate) const COAT_FRESNEL: Fresnel = Fresnel::Schlick {
    f0: Vec3::splat(0.04),
    f90: Vec3::ONE,
    eta: None,
};

impl Clearcoat {
    /// What it reflects of white light at a cosine.
    pub fn albedo(&self, cosine: f32) -> f32 {
        let direction = Vec3::Z * cosine.max(0.0);
        let energy = DirectionalAlbedo::new(&self.ggx);
        self.weight
            * energy
                .albedo(COAT_FRESNEL.f0_f90(), direction)
                .single_scatter
                .x
    }

    pub fn eval(&self, view: Vec3, light: Vec3) -> BsdfEval {
        let (v, l) = (self.frame.to_local(view), self.frame.to_local(light));
        if self.ggx.effectively_smooth() || l.z <= 0.0 || v.z <= 0.0 {
            return BsdfEval::default();
        }
        let (value, pdf) = eval_reflection(&self.ggx, &COAT_FRESNEL, v, l);
        BsdfEval {
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
        // What lies below gets what `albedo` leaves, so that is to be the integral of `eval`.
        for (roughness, cosine) in [(0.5f32, 0.9f32), (0.5, 0.5), (0.8, 0.7), (0.8, 0.3)] {
            let view = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let coat = Clearcoat {
                weight: 0.6,
                ggx: Ggx::isotropic(roughness),
                frame: seen_from(view),
            };
            let sent = over_the_hemisphere(|light| coat.eval(view, light).value.x);
            let ratio = sent / f64::from(coat.albedo(cosine));
            assert!((ratio - 1.0).abs() < 4e-3, "{roughness}, {cosine}: {ratio}");
        }
    }
}
