//! Surface point with its BSDF.

use glam::Vec3;
use raycam_scene::MaterialModel;

use crate::bsdf::layered::LayeredBsdf;
use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::phong::ModifiedPhong;
use crate::bsdf::principled::anisotropy_tangent;
use crate::bsdf::{BsdfEval, BsdfModel, BsdfSample};
use crate::interaction::LightSampleContext;
use crate::interaction::SurfaceInteraction;
use crate::lobes::shading_frame::ShadingFrame;

/// BSDF of any material, at one point.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "created at every hit: boxing would allocate memory there")]
pub(crate) enum Bsdf<'a> {
    /// Black surface: absorbs all light, or only emits light.
    Black,
    Phong(ModifiedPhong<'a>),
    Layered(LayeredBsdf<'a>),
}

impl<'a> Bsdf<'a> {
    /// The BSDF at a hit, and the shading frame with the material's normal and height map.
    pub fn new(hit: &MaterialHit<'a>) -> (Self, ShadingFrame) {
        let material = &hit.material.material;
        let mut frame = hit.unmapped_frame;
        let is_phong = matches!(material.model, MaterialModel::Phong { .. });
        if let Some(normal) = if is_phong { hit.mapped_normal() } else { hit.mapped_mirror_normal() } {
            frame = frame.with_shading_normal(normal, None);
        }
        let tangent = match &material.model {
            MaterialModel::Phong { diffuse, specular, .. } => {
                let phong = ModifiedPhong {
                    diffuse: hit.base_color() * *diffuse,
                    specular: Vec3::from(*specular),
                    lobe: hit.material.phong_lobe.as_deref(),
                };
                return (Self::Phong(phong), frame);
            }
            MaterialModel::Principled(p) => anisotropy_tangent(p, hit),
            MaterialModel::Unlit | MaterialModel::Metal(_) | MaterialModel::Glass(_) | MaterialModel::Boundary => None,
        };
        let Some(stack) = hit.layer_stack() else {
            return (Self::Black, frame);
        };
        frame = frame.with_shading_normal(frame.normal, tangent);
        (Self::Layered(LayeredBsdf::new(stack, &frame)), frame)
    }
}

impl BsdfModel for Bsdf<'_> {
    fn eval(&self, frame: &ShadingFrame, wi: Vec3) -> BsdfEval {
        match self {
            Self::Black => BsdfEval::default(),
            Self::Phong(phong) => phong.eval(frame, wi),
            Self::Layered(layered) => layered.eval(frame, wi),
        }
    }

    fn eval_diffuse(&self, frame: &ShadingFrame, wi: Vec3) -> Vec3 {
        match self {
            Self::Black => Vec3::ZERO,
            Self::Phong(phong) => phong.eval_diffuse(frame, wi),
            Self::Layered(layered) => layered.eval_diffuse(frame, wi),
        }
    }

    fn diffuse_albedo(&self, frame: &ShadingFrame) -> Vec3 {
        match self {
            Self::Black => Vec3::ZERO,
            Self::Phong(phong) => phong.diffuse_albedo(frame),
            Self::Layered(layered) => layered.diffuse_albedo(),
        }
    }

    fn sample(&self, frame: &ShadingFrame, random: [f32; 3]) -> Option<BsdfSample> {
        match self {
            Self::Black => None,
            Self::Phong(phong) => phong.sample(frame, random),
            Self::Layered(layered) => layered.sample(frame, random),
        }
    }

    fn albedo(&self, frame: &ShadingFrame) -> Vec3 {
        match self {
            Self::Black => Vec3::ZERO,
            Self::Phong(phong) => phong.albedo(frame),
            Self::Layered(layered) => layered.albedo(),
        }
    }

    fn is_non_specular(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Phong(phong) => phong.is_non_specular(),
            Self::Layered(layered) => layered.is_non_specular(),
        }
    }

    fn is_transmissive(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Phong(phong) => phong.is_transmissive(),
            Self::Layered(layered) => layered.is_transmissive(),
        }
    }

    fn needs_lobe_sample(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Phong(phong) => phong.needs_lobe_sample(),
            Self::Layered(_) => true,
        }
    }
}

/// A surface interaction with its shading frame and BSDF.
#[derive(Clone, Debug)]
pub(crate) struct ShadingPoint<'a, B> {
    pub interaction: &'a SurfaceInteraction,
    pub frame: ShadingFrame,
    pub bsdf: B,
}

impl<'a> ShadingPoint<'a, Bsdf<'a>> {
    /// Creates the shading point of a hit.
    pub fn new(interaction: &'a SurfaceInteraction, hit: &MaterialHit<'a>) -> Self {
        let (bsdf, frame) = Bsdf::new(hit);
        Self { interaction, frame, bsdf }
    }
}

impl<B: BsdfModel> ShadingPoint<'_, B> {
    /// The point in the form that light sampling requires.
    #[inline]
    pub fn light_sample_context(&self) -> LightSampleContext {
        LightSampleContext {
            position: self.interaction.position,
            normal: if self.bsdf.is_transmissive() { Vec3::ZERO } else { self.frame.geometric },
        }
    }
}
