//! Exact queries of a real mesh.

use std::collections::HashMap;

use rapier3d_f64::math::{Pose, Vector};
use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingVolume};
use rapier3d_f64::parry::query::{PointQuery, Ray};
use rapier3d_f64::parry::shape::{TriMesh, Triangle};

/// Directions of the three rays that decide by majority whether a point is inside; they are not parallel to typical
/// edges.
const PARITY_DIRECTIONS: [[f64; 3]; 3] = [
    [0.533_174_1, 0.218_653_9, 0.817_263_3],
    [-0.731_822_6, 0.611_193_2, 0.301_492_7],
    [0.170_871_9, -0.892_113_4, 0.418_261_5],
];

/// Triangles of a mesh, with precomputed data for queries.
pub(crate) struct Surface {
    mesh: TriMesh,
    /// True if every edge is used equally often in both directions, so that the surface has an inside.
    pub(crate) is_closed: bool,
    /// The edges; each edge occurs once.
    edges: Vec<[u32; 2]>,
    /// One vertex of each connected part.
    seeds: Vec<u32>,
}

/// Surface at a pose, with its bounds there.
pub(crate) struct Placed<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) pose: Pose,
    pub(crate) bounds: Aabb,
}

impl Surface {
    /// Creates the surface of these triangles, without triangles of zero area; `None` if no triangles are left.
    pub(crate) fn new(vertices: &[Vector], triangles: impl Iterator<Item = [u32; 3]>) -> Option<Self> {
        let mut numbers = HashMap::new();
        let mut points = Vec::new();
        let mut weld = |i: u32| {
            let vertex = vertices[i as usize];
            // Adding zero converts -0.0 to 0.0, so that both have the same bits.
            let key = (vertex + Vector::ZERO).to_array().map(f64::to_bits);
            *numbers.entry(key).or_insert_with(|| {
                points.push(vertex);
                points.len() as u32 - 1
            })
        };
        let welded: Vec<[u32; 3]> = triangles.map(|triangle| triangle.map(&mut weld)).collect();
        let has_area = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| points[i as usize]);
            (b - a).cross(c - a) != Vector::ZERO
        };
        let triangles: Vec<[u32; 3]> = welded.into_iter().filter(has_area).collect();
        let (edges, is_closed) = edges_of(&triangles);
        let seeds = seeds_of(points.len(), &edges);
        let mesh = TriMesh::new(points, triangles).ok()?;
        Some(Self { mesh, is_closed, edges, seeds })
    }

    /// The triangles of the surface.
    pub(crate) fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Enclosed volume of a closed surface, positive if its triangles face outwards.
    pub(crate) fn volume(&self) -> f64 {
        let origin = self.mesh.local_aabb().center();
        let volume = |triangle: Triangle| {
            let [a, b, c] = [triangle.a - origin, triangle.b - origin, triangle.c - origin];
            a.dot(b.cross(c)) / 6.0
        };
        self.mesh.triangles().map(volume).sum()
    }

    /// Surface at a pose.
    pub(crate) fn at(&self, pose: Pose) -> Placed<'_> {
        let points = self.mesh.vertices().iter().map(|&point| pose * point);
        Placed { surface: self, pose, bounds: Aabb::from_points(points) }
    }

    /// Distance of a point to the surface.
    pub(crate) fn distance(&self, point: Vector) -> f64 {
        (self.mesh.project_local_point(point, false).point - point).length()
    }

    /// True if a point is inside a closed surface.
    fn contains(&self, point: Vector) -> bool {
        if !self.mesh.local_aabb().contains_local_point(point) {
            return false;
        }
        let odd = |direction: &[f64; 3]| self.crossings(point, Vector::from_array(*direction), f64::MAX).len() % 2;
        PARITY_DIRECTIONS.iter().map(odd).sum::<usize>() >= 2
    }

    /// Depth of a point inside a closed surface; 0 outside.
    fn depth(&self, point: Vector) -> f64 {
        if self.contains(point) { self.distance(point) } else { 0.0 }
    }

    /// Returns where the segment from `origin` to `origin + limit * direction` crosses the surface: the parameter along
    /// `direction` and the triangle of each crossing, in order.
    fn crossings(&self, origin: Vector, direction: Vector, limit: f64) -> Vec<(f64, u32)> {
        let ray = Ray::new(origin, direction);
        let leaves = self.mesh.bvh().leaves(|node| node.cast_ray(&ray, limit) < f64::MAX);
        let hit = |i: u32| crossing(&self.mesh.triangle(i), origin, direction).filter(|t| *t <= limit).map(|t| (t, i));
        let mut found: Vec<(f64, u32)> = leaves.filter_map(hit).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found
    }
}

impl Placed<'_> {
    /// Maximum depth to which two surfaces penetrate each other; 0 if they do not penetrate.
    ///
    /// For a closed surface, these are the depths of vertices and edge parts inside it. For an open surface, a triangle
    /// that an edge crosses divides the edge into two parts; the depth is the extent of the shorter part along the
    /// triangle's normal.
    pub(crate) fn penetration(&self, other: &Placed<'_>) -> f64 {
        if !self.bounds.intersects(&other.bounds) {
            return 0.0;
        }
        let (here, touches) = self.penetration_of_edges(other);
        let (there, touched) = other.penetration_of_edges(self);
        let is_crossed = touches || touched;
        here.max(there)
            .max(self.penetration_of_points(other, is_crossed))
            .max(other.penetration_of_points(self, is_crossed))
    }

    /// True if the surfaces cross.
    pub(crate) fn touches(&self, other: &Placed<'_>) -> bool {
        let mut crosses =
            |from: Vector, along: Vector, solid: &Placed<'_>| !solid.surface.crossings(from, along, 1.0).is_empty();
        self.bounds.intersects(&other.bounds)
            && (self.any_edge(other, &mut crosses) || other.any_edge(self, &mut crosses))
    }

    /// Visits the edges near another surface, as start and direction in the other surface's coordinates. Ends if
    /// `visit` returns true.
    fn any_edge(&self, other: &Placed<'_>, visit: &mut dyn FnMut(Vector, Vector, &Placed<'_>) -> bool) -> bool {
        let there = other.pose.inverse() * self.pose;
        let bounds = other.surface.mesh.local_aabb();
        let points: Vec<Vector> = self.surface.mesh.vertices().iter().map(|&point| there * point).collect();
        self.surface.edges.iter().any(|&[a, b]| {
            let (a, b) = (points[a as usize], points[b as usize]);
            Aabb::new(a.min(b), a.max(b)).intersects(&bounds) && visit(a, b - a, other)
        })
    }

    /// Depth of this surface's edges inside another surface, and true if any edge crosses the other surface.
    fn penetration_of_edges(&self, other: &Placed<'_>) -> (f64, bool) {
        let (mut deepest, mut crosses): (f64, bool) = (0.0, false);
        self.any_edge(other, &mut |from, along, solid| {
            let hits = solid.surface.crossings(from, along, 1.0);
            crosses |= !hits.is_empty();
            if solid.surface.is_closed {
                for pair in hits.windows(2) {
                    deepest = deepest.max(solid.surface.depth(from + along * (0.5 * (pair[0].0 + pair[1].0))));
                }
            } else {
                for (t, triangle) in hits {
                    let normal = solid.surface.mesh.triangle(triangle).normal().unwrap_or(Vector::ZERO);
                    deepest = deepest.max(along.dot(normal).abs() * t.min(1.0 - t));
                }
            }
            false
        });
        (deepest, crosses)
    }

    /// Depth of this surface's vertices and edge midpoints inside another, closed surface. If the surfaces do not
    /// cross, each is inside the other either completely or not at all.
    fn penetration_of_points(&self, other: &Placed<'_>, is_crossed: bool) -> f64 {
        if !other.surface.is_closed {
            return 0.0;
        }
        let there = other.pose.inverse() * self.pose;
        let vertices = self.surface.mesh.vertices();
        let depth = |point: Vector| other.surface.depth(there * point);
        if !is_crossed {
            return self.surface.seeds.iter().map(|&i| depth(vertices[i as usize])).fold(0.0, f64::max);
        }
        let middle = |&[a, b]: &[u32; 2]| 0.5 * (vertices[a as usize] + vertices[b as usize]);
        let points = vertices.iter().copied().chain(self.surface.edges.iter().map(middle));
        points.map(depth).fold(0.0, f64::max)
    }
}

/// Returns the intersection of a ray with a triangle, from either side. Source: Möller and Trumbore 1997.
fn crossing(triangle: &Triangle, origin: Vector, direction: Vector) -> Option<f64> {
    let (u_edge, v_edge) = (triangle.b - triangle.a, triangle.c - triangle.a);
    let p = direction.cross(v_edge);
    let determinant = u_edge.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let from_corner = origin - triangle.a;
    let u = from_corner.dot(p) / determinant;
    let q = from_corner.cross(u_edge);
    let v = direction.dot(q) / determinant;
    let t = v_edge.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}

/// Returns each edge once, and true if every edge is used equally often in both directions.
fn edges_of(triangles: &[[u32; 3]]) -> (Vec<[u32; 2]>, bool) {
    let mut balance: HashMap<[u32; 2], i32> = HashMap::new();
    let mut edges = Vec::new();
    for &[a, b, c] in triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let (edge, sign) = if from < to { ([from, to], 1) } else { ([to, from], -1) };
            *balance.entry(edge).or_insert_with(|| {
                edges.push(edge);
                0
            }) += sign;
        }
    }
    let is_closed = !triangles.is_empty() && balance.values().all(|&count| count == 0);
    (edges, is_closed)
}

/// Returns one vertex of each part that is connected by edges; vertices without edges are ignored.
fn seeds_of(count: usize, edges: &[[u32; 2]]) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..count as u32).collect();
    fn root(parents: &mut [u32], mut i: u32) -> u32 {
        while parents[i as usize] != i {
            parents[i as usize] = parents[parents[i as usize] as usize];
            i = parents[i as usize];
        }
        i
    }
    for &[a, b] in edges {
        let (a, b) = (root(&mut parents, a), root(&mut parents, b));
        parents[a.max(b) as usize] = a.min(b);
    }
    let mut seeds: Vec<u32> = edges.iter().map(|&[a, _]| root(&mut parents, a)).collect();
    seeds.sort_unstable();
    seeds.dedup();
    seeds
}

#[cfg(test)]
mod tests {
    use super::*;
    use raycam_scene::mesh::primitive;

    fn surface(mesh: &raycam_scene::Mesh) -> Surface {
        let points: Vec<Vector> = mesh.vertices.iter().map(|&v| crate::convert::vector(v)).collect();
        Surface::new(&points, mesh.triangles.iter().copied()).unwrap()
    }

    fn cube() -> Surface {
        surface(&primitive::box_([1.0; 3]).unwrap())
    }

    #[test]
    fn depth_in_a_cube_is_the_distance_to_its_nearest_face() {
        let cube = cube();
        assert!(cube.is_closed);
        assert!((cube.volume() - 1.0).abs() < 1e-12);
        assert!((cube.depth(Vector::new(0.1, 0.0, 0.45)) - 0.05).abs() < 1e-12);
        assert_eq!(cube.depth(Vector::new(0.1, 0.0, 0.55)), 0.0);
    }

    #[test]
    fn penetration_of_cubes_is_their_overlap() {
        let cube = cube();
        let at = |x: f64, y: f64| cube.at(Pose::from_translation(Vector::new(x, y, 0.0)));
        assert_eq!(at(0.0, 0.0).penetration(&at(1.01, 0.0)), 0.0);
        assert!((at(0.0, 0.1).penetration(&at(0.99, 0.0)) - 0.01).abs() < 1e-9);
        assert!(at(0.0, 0.1).touches(&at(0.99, 0.0)));
        assert!(!at(0.0, 0.1).touches(&at(1.01, 0.0)));
    }

    #[test]
    fn penetration_of_crossed_bars_is_found_without_vertices_inside() {
        let bar = surface(&primitive::box_([2.0, 0.2, 0.2]).unwrap());
        let lower = bar.at(Pose::from_translation(Vector::ZERO));
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let turned = rapier3d_f64::math::Rotation::from_xyzw(0.0, 0.0, half, half);
        // The offsets are irregular, so that no midpoint of an edge is inside the other object.
        let upper = bar.at(Pose::from_parts(Vector::new(0.33, 0.27, 0.19), turned));
        assert!((lower.penetration(&upper) - 0.01).abs() < 1e-9, "{}", lower.penetration(&upper));
    }

    #[test]
    fn penetration_of_an_open_floor_is_the_depth_below_it() {
        let floor = surface(&primitive::plane([4.0; 2]).unwrap());
        let (cube, floor) = (cube(), floor.at(Pose::identity()));
        assert!(!floor.surface.is_closed);
        let at = |z: f64| cube.at(Pose::from_translation(Vector::new(0.2, 0.1, z)));
        assert!((at(0.49).penetration(&floor) - 0.01).abs() < 1e-9);
        assert_eq!(at(0.51).penetration(&floor), 0.0);
    }

    #[test]
    fn nested_surfaces_penetrate_each_other() {
        let (cube, outer) = (cube(), surface(&primitive::box_([3.0; 3]).unwrap()));
        let inside = cube.at(Pose::identity()).penetration(&outer.at(Pose::identity()));
        assert!((inside - 1.0).abs() < 1e-9, "{inside}");
    }
}
