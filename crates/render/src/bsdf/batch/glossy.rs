//! Rough metals and glTF's principled material, also under coats and sheens, many points at a time, field by field: what
//! [`Layered`](crate::bsdf::Layered) does one by one.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::{Material, MaterialModel};

use crate::bsdf::batch::clearcoat::ClearcoatBatch;
use crate::bsdf::batch::glossy_params::GlossyParams;
use crate::bsdf::principled::{TextureLookup, ViewContext};
use crate::bsdf::specular::is_smooth;
use crate::bsdf::{BsdfEvals, BsdfSample, conductor, principled};
use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::albedo_tables::{
    Albedo, AlbedoRow, AlbedoTables, albedo_tables, multi_scatter_color,
};
use crate::lobes::ggx::MicrofacetEval;
use crate::lobes::shading_frame::{ShadingFrame, cosine_hemisphere_pdf};
use crate::lobes::sheen::Sheen;
use crate::prepare::geometry::Geometry;
use crate::prepare::material::PreparedMaterial;
use crate::soa::{Vec3xN, get_lane, set_lane};

use crate::bsdf::batch::glossy_sample::Goes;

/// Points of rough interfaces over diffuse bases. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct GlossyBsdfBatch<const N: usize> {
    /// Which lanes are such, and whether any is.
    pub is_active: [bool; N],
    any_active: bool,
    normal: Vec3xN<f32, N>,
    pub(crate) params: GlossyParams<N>,
    pub(crate) coat: ClearcoatBatch<N>,
    /// Fibres are looked at one by one: most of them is powers.
    sheens: [Option<Sheen>; N],
    any_sheen: bool,
    pub(crate) view_terms: ViewTerms<N>,
    pub(crate) samples: Goes<N>,
}

/// What depends on the view alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewTerms<const N: usize> {
    /// The normal, bent where needed so that the viewer sees it, and the view along tangent, bitangent and normal.
    normal: Vec3xN<f32, N>,
    pub(crate) wo: Vec3xN<f32, N>,
    /// What the roughness loses of the view, and what it keeps in the mean.
    energy_loss: [f32; N],
    mean_albedo: [f32; N],
    /// The colour of what it gives back.
    multi_scatter: Vec3xN<f32, N>,
    /// What the interface leaves for the base: from here, and in the mean.
    base_transmittance: [f32; N],
    mean_base_transmittance: [f32; N],
    /// How often the interface, the base and the coat are sampled.
    pub(crate) lobe_probabilities: [[f32; N]; 3],
}

impl<const N: usize> Default for ViewTerms<N> {
    fn default() -> Self {
        Self {
            normal: [[0.0; N]; 3],
            wo: [[0.0; N]; 3],
            energy_loss: [0.0; N],
            mean_albedo: [1.0; N],
            multi_scatter: [[0.0; N]; 3],
            base_transmittance: [0.0; N],
            mean_base_transmittance: [1.0; N],
            lobe_probabilities: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> Default for GlossyBsdfBatch<N> {
    fn default() -> Self {
        Self {
            is_active: [false; N],
            any_active: false,
            normal: [[0.0; N]; 3],
            params: GlossyParams::default(),
            coat: ClearcoatBatch::default(),
            sheens: [None; N],
            any_sheen: false,
            view_terms: ViewTerms::default(),
            samples: Goes::default(),
        }
    }
}

/// Whether points of a material are glossy ones, but for those that its textures make smooth.
pub(crate) fn is_rough_reflective(material: &Material) -> bool {
    match &material.model {
        MaterialModel::Metal(metal) => !is_smooth(metal.roughness),
        MaterialModel::Principled(p) => principled::is_rough_reflective(p),
        _ => false,
    }
}

impl<const N: usize> GlossyBsdfBatch<N> {
    /// Forgets all.
    #[inline]
    pub fn clear(&mut self) {
        self.is_active = [false; N];
        (self.any_active, self.params.any_conductor) = (false, false);
        (self.coat.any_active, self.any_sheen) = (false, false);
    }

    /// Whether there is any.
    #[inline]
    pub fn any(&self) -> bool {
        self.any_active
    }

    /// Sets a lane, where the point there is glossy; its material is.
    #[inline]
    pub fn set_lane(
        &mut self,
        (places, lane): (&SurfaceInteractions<N>, usize),
        world: &Geometry,
        prepared: &PreparedMaterial,
        hit: &Hit,
    ) {
        let (material, footprint) = (&prepared.material, places.footprint(lane));
        let (mut normal, front) = (places.shading_normal(lane), places.is_front(lane));
        if let Some(map) = material.normal_map {
            let mapped = world.mapped_normal(&map, hit, footprint, normal, front);
            normal = mapped.unwrap_or(normal);
        }
        let base = world.base_color_with(prepared, hit, footprint);
        let layers = match &material.model {
            MaterialModel::Metal(metal) => conductor::layer_stack(metal, base),
            MaterialModel::Principled(p) => {
                let lookup = TextureLookup::new(world, hit, footprint);
                principled::layer_stack(p, &lookup, &ViewContext::for_lane(places, lane, base))
            }
            _ => return,
        };
        if layers.ggx.effectively_smooth() {
            return;
        }
        self.params.set_lane(lane, &layers, &material.model);
        self.coat.set_lane(lane, layers.coat.as_ref());
        self.sheens[lane] = layers.sheen;
        self.any_sheen |= layers.sheen.is_some();
        set_lane(&mut self.normal, lane, normal.to_array());
        self.is_active[lane] = true;
        self.any_active = true;
    }

    /// The direction in which light goes on, and where its ray starts.
    #[inline]
    pub fn sample(&self, lane: usize) -> Option<(BsdfSample, Vec3)> {
        let goes = &self.samples;
        goes.goes[lane].then(|| {
            let sample = BsdfSample {
                wi: get_lane(&goes.direction, lane).into(),
                weight: get_lane(&goes.weight, lane).into(),
                pdf: goes.pdf[lane],
                is_specular: goes.delta[lane],
                eta_scale: 1.0,
            };
            (sample, get_lane(&goes.start, lane).into())
        })
    }

    #[inline(always)]
    pub(crate) fn shading_frame(
        &self,
        places: &SurfaceInteractions<N>,
        lane: usize,
    ) -> ShadingFrame {
        places
            .shading_frame(lane)
            .with_axis(get_lane(&self.view_terms.normal, lane).into())
    }

    /// The values of light from these directions.
    #[inline(always)]
    pub fn eval(
        &self,
        places: &SurfaceInteractions<N>,
        directions: &Vec3xN<f32, N>,
    ) -> BsdfEvals<N> {
        let (tables, made, seen) = (albedo_tables(), &self.params, &self.view_terms);
        let (mut lights, mut up) = ([[0.0; N]; 3], [false; N]);
        let (mut at, mut cosines, mut facets) = ([[0.0; N]; 2], [0.0; N], [[0.0; N]; 2]);
        for (lane, up) in up.iter_mut().enumerate() {
            let light = Vec3::from(get_lane(directions, lane));
            let l = self.shading_frame(places, lane).to_local(light);
            *up = (places.geometric_normal(lane).dot(light) > 0.0) & (l.z > 0.0);
            set_lane(&mut lights, lane, l.to_array());
        }
        for lane in 0..N {
            let rows = AlbedoRow::new(&made.ggx(lane));
            [at[0][lane], at[1][lane]] = rows.albedo_at(tables, lights[2][lane]);
        }
        for lane in 0..N {
            let (v, l) = (
                get_lane(&seen.wo, lane).into(),
                get_lane(&lights, lane).into(),
            );
            let MicrofacetEval {
                cosine,
                weight: seen,
                pdf,
            } = MicrofacetEval::new(&made.ggx(lane), v, l);
            cosines[lane] = cosine;
            [facets[0][lane], facets[1][lane]] = [seen, pdf];
        }
        let reflected = made.reflectance(&cosines);
        let mut values = BsdfEvals::default();
        for lane in 0..N {
            let cosine = lights[2][lane];
            let single = Vec3::from(get_lane(&reflected, lane)) * facets[0][lane];
            let [all, of_f0] = [at[0][lane], at[1][lane]];
            let (lost, kept) = (seen.energy_loss[lane] * (1.0 - all), seen.mean_albedo[lane]);
            let mean = 1.0 - kept;
            let back = if mean > 1e-6 { lost / mean } else { 0.0 };
            let multiple =
                Vec3::from(get_lane(&seen.multi_scatter, lane)) * (back * cosine * FRAC_1_PI);
            let left = Albedo::new(made.over(lane), [all, of_f0], kept).base_transmittance();
            let base =
                seen.base_transmittance[lane] * left.max(0.0) / seen.mean_base_transmittance[lane];
            let base = made.diffuse(lane) * (base * (cosine * FRAC_1_PI));
            let [specular, diffuse] = [0, 1].map(|lobe: usize| seen.lobe_probabilities[lobe][lane]);
            let pdf = cosine_hemisphere_pdf(cosine) * diffuse + facets[1][lane] * specular;
            let value = if up[lane] {
                single + multiple + base
            } else {
                Vec3::ZERO
            };
            values.pdf[lane] = if up[lane] { pdf } else { 0.0 };
            set_lane(&mut values.value, lane, value.to_array());
        }
        if self.any_sheen {
            self.apply_sheen(&lights, &up, &mut values);
        }
        if self.coat.any_active {
            let coatings = self.coat.eval(places, tables, directions);
            for (lane, &up) in up.iter().enumerate() {
                let below = Vec3::from(get_lane(&values.value, lane));
                let value = below * coatings.transmittance[lane] + coatings.value[lane];
                let pdf = values.pdf[lane] + coatings.pdf[lane] * seen.lobe_probabilities[2][lane];
                values.pdf[lane] = if up { pdf } else { 0.0 };
                let value = if up { value } else { Vec3::ZERO };
                set_lane(&mut values.value, lane, value.to_array());
            }
        }
        values
    }

    /// Adds what fibres send back, and takes what they do not let through.
    #[inline(always)]
    fn apply_sheen(&self, lights: &Vec3xN<f32, N>, up: &[bool; N], values: &mut BsdfEvals<N>) {
        for (lane, sheen) in self.sheens.iter().enumerate() {
            let Some(sheen) = sheen.filter(|_| up[lane]) else {
                continue;
            };
            let v = Vec3::from(get_lane(&self.view_terms.wo, lane));
            let l = Vec3::from(get_lane(lights, lane));
            let left = sheen
                .base_transmittance(v.z)
                .min(sheen.base_transmittance(l.z));
            let below = Vec3::from(get_lane(&values.value, lane));
            let value = below * left + sheen.eval(v, l);
            set_lane(&mut values.value, lane, value.to_array());
        }
    }

    /// What depends on the view.
    #[inline(always)]
    pub(crate) fn prepare_view(&mut self, places: &SurfaceInteractions<N>, tables: &AlbedoTables) {
        let made = &mut self.params;
        let mut seen = ViewTerms::default();
        for lane in 0..N {
            let frame = places.shading_frame(lane);
            let normal = frame.bend_towards_viewer(get_lane(&self.normal, lane).into());
            let view = frame.with_axis(normal).to_local(frame.wo);
            set_lane(&mut seen.normal, lane, normal.to_array());
            set_lane(&mut seen.wo, lane, view.to_array());
        }
        made.compute_f0();
        let mut of_sheen = [[0.0; N]; 3];
        if self.any_sheen {
            for (lane, sheen) in self.sheens.iter().enumerate() {
                let reflected = sheen.map_or(Vec3::ZERO, |s| s.albedo_color(seen.wo[2][lane]));
                set_lane(&mut of_sheen, lane, reflected.to_array());
            }
        }
        let mut coated = [0.0; N];
        if self.coat.any_active {
            self.coat.prepare_view(places, tables);
            coated = self.coat.view_albedo;
        }
        let reflected = made.reflectance(&seen.wo[2]);
        let (mut at, mut means) = ([[0.0; N]; 2], [[0.0; N]; 2]);
        for lane in 0..N {
            let rows = AlbedoRow::new(&made.ggx(lane));
            [at[0][lane], at[1][lane]] = rows.albedo_at(tables, seen.wo[2][lane]);
            [means[0][lane], means[1][lane]] = rows.mean_albedo(tables);
        }
        let mean = |color: Vec3| color.element_sum() / 3.0;
        for lane in 0..N {
            let [at, means] = [[at[0][lane], at[1][lane]], [means[0][lane], means[1][lane]]];
            let (ends, over) = (made.ends(lane), made.over(lane));
            let own = Albedo::new(ends, at, means[0]);
            let diffuse = made.diffuse(lane);
            let left = Albedo::new(over, at, means[0])
                .base_transmittance()
                .max(0.0);
            let lost = 1.0 - at[0];
            let of_metal = Vec3::from(get_lane(&reflected, lane)) * (1.0 - lost);
            let single = if made.is_conductor[lane] {
                of_metal
            } else {
                own.single_scatter
            };
            let of_sheen = Vec3::from(get_lane(&of_sheen, lane));
            let weights = [
                mean(single),
                mean(own.multi_scatter + diffuse * left + of_sheen),
            ];
            let (sum, coated) = (weights[0] + weights[1], coated[lane]);
            let scale = if sum > 0.0 { (1.0 - coated) / sum } else { 0.0 };
            let all = if coated > 0.0 { 1.0 } else { 0.0 };
            seen.lobe_probabilities[0][lane] = weights[0] * scale;
            seen.lobe_probabilities[1][lane] = weights[1] * scale;
            seen.lobe_probabilities[2][lane] = if sum > 0.0 { coated } else { all };
            seen.energy_loss[lane] = lost;
            seen.mean_albedo[lane] = means[0];
            set_lane(
                &mut seen.multi_scatter,
                lane,
                multi_scatter_color(ends, means[0]).to_array(),
            );
            seen.base_transmittance[lane] = left;
            seen.mean_base_transmittance[lane] = Albedo::new(over, means, means[0])
                .base_transmittance()
                .max(1e-6);
        }
        self.view_terms = seen;
    }
}
