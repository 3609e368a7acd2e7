//! Layers over a base: metal, glass and glTF's principled material are this with other numbers.
//!
//! From above: a clear coat, a sheen, a rough interface, and below it a diffuse base that sends light back and on, or
//! refraction. The interface and the base share energy by their albedos (C. Kelemen and L. Szirmay-Kalos, "A Microfacet
//! Based Coupled Specular-Matte BRDF Model", 2001): reciprocal, and lossless where the base is white.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::bsdf::Value;
use crate::bsdf::layered_sampling::{DOWN, LOBES, SPECULAR, UP};
use crate::bsdf::multiscatter_dielectric::Between;
use crate::lobes::albedo_dielectric::Interface;
use crate::lobes::albedo_tables::{Albedo, Energy};
use crate::lobes::clearcoat::Coat;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::{Facets, Ggx};
use crate::lobes::shading_frame::{Frame, cosine_density};
use crate::lobes::sheen::Sheen;

/// What a point is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layers<'a> {
    /// Of the interface: what it reflects, and what it keeps from the base.
    pub fresnel: Fresnel,
    pub over: Fresnel,
    pub ggx: Ggx,
    /// What the base reflects, and what it lets through, diffusely.
    pub diffuse: Vec3,
    pub through: Vec3,
    /// What is left of light that is refracted.
    pub transmission: Vec3,
    /// The index of the other side relative to the viewer's; 1 for thin walls.
    pub eta: f32,
    /// What a solid's roughness loses, where that is known.
    pub interface: Option<&'a Interface>,
    pub coat: Option<Coat>,
    pub sheen: Option<Sheen>,
}

impl Layers<'_> {
    /// Whether it is the interface alone.
    pub fn is_bare(&self) -> bool {
        self.diffuse == Vec3::ZERO
            && self.through == Vec3::ZERO
            && self.coat.is_none()
            && self.sheen.is_none()
    }
}

/// Layers seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layered<'a> {
    pub(crate) layers: Layers<'a>,
    /// In coordinates along tangent, bitangent and normal.
    pub(crate) view: Vec3,
    energy: Energy,
    pub(crate) between: Option<Between<'a>>,
    /// What the interface leaves for the base: from here, and in the mean.
    pub(crate) left: f32,
    left_mean: f32,
    /// The coat's share of the view.
    pub(crate) coated: f32,
    /// How often each lobe is sampled.
    pub(crate) shares: [f32; LOBES],
}

impl<'a> Layered<'a> {
    pub fn new(layers: Layers<'a>, frame: &Frame) -> Self {
        let view = frame.local(frame.view);
        let energy = Energy::new(&layers.ggx);
        let coated = layers
            .coat
            .map_or(0.0, |coat| coat.reflected(coat.frame.local(frame.view).z));
        let mut this = Self {
            layers,
            view,
            energy,
            between: Between::new(&layers, energy, view),
            left: 0.0,
            left_mean: 1.0,
            coated,
            shares: [0.0; LOBES],
        };
        if this.has_base() {
            this.left = this.left(view);
            this.left_mean = this.left_mean();
        }
        this.shares = this.shares();
        this
    }

    /// Whether there is anything diffuse below the interface.
    fn has_base(&self) -> bool {
        self.layers.diffuse != Vec3::ZERO || self.layers.through != Vec3::ZERO
    }

    /// What the interface reflects of light from a direction.
    pub(crate) fn albedo_of(&self, fresnel: &Fresnel, direction: Vec3) -> Albedo {
        if self.layers.ggx.is_smooth() {
            return Albedo {
                single: fresnel.reflected(direction.z),
                multiple: Vec3::ZERO,
            };
        }
        if let Fresnel::Schlick { inside: None, .. } = fresnel {
            return self.energy.albedo(fresnel.ends(), direction);
        }
        let lost = self.energy.lost(direction);
        Albedo {
            single: fresnel.reflected(direction.z) * (1.0 - lost),
            multiple: self.energy.multiple(fresnel.ends()) * lost,
        }
    }

    /// What the interface leaves for the base of light from a direction.
    fn left(&self, direction: Vec3) -> f32 {
        self.albedo_of(&self.layers.over, direction).left().max(0.0)
    }

    /// The same in the mean over the hemisphere, weighed by the cosine.
    fn left_mean(&self) -> f32 {
        if let Fresnel::Schlick { inside: None, .. } = self.layers.over {
            return self
                .energy
                .albedo_mean(self.layers.over.ends())
                .left()
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
    pub(crate) fn covered(&self, frame: &Frame, light: Vec3) -> (f32, f32) {
        let coat = self.layers.coat.map_or(1.0, |coat| {
            let cosine = coat.frame.normal.dot(light).abs();
            1.0 - self.coated.max(coat.reflected(cosine))
        });
        let sheen = self.layers.sheen.map_or(1.0, |sheen| {
            let cosine = frame.normal.dot(light).abs();
            sheen.left(self.view.z).min(sheen.left(cosine))
        });
        (coat, sheen)
    }

    pub fn evaluate(&self, frame: &Frame, light: Vec3) -> Value {
        let l = frame.local(light);
        let up = frame.geometric.dot(light) > 0.0;
        if up != (l.z > 0.0) || l.z == 0.0 {
            return Value::default();
        }
        let (coat, sheen) = self.covered(frame, light);
        if !up {
            let Value { value, pdf } = self.below(l);
            return Value {
                value: value * (coat * sheen),
                pdf,
            };
        }
        let mut found = self.above(l);
        found.value *= sheen;
        if let Some(sheen) = &self.layers.sheen {
            found.value += sheen.evaluate(self.view, l);
        }
        found.value *= coat;
        if let Some(coat) = &self.layers.coat {
            let Value { value, pdf } = coat.evaluate(frame.view, light);
            found.value += value;
            found.pdf += pdf * self.shares[LOBES - 1];
        }
        found
    }

    /// The interface and the base, on the viewer's side.
    fn above(&self, l: Vec3) -> Value {
        let (layers, v) = (&self.layers, self.view);
        let mut value = Vec3::ZERO;
        let mut pdf = cosine_density(l.z) * self.shares[UP];
        if !layers.ggx.is_smooth() {
            let Facets {
                cosine,
                seen,
                pdf: density,
            } = Facets::new(&layers.ggx, v, l);
            value += layers.fresnel.reflected(cosine) * seen;
            pdf += density * (self.mirrors(cosine) * self.shares[SPECULAR]);
            let lost = self.energy.lost_mean();
            if lost > 1e-6 {
                let lost = self.energy.lost(v) * self.energy.lost(l) / lost;
                value += self.energy.multiple(layers.fresnel.ends()) * (lost * l.z * FRAC_1_PI);
            }
        }
        value += layers.diffuse * self.base(l) + self.between(l);
        Value { value, pdf }
    }

    /// The base of albedo 1, times the cosine.
    fn base(&self, light: Vec3) -> f32 {
        self.left * self.left(light) / self.left_mean * (light.z * FRAC_1_PI)
    }

    /// What leaves after several microfacets, times the cosine.
    fn between(&self, l: Vec3) -> Vec3 {
        self.between.map_or(Vec3::ZERO, |between| {
            between.evaluate(l) * self.layers.transmission
        })
    }

    /// The base and refraction, on the other side.
    fn below(&self, l: Vec3) -> Value {
        let (layers, v) = (&self.layers, self.view);
        let mut found = Value {
            value: layers.through * self.base(Vec3::new(l.x, l.y, -l.z)) + self.between(l),
            pdf: cosine_density(-l.z) * self.shares[DOWN],
        };
        if layers.transmission == Vec3::ZERO || layers.ggx.is_smooth() {
            return found;
        }
        let ggx = &layers.ggx;
        if layers.eta == 1.0 {
            // Thin walls: the reflection, seen from behind.
            let l = Vec3::new(l.x, l.y, -l.z);
            let h = (v + l).normalize();
            let cosine = v.dot(h);
            let rest = (Vec3::ONE - layers.over.reflected(cosine)) * layers.transmission;
            found.value += rest * (ggx.density(h) * ggx.visible_both(v, l) / (4.0 * v.z));
            let refracts = 1.0 - self.mirrors(cosine);
            found.pdf += ggx.pdf(v, h) / (4.0 * cosine) * (refracts * self.shares[SPECULAR]);
            return found;
        }
        let sum = v + l * layers.eta;
        let h = sum.normalize_or_zero();
        let h = if h.z < 0.0 { -h } else { h };
        let (seen, lit) = (v.dot(h), l.dot(h));
        if seen <= 0.0 || lit >= 0.0 {
            return found;
        }
        let rest = (Vec3::ONE - layers.over.reflected(seen)) * layers.transmission;
        let squeeze = -lit / (seen + layers.eta * lit).powi(2);
        let down = Vec3::new(l.x, l.y, -l.z);
        let shape = ggx.density(h) * ggx.visible_both(v, down) * seen / v.z;
        found.value += rest * (shape * squeeze);
        let density = ggx.pdf(v, h) * layers.eta * layers.eta * squeeze;
        found.pdf += density * ((1.0 - self.mirrors(seen)) * self.shares[SPECULAR]);
        found
    }

    pub fn albedo(&self) -> Vec3 {
        let layers = &self.layers;
        let Albedo { single, multiple } = self.albedo_of(&layers.fresnel, self.view);
        let below = (Vec3::ONE - layers.over.reflected(self.view.z)) * layers.transmission;
        let inner = single + multiple + (layers.diffuse + layers.through) * self.left + below;
        let (sheen, left) = layers.sheen.map_or((Vec3::ZERO, 1.0), |sheen| {
            (sheen.reflected(self.view.z), sheen.left(self.view.z))
        });
        let coat = Vec3::splat(self.coated);
        (coat + (inner * left + sheen) * (1.0 - self.coated)).min(Vec3::ONE)
    }

    pub fn is_transmissive(&self) -> bool {
        self.layers.transmission != Vec3::ZERO || self.layers.through != Vec3::ZERO
    }

    /// Whether light sampling finds something of it: it is not mirror and smooth glass alone.
    pub fn is_lit(&self) -> bool {
        let rough = |ggx: &Ggx| !ggx.is_smooth();
        rough(&self.layers.ggx)
            || self.layers.coat.is_some_and(|coat| rough(&coat.ggx))
            || self.shares[UP] > 0.0
            || self.shares[DOWN] > 0.0
    }
}
