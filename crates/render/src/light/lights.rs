//! All lights of a scene.

use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};
use raycam_bvh::dispatch_simd;
use raycam_scene::world::{SURFACES, light_names};
use raycam_scene::{Light, LightTraits, LightVisibility, Up};

use crate::light::air_light::AirLight;
use crate::light::bounds::LightBounds;
use crate::light::emissive_triangles::EmissiveTriangles;
use crate::light::environment::EnvironmentLight;
use crate::light::light_cull::{BoundingSphere, TestSpheres};
use crate::light::prepared_light::PreparedLight;
use crate::light::projector::ProjectorLight;
use crate::light::samples::EnvironmentLookup;
use crate::light::tree::LightTree;
use crate::soa::Vec3xN;

/// Light of the world to which a part of the received light belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightOwner {
    /// Light without a mesh, by its index in the world.
    World(usize),
    /// All emissive and unlit surfaces.
    Surfaces,
}

/// Kind of ray, which determines the lights that the ray finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightView {
    /// Rays that surfaces and media scatter, and light samples.
    Scattered,
    /// Rays from the camera.
    Camera,
    /// Rays that mirrors and glass reflect and refract.
    Reflection,
}

/// Lights of a scene, with and without a mesh.
#[derive(Debug, Default)]
pub(crate) struct Lights {
    /// Lights without a mesh that illuminate, in the order of the world.
    pub(super) lights: Vec<PreparedLight>,
    /// For each light without a mesh that illuminates: its index in the world.
    pub(super) owners: Vec<usize>,
    /// Names of all lights of the world.
    pub(super) names: Vec<String>,
    /// Lights that rays from the camera and from mirrors find, if these lights differ from the lights that illuminate.
    pub(super) views: Option<Box<[Lights; 2]>>,
    /// Total radiance of constant skies, for integrators that treat it as an ambient term.
    pub ambient: Vec3,
    /// Indices of infinite lights, constant skies last.
    pub(super) infinite: Vec<usize>,
    /// Number of infinite lights that are not constant.
    pub(super) non_constant_infinite: usize,
    /// Indices of finite lights.
    pub(super) finite: Vec<usize>,
    /// Finite lights that rays can hit (indices into `finite`), with bounding spheres.
    pub(super) intersectable: Vec<(usize, BoundingSphere)>,
    /// Light tree over `finite`.
    pub(super) tree: LightTree,
    /// Emissive triangles.
    pub(super) emissive_triangles: Arc<EmissiveTriangles>,
    /// Result of [`Lights::air_light`], computed on demand.
    pub(super) air_light: OnceLock<AirLight>,
    /// Air light of each infinite light with its index in the world, computed on demand.
    pub(super) air_light_parts: OnceLock<Vec<(usize, AirLight)>>,
}

/// Quotient of two colours, component by component; 0 for a component without light.
fn divide_or_zero(part: Vec3, total: Vec3) -> Vec3 {
    Vec3::select(total.cmpgt(Vec3::ZERO), part / total, Vec3::ZERO)
}

impl Lights {
    /// Prepares lights without a mesh. Environment tables are shared with equal `known` lights.
    pub fn sharing(lights: &[Light], traits: &[LightTraits], up: Up, origin: DVec3, known: &[&Lights]) -> Self {
        let known: Vec<&EnvironmentLight> = known.iter().flat_map(|lights| lights.environments()).collect();
        let visible = |index: usize| traits.get(index).map(|traits| traits.visible).unwrap_or_default();
        let select = |is_found: fn(LightVisibility) -> bool| {
            let found = lights.iter().enumerate().filter(|(index, _)| is_found(visible(*index)));
            let prepared = found.flat_map(|(index, light)| {
                PreparedLight::new(light, up, origin, &known).into_iter().map(move |prepared| (index, prepared))
            });
            Self::of_prepared(prepared)
        };
        let is_usual = (0..lights.len()).all(|index| visible(index).is_everywhere());
        let views = || Box::new([select(|visible| visible.camera), select(|visible| visible.reflection)]);
        let names = light_names(lights, traits);
        Self { names, views: (!is_usual).then(views), ..select(|visible| visible.light) }
    }

    /// Creates the collection from lights without a mesh, each with its index in the world.
    fn of_prepared(lights: impl Iterator<Item = (usize, PreparedLight)>) -> Self {
        let (owners, prepared): (Vec<usize>, Vec<PreparedLight>) = lights.unzip();
        let (mut infinite, finite): (Vec<_>, Vec<_>) = (0..prepared.len()).partition(|&i| prepared[i].is_infinite());
        let is_constant_sky = |source: &PreparedLight| source.constant_radiance().is_some();
        infinite.sort_by_key(|&i| is_constant_sky(&prepared[i]));
        let constant_radiance = |source: &PreparedLight| source.constant_radiance().unwrap_or_default();
        let bounds: Vec<LightBounds> = finite.iter().map(|&i| prepared[i].bounds()).collect();
        Self {
            ambient: prepared.iter().map(constant_radiance).sum(),
            tree: LightTree::new(&bounds),
            intersectable: finite
                .iter()
                .enumerate()
                .filter(|&(_, &i)| prepared[i].is_hittable(false))
                .map(|(index, _)| (index, BoundingSphere::enclosing(&bounds[index])))
                .collect(),
            non_constant_infinite: infinite.iter().filter(|&&i| !is_constant_sky(&prepared[i])).count(),
            lights: prepared,
            owners,
            names: vec![],
            views: None,
            infinite,
            finite,
            emissive_triangles: Arc::default(),
            air_light: OnceLock::new(),
            air_light_parts: OnceLock::new(),
        }
    }

    /// The light from infinity that fog scatters, in closed form.
    pub fn air_light(&self) -> &AirLight {
        self.air_light.get_or_init(|| AirLight::new(self.infinite.iter().map(|&index| &self.lights[index])))
    }

    /// True if any light has no size, so that no ray scattered by a surface can hit it.
    pub fn has_sizeless(&self) -> bool {
        self.lights.iter().any(|light| !light.is_hittable(false))
    }

    /// True if any triangle emits.
    pub fn has_emissive_triangles(&self) -> bool {
        !self.emissive_triangles.is_empty()
    }

    /// True if light samples may belong to infinite lights.
    pub fn has_infinite_samples(&self) -> bool {
        self.non_constant_infinite > 0
    }

    /// True if any light is infinitely far away.
    pub fn has_infinite(&self) -> bool {
        !self.infinite.is_empty()
    }

    /// True if any light without a mesh is finite.
    pub fn has_finite(&self) -> bool {
        !self.finite.is_empty()
    }

    /// Number of lights; all emissive triangles count as one.
    pub fn count(&self) -> usize {
        self.lights.len() + usize::from(self.has_emissive_triangles())
    }

    /// True if BSDF samples may hit light that light samples also find. Constant skies do not count if they are an
    /// `ambient` term.
    pub fn is_hittable(&self, ambient: bool) -> bool {
        let found = |source: &PreparedLight| source.is_hittable(ambient);
        self.has_emissive_triangles() || self.lights.iter().any(found)
    }

    /// Maximum intensity of each finite light and emissive triangle, summed over all of them and over the colour
    /// channels, in W/sr.
    pub fn phi(&self) -> f64 {
        self.tree.phi() + self.emissive_triangles.tree().phi()
    }

    /// True if any light may cast caustics: an emissive triangle, or a light with an extent other than a gradient sky.
    pub fn can_cast_caustics(&self) -> bool {
        self.has_emissive_triangles() || self.lights.iter().any(PreparedLight::can_cast_caustics)
    }

    /// Radiance of the infinite lights from a unit direction: the radiance of an escaped ray. `known` is a
    /// precomputed lookup of one infinite light.
    pub fn escaped_radiance(&self, direction: Vec3, known: Option<EnvironmentLookup>) -> Vec3 {
        if self.non_constant_infinite == 0 {
            return self.ambient;
        }
        let parts = self.infinite.iter().enumerate().map(|(number, &i)| {
            let (radiance, _) = match known {
                Some((known, own)) if known == number => own,
                _ => self.lights[i].radiance_and_pdf(Vec3::ZERO, direction),
            };
            radiance
        });
        parts.sum()
    }

    /// Radiance of escaped rays, if it is the same in all directions.
    pub fn constant_environment(&self) -> Option<Vec3> {
        (self.non_constant_infinite == 0).then(|| self.escaped_radiance(Vec3::Z, None))
    }

    /// First environment light, with its index among the infinite lights.
    pub fn environment(&self) -> Option<(usize, &EnvironmentLight)> {
        let mut environments = self.infinite[..self.non_constant_infinite].iter().enumerate();
        environments.find_map(|(number, &i)| Some((number, self.lights[i].environment()?)))
    }

    fn environments(&self) -> impl Iterator<Item = &EnvironmentLight> {
        let views = self.views.iter().flat_map(|views| views.iter());
        let lights = self.lights.iter().chain(views.flat_map(|view| &view.lights));
        lights.filter_map(PreparedLight::environment)
    }

    /// Returns the first projector of the world, if any.
    pub fn projector(&self) -> Option<&ProjectorLight> {
        self.lights.iter().find_map(PreparedLight::projector)
    }

    /// Returns the lights that rays of this kind find.
    pub fn view(&self, view: LightView) -> &Self {
        match (&self.views, view) {
            (Some(views), LightView::Camera) => &views[0],
            (Some(views), LightView::Reflection) => &views[1],
            _ => self,
        }
    }

    /// True if some rays do not find all lights that illuminate.
    pub fn has_views(&self) -> bool {
        self.views.is_some()
    }

    /// The light with this name.
    ///
    /// # Errors
    /// A message with all names.
    pub fn owner(&self, name: &str) -> Result<LightOwner, String> {
        if name == SURFACES {
            return Ok(LightOwner::Surfaces);
        }
        self.names.iter().position(|known| known == name).map(LightOwner::World).ok_or_else(|| {
            let names: Vec<&str> = self.names.iter().map(String::as_str).chain([SURFACES]).collect();
            format!("no light named {name:?}; available: {}", names.join(", "))
        })
    }

    /// Light of the world to which a finite light belongs.
    pub fn owner_of_finite(&self, index: usize) -> LightOwner {
        LightOwner::World(self.owners[self.finite[index]])
    }

    /// Light of the world to which an infinite light belongs.
    pub fn owner_of_infinite(&self, index: usize) -> LightOwner {
        LightOwner::World(self.owners[self.infinite[index]])
    }

    /// Fraction of each colour of the infinite lights' radiance that belongs to one light. Constant skies are included
    /// only if `has_constant` is true.
    pub fn share_of_infinite(
        &self,
        owner: LightOwner,
        radiance: impl Fn(&PreparedLight) -> Vec3,
        has_constant: bool,
    ) -> Vec3 {
        let count = if has_constant { self.infinite.len() } else { self.non_constant_infinite };
        let (mut own, mut total) = (Vec3::ZERO, Vec3::ZERO);
        for &index in &self.infinite[..count] {
            let part = radiance(&self.lights[index]);
            total += part;
            own += if owner == LightOwner::World(self.owners[index]) { part } else { Vec3::ZERO };
        }
        divide_or_zero(own, total)
    }

    /// Fraction of each colour of the air light that belongs to one light.
    pub fn share_of_air_light(&self, owner: LightOwner, direction: Vec3, g: f32) -> Vec3 {
        let radiance = |light: &AirLight| light.radiance(direction, Vec3::ONE, g);
        let parts = self.air_light_parts.get_or_init(|| {
            let of_light = |&index: &usize| (self.owners[index], AirLight::new([&self.lights[index]].into_iter()));
            self.infinite.iter().map(of_light).collect()
        });
        let own = parts.iter().filter(|(part, _)| owner == LightOwner::World(*part));
        divide_or_zero(
            own.map(|(_, light)| radiance(light)).sum(),
            parts.iter().map(|(_, light)| radiance(light)).sum(),
        )
    }

    /// Sets `out` for each ray: false only if the ray misses every light that rays can hit.
    pub fn may_intersect_any<const N: usize>(
        &self,
        from: &Vec3xN<f64, N>,
        directions: &Vec3xN<f32, N>,
        out: &mut [bool; N],
    ) {
        dispatch_simd(TestSpheres { spheres: &self.intersectable, from, directions, out });
    }
}
