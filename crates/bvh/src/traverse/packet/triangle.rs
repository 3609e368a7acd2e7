//! The watertight ray-triangle test for packets (S. Woop, C. Benthin and I. Wald, "Watertight Ray/Triangle
//! Intersection", JCGT 2013), one triangle per ray.
//!
//! The ray is sheared to its major axis; the triangle is hit if its three edge functions do not differ in sign. Each
//! edge function is a difference of two rounded products, never fused. For two triangles that share an edge, the test
//! computes the same value with opposite sign, so no ray passes between them; if a value is 0, float64 decides exactly.
//! Front and back faces are hit, and edges count as inside.
//!
//! The test has two stages: edge functions, of one ray and sixteen triangles
//! ([`crate::traverse::triangle::single::edge_test`]) or of one triangle and sixteen rays
//! ([`crate::traverse::packet::triangle_edges`]); then the few remaining triangles, one by one for a single ray
//! ([`crate::traverse::triangle::single::intersect_triangle`]) or one per lane ([`intersect_lanes`]). All functions
//! compute every value by the same operations in the same order, so all return the same hit for a ray and a triangle.

use crate::node::LeafNode;
use crate::simd::{Isa, Vector};
use crate::traverse::packet::Packet;
use crate::traverse::packet::packet_ray::PacketRay;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::packet::soa::load_rays;
use crate::traverse::packet::triangle_edges::PotentialHits;
use crate::traverse::triangle::edge::edge_functions_f64;
use crate::traverse::triangle::single::plane_depth_f64;

/// Intersections of rays with one triangle each; valid in the lanes of `hit`.
pub struct LaneIntersections<V> {
    pub hit: u32,
    /// Indices of the triangles, as bits of floats.
    pub triangle: V,
    pub t: V,
    /// Barycentric weights times `det`. A ray may hit several triangles before the closest one is known; the division
    /// by `det` is done once at the end.
    pub u: V,
    pub v: V,
    pub det: V,
}

/// Intersects the [`Isa::RAY_LANES`] rays of a group with one triangle each, from [`PotentialHits`], at a t of
/// `0..=t_max`. With `ANY_HIT` only `hit` is valid.
#[inline(always)]
pub fn intersect_lanes<I: Isa, const ANY_HIT: bool>(
    leaf: &LeafNode,
    packet: &Packet,
    group: usize,
    potential: &PotentialHits,
) -> LaneIntersections<I::RayVec> {
    let mut hit = potential.hit_lanes::<I>(group);
    let zero = I::RayVec::splat(0.0);
    let start = I::RAY_LANES * (group % (PACKET_SIZE / I::RAY_LANES));
    // SAFETY: a row of 64 words contains the group, as in `load_rays`; the words are moved as floats without
    // arithmetic.
    let triangle = unsafe { I::RayVec::load(potential.triangle.as_ptr().add(start).cast()) };
    let [kx, ky, kz] = packet.axes;
    let [px, py, pz] = gather_triangles::<I>(leaf, packet.axes, triangle);
    let along = |axis: usize| load_rays::<I>(&packet.origin[axis], group);
    let z = subtract(pz, along(kz));
    let scale = load_rays::<I>(&packet.shear[2], group);
    let (enter, leave) = slab_interval::<I>(packet, group, [px, py, z], scale);
    let t_max = load_rays::<I>(&packet.t_max, group);
    // t is clamped to this interval below, so the ray certainly misses if the interval is out of range.
    let soon = <I::RayVec as Vector>::and(enter.le(t_max), zero.le(enter.max(leave)));
    hit &= <I::RayVec as Vector>::to_bitmask(soon);
    let nothing = LaneIntersections { hit: 0, triangle, t: zero, u: zero, v: zero, det: zero };
    if hit == 0 {
        return nothing;
    }
    let (x, y) = (subtract(px, along(kx)), subtract(py, along(ky)));
    let sx = load_rays::<I>(&packet.shear[0], group);
    let sy = load_rays::<I>(&packet.shear[1], group);
    let [ax, bx, cx] = shear_corners(x, sx, z);
    let [ay, by, cy] = shear_corners(y, sy, z);
    let mut edges = [cx.mul(by).sub(cy.mul(bx)), ax.mul(cy).sub(ay.mul(cx)), bx.mul(ay).sub(by.mul(ax))];
    let smallest = edges[0].abs().min(edges[1].abs()).min(edges[2].abs());
    let unsure = <I::RayVec as Vector>::to_bitmask(smallest.eq(zero)) & hit;
    if unsure != 0 {
        hit = resolve_zero_edges::<I>([ax, ay, bx, by, cx, cy], &mut edges, unsure, hit);
    }
    let [u, v, w] = edges;
    if ANY_HIT {
        // An any-hit query does not need t if the whole interval, to which t would be clamped, is within range.
        let sure = <I::RayVec as Vector>::and(zero.le(enter), enter.max(leave).le(t_max));
        if hit & !<I::RayVec as Vector>::to_bitmask(sure) == 0 {
            return LaneIntersections { hit, ..nothing };
        }
    }
    let det = u.add(v).add(w);
    let mut depth = u.mul(z[0]).add(v.mul(z[1])).add(w.mul(z[2])).div(det);
    if leaf.has_slivers() {
        let behind = hit & !<I::RayVec as Vector>::to_bitmask(zero.le(enter));
        if behind != 0 {
            depth = resolve_sliver_depths::<I>(leaf, packet, start, potential, behind, depth);
        }
    }
    let t = depth.mul(scale).min(leave).max(enter);
    let counts = <I::RayVec as Vector>::and(zero.le(t), t.le(t_max));
    LaneIntersections { hit: hit & <I::RayVec as Vector>::to_bitmask(counts), triangle, t, u: v, v: w, det }
}

/// The corners of one triangle per lane, along three axes.
#[inline(always)]
fn gather_triangles<I: Isa>(leaf: &LeafNode, axes: [usize; 3], triangle: I::RayVec) -> [[I::RayVec; 3]; 3] {
    let corner = [
        I::gather_lanes(I::expand_bits(leaf.packed_indices[0]), triangle),
        I::gather_lanes(I::expand_bits(leaf.packed_indices[1]), triangle),
        I::gather_lanes(I::expand_bits(leaf.packed_indices[2]), triangle),
    ];
    [
        gather_corners::<I>(leaf, axes[0], &corner),
        gather_corners::<I>(leaf, axes[1], &corner),
        gather_corners::<I>(leaf, axes[2], &corner),
    ]
}

/// The t at which rays enter and leave the bounds of their triangles, see [`crate::traverse::trav_ray::SLAB_PAD`]. The
/// corners' coordinates along the major axis, which come last, are relative to the origins.
#[inline(always)]
fn slab_interval<I: Isa>(
    packet: &Packet,
    group: usize,
    [px, py, z]: [[I::RayVec; 3]; 3],
    scale: I::RayVec,
) -> (I::RayVec, I::RayVec) {
    let [kx, ky, kz] = packet.axes;
    let (first, last) = near_far_bounds(px, packet.near_rows[kx]);
    let ex = packet.near.t_at_lanes::<I>(kx, group, first);
    let lx = packet.far.t_at_lanes::<I>(kx, group, last);
    let (first, last) = near_far_bounds(py, packet.near_rows[ky]);
    let ey = packet.near.t_at_lanes::<I>(ky, group, first);
    let ly = packet.far.t_at_lanes::<I>(ky, group, last);
    let (first, last) = near_far_bounds(z, packet.near_rows[kz]);
    let (ez, lz) = (first.mul(scale), last.mul(scale));
    (ex.max(ey).max(ez), lx.min(ly).min(lz))
}

/// Replaces the edge functions of the lanes `unsure`, in which one edge function is 0, by float64 results; returns the
/// lanes of `hit` in which the ray still hits.
#[inline(always)]
fn resolve_zero_edges<I: Isa>(corners: [I::RayVec; 6], edges: &mut [I::RayVec; 3], unsure: u32, hit: u32) -> u32 {
    let mut edge_lanes = [[0.0; 16]; 3];
    let mut corner_lanes = [[0.0; 16]; 6];
    for (array, vector) in corner_lanes.iter_mut().zip(corners) {
        // SAFETY: each array contains at least as many floats as the vector.
        unsafe { vector.store(array.as_mut_ptr()) };
    }
    for (array, vector) in edge_lanes.iter_mut().zip(*edges) {
        // SAFETY: each array contains at least as many floats as the vector.
        unsafe { vector.store(array.as_mut_ptr()) };
    }
    let hit = edge_functions_f64_lanes(&corner_lanes, unsure, hit, &mut edge_lanes);
    for (array, vector) in edge_lanes.iter().zip(edges) {
        // SAFETY: each array contains at least as many floats as the vector.
        *vector = unsafe { I::RayVec::load(array.as_ptr()) };
    }
    hit
}

/// Returns the depths; for slivers in the lanes `behind`, they are recomputed in float64.
#[inline(always)]
fn resolve_sliver_depths<I: Isa>(
    leaf: &LeafNode,
    packet: &Packet,
    start: usize,
    potential: &PotentialHits,
    behind: u32,
    depth: I::RayVec,
) -> I::RayVec {
    let mut depths = [0.0; 16];
    // SAFETY: the array contains at least as many floats as the vector.
    unsafe { depth.store(depths.as_mut_ptr()) };
    sliver_depths(leaf, packet, start, potential, behind, &mut depths);
    // SAFETY: as above.
    unsafe { I::RayVec::load(depths.as_ptr()) }
}

/// The corner coordinates of one triangle per lane along an axis; a, b and c are the lanes of its vertices in the leaf.
#[inline(always)]
fn gather_corners<I: Isa>(leaf: &LeafNode, axis: usize, [a, b, c]: &[I::RayVec; 3]) -> [I::RayVec; 3] {
    // SAFETY: each row of `vertices` contains 16 floats.
    let row = unsafe { I::F32x16::load(leaf.vertices[axis].as_ptr()) };
    [I::gather_lanes(row, *a), I::gather_lanes(row, *b), I::gather_lanes(row, *c)]
}

#[inline(always)]
fn subtract<V: Vector>([a, b, c]: [V; 3], origin: V) -> [V; 3] {
    [a.sub(origin), b.sub(origin), c.sub(origin)]
}

#[inline(always)]
fn shear_corners<V: Vector>([a, b, c]: [V; 3], s: V, z: [V; 3]) -> [V; 3] {
    [a.sub(s.mul(z[0])), b.sub(s.mul(z[1])), c.sub(s.mul(z[2]))]
}

/// The coordinates of a triangle's bounds along an axis where rays enter and leave; `near_row` is the row of bounds
/// where rays enter.
#[inline(always)]
fn near_far_bounds<V: Vector>([a, b, c]: [V; 3], near_row: usize) -> (V, V) {
    let (lower, upper) = (a.min(b).min(c), a.max(b).max(c));
    let backwards = V::from_bitmask(0u32.wrapping_sub(near_row as u32 & 1) & 0xffff);
    (V::select(backwards, upper, lower), V::select(backwards, lower, upper))
}

/// Replaces the depths of slivers whose bounds begin behind the ray's origin by depths computed in float64.
#[cold]
#[inline(never)]
fn sliver_depths(
    leaf: &LeafNode,
    packet: &Packet,
    start: usize,
    potential: &PotentialHits,
    behind: u32,
    depths: &mut [f32; 16],
) {
    for lane in (0..16).filter(|lane| behind >> lane & 1 != 0) {
        let i = start + lane;
        let k = potential.triangle[i] as usize;
        if leaf.is_sliver(k) {
            depths[lane] = plane_depth_f64(leaf, k, PacketRay(packet, i), depths[lane]);
        }
    }
}

/// Decides in float64 whether the lanes of `unsure` are hits; returns the lanes of `hit` that remain.
#[cold]
#[inline(never)]
fn edge_functions_f64_lanes(corners: &[[f32; 16]; 6], unsure: u32, mut hit: u32, edges: &mut [[f32; 16]; 3]) -> u32 {
    for lane in (0..16).filter(|lane| unsure >> lane & 1 != 0) {
        match edge_functions_f64(corners.map(|row| row[lane])) {
            Some(decided) => {
                for (edge, value) in edges.iter_mut().zip(decided) {
                    edge[lane] = value;
                }
            }
            None => hit &= !(1 << lane),
        }
    }
    hit
}
