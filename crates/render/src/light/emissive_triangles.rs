//! Emissive triangles: every triangle of an emissive material is a light.

use std::sync::{Arc, Weak};

use glam::{DAffine3, DVec3, Vec3};
use raycam_bvh::Hit;
use raycam_scene::Material;

use crate::interaction::LightSampleContext;
use crate::interaction::ray_cone::Footprint;
use crate::light::bounds::LightBounds;
use crate::light::samples::LightLiSample;
use crate::light::tree::LightTree;
use crate::light::tree::importance::LightTreeContext;
use crate::prepare::geometry::Geometry;
use crate::prepare::instance::PreparedInstance;
use crate::prepare::mesh::PreparedMesh;
use crate::prepare::texture::PreparedTexture;

/// All emissive triangles of the scene.
#[derive(Debug, Default)]
pub(crate) struct EmissiveTriangles {
    /// Instance and triangle.
    triangles: Vec<[u32; 2]>,
    /// Light index of every triangle of an emissive instance.
    light_of_triangle: Vec<Vec<u32>>,
    tree: LightTree,
}

/// Key of a scene's emissive triangles. It contains everything they depend on: equal keys mean equal triangles.
#[derive(Debug)]
pub(crate) struct EmissiveKey {
    origin: DVec3,
    instances: Vec<EmissiveInstance>,
}

#[derive(Debug)]
struct EmissiveInstance {
    instance: usize,
    /// The mesh; holding it keeps its address from being reused.
    mesh: Weak<PreparedMesh>,
    world_from_mesh: DAffine3,
    materials: Vec<(Material, Vec<Weak<PreparedTexture>>)>,
}

impl EmissiveKey {
    pub fn new(world: &Geometry) -> Self {
        let material = |&material: &usize| {
            let material = &world.materials[material].material;
            let slots = material.texture_slots().into_iter();
            (material.clone(), slots.map(|slot| Arc::downgrade(&world.textures[slot.texture])).collect())
        };
        let instances = world.shining_instances().map(|(instance, object)| EmissiveInstance {
            instance,
            mesh: Arc::downgrade(&object.mesh),
            world_from_mesh: object.world_from_mesh,
            materials: object.materials.iter().map(material).collect(),
        });
        Self { origin: world.origin, instances: instances.collect() }
    }
}

impl PartialEq for EmissiveKey {
    fn eq(&self, other: &Self) -> bool {
        (self.instances.is_empty() && other.instances.is_empty())
            || (self.origin == other.origin && self.instances == other.instances)
    }
}

impl PartialEq for EmissiveInstance {
    fn eq(&self, other: &Self) -> bool {
        let same = |(a, textures): &(Material, Vec<Weak<PreparedTexture>>), (b, others): &(Material, Vec<_>)| {
            a == b && textures.len() == others.len() && textures.iter().zip(others).all(|(a, b)| Weak::ptr_eq(a, b))
        };
        self.instance == other.instance
            && Weak::ptr_eq(&self.mesh, &other.mesh)
            && self.world_from_mesh == other.world_from_mesh
            && self.materials.len() == other.materials.len()
            && self.materials.iter().zip(&other.materials).all(|(a, b)| same(a, b))
    }
}

impl Geometry {
    /// Instances that may have emissive surfaces, by index.
    fn shining_instances(&self) -> impl Iterator<Item = (usize, &PreparedInstance)> {
        let shines = |&material: &usize| self.materials[material].material.emission.value != [0.0; 3];
        let instances = self.instances.iter().enumerate();
        instances.filter(move |(_, object)| object.is_visible && object.materials.iter().any(shines))
    }
}

/// Light index of a triangle that does not emit.
const NOT_EMISSIVE: u32 = u32::MAX;

impl EmissiveTriangles {
    pub fn new(world: &Geometry) -> Self {
        let mut found = Self::default();
        let mut bounds = vec![];
        let shines = |&material: &usize| world.materials[material].material.emission.value != [0.0; 3];
        for (instance, object) in world.shining_instances() {
            found.light_of_triangle.resize_with(instance + 1, Vec::new);
            let count = object.mesh.mesh.triangles.len();
            let mut numbers = vec![NOT_EMISSIVE; count];
            for (triangle, number) in numbers.iter_mut().enumerate() {
                let (instance, triangle) = (instance as u32, triangle as u32);
                if shines(&world.material_index(instance, triangle))
                    && let Some(light) = measure_emission(world, instance, triangle)
                {
                    *number = found.triangles.len() as u32;
                    found.triangles.push([instance, triangle]);
                    bounds.push(light);
                }
            }
            found.light_of_triangle[instance] = numbers;
        }
        found.tree = LightTree::new(&bounds);
        found
    }

    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Light tree over the triangles.
    pub fn tree(&self) -> &LightTree {
        &self.tree
    }

    /// Importance of all triangles together at a point.
    pub fn importance(&self, from: &LightSampleContext) -> f64 {
        self.tree.importance(from)
    }

    /// Samples a triangle by the light tree and a point uniformly on it.
    pub fn sample(
        &self,
        world: &Geometry,
        by: &LightTreeContext,
        which: f64,
        [x, y]: [f32; 2],
    ) -> Option<LightLiSample> {
        let (number, probability) = self.tree.sample(by, which)?;
        let [instance, triangle] = self.triangles[number];
        // The square folded along its diagonal.
        let (u, v) = if x + y > 1.0 { (1.0 - x, 1.0 - y) } else { (x, y) };
        let [a, e1, e2] = edges(world, instance, triangle);
        let end = a + e1 * f64::from(u) + e2 * f64::from(v);
        let offset = end - by.from.position;
        let distance = offset.length();
        let direction = offset / distance;
        let hit = Hit { t: distance as f32, u, v, instance, triangle };
        let radiance = world.emission(&hit, direction.as_vec3(), &Footprint::default()) * world.opacity(&hit);
        let density = solid_angle_pdf(e1.cross(e2) / 2.0, direction, distance);
        if radiance == Vec3::ZERO {
            return None;
        }
        LightLiSample::new(direction, end, radiance, probability * density)
    }

    /// Density by solid angle with which [`EmissiveTriangles::sample`] yields a hit at this distance.
    pub fn pdf(&self, world: &Geometry, from: &LightSampleContext, hit: &Hit, direction: Vec3, distance: f64) -> f64 {
        let numbers = self.light_of_triangle.get(hit.instance as usize);
        let number = numbers.and_then(|numbers| numbers.get(hit.triangle as usize));
        let Some(&number) = number.filter(|&&number| number != NOT_EMISSIVE) else {
            return 0.0;
        };
        let [_, e1, e2] = edges(world, hit.instance, hit.triangle);
        let density = solid_angle_pdf(e1.cross(e2) / 2.0, direction.as_dvec3(), distance);
        self.tree.pmf(&from.into(), number as usize) * density
    }
}

/// First vertex, scene-local, and the edges to the others.
fn edges(world: &Geometry, instance: u32, triangle: u32) -> [DVec3; 3] {
    let [a, b, c] = world.corners(instance, triangle);
    [a - world.origin, b - a, c - a]
}

/// Density by solid angle of a point sampled uniformly on an area, given as a normal of that length.
fn solid_angle_pdf(area: DVec3, direction: DVec3, distance: f64) -> f64 {
    distance * distance / area.dot(direction).abs()
}

/// Light bounds of a triangle; `None` if it is degenerate. The radiance is the mean over an even grid and is used only
/// for light selection: bright texels between grid points are found by BSDF samples.
fn measure_emission(world: &Geometry, instance: u32, triangle: u32) -> Option<LightBounds> {
    const MEASURE_GRID: usize = 8;
    let [a, e1, e2] = edges(world, instance, triangle);
    let area = e1.cross(e2) / 2.0;
    let normal = area.try_normalize()?;
    let material = &world.materials[world.material_index(instance, triangle)].material;
    let place = |i: usize| {
        let (x, y) = (i % MEASURE_GRID, i / MEASURE_GRID);
        [x, y].map(|n| (n as f32 + 0.5) / MEASURE_GRID as f32)
    };
    let mean = if material.emission.texture.is_some() {
        // Half of the square; the other half is folded onto it.
        let at = |i: usize| {
            let [u, v] = place(i);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let hit = Hit { t: 0.0, u, v, instance, triangle };
            world.emission(&hit, front_direction(world, instance, normal), &Footprint::default())
        };
        (0..MEASURE_GRID * MEASURE_GRID).map(at).sum::<Vec3>() / (MEASURE_GRID * MEASURE_GRID) as f32
    } else {
        Vec3::from(material.emission.value)
    };
    let intensity = (mean.as_dvec3() * area.length()).as_vec3();
    let front = -front_direction(world, instance, normal).as_dvec3();
    Some(LightBounds::planar(&[a, a + e1, a + e2], front, intensity, material.double_sided))
}

/// Direction of a ray that hits the triangle's front.
fn front_direction(world: &Geometry, instance: u32, normal: DVec3) -> Vec3 {
    let mirrored = world.instances[instance as usize].flips_orientation;
    (if mirrored { normal } else { -normal }).as_vec3()
}
