//! What glossy points are made of, many at a time, field by field: an interface of one roughness over a diffuse base.

use glam::Vec3;
use raycam_scene::Reflectance;

use crate::bsdf::layered::Layers;
use crate::lobes::fresnel::{Fresnel, conductors, schlick};
use crate::lobes::ggx::Ggx;
use crate::soa::{Three, get, set};

/// Interfaces and bases. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct Glosses<const N: usize> {
    /// Which interfaces are metals, and whether any is.
    pub metal: [bool; N],
    pub any_metal: bool,
    /// The width of the interface's lobe.
    alpha: [f32; N],
    /// What the interface reflects at normal and at grazing incidence, and what it keeps from the base.
    ends: [Three<f32, N>; 2],
    over: [Three<f32, N>; 2],
    /// What the base reflects.
    diffuse: Three<f32, N>,
    /// Of metals.
    ior: Three<f32, N>,
    extinction: Three<f32, N>,
}

impl<const N: usize> Default for Glosses<N> {
    fn default() -> Self {
        Self {
            metal: [false; N],
            any_metal: false,
            alpha: [1.0; N],
            ends: [[[0.0; N]; 3]; 2],
            over: [[[0.0; N]; 3]; 2],
            diffuse: [[0.0; N]; 3],
            ior: [[1.0; N]; 3],
            extinction: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> Glosses<N> {
    /// Sets a lane by its layers, of which only interface and base matter, and what they were made by.
    #[inline]
    pub fn put(&mut self, lane: usize, layers: &Layers, reflectance: &Reflectance) {
        self.metal[lane] = false;
        if let Reflectance::Metal(metal) = reflectance {
            self.metal[lane] = true;
            self.any_metal = true;
            set(&mut self.ior, lane, metal.ior);
            set(&mut self.extinction, lane, metal.extinction);
        }
        // What a metal reflects at normal incidence is found for many.
        let ends = |fresnel: &Fresnel| match *fresnel {
            Fresnel::Conductor { tint, .. } => (tint, tint),
            ref fresnel => fresnel.ends(),
        };
        let (own, over) = (ends(&layers.fresnel), ends(&layers.over));
        for (lanes, (f0, f90)) in [(&mut self.ends, own), (&mut self.over, over)] {
            set(&mut lanes[0], lane, f0.to_array());
            set(&mut lanes[1], lane, f90.to_array());
        }
        set(&mut self.diffuse, lane, layers.diffuse.to_array());
        self.alpha[lane] = layers.ggx.x;
    }

    /// Finds what metals reflect at normal incidence.
    #[inline(always)]
    pub fn find_ends(&mut self) {
        if self.any_metal {
            for lane in 0..N {
                let straight = self.of_metal(lane, 1.0).to_array();
                for (f0, straight) in self.ends[0].iter_mut().zip(straight) {
                    f0[lane] = if self.metal[lane] { straight } else { f0[lane] };
                }
            }
        }
    }

    #[inline(always)]
    pub fn ggx(&self, lane: usize) -> Ggx {
        Ggx {
            x: self.alpha[lane],
            y: self.alpha[lane],
        }
    }

    #[inline(always)]
    pub fn ends(&self, lane: usize) -> (Vec3, Vec3) {
        let [f0, f90] = &self.ends;
        (get(f0, lane).into(), get(f90, lane).into())
    }

    #[inline(always)]
    pub fn over(&self, lane: usize) -> (Vec3, Vec3) {
        let [f0, f90] = &self.over;
        (get(f0, lane).into(), get(f90, lane).into())
    }

    #[inline(always)]
    pub fn diffuse(&self, lane: usize) -> Vec3 {
        get(&self.diffuse, lane).into()
    }

    /// What the interfaces reflect at these cosines.
    #[inline(always)]
    pub fn reflected(&self, cosines: &[f32; N]) -> Three<f32, N> {
        let mut reflected = [[0.0; N]; 3];
        for (lane, &cosine) in cosines.iter().enumerate() {
            let (f0, f90) = self.ends(lane);
            set(&mut reflected, lane, schlick(f0, f90, cosine).to_array());
        }
        if self.any_metal {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let color = self.of_metal(lane, cosine).to_array();
                for (out, color) in reflected.iter_mut().zip(color) {
                    out[lane] = if self.metal[lane] { color } else { out[lane] };
                }
            }
        }
        reflected
    }

    #[inline(always)]
    fn of_metal(&self, lane: usize, cosine: f32) -> Vec3 {
        let (ior, extinction) = (get(&self.ior, lane), get(&self.extinction, lane));
        let tint = Vec3::from(get(&self.ends[1], lane));
        tint * conductors(cosine, ior.into(), extinction.into())
    }
}
