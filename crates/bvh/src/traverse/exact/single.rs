//! Closest hits in float64, for a single ray: float32 boxes find the candidates, float64 corners decide.
//!
//! Every float32 quantity on the way (ray, vertices, transform) has a bounded error. Boxes and triangles are padded by it,
//! so that no float64 hit is missed. Hits are computed from [`ExactTriangles::corners`] alone. A ray that starts far away is
//! first clipped, in float64, to the bounds of the scene: the error bound counts from there.

use crate::limits::MACHINE_EPSILON;
use crate::node::{LeafNode, NodeRef, leaf, node};
use crate::ray::{ExactHit, ExactRay, HitFilter};
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{ExactTriangles, InstanceRecord, Scene};
use crate::simd::{Isa, Vector};
use crate::traverse::exact::triangle::{HitSoFar, ShearedRay};
use crate::traverse::node_test::intersect_children;
use crate::traverse::stack::Stack;
use crate::traverse::trav_ray::TravRay;
use crate::traverse::triangle::edge::{corners, indices};
use crate::traverse::triangle::single::{RayView, shear_vertices};

/// The relative error of a few float64 roundings.
pub const F64_ERROR: f64 = 1.0 / (1u64 << 50) as f64;

/// The t of a ray that needs no more hits.
pub const DONE: f64 = f64::NEG_INFINITY;

/// A ray clipped to the bounds of the scene.
#[derive(Clone, Copy)]
pub struct ClippedRay {
    /// Origin in the world and direction as given, the latter scaled to a largest component in 1..2.
    pub ray: ShearedRay,
    /// The given t is the t along `ray.direction` divided by this power of two.
    pub direction_scale: f64,
    /// Clipped origin in scaled scene coordinates, at `t_offset` along the ray.
    pub local_origin: [f64; 3],
    pub t_offset: f64,
    /// The error bound of `local_origin`.
    pub origin_error: f64,
    /// The smallest valid t, along `ray.direction`.
    pub t_min: f64,
    /// The error bound of the t of `best`.
    pub t_error: f64,
    /// True if any hit will do: a ray with one is done.
    pub any_hit: bool,
    /// The closest hit so far, its `t` along `ray.direction`.
    pub best: ExactHit,
}

impl ClippedRay {
    pub fn new(scene: &Scene, ray: &ExactRay) -> Option<ClippedRay> {
        let steepest = ray.direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        let finite = ray.origin.iter().chain(&ray.direction).all(|x| x.is_finite());
        // False for a limit that is NaN.
        let ordered = ray.t_min <= ray.t_max;
        // Also excludes subnormal directions, whose scaling would not be exact.
        if !finite || steepest < f64::MIN_POSITIVE || !ordered || scene.root == NodeRef::EMPTY {
            return None;
        }
        let power = f64::from_bits(steepest.to_bits() & (0x7ff << 52));
        let direction = ray.direction.map(|d| d / power);
        let world = scene.origin();
        let far: [f64; 3] = std::array::from_fn(|a| (ray.origin[a] - world[a]) * scene.scale);
        let scale = scene.scale;
        // In scaled scene coordinates the direction is `scale` times as long, and t the same.
        let along = direction.map(|d| d * scale);
        let fat = f64::from(scene.box_padding(scene.max_abs_coord)) * 2.0 + 1e-5 * f64::from(scene.max_abs_coord);
        let (mut enter, mut leave) = (ray.t_min * power, ray.t_max * power);
        let offset = (0..3).fold(0.0, |m: f64, a| m.max(far[a].abs()).max((world[a] * scale).abs()));
        let drift = F64_ERROR * (offset + f64::from(scene.max_abs_coord));
        for axis in 0..3 {
            let lower = f64::from(scene.bounds.lower[axis]) - fat - drift - far[axis];
            let upper = f64::from(scene.bounds.upper[axis]) + fat + drift - far[axis];
            if along[axis] == 0.0 {
                if lower > 0.0 || upper < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (lower / along[axis], upper / along[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // `enter` is rounded; the padding covers it.
        if enter > leave {
            return None;
        }
        let start = std::array::from_fn(|a| far[a] + enter * along[a]);
        let best = ExactHit { t: ray.t_max * power, ..ExactHit::MISS };
        Some(ClippedRay {
            ray: ShearedRay::new(ray.origin, direction),
            direction_scale: power,
            local_origin: start,
            t_offset: enter,
            origin_error: drift,
            t_min: ray.t_min * power,
            t_error: 0.0,
            any_hit: false,
            best,
        })
    }

    /// The t up to which boxes must be visited, from `local_origin`.
    #[inline(always)]
    pub fn t_max_f32(&self) -> f32 {
        t_max_f32(self.best.t, self.t_offset)
    }

    /// The hit, with t in lengths of the given direction.
    pub fn to_hit(&self) -> ExactHit {
        if self.best.triangle == crate::INVALID_ID {
            return ExactHit::MISS;
        }
        ExactHit { t: self.best.t / self.direction_scale, ..self.best }
    }

    /// Intersects a triangle in float64; keeps the hit if it is the closest that is accepted.
    #[inline(always)]
    fn intersect_exact(
        &mut self,
        instance: u32,
        triangle: u32,
        triangles: &dyn ExactTriangles,
        accepts: impl Fn(&ExactHit) -> bool,
    ) {
        let corners = triangles.corners(instance, triangle);
        let Some(found) = self.ray.intersect(corners) else {
            return;
        };
        let so_far = HitSoFar::new(self.t_min, self.best.t, self.t_error, &self.best);
        if self.ray.precedes(&found, corners, (instance, triangle), &so_far, triangles) {
            let t = if self.any_hit { DONE } else { found.t };
            let hit = ExactHit { t, u: found.u, v: found.v, instance, triangle, normal: found.normal };
            if accepts(&hit) {
                self.t_error = if self.any_hit { 0.0 } else { found.t_error };
                self.best = hit;
            }
        }
    }
}

/// A search along one ray: it visits the triangles that the ray may hit.
pub trait RaySearch {
    fn clipped_ray(&self) -> &ClippedRay;

    /// True if triangles of an instance are of interest.
    #[inline(always)]
    fn accepts_instance(&self, _: u32) -> bool {
        true
    }

    fn visit(&mut self, instance: u32, triangle: u32, triangles: &dyn ExactTriangles);
}

impl RaySearch for ClippedRay {
    #[inline(always)]
    fn clipped_ray(&self) -> &ClippedRay {
        self
    }

    #[inline(always)]
    fn visit(&mut self, instance: u32, triangle: u32, triangles: &dyn ExactTriangles) {
        self.intersect_exact(instance, triangle, triangles, |_| true);
    }
}

/// The search for the closest hit that a filter accepts.
struct FilteredRay<'a> {
    ray: ClippedRay,
    number: usize,
    filter: &'a dyn HitFilter,
}

impl RaySearch for FilteredRay<'_> {
    #[inline(always)]
    fn clipped_ray(&self) -> &ClippedRay {
        &self.ray
    }

    #[inline(always)]
    fn accepts_instance(&self, instance: u32) -> bool {
        self.filter.accepts_instance(self.number, instance)
    }

    #[inline(always)]
    fn visit(&mut self, instance: u32, triangle: u32, triangles: &dyn ExactTriangles) {
        let accepts = |hit: &ExactHit| self.filter.accepts(self.number, hit);
        self.ray.intersect_exact(instance, triangle, triangles, accepts);
    }
}

/// Replaces hits that a filter does not accept by the closest, or any, that it does.
#[inline(always)]
pub fn filter_hits<I: Isa>(
    scene: &Scene,
    rays: &[ExactRay],
    triangles: &dyn ExactTriangles,
    filter: &dyn HitFilter,
    any_hit: bool,
    hits: &mut [ExactHit],
) {
    for (number, (ray, hit)) in rays.iter().zip(hits).enumerate() {
        let counts = || filter.accepts_instance(number, hit.instance) && filter.accepts(number, hit);
        if hit.instance == crate::INVALID_ID || counts() {
            continue;
        }
        *hit = ExactHit::MISS;
        if let Some(mut ray) = ClippedRay::new(scene, ray) {
            ray.any_hit = any_hit;
            let mut search = FilteredRay { ray, number, filter };
            intersect_tlas::<I>(scene, &mut search, triangles);
            *hit = search.ray.to_hit();
        }
    }
}

/// The t up to which boxes must be visited for hits before `t`, from `t_offset`.
#[inline(always)]
pub fn t_max_f32(t: f64, forward: f64) -> f32 {
    if t == DONE {
        return -1.0;
    }
    let limit = t - forward + F64_ERROR * forward.abs();
    (limit as f32).next_up().max(0.0)
}

/// One ray through the TLAS.
#[inline(always)]
pub fn intersect_tlas<I: Isa>(scene: &Scene, search: &mut impl RaySearch, triangles: &dyn ExactTriangles) {
    let ray = search.clipped_ray();
    let start = ray.local_origin.map(|x| x as f32);
    let direction = ray.ray.direction.map(|d| (d * scene.scale) as f32);
    let distance = max_abs(start);
    let slack = 2.0 * scene.box_padding(distance) + ray.origin_error as f32 * 2.0;
    let mut stack = Stack::new();
    let mut at = scene.root;
    if let Some(outer) = TravRay::new(start, direction, &scene.bounds, slack) {
        loop {
            if !at.is_leaf() {
                let node = node(scene.blocks(), at);
                let limit = outer.to_local_t(search.clipped_ray().t_max_f32()).next_up();
                let (into, enter) = intersect_children::<I>(node, &outer, limit);
                let into = <I::F32x8 as Vector>::to_bitmask(into);
                if into != 0 {
                    at = stack.push::<I>(node, enter, into);
                    continue;
                }
            } else {
                let subtree = &scene.subtree_refs[at.index()];
                if search.accepts_instance(subtree.instance) {
                    intersect_subtree::<I>(scene, subtree, search, triangles);
                }
            }
            match stack.pop(0, outer.to_local_t(search.clipped_ray().t_max_f32()).next_up()) {
                Some(next) => at = next,
                None => return,
            }
        }
    }
}

/// One ray in tree coordinates of the mesh.
#[inline(always)]
pub fn to_mesh_space(
    scene: &Scene,
    instance_record: &InstanceRecord,
    (start, direction): ([f64; 3], [f64; 3]),
) -> ([f32; 3], [f32; 3]) {
    let matrix = instance_record.mesh_from_scene.map(|row| row.map(f64::from));
    let turned = |v: [f64; 3], row: usize| (0..3).map(|k| matrix[row][k] * v[k]).sum::<f64>();
    let along = direction.map(|d| d * scene.scale);
    (
        std::array::from_fn(|row| (turned(start, row) + matrix[row][3]) as f32),
        std::array::from_fn(|row| turned(along, row) as f32),
    )
}

/// One ray through a subtree of an instance.
#[inline(always)]
pub fn intersect_subtree<I: Isa>(
    scene: &Scene,
    subtree: &SubtreeRef,
    search: &mut impl RaySearch,
    triangles: &dyn ExactTriangles,
) {
    let ray = search.clipped_ray();
    let instance = subtree.instance;
    let instance_record: &InstanceRecord = &scene.instances[instance as usize];
    let mesh = &*instance_record.bvh;
    let (origin, direction) = to_mesh_space(scene, instance_record, (ray.local_origin, ray.ray.direction));
    let distance = max_abs(ray.local_origin.map(|x| x as f32));
    let off = coordinate_error(scene, instance_record, distance, ray.origin_error);
    let Some(local) = TravRay::new(origin, direction, mesh.bounds(), off) else {
        return;
    };
    let off = off + 8.0 * MACHINE_EPSILON * (max_abs(origin).max(mesh.max_abs_coord()) + mesh.max_abs_coord());
    let mut stack = Stack::new();
    let mut at = subtree.node;
    loop {
        if !at.is_leaf() {
            let node = node(mesh.blocks(), at);
            let (into, enter) =
                intersect_children::<I>(node, &local, local.to_local_t(search.clipped_ray().t_max_f32()).next_up());
            let into = <I::F32x8 as Vector>::to_bitmask(into);
            if into != 0 {
                at = stack.push::<I>(node, enter, into);
                continue;
            }
        } else {
            let leaf = leaf(mesh.blocks(), at);
            let mut near = conservative_candidates::<I>(leaf, &local, off);
            while near != 0 {
                let lane = near.trailing_zeros();
                near &= near - 1;
                let triangle = mesh.prim_id(leaf.first_prim + lane);
                search.visit(instance, triangle, triangles);
            }
        }
        match stack.pop(0, local.to_local_t(search.clipped_ray().t_max_f32()).next_up()) {
            Some(next) => at = next,
            None => return,
        }
    }
}

/// The largest absolute coordinate.
pub fn max_abs(point: [f32; 3]) -> f32 {
    point[0].abs().max(point[1].abs()).max(point[2].abs())
}

/// The error bound of float32 coordinates in the mesh, for rays within `distance` of the scene's origin: ray, matrix
/// and vertices were rounded at the size they have in the scene or in the mesh.
pub fn coordinate_error(scene: &Scene, instance_record: &InstanceRecord, distance: f32, drift: f64) -> f32 {
    instance_record.max_scale * (32.0 * MACHINE_EPSILON * (distance + scene.max_abs_coord) + drift as f32 * 2.0)
        + 8.0 * MACHINE_EPSILON * instance_record.bvh.max_abs_coord()
}

/// Bit i: the ray may hit triangle i if ray and corners are off by at most `off`.
///
/// The shear adds at most the error along its axis, so a sheared corner is off by e = 2 `off`. An edge function x1 y2 -
/// y1 x2 is then off by e (|x1| + |y1| + |x2| + |y2|) + 2 e^2, and by less than that again for rounding, which `off`
/// exceeds by far.
#[inline(always)]
pub fn conservative_candidates<I: Isa>(leaf: &LeafNode, ray: impl RayView, off: f32) -> u32 {
    let [px, py] = shear_vertices::<I>(leaf, ray);
    let size = px.abs().add(py.abs());
    let index = indices::<I>(leaf);
    let (x, y) = (corners::<I>(px, &index), corners::<I>(py, &index));
    let size = corners::<I>(size, &index);
    let e = I::F32x16::splat(4.0 * off);
    let square = I::F32x16::splat(16.0 * off * off);
    let zero = I::F32x16::splat(0.0);
    let u = edge_bounds::<I>(&x, &y, &size, [1, 2], e, square);
    let v = edge_bounds::<I>(&x, &y, &size, [2, 0], e, square);
    let w = edge_bounds::<I>(&x, &y, &size, [0, 1], e, square);
    let inside = <I::F32x16 as Vector>::or(zero.le(u.0.min(v.0).min(w.0)), u.1.max(v.1).max(w.1).le(zero));
    <I::F32x16 as Vector>::to_bitmask(inside) & ((1u32 << leaf.count) - 1)
}

/// The greatest and the least possible value of an edge function.
#[inline(always)]
fn edge_bounds<I: Isa>(
    x: &[I::F32x16; 3],
    y: &[I::F32x16; 3],
    size: &[I::F32x16; 3],
    [a, b]: [usize; 2],
    e: I::F32x16,
    square: I::F32x16,
) -> (I::F32x16, I::F32x16) {
    let value = x[b].mul(y[a]).sub(y[b].mul(x[a]));
    let slack = e.mul(size[a].add(size[b])).add(square);
    (value.add(slack), value.sub(slack))
}
