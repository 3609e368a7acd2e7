//! Welding: corners at exactly the same point become one vertex.

use std::convert::Infallible;
use std::hash::{BuildHasher, RandomState};
use std::sync::OnceLock;

use glam::DVec3;

use crate::io::parallel;

/// Position with finite coordinates that can be compared and hashed.
pub(crate) trait WeldKey: Copy + Send + Sync {
    type Bits: Eq;

    /// Key that is equal for equal points.
    fn bits(self) -> Self::Bits;

    fn hash(self, seed: HashSeed) -> u64;
}

// Adding 0 converts -0 to 0.

impl WeldKey for DVec3 {
    type Bits = [u64; 3];

    fn bits(self) -> [u64; 3] {
        (self + Self::ZERO).to_array().map(f64::to_bits)
    }

    fn hash(self, HashSeed([a, b, c]): HashSeed) -> u64 {
        let [x, y, z] = self.bits();
        fold(fold(x ^ a, y ^ b) ^ c, z ^ a)
    }
}

impl WeldKey for [f32; 3] {
    type Bits = [u32; 3];

    fn bits(self) -> [u32; 3] {
        self.map(|v| (v + 0.0).to_bits())
    }

    fn hash(self, HashSeed([a, b, c]): HashSeed) -> u64 {
        let [x, y, z] = self.bits().map(u64::from);
        fold(fold((x | y << 32) ^ a, z ^ b) ^ c, a)
    }
}

/// Random seed of a hash, so that nobody can create a file whose points all have the same hash.
#[derive(Clone, Copy)]
pub(crate) struct HashSeed([u64; 3]);

impl HashSeed {
    fn draw() -> Self {
        let drawn = RandomState::new();
        Self([1_u8, 2, 3].map(|i| drawn.hash_one(i)))
    }
}

/// Folded multiplication, as in wyhash (Wang Yi, 2019).
fn fold(a: u64, b: u64) -> u64 {
    let wide = u128::from(a) * u128::from(b);
    wide as u64 ^ (wide >> 64) as u64
}

/// Distinct positions, in the order in which they first occurred.
pub(crate) struct VertexWelder<P> {
    /// The distinct points.
    pub(crate) points: Vec<P>,
    /// Index into `points` plus one, or 0 for an empty slot; probing starts at the hash. The table is at least twice as
    /// long as `points`.
    table: Vec<u32>,
    seed: HashSeed,
}

impl<P: WeldKey> Default for VertexWelder<P> {
    fn default() -> Self {
        Self::new(HashSeed::draw(), 0)
    }
}

impl<P: WeldKey> VertexWelder<P> {
    /// Creates a welder with this initial capacity.
    fn new(seed: HashSeed, capacity: usize) -> Self {
        let length = match capacity {
            0 => 0,
            capacity => (2 * capacity).next_power_of_two(),
        };
        Self { points: Vec::with_capacity(capacity), table: vec![0; length], seed }
    }

    /// Returns the index of a point among the distinct points; a new point is appended.
    pub(crate) fn insert(&mut self, point: P) -> u32 {
        self.insert_hashed(point, point.hash(self.seed))
    }

    #[inline]
    fn insert_hashed(&mut self, point: P, hash: u64) -> u32 {
        // Most points are already known and are stored at the slot of their hash.
        let at = hash as usize & self.table.len().wrapping_sub(1);
        match self.table.get(at) {
            Some(&found) if found > 0 && self.points[found as usize - 1].bits() == point.bits() => found - 1,
            _ => self.probe(point, hash),
        }
    }

    #[inline(never)]
    fn probe(&mut self, point: P, hash: u64) -> u32 {
        if 2 * self.points.len() >= self.table.len() {
            self.grow();
        }
        let key = point.bits();
        let last = self.table.len() - 1;
        let mut at = hash as usize & last;
        loop {
            match self.table[at] {
                0 => {
                    self.points.push(point);
                    let found = self.points.len() as u32;
                    self.table[at] = found;
                    return found - 1;
                }
                found if self.points[found as usize - 1].bits() == key => return found - 1,
                _ => at = (at + 1) & last,
            }
        }
    }

    fn grow(&mut self) {
        let length = (4 * self.table.len()).max(1 << 10);
        self.table.clear();
        self.table.resize(length, 0);
        for (i, &point) in self.points.iter().enumerate() {
            let mut at = point.hash(self.seed) as usize & (length - 1);
            while self.table[at] != 0 {
                at = (at + 1) & (length - 1);
            }
            self.table[at] = i as u32 + 1;
        }
    }
}

/// Number of shards into which points are divided by their hashes, each processed by one thread at a time.
const SHARDS: usize = 64;

/// Shard of a hash. The lower bits of the hash select the slot in a table.
fn shard_of(hash: u64) -> usize {
    (hash >> 32) as usize % SHARDS
}

/// The distinct points of a block of triangles, and the same points with their indices, grouped by shard so that each
/// shard is read sequentially.
struct WeldBlock {
    points: Vec<[f32; 3]>,
    shards: Vec<Vec<(u32, [f32; 3])>>,
}

/// Reads triangles block by block and welds their corners. Returns the distinct points in the order of first use, and
/// the triangles as indices. The result does not depend on the number of threads.
///
/// `read` receives the index of a block's first triangle, and writes the corners of each triangle in the block. Three
/// times `count` must be less than 2³².
///
/// # Errors
/// The error of the first block that has one.
pub(crate) fn weld_triangles<E: Send>(
    count: usize,
    block: usize,
    read: impl Fn(usize, &mut dyn FnMut([[f32; 3]; 3])) -> Result<(), E> + Sync,
) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), E> {
    let seed = HashSeed::draw();
    let mut triangles = vec![[0; 3]; count];
    let blocks: Vec<OnceLock<WeldBlock>> = (0..count.div_ceil(block)).map(|_| OnceLock::new()).collect();
    parallel::fill_blocks(&mut triangles, block, |first, triangles| {
        let welded = weld_block(seed, triangles, |each| read(first, each))?;
        // Each block is set once, by the thread that reads it.
        let _ = blocks[first / block].set(welded);
        Ok(())
    })?;
    let blocks: Vec<WeldBlock> = blocks.into_iter().filter_map(OnceLock::into_inner).collect();
    // Points are numbered consecutively over all blocks.
    let mut starts = vec![0];
    for block in &blocks {
        starts.push(starts[starts.len() - 1] + block.points.len() as u32);
    }
    let (indices, firsts) = unique_points(&blocks, &starts, seed);
    let mut points = vec![[0.0; 3]; firsts.len()];
    let Ok(()) = parallel::fill_blocks(&mut points, block, |first, points| {
        let firsts = &firsts[first..first + points.len()];
        let mut at = starts.partition_point(|&start| start <= firsts[0]) - 1;
        for (point, &number) in points.iter_mut().zip(firsts) {
            while number >= starts[at + 1] {
                at += 1;
            }
            *point = blocks[at].points[(number - starts[at]) as usize].map(f64::from);
        }
        Ok::<(), Infallible>(())
    });
    let Ok(()) = parallel::fill_blocks(&mut triangles, block, |first, triangles| {
        let indices = &indices[starts[first / block] as usize..];
        for corner in triangles.as_flattened_mut() {
            *corner = indices[*corner as usize];
        }
        Ok::<(), Infallible>(())
    });
    // This conversion takes no time, because both types have the same memory layout.
    let points = points.into_iter().map(DVec3::from_array).collect();
    Ok((points, triangles))
}

/// Welds the triangles of a single block.
fn weld_block<E>(
    seed: HashSeed,
    triangles: &mut [[u32; 3]],
    read: impl FnOnce(&mut dyn FnMut([[f32; 3]; 3])) -> Result<(), E>,
) -> Result<WeldBlock, E> {
    let mut weld = VertexWelder::new(seed, triangles.len());
    let mut shards = vec![Vec::new(); SHARDS];
    let mut left = triangles.iter_mut();
    read(&mut |corners| {
        if let Some(triangle) = left.next() {
            for (corner, point) in triangle.iter_mut().zip(corners) {
                let (hash, known) = (point.hash(seed), weld.points.len());
                *corner = weld.insert_hashed(point, hash);
                if *corner as usize == known {
                    shards[shard_of(hash)].push((*corner, point));
                }
            }
        }
    })?;
    Ok(WeldBlock { points: weld.points, shards })
}

/// Returns the index of every point of all blocks among the distinct points, and the first occurrence of each distinct
/// point. Each shard of hashes is processed by one thread.
fn unique_points(blocks: &[WeldBlock], starts: &[u32], seed: HashSeed) -> (Vec<u32>, Vec<u32>) {
    let shards: Vec<usize> = match blocks.len() {
        0 | 1 => Vec::new(),
        _ => (0..SHARDS).collect(),
    };
    let repeated = parallel::par_map(&shards, |&shard| {
        let count = blocks.iter().map(|block| block.shards[shard].len()).sum();
        let mut weld = VertexWelder::new(seed, count);
        let (mut firsts, mut repeated) = (Vec::with_capacity(count), Vec::new());
        for (block, start) in blocks.iter().zip(starts) {
            for &(i, point) in &block.shards[shard] {
                let (index, number) = (weld.insert(point), start + i);
                if index as usize == firsts.len() {
                    firsts.push(number);
                } else {
                    repeated.push((number, firsts[index as usize]));
                }
            }
        }
        repeated
    });
    const VACANT: u32 = u32::MAX;
    let mut indices = vec![VACANT; starts[blocks.len()] as usize];
    for (number, before) in repeated.into_iter().flatten() {
        indices[number as usize] = before;
    }
    let mut firsts = Vec::with_capacity(indices.len());
    for number in 0..indices.len() {
        indices[number] = match indices[number] {
            VACANT => {
                firsts.push(number as u32);
                firsts.len() as u32 - 1
            }
            before => indices[before as usize],
        };
    }
    (indices, firsts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_share_an_index_in_order_of_first_use() {
        let mut weld = VertexWelder::default();
        let point = |i: u32| DVec3::new(f64::from(i % 7), f64::from(i % 11), f64::from(i % 13) - 6.0);
        let mut expected: Vec<DVec3> = Vec::new();
        for i in 0..30_000 {
            let known = expected.iter().position(|&known| known == point(i));
            let index = known.unwrap_or_else(|| {
                expected.push(point(i));
                expected.len() - 1
            });
            assert_eq!(weld.insert(point(i)) as usize, index);
        }
        assert_eq!(weld.points, expected);
        assert_eq!(expected.len(), 7 * 11 * 13);
    }

    #[test]
    fn negative_zero_is_welded_to_zero_and_adjacent_floats_are_not() {
        let mut weld = VertexWelder::default();
        assert_eq!(weld.insert(DVec3::new(0.0, -0.0, 1.0)), 0);
        assert_eq!(weld.insert(DVec3::new(-0.0, 0.0, 1.0)), 0);
        assert_eq!(weld.insert(DVec3::new(0.0, f64::MIN_POSITIVE, 1.0)), 1);
        assert_eq!(weld.insert(DVec3::new(0.0, 0.0, 1.0_f64.next_up())), 2);
    }

    #[test]
    fn block_size_does_not_change_welding() {
        // The cases have few or many points, points in many blocks, and zeros of both signs.
        for (count, turns) in [(0_u32, 3_u32), (1, 3), (1000, 40), (20_000, 50_000)] {
            let corner = |i: u32| {
                let i = i.wrapping_mul(2_654_435_761) % turns;
                let zero = if i.is_multiple_of(2) { 0.0 } else { -0.0 };
                [(i / 2) as f32, zero, (i % 3) as f32]
            };
            let facet = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2].map(corner);
            let mut weld = VertexWelder::default();
            let expected: Vec<_> = (0..count).map(|i| facet(i).map(|point| weld.insert(point))).collect();
            for block in [1, 7, 1024] {
                let read = |first: usize, each: &mut dyn FnMut([[f32; 3]; 3])| {
                    (first..(first + block).min(count as usize)).for_each(|i| each(facet(i as u32)));
                    Ok::<(), ()>(())
                };
                let (points, found) = weld_triangles(count as usize, block, read).unwrap();
                assert_eq!(found, expected);
                let points: Vec<_> = points.iter().map(|p| p.as_vec3().to_array()).collect();
                assert_eq!(format!("{points:?}"), format!("{:?}", weld.points));
            }
        }
        let fail = |first: usize, _: &mut dyn FnMut([[f32; 3]; 3])| {
            if first < 30 { Ok(()) } else { Err(first) }
        };
        assert_eq!(weld_triangles(100, 10, fail), Err(30));
    }
}
