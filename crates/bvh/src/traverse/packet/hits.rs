//! Closest hits of the rays of a packet in a mesh.

use crate::blas::Bvh;
use crate::limits::MAX_TRIANGLES;
use crate::node::LeafNode;
use crate::ray::{Hit, INVALID_ID};
use crate::scene::instance_ranges::InstanceRanges;
use crate::simd::{F32x4, Isa, Vector};
use crate::traverse::near_ties::{absolute_lanes, widen_lanes};
use crate::traverse::packet::Packet;
use crate::traverse::packet::soa::{PACKET_SIZE, load, load_rays, store, store_masked};
use crate::traverse::packet::triangle::{LaneIntersections, intersect_lanes};
use crate::traverse::packet::triangle_edges::PotentialHits;
use crate::traverse::single::closest_hit::NO_PRIM;

/// The closest hits of the rays of a packet in a mesh.
pub struct PacketHits<'a> {
    pub t: [f32; PACKET_SIZE],
    /// Positions of the hit triangles in the primitive ids of the mesh, as bits of floats.
    pub prim_index: [f32; PACKET_SIZE],
    /// Barycentric weights times `det`, until [`PacketHits::normalize_barycentrics`] divides them.
    pub u: [f32; PACKET_SIZE],
    pub v: [f32; PACKET_SIZE],
    det: [f32; PACKET_SIZE],
    /// The instances of the mesh in a flattened scene; otherwise `None`.
    ranges: Option<&'a InstanceRanges>,
    /// Bit i: ray i may have hit coplanar surfaces of two instances.
    pub contested: u64,
}

impl<'a> PacketHits<'a> {
    pub const MISS: PacketHits<'a> = PacketHits {
        t: [f32::INFINITY; PACKET_SIZE],
        prim_index: [f32::from_bits(NO_PRIM); PACKET_SIZE],
        u: [0.0; PACKET_SIZE],
        v: [0.0; PACKET_SIZE],
        det: [1.0; PACKET_SIZE],
        ranges: None,
        contested: 0,
    };

    /// Creates hits that are all misses; `ranges` contains the instances of a flattened scene.
    #[inline(always)]
    pub fn new(ranges: Option<&'a InstanceRanges>) -> PacketHits<'a> {
        PacketHits { ranges, ..Self::MISS }
    }
}

/// Intersects a leaf; returns the rays whose hit became closer. `COMMON_ORIGIN` has the same meaning as in
/// [`PotentialHits::test_edges`].
#[inline(always)]
pub fn closest_in_leaf<I: Isa, const COMMON_ORIGIN: bool>(
    mesh: &Bvh,
    leaf: &LeafNode,
    active: u64,
    packet: &mut Packet,
    nearest: &mut PacketHits,
    potential: &mut PotentialHits,
) -> u64 {
    let mut closer = 0;
    potential.test_edges::<I, COMMON_ORIGIN>(leaf, active, packet);
    while potential.hit_mask != 0 {
        let mut groups = potential.active_groups::<I>();
        while groups != 0 {
            let group = groups.trailing_zeros() as usize;
            groups &= groups - 1;
            let found = intersect_lanes::<I, false>(leaf, packet, group, potential);
            let first = nearest.merge::<I>(mesh, leaf, found, group, packet);
            closer |= u64::from(first) << (I::RAY_LANES * group);
        }
        potential.next_triangle();
    }
    if closer != 0 {
        mesh.prefetch_prim_id::<I>(leaf.first_prim);
    }
    closer
}

const _: () = assert!(MAX_TRIANGLES < f32::INFINITY.to_bits() as usize);

impl PacketHits<'_> {
    /// Divides the barycentric weights by the determinant, once for the final hits.
    #[inline(always)]
    pub fn normalize_barycentrics<I: Isa>(&mut self) {
        for group in 0..PACKET_SIZE / 16 {
            let det = load::<I>(&self.det, group);
            let u = load::<I>(&self.u, group).div(det);
            let v = load::<I>(&self.v, group).div(det);
            store::<I>(&mut self.u, group, u);
            store::<I>(&mut self.v, group, v);
        }
    }

    /// Writes the hits of a full packet, four at a time and branch-free, because misses are unpredictable.
    #[inline(always)]
    pub fn scatter_hits<I: Isa>(&self, mesh: &Bvh, instance: u32, hits: &mut [Hit; PACKET_SIZE]) {
        let mut instances = [0.0; PACKET_SIZE];
        let [here, nowhere] = [instance, INVALID_ID].map(|id| I::F32x16::splat(f32::from_bits(id)));
        for group in 0..PACKET_SIZE / 16 {
            let prim = load::<I>(&self.prim_index, group);
            // Interpreted as a float, `NO_PRIM` is NaN. No valid triangle index is large enough to be NaN.
            let found = prim.eq(prim);
            store::<I>(&mut instances, group, I::F32x16::select(found, here, nowhere));
        }
        for (four, hits) in hits.chunks_exact_mut(4).enumerate() {
            let columns = [&self.t, &self.u, &self.v, &instances];
            let columns = columns.map(|row| F32x4::new(std::array::from_fn(|i| row[4 * four + i])));
            let rows = F32x4::transpose(columns);
            for (i, (hit, row)) in hits.iter_mut().zip(rows).enumerate() {
                // SAFETY: a hit begins with four words: t, u, v and the instance.
                unsafe { (&raw mut *hit).cast::<[f32; 4]>().write(row.array()) };
                // All bits of a missing id are set.
                let prim = self.prim_index[4 * four + i].to_bits();
                let missed = u32::from(prim == NO_PRIM).wrapping_neg();
                hit.triangle = mesh.prim_id(prim & !missed) | missed;
            }
        }
    }

    /// Merges new intersections of a group into the hits: an intersection that comes before the current hit by (t, id)
    /// replaces it. Returns the lanes of the replaced hits.
    #[inline(always)]
    fn merge<I: Isa>(
        &mut self,
        mesh: &Bvh,
        leaf: &LeafNode,
        found: LaneIntersections<I::RayVec>,
        group: usize,
        packet: &mut Packet,
    ) -> u32 {
        let LaneIntersections { hit, t, u, v, det, .. } = found;
        let limit = load_rays::<I>(&packet.t_max, group);
        let absolute = absolute_lanes::<I>(packet.tie_width, load_rays::<I>(&packet.shear[2], group));
        let wide = widen_lanes(t, absolute);
        let prim = I::add_u32_bits(found.triangle, leaf.first_prim);
        let ties = <I::RayVec as Vector>::to_bitmask(limit.le(widen_lanes(wide, absolute))) & hit;
        let mut first = hit & !ties;
        if ties != 0 {
            first |= self.resolve_ties::<I>(mesh, (t, prim), group, ties);
        }
        let lanes = <I::RayVec as Vector>::from_bitmask(first);
        store_masked::<I>(&mut packet.t_max, group, lanes, wide);
        store_masked::<I>(&mut self.t, group, lanes, t);
        store_masked::<I>(&mut self.u, group, lanes, u);
        store_masked::<I>(&mut self.v, group, lanes, v);
        store_masked::<I>(&mut self.det, group, lanes, det);
        store_masked::<I>(&mut self.prim_index, group, lanes, prim);
        first
    }

    /// `ties` are the lanes whose two hits have nearly equal t. Returns the lanes of `ties` in which the new triangle
    /// comes first by (t, id), or in which the ray had no hit. Marks rays whose two hits are on different instances.
    #[cold]
    #[inline(never)]
    fn resolve_ties<I: Isa>(&mut self, mesh: &Bvh, (t, prim): (I::RayVec, I::RayVec), group: usize, ties: u32) -> u32 {
        let (mut times, mut prims) = ([0.0; 16], [0u32; 16]);
        // SAFETY: the arrays contain at least as many words as a vector; words that are not floats are only moved.
        unsafe {
            t.store(times.as_mut_ptr());
            prim.store(prims.as_mut_ptr().cast());
        }
        let mut first = 0;
        for lane in (0..16).filter(|lane| ties >> lane & 1 != 0) {
            let i = I::RAY_LANES * group + lane;
            let known = self.prim_index[i].to_bits();
            if known == NO_PRIM {
                first |= 1 << lane;
                continue;
            }
            let (found, known) = (mesh.prim_id(prims[lane]), mesh.prim_id(known));
            first |= u32::from((times[lane], found) < (self.t[i], known)) << lane;
            if let Some(ranges) = self.ranges {
                self.contested |= u64::from(ranges.locate(found).0 != ranges.locate(known).0) << i;
            }
        }
        first
    }
}
