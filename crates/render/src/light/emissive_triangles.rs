//! Emissive triangles: every triangle of an emissive material is a light.
//!
//! Points on a triangle are sampled in proportion to the brightness of its texture's texels.

use std::sync::{Arc, Weak};

use glam::{DAffine3, DVec3, Vec2, Vec3};
use raycam_bvh::Hit;
use raycam_scene::Material;

use crate::interaction::LightSampleContext;
use crate::interaction::ray_cone::Footprint;
use crate::light::bounds::LightBounds;
use crate::light::emission_table::{CellContent, EmissionTable};
use crate::light::samples::LightLiSample;
use crate::light::tree::LightTree;
use crate::light::tree::RecentNodes;
use crate::light::tree::importance::LightTreeContext;
use crate::prepare::geometry::Geometry;
use crate::prepare::instance::PreparedInstance;
use crate::prepare::mesh::PreparedMesh;
use crate::prepare::texture::PreparedTexture;

/// All emissive triangles of the scene.
#[derive(Debug, Default)]
pub(crate) struct EmissiveTriangles {
    /// For each light: the indices of its instance and its triangle.
    triangles: Vec<[u32; 2]>,
    /// For each emissive instance: the light index of every triangle.
    light_of_triangle: Vec<Vec<u32>>,
    /// Distribution of the points on each triangle; `None` if the emission is uniform.
    distributions: Vec<Option<PointDistribution>>,
    tree: LightTree,
}

/// Key of a scene's emissive triangles. The key contains all inputs, so scenes with equal keys have equal triangles.
#[derive(Debug)]
pub(crate) struct EmissiveKey {
    origin: DVec3,
    instances: Vec<EmissiveInstance>,
}

#[derive(Debug)]
struct EmissiveInstance {
    instance: usize,
    /// The mesh; the reference prevents its address from being reused.
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

/// Distribution of points on a triangle with an emission texture.
#[derive(Debug)]
struct PointDistribution {
    grid: CellGrid,
    table: EmissionTable,
}

impl PointDistribution {
    /// Samples the weights of the second and third vertex. Returns the weights and their density relative to the
    /// uniform density.
    fn sample(&self, random: [f32; 2]) -> ([f32; 2], f64) {
        let (point, density) = self.table.sample(random);
        (self.grid.to_triangle(point), density)
    }

    /// The density of [`PointDistribution::sample`].
    fn pdf(&self, weights: [f32; 2]) -> f64 {
        self.table.pdf(self.grid.to_grid(weights).map(|x| x.max(0.0)))
    }
}

/// Light index of a triangle that does not emit.
const NOT_EMISSIVE: u32 = u32::MAX;

impl EmissiveTriangles {
    pub fn new(world: &Geometry) -> Self {
        let mut found = Self::default();
        let mut bounds = vec![];
        let shines = |&material: &usize| world.materials[material].material.emission.value != [0.0; 3];
        let most_cells = limit_cells(world);
        for (instance, object) in world.shining_instances() {
            found.light_of_triangle.resize_with(instance + 1, Vec::new);
            let count = object.mesh.mesh.triangles.len();
            let mut numbers = vec![NOT_EMISSIVE; count];
            for (triangle, number) in numbers.iter_mut().enumerate() {
                let (instance, triangle) = (instance as u32, triangle as u32);
                if shines(&world.material_index(instance, triangle))
                    && let Some((light, distribution)) = measure_emission(world, instance, triangle, most_cells)
                {
                    *number = found.triangles.len() as u32;
                    found.triangles.push([instance, triangle]);
                    bounds.push(light);
                    found.distributions.push(distribution);
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

    /// Importance of all emissive triangles together at a point.
    pub fn importance(&self, from: &LightSampleContext) -> f64 {
        self.tree.importance(from)
    }

    /// Samples a triangle by the light tree, and a point on this triangle by its brightness. `recent` is that of
    /// [`LightTree::sample`].
    pub fn sample(
        &self,
        world: &Geometry,
        by: &LightTreeContext,
        which: f64,
        [x, y]: [f32; 2],
        recent: Option<&mut RecentNodes>,
    ) -> Option<LightLiSample> {
        let (number, probability) = self.tree.sample(by, which, recent)?;
        let [instance, triangle] = self.triangles[number];
        let ([u, v], brightness_density) = match &self.distributions[number] {
            Some(distribution) => distribution.sample([x, y]),
            // The unit square is folded along its diagonal.
            None if x + y > 1.0 => ([1.0 - x, 1.0 - y], 1.0),
            None => ([x, y], 1.0),
        };
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
        LightLiSample::new(direction, end, radiance, probability * density * brightness_density)
    }

    /// Density by solid angle with which [`EmissiveTriangles::sample`] samples the direction to this hit, at
    /// this distance.
    pub fn pdf(&self, world: &Geometry, from: &LightSampleContext, hit: &Hit, direction: Vec3, distance: f64) -> f64 {
        let numbers = self.light_of_triangle.get(hit.instance as usize);
        let number = numbers.and_then(|numbers| numbers.get(hit.triangle as usize));
        let Some(&number) = number.filter(|&&number| number != NOT_EMISSIVE) else {
            return 0.0;
        };
        let [_, e1, e2] = edges(world, hit.instance, hit.triangle);
        let density = solid_angle_pdf(e1.cross(e2) / 2.0, direction.as_dvec3(), distance);
        let brightness_density = self.distributions[number as usize].as_ref();
        let brightness_density = brightness_density.map_or(1.0, |points| points.pdf([hit.u, hit.v]));
        self.tree.pmf(&from.into(), number as usize) * density * brightness_density
    }
}

/// The first vertex in scene-local coordinates, and the edges to the other two vertices.
fn edges(world: &Geometry, instance: u32, triangle: u32) -> [DVec3; 3] {
    let [a, b, c] = world.corners(instance, triangle);
    [a - world.origin, b - a, c - a]
}

/// Density by solid angle of a point that is sampled uniformly on an area. `area` is a normal whose length is the size
/// of the area.
fn solid_angle_pdf(area: DVec3, direction: DVec3, distance: f64) -> f64 {
    distance * distance / area.dot(direction).abs()
}

/// Maximum number of cells along an edge of a table, and maximum number of values in all tables together.
const MAX_CELLS: usize = 4096;
const MAX_TABLE_VALUES: usize = 1 << 25;

/// Maximum number of cells along an edge for which all tables together have at most [`MAX_TABLE_VALUES`] values.
fn limit_cells(world: &Geometry) -> usize {
    let shining = world.shining_instances().flat_map(|(instance, object)| {
        let triangles = 0..object.mesh.mesh.triangles.len() as u32;
        triangles.map(move |triangle| CellGrid::new(world, instance as u32, triangle).size)
    });
    let cells: Vec<usize> = shining.filter(|&cells| cells > 1).collect();
    let mut limit = MAX_CELLS;
    let values = |limit: usize| cells.iter().map(|&cells| EmissionTable::len_of(cells.min(limit))).sum::<usize>();
    while limit > 1 && values(limit) > MAX_TABLE_VALUES {
        limit /= 2;
    }
    limit
}

/// Grid of cells on a triangle with an emission texture.
#[derive(Clone, Copy, Debug)]
struct CellGrid {
    /// Number of cells along an edge of the triangle.
    size: usize,
    content: CellContent,
    /// Vertex from which both edges of the grid start.
    base: usize,
}

impl CellGrid {
    /// Grid of a single cell, for a uniform emission.
    const UNIFORM: Self = Self { size: 1, content: CellContent::Constant, base: 0 };
    /// Tolerance for the rounding of texture coordinates, in cells.
    const ROUNDING: f32 = 1e-2;

    /// The grid of a triangle. An image without interpolation is constant within a texel; any other image is bilinear
    /// within half a texel.
    fn new(world: &Geometry, instance: u32, triangle: u32) -> Self {
        let material = &world.materials[world.material_index(instance, triangle)].material;
        let grid = || {
            let slot = material.emission.texture?;
            let corners = world.uv_corners(instance, triangle, slot.uv_set)?;
            let texture = &world.textures[slot.texture];
            let is_interpolated = texture.is_interpolated();
            let scale = Vec2::from(texture.size().map(|n| n as f32)) * if is_interpolated { 2.0 } else { 1.0 };
            let corners = corners.map(|uv| Vec2::from(slot.coordinates(uv.map(|x| x as f32))) * scale);
            Some(Self::on_corners(corners, is_interpolated))
        };
        grid().unwrap_or(Self::UNIFORM)
    }

    /// The grid of a triangle whose texture coordinates are given in units of the image's cells.
    fn on_corners(corners: [Vec2; 3], is_interpolated: bool) -> Self {
        let edges = |base: usize| [1, 2].map(|next| corners[(base + next) % 3] - corners[base]);
        // The grid starts at the vertex whose edges are most parallel to the image's axes.
        let skew = |base: &usize| edges(*base).iter().map(|edge| edge.abs().min_element()).fold(0.0, f32::max);
        let base = [0, 1, 2].into_iter().min_by(|a, b| skew(a).total_cmp(&skew(b))).unwrap_or(0);
        let lengths = edges(base).map(|edge| edge.abs().max_element());
        let longest = (lengths[0].max(lengths[1]) - Self::ROUNDING).ceil().clamp(1.0, MAX_CELLS as f32);
        let is_whole = |x: f32| (x - x.round()).abs() <= Self::ROUNDING;
        let is_aligned = skew(&base) <= Self::ROUNDING
            && corners[base].to_array().into_iter().all(is_whole)
            && lengths.into_iter().all(|length| length >= 1.0 && is_whole(longest / length));
        let content = match (is_aligned, is_interpolated) {
            (true, false) => CellContent::Constant,
            (true, true) => CellContent::Bilinear,
            (false, _) => CellContent::Mixed,
        };
        Self { size: longest as usize, content, base }
    }

    /// Weights of the second and third vertex for a point of the grid.
    fn to_triangle(self, [s, t]: [f32; 2]) -> [f32; 2] {
        match self.base {
            0 => [s, t],
            1 => [1.0 - s - t, s],
            _ => [t, 1.0 - s - t],
        }
    }

    /// The inverse of [`CellGrid::to_triangle`].
    fn to_grid(self, [u, v]: [f32; 2]) -> [f32; 2] {
        match self.base {
            0 => [u, v],
            1 => [v, 1.0 - u - v],
            _ => [1.0 - u - v, u],
        }
    }
}

/// Light bounds of a triangle, computed from its mean radiance, and the distribution of its points; `None` if the
/// triangle is degenerate.
fn measure_emission(
    world: &Geometry,
    instance: u32,
    triangle: u32,
    most_cells: usize,
) -> Option<(LightBounds, Option<PointDistribution>)> {
    let [a, e1, e2] = edges(world, instance, triangle);
    let area = e1.cross(e2) / 2.0;
    let normal = area.try_normalize()?;
    let material = &world.materials[world.material_index(instance, triangle)].material;
    let (mean, table) = if material.emission.texture.is_some() {
        let direction = front_direction(world, instance, normal);
        let mut grid = CellGrid::new(world, instance, triangle);
        if grid.size > most_cells {
            (grid.size, grid.content) = (most_cells, CellContent::Mixed);
        }
        let (mean, table) = EmissionTable::measure(grid.size, grid.content, |point| {
            let [u, v] = grid.to_triangle(point);
            let hit = Hit { t: 0.0, u, v, instance, triangle };
            world.emission(&hit, direction, &Footprint::default())
        });
        (mean, table.map(|table| PointDistribution { grid, table }))
    } else {
        (Vec3::from(material.emission.value), None)
    };
    let intensity = (mean.as_dvec3() * area.length()).as_vec3();
    let front = -front_direction(world, instance, normal).as_dvec3();
    let corners = [a, a + e1, a + e2];
    Some((LightBounds::planar(&corners, front, intensity, material.double_sided), table))
}

/// Direction of a ray that hits the triangle's front.
fn front_direction(world: &Geometry, instance: u32, normal: DVec3) -> Vec3 {
    let mirrored = world.instances[instance as usize].flips_orientation;
    (if mirrored { normal } else { -normal }).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_start_at_the_right_angled_corner_of_a_triangle() {
        // The triangle is the second half of a rectangle with 8 x 4 half texels.
        let corners = [[0.0, 0.0], [8.0, 4.0], [0.0, 4.0]].map(Vec2::from);
        for turn in 0..3 {
            let turned = [0, 1, 2].map(|i| corners[(i + turn) % 3]);
            let grid = CellGrid::on_corners(turned, true);
            assert_eq!((grid.size, grid.content, (grid.base + turn) % 3), (8, CellContent::Bilinear, 2));
            for point in [[0.1, 0.2], [0.7, 0.05], [0.0, 0.9]] {
                let [u, v] = grid.to_triangle(point);
                let place = turned[0] * (1.0 - u - v) + turned[1] * u + turned[2] * v;
                let [s, t] = point;
                let expected = corners[2] * (1.0 - s - t) + corners[0] * s + corners[1] * t;
                assert!((place - expected).length() < 1e-5);
                let back = Vec2::from(grid.to_grid([u, v]));
                assert!((back - Vec2::from(point)).length() < 1e-6);
            }
        }
        assert_eq!(CellGrid::on_corners(corners.map(|at| at + 0.25), true).content, CellContent::Mixed);
        assert_eq!(CellGrid::on_corners(corners, false).content, CellContent::Constant);
    }
}
