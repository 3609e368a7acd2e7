//! Light that leaves a rough interface which lets light through only after several of its microfacets.
//!
//! One lobe on each side returns what one microfacet alone loses (C. Kulla and A. Conty, "Revisiting Physically Based
//! Shading at Imageworks", 2017), with the shares of the sides as detailed balance asks for: with a the loss by
//! direction, A its mean and n the index of a side, light from v to l is a(v) a(l) n(l)^2 / sum(n^2 A), whatever sides
//! they are on. That is reciprocal, and loses nothing.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::bsdf::layered::Layers;
use crate::lobes::albedo_dielectric::Losses;
use crate::lobes::albedo_tables::Energy;
use crate::lobes::fresnel::Fresnel;

/// The lobes of a surface seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Between<'a> {
    energy: Energy,
    /// Of solids, whose sides differ; thin walls lose the same on both.
    losses: Option<Losses<'a>>,
    inside: bool,
    ends: (Vec3, Vec3),
    /// The share of what reflection alone would lose that the interface's own lobe gives back.
    given_back: Vec3,
    /// What is lost of the view.
    view: Vec3,
    /// Over the sides in the mean, by their squared indices relative to the viewer's.
    total: Vec3,
    /// How much of it leaves on the viewer's side.
    up: f32,
}

impl<'a> Between<'a> {
    /// `None` where nothing is lost, or nobody knows how much.
    pub fn new(layers: &Layers<'a>, energy: Energy, view: Vec3) -> Option<Self> {
        let thin = layers.eta == 1.0;
        if layers.transmission == Vec3::ZERO || layers.ggx.is_smooth() {
            return None;
        }
        let known = layers.interface.filter(|interface| {
            interface.is_between(layers.eta)
                && layers.ggx.is_isotropic()
                && !matches!(layers.over, Fresnel::Film { .. })
        });
        if !thin && known.is_none() {
            return None;
        }
        let ends = layers.over.ends();
        let mut this = Self {
            energy,
            losses: known.filter(|_| !thin).map(|known| known.at(&layers.ggx)),
            inside: layers.eta < 1.0,
            ends,
            given_back: energy.multiple(ends),
            view: Vec3::ZERO,
            total: Vec3::ZERO,
            up: 0.5,
        };
        this.view = this.lost(view, false);
        let up = this.lost_mean(false);
        this.total = up + this.lost_mean(true) * (layers.eta * layers.eta);
        if this.total.max_element() < 1e-6 {
            return None;
        }
        this.total = this.total.max(Vec3::splat(1e-9));
        this.up = (up / this.total).element_sum() / 3.0;
        Some(this)
    }

    /// What is lost of light from a direction above its side.
    fn lost(&self, direction: Vec3, other: bool) -> Vec3 {
        let reflected = self.energy.lost(direction);
        let all = match &self.losses {
            None => Vec3::splat(reflected),
            Some(losses) => {
                let [up, down] = losses.kept(self.inside != other, direction.z, self.ends);
                Vec3::ONE - up - down
            }
        };
        (all - self.given_back * reflected).max(Vec3::ZERO)
    }

    fn lost_mean(&self, other: bool) -> Vec3 {
        let reflected = self.energy.lost_mean();
        let all = match &self.losses {
            None => Vec3::splat(reflected),
            Some(losses) => losses.lost_mean(self.inside != other, self.ends),
        };
        (all - self.given_back * reflected).max(Vec3::ZERO)
    }

    /// The value of light from a direction, where nothing is absorbed.
    pub fn evaluate(&self, l: Vec3) -> Vec3 {
        let height = l.z.abs();
        let lost = self.lost(Vec3::new(l.x, l.y, height), l.z < 0.0);
        self.view * lost / self.total * (height * FRAC_1_PI)
    }

    /// How much one microfacet reflects and refracts of light from a direction, where that is known better than by its
    /// angle to the surface.
    pub fn kept(&self, direction: Vec3) -> Option<[f32; 2]> {
        let kept = self
            .losses
            .map(|losses| losses.kept(self.inside, direction.z, self.ends));
        kept.map(|kept| kept.map(|share| share.element_sum() / 3.0))
    }

    /// How much light it returns on the viewer's side, and on the other.
    pub fn shares(&self) -> [f32; 2] {
        let view = self.view.element_sum() / 3.0;
        [view * self.up, view * (1.0 - self.up)]
    }
}
