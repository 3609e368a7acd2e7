//! Layers over a base: metal, glass and glTF's principled material are this with other numbers.
//!
//! From above: a clear coat, a sheen, a rough interface, and below it a diffuse base that sends light back and on, or
//! refraction. The interface and the base share energy by their albedos (C. Kelemen and L. Szirmay-Kalos, "A Microfacet
//! Based Coupled Specular-Matte BRDF Model", 2001): reciprocal, and lossless where the base is white.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::bsdf::BsdfEval;
use crate::bsdf::layered_sampling::{
    DIFFUSE_REFLECTION, DIFFUSE_TRANSMISSION, LOBE_COUNT, SPECULAR,
};
use crate::bsdf::multiscatter_dielectric::MultiscatterDielectric;
use crate::lobes::albedo_dielectric::DielectricAlbedo;
use crate::lobes::albedo_tables::{Albedo, DirectionalAlbedo};
use crate::lobes::clearcoat::Clearcoat;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::{Ggx, MicrofacetEval};
use crate::lobes::shading_frame::{ShadingFrame, cosine_hemisphere_pdf};
use crate::lobes::sheen::Sheen;

/// What a point is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerStack<'a> {
    /// Of the interface: what it reflects, and what it keeps from the base.
    pub fresnel: Fresnel,
    pub base_fresnel: Fresnel,
    pub ggx: Ggx,
    /// What the base reflects, and what it lets through, diffusely.
    pub diffuse: Vec3,
    pub diffuse_transmission: Vec3,
    /// What is left of light that is refracted.
    pub transmission: Vec3,
    /// The index of the other side relative to the viewer's; 1 for thin walls.
    pub eta: f32,
    /// What a solid's roughness loses, where that is known.
    pub dielectric_albedo: Option<&'a DielectricAlbedo>,
    pub coat: Option<Clearcoat>,
    pub sheen: Option<Sheen>,
}

impl LayerStack<'_> {
    /// Whether it is the interface alone.
    pub fn is_interface_only(&self) -> bool {
        self.diffuse == Vec3::ZERO
            && self.diffuse_transmission == Vec3::ZERO
            && self.coat.is_none()
            && self.sheen.is_none()
    }
}

/// Layers seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayeredBsdf<'a> {
    pub(crate) stack: LayerStack<'a>,
    /// In coordinates along tangent, bitangent and normal.
    pub(crate) wo: Vec3,
    directional_albedo: DirectionalAlbedo,
    pub(crate) multiscatter: Option<MultiscatterDielectric<'a>>,
    /// What the interface leaves for the base: from here, and in the mean.
    pub(crate) base_transmittance: f32,
    mean_base_transmittance: f32,
    /// The coat's share of the view.
    pub(crate) coat_albedo: f32,
    /// How often each lobe is sampled.
    pub(crate) lobe_probabilities: [f32; LOBE_COUNT],
}

impl<'a> LayeredBsdf<'a> {
    pub fn new(layers: LayerStack<'a>, frame: &ShadingFrame) -> Self {
        let view = frame.to_local(frame.wo);
        let energy = DirectionalAlbedo::new(&layers.ggx);
        let coated = layers
            .coat
            .map_or(0.0, |coat| coat.albedo(coat.frame.to_local(frame.wo).z));
        let mut this = Self {
            stack: layers,
            wo: view,
            directional_albedo: energy,
            multiscatter: MultiscatterDielectric::new(&layers, energy, view),
            base_transmittance: 0.0,
            mean_base_transmittance: 1.0,
            coat_albedo: coated,
            lobe_probabilities: [0.0; LOBE_COUNT],
        };
        if this.has_diffuse_base() {
            this.base_transmittance = this.left(view);
            this.mean_base_transmittance = this.left_mean();
        }
        this.lobe_probabilities = this.compute_lobe_probabilities();
        this
    }

    /// Whether there is anything diffuse below the interface.
    fn has_diffuse_base(&self) -> bool {
        self.stack.diffuse != Vec3::ZERO || self.stack.diffuse_transmission != Vec3::ZERO
    }

    /// What the interface reflects of light from a direction.
    pub(crate) fn interface_albedo(&self, fresnel: &Fresnel, direction: Vec3) -> Albedo {
        if self.stack.ggx.effectively_smooth() {
            return Albedo {
                single_scatter: fresnel.reflectance(direction.z),
                multi_scatter: Vec3::ZERO,
            };
        }
        if let Fresnel::Schlick { eta: None, .. } = fresnel {
            return self.directional_albedo.albedo(fresnel.f0_f90(), direction);
        }
        let lost = self.directional_albedo.energy_loss(direction);
        Albedo {
            single_scatter: fresnel.reflectance(direction.z) * (1.0 - lost),
            multi_scatter: self
                .directional_albedo
                .multi_scatter_color(fresnel.f0_f90())
                * lost,
        }
    }

    /// What the interface leaves for the base of light from a direction.
    fn left(&self, direction: Vec3) -> f32 {
        self.interface_albedo(&self.stack.base_fresnel, direction)
            .base_transmittance()
            .max(0.0)
    }

    /// The same in the mean over the hemisphere, weighed by the cosine.
    fn left_mean(&self) -> f32 {
        if let Fresnel::Schlick { eta: None, .. } = self.stack.base_fresnel {
            return self
                .directional_albedo
                .albedo_mean(self.stack.base_fresnel.f0_f90())
                .base_transmittance()
                .max(1e-6);
        }
        const POINTS: usize = 8;
        let sum: f32 = (0..POINTS)
            .map(|i| {
                let cos2 = (i as f32 + 0.5) / POINTS as f32;
                let across = ((1.0 - cos2) / 2.0).sqrt();
                self.left(Vec3::new(across, across, cos2.sqrt()))
            })
            .sum();
        (sum / POINTS as f32).max(1e-6)
    }

    /// What the coat and the sheen leave of light that goes both ways.
    pub(crate) fn cover_transmittance(&self, frame: &ShadingFrame, light: Vec3) -> (f32, f32) {
        let coat = self.stack.coat.map_or(1.0, |coat| {
            let cosine = coat.frame.normal.dot(light).abs();
            1.0 - self.coat_albedo.max(coat.albedo(cosine))
        });
        let sheen = self.stack.sheen.map_or(1.0, |sheen| {
            let cosine = frame.normal.dot(light).abs();
            sheen
                .base_transmittance(self.wo.z)
                .min(sheen.base_transmittance(cosine))
        });
        (coat, sheen)
    }

    pub fn eval(&self, frame: &ShadingFrame, light: Vec3) -> BsdfEval {
        let l = frame.to_local(light);
        let up = frame.geometric.dot(light) > 0.0;
        if up != (l.z > 0.0) || l.z == 0.0 {
            return BsdfEval::default();
        }
        let (coat, sheen) = self.cover_transmittance(frame, light);
        if !up {
            let BsdfEval { value, pdf } = self.eval_transmission(l);
            return BsdfEval {
                value: value * (coat * sheen),
                pdf,
            };
        }
        let mut found = self.eval_reflection(l);
        found.value *= sheen;
        if let Some(sheen) = &self.stack.sheen {
            found.value += sheen.eval(self.wo, l);
        }
        found.value *= coat;
        if let Some(coat) = &self.stack.coat {
            let BsdfEval { value, pdf } = coat.eval(frame.wo, light);
            found.value += value;
            found.pdf += pdf * self.lobe_probabilities[LOBE_COUNT - 1];
        }
        found
    }

    /// The interface and the base, on the viewer's side.
    fn eval_reflection(&self, l: Vec3) -> BsdfEval {
        let (layers, v) = (&self.stack, self.wo);
        let mut value = Vec3::ZERO;
        let mut pdf = cosine_hemisphere_pdf(l.z) * self.lobe_probabilities[DIFFUSE_REFLECTION];
        if !layers.ggx.effectively_smooth() {
            let MicrofacetEval {
                cosine,
                weight: seen,
                pdf: density,
            } = MicrofacetEval::new(&layers.ggx, v, l);
            value += layers.fresnel.reflectance(cosine) * seen;
            pdf += density * (self.reflect_probability(cosine) * self.lobe_probabilities[SPECULAR]);
            let lost = self.directional_albedo.mean_energy_loss();
            if lost > 1e-6 {
                let lost = self.directional_albedo.energy_loss(v)
                    * self.directional_albedo.energy_loss(l)
                    / lost;
                value += self
                    .directional_albedo
                    .multi_scatter_color(layers.fresnel.f0_f90())
                    * (lost * l.z * FRAC_1_PI);
            }
        }
        value += layers.diffuse * self.eval_base(l) + self.between(l);
        BsdfEval { value, pdf }
    }

    /// The base of albedo 1, times the cosine.
    fn eval_base(&self, light: Vec3) -> f32 {
        self.base_transmittance * self.left(light) / self.mean_base_transmittance
            * (light.z * FRAC_1_PI)
    }

    /// What leaves after several microfacets, times the cosine.
    fn between(&self, l: Vec3) -> Vec3 {
        self.multiscatter.map_or(Vec3::ZERO, |between| {
            between.eval(l) * self.stack.transmission
        })
    }

    /// The base and refraction, on the other side.
    fn eval_transmission(&self, l: Vec3) -> BsdfEval {
        let (layers, v) = (&self.stack, self.wo);
        let mut found = BsdfEval {
            value: layers.diffuse_transmission * self.eval_base(Vec3::new(l.x, l.y, -l.z))
                + self.between(l),
            pdf: cosine_hemisphere_pdf(-l.z) * self.lobe_probabilities[DIFFUSE_TRANSMISSION],
        };
        if layers.transmission == Vec3::ZERO || layers.ggx.effectively_smooth() {
            return found;
        }
        let ggx = &layers.ggx;
        if layers.eta == 1.0 {
            // Thin walls: the reflection, seen from behind.
            let l = Vec3::new(l.x, l.y, -l.z);
            let h = (v + l).normalize();
            let cosine = v.dot(h);
            let rest = (Vec3::ONE - layers.base_fresnel.reflectance(cosine)) * layers.transmission;
            found.value += rest * (ggx.d(h) * ggx.g(v, l) / (4.0 * v.z));
            let refracts = 1.0 - self.reflect_probability(cosine);
            found.pdf +=
                ggx.pdf(v, h) / (4.0 * cosine) * (refracts * self.lobe_probabilities[SPECULAR]);
            return found;
        }
        let sum = v + l * layers.eta;
        let h = sum.normalize_or_zero();
        let h = if h.z < 0.0 { -h } else { h };
        let (seen, lit) = (v.dot(h), l.dot(h));
        if seen <= 0.0 || lit >= 0.0 {
            return found;
        }
        let rest = (Vec3::ONE - layers.base_fresnel.reflectance(seen)) * layers.transmission;
        let squeeze = -lit / (seen + layers.eta * lit).powi(2);
        let down = Vec3::new(l.x, l.y, -l.z);
        let shape = ggx.d(h) * ggx.g(v, down) * seen / v.z;
        found.value += rest * (shape * squeeze);
        let density = ggx.pdf(v, h) * layers.eta * layers.eta * squeeze;
        found.pdf +=
            density * ((1.0 - self.reflect_probability(seen)) * self.lobe_probabilities[SPECULAR]);
        found
    }

    pub fn albedo(&self) -> Vec3 {
        let layers = &self.stack;
        let Albedo {
            single_scatter: single,
            multi_scatter: multiple,
        } = self.interface_albedo(&layers.fresnel, self.wo);
        let below = (Vec3::ONE - layers.base_fresnel.reflectance(self.wo.z)) * layers.transmission;
        let inner = single
            + multiple
            + (layers.diffuse + layers.diffuse_transmission) * self.base_transmittance
            + below;
        let (sheen, left) = layers.sheen.map_or((Vec3::ZERO, 1.0), |sheen| {
            (
                sheen.albedo_color(self.wo.z),
                sheen.base_transmittance(self.wo.z),
            )
        });
        let coat = Vec3::splat(self.coat_albedo);
        (coat + (inner * left + sheen) * (1.0 - self.coat_albedo)).min(Vec3::ONE)
    }

    pub fn is_transmissive(&self) -> bool {
        self.stack.transmission != Vec3::ZERO || self.stack.diffuse_transmission != Vec3::ZERO
    }

    /// Whether light sampling finds something of it: it is not mirror and smooth glass alone.
    pub fn is_non_specular(&self) -> bool {
        let rough = |ggx: &Ggx| !ggx.effectively_smooth();
        rough(&self.stack.ggx)
            || self.stack.coat.is_some_and(|coat| rough(&coat.ggx))
            || self.lobe_probabilities[DIFFUSE_REFLECTION] > 0.0
            || self.lobe_probabilities[DIFFUSE_TRANSMISSION] > 0.0
    }
}
