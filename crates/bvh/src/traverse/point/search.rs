//! The search for the closest point: nearest instances, nodes and leaves first.

use crate::exact::closest_point::closest_point;
use crate::node::{NodeRef, WideNode, leaf, node};
use crate::ray::{ClosestPoint, ExactHit, HitFilter, INVALID_ID};
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{ExactTriangles, InstanceRecord, Scene};
use crate::simd::{Isa, Vector};
use crate::traverse::exact::clipped_ray::{F64_ERROR, coordinate_error, max_abs};
use crate::traverse::point::bounds::{Sphere, box_distances, near_triangles};
use crate::traverse::stack::Stack;

/// One point with its closest point so far.
struct PointSearch<'a> {
    scene: &'a Scene,
    triangles: &'a dyn ExactTriangles,
    filter: Option<&'a dyn HitFilter>,
    number: usize,
    point: [f64; 3],
    /// The point in scaled scene coordinates, and its error bound.
    local: [f64; 3],
    error: f64,
    best: ClosestPoint,
    /// The squared distance of `best`.
    squared_distance: f64,
    /// Cosine of `best` (see [`facing`]), computed when another triangle has the same distance.
    facing: Option<i64>,
}

#[inline(always)]
pub fn closest_points_batch<I: Isa>(
    scene: &Scene,
    points: &[[f64; 3]],
    max_distance: &[f64],
    triangles: &dyn ExactTriangles,
    filter: Option<&dyn HitFilter>,
    found: &mut [ClosestPoint],
) {
    let mut hint = None;
    for (number, (&point, found)) in points.iter().zip(found.iter_mut()).enumerate() {
        *found = ClosestPoint::MISS;
        let max_distance = if max_distance.len() == 1 { max_distance[0] } else { max_distance[number] };
        // This is false if the limit is NaN.
        let has_reach = max_distance >= 0.0;
        if !has_reach || !point.iter().all(|x| x.is_finite()) || scene.root == NodeRef::EMPTY {
            continue;
        }
        let world = scene.origin();
        let local: [f64; 3] = std::array::from_fn(|a| (point[a] - world[a]) * scene.scale);
        let reach = (0..3).fold(0.0, |most: f64, a| most.max(local[a].abs()).max((world[a] * scene.scale).abs()));
        let mut search = PointSearch {
            scene,
            triangles,
            filter,
            number,
            point,
            local,
            error: F64_ERROR * (reach + f64::from(scene.max_abs_coord)),
            best: ClosestPoint::MISS,
            // The bound is slightly larger than the squared maximum distance; at the end, the distance itself is
            // compared exactly.
            squared_distance: max_distance * max_distance * (1.0 + 4.0 * f64::EPSILON),
            facing: None,
        };
        if let Some((instance, triangle)) = hint
            && search.accepts_instance(instance)
        {
            search.visit(instance, triangle);
        }
        search.traverse_tlas::<I>();
        if search.best.instance != INVALID_ID && search.best.distance <= max_distance {
            *found = search.best;
            hint = Some((found.instance, found.triangle));
        }
    }
}

impl PointSearch<'_> {
    #[inline(always)]
    fn accepts_instance(&self, instance: u32) -> bool {
        self.filter.is_none_or(|filter| filter.accepts_instance(self.number, instance))
    }

    /// Computes the closest point of a triangle, and keeps it if it precedes the closest point so far. Closest points
    /// are ordered by distance, then by the cosine between the triangle's outward normal and the direction to the given
    /// point (largest first), then by (instance, triangle).
    #[inline(always)]
    fn visit(&mut self, instance: u32, triangle: u32) {
        let corners = self.triangles.corners(instance, triangle);
        let found = closest_point(self.point, corners);
        let ties = found.squared_distance == self.squared_distance;
        let is_farther = !(found.squared_distance < self.squared_distance || ties);
        if is_farther || self.filter.is_some_and(|filter| !filter.accepts(self.number, &hit(instance, triangle))) {
            return;
        }
        let mut cosine = None;
        if ties && self.best.instance != INVALID_ID {
            let own = self.cosine(instance, triangle, found.position);
            let best = self.best;
            let others = self.facing.unwrap_or_else(|| self.cosine(best.instance, best.triangle, best.position));
            self.facing = Some(others);
            let order = (best.instance, best.triangle);
            if own < others || own == others && (instance, triangle) >= order {
                return;
            }
            cosine = Some(own);
        }
        self.facing = cosine;
        self.squared_distance = found.squared_distance;
        self.best = ClosestPoint {
            distance: found.squared_distance.sqrt(),
            position: found.position,
            weights: found.weights,
            instance,
            triangle,
        };
    }

    /// Cosine of a triangle at its closest point; see [`facing`].
    #[cold]
    #[inline(never)]
    fn cosine(&self, instance: u32, triangle: u32, position: [f64; 3]) -> i64 {
        let cosine = facing(self.point, self.triangles.corners(instance, triangle), position);
        if self.triangles.is_mirrored(instance) && cosine != i64::MIN { -cosine } else { cosine }
    }

    /// Radius within which boxes and triangles are considered, in coordinates that are `scale` times as large as world
    /// coordinates.
    #[inline(always)]
    fn radius(&self, scale: f64) -> f32 {
        let radius = (self.squared_distance.sqrt() * scale * (1.0 + 4.0 * f64::EPSILON)) as f32;
        radius.next_up().min(f32::MAX)
    }

    #[inline(always)]
    fn traverse_tlas<I: Isa>(&mut self) {
        let scene = self.scene;
        let point = self.local.map(|x| x as f32);
        let error = 2.0 * scene.box_padding(max_abs(point)) + 2.0 * self.error as f32;
        let mut sphere = Sphere::new(point, error, 1.0);
        let mut stack = Stack::new();
        let mut at = scene.root;
        loop {
            sphere.radius = self.radius(scene.scale);
            if !at.is_leaf() {
                if let Some(nearest) = enter::<I>(node(scene.blocks(), at), &sphere, &mut stack) {
                    at = nearest;
                    continue;
                }
            } else {
                let subtree = &scene.subtree_refs[at.index()];
                if self.accepts_instance(subtree.instance) {
                    self.traverse_subtree::<I>(subtree);
                    sphere.radius = self.radius(scene.scale);
                }
            }
            match stack.pop(0, sphere.squared_limit()) {
                Some(next) => at = next,
                None => return,
            }
        }
    }

    #[inline(always)]
    fn traverse_subtree<I: Isa>(&mut self, subtree: &SubtreeRef) {
        let scene = self.scene;
        let record = &scene.instances[subtree.instance as usize];
        let mesh = &*record.bvh;
        let point = to_mesh_point(record, self.local);
        let distance = max_abs(self.local.map(|x| x as f32));
        let error = coordinate_error(scene, record, distance, self.error) + 8.0 * f32::EPSILON * max_abs(point);
        let scale = scene.scale * f64::from(record.max_length_scale);
        let mut sphere = Sphere::new(point, error, record.length_condition);
        let mut stack = Stack::new();
        let mut at = subtree.node;
        loop {
            sphere.radius = self.radius(scale);
            if !at.is_leaf() {
                if let Some(nearest) = enter::<I>(node(mesh.blocks(), at), &sphere, &mut stack) {
                    at = nearest;
                    continue;
                }
            } else {
                let leaf = leaf(mesh.blocks(), at);
                let mut near = near_triangles::<I>(leaf, &sphere, self.filter.is_none());
                while near != 0 {
                    let lane = near.trailing_zeros();
                    near &= near - 1;
                    self.visit(subtree.instance, mesh.prim_id(leaf.first_prim + lane));
                }
                sphere.radius = self.radius(scale);
            }
            match stack.pop(0, sphere.squared_limit()) {
                Some(next) => at = next,
                None => return,
            }
        }
    }
}

/// Returns the nearest child of a node that the sphere reaches; all other children that the sphere reaches are pushed.
#[inline(always)]
fn enter<I: Isa>(node: &WideNode, sphere: &Sphere, stack: &mut Stack) -> Option<NodeRef> {
    let distances = box_distances::<I>(node, sphere);
    let into = <I::F32x8 as Vector>::to_bitmask(distances.le(I::F32x8::splat(sphere.squared_limit())));
    // This code contains no closure, because a closure would be compiled without the selected instruction set.
    if into == 0 { None } else { Some(stack.push::<I>(node, distances, into)) }
}

/// Cosine between a triangle's normal and the direction from its closest point `position` to `point`, in units of 1e-9,
/// so that triangles in the same plane have the same value. 0 for a point on the triangle; the smallest value for a
/// triangle without area.
fn facing(point: [f64; 3], [a, b, c]: [[f64; 3]; 3], position: [f64; 3]) -> i64 {
    let sub = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| p[k] - q[k]) };
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let unit = |v: [f64; 3]| {
        let largest = v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let scaled = v.map(|x| x / largest);
        scaled.map(|x| x / dot(scaled, scaled).sqrt())
    };
    let (e, f) = (unit(sub(b, a)), unit(sub(c, a)));
    let normal = unit(std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        e[i] * f[j] - e[j] * f[i]
    }));
    if !normal.iter().all(|x| x.is_finite()) {
        return i64::MIN;
    }
    let towards = unit(sub(point, position));
    if towards.iter().all(|x| x.is_finite()) { (dot(normal, towards) * 1e9).round() as i64 } else { 0 }
}

/// A hit for filters, in which only the instance and the triangle are set.
fn hit(instance: u32, triangle: u32) -> ExactHit {
    ExactHit { instance, triangle, ..ExactHit::MISS }
}

/// Transforms a point from scaled scene coordinates to tree coordinates of the mesh.
#[inline(always)]
fn to_mesh_point(record: &InstanceRecord, point: [f64; 3]) -> [f32; 3] {
    record.mesh_from_scene.map(|row| {
        let [x, y, z, w] = row.map(f64::from);
        (x * point[0] + y * point[1] + z * point[2] + w) as f32
    })
}
