//! All lights of a scene.

use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};
use raycam_bvh::dispatch_simd;
use raycam_scene::{Light, Up};

use crate::light::air_light::AirLight;
use crate::light::bounds::LightBounds;
use crate::light::emissive_triangles::EmissiveTriangles;
use crate::light::environment::EnvironmentLight;
use crate::light::light_cull::{BoundingSphere, TestSpheres};
use crate::light::prepared_light::PreparedLight;
use crate::light::samples::EnvironmentLookup;
use crate::light::tree::LightTree;
use crate::soa::Vec3xN;

/// Lights of a scene, with and without a mesh.
#[derive(Debug, Default)]
pub(crate) struct Lights {
    /// Lights without a mesh, in the order of the world.
    pub(super) lights: Vec<PreparedLight>,
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
}

impl Lights {
    /// Prepares lights without a mesh. Environment tables are shared with equal `known` lights.
    pub fn sharing(lights: &[Light], up: Up, origin: DVec3, known: &[&Lights]) -> Self {
        let known: Vec<&EnvironmentLight> = known.iter().flat_map(|lights| lights.environments()).collect();
        let prepared: Vec<PreparedLight> =
            lights.iter().flat_map(|light| PreparedLight::new(light, up, origin, &known)).collect();
        let (mut infinite, finite): (Vec<_>, Vec<_>) = (0..prepared.len()).partition(|&i| prepared[i].is_infinite());
        let is_constant_sky =
            |source: &PreparedLight| matches!(source, PreparedLight::GradientSky(sky) if sky.is_constant());
        infinite.sort_by_key(|&i| is_constant_sky(&prepared[i]));
        let constant_radiance = |source: &PreparedLight| match source {
            PreparedLight::GradientSky(sky) if sky.is_constant() => sky.horizon,
            _ => Vec3::ZERO,
        };
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
            infinite,
            finite,
            emissive_triangles: Arc::default(),
            air_light: OnceLock::new(),
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

    /// Largest total intensity of the finite lights and emissive triangles in W/sr, summed over the colour channels.
    pub fn phi(&self) -> f64 {
        self.tree.phi() + self.emissive_triangles.tree().phi()
    }

    /// True if any light has an extent without surrounding the scene.
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
        self.lights.iter().filter_map(PreparedLight::environment)
    }

    /// For each ray, false only if it misses every light that rays can hit.
    pub fn may_intersect_any<const N: usize>(
        &self,
        from: &Vec3xN<f64, N>,
        directions: &Vec3xN<f32, N>,
        out: &mut [bool; N],
    ) {
        dispatch_simd(TestSpheres { spheres: &self.intersectable, from, directions, out });
    }
}
