//! Closest hits of the rays of a packet in one subtree, as far as float32 determines them: the counterpart of
//! [`crate::traverse::exact::single::HitSearch`] for sixteen rays at a time.

use crate::limits::MACHINE_EPSILON;
use crate::node::LeafNode;
use crate::simd::{Isa, Vector};
use crate::traverse::exact::leaf::{MAX_T_WIDTH, T_ERROR};
use crate::traverse::exact::ray_state::Decision;
use crate::traverse::exact::ties::{RELATIVE_WIDTH, TieWindow};
use crate::traverse::packet::Packet;
use crate::traverse::packet::soa::{PACKET_SIZE, load, store};
use crate::traverse::triangle::edge::corner_lanes;

/// Factor by which upper bounds are multiplied; it exceeds the rounding errors of a few operations.
const ROUNDED_UP: f32 = 1.0 + 16.0 * MACHINE_EPSILON;

/// A row with one value per lane.
pub type LaneRow = [f32; PACKET_SIZE];

/// The closest hits so far, one per lane.
#[repr(C, align(64))]
pub struct LaneHits {
    /// Bounds of t of each hit, or of the end of the ray.
    pub t: [LaneRow; 2],
    /// For each lane of `pending`, the triangle's position in the primitive ids of the mesh, as bits of a float.
    prim: LaneRow,
    /// Lanes with pending hits: the triangle and the bounds of t are known, but the intersection has not been
    /// computed.
    pub pending: u64,
    /// True if any hit is sufficient.
    any_hit: bool,
    /// Width of the range of t in which hits may tie, as two terms: a fraction of t, and the width at t = 0.
    tie: [f32; 2],
    /// Width of the range of t behind a hit in which boxes are still visited, as the same two terms.
    behind: [f32; 2],
}

/// The lanes of a packet in which float32 accepts a triangle, and the lanes in which float64 must decide.
pub struct LaneDecisions {
    pub accepted: u64,
    pub unknown: u64,
}

impl LaneHits {
    /// Creates the state without hits; the caller must set `t`.
    #[inline(always)]
    pub fn new(ties: &TieWindow, any_hit: bool) -> LaneHits {
        let may_tie = ties.may_exist && !any_hit;
        let width = [RELATIVE_WIDTH as f32, ties.width(0.0) as f32 * ROUNDED_UP];
        LaneHits {
            t: [[0.0; PACKET_SIZE]; 2],
            prim: [0.0; PACKET_SIZE],
            pending: 0,
            any_hit,
            tie: if may_tie { width.map(|width| 2.0 * ROUNDED_UP * width) } else { [0.0; 2] },
            behind: [1.0 + width[0] + 32.0 * MACHINE_EPSILON, width[1] * ROUNDED_UP + f32::MIN_POSITIVE],
        }
    }

    /// For a pending hit, the triangle's position in the primitive ids of the mesh.
    #[inline(always)]
    pub fn prim_index(&self, lane: usize) -> u32 {
        self.prim[lane & (PACKET_SIZE - 1)].to_bits()
    }

    /// Decides about a triangle that the ray of a lane may hit within these bounds of t.
    #[inline(always)]
    pub fn decide(&self, lane: usize, [least, greatest]: [f32; 2], is_sure: bool) -> Decision {
        let lane = lane & (PACKET_SIZE - 1);
        let farthest = if least.abs() > greatest.abs() { least.abs() } else { greatest.abs() };
        let tie = farthest * self.tie[0] + self.tie[1];
        if greatest < 0.0 || least > self.t[1][lane] + tie {
            return Decision::Rejected;
        }
        let is_closest = least > 0.0 && greatest + tie < self.t[0][lane];
        if is_sure && is_closest { Decision::Accepted } else { Decision::Unknown }
    }

    /// Makes an accepted triangle the hit of a lane.
    #[inline(always)]
    pub fn accept(&mut self, lane: usize, prim: u32, t: [f32; 2], packet: &mut Packet) {
        let i = lane & (PACKET_SIZE - 1);
        let end = if self.any_hit { f32::NEG_INFINITY } else { t[1] };
        self.t[0][i] = if self.any_hit { end } else { t[0] };
        self.t[1][i] = end;
        self.prim[i] = f32::from_bits(prim);
        self.pending |= 1 << i;
        packet.t_max[i] = if self.any_hit { -1.0 } else { end * self.behind[0] + self.behind[1] };
    }

    /// Tests triangle `k` of a leaf against the rays `active`, and makes it the hit of
    /// each lane in which it is certainly the closest.
    #[inline(always)]
    pub fn test_triangle<I: Isa>(
        &mut self,
        leaf: &LeafNode,
        k: u32,
        active: u64,
        off: f32,
        packet: &mut Packet,
    ) -> LaneDecisions {
        let [a, b, c] = corner_lanes(leaf, k as usize & 15);
        let [kx, ky, kz] = packet.axes;
        let (vx, vy, vz) = (&leaf.vertices[kx], &leaf.vertices[ky], &leaf.vertices[kz]);
        let mut decisions = LaneDecisions { accepted: 0, unknown: 0 };
        for group in 0..PACKET_SIZE / 16 {
            let lanes = (active >> (16 * group)) as u32 & 0xffff;
            if lanes == 0 {
                continue;
            }
            let (ox, oy) = (load::<I>(&packet.origin[kx], group), load::<I>(&packet.origin[ky], group));
            let oz = load::<I>(&packet.origin[kz], group);
            let (sx, sy) = (load::<I>(&packet.shear[0], group), load::<I>(&packet.shear[1], group));
            let za = I::F32x16::splat(vz[a]).sub(oz);
            let zb = I::F32x16::splat(vz[b]).sub(oz);
            let zc = I::F32x16::splat(vz[c]).sub(oz);
            let ax = I::F32x16::splat(vx[a]).sub(ox).sub(sx.mul(za));
            let ay = I::F32x16::splat(vy[a]).sub(oy).sub(sy.mul(za));
            let bx = I::F32x16::splat(vx[b]).sub(ox).sub(sx.mul(zb));
            let by = I::F32x16::splat(vy[b]).sub(oy).sub(sy.mul(zb));
            let cx = I::F32x16::splat(vx[c]).sub(ox).sub(sx.mul(zc));
            let cy = I::F32x16::splat(vy[c]).sub(oy).sub(sy.mul(zc));
            let u = cx.mul(by).sub(cy.mul(bx));
            let v = ax.mul(cy).sub(ay.mul(cx));
            let w = bx.mul(ay).sub(by.mul(ax));
            let farthest = ax.abs().add(ay.abs()).max(bx.abs().add(by.abs())).max(cx.abs().add(cy.abs()));
            let slack = farthest.mul(I::F32x16::splat(8.0 * off)).add(I::F32x16::splat(16.0 * off * off));
            let zero = I::F32x16::splat(0.0);
            let (least, greatest) = (u.min(v).min(w), u.max(v).max(w));
            let near = <I::F32x16 as Vector>::or(zero.sub(slack).le(least), greatest.le(slack));
            let near = <I::F32x16 as Vector>::to_bitmask(near) & lanes;
            if near == 0 {
                continue;
            }
            let above = slack.mul(I::F32x16::splat(ROUNDED_UP));
            let sure = <I::F32x16 as Vector>::or(above.le(least), greatest.le(zero.sub(above)));
            let scale = load::<I>(&packet.shear[2], group);
            let (ta, tb, tc) = (za.mul(scale), zb.mul(scale), zc.mul(scale));
            let [t_least, t_greatest] =
                t_range_lanes::<I>([u, v, w], [ta, tb, tc], slack, (sure, near), (off, scale.abs()));
            let tie = t_least.abs().max(t_greatest.abs()).mul(I::F32x16::splat(self.tie[0]));
            let tie = tie.add(I::F32x16::splat(self.tie[1]));
            let (known_least, known_greatest) = (load::<I>(&self.t[0], group), load::<I>(&self.t[1], group));
            // If a bound is NaN, float64 decides.
            let end = known_greatest.add(tie);
            let behind = !<I::F32x16 as Vector>::to_bitmask(t_least.le(end)) & finite::<I>(t_least, end);
            let before = !<I::F32x16 as Vector>::to_bitmask(zero.le(t_greatest)) & finite::<I>(t_greatest, zero);
            let ahead = I::F32x16::splat(f32::MIN_POSITIVE).le(t_least);
            let closest = t_greatest.add(tie).le(known_least.mul(I::F32x16::splat(2.0 - ROUNDED_UP)));
            let taken = <I::F32x16 as Vector>::and(sure, <I::F32x16 as Vector>::and(ahead, closest));
            let taken = <I::F32x16 as Vector>::to_bitmask(taken) & near;
            decisions.unknown |= u64::from(near & !taken & !behind & !before) << (16 * group);
            if taken == 0 {
                continue;
            }
            decisions.accepted |= u64::from(taken) << (16 * group);
            let taken = <I::F32x16 as Vector>::from_bitmask(taken);
            let (mut ends, mut limit) = ([t_least, t_greatest], t_greatest.mul(I::F32x16::splat(self.behind[0])));
            limit = limit.add(I::F32x16::splat(self.behind[1]));
            if self.any_hit {
                ends = [I::F32x16::splat(f32::NEG_INFINITY), I::F32x16::splat(f32::NEG_INFINITY)];
                limit = I::F32x16::splat(-1.0);
            }
            let prim = I::F32x16::splat(f32::from_bits(leaf.first_prim + k));
            store::<I>(&mut self.t[0], group, I::F32x16::select(taken, ends[0], known_least));
            store::<I>(&mut self.t[1], group, I::F32x16::select(taken, ends[1], known_greatest));
            let (known_prim, known_limit) = (load::<I>(&self.prim, group), load::<I>(&packet.t_max, group));
            store::<I>(&mut self.prim, group, I::F32x16::select(taken, prim, known_prim));
            store::<I>(&mut packet.t_max, group, I::F32x16::select(taken, limit, known_limit));
        }
        self.pending |= decisions.accepted;
        decisions
    }
}

/// Same as [`crate::traverse::exact::leaf::t_range`] for sixteen rays and one triangle, from the edge functions and the
/// t of the corners. The lanes of `sure` certainly pass the triangle; the bounds are needed in the lanes of `near`.
#[inline(always)]
fn t_range_lanes<I: Isa>(
    [u, v, w]: [I::F32x16; 3],
    [ta, tb, tc]: [I::F32x16; 3],
    slack: I::F32x16,
    (sure, near): (<I::F32x16 as Vector>::Mask, u32),
    (off, scale): (f32, I::F32x16),
) -> [I::F32x16; 2] {
    let (first, last) = (ta.min(tb).min(tc), ta.max(tb).max(tc));
    let (mut least, mut greatest) = (first, last);
    let wide = last.abs().mul(I::F32x16::splat(MAX_T_WIDTH)).le(last.sub(first));
    let wide = <I::F32x16 as Vector>::and(sure, wide);
    if <I::F32x16 as Vector>::to_bitmask(wide) & near != 0 {
        let reciprocal = I::F32x16::splat(1.0).div(u.add(v).add(w));
        let t = u.mul(ta).add(v.mul(tb)).add(w.mul(tc)).mul(reciprocal);
        let error = slack.mul(I::F32x16::splat(6.0)).mul(reciprocal.abs()).mul(last.sub(first));
        let error = error.add(first.abs().max(last.abs()).mul(I::F32x16::splat(16.0 * MACHINE_EPSILON)));
        least = I::F32x16::select(wide, t.sub(error).max(first), first);
        greatest = I::F32x16::select(wide, t.add(error).min(last), last);
    }
    let pad = scale.mul(I::F32x16::splat(2.0 * off));
    let least = least.sub(least.abs().mul(I::F32x16::splat(T_ERROR))).sub(pad);
    [least, greatest.add(greatest.abs().mul(I::F32x16::splat(T_ERROR))).add(pad)]
}

/// Bit i: lane i is not NaN in either vector.
#[inline(always)]
fn finite<I: Isa>(a: I::F32x16, b: I::F32x16) -> u32 {
    <I::F32x16 as Vector>::to_bitmask(<I::F32x16 as Vector>::and(a.eq(a), b.eq(b)))
}
