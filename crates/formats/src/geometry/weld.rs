//! Corners at exactly the same place made one vertex.

use std::convert::Infallible;
use std::hash::{BuildHasher, RandomState};
use std::sync::OnceLock;

use glam::DVec3;

use crate::io::parallel;

/// Somewhere that is finite.
pub(crate) trait Place: Copy + Send + Sync {
    type Bits: Eq;

    /// Equal where the places are.
    fn bits(self) -> Self::Bits;

    fn hash(self, secret: Secret) -> u64;
}

// Adding 0 makes -0 and 0 the same.

impl Place for DVec3 {
    type Bits = [u64; 3];

    fn bits(self) -> [u64; 3] {
        (self + Self::ZERO).to_array().map(f64::to_bits)
    }

    fn hash(self, Secret([a, b, c]): Secret) -> u64 {
        let [x, y, z] = self.bits();
        fold(fold(x ^ a, y ^ b) ^ c, z ^ a)
    }
}

impl Place for [f32; 3] {
    type Bits = [u32; 3];

    fn bits(self) -> [u32; 3] {
        self.map(|v| (v + 0.0).to_bits())
    }

    fn hash(self, Secret([a, b, c]): Secret) -> u64 {
        let [x, y, z] = self.bits().map(u64::from);
        fold(fold((x | y << 32) ^ a, z ^ b) ^ c, a)
    }
}

/// Drawn, so that no file can be made of which all places have the same hash.
#[derive(Clone, Copy)]
pub(crate) struct Secret([u64; 3]);

impl Secret {
    fn draw() -> Self {
        let drawn = RandomState::new();
        Self([1_u8, 2, 3].map(|i| drawn.hash_one(i)))
    }
}

/// Source: the folded multiplication of wyhash (Wang Yi, 2019).
fn fold(a: u64, b: u64) -> u64 {
    let wide = u128::from(a) * u128::from(b);
    wide as u64 ^ (wide >> 64) as u64
}

/// Places, each once, in the order in which they came first.
pub(crate) struct Weld<P> {
    /// The places.
    pub(crate) places: Vec<P>,
    /// One more than an index into `places`, or 0; searched from where the hash says. At least twice as long as `places`.
    table: Vec<u32>,
    secret: Secret,
}

impl<P: Place> Default for Weld<P> {
    fn default() -> Self {
        Self::new(Secret::draw(), 0)
    }
}

impl<P: Place> Weld<P> {
    /// With room for so many places, and it grows.
    fn new(secret: Secret, room: usize) -> Self {
        let length = match room {
            0 => 0,
            room => (2 * room).next_power_of_two(),
        };
        Self {
            places: Vec::with_capacity(room),
            table: vec![0; length],
            secret,
        }
    }

    /// The index of a place.
    pub(crate) fn index(&mut self, place: P) -> u32 {
        self.hashed(place, place.hash(self.secret))
    }

    #[inline]
    fn hashed(&mut self, place: P, hash: u64) -> u32 {
        // Most are known, and where their hash says.
        let at = hash as usize & self.table.len().wrapping_sub(1);
        match self.table.get(at) {
            Some(&found) if found > 0 && self.places[found as usize - 1].bits() == place.bits() => {
                found - 1
            }
            _ => self.searched(place, hash),
        }
    }

    #[inline(never)]
    fn searched(&mut self, place: P, hash: u64) -> u32 {
        if 2 * self.places.len() >= self.table.len() {
            self.grow();
        }
        let key = place.bits();
        let last = self.table.len() - 1;
        let mut at = hash as usize & last;
        loop {
            match self.table[at] {
                0 => {
                    self.places.push(place);
                    let found = self.places.len() as u32;
                    self.table[at] = found;
                    return found - 1;
                }
                found if self.places[found as usize - 1].bits() == key => return found - 1,
                _ => at = (at + 1) & last,
            }
        }
    }

    fn grow(&mut self) {
        let length = (4 * self.table.len()).max(1 << 10);
        self.table.clear();
        self.table.resize(length, 0);
        for (i, &place) in self.places.iter().enumerate() {
            let mut at = place.hash(self.secret) as usize & (length - 1);
            while self.table[at] != 0 {
                at = (at + 1) & (length - 1);
            }
            self.table[at] = i as u32 + 1;
        }
    }
}

/// Parts into which places are divided by their hashes, each for one core at a time.
const SHARDS: usize = 64;

/// Which part has a hash. Its lower bits say where it is in a table.
fn shard_of(hash: u64) -> usize {
    (hash >> 32) as usize % SHARDS
}

/// The places of some triangles, and those of each part again with their indices: read one after the other.
struct Block {
    places: Vec<[f32; 3]>,
    shards: Vec<Vec<(u32, [f32; 3])>>,
}

/// The triangles of corners that `read` writes block by block, which gets the number of a block's first triangle: the places,
/// each once and in the order in which they came first, and the triangles that refer to them, as one core after the other
/// would have made them. Three times `count` is less than 2³².
///
/// # Errors
/// That of the first block that has one.
pub(crate) fn triangles<E: Send>(
    count: usize,
    block: usize,
    read: impl Fn(usize, &mut dyn FnMut([[f32; 3]; 3])) -> Result<(), E> + Sync,
) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), E> {
    let secret = Secret::draw();
    let mut triangles = vec![[0; 3]; count];
    let blocks: Vec<OnceLock<Block>> = (0..count.div_ceil(block))
        .map(|_| OnceLock::new())
        .collect();
    parallel::make(&mut triangles, block, |first, triangles| {
        let mut weld = Weld::new(secret, triangles.len());
        let mut shards = vec![Vec::new(); SHARDS];
        let mut left = triangles.iter_mut();
        read(first, &mut |corners| {
            if let Some(triangle) = left.next() {
                for (corner, place) in triangle.iter_mut().zip(corners) {
                    let (hash, known) = (place.hash(secret), weld.places.len());
                    *corner = weld.hashed(place, hash);
                    if *corner as usize == known {
                        shards[shard_of(hash)].push((*corner, place));
                    }
                }
            }
        })?;
        // Nobody else sets that of this block.
        let _ = blocks[first / block].set(Block {
            places: weld.places,
            shards,
        });
        Ok(())
    })?;
    let blocks: Vec<Block> = blocks
        .into_iter()
        .filter_map(OnceLock::into_inner)
        .collect();
    // Places have numbers through all blocks; which ones were there before, and as what number.
    let mut starts = vec![0];
    for block in &blocks {
        starts.push(starts[starts.len() - 1] + block.places.len() as u32);
    }
    let shards: Vec<usize> = match blocks.len() {
        0 | 1 => Vec::new(),
        _ => (0..SHARDS).collect(),
    };
    let again = parallel::map(&shards, |&shard| {
        let count = blocks.iter().map(|block| block.shards[shard].len()).sum();
        let mut weld = Weld::new(secret, count);
        let (mut firsts, mut again) = (Vec::with_capacity(count), Vec::new());
        for (block, start) in blocks.iter().zip(&starts) {
            for &(i, place) in &block.shards[shard] {
                let (index, number) = (weld.index(place), start + i);
                if index as usize == firsts.len() {
                    firsts.push(number);
                } else {
                    again.push((number, firsts[index as usize]));
                }
            }
        }
        again
    });
    const NEW: u32 = u32::MAX;
    let mut indices = vec![NEW; starts[blocks.len()] as usize];
    for (number, before) in again.into_iter().flatten() {
        indices[number as usize] = before;
    }
    let mut firsts = Vec::with_capacity(indices.len());
    for number in 0..indices.len() {
        indices[number] = match indices[number] {
            NEW => {
                firsts.push(number as u32);
                firsts.len() as u32 - 1
            }
            before => indices[before as usize],
        };
    }
    let mut places = vec![[0.0; 3]; firsts.len()];
    let Ok(()) = parallel::make(&mut places, block, |first, places| {
        let firsts = &firsts[first..first + places.len()];
        let mut at = starts.partition_point(|&start| start <= firsts[0]) - 1;
        for (place, &number) in places.iter_mut().zip(firsts) {
            while number >= starts[at + 1] {
                at += 1;
            }
            *place = blocks[at].places[(number - starts[at]) as usize].map(f64::from);
        }
        Ok::<(), Infallible>(())
    });
    let Ok(()) = parallel::make(&mut triangles, block, |first, triangles| {
        let indices = &indices[starts[first / block] as usize..];
        for corner in triangles.as_flattened_mut() {
            *corner = indices[*corner as usize];
        }
        Ok::<(), Infallible>(())
    });
    // Takes no time: the same numbers at the same places.
    let places = places.into_iter().map(DVec3::from_array).collect();
    Ok((places, triangles))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_place_has_one_index_in_order() {
        let mut weld = Weld::default();
        let place =
            |i: u32| DVec3::new(f64::from(i % 7), f64::from(i % 11), f64::from(i % 13) - 6.0);
        let mut expected: Vec<DVec3> = Vec::new();
        for i in 0..30_000 {
            let known = expected.iter().position(|&known| known == place(i));
            let index = known.unwrap_or_else(|| {
                expected.push(place(i));
                expected.len() - 1
            });
            assert_eq!(weld.index(place(i)) as usize, index);
        }
        assert_eq!(weld.places, expected);
        assert_eq!(expected.len(), 7 * 11 * 13);
    }

    #[test]
    fn zeros_are_one_place_and_neighbours_are_not() {
        let mut weld = Weld::default();
        assert_eq!(weld.index(DVec3::new(0.0, -0.0, 1.0)), 0);
        assert_eq!(weld.index(DVec3::new(-0.0, 0.0, 1.0)), 0);
        assert_eq!(weld.index(DVec3::new(0.0, f64::MIN_POSITIVE, 1.0)), 1);
        assert_eq!(weld.index(DVec3::new(0.0, 0.0, 1.0_f64.next_up())), 2);
    }

    #[test]
    fn blocks_make_what_one_core_makes() {
        // Few and many places, some in many blocks and some at both zeros.
        for (count, turns) in [(0_u32, 3_u32), (1, 3), (1000, 40), (20_000, 50_000)] {
            let corner = |i: u32| {
                let i = i.wrapping_mul(2_654_435_761) % turns;
                let zero = if i.is_multiple_of(2) { 0.0 } else { -0.0 };
                [(i / 2) as f32, zero, (i % 3) as f32]
            };
            let facet = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2].map(corner);
            let mut weld = Weld::default();
            let expected: Vec<_> = (0..count)
                .map(|i| facet(i).map(|place| weld.index(place)))
                .collect();
            for block in [1, 7, 1024] {
                let read = |first: usize, each: &mut dyn FnMut([[f32; 3]; 3])| {
                    (first..(first + block).min(count as usize))
                        .for_each(|i| each(facet(i as u32)));
                    Ok::<(), ()>(())
                };
                let (places, found) = triangles(count as usize, block, read).unwrap();
                assert_eq!(found, expected);
                let places: Vec<_> = places.iter().map(|p| p.as_vec3().to_array()).collect();
                assert_eq!(format!("{places:?}"), format!("{:?}", weld.places));
            }
        }
        let fail = |first: usize, _: &mut dyn FnMut([[f32; 3]; 3])| {
            if first < 30 { Ok(()) } else { Err(first) }
        };
        assert_eq!(triangles(100, 10, fail), Err(30));
    }
}
