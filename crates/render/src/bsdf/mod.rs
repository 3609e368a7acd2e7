//! How surfaces scatter light: the closed set of [`raycam_scene::MaterialModel`], evaluated at a point.
//!
//! All directions point away from the surface and are of unit length. `eval` and `sample` agree: a sample's weight
//! is its value divided by its density, and what one never returns the other gives no density.

pub(crate) mod batch;
pub(crate) mod conductor;
pub(crate) mod dielectric;
pub(crate) mod diffuse;
pub(crate) mod layered;
pub(crate) mod layered_sampling;
pub(crate) mod multiscatter_dielectric;
pub(crate) mod phong;
pub(crate) mod principled;
pub(crate) mod specular;
#[cfg(test)]
pub(crate) mod tests;

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::{Material, MaterialModel};

use crate::interaction::ray_cone::Footprint;
use crate::interaction::{LightSampleContext, SurfaceInteraction};
use crate::prepare::geometry::Geometry;
use crate::prepare::material::PreparedMaterial;
use crate::soa::{Vec3xN, get_lane, set_lane};

pub(crate) use crate::bsdf::batch::glossy::is_rough_reflective;
pub(crate) use crate::bsdf::batch::rough_dielectric::is_rough_refractive;
pub(crate) use crate::bsdf::layered::LayeredBsdf;
pub(crate) use crate::bsdf::phong::ModifiedPhong;
pub(crate) use crate::lobes::albedo_dielectric::DielectricAlbedo;
pub(crate) use crate::lobes::shading_frame::ShadingFrame;

use crate::bsdf::principled::{TextureLookup, ViewContext};
use crate::lobes::albedo_dielectric::FresnelModel;

/// How one point scatters light, its textures looked up.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "made at every hit: a box would be an allocation there"
)]
pub(crate) enum Bsdf<'a> {
    /// It does not: it absorbs, or shines by itself.
    Black,
    Phong(ModifiedPhong<'a>),
    Layered(LayeredBsdf<'a>),
}

/// A direction that light may come from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BsdfSample {
    pub wi: Vec3,
    /// Value (reflectance or transmittance times cosine) divided by density.
    pub weight: Vec3,
    /// By solid angle; of no meaning for delta samples.
    pub pdf: f32,
    /// Whether this direction is one of few: no light sampling finds it.
    pub is_specular: bool,
    /// The square of the relative index of refraction where it is refracted, else 1: what the weight has been divided
    /// by, and will be multiplied by on the way out.
    pub eta_scale: f32,
}

/// What share of an irradiance becomes radiance towards the viewer, and the density of sampling its direction.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BsdfEval {
    /// Reflectance or transmittance in 1/sr times the cosine.
    pub value: Vec3,
    /// By solid angle.
    pub pdf: f32,
}

/// [`BsdfEval`]s of many points, field by field.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BsdfEvals<const N: usize> {
    pub value: Vec3xN<f32, N>,
    pub pdf: [f32; N],
}

impl<const N: usize> Default for BsdfEvals<N> {
    fn default() -> Self {
        Self {
            value: [[0.0; N]; 3],
            pdf: [0.0; N],
        }
    }
}

impl<const N: usize> BsdfEvals<N> {
    /// Takes some lanes of others.
    #[inline(always)]
    pub fn select_lanes(&mut self, which: &[bool; N], others: &Self) {
        for (lane, &which) in which.iter().enumerate() {
            let from = if which { others } else { &*self };
            let (value, pdf) = (get_lane(&from.value, lane), from.pdf[lane]);
            set_lane(&mut self.value, lane, value);
            self.pdf[lane] = pdf;
        }
    }
}

/// What paths ask of a point of a surface.
pub(crate) trait BsdfModel {
    /// The value of light from a direction.
    fn eval(&self, frame: &ShadingFrame, light: Vec3) -> BsdfEval;
    /// A direction drawn about as often as it matters; `None` where the light is absorbed.
    fn sample(&self, frame: &ShadingFrame, random: [f32; 3]) -> Option<BsdfSample>;
    /// The radiance towards the viewer under a sky of radiance 1 that nothing hides.
    fn albedo(&self, frame: &ShadingFrame) -> Vec3;
    /// Whether light that is sampled has a chance to be scattered to the viewer.
    fn is_non_specular(&self) -> bool;
    /// Whether light from behind the surface reaches the viewer.
    fn is_transmissive(&self) -> bool;
    /// Whether [`BsdfModel::sample`] needs the first of its numbers, which chooses among parts.
    fn needs_lobe_sample(&self) -> bool;
}

impl PreparedMaterial {
    /// What roughness loses, for a colour.
    fn dielectric_albedo(&self, channel: Option<usize>) -> Option<&DielectricAlbedo> {
        self.dielectric_tables
            .get(channel.unwrap_or(1))
            .or(self.dielectric_tables.first())
    }

    /// The albedo where light is scattered by a [`Diffuse`] surface alone, without a normal map.
    #[inline]
    pub fn diffuse_albedo(
        &self,
        world: &Geometry,
        hit: &Hit,
        footprint: &Footprint,
    ) -> Option<Vec3> {
        let MaterialModel::Phong { diffuse, .. } = self.material.model else {
            return None;
        };
        (self.phong_lobe.is_none() && self.material.normal_map.is_none())
            .then(|| world.base_color_with(self, hit, footprint) * diffuse)
    }
}

/// The diffuse part of a material that is matte and no more: without a lobe, normals or light of its own.
pub(crate) fn diffuse_only(material: &Material) -> Option<f32> {
    let MaterialModel::Phong {
        diffuse, specular, ..
    } = material.model
    else {
        return None;
    };
    let plain = specular == [0.0; 3]
        && material.normal_map.is_none()
        && material.emission.value == [0.0; 3];
    plain.then_some(diffuse)
}

impl<'a> Bsdf<'a> {
    /// What happens to light at a hit, and the directions that it happens by: `unmapped_frame` with the normal map's normal.
    pub fn new(
        world: &'a Geometry,
        hit: &Hit,
        smooth: ShadingFrame,
        front: bool,
        channel: Option<usize>,
        around: f32,
        footprint: &Footprint,
    ) -> (Self, ShadingFrame) {
        let prepared = world.material(hit);
        let PreparedMaterial {
            material,
            phong_lobe: lobe,
            ..
        } = prepared;
        let normal = material
            .normal_map
            .and_then(|map| world.mapped_normal(&map, hit, footprint, smooth.normal, front));
        let mut frame = smooth;
        if let Some(normal) = normal {
            frame = smooth.with_shading_normal(normal, None);
        }
        let base = world.base_color_with(prepared, hit, footprint);
        let layers = match &material.model {
            MaterialModel::Phong {
                diffuse, specular, ..
            } => {
                let lecture = ModifiedPhong {
                    diffuse: base * *diffuse,
                    specular: Vec3::from(*specular),
                    lobe: lobe.as_deref(),
                };
                return (Self::Phong(lecture), frame);
            }
            MaterialModel::Unlit => return (Self::Black, frame),
            MaterialModel::Metal(metal) => {
                frame = frame.with_shading_normal(frame.normal, None);
                conductor::layer_stack(metal, base)
            }
            MaterialModel::Glass(glass) => {
                frame = frame.with_shading_normal(frame.normal, None);
                let eta = dielectric::eta(glass, front, channel, around);
                dielectric::layer_stack(glass, eta, base, prepared.dielectric_albedo(channel))
            }
            MaterialModel::Principled(p) => {
                let lookup = TextureLookup::new(world, hit, footprint);
                frame = frame.with_shading_normal(frame.normal, lookup.tangent(p));
                let seen = ViewContext {
                    unmapped_frame: smooth,
                    front,
                    channel,
                    outside_ior: around,
                    base,
                    dielectric_albedo: prepared.dielectric_albedo(channel),
                };
                principled::layer_stack(p, &lookup, &seen)
            }
        };
        (Self::Layered(LayeredBsdf::new(layers, &frame)), frame)
    }
}

impl BsdfModel for Bsdf<'_> {
    fn eval(&self, frame: &ShadingFrame, light: Vec3) -> BsdfEval {
        match self {
            Self::Black => BsdfEval::default(),
            Self::Phong(lecture) => BsdfModel::eval(lecture, frame, light),
            Self::Layered(layered) => layered.eval(frame, light),
        }
    }

    fn sample(&self, frame: &ShadingFrame, random: [f32; 3]) -> Option<BsdfSample> {
        match self {
            Self::Black => None,
            Self::Phong(lecture) => BsdfModel::sample(lecture, frame, random),
            Self::Layered(layered) => layered.sample(frame, random),
        }
    }

    fn albedo(&self, frame: &ShadingFrame) -> Vec3 {
        match self {
            Self::Black => Vec3::ZERO,
            Self::Phong(lecture) => BsdfModel::albedo(lecture, frame),
            Self::Layered(layered) => layered.albedo(),
        }
    }

    fn is_non_specular(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Phong(lecture) => lecture.is_non_specular(),
            Self::Layered(layered) => layered.is_non_specular(),
        }
    }

    fn is_transmissive(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Phong(lecture) => lecture.is_transmissive(),
            Self::Layered(layered) => layered.is_transmissive(),
        }
    }

    fn needs_lobe_sample(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Phong(lecture) => lecture.needs_lobe_sample(),
            Self::Layered(_) => true,
        }
    }
}

/// What the roughness of a material loses where light is refracted: one for each colour if they differ.
pub(crate) fn dielectric_tables(material: &Material) -> Vec<DielectricAlbedo> {
    let (ior, dispersion, curve) = match &material.model {
        MaterialModel::Glass(glass) if !glass.thin => {
            (glass.ior, glass.dispersion, FresnelModel::Exact)
        }
        MaterialModel::Principled(p) if principled::has_interior(p) => {
            (p.ior, p.dispersion, FresnelModel::Schlick)
        }
        _ => return vec![],
    };
    let of = |channel| {
        DielectricAlbedo::new(principled::ior_of_channel(ior, dispersion, channel), curve)
    };
    match is_dispersive(material) {
        true => [0, 1, 2].map(|channel| of(Some(channel))).into(),
        false => vec![of(None)],
    }
}

/// What the inside of a material does to light that goes through it: absorption per metre, where it has an inside.
pub(crate) fn interior_absorption(material: &Material) -> Option<Vec3> {
    match &material.model {
        MaterialModel::Principled(p) => principled::interior_absorption(p),
        MaterialModel::Glass(glass) => dielectric::interior_absorption(glass),
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) => None,
    }
}

/// The index of refraction of the inside of a material, for a colour.
pub(crate) fn ior(material: &Material, channel: Option<usize>) -> f32 {
    match &material.model {
        MaterialModel::Glass(glass) if !glass.thin => {
            principled::ior_of_channel(glass.ior, glass.dispersion, channel)
        }
        MaterialModel::Principled(p) if principled::has_interior(p) => {
            principled::ior_of_channel(p.ior, p.dispersion, channel)
        }
        _ => 1.0,
    }
}

/// Whether a material refracts colours differently.
pub(crate) fn is_dispersive(material: &Material) -> bool {
    match &material.model {
        MaterialModel::Principled(p) => p.dispersion > 0.0 && principled::has_interior(p),
        MaterialModel::Glass(glass) => glass.dispersion > 0.0 && !glass.thin,
        MaterialModel::Phong { .. } | MaterialModel::Unlit | MaterialModel::Metal(_) => false,
    }
}

/// What happens to light at a place.
#[derive(Clone, Debug)]
pub(crate) struct ShadingPoint<'a, S> {
    pub interaction: &'a SurfaceInteraction,
    /// The normals and the viewer.
    pub frame: ShadingFrame,
    pub bsdf: S,
}

impl<'a> ShadingPoint<'a, Bsdf<'a>> {
    /// What a ray in this direction sees at its hit, which is this place; `channel` is the colour that it carries, where it
    /// has lost the others by dispersion.
    pub fn new(
        geometry: &'a Geometry,
        place: &'a SurfaceInteraction,
        direction: Vec3,
        hit: &Hit,
        channel: Option<usize>,
        around: f32,
    ) -> Self {
        let smooth = place.shading_frame(direction);
        let (scatter, frame) = Bsdf::new(
            geometry,
            hit,
            smooth,
            place.is_front,
            channel,
            around,
            &place.footprint,
        );
        Self {
            interaction: place,
            frame,
            bsdf: scatter,
        }
    }
}

impl<S: BsdfModel> ShadingPoint<'_, S> {
    /// This point, as lights are sampled for it.
    #[inline]
    pub fn light_sample_context(&self) -> LightSampleContext {
        LightSampleContext {
            position: self.interaction.position,
            normal: if self.bsdf.is_transmissive() {
                Vec3::ZERO
            } else {
                self.frame.geometric
            },
        }
    }
}
