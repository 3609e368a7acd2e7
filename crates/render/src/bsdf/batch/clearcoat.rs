//! Clear coats of many points, field by field: what [`Clearcoat`] is at one.

use glam::Vec3;

use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::albedo_tables::{Albedo, AlbedoRow, AlbedoTables};
use crate::lobes::clearcoat::{COAT_FRESNEL, Clearcoat};
use crate::lobes::fresnel::schlick;
use crate::lobes::ggx::{Ggx, MicrofacetEval};
use crate::lobes::shading_frame::ShadingFrame;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Coats, some of which are mirrors. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct ClearcoatBatch<const N: usize> {
    /// Which lanes have one, and whether any has.
    pub is_active: [bool; N],
    pub any_active: bool,
    weight: [f32; N],
    alpha: [f32; N],
    /// Which the viewer sees.
    normal: Vec3xN<f32, N>,
    /// Along tangent, bitangent and normal.
    wo: Vec3xN<f32, N>,
    /// Their share of the view.
    pub view_albedo: [f32; N],
}

/// What they do with light from some directions.
pub(crate) struct ClearcoatEvals<const N: usize> {
    /// Of any colour, times the cosine, and the density of sampling it.
    pub value: [f32; N],
    pub pdf: [f32; N],
    /// What is left of light that goes both ways through them.
    pub transmittance: [f32; N],
}

/// Where they send light on.
pub(crate) struct ClearcoatSamples<const N: usize> {
    pub goes: [bool; N],
    pub direction: Vec3xN<f32, N>,
    /// Of mirrors, times the chance that they are asked.
    pub weight: [f32; N],
    pub delta: [bool; N],
}

impl<const N: usize> Default for ClearcoatBatch<N> {
    fn default() -> Self {
        Self {
            is_active: [false; N],
            any_active: false,
            weight: [0.0; N],
            alpha: [1.0; N],
            normal: [[0.0; N]; 3],
            wo: [[0.0; N]; 3],
            view_albedo: [0.0; N],
        }
    }
}

impl<const N: usize> ClearcoatBatch<N> {
    #[inline]
    pub fn set_lane(&mut self, lane: usize, coat: Option<&Clearcoat>) {
        self.is_active[lane] = coat.is_some();
        if let Some(coat) = coat {
            self.any_active = true;
            (self.weight[lane], self.alpha[lane]) = (coat.weight, coat.ggx.alpha_x);
            set_lane(&mut self.normal, lane, coat.frame.normal.to_array());
        }
    }

    #[inline(always)]
    fn ggx(&self, lane: usize) -> Ggx {
        Ggx {
            alpha_x: self.alpha[lane],
            alpha_y: self.alpha[lane],
        }
    }

    #[inline(always)]
    fn shading_frame(&self, places: &SurfaceInteractions<N>, lane: usize) -> ShadingFrame {
        places
            .shading_frame(lane)
            .with_axis(get_lane(&self.normal, lane).into())
    }

    /// [`Clearcoat::albedo`].
    #[inline(always)]
    fn albedo(&self, lane: usize, tables: &AlbedoTables, cosine: f32) -> f32 {
        let rows = AlbedoRow::new(&self.ggx(lane));
        let (at, [kept, _]) = (
            rows.albedo_at(tables, cosine.max(0.0)),
            rows.mean_albedo(tables),
        );
        self.weight[lane]
            * Albedo::new(COAT_FRESNEL.f0_f90(), at, kept)
                .single_scatter
                .x
    }

    /// What depends on the view.
    #[inline(always)]
    pub fn prepare_view(&mut self, places: &SurfaceInteractions<N>, tables: &AlbedoTables) {
        for lane in 0..N {
            let frame = self.shading_frame(places, lane);
            set_lane(&mut self.wo, lane, frame.to_local(frame.wo).to_array());
        }
        for lane in 0..N {
            let coated = self.albedo(lane, tables, self.wo[2][lane]);
            self.view_albedo[lane] = if self.is_active[lane] { coated } else { 0.0 };
        }
    }

    /// [`Clearcoat::eval`], and what they leave; where there is none, all.
    #[inline(always)]
    pub fn eval(
        &self,
        places: &SurfaceInteractions<N>,
        tables: &AlbedoTables,
        directions: &Vec3xN<f32, N>,
    ) -> ClearcoatEvals<N> {
        let mut out = ClearcoatEvals {
            value: [0.0; N],
            pdf: [0.0; N],
            transmittance: [1.0; N],
        };
        for lane in 0..N {
            let light = Vec3::from(get_lane(directions, lane));
            let (v, l) = (
                Vec3::from(get_lane(&self.wo, lane)),
                self.shading_frame(places, lane).to_local(light),
            );
            let MicrofacetEval {
                cosine,
                weight: seen,
                pdf,
            } = MicrofacetEval::new(&self.ggx(lane), v, l);
            let (f0, f90) = COAT_FRESNEL.f0_f90();
            let value = schlick(f0, f90, cosine).x * seen * self.weight[lane];
            let lit = self.is_active[lane]
                & !self.ggx(lane).effectively_smooth()
                & (l.z > 0.0)
                & (v.z > 0.0);
            out.value[lane] = if lit { value } else { 0.0 };
            out.pdf[lane] = if lit { pdf } else { 0.0 };
        }
        for lane in 0..N {
            let light = Vec3::from(get_lane(directions, lane));
            let cosine = Vec3::from(get_lane(&self.normal, lane)).dot(light).abs();
            let reflected = self.albedo(lane, tables, cosine);
            let left = 1.0 - self.view_albedo[lane].max(reflected);
            out.transmittance[lane] = if self.is_active[lane] { left } else { 1.0 };
        }
        out
    }

    /// Where they send light on.
    #[inline(always)]
    pub fn sample(
        &self,
        places: &SurfaceInteractions<N>,
        random: &[[f32; N]; 2],
    ) -> ClearcoatSamples<N> {
        let mut out = ClearcoatSamples {
            goes: [false; N],
            direction: [[0.0; N]; 3],
            weight: [0.0; N],
            delta: [false; N],
        };
        let (f0, f90) = COAT_FRESNEL.f0_f90();
        let [first, second] = random;
        for (lane, (&a, &b)) in first.iter().zip(second).enumerate() {
            let (v, ggx) = (Vec3::from(get_lane(&self.wo, lane)), self.ggx(lane));
            let h = ggx.sample_wm(v, [a, b]);
            let delta = ggx.effectively_smooth();
            let reflected = 2.0 * v.dot(h) * h - v;
            let l = if delta {
                Vec3::new(-v.x, -v.y, v.z)
            } else {
                reflected
            };
            let direction = self.shading_frame(places, lane).to_world(l);
            let above = places.geometric_normal(lane).dot(direction) > 0.0;
            out.goes[lane] = if delta { above } else { l.z > 0.0 };
            out.delta[lane] = delta;
            out.weight[lane] = schlick(f0, f90, v.z).x;
            set_lane(&mut out.direction, lane, direction.to_array());
        }
        out
    }

    /// How much of the surface a coat covers.
    #[inline(always)]
    pub fn weight(&self, lane: usize) -> f32 {
        self.weight[lane]
    }
}
