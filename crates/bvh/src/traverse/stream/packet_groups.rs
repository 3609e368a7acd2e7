//! Groups of the rays of a chunk by direction octant and major axis, one packet each (compare J. Tsakok, "Faster
//! Incoherent Rays: Multi-BVH Ray Stream Tracing", HPG 2009).

use crate::ray::Ray;
use crate::simd::{Isa, Vector};
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::trav_ray::MAX_RECIPROCAL;

/// Minimum number of rays in a group; smaller groups are traced as single rays.
const MIN_GROUP_RAYS: u32 = 12;

/// Minimum number of rays in a chunk; smaller chunks are traced as single rays.
const MIN_CHUNK_RAYS: usize = 5;

/// Direction classes: 8 octants for each of 3 major axes, and one class for all other directions.
pub const DIRECTION_CLASSES: usize = 32;

/// Class of a ray that cannot be in a packet: not finite, or parallel to an axis.
pub const UNGROUPED: u8 = DIRECTION_CLASSES as u8 - 1;

/// For each lane, the index in the chunk of the lane's ray; `None` if ray i is in lane i.
pub type RayIndices<'a> = Option<&'a [u8; PACKET_SIZE]>;

/// Returns the index in the chunk of the ray in a lane.
#[inline(always)]
pub fn ray_index(lane: u32, indices: RayIndices) -> usize {
    let lane = lane as usize & (PACKET_SIZE - 1);
    indices.map_or(lane, |indices| usize::from(indices[lane]) & (PACKET_SIZE - 1))
}

/// Converts a mask by lane to a mask by index in the chunk.
#[inline(always)]
pub fn ray_mask(mut lanes: u64, indices: RayIndices) -> u64 {
    if indices.is_none() {
        return lanes;
    }
    let mut numbers = 0;
    while lanes != 0 {
        numbers |= 1 << ray_index(lanes.trailing_zeros(), indices);
        lanes &= lanes - 1;
    }
    numbers
}

const EMPTY_RAY: Ray = Ray { origin: [0.0; 3], direction: [0.0; 3], t_max: 0.0 };

/// Several rays of a chunk.
pub struct RayBatch {
    pub rays: [Ray; PACKET_SIZE],
    /// The rays' indices in the chunk.
    pub indices: [u8; PACKET_SIZE],
    pub len: usize,
}

impl RayBatch {
    pub const EMPTY: RayBatch = RayBatch { rays: [EMPTY_RAY; PACKET_SIZE], indices: [0; PACKET_SIZE], len: 0 };

    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds a ray; a group has at most 64 rays.
    #[inline(always)]
    pub fn push(&mut self, ray: Ray, number: usize) {
        self.rays[self.len & (PACKET_SIZE - 1)] = ray;
        self.indices[self.len & (PACKET_SIZE - 1)] = number as u8;
        self.len += 1;
    }

    /// Gathers the rays of `lanes`, whose indices in the chunk are `indices`.
    #[inline(always)]
    pub fn gather(&mut self, rays: &[Ray], indices: RayIndices, mut lanes: u64) {
        self.clear();
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            self.push(rays[lane as usize & (PACKET_SIZE - 1)], ray_index(lane, indices));
        }
    }

    #[inline(always)]
    pub fn all(&self) -> (&[Ray], RayIndices<'_>) {
        (&self.rays[..self.len], Some(&self.indices))
    }

    /// The rays of a group, which are gathered unless the group is the whole chunk, and their indices in the
    /// chunk.
    #[inline(always)]
    pub fn subset<'a>(
        &'a mut self,
        rays: &'a [Ray],
        indices: RayIndices<'a>,
        group: u64,
        whole: bool,
    ) -> (&'a [Ray], RayIndices<'a>) {
        if whole {
            return (rays, indices);
        }
        self.gather(rays, indices, group);
        self.all()
    }
}

/// Groups of a chunk: first the whole chunk; if it is not coherent, one group per direction class.
pub struct OctantGroups {
    direction_class: [u8; PACKET_SIZE],
    remaining: u64,
    /// True until the chunk is divided into groups.
    pub is_whole: bool,
}

impl OctantGroups {
    #[inline(always)]
    pub fn new(rays: &[Ray]) -> OctantGroups {
        OctantGroups {
            direction_class: [UNGROUPED; PACKET_SIZE],
            remaining: u64::MAX >> (PACKET_SIZE - rays.len()),
            is_whole: rays.len() >= MIN_CHUNK_RAYS,
        }
    }

    /// Groups the rays by direction class.
    #[inline(never)]
    pub fn sort(&mut self, rays: &[Ray]) {
        for (to, ray) in self.direction_class.iter_mut().zip(rays) {
            *to = direction_class(ray.direction);
        }
        self.remaining = u64::MAX >> (PACKET_SIZE - rays.len());
        self.is_whole = false;
    }

    /// Returns the lanes of the next group, and true if a packet of these rays may be faster than single rays.
    #[inline(always)]
    pub fn next(&mut self) -> Option<(u64, bool)> {
        if self.remaining == 0 {
            return None;
        }
        if self.is_whole {
            return Some((std::mem::take(&mut self.remaining), true));
        }
        Some(self.next_group())
    }

    #[inline(never)]
    fn next_group(&mut self) -> (u64, bool) {
        let first = self.direction_class[self.remaining.trailing_zeros() as usize & (PACKET_SIZE - 1)];
        let mut same = 0;
        for (i, class) in self.direction_class.iter().enumerate() {
            same |= u64::from(*class == first) << i;
        }
        same &= self.remaining;
        self.remaining &= !same;
        (same, first != UNGROUPED && same.count_ones() >= MIN_GROUP_RAYS)
    }
}

/// The direction class of a direction; rays of one class satisfy the conditions of
/// [`crate::traverse::packet::Packet::setup`]. Branch-free, because directions are unpredictable.
#[inline(always)]
fn direction_class([x, y, z]: [f32; 3]) -> u8 {
    const MIN_DIRECTION_RATIO: u32 = (1.0 / MAX_RECIPROCAL).to_bits();
    const INFINITE: u32 = f32::INFINITY.to_bits();
    // The bits of non-negative floats, read as integers, have the same order as the floats.
    let [dx, dy, dz] = [x.to_bits(), y.to_bits(), z.to_bits()];
    let [x, y, z] = [dx << 1 >> 1, dy << 1 >> 1, dz << 1 >> 1];
    let least = x.min(y).min(z);
    let most = x.max(y).max(z);
    let main = if x == most {
        0
    } else if y == most {
        8
    } else {
        16
    };
    let signs = dx >> 31 | dy >> 31 << 1 | dz >> 31 << 2;
    let odd = (least < MIN_DIRECTION_RATIO) | (most > INFINITE);
    (if odd { u32::from(UNGROUPED) } else { main | signs }) as u8
}

/// The direction classes of several rays of a batch.
#[inline(always)]
pub fn direction_classes<I: Isa>(rays: &[Ray], numbers: &[u32], out: &mut [u8]) {
    const LANES: usize = 16;
    let numbers = numbers.chunks(LANES);
    for (out, numbers) in out.chunks_mut(LANES).zip(numbers) {
        let from: [*const f32; LANES] = std::array::from_fn(|i| {
            let number = numbers.get(i).unwrap_or(&numbers[0]);
            let ray: *const Ray = &rays[*number as usize];
            ray.cast::<f32>().wrapping_add(3)
        });
        let mut lanes = [[0.0f32; LANES]; 3];
        // SAFETY: the three floats of a ray's direction are followed by its t_max; the rows contain sixteen floats.
        unsafe {
            let columns = I::load_transposed(from);
            for (row, column) in lanes.iter_mut().zip(columns) {
                column.store(row.as_mut_ptr());
            }
        }
        let [x, y, z] = lanes;
        let mut found = [0; LANES];
        for lane in 0..LANES {
            found[lane] = direction_class([x[lane], y[lane], z[lane]]);
        }
        out.copy_from_slice(&found[..out.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(direction: [f32; 3]) -> Ray {
        Ray { direction, t_max: 1.0, ..EMPTY_RAY }
    }

    #[test]
    fn rays_are_grouped_exactly_once_with_similar_rays() {
        let kinds = [[1.0, 0.5, 0.25], [1.0, -0.5, 0.25], [0.5, 1.0, 0.25]];
        let mut rays: Vec<Ray> = (0..PACKET_SIZE).map(|i| ray(kinds[i * i % 3])).collect();
        rays[5] = ray([1.0, 0.0, 0.25]);
        rays[6] = ray([1.0, f32::NAN, 0.25]);
        let mut groups = OctantGroups::new(&rays[..60]);
        assert_eq!(groups.next(), Some((u64::MAX >> 4, true)));
        assert_eq!(groups.next(), None);
        groups.sort(&rays[..60]);
        let (mut seen, mut members) = (0, RayBatch::EMPTY);
        while let Some((group, pays)) = groups.next() {
            assert_eq!(seen & group, 0);
            seen |= group;
            members.gather(&rays, None, group);
            let all = u64::MAX >> (PACKET_SIZE - members.len);
            let indices = members.all().1;
            assert_eq!(ray_mask(all, indices), group);
            assert_eq!(members.len, group.count_ones() as usize);
            for (lane, ray) in members.all().0.iter().enumerate() {
                assert!(group >> members.indices[lane] & 1 != 0);
                let (y, x) = (ray.direction[1], members.rays[0].direction[1]);
                assert!(y == x || !pays, "they run alike");
            }
            let odd = group & 0b110_0000 != 0;
            assert_eq!(pays, !odd && members.len >= MIN_GROUP_RAYS as usize);
        }
        assert_eq!(seen, u64::MAX >> 4);
    }
}
