//! Builds a packet: one pass over the rays in SoA, whose extremes decide whether the rays are coherent.

use crate::aabb::Aabb;
use crate::limits::{MACHINE_EPSILON, MAX_COORD};
use crate::ray::Ray;
use crate::simd::{Isa, Vector};
use crate::traverse::packet::Packet;
use crate::traverse::packet::frustum::Apex;
use crate::traverse::packet::soa::{PACKET_SIZE, min_max, store, to_bitmask};
use crate::traverse::trav_ray::{MAX_ORIGIN, MAX_RECIPROCAL, ORIGIN_PAD, RELATIVE_PAD, SLAB_PAD};

/// Parameters of a packet's setup.
struct SetupContext<'a> {
    /// The rays; entries after the last ray repeat the first ray.
    rays: &'a [Ray; PACKET_SIZE],
    /// The bounds of the tree, and their largest coordinate.
    bounds: &'a Aabb,
    max_abs_coord: f32,
    /// Additional padding of slabs, as a fraction of the largest coordinate of ray and tree.
    pad: f32,
    apex: Apex,
    apex_point: [f32; 3],
}

/// Results of a packet's setup for each lane, combined over all groups.
struct LaneTotals<V: Vector> {
    /// NaN if a component of an origin or a direction is NaN or infinite.
    sum: V,
    /// Lanes whose t_max is at least 0 in every group.
    ahead: V::Mask,
    /// For each axis, the maximum amounts of t by which a ray crosses a plane earlier and later than a ray from the
    /// apex.
    early: [V; 3],
    late: [V; 3],
}

impl Packet {
    /// Sets up at most 64 rays for a tree; returns false if the rays are not coherent, or if any ray is not finite or
    /// is parallel to an axis. Slabs get additional padding of `pad` times the largest coordinate of ray and tree.
    #[inline(always)]
    pub fn setup<I: Isa>(&mut self, rays: &[Ray], bounds: &Aabb, pad: f32, apex: Apex) -> bool {
        let n = rays.len();
        debug_assert!(0 < n && n <= PACKET_SIZE);
        let mut padded;
        let rays: &[Ray; PACKET_SIZE] = match rays.try_into() {
            Ok(rays) => rays,
            Err(_) => {
                padded = [rays[0]; PACKET_SIZE];
                padded[..n].copy_from_slice(rays);
                &padded
            }
        };
        self.active = u64::MAX >> (PACKET_SIZE - n);
        let first = &rays[0];
        let context = SetupContext {
            rays,
            bounds,
            max_abs_coord: bounds.max_abs_coord(),
            pad,
            apex,
            apex_point: std::array::from_fn(|axis| match apex {
                Apex::Origin => first.origin[axis],
                Apex::Target => first.origin[axis] + first.direction[axis] * first.t_max,
            }),
        };
        // The generic function is compiled twice, because a common origin requires much less work.
        let coherent = match apex == Apex::Origin && have_common_origin::<I>(rays) {
            true => self.setup_lanes::<I, true>(&context),
            false => self.setup_lanes::<I, false>(&context),
        };
        self.t_max[n..].fill(0.0);
        coherent
    }

    /// Sets up all lanes and the frustum. `COMMON_ORIGIN` is true if the rays start at one point.
    #[inline(always)]
    fn setup_lanes<I: Isa, const COMMON_ORIGIN: bool>(&mut self, context: &SetupContext) -> bool {
        let first = &context.rays[0];
        self.setup_axes(first.direction);
        let groups = (PACKET_SIZE - self.active.leading_zeros() as usize).div_ceil(16);
        let zero = I::F32x16::splat(0.0);
        let mut totals = LaneTotals { sum: zero, ahead: zero.eq(zero), early: [zero; 3], late: [zero; 3] };
        for g in 0..groups {
            self.setup_group::<I, COMMON_ORIGIN>(context, g, &mut totals);
        }
        self.shear_range = [min_max::<I>(&self.shear[0], groups), min_max::<I>(&self.shear[1], groups)];
        let ranges = [
            min_max::<I>(&self.reciprocal[0], groups),
            min_max::<I>(&self.reciprocal[1], groups),
            min_max::<I>(&self.reciprocal[2], groups),
        ];
        self.origin_range = if COMMON_ORIGIN {
            first.origin.map(|x| [x, x])
        } else {
            [
                min_max::<I>(&self.origin[0], groups),
                min_max::<I>(&self.origin[1], groups),
                min_max::<I>(&self.origin[2], groups),
            ]
        };
        let finite = to_bitmask::<I>(totals.sum.mul(zero).eq(zero)) & to_bitmask::<I>(totals.ahead) == 0xffff;
        let coherent = finite && self.is_coherent(context, &ranges);
        if coherent {
            self.setup_frustum::<I, COMMON_ORIGIN>(context, &ranges, &totals);
        }
        coherent
    }

    /// Sets the major axis and the signs of the first ray, which all other rays must share.
    #[inline(always)]
    fn setup_axes(&mut self, direction: [f32; 3]) {
        let size = direction.map(f32::abs);
        let z = if size[0] >= size[1] && size[0] >= size[2] {
            0
        } else if size[1] >= size[2] {
            1
        } else {
            2
        };
        self.axes = [[1, 2, 0][z], [2, 0, 1][z], z];
        self.near_rows = std::array::from_fn(|axis| 2 * axis + usize::from(direction[axis] < 0.0));
    }

    /// Sets up the sixteen rays of a group, as [`crate::traverse::trav_ray::TravRay::setup`] does for one ray.
    #[inline(always)]
    fn setup_group<I: Isa, const COMMON_ORIGIN: bool>(
        &mut self,
        context: &SetupContext,
        g: usize,
        totals: &mut LaneTotals<I::F32x16>,
    ) {
        let &SetupContext { rays, bounds, pad, .. } = context;
        let [x, y, z] = self.axes;
        let (zero, one) = (I::F32x16::splat(0.0), I::F32x16::splat(1.0));
        let from: [*const f32; 16] = std::array::from_fn(|i| (&raw const rays[16 * g + i]).cast());
        // SAFETY: a ray is seven floats, of which the last four are read here: direction and t_max.
        let [dx, dy, dz, t] = unsafe { I::load_transposed(from.map(|ray| ray.wrapping_add(3))) };
        let o = if COMMON_ORIGIN {
            rays[0].origin.map(I::F32x16::splat)
        } else {
            // SAFETY: a ray is seven floats, of which the first four are read here; the fourth, a component of the
            // direction, is not used.
            let [x, y, z, _] = unsafe { I::load_transposed(from) };
            [x, y, z]
        };
        let d = [dx, dy, dz];
        store::<I>(&mut self.t_max, g, t);
        totals.ahead = <I::F32x16 as Vector>::and(totals.ahead, zero.le(t));
        totals.sum = totals.sum.add(dx.add(dy).add(dz));
        if !COMMON_ORIGIN {
            totals.sum = totals.sum.add(o[0].add(o[1]).add(o[2]));
        }
        let main = one.div(d[z]);
        store::<I>(&mut self.shear[0], g, d[x].div(d[z]));
        store::<I>(&mut self.shear[1], g, d[y].div(d[z]));
        store::<I>(&mut self.shear[2], g, main);
        // The value T in the documentation of [`SLAB_PAD`]: no triangle has a larger t.
        let above = I::F32x16::splat(bounds.upper[z]).sub(o[z]);
        let below = o[z].sub(I::F32x16::splat(bounds.lower[z]));
        let end = above.max(below).mul(main.abs());
        let end_pad = end.mul(I::F32x16::splat(SLAB_PAD));
        for axis in 0..3 {
            let reciprocal = match axis == z {
                true => main,
                false => one.div(d[axis]),
            };
            let mut wide = o[axis].mul(reciprocal).abs().mul(I::F32x16::splat(ORIGIN_PAD));
            if pad != 0.0 {
                let distance = o[0].abs().max(o[1].abs()).max(o[2].abs());
                let padding = distance.add(I::F32x16::splat(context.max_abs_coord)).mul(I::F32x16::splat(pad));
                wide = wide.add(padding.mul(reciprocal.abs()));
            }
            wide = wide.add(end_pad);
            let near = reciprocal.mul(I::F32x16::splat(1.0 - RELATIVE_PAD));
            let far = reciprocal.mul(I::F32x16::splat(1.0 + RELATIVE_PAD));
            store::<I>(&mut self.origin[axis], g, o[axis]);
            store::<I>(&mut self.reciprocal[axis], g, reciprocal);
            store::<I>(&mut self.near.reciprocal[axis], g, near);
            store::<I>(&mut self.near.offset[axis], g, o[axis].mul(near).add(wide));
            store::<I>(&mut self.far.reciprocal[axis], g, far);
            store::<I>(&mut self.far.offset[axis], g, o[axis].mul(far).sub(wide));
            if !COMMON_ORIGIN {
                // A ray from `p` crosses the plane b at t = (b - p) r = (b - apex) r - (p - apex) r.
                let apex = I::F32x16::splat(context.apex_point[axis]);
                let aside = match context.apex {
                    Apex::Origin => o[axis].sub(apex),
                    Apex::Target => apex.sub(o[axis].add(d[axis].mul(t))),
                }
                .mul(reciprocal);
                totals.early[axis] = totals.early[axis].max(aside);
                totals.late[axis] = totals.late[axis].min(aside);
            }
        }
    }

    /// True if all rays have the same major axis and the same sign per axis, none is parallel to an axis, and all are
    /// in range.
    #[inline(always)]
    fn is_coherent(&self, context: &SetupContext, ranges: &[[f32; 2]; 3]) -> bool {
        let [x, y, z] = self.axes;
        let [sx, sy] = self.shear_range;
        is_minor_axis(sx, x < z)
            && is_minor_axis(sy, y < z)
            && min_reciprocal(ranges[z]) >= 1.0 / MAX_COORD
            && max_reciprocal(ranges[z]) <= MAX_COORD
            && ranges.iter().zip(&context.rays[0].direction).all(|(range, d)| {
                (if *d < 0.0 { range[1] < 0.0 } else { range[0] > 0.0 }) && max_reciprocal(*range) <= MAX_RECIPROCAL
            })
            && self.max_abs_origin() <= MAX_ORIGIN
            && max_abs(&context.apex_point) <= MAX_ORIGIN
    }

    /// The frustum around all rays, padded by at least as much as the slabs of each ray.
    #[inline(always)]
    fn setup_frustum<I: Isa, const COMMON_ORIGIN: bool>(
        &mut self,
        context: &SetupContext,
        ranges: &[[f32; 2]; 3],
        totals: &LaneTotals<I::F32x16>,
    ) {
        let (z, apex_point) = (self.axes[2], &context.apex_point);
        let slack = (self.max_abs_origin() + context.max_abs_coord + max_abs(apex_point)) * context.pad * 1.5;
        let end = context.bounds.max_distance_along(z, self.origin_range[z]) * max_reciprocal(ranges[z]);
        let backwards = context.apex == Apex::Target;
        for axis in 0..3 {
            let [least, greatest] = self.origin_range[axis];
            // For rays that do not start at the apex, the frustum's t has three more rounding errors than the t of the
            // rays' own slabs.
            let farthest = least.abs().max(greatest.abs());
            let off = if backwards { farthest + apex_point[axis].abs() } else { greatest - least };
            let range = ranges[axis];
            let wide = 32.0 * MACHINE_EPSILON * end
                + ((4.0 * farthest + 16.0 * off) * MACHINE_EPSILON + slack) * max_reciprocal(range);
            self.frustum.apex[axis] = apex_point[axis];
            self.frustum.reciprocal[axis] = if backwards { [-range[1], -range[0]] } else { range };
            let (early, late) = match COMMON_ORIGIN {
                true => (0.0, 0.0),
                false => (totals.early[axis].reduce_max(), totals.late[axis].reduce_min()),
            };
            self.frustum.t_near_pad[axis] = early + wide;
            self.frustum.t_far_pad[axis] = wide - late;
            self.frustum.near_rows[axis] = self.near_rows[axis] ^ usize::from(backwards);
        }
    }
}

/// The largest absolute value in a range of reciprocals that have one sign.
#[inline(always)]
fn max_reciprocal([least, greatest]: [f32; 2]) -> f32 {
    if least < 0.0 { -least } else { greatest }
}

/// The smallest absolute value in a range of reciprocals that have one sign.
#[inline(always)]
fn min_reciprocal([least, greatest]: [f32; 2]) -> f32 {
    if least < 0.0 { -greatest } else { least }
}

/// True if all directions have a smaller component along an axis than along the major axis, according to the range of
/// the quotients of both components. Rounding does not change the result. If the components are equal, the first axis
/// is the major axis, as for a single ray.
#[inline(always)]
fn is_minor_axis([least, greatest]: [f32; 2], is_before_main: bool) -> bool {
    match is_before_main {
        true => -1.0 < least && greatest < 1.0,
        false => -1.0 <= least && greatest <= 1.0,
    }
}

/// The largest absolute value of a coordinate.
#[inline(always)]
fn max_abs(point: &[f32; 3]) -> f32 {
    let [x, y, z] = point.map(f32::abs);
    x.max(y).max(z)
}

/// Masks for sixteen rays that are read as seven vectors: the lanes of each vector that do not belong to an origin.
const NON_ORIGIN_LANES: [u32; 7] = {
    let mut lanes = [0; 7];
    let mut i = 0;
    while i < 16 * 7 {
        lanes[i / 16] |= ((i % 7 > 2) as u32) << (i % 16);
        i += 1;
    }
    lanes
};

/// True if all rays start at one point. Compares the rays as they are stored, without a transposition.
#[inline(always)]
fn have_common_origin<I: Isa>(rays: &[Ray; PACKET_SIZE]) -> bool {
    let first = rays[0].origin;
    if first != rays[PACKET_SIZE / 2].origin || first != rays[PACKET_SIZE - 1].origin {
        return false;
    }
    let from = std::array::from_fn(|i| (&raw const rays[i]).cast());
    // SAFETY: a ray consists of seven floats.
    let [x, y, z, _] = unsafe { I::load_transposed(from) };
    let (no, yes) = (I::F32x16::splat(0.0), I::F32x16::splat(1.0));
    let mut same = I::F32x16::select(x.eq(I::F32x16::splat(first[0])), yes, no);
    same = I::F32x16::select(y.eq(I::F32x16::splat(first[1])), same, no);
    same = I::F32x16::select(z.eq(I::F32x16::splat(first[2])), same, no);
    let floats: *const f32 = rays.as_ptr().cast();
    for (i, others) in NON_ORIGIN_LANES.into_iter().enumerate() {
        // SAFETY: sixteen rays consist of seven times sixteen floats.
        let start = unsafe { I::F32x16::load(floats.add(16 * i)) };
        let mut these = yes;
        for group in 1..PACKET_SIZE / 16 {
            // SAFETY: as above, in a group of sixteen rays.
            let next = unsafe { I::F32x16::load(floats.add(16 * (7 * group + i))) };
            these = I::F32x16::select(next.eq(start), these, no);
        }
        these = I::F32x16::select(<I::F32x16 as Vector>::from_bitmask(others), yes, these);
        same = same.min(these);
    }
    to_bitmask::<I>(same.eq(yes)) == 0xffff
}
