//! Pairs of adjacent triangles as one build primitive, for a smaller tree.

use crate::build::prim_ref::PrimRef;
use crate::simd::prefetch;

/// Maximum surface area of a pair's bounds, as a fraction of the sum of the areas of both triangles' bounds.
const MAX_PAIR_AREA_RATIO: f32 = 0.85;

/// Number of triangles between the prefetch of a triangle's corners and their use; the corners may have left the L1
/// cache since their bounds were computed.
const PREFETCH_DISTANCE: usize = 8;

/// Maximum number of probes per edge; after that an edge is ignored.
const MAX_PROBES: usize = 8;

/// One triangle, or two with a common edge.
#[derive(Clone, Copy)]
pub struct TrianglePair {
    /// Four vertices; the fourth repeats the third for a single triangle.
    pub vertices: [u32; 4],
    /// Both triangles; for a single triangle, the same triangle twice.
    pub triangles: [u32; 2],
    /// The second triangle's corners as indices into the vertices; the first triangle's corners are 0, 1 and 2.
    pub second_corners: [u8; 3],
    /// The number of triangles.
    pub count: u8,
}

impl TrianglePair {
    /// Creates a pair that contains only one triangle.
    pub fn single(id: u32, corners: [u32; 3]) -> TrianglePair {
        let [a, b, c] = corners;
        TrianglePair { vertices: [a, b, c, c], triangles: [id; 2], second_corners: [0; 3], count: 1 }
    }

    /// Pairs two triangles if they share at least two vertices.
    #[inline(always)]
    pub fn try_pair(&self, other: &TrianglePair) -> Option<TrianglePair> {
        let [a, b, c, _] = self.vertices;
        let (mut fourth, mut strangers) = (c, 0);
        let mut second_corners = [0; 3];
        for (slot, &vertex) in second_corners.iter_mut().zip(&other.vertices) {
            let known = vertex == a || vertex == b || vertex == c;
            *slot = match vertex {
                _ if vertex == a => 0,
                _ if vertex == b => 1,
                _ if vertex == c => 2,
                _ => 3,
            };
            fourth = if known { fourth } else { vertex };
            strangers += u32::from(!known);
        }
        (strangers <= 1).then_some(TrianglePair {
            vertices: [a, b, c, fourth],
            triangles: [self.triangles[0], other.triangles[0]],
            second_corners,
            count: 2,
        })
    }
}

/// Pairs triangles of a treelet. Memory is reused between treelets.
#[derive(Default)]
pub struct PairFinder {
    /// Pairs of triangles, indexed by the primitive ids that [`PairFinder::pair_triangles`] assigns.
    pub pairs: Vec<TrianglePair>,
    /// Open-addressing hash table of the edges of unpaired triangles: part of the hash in the upper half, the primitive
    /// in the lower half, counted from 1.
    edge_table: Vec<u32>,
}

/// The hash of an undirected edge.
#[inline(always)]
fn edge_hash(a: u32, b: u32) -> u64 {
    let edge = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
    let hash = edge.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (hash ^ hash >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93)
}

impl PairFinder {
    /// Merges primitives whose ids are triangles: each triangle is paired with the best preceding unpaired neighbour,
    /// if the pair is small enough. Returns the number of merged primitives, which come first; their ids index `pairs`.
    /// A treelet has at most twice `TREELET_SIZE` primitives, so their indices fit into 16 bits.
    #[inline(always)]
    pub fn pair_triangles(&mut self, triangles: &[[u32; 3]], prims: &mut [PrimRef]) -> usize {
        let PairFinder { pairs, edge_table } = self;
        pairs.clear();
        let bits = (8 * prims.len()).next_power_of_two().trailing_zeros();
        edge_table.clear();
        edge_table.resize(1 << bits, 0);
        let alone = |prim: &PrimRef| TrianglePair::single(prim.id, triangles[prim.id as usize]);
        let (mut n, mut next) = (0, 0);
        while let Some(&(mut prim)) = prims.get(next) {
            if let Some(later) = prims.get(next + PREFETCH_DISTANCE) {
                prefetch(triangles.as_ptr().wrapping_add(later.id as usize));
            }
            next += 1;
            let single = alone(&prim);
            let mut best: Option<(f32, usize, TrianglePair)> = None;
            let mut slots = [usize::MAX; 3];
            let tag = |hash: u64| (hash >> 16) as u32 & 0xffff_0000;
            let [a, b, c, _] = single.vertices;
            let hashes = [edge_hash(a, b), edge_hash(b, c), edge_hash(c, a)];
            for k in 0..3 {
                let (first, tag) = ((hashes[k] >> (64 - bits)) as usize, tag(hashes[k]));
                for slot in first..first + MAX_PROBES {
                    let slot = slot & (edge_table.len() - 1);
                    let found = edge_table[slot];
                    if found == 0 {
                        slots[k] = slot;
                        break;
                    }
                    let other = (found as u16 - 1) as usize;
                    if (found ^ tag) >> 16 == 0
                        && pairs[other].count == 1
                        && let Some(pair) = pairs[other].try_pair(&single)
                    {
                        let ratio = prims[other].merge_area_ratio(&prim);
                        if ratio <= best.map_or(MAX_PAIR_AREA_RATIO, |b| b.0) {
                            best = Some((ratio, other, pair));
                        }
                    }
                }
            }
            if let Some((_, other, pair)) = best {
                pairs[other] = pair;
                prims[other] = prims[other].union(&prim);
                continue;
            }
            for k in 0..3 {
                if let Some(slot) = edge_table.get_mut(slots[k]) {
                    *slot = tag(hashes[k]) | (n as u32 + 1);
                }
            }
            prim.id = n as u32;
            prims[n] = prim;
            pairs.push(single);
            n += 1;
        }
        n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of a sheet of quads, two per quad. `order` returns the quad of each triangle, and true for the upper
    /// half.
    fn sheet(side: u32, order: impl Fn(u32) -> (u32, bool)) -> Vec<[u32; 3]> {
        (0..2 * side * side)
            .map(|t| {
                let (quad, upper) = order(t);
                let a = quad / side * (side + 1) + quad % side;
                match upper {
                    false => [a, a + 1, a + side + 2],
                    true => [a, a + side + 2, a + side + 1],
                }
            })
            .collect()
    }

    /// Finds the pairs, checks their boxes and triangles, and returns the pairs.
    fn found(side: u32, triangles: &[[u32; 3]]) -> Vec<TrianglePair> {
        let vertex = |i: u32| [(i % (side + 1)) as f32, (i / (side + 1)) as f32, 0.0];
        let around = |ids: &[u32]| {
            let all = ids.iter().flat_map(|&id| triangles[id as usize]);
            all.map(vertex).fold(([f32::MAX; 3], [f32::MIN; 3]), |b, p| {
                ([0, 1, 2].map(|i| b.0[i].min(p[i])), [0, 1, 2].map(|i| b.1[i].max(p[i])))
            })
        };
        let mut prims: Vec<_> = (0..triangles.len() as u32)
            .map(|id| {
                let (lower, upper) = around(&[id]);
                PrimRef::new(lower, upper, id)
            })
            .collect();
        let mut pairs = PairFinder::default();
        let n = pairs.pair_triangles(triangles, &mut prims);
        assert_eq!(pairs.pairs.len(), n);
        let mut seen = vec![0; triangles.len()];
        for (i, (prim, single)) in prims.iter().zip(&pairs.pairs).enumerate() {
            let ids = &single.triangles[..single.count as usize];
            ids.iter().for_each(|&id| seen[id as usize] += 1);
            let (lower, upper) = around(ids);
            let expected = PrimRef::new(lower, upper, i as u32);
            assert_eq!(format!("{prim:?}"), format!("{expected:?}"));
        }
        assert!(seen.iter().all(|&times| times == 1), "each triangle once");
        pairs.pairs
    }

    #[test]
    fn triangles_of_a_quad_are_paired_in_either_order() {
        let side = 20;
        let quads = side * side;
        let beside = sheet(side, |t| (t / 2, t % 2 == 1));
        let apart = sheet(side, |t| (t % quads, t >= quads));
        for triangles in [&beside, &apart] {
            assert_eq!(found(side, triangles).len(), quads as usize);
        }
    }

    #[test]
    fn triangles_are_paired_with_the_best_neighbour() {
        // Half a square, a distant triangle, the other half of the square, and a longer triangle next to the square.
        let triangles = [[0, 1, 3], [10, 11, 13], [0, 3, 2], [0, 4, 3]];
        let pairs = found(1, &triangles);
        let pairs = pairs.iter().filter(|pair| pair.count == 2);
        let pairs: Vec<_> = pairs.map(|pair| pair.triangles).collect();
        assert_eq!(pairs, [[0, 2]]);
    }
}
