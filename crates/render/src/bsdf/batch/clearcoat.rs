//! Clear coats of many points, field by field: what [`Coat`] is at one.

use glam::Vec3;

use crate::interaction::Places;
use crate::lobes::albedo_tables::{Albedo, Rows, Tables};
use crate::lobes::clearcoat::{COAT, Coat};
use crate::lobes::fresnel::schlick;
use crate::lobes::ggx::{Facets, Ggx};
use crate::lobes::shading_frame::Frame;
use crate::soa::{Three, get, set};

/// Coats, some of which are mirrors. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct Coats<const N: usize> {
    /// Which lanes have one, and whether any has.
    pub is: [bool; N],
    pub any: bool,
    weight: [f32; N],
    alpha: [f32; N],
    /// Which the viewer sees.
    normal: Three<f32, N>,
    /// Along tangent, bitangent and normal.
    view: Three<f32, N>,
    /// Their share of the view.
    pub coated: [f32; N],
}

/// What they do with light from some directions.
pub(crate) struct Coatings<const N: usize> {
    /// Of any colour, times the cosine, and the density of sampling it.
    pub value: [f32; N],
    pub pdf: [f32; N],
    /// What is left of light that goes both ways through them.
    pub left: [f32; N],
}

/// Where they send light on.
pub(crate) struct Reflections<const N: usize> {
    pub goes: [bool; N],
    pub direction: Three<f32, N>,
    /// Of mirrors, times the chance that they are asked.
    pub weight: [f32; N],
    pub delta: [bool; N],
}

impl<const N: usize> Default for Coats<N> {
    fn default() -> Self {
        Self {
            is: [false; N],
            any: false,
            weight: [0.0; N],
            alpha: [1.0; N],
            normal: [[0.0; N]; 3],
            view: [[0.0; N]; 3],
            coated: [0.0; N],
        }
    }
}

impl<const N: usize> Coats<N> {
    #[inline]
    pub fn put(&mut self, lane: usize, coat: Option<&Coat>) {
        self.is[lane] = coat.is_some();
        if let Some(coat) = coat {
            self.any = true;
            (self.weight[lane], self.alpha[lane]) = (coat.weight, coat.ggx.x);
            set(&mut self.normal, lane, coat.frame.normal.to_array());
        }
    }

    #[inline(always)]
    fn ggx(&self, lane: usize) -> Ggx {
        Ggx {
            x: self.alpha[lane],
            y: self.alpha[lane],
        }
    }

    #[inline(always)]
    fn frame(&self, places: &Places<N>, lane: usize) -> Frame {
        places.frame(lane).about(get(&self.normal, lane).into())
    }

    /// [`Coat::reflected`].
    #[inline(always)]
    fn reflected(&self, lane: usize, tables: &Tables, cosine: f32) -> f32 {
        let rows = Rows::new(&self.ggx(lane));
        let (at, [kept, _]) = (rows.at(tables, cosine.max(0.0)), rows.mean(tables));
        self.weight[lane] * Albedo::new(COAT.ends(), at, kept).single.x
    }

    /// What depends on the view.
    #[inline(always)]
    pub fn see(&mut self, places: &Places<N>, tables: &Tables) {
        for lane in 0..N {
            let frame = self.frame(places, lane);
            set(&mut self.view, lane, frame.local(frame.view).to_array());
        }
        for lane in 0..N {
            let coated = self.reflected(lane, tables, self.view[2][lane]);
            self.coated[lane] = if self.is[lane] { coated } else { 0.0 };
        }
    }

    /// [`Coat::evaluate`], and what they leave; where there is none, all.
    #[inline(always)]
    pub fn evaluate(
        &self,
        places: &Places<N>,
        tables: &Tables,
        directions: &Three<f32, N>,
    ) -> Coatings<N> {
        let mut out = Coatings {
            value: [0.0; N],
            pdf: [0.0; N],
            left: [1.0; N],
        };
        for lane in 0..N {
            let light = Vec3::from(get(directions, lane));
            let (v, l) = (
                Vec3::from(get(&self.view, lane)),
                self.frame(places, lane).local(light),
            );
            let Facets { cosine, seen, pdf } = Facets::new(&self.ggx(lane), v, l);
            let (f0, f90) = COAT.ends();
            let value = schlick(f0, f90, cosine).x * seen * self.weight[lane];
            let lit = self.is[lane] & !self.ggx(lane).is_smooth() & (l.z > 0.0) & (v.z > 0.0);
            out.value[lane] = if lit { value } else { 0.0 };
            out.pdf[lane] = if lit { pdf } else { 0.0 };
        }
        for lane in 0..N {
            let light = Vec3::from(get(directions, lane));
            let cosine = Vec3::from(get(&self.normal, lane)).dot(light).abs();
            let reflected = self.reflected(lane, tables, cosine);
            let left = 1.0 - self.coated[lane].max(reflected);
            out.left[lane] = if self.is[lane] { left } else { 1.0 };
        }
        out
    }

    /// Where they send light on.
    #[inline(always)]
    pub fn sample(&self, places: &Places<N>, random: &[[f32; N]; 2]) -> Reflections<N> {
        let mut out = Reflections {
            goes: [false; N],
            direction: [[0.0; N]; 3],
            weight: [0.0; N],
            delta: [false; N],
        };
        let (f0, f90) = COAT.ends();
        let [first, second] = random;
        for (lane, (&a, &b)) in first.iter().zip(second).enumerate() {
            let (v, ggx) = (Vec3::from(get(&self.view, lane)), self.ggx(lane));
            let h = ggx.sample(v, [a, b]);
            let delta = ggx.is_smooth();
            let reflected = 2.0 * v.dot(h) * h - v;
            let l = if delta {
                Vec3::new(-v.x, -v.y, v.z)
            } else {
                reflected
            };
            let direction = self.frame(places, lane).world(l);
            let above = places.geometric(lane).dot(direction) > 0.0;
            out.goes[lane] = if delta { above } else { l.z > 0.0 };
            out.delta[lane] = delta;
            out.weight[lane] = schlick(f0, f90, v.z).x;
            set(&mut out.direction, lane, direction.to_array());
        }
        out
    }

    /// How much of the surface a coat covers.
    #[inline(always)]
    pub fn weight(&self, lane: usize) -> f32 {
        self.weight[lane]
    }
}
