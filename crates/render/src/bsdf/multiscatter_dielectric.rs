//! Light that leaves a rough refracting interface after several reflections or refractions at its microfacets.
//!
//! One lobe on each side returns the energy that one microfacet loses (C. Kulla and A. Conty, "Revisiting Physically
//! Based Shading at Imageworks", 2017). Detailed balance divides this energy between the sides. Let a be the loss by
//! direction, A its mean, and n the index of refraction of a side. For directions v and l on any sides, light from v to
//! l is then a(v) a(l) n(l)^2 / sum(n^2 A). This is reciprocal and lossless.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::bsdf::layer_stack::LayerStack;
use crate::lobes::albedo_dielectric::EnergyLoss;
use crate::lobes::albedo_tables::DirectionalAlbedo;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::mean_color::mean;

/// Energy that single scattering loses for light from `wo`, and the sides on which it returns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MultiscatterTerms {
    /// Energy loss of light from `wo`.
    pub view_loss: Vec3,
    /// Sum over both sides of the mean loss, times the square of the side's index of refraction relative to the
    /// viewer's side. At least 1e-9.
    pub mean_loss: Vec3,
    /// Fraction of the lost energy that leaves on the viewer's side.
    pub reflected_fraction: f32,
    /// False if almost no light is lost.
    pub is_significant: bool,
}

impl MultiscatterTerms {
    /// Creates the lobes from the loss of light from `wo`, and the mean losses on the viewer's side and on the far
    /// side. `eta` is the index of refraction of the far side relative to the viewer's side.
    #[inline(always)]
    pub fn new(view_loss: Vec3, [near, far]: [Vec3; 2], eta: f32) -> Self {
        let mean_loss = near + far * (eta * eta);
        let is_significant = mean_loss.max_element() >= 1e-6;
        let mean_loss = mean_loss.max(Vec3::splat(1e-9));
        Self { view_loss, mean_loss, reflected_fraction: mean(near / mean_loss), is_significant }
    }

    /// Value for a loss from `wi`, times the absolute cosine of `wi`, without absorption.
    #[inline(always)]
    pub fn eval(&self, loss: Vec3, cosine: f32) -> Vec3 {
        self.view_loss * loss / self.mean_loss * (cosine * FRAC_1_PI)
    }

    /// Fractions of light that the lobes return on the viewer's side and on the far side.
    #[inline(always)]
    pub fn lobe_probabilities(&self) -> [f32; 2] {
        let view = mean(self.view_loss);
        [view * self.reflected_fraction, view * (1.0 - self.reflected_fraction)]
    }
}

/// Multi-scatter lobes on both sides of a surface seen from one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MultiscatterDielectric<'a> {
    directional_albedo: DirectionalAlbedo,
    /// Losses of a solid, whose sides differ; `None` for thin walls, whose losses are the same on both sides.
    loss_tables: Option<EnergyLoss<'a>>,
    starts_inside: bool,
    f0_f90: (Vec3, Vec3),
    /// Part of the energy lost by reflection that the interface's own multi-scatter lobe returns.
    compensation: Vec3,
    terms: MultiscatterTerms,
}

impl<'a> MultiscatterDielectric<'a> {
    /// Creates the lobes. `None` if almost no energy is lost, or if no table contains the loss.
    pub fn new(stack: &LayerStack<'a>, directional_albedo: DirectionalAlbedo, wo: Vec3) -> Option<Self> {
        let is_thin = stack.eta == 1.0;
        if stack.transmission == Vec3::ZERO || stack.ggx.effectively_smooth() {
            return None;
        }
        let table = stack.dielectric_albedo.filter(|table| {
            table.matches_eta(stack.eta)
                && stack.ggx.is_isotropic()
                && !matches!(stack.base_fresnel, Fresnel::ThinFilm { .. })
        });
        if !is_thin && table.is_none() {
            return None;
        }
        let f0_f90 = stack.base_fresnel.f0_f90();
        let mut this = Self {
            directional_albedo,
            loss_tables: table.filter(|_| !is_thin).map(|table| table.at_roughness(&stack.ggx)),
            starts_inside: stack.eta < 1.0,
            f0_f90,
            compensation: directional_albedo.multi_scatter_color(f0_f90),
            terms: MultiscatterTerms::new(Vec3::ZERO, [Vec3::ZERO; 2], 1.0),
        };
        let view_loss = this.energy_loss(wo, false);
        let mean_losses = [this.mean_energy_loss(false), this.mean_energy_loss(true)];
        this.terms = MultiscatterTerms::new(view_loss, mean_losses, stack.eta);
        this.terms.is_significant.then_some(this)
    }

    /// Energy loss of light from `w`, a local direction on the viewer's side or on the far side; `w.z` is positive on
    /// either side.
    fn energy_loss(&self, w: Vec3, is_far_side: bool) -> Vec3 {
        let reflected = self.directional_albedo.energy_loss(w);
        let loss = match &self.loss_tables {
            None => Vec3::splat(reflected),
            Some(tables) => {
                let [up, down] = tables.albedo(self.starts_inside != is_far_side, w.z, self.f0_f90);
                Vec3::ONE - up - down
            }
        };
        (loss - self.compensation * reflected).max(Vec3::ZERO)
    }

    fn mean_energy_loss(&self, is_far_side: bool) -> Vec3 {
        let reflected = self.directional_albedo.mean_energy_loss();
        let loss = match &self.loss_tables {
            None => Vec3::splat(reflected),
            Some(tables) => tables.mean_loss(self.starts_inside != is_far_side, self.f0_f90),
        };
        (loss - self.compensation * reflected).max(Vec3::ZERO)
    }

    /// Value of the lobes for light from `wi`, times the absolute cosine of `wi`, without absorption.
    pub fn eval(&self, wi: Vec3) -> Vec3 {
        let cosine = wi.z.abs();
        let loss = self.energy_loss(Vec3::new(wi.x, wi.y, cosine), wi.z < 0.0);
        self.terms.eval(loss, cosine)
    }

    /// Albedos of a single reflection and of a single refraction of light from `w`, averaged over the colours; `None`
    /// for thin walls.
    pub fn single_scatter_albedo(&self, w: Vec3) -> Option<[f32; 2]> {
        let albedo = self.loss_tables.map(|tables| tables.albedo(self.starts_inside, w.z, self.f0_f90));
        albedo.map(|albedo| albedo.map(mean))
    }

    /// Fractions of light that the lobes return on the viewer's side and on the far side.
    pub fn lobe_probabilities(&self) -> [f32; 2] {
        self.terms.lobe_probabilities()
    }
}
