//! Which triangles of a treelet go in pairs: those with a common edge, where the box of both is hardly larger.

use crate::build::BuildItem;
use crate::build::triangle_pair::Piece;
use crate::simd::prefetch;

/// A pair whose box is larger than this part of both boxes together stays two: rays would meet it in vain.
const PAIR: f32 = 0.85;

/// How many triangles before it is needed one is asked for: since its box was made it may have left the nearest caches.
const AHEAD: usize = 8;

/// How many triangles in a row may have no pair beside them before nobody looks there any more.
const HOPE: usize = 16;

/// How many places are looked at: where more edges are in a row, or are one, some are forgotten.
const PROBES: usize = 8;

/// The pairs of a treelet's triangles, and room to find them in, kept from one treelet to the next.
#[derive(Default)]
pub struct Pairs {
    /// By the ids that items have after [`Pairs::find`].
    pub pieces: Vec<Piece>,
    /// The edges of those that are alone, with room for more: in the upper half a part of the edge's hash, in the
    /// lower one the item, counted from 1.
    edges: Vec<u32>,
}

/// A number that hardly any other edge has.
#[inline(always)]
fn edge_hash(a: u32, b: u32) -> u64 {
    let edge = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
    let hash = edge.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (hash ^ hash >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93)
}

impl Pairs {
    /// Joins items, whose ids are those of triangles: each takes the best of the open neighbours among those before it, if
    /// there is a good one. Returns how many are left; they come first, and their ids are those of pieces. Of items, which
    /// half a word numbers, no treelet has more than twice `TREELET`.
    ///
    /// Most quads that were cut in two lie beside each other. In a `hurry` that is looked at first, as long as it pays:
    /// such a pair need not be the best, and no edge of it is looked up.
    #[inline(always)]
    pub fn find(&mut self, triangles: &[[u32; 3]], items: &mut [BuildItem], hurry: bool) -> usize {
        let Pairs { pieces, edges } = self;
        pieces.clear();
        let bits = (8 * items.len()).next_power_of_two().trailing_zeros();
        edges.clear();
        edges.resize(1 << bits, 0);
        let alone = |item: &BuildItem| Piece::one(item.id, triangles[item.id as usize]);
        let mut hope = if hurry { HOPE } else { 0 };
        let (mut n, mut next) = (0, 0);
        while let Some(&(mut item)) = items.get(next) {
            if let Some(later) = items.get(next + AHEAD) {
                prefetch(triangles.as_ptr().wrapping_add(later.id as usize));
            }
            next += 1;
            let piece = alone(&item);
            if hope > 0
                && let Some(beside) = items.get(next)
            {
                if let Some(pair) = piece.joined(&alone(beside))
                    && item.join_cost(beside) <= PAIR
                {
                    item = item.joined(beside);
                    item.id = n as u32;
                    items[n] = item;
                    pieces.push(pair);
                    (n, next, hope) = (n + 1, next + 1, HOPE);
                    continue;
                }
                hope -= 1;
            }
            let mut best: Option<(f32, usize, Piece)> = None;
            let mut places = [usize::MAX; 3];
            let tag = |hash: u64| (hash >> 16) as u32 & 0xffff_0000;
            let [a, b, c, _] = piece.vertices;
            let hashes = [edge_hash(a, b), edge_hash(b, c), edge_hash(c, a)];
            for k in 0..3 {
                let (first, tag) = ((hashes[k] >> (64 - bits)) as usize, tag(hashes[k]));
                for place in first..first + PROBES {
                    let place = place & (edges.len() - 1);
                    let found = edges[place];
                    if found == 0 {
                        places[k] = place;
                        break;
                    }
                    let other = (found as u16 - 1) as usize;
                    if (found ^ tag) >> 16 == 0
                        && pieces[other].count == 1
                        && let Some(pair) = pieces[other].joined(&piece)
                    {
                        let ratio = items[other].join_cost(&item);
                        if ratio <= best.map_or(PAIR, |b| b.0) {
                            best = Some((ratio, other, pair));
                        }
                    }
                }
            }
            if let Some((_, other, pair)) = best {
                pieces[other] = pair;
                items[other] = items[other].joined(&item);
                continue;
            }
            for k in 0..3 {
                if let Some(place) = edges.get_mut(places[k]) {
                    *place = tag(hashes[k]) | (n as u32 + 1);
                }
            }
            item.id = n as u32;
            items[n] = item;
            pieces.push(piece);
            n += 1;
        }
        n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quads of a sheet, each cut in two, as `order` has the halves: which quad, and which half.
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

    /// The pieces that are found, and the boxes beside them, checked against the triangles.
    fn found(side: u32, triangles: &[[u32; 3]], hurry: bool) -> Vec<Piece> {
        let vertex = |i: u32| [(i % (side + 1)) as f32, (i / (side + 1)) as f32, 0.0];
        let around = |ids: &[u32]| {
            let all = ids.iter().flat_map(|&id| triangles[id as usize]);
            all.map(vertex)
                .fold(([f32::MAX; 3], [f32::MIN; 3]), |b, p| {
                    (
                        [0, 1, 2].map(|i| b.0[i].min(p[i])),
                        [0, 1, 2].map(|i| b.1[i].max(p[i])),
                    )
                })
        };
        let mut items: Vec<_> = (0..triangles.len() as u32)
            .map(|id| {
                let (lower, upper) = around(&[id]);
                BuildItem::new(lower, upper, id)
            })
            .collect();
        let mut pairs = Pairs::default();
        let n = pairs.find(triangles, &mut items, hurry);
        assert_eq!(pairs.pieces.len(), n);
        let mut seen = vec![0; triangles.len()];
        for (i, (item, piece)) in items.iter().zip(&pairs.pieces).enumerate() {
            let ids = &piece.triangles[..piece.count as usize];
            ids.iter().for_each(|&id| seen[id as usize] += 1);
            let (lower, upper) = around(ids);
            let expected = BuildItem::new(lower, upper, i as u32);
            assert_eq!(format!("{item:?}"), format!("{expected:?}"));
        }
        assert!(seen.iter().all(|&times| times == 1), "each triangle once");
        pairs.pieces
    }

    #[test]
    fn every_quad_is_a_pair_whatever_the_order_of_its_halves() {
        let side = 20;
        let quads = side * side;
        let beside = sheet(side, |t| (t / 2, t % 2 == 1));
        let apart = sheet(side, |t| (t % quads, t >= quads));
        for hurry in [false, true] {
            for triangles in [&beside, &apart] {
                let pieces = found(side, triangles, hurry);
                assert_eq!(pieces.len(), quads as usize, "in a hurry: {hurry}");
            }
        }
    }

    #[test]
    fn who_is_in_a_hurry_takes_what_lies_beside_even_if_another_would_be_better() {
        // Half a square, something far away, the other half, and one beside that which is longer.
        let triangles = [[0, 1, 3], [10, 11, 13], [0, 3, 2], [0, 4, 3]];
        let pairs = |hurry| {
            let pieces = found(1, &triangles, hurry);
            let pairs = pieces.iter().filter(|piece| piece.count == 2);
            pairs.map(|piece| piece.triangles).collect::<Vec<_>>()
        };
        assert_eq!(pairs(true), [[2, 3]]);
        assert_eq!(pairs(false), [[0, 2]]);
    }

    #[test]
    fn hope_ends_where_nothing_lies_beside() {
        // More triangles without anybody beside them than are looked at, then a quad whose halves meet by their edge.
        let side = 20;
        let quads = side * side;
        let triangles = sheet(side, |t| match t < quads {
            true => (t, false),
            false => (2 * quads - 1 - t, true),
        });
        assert_eq!(found(side, &triangles, true).len(), quads as usize);
    }
}
