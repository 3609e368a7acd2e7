//! Lambertian reflection plus the modified Phong lobe.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::bsdf::diffuse::Diffuse;
use crate::bsdf::{BsdfEval, BsdfModel, BsdfSample};
use crate::lobes::phong_lobe::PhongLobe;
use crate::lobes::shading_frame::{ShadingFrame, cosine_hemisphere_pdf, sample_cosine_hemisphere};

/// Modified Phong BSDF at a point: albedos and specular lobe.
#[derive(Clone, Debug)]
pub(crate) struct ModifiedPhong<'a> {
    /// Albedo of the diffuse part.
    pub diffuse: Vec3,
    /// Albedo of the specular part at normal incidence.
    pub specular: Vec3,
    /// Specular lobe; `None` if `specular` is 0.
    pub lobe: Option<&'a PhongLobe>,
}

impl ModifiedPhong<'_> {
    /// The probability of sampling the specular lobe.
    fn specular_probability(&self) -> f32 {
        if self.lobe.is_none() {
            return 0.0;
        }
        let (specular, diffuse) = (self.specular.element_sum(), self.diffuse.element_sum());
        if specular == 0.0 { 0.0 } else { specular / (specular + diffuse) }
    }

    /// Value and density for light from the viewer's side.
    #[inline]
    fn eval_reflection(&self, frame: &ShadingFrame, wi: Vec3) -> BsdfEval {
        let cosine = frame.normal.dot(wi);
        if cosine <= 0.0 {
            return BsdfEval::default();
        }
        let mut reflected = self.diffuse * FRAC_1_PI;
        let mut pdf = cosine_hemisphere_pdf(cosine);
        if let Some(lobe) = self.lobe {
            reflected += self.specular * lobe.eval(frame.normal, frame.wo, wi);
            let probability = self.specular_probability();
            pdf += (lobe.pdf(frame.normal, frame.wo, wi) - pdf) * probability;
        }
        BsdfEval { value: reflected * cosine, pdf }
    }
}

impl BsdfModel for ModifiedPhong<'_> {
    /// The triangle reflects only on the viewer's side, for any shading normal.
    #[inline]
    fn eval(&self, frame: &ShadingFrame, wi: Vec3) -> BsdfEval {
        if frame.geometric.dot(wi) > 0.0 { self.eval_reflection(frame, wi) } else { BsdfEval::default() }
    }

    fn eval_diffuse(&self, frame: &ShadingFrame, wi: Vec3) -> Vec3 {
        let is_lit = frame.geometric.dot(wi) > 0.0;
        self.diffuse * (if is_lit { frame.normal.dot(wi).max(0.0) } else { 0.0 } * FRAC_1_PI)
    }

    fn diffuse_albedo(&self, _: &ShadingFrame) -> Vec3 {
        self.diffuse
    }

    #[inline]
    fn sample(&self, frame: &ShadingFrame, [choice, x, y]: [f32; 3]) -> Option<BsdfSample> {
        let wi = match self.lobe {
            Some(lobe) if choice < self.specular_probability() => lobe.sample(frame.normal, frame.wo, [x, y]),
            _ => frame.to_world(sample_cosine_hemisphere([x, y])),
        };
        if frame.geometric.dot(wi) <= 0.0 {
            return None;
        }
        if self.lobe.is_none() {
            let albedo = self.diffuse;
            let diffuse = Diffuse { albedo, sampled_direction: wi, guiding: None };
            return diffuse.sample(frame, [choice, x, y]);
        }
        let BsdfEval { value, pdf } = self.eval_reflection(frame, wi);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: value / pdf, pdf, is_specular: false, eta_scale: 1.0 })
    }

    fn albedo(&self, frame: &ShadingFrame) -> Vec3 {
        let specular = self.lobe.map_or(0.0, |lobe| lobe.albedo(frame.normal.dot(frame.wo)));
        self.diffuse + self.specular * specular
    }

    fn is_non_specular(&self) -> bool {
        true
    }

    fn is_transmissive(&self) -> bool {
        false
    }

    fn needs_lobe_sample(&self) -> bool {
        self.lobe.is_some()
    }
}
