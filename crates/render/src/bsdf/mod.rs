//! How surfaces scatter light: the closed set of [`raycam_scene::Reflectance`], evaluated at a point.
//!
//! All directions point away from the surface and are of unit length. `evaluate` and `sample` agree: a sample's weight
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
use raycam_scene::{Material, Reflectance};

use crate::prepare::PreparedWorld;
use crate::prepare::material::PreparedMaterial;
use crate::prepare::texture::Footprint;
use crate::soa::{Three, get, set};

pub(crate) use crate::bsdf::batch::glossy::{FindLobes, GlossyPoints, is_glossy};
pub(crate) use crate::bsdf::batch::rough_dielectric::{FindFrosted, FrostedPoints, is_frosted};
pub(crate) use crate::bsdf::batch::specular::{FindWays, SmoothPoints};
pub(crate) use crate::bsdf::diffuse::{Directions, Matte};
pub(crate) use crate::bsdf::layered::Layered;
pub(crate) use crate::bsdf::phong::Lecture;
pub(crate) use crate::bsdf::principled::is_solid;
pub(crate) use crate::bsdf::specular::is_clear;
pub(crate) use crate::guiding::cones::{Aim, Aims, share};
pub(crate) use crate::lobes::albedo_dielectric::Interface;
pub(crate) use crate::lobes::phong_lobe::Lobe;
pub(crate) use crate::lobes::shading_frame::{Frame, above, cosine_direction, turn, turned};

use crate::bsdf::principled::{Lookup, Seen};
use crate::bsdf::specular::is_smooth;
use crate::lobes::albedo_dielectric::Curve;

/// How one point scatters light, its textures looked up.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "made at every hit: a box would be an allocation there"
)]
pub(crate) enum Scatter<'a> {
    /// It does not: it absorbs, or shines by itself.
    Black,
    Lecture(Lecture<'a>),
    Layered(Layered<'a>),
}

/// A direction that light may come from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScatterSample {
    pub direction: Vec3,
    /// Value (reflectance or transmittance times cosine) divided by density.
    pub weight: Vec3,
    /// By solid angle; of no meaning for delta samples.
    pub pdf: f32,
    /// Whether this direction is one of few: no light sampling finds it.
    pub delta: bool,
    /// The square of the relative index of refraction where it is refracted, else 1: what the weight has been divided
    /// by, and will be multiplied by on the way out.
    pub squeeze: f32,
}

/// What share of an irradiance becomes radiance towards the viewer, and the density of sampling its direction.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Value {
    /// Reflectance or transmittance in 1/sr times the cosine.
    pub value: Vec3,
    /// By solid angle.
    pub pdf: f32,
}

/// [`Value`]s of many points, field by field.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Values<const N: usize> {
    pub value: Three<f32, N>,
    pub pdf: [f32; N],
}

impl<const N: usize> Default for Values<N> {
    fn default() -> Self {
        Self {
            value: [[0.0; N]; 3],
            pdf: [0.0; N],
        }
    }
}

impl<const N: usize> Values<N> {
    /// Takes some lanes of others.
    #[inline(always)]
    pub fn take(&mut self, which: &[bool; N], others: &Self) {
        for (lane, &which) in which.iter().enumerate() {
            let from = if which { others } else { &*self };
            let (value, pdf) = (get(&from.value, lane), from.pdf[lane]);
            set(&mut self.value, lane, value);
            self.pdf[lane] = pdf;
        }
    }
}

/// What paths ask of a point of a surface.
pub(crate) trait Scattering {
    /// The value of light from a direction.
    fn evaluate(&self, frame: &Frame, light: Vec3) -> Value;
    /// A direction drawn about as often as it matters; `None` where the light is absorbed.
    fn sample(&self, frame: &Frame, random: [f32; 3]) -> Option<ScatterSample>;
    /// The radiance towards the viewer under a sky of radiance 1 that nothing hides.
    fn albedo(&self, frame: &Frame) -> Vec3;
    /// Whether light that is sampled has a chance to be scattered to the viewer.
    fn is_lit(&self) -> bool;
    /// Whether light from behind the surface reaches the viewer.
    fn is_transmissive(&self) -> bool;
    /// Whether [`Scattering::sample`] needs the first of its numbers, which chooses among parts.
    fn chooses(&self) -> bool;
}

impl PreparedMaterial {
    /// What roughness loses, for a colour.
    fn interface(&self, channel: Option<usize>) -> Option<&Interface> {
        self.interfaces
            .get(channel.unwrap_or(1))
            .or(self.interfaces.first())
    }

    /// The albedo where light is scattered by a [`Matte`] surface alone, without a normal map.
    #[inline]
    pub fn matte(&self, world: &PreparedWorld, hit: &Hit, footprint: &Footprint) -> Option<Vec3> {
        let Reflectance::Lecture { diffuse, .. } = self.material.reflectance else {
            return None;
        };
        (self.lobe.is_none() && self.material.normal_map.is_none())
            .then(|| world.base_color_of(self, hit, footprint) * diffuse)
    }
}

/// The diffuse part of a material that is matte and no more: without a lobe, normals or light of its own.
pub(crate) fn plain(material: &Material) -> Option<f32> {
    let Reflectance::Lecture {
        diffuse, specular, ..
    } = material.reflectance
    else {
        return None;
    };
    let plain = specular == [0.0; 3]
        && material.normal_map.is_none()
        && material.emission.value == [0.0; 3];
    plain.then_some(diffuse)
}

impl<'a> Scatter<'a> {
    /// What happens to light at a hit, and the directions that it happens by: `smooth` with the normal map's normal.
    pub fn new(
        world: &'a PreparedWorld,
        hit: &Hit,
        smooth: Frame,
        front: bool,
        channel: Option<usize>,
        around: f32,
        footprint: &Footprint,
    ) -> (Self, Frame) {
        let prepared = world.material(hit);
        let PreparedMaterial { material, lobe, .. } = prepared;
        let normal = material
            .normal_map
            .and_then(|map| world.mapped_normal(&map, hit, footprint, smooth.normal, front));
        let mut frame = smooth;
        if let Some(normal) = normal {
            frame = smooth.with_normal(normal, None);
        }
        let base = world.base_color_of(prepared, hit, footprint);
        let layers = match &material.reflectance {
            Reflectance::Lecture {
                diffuse, specular, ..
            } => {
                let lecture = Lecture {
                    diffuse: base * *diffuse,
                    specular: Vec3::from(*specular),
                    lobe: lobe.as_deref(),
                };
                return (Self::Lecture(lecture), frame);
            }
            Reflectance::Unlit => return (Self::Black, frame),
            Reflectance::Metal(metal) => {
                frame = frame.with_normal(frame.normal, None);
                conductor::layers(metal, base)
            }
            Reflectance::Glass(glass) => {
                frame = frame.with_normal(frame.normal, None);
                let eta = dielectric::eta(glass, front, channel, around);
                dielectric::layers(glass, eta, base, prepared.interface(channel))
            }
            Reflectance::Principled(p) => {
                let lookup = Lookup::new(world, hit, footprint);
                frame = frame.with_normal(frame.normal, lookup.tangent(p));
                let seen = Seen {
                    smooth,
                    front,
                    channel,
                    around,
                    base,
                    interface: prepared.interface(channel),
                };
                principled::layers(p, &lookup, &seen)
            }
        };
        (Self::Layered(Layered::new(layers, &frame)), frame)
    }
}

impl Scattering for Scatter<'_> {
    fn evaluate(&self, frame: &Frame, light: Vec3) -> Value {
        match self {
            Self::Black => Value::default(),
            Self::Lecture(lecture) => Scattering::evaluate(lecture, frame, light),
            Self::Layered(layered) => layered.evaluate(frame, light),
        }
    }

    fn sample(&self, frame: &Frame, random: [f32; 3]) -> Option<ScatterSample> {
        match self {
            Self::Black => None,
            Self::Lecture(lecture) => Scattering::sample(lecture, frame, random),
            Self::Layered(layered) => layered.sample(frame, random),
        }
    }

    fn albedo(&self, frame: &Frame) -> Vec3 {
        match self {
            Self::Black => Vec3::ZERO,
            Self::Lecture(lecture) => Scattering::albedo(lecture, frame),
            Self::Layered(layered) => layered.albedo(),
        }
    }

    fn is_lit(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Lecture(lecture) => lecture.is_lit(),
            Self::Layered(layered) => layered.is_lit(),
        }
    }

    fn is_transmissive(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Lecture(lecture) => lecture.is_transmissive(),
            Self::Layered(layered) => layered.is_transmissive(),
        }
    }

    fn chooses(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Lecture(lecture) => lecture.chooses(),
            Self::Layered(_) => true,
        }
    }
}

/// What the roughness of a material loses where light is refracted: one for each colour if they differ.
pub(crate) fn interfaces(material: &Material) -> Vec<Interface> {
    let (ior, dispersion, curve) = match &material.reflectance {
        Reflectance::Glass(glass) if !glass.thin => (glass.ior, glass.dispersion, Curve::Exact),
        Reflectance::Principled(p) if principled::is_solid(p) => {
            (p.ior, p.dispersion, Curve::Schlick)
        }
        _ => return vec![],
    };
    let of = |channel| Interface::new(principled::dispersed(ior, dispersion, channel), curve);
    match is_dispersive(material) {
        true => [0, 1, 2].map(|channel| of(Some(channel))).into(),
        false => vec![of(None)],
    }
}

/// What the inside of a material does to light that goes through it: absorption per metre, where it has an inside.
pub(crate) fn inside(material: &Material) -> Option<Vec3> {
    match &material.reflectance {
        Reflectance::Principled(p) => principled::inside(p),
        Reflectance::Glass(glass) => dielectric::inside(glass),
        Reflectance::Lecture { .. } | Reflectance::Unlit | Reflectance::Metal(_) => None,
    }
}

/// The index of refraction of the inside of a material, for a colour.
pub(crate) fn index(material: &Material, channel: Option<usize>) -> f32 {
    match &material.reflectance {
        Reflectance::Glass(glass) if !glass.thin => {
            principled::dispersed(glass.ior, glass.dispersion, channel)
        }
        Reflectance::Principled(p) if principled::is_solid(p) => {
            principled::dispersed(p.ior, p.dispersion, channel)
        }
        _ => 1.0,
    }
}

/// Whether a material refracts colours differently.
pub(crate) fn is_dispersive(material: &Material) -> bool {
    match &material.reflectance {
        Reflectance::Principled(p) => p.dispersion > 0.0 && principled::is_solid(p),
        Reflectance::Glass(glass) => glass.dispersion > 0.0 && !glass.thin,
        Reflectance::Lecture { .. } | Reflectance::Unlit | Reflectance::Metal(_) => false,
    }
}
