//! BSDF of layers. Metal, glass and glTF's principled material are layers with different parameters.
//!
//! From above: a clear coat, a sheen, a rough interface, and below the interface either a diffuse base that reflects
//! and transmits, or refraction. The interface and the base share energy by their albedos (C. Kelemen and L.
//! Szirmay-Kalos, "A Microfacet Based Coupled Specular-Matte BRDF Model", 2001), so that the BSDF without a coat is
//! reciprocal, and lossless over a white base.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::bsdf::BsdfEval;
use crate::bsdf::base_directions::BaseDirections;
use crate::bsdf::layer_stack::LayerStack;
use crate::bsdf::multiscatter_dielectric::MultiscatterDielectric;
use crate::lobes::albedo_internal::InternalTransmittance;
use crate::lobes::albedo_tables::{Albedo, DirectionalAlbedo, albedo_tables, multi_scatter_lobe};
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::{Ggx, MicrofacetEval};
use crate::lobes::mean_color::mean;
use crate::lobes::shading_frame::{ShadingFrame, cosine_hemisphere_pdf};

/// Number of lobes. The constants below are the lobes' indices in `lobe_probabilities`.
pub(crate) const LOBE_COUNT: usize = 5;
/// Lobe of the interface; for a rough interface that refracts, both reflection and refraction.
pub(crate) const SPECULAR: usize = 0;
pub(crate) const DIFFUSE_REFLECTION: usize = 1;
pub(crate) const DIFFUSE_TRANSMISSION: usize = 2;
/// Lobe of refraction at a smooth interface.
pub(crate) const REFRACTION: usize = 3;
pub(crate) const COAT: usize = 4;

/// BSDF of a layered material, seen from one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayeredBsdf<'a> {
    pub(crate) stack: LayerStack<'a>,
    pub(crate) wo: Vec3,
    directional_albedo: DirectionalAlbedo,
    /// Transmittance of the rough interface for light from inside; it determines the fraction of light that reaches the
    /// base.
    internal_transmittance: Option<InternalTransmittance<'a>>,
    pub(crate) multiscatter: Option<MultiscatterDielectric<'a>>,
    /// Albedo of a single reflection or refraction at the interface if [`SPECULAR`] is sampled in proportion to its
    /// value; `None` if it is sampled by visible normals.
    pub(crate) exact_interface_albedo: Option<f32>,
    /// Fraction of light that the interface passes to the base: from `wo`, and the cosine-weighted mean.
    pub(crate) base_transmittance: f32,
    mean_base_transmittance: f32,
    /// Distribution of the base's directions if it is seen from inside; `None`: a cosine distribution.
    pub(crate) base_directions: Option<BaseDirections>,
    /// Fractions of the base in the lobes [`DIFFUSE_REFLECTION`] and [`DIFFUSE_TRANSMISSION`].
    pub(crate) base_fractions: [f32; 2],
    /// Directional albedo of the coat for light from `wo`.
    pub(crate) coat_albedo: f32,
    pub(crate) lobe_probabilities: [f32; LOBE_COUNT],
}

/// Lobe of a diffuse base of albedo 1 below an interface, times the cosine of `wi`. The arguments `wo` and `wi` are the
/// interface's transmittances for these directions, and `mean` is its mean transmittance.
#[inline(always)]
pub(crate) fn base_lobe(wo: f32, wi: f32, mean: f32, cosine: f32) -> f32 {
    wo * wi / mean * (cosine * FRAC_1_PI)
}

/// Points and weights of the Gauss-Legendre quadrature from 0 to 1, exact for polynomials up to degree 9.
const GAUSS_LEGENDRE: [(f32, f32); 5] = [
    (0.046_910_077, 0.118_463_44),
    (0.230_765_34, 0.239_314_33),
    (0.5, 0.284_444_45),
    (0.769_234_66, 0.239_314_33),
    (0.953_089_95, 0.118_463_44),
];

/// Local direction above the surface with this squared cosine, halfway between the two tangents.
fn diagonal_direction(cos2: f32) -> Vec3 {
    let across = ((1.0 - cos2) / 2.0).max(0.0).sqrt();
    Vec3::new(across, across, cos2.sqrt())
}

/// Transmittance of a rough isotropic interface seen from inside; `None` for other interfaces.
fn internal_transmittance<'a>(stack: &LayerStack<'a>) -> Option<InternalTransmittance<'a>> {
    let is_inside = matches!(stack.base_fresnel, Fresnel::Schlick { eta: Some(_), .. });
    let is_rough = stack.ggx.is_isotropic() && !stack.ggx.effectively_smooth();
    let table = stack.dielectric_albedo.filter(|table| is_inside && is_rough && table.matches_eta(stack.eta));
    table.map(|table| table.internal_transmittance(&stack.ggx))
}

/// Probability of reflection at a microfacet that reflects and refracts, from the colours of the reflected and the
/// refracted light.
#[inline(always)]
pub(crate) fn reflect_probability(reflected: Vec3, refracted: Vec3) -> f32 {
    let reflected = reflected.element_sum();
    let both = reflected + refracted.element_sum();
    if both > 0.0 { reflected / both } else { 1.0 }
}

impl<'a> LayeredBsdf<'a> {
    pub fn new(stack: LayerStack<'a>, frame: &ShadingFrame) -> Self {
        let wo = frame.to_local(frame.wo);
        let directional_albedo = DirectionalAlbedo::new(&stack.ggx);
        let coat_albedo = stack.coat.map_or(0.0, |coat| coat.albedo(albedo_tables(), coat.wo().z));
        let mut this = Self {
            stack,
            wo,
            directional_albedo,
            internal_transmittance: None,
            multiscatter: MultiscatterDielectric::new(&stack, directional_albedo, wo),
            exact_interface_albedo: None,
            base_transmittance: 0.0,
            mean_base_transmittance: 1.0,
            base_directions: None,
            base_fractions: [0.0; 2],
            coat_albedo,
            lobe_probabilities: [0.0; LOBE_COUNT],
        };
        if this.has_diffuse_base() {
            this.internal_transmittance = internal_transmittance(&stack);
            this.base_transmittance = this.base_transmittance(wo);
            this.mean_base_transmittance = this.mean_base_transmittance();
            this.base_directions = this.base_directions();
            this.exact_interface_albedo = this.exact_interface_albedo();
        }
        let weights = this.lobe_weights();
        this.base_fractions = this.base_fractions(&weights);
        this.lobe_probabilities = this.sampling_probabilities(weights);
        this
    }

    fn has_diffuse_base(&self) -> bool {
        self.stack.diffuse != Vec3::ZERO || self.stack.diffuse_transmission != Vec3::ZERO
    }

    /// Albedo of the interface with the reflectance `fresnel`, for light from the local direction `w`.
    pub(crate) fn interface_albedo(&self, fresnel: &Fresnel, w: Vec3) -> Albedo {
        if self.stack.ggx.effectively_smooth() {
            return Albedo { single_scatter: fresnel.reflectance(w.z), multi_scatter: Vec3::ZERO };
        }
        if let Fresnel::Schlick { eta: None, .. } = fresnel {
            return self.directional_albedo.albedo(fresnel.f0_f90(), w);
        }
        let loss = self.directional_albedo.energy_loss(w);
        Albedo {
            single_scatter: fresnel.reflectance(w.z) * (1.0 - loss),
            multi_scatter: self.directional_albedo.multi_scatter_color(fresnel.f0_f90()) * loss,
        }
    }

    /// Fraction of the light from the local direction `w` that the interface passes to the base.
    fn base_transmittance(&self, w: Vec3) -> f32 {
        if let Some(internal) = &self.internal_transmittance {
            let f0_f90 = self.stack.base_fresnel.f0_f90();
            return self.base_share(self.directional_albedo.energy_loss(w), internal.at(w.z, f0_f90)).max(0.0);
        }
        self.interface_albedo(&self.stack.base_fresnel, w).base_transmittance().max(0.0)
    }

    /// Fraction of light from inside that the interface passes to the base. `loss` is the energy loss of a perfect
    /// mirror; `passed` is the light that such a mirror would reflect and this interface transmits.
    fn base_share(&self, loss: f32, passed: Vec3) -> f32 {
        let f0_f90 = self.stack.base_fresnel.f0_f90();
        let multi_scatter = self.directional_albedo.multi_scatter_color(f0_f90) * loss;
        Albedo { single_scatter: Vec3::splat(1.0 - loss) - passed, multi_scatter }.base_transmittance()
    }

    /// Cosine-weighted mean of [`LayeredBsdf::base_transmittance`] over the hemisphere.
    fn mean_base_transmittance(&self) -> f32 {
        let fresnel = &self.stack.base_fresnel;
        if let Fresnel::Schlick { eta: None, .. } = fresnel {
            return self.directional_albedo.albedo_mean(fresnel.f0_f90()).base_transmittance().max(1e-6);
        }
        if let Some(internal) = &self.internal_transmittance {
            return self
                .base_share(self.directional_albedo.mean_energy_loss(), internal.mean(fresnel.f0_f90()))
                .max(1e-6);
        }
        // Beyond the critical angle all light is reflected, and the transmittance has a kink. Both parts are integrated
        // separately.
        let critical_cos2 = self.critical_cos2();
        let at = |cos2: f32| self.base_transmittance(diagonal_direction(cos2));
        let (mut beyond, mut within) = (0.0, 0.0);
        for (point, weight) in GAUSS_LEGENDRE {
            // The quadrature runs over the cosine instead of its square, because Schlick's transmittance is a
            // polynomial in the cosine or, within the critical angle, in the cosine of the refracted ray.
            let (square, weight) = (point * point, 2.0 * weight * point);
            within += weight * at(critical_cos2 + (1.0 - critical_cos2) * square);
            if critical_cos2 > 0.0 {
                beyond += weight * at(critical_cos2 * square);
            }
        }
        (critical_cos2 * beyond + (1.0 - critical_cos2) * within).max(1e-6)
    }

    /// Squared cosine of the critical angle if the base is seen from inside, otherwise 0.
    fn critical_cos2(&self) -> f32 {
        match self.stack.base_fresnel {
            Fresnel::Schlick { eta: Some(eta), .. } => (1.0 - eta * eta).max(0.0),
            _ => 0.0,
        }
    }

    fn base_directions(&self) -> Option<BaseDirections> {
        let critical_cos2 = self.critical_cos2();
        let transmittance = |cos2: f32| self.base_transmittance(diagonal_direction(cos2));
        if critical_cos2 > 0.0 { BaseDirections::new(critical_cos2, transmittance) } else { None }
    }

    /// Albedo of a single reflection or refraction at a rough interface seen from inside, averaged over the colours;
    /// `None` if no table contains it, or if the interface does not refract.
    fn exact_interface_albedo(&self) -> Option<f32> {
        let internal = self.internal_transmittance.filter(|_| self.stack.transmission != Vec3::ZERO)?;
        let (stack, cosine) = (&self.stack, self.wo.z);
        let mirror = Vec3::splat(1.0 - self.directional_albedo.energy_loss(self.wo));
        let reflected = mirror - internal.at(cosine, stack.fresnel.f0_f90());
        let refracted = internal.refraction_at(cosine, stack.base_fresnel.f0_f90()) * stack.transmission;
        let albedo = mean(reflected + refracted);
        (albedo > 1e-6).then_some(albedo)
    }

    /// Density of [`LayeredBsdf::sample_diffuse`] at a direction with this cosine, for the reflected (0) or transmitted
    /// (1) diffuse lobe.
    fn diffuse_pdf(&self, cosine: f32, side: usize) -> f32 {
        let fraction = self.base_fractions[side];
        let relative = self.base_directions.map_or(1.0, |base| 1.0 + fraction * (base.relative_density(cosine) - 1.0));
        cosine_hemisphere_pdf(cosine) * relative
    }

    /// Fractions of light that the coat and the sheen transmit. The coat's fraction depends only on the viewing
    /// direction.
    pub(crate) fn cover_transmittance(&self, frame: &ShadingFrame, wi_world: Vec3) -> (f32, f32) {
        let sheen = self.stack.sheen.map_or(1.0, |sheen| {
            let cosine = frame.normal.dot(wi_world).abs();
            let from_wo = sheen.base_transmittance(self.wo.z);
            from_wo.min(sheen.base_transmittance(cosine))
        });
        (1.0 - self.coat_albedo, sheen)
    }

    pub fn eval(&self, frame: &ShadingFrame, wi_world: Vec3) -> BsdfEval {
        let wi = frame.to_local(wi_world);
        let is_reflection = frame.geometric.dot(wi_world) > 0.0;
        if is_reflection != (wi.z > 0.0) || wi.z == 0.0 {
            // The coat has its own normal, so it may reflect in directions in which the base's mapped normal faces
            // away.
            return if is_reflection { self.eval_coat(wi_world) } else { BsdfEval::default() };
        }
        let (coat, sheen) = self.cover_transmittance(frame, wi_world);
        if !is_reflection {
            let BsdfEval { value, pdf } = self.eval_transmission(wi);
            return BsdfEval { value: value * (coat * sheen), pdf };
        }
        let mut eval = self.eval_reflection(wi);
        eval.value *= sheen;
        if let Some(sheen) = &self.stack.sheen {
            eval.value += sheen.eval(self.wo, wi);
        }
        let own = self.eval_coat(wi_world);
        BsdfEval { value: eval.value * coat + own.value, pdf: eval.pdf + own.pdf }
    }

    /// Part of [`LayeredBsdf::eval`] that the coat reflects.
    fn eval_coat(&self, wi_world: Vec3) -> BsdfEval {
        self.stack.coat.map_or(BsdfEval::default(), |coat| {
            let (value, pdf) = coat.eval(coat.wo(), wi_world);
            BsdfEval { value: Vec3::splat(value), pdf: pdf * self.lobe_probabilities[COAT] }
        })
    }

    /// Part of [`LayeredBsdf::eval`] that comes from the diffuse base and the sheen.
    pub fn eval_diffuse(&self, frame: &ShadingFrame, wi_world: Vec3) -> Vec3 {
        let (stack, wi) = (&self.stack, frame.to_local(wi_world));
        let is_reflection = frame.geometric.dot(wi_world) > 0.0;
        if is_reflection != (wi.z > 0.0) || wi.z == 0.0 {
            return Vec3::ZERO;
        }
        let (coat, sheen) = self.cover_transmittance(frame, wi_world);
        if !is_reflection {
            let base = self.eval_base(Vec3::new(wi.x, wi.y, -wi.z)) / (stack.eta * stack.eta);
            return stack.diffuse_transmission * (base * coat * sheen);
        }
        let covering = stack.sheen.as_ref().map_or(Vec3::ZERO, |sheen| sheen.eval(self.wo, wi));
        (stack.diffuse * (self.eval_base(wi) * sheen) + covering) * coat
    }

    /// Part of [`LayeredBsdf::albedo`] that comes from the diffuse base and the sheen.
    pub fn diffuse_albedo(&self) -> Vec3 {
        let stack = &self.stack;
        let (sheen, passed) = stack
            .sheen
            .map_or((Vec3::ZERO, 1.0), |sheen| (sheen.albedo_color(self.wo.z), sheen.base_transmittance(self.wo.z)));
        let base = (stack.diffuse + stack.diffuse_transmission) * (self.base_transmittance * passed);
        (base + sheen) * (1.0 - self.coat_albedo)
    }

    /// Value and density of the interface and the base, for `wi` on the viewer's side.
    fn eval_reflection(&self, wi: Vec3) -> BsdfEval {
        let (stack, wo) = (&self.stack, self.wo);
        let mut value = Vec3::ZERO;
        let mut pdf = self.diffuse_pdf(wi.z, 0) * self.lobe_probabilities[DIFFUSE_REFLECTION];
        if !stack.ggx.effectively_smooth() {
            let facets = MicrofacetEval::reflection(&stack.ggx, wo, wi);
            let reflected = stack.fresnel.reflectance(facets.cosine) * facets.weight;
            value += reflected;
            pdf += self.interface_pdf(reflected, facets.pdf, self.reflect_probability(facets.cosine));
            value += multi_scatter_lobe(
                self.directional_albedo.multi_scatter_color(stack.fresnel.f0_f90()),
                [wo, wi].map(|w| self.directional_albedo.energy_loss(w)),
                self.directional_albedo.mean_energy_loss(),
                wi.z,
            );
        }
        value += stack.diffuse * self.eval_base(wi) + self.eval_multiscatter(wi);
        BsdfEval { value, pdf }
    }

    /// Value of a diffuse base of albedo 1, times the cosine of `wi`, which must lie above the surface.
    fn eval_base(&self, wi: Vec3) -> f32 {
        let from_wi = self.base_transmittance(wi);
        base_lobe(self.base_transmittance, from_wi, self.mean_base_transmittance, wi.z)
    }

    /// Value of the light that leaves after scattering at several microfacets, times the cosine of `wi`.
    fn eval_multiscatter(&self, wi: Vec3) -> Vec3 {
        self.multiscatter.map_or(Vec3::ZERO, |multiscatter| multiscatter.eval(wi) * self.stack.transmission)
    }

    /// Value and density of the base and of refraction, for `wi` on the far side.
    fn eval_transmission(&self, wi: Vec3) -> BsdfEval {
        let (stack, wo) = (&self.stack, self.wo);
        let mirrored = Vec3::new(wi.x, wi.y, -wi.z);
        // The value contains the squared relative index of refraction, as for refraction, so that light keeps its
        // energy if it enters by one lobe and leaves by another.
        let scale = 1.0 / (stack.eta * stack.eta);
        let mut eval = BsdfEval {
            value: stack.diffuse_transmission * (self.eval_base(mirrored) * scale) + self.eval_multiscatter(wi),
            pdf: self.diffuse_pdf(-wi.z, 1) * self.lobe_probabilities[DIFFUSE_TRANSMISSION],
        };
        if stack.transmission == Vec3::ZERO || stack.ggx.effectively_smooth() {
            return eval;
        }
        let facets = if stack.eta == 1.0 {
            thin_wall_facets(&stack.ggx, wo, mirrored)
        } else {
            MicrofacetEval::refraction(&stack.ggx, stack.eta, wo, wi)
        };
        let refracted =
            (Vec3::ONE - stack.base_fresnel.reflectance(facets.cosine)) * stack.transmission * facets.weight;
        eval.value += refracted;
        eval.pdf += self.interface_pdf(refracted / scale, facets.pdf, 1.0 - self.reflect_probability(facets.cosine));
        eval
    }

    /// Part of the density that comes from [`SPECULAR`], for a direction into which the interface scatters the fraction
    /// `scattered` of the light per solid angle. `facets_pdf` is the density of this direction if visible normals are
    /// sampled, and `probability` the probability that a microfacet reflects or refracts.
    fn interface_pdf(&self, scattered: Vec3, facets_pdf: f32, probability: f32) -> f32 {
        let lobe_probability = self.lobe_probabilities[SPECULAR];
        match self.exact_interface_albedo {
            Some(albedo) => scattered.element_sum() / (3.0 * albedo) * lobe_probability,
            None => facets_pdf * (probability * lobe_probability),
        }
    }

    /// Directional albedo, at most 1.
    pub fn albedo(&self) -> Vec3 {
        let stack = &self.stack;
        let interface = self.interface_albedo(&stack.fresnel, self.wo);
        let below = (Vec3::ONE - stack.base_fresnel.reflectance(self.wo.z)) * stack.transmission;
        let inner = interface.single_scatter
            + interface.multi_scatter
            + (stack.diffuse + stack.diffuse_transmission) * self.base_transmittance
            + below;
        let (sheen, passed) = stack.sheen.map_or((Vec3::ZERO, 1.0), |sheen| {
            let cosine = self.wo.z;
            (sheen.albedo_color(cosine), sheen.base_transmittance(cosine))
        });
        let coat = Vec3::splat(self.coat_albedo);
        (coat + (inner * passed + sheen) * (1.0 - self.coat_albedo)).min(Vec3::ONE)
    }

    pub fn is_transmissive(&self) -> bool {
        self.stack.transmission != Vec3::ZERO || self.stack.diffuse_transmission != Vec3::ZERO
    }

    /// True if the layers contain more than mirrors and smooth refraction, so that light sampling is useful.
    pub fn is_non_specular(&self) -> bool {
        let is_rough = |ggx: &Ggx| !ggx.effectively_smooth();
        is_rough(&self.stack.ggx)
            || self.stack.coat.is_some_and(|coat| is_rough(&coat.ggx))
            || self.lobe_probabilities[DIFFUSE_REFLECTION] > 0.0
            || self.lobe_probabilities[DIFFUSE_TRANSMISSION] > 0.0
    }
}

/// Microfacets of a thin wall: transmission has the shape of reflection, mirrored to the other side. `mirrored` is the
/// light's direction mirrored to the upper side.
fn thin_wall_facets(ggx: &Ggx, wo: Vec3, mirrored: Vec3) -> MicrofacetEval {
    let wm = (wo + mirrored).normalize();
    let cosine = wo.dot(wm);
    MicrofacetEval {
        cosine,
        weight: ggx.d(wm) * ggx.g(wo, mirrored) / (4.0 * wo.z),
        pdf: ggx.pdf(wo, wm) / (4.0 * cosine),
    }
}
