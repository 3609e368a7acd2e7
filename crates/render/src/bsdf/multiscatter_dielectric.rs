//! Light that leaves a rough interface which lets light through only after several of its microfacets.
//!
//! One lobe on each side returns what one microfacet alone loses (C. Kulla and A. Conty, "Revisiting Physically Based
//! Shading at Imageworks", 2017), with the shares of the sides as detailed balance asks for: with a the loss by
//! direction, A its mean and n the index of a side, light from v to l is a(v) a(l) n(l)^2 / sum(n^2 A), whatever sides
//! they are on. That is reciprocal, and loses nothing.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::bsdf::layered::LayerStack;
use crate::lobes::albedo_dielectric::EnergyLoss;
use crate::lobes::albedo_tables::DirectionalAlbedo;
use crate::lobes::fresnel::Fresnel;

/// The lobes of a surface seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MultiscatterDielectric<'a> {
    directional_albedo: DirectionalAlbedo,
    /// Of solids, whose sides differ; thin walls lose the same on both.
    loss_tables: Option<EnergyLoss<'a>>,
    starts_inside: bool,
    f0_f90: (Vec3, Vec3),
    /// The share of what reflection alone would lose that the interface's own lobe gives back.
    compensation: Vec3,
    /// What is lost of the view.
    view_loss: Vec3,
    /// Over the sides in the mean, by their squared indices relative to the viewer's.
    mean_loss: Vec3,
    /// How much of it leaves on the viewer's side.
    reflected_fraction: f32,
}

impl<'a> MultiscatterDielectric<'a> {
    /// `None` where nothing is lost, or nobody knows how much.
    pub fn new(layers: &LayerStack<'a>, energy: DirectionalAlbedo, view: Vec3) -> Option<Self> {
        let thin = layers.eta == 1.0;
        if layers.transmission == Vec3::ZERO || layers.ggx.effectively_smooth() {
            return None;
        }
        let known = layers.dielectric_albedo.filter(|interface| {
            interface.matches_eta(layers.eta)
                && layers.ggx.is_isotropic()
                && !matches!(layers.base_fresnel, Fresnel::ThinFilm { .. })
        });
        if !thin && known.is_none() {
            return None;
        }
        let ends = layers.base_fresnel.f0_f90();
        let mut this = Self {
            directional_albedo: energy,
            loss_tables: known
                .filter(|_| !thin)
                .map(|known| known.at_roughness(&layers.ggx)),
            starts_inside: layers.eta < 1.0,
            f0_f90: ends,
            compensation: energy.multi_scatter_color(ends),
            view_loss: Vec3::ZERO,
            mean_loss: Vec3::ZERO,
            reflected_fraction: 0.5,
        };
        this.view_loss = this.energy_loss(view, false);
        let up = this.mean_energy_loss(false);
        this.mean_loss = up + this.mean_energy_loss(true) * (layers.eta * layers.eta);
        if this.mean_loss.max_element() < 1e-6 {
            return None;
        }
        this.mean_loss = this.mean_loss.max(Vec3::splat(1e-9));
        this.reflected_fraction = (up / this.mean_loss).element_sum() / 3.0;
        Some(this)
    }

    /// What is lost of light from a direction above its side.
    fn energy_loss(&self, direction: Vec3, other: bool) -> Vec3 {
        let reflected = self.directional_albedo.energy_loss(direction);
        let all = match &self.loss_tables {
            None => Vec3::splat(reflected),
            Some(losses) => {
                let [up, down] =
                    losses.albedo(self.starts_inside != other, direction.z, self.f0_f90);
                Vec3::ONE - up - down
            }
        };
        (all - self.compensation * reflected).max(Vec3::ZERO)
    }

    fn mean_energy_loss(&self, other: bool) -> Vec3 {
        let reflected = self.directional_albedo.mean_energy_loss();
        let all = match &self.loss_tables {
            None => Vec3::splat(reflected),
            Some(losses) => losses.mean_loss(self.starts_inside != other, self.f0_f90),
        };
        (all - self.compensation * reflected).max(Vec3::ZERO)
    }

    /// The value of light from a direction, where nothing is absorbed.
    pub fn eval(&self, l: Vec3) -> Vec3 {
        let height = l.z.abs();
        let lost = self.energy_loss(Vec3::new(l.x, l.y, height), l.z < 0.0);
        self.view_loss * lost / self.mean_loss * (height * FRAC_1_PI)
    }

    /// How much one microfacet reflects and refracts of light from a direction, where that is known better than by its
    /// angle to the surface.
    pub fn single_scatter_albedo(&self, direction: Vec3) -> Option<[f32; 2]> {
        let kept = self
            .loss_tables
            .map(|losses| losses.albedo(self.starts_inside, direction.z, self.f0_f90));
        kept.map(|kept| kept.map(|share| share.element_sum() / 3.0))
    }

    /// How much light it returns on the viewer's side, and on the other.
    pub fn lobe_probabilities(&self) -> [f32; 2] {
        let view = self.view_loss.element_sum() / 3.0;
        [
            view * self.reflected_fraction,
            view * (1.0 - self.reflected_fraction),
        ]
    }
}
