//! Rough metals and glTF's principled material, also under coats and sheens, many points at a time, field by field: what
//! [`Layered`](crate::bsdf::Layered) does one by one.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::{Material, Reflectance};

use crate::bsdf::batch::clearcoat::Coats;
use crate::bsdf::batch::glossy_params::Glosses;
use crate::bsdf::principled::{Lookup, Seen};
use crate::bsdf::{ScatterSample, Values, conductor, is_smooth, principled};
use crate::interaction::Places;
use crate::lobes::albedo_tables::{Albedo, Rows, Tables, multiple, tables};
use crate::lobes::ggx::Facets;
use crate::lobes::shading_frame::{Frame, cosine_density};
use crate::lobes::sheen::Sheen;
use crate::prepare::PreparedWorld;
use crate::prepare::material::PreparedMaterial;
use crate::soa::{Three, get, set};

pub(crate) use crate::bsdf::batch::glossy_sample::FindLobes;
use crate::bsdf::batch::glossy_sample::Goes;

/// Points of rough interfaces over diffuse bases. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct GlossyPoints<const N: usize> {
    /// Which lanes are such, and whether any is.
    pub is: [bool; N],
    any: bool,
    normal: Three<f32, N>,
    pub(crate) made: Glosses<N>,
    pub(crate) coats: Coats<N>,
    /// Fibres are looked at one by one: most of them is powers.
    sheens: [Option<Sheen>; N],
    any_sheen: bool,
    pub(crate) seen: Views<N>,
    pub(crate) goes: Goes<N>,
}

/// What depends on the view alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Views<const N: usize> {
    /// The normal, bent where needed so that the viewer sees it, and the view along tangent, bitangent and normal.
    normal: Three<f32, N>,
    pub(crate) view: Three<f32, N>,
    /// What the roughness loses of the view, and what it keeps in the mean.
    lost: [f32; N],
    kept: [f32; N],
    /// The colour of what it gives back.
    multiple: Three<f32, N>,
    /// What the interface leaves for the base: from here, and in the mean.
    left: [f32; N],
    left_mean: [f32; N],
    /// How often the interface, the base and the coat are sampled.
    pub(crate) shares: [[f32; N]; 3],
}

impl<const N: usize> Default for Views<N> {
    fn default() -> Self {
        Self {
            normal: [[0.0; N]; 3],
            view: [[0.0; N]; 3],
            lost: [0.0; N],
            kept: [1.0; N],
            multiple: [[0.0; N]; 3],
            left: [0.0; N],
            left_mean: [1.0; N],
            shares: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> Default for GlossyPoints<N> {
    fn default() -> Self {
        Self {
            is: [false; N],
            any: false,
            normal: [[0.0; N]; 3],
            made: Glosses::default(),
            coats: Coats::default(),
            sheens: [None; N],
            any_sheen: false,
            seen: Views::default(),
            goes: Goes::default(),
        }
    }
}

/// Whether points of a material are glossy ones, but for those that its textures make smooth.
pub(crate) fn is_glossy(material: &Material) -> bool {
    match &material.reflectance {
        Reflectance::Metal(metal) => !is_smooth(metal.roughness),
        Reflectance::Principled(p) => principled::is_glossy(p),
        _ => false,
    }
}

impl<const N: usize> GlossyPoints<N> {
    /// Forgets all.
    #[inline]
    pub fn begin(&mut self) {
        self.is = [false; N];
        (self.any, self.made.any_metal) = (false, false);
        (self.coats.any, self.any_sheen) = (false, false);
    }

    /// Whether there is any.
    #[inline]
    pub fn any(&self) -> bool {
        self.any
    }

    /// Sets a lane, where the point there is glossy; its material is.
    #[inline]
    pub fn put(
        &mut self,
        (places, lane): (&Places<N>, usize),
        world: &PreparedWorld,
        prepared: &PreparedMaterial,
        hit: &Hit,
    ) {
        let (material, footprint) = (&prepared.material, places.footprint(lane));
        let (mut normal, front) = (places.normal(lane), places.front(lane));
        if let Some(map) = material.normal_map {
            let mapped = world.mapped_normal(&map, hit, footprint, normal, front);
            normal = mapped.unwrap_or(normal);
        }
        let base = world.base_color_of(prepared, hit, footprint);
        let layers = match &material.reflectance {
            Reflectance::Metal(metal) => conductor::layers(metal, base),
            Reflectance::Principled(p) => {
                let lookup = Lookup::new(world, hit, footprint);
                principled::layers(p, &lookup, &Seen::at(places, lane, base))
            }
            _ => return,
        };
        if layers.ggx.is_smooth() {
            return;
        }
        self.made.put(lane, &layers, &material.reflectance);
        self.coats.put(lane, layers.coat.as_ref());
        self.sheens[lane] = layers.sheen;
        self.any_sheen |= layers.sheen.is_some();
        set(&mut self.normal, lane, normal.to_array());
        self.is[lane] = true;
        self.any = true;
    }

    /// The direction in which light goes on, and where its ray starts.
    #[inline]
    pub fn sample(&self, lane: usize) -> Option<(ScatterSample, Vec3)> {
        let goes = &self.goes;
        goes.goes[lane].then(|| {
            let sample = ScatterSample {
                direction: get(&goes.direction, lane).into(),
                weight: get(&goes.weight, lane).into(),
                pdf: goes.pdf[lane],
                delta: goes.delta[lane],
                squeeze: 1.0,
            };
            (sample, get(&goes.start, lane).into())
        })
    }

    #[inline(always)]
    pub(crate) fn frame(&self, places: &Places<N>, lane: usize) -> Frame {
        places
            .frame(lane)
            .about(get(&self.seen.normal, lane).into())
    }

    /// The values of light from these directions.
    #[inline(always)]
    pub fn evaluate(&self, places: &Places<N>, directions: &Three<f32, N>) -> Values<N> {
        let (tables, made, seen) = (tables(), &self.made, &self.seen);
        let (mut lights, mut up) = ([[0.0; N]; 3], [false; N]);
        let (mut at, mut cosines, mut facets) = ([[0.0; N]; 2], [0.0; N], [[0.0; N]; 2]);
        for (lane, up) in up.iter_mut().enumerate() {
            let light = Vec3::from(get(directions, lane));
            let l = self.frame(places, lane).local(light);
            *up = (places.geometric(lane).dot(light) > 0.0) & (l.z > 0.0);
            set(&mut lights, lane, l.to_array());
        }
        for lane in 0..N {
            let rows = Rows::new(&made.ggx(lane));
            [at[0][lane], at[1][lane]] = rows.at(tables, lights[2][lane]);
        }
        for lane in 0..N {
            let (v, l) = (get(&seen.view, lane).into(), get(&lights, lane).into());
            let Facets { cosine, seen, pdf } = Facets::new(&made.ggx(lane), v, l);
            cosines[lane] = cosine;
            [facets[0][lane], facets[1][lane]] = [seen, pdf];
        }
        let reflected = made.reflected(&cosines);
        let mut values = Values::default();
        for lane in 0..N {
            let cosine = lights[2][lane];
            let single = Vec3::from(get(&reflected, lane)) * facets[0][lane];
            let [all, of_f0] = [at[0][lane], at[1][lane]];
            let (lost, kept) = (seen.lost[lane] * (1.0 - all), seen.kept[lane]);
            let mean = 1.0 - kept;
            let back = if mean > 1e-6 { lost / mean } else { 0.0 };
            let multiple = Vec3::from(get(&seen.multiple, lane)) * (back * cosine * FRAC_1_PI);
            let left = Albedo::new(made.over(lane), [all, of_f0], kept).left();
            let base = seen.left[lane] * left.max(0.0) / seen.left_mean[lane];
            let base = made.diffuse(lane) * (base * (cosine * FRAC_1_PI));
            let [specular, diffuse] = [0, 1].map(|lobe: usize| seen.shares[lobe][lane]);
            let pdf = cosine_density(cosine) * diffuse + facets[1][lane] * specular;
            let value = if up[lane] {
                single + multiple + base
            } else {
                Vec3::ZERO
            };
            values.pdf[lane] = if up[lane] { pdf } else { 0.0 };
            set(&mut values.value, lane, value.to_array());
        }
        if self.any_sheen {
            self.add_sheens(&lights, &up, &mut values);
        }
        if self.coats.any {
            let coatings = self.coats.evaluate(places, tables, directions);
            for (lane, &up) in up.iter().enumerate() {
                let below = Vec3::from(get(&values.value, lane));
                let value = below * coatings.left[lane] + coatings.value[lane];
                let pdf = values.pdf[lane] + coatings.pdf[lane] * seen.shares[2][lane];
                values.pdf[lane] = if up { pdf } else { 0.0 };
                let value = if up { value } else { Vec3::ZERO };
                set(&mut values.value, lane, value.to_array());
            }
        }
        values
    }

    /// Adds what fibres send back, and takes what they do not let through.
    #[inline(always)]
    fn add_sheens(&self, lights: &Three<f32, N>, up: &[bool; N], values: &mut Values<N>) {
        for (lane, sheen) in self.sheens.iter().enumerate() {
            let Some(sheen) = sheen.filter(|_| up[lane]) else {
                continue;
            };
            let v = Vec3::from(get(&self.seen.view, lane));
            let l = Vec3::from(get(lights, lane));
            let left = sheen.left(v.z).min(sheen.left(l.z));
            let below = Vec3::from(get(&values.value, lane));
            let value = below * left + sheen.evaluate(v, l);
            set(&mut values.value, lane, value.to_array());
        }
    }

    /// What depends on the view.
    #[inline(always)]
    pub(crate) fn see(&mut self, places: &Places<N>, tables: &Tables) {
        let made = &mut self.made;
        let mut seen = Views::default();
        for lane in 0..N {
            let frame = places.frame(lane);
            let normal = frame.seen(get(&self.normal, lane).into());
            let view = frame.about(normal).local(frame.view);
            set(&mut seen.normal, lane, normal.to_array());
            set(&mut seen.view, lane, view.to_array());
        }
        made.find_ends();
        let mut of_sheen = [[0.0; N]; 3];
        if self.any_sheen {
            for (lane, sheen) in self.sheens.iter().enumerate() {
                let reflected = sheen.map_or(Vec3::ZERO, |s| s.reflected(seen.view[2][lane]));
                set(&mut of_sheen, lane, reflected.to_array());
            }
        }
        let mut coated = [0.0; N];
        if self.coats.any {
            self.coats.see(places, tables);
            coated = self.coats.coated;
        }
        let reflected = made.reflected(&seen.view[2]);
        let (mut at, mut means) = ([[0.0; N]; 2], [[0.0; N]; 2]);
        for lane in 0..N {
            let rows = Rows::new(&made.ggx(lane));
            [at[0][lane], at[1][lane]] = rows.at(tables, seen.view[2][lane]);
            [means[0][lane], means[1][lane]] = rows.mean(tables);
        }
        let mean = |color: Vec3| color.element_sum() / 3.0;
        for lane in 0..N {
            let [at, means] = [[at[0][lane], at[1][lane]], [means[0][lane], means[1][lane]]];
            let (ends, over) = (made.ends(lane), made.over(lane));
            let own = Albedo::new(ends, at, means[0]);
            let diffuse = made.diffuse(lane);
            let left = Albedo::new(over, at, means[0]).left().max(0.0);
            let lost = 1.0 - at[0];
            let of_metal = Vec3::from(get(&reflected, lane)) * (1.0 - lost);
            let single = if made.metal[lane] {
                of_metal
            } else {
                own.single
            };
            let of_sheen = Vec3::from(get(&of_sheen, lane));
            let weights = [mean(single), mean(own.multiple + diffuse * left + of_sheen)];
            let (sum, coated) = (weights[0] + weights[1], coated[lane]);
            let scale = if sum > 0.0 { (1.0 - coated) / sum } else { 0.0 };
            let all = if coated > 0.0 { 1.0 } else { 0.0 };
            seen.shares[0][lane] = weights[0] * scale;
            seen.shares[1][lane] = weights[1] * scale;
            seen.shares[2][lane] = if sum > 0.0 { coated } else { all };
            seen.lost[lane] = lost;
            seen.kept[lane] = means[0];
            set(
                &mut seen.multiple,
                lane,
                multiple(ends, means[0]).to_array(),
            );
            seen.left[lane] = left;
            seen.left_mean[lane] = Albedo::new(over, means, means[0]).left().max(1e-6);
        }
        self.seen = seen;
    }
}
