//! Matte surfaces without anything else to them: most of what there is.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use raycam_bvh::Loops;

use crate::bsdf::{ScatterSample, Scattering, Value};
use crate::guiding::cones::{Aims, share};
use crate::lobes::shading_frame::{Frame, above, cosine_density, cosine_direction};
use crate::soa::{LANES, Three, get, set};

/// One point of such a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Matte<'a> {
    pub albedo: Vec3,
    /// Where it scatters to, drawn by [`Directions`].
    pub direction: Vec3,
    /// Where its rays are aimed: in which lane.
    pub aims: Option<(&'a Aims<LANES>, usize)>,
}

impl Matte<'_> {
    #[inline(always)]
    fn density(&self, direction: Vec3, cosine: f32) -> f32 {
        match self.aims {
            Some((aims, lane)) => aims.density(lane, direction, cosine),
            None => cosine_density(cosine),
        }
    }
}

impl Scattering for Matte<'_> {
    /// A triangle sends light back on the viewer's side, whatever the smooth surface says.
    #[inline]
    fn evaluate(&self, frame: &Frame, light: Vec3) -> Value {
        let cosine = frame.normal.dot(light);
        if frame.geometric.dot(light) <= 0.0 || cosine <= 0.0 {
            return Value::default();
        }
        Value {
            value: self.albedo * FRAC_1_PI * cosine,
            pdf: self.density(light, cosine),
        }
    }

    #[inline]
    fn sample(&self, frame: &Frame, _: [f32; 3]) -> Option<ScatterSample> {
        let direction = self.direction;
        if frame.geometric.dot(direction) <= 0.0 {
            return None;
        }
        let cosine = frame.normal.dot(direction);
        let pdf = self.density(direction, cosine);
        let weight = match self.aims {
            Some(_) => self.albedo * share(cosine, pdf),
            // Exactly: value and density differ by the albedo alone.
            None => self.albedo,
        };
        Some(ScatterSample {
            direction,
            weight,
            pdf,
            delta: false,
            squeeze: 1.0,
        })
    }

    fn albedo(&self, _: &Frame) -> Vec3 {
        self.albedo
    }

    fn is_lit(&self) -> bool {
        true
    }

    fn is_transmissive(&self) -> bool {
        false
    }

    fn chooses(&self) -> bool {
        false
    }
}

/// Draws directions of many matte points, by two numbers each.
pub(crate) struct Directions<'a, const N: usize> {
    pub normals: &'a Three<f32, N>,
    pub random: &'a [[f32; N]; 2],
    pub out: &'a mut Three<f32, N>,
}

impl<const N: usize> Loops for Directions<'_, N> {
    #[inline(always)]
    fn run(self) {
        for lane in 0..N {
            let random = [self.random[0][lane], self.random[1][lane]];
            let direction = above(get(self.normals, lane).into(), cosine_direction(random));
            set(self.out, lane, direction.to_array());
        }
    }
}
