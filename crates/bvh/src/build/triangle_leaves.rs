//! How triangles become leaves: a leaf names each vertex once.

use crate::blas::Quality;
use crate::build::triangle_pairs::Pairs;
use crate::build::{BuildItem, Leaves, Source, TREELET};
use crate::node::{NodeBlock, LEAF, MAX_LEAF_TRIANGLES, LeafNode};
use crate::simd::prefetch;

/// The triangles as the builder sees them.
pub struct Triangles<'a> {
    pub vertices: &'a [[f32; 3]],
    pub triangles: &'a [[u32; 3]],
    pub scale: f32,
    pub quality: Quality,
    /// The first triangle of each mesh, where they are several: leaves are of one, so that their boxes are as tight.
    pub firsts: &'a [u32],
}

/// Corners as many vertices apart are in the nearest cache by chance alone.
const SCATTERED: u32 = 4096;

/// What a thread knows of the triangles of the treelet it builds.
pub struct Pieces {
    pairs: Pairs,
    /// By a hash of the vertex: it in the upper half; in the lower one which leaf it was seen in and at what place.
    seen: Box<[u64; SEEN]>,
    leaf: u32,
    /// What was found to fit into a leaf...
    fitting: Vec<Shared>,
    /// ... last of those that begin with each piece: its place, counted from 1.
    last: Vec<u32>,
}

const SEEN: usize = 1 << 10;

impl Default for Pieces {
    fn default() -> Self {
        Self {
            pairs: Pairs::default(),
            seen: Box::new([0; SEEN]),
            leaf: 0,
            fitting: vec![],
            last: vec![],
        }
    }
}

/// The different vertices of some triangles, and each triangle's corners among them.
struct Shared {
    vertices: [u32; MAX_LEAF_TRIANGLES + 4],
    count: usize,
    corners: [[u8; 3]; MAX_LEAF_TRIANGLES],
    triangles: usize,
}

impl Pieces {
    /// `None` where there are too many vertices or triangles for a leaf.
    #[inline(always)]
    fn share(&mut self, items: &[BuildItem]) -> Option<Shared> {
        // Nothing is looked up for what is too much anyway.
        let count = |item: &BuildItem| usize::from(self.pairs.pieces[item.id as usize].count);
        if items.iter().map(count).sum::<usize>() > MAX_LEAF_TRIANGLES {
            return None;
        }
        self.leaf += 1;
        if self.leaf >> 28 != 0 {
            self.seen.fill(0);
            self.leaf = 1;
        }
        let leaf = u64::from(self.leaf);
        let mut shared = Shared {
            vertices: [0; MAX_LEAF_TRIANGLES + 4],
            count: 0,
            corners: [[0; 3]; MAX_LEAF_TRIANGLES],
            triangles: 0,
        };
        for item in items {
            let piece = &self.pairs.pieces[item.id as usize];
            let mut places = [0; 4];
            for (place, &vertex) in places.iter_mut().zip(&piece.vertices) {
                let mut at = (vertex.wrapping_mul(0x9e37_79b1) >> 22) as usize % SEEN;
                let key = u64::from(vertex) << 32 | leaf << 4;
                loop {
                    let found = self.seen[at];
                    let here = found >> 4 & 0x0fff_ffff == leaf;
                    if here && found >> 32 != u64::from(vertex) {
                        at = (at + 1) % SEEN;
                        continue;
                    }
                    *place = if here {
                        found as usize & 15
                    } else {
                        shared.count
                    };
                    shared.vertices[shared.count] = vertex;
                    shared.count += usize::from(!here);
                    self.seen[at] = key | (*place as u64 & 15);
                    break;
                }
            }
            if shared.count > MAX_LEAF_TRIANGLES {
                return None;
            }
            let place = |k: u8| places[k as usize & 3] as u8;
            shared.corners[shared.triangles] = [place(0), place(1), place(2)];
            if piece.count == 2 {
                shared.corners[shared.triangles + 1] = piece.second.map(place);
            }
            shared.triangles += piece.count as usize;
        }
        Some(shared)
    }
}

impl Triangles<'_> {
    /// The box of a triangle.
    #[inline(always)]
    fn item_of(&self, id: u32, corners: [u32; 3]) -> BuildItem {
        let [a, b, c] = corners.map(|i| self.vertex(i));
        let least = |a: f32, b: f32| if a < b { a } else { b };
        let most = |a: f32, b: f32| if a > b { a } else { b };
        let lower = std::array::from_fn(|i| least(least(a[i], b[i]), c[i]));
        let upper = std::array::from_fn(|i| most(most(a[i], b[i]), c[i]));
        BuildItem::new(lower, upper, id)
    }

    #[inline(always)]
    fn vertex(&self, index: u32) -> [f32; 3] {
        debug_assert!((index as usize) < self.vertices.len());
        // SAFETY: `check` has seen every index of every triangle.
        unsafe { self.vertices.get_unchecked(index as usize) }.map(|x| x * self.scale)
    }
}

impl Source for Triangles<'_> {
    fn count(&self) -> usize {
        self.triangles.len()
    }

    #[inline(always)]
    fn item(&self, t: usize) -> BuildItem {
        self.item_of(t as u32, self.triangles[t])
    }

    #[inline(always)]
    fn ask(&self, items: std::ops::Range<usize>) {
        let some = self.triangles.get(items).unwrap_or_default();
        let [Some(first), Some(last)] = [some.first(), some.last()] else {
            return;
        };
        let ends = || first.iter().chain(last);
        let (least, most) = (ends().min(), ends().max());
        if most.copied().unwrap_or(0) - least.copied().unwrap_or(0) < SCATTERED {
            return;
        }
        for &vertex in some.as_flattened() {
            prefetch(self.vertices.as_ptr().wrapping_add(vertex as usize));
        }
    }

    fn items(&self, ids: &[u32], items: &mut Vec<BuildItem>) {
        items.reserve(ids.len());
        let mut corners = [[0; 3]; 64];
        for ids in ids.chunks(corners.len()) {
            for (corners, &id) in corners.iter_mut().zip(ids) {
                *corners = self.triangles[id as usize];
                // Each may be anywhere in memory: all are on their way before the first is needed.
                for vertex in *corners {
                    prefetch(self.vertices.as_ptr().wrapping_add(vertex as usize));
                }
            }
            let made = ids
                .iter()
                .zip(&corners)
                .map(|(&id, &corners)| self.item_of(id, corners));
            items.extend(made);
        }
    }
}

impl Leaves for Triangles<'_> {
    const IN_BLOCKS: bool = true;
    const USUAL: usize = 10;
    type Notes = Pieces;

    #[inline(always)]
    fn enter(&self, items: &mut [BuildItem], notes: &mut Pieces) -> usize {
        notes.fitting.clear();
        notes.last.clear();
        notes.last.resize(items.len(), 0);
        let hurry = self.quality == Quality::Fast;
        notes.pairs.find(self.triangles, items, hurry)
    }

    fn binary_leaf(&self) -> usize {
        // Four pairs without a common vertex have 16, which is what a leaf holds.
        4
    }

    fn bins(&self, items: usize) -> usize {
        match self.quality {
            // There a plane matters that lies just where something ends.
            Quality::Default if items > 16 * TREELET => 256,
            Quality::High if items > TREELET => 256,
            _ if items > TREELET => 64,
            Quality::Fast => 8,
            _ if items < 24 => 8,
            Quality::Default => 16,
            Quality::High => 32,
        }
    }

    fn widest(&self) -> bool {
        self.quality == Quality::Fast
    }

    fn expected(&self) -> (usize, usize) {
        // A third more than are used where leaves fill worst, on hair.
        let blocks = (self.triangles.len() + self.vertices.len()) / 10;
        (blocks + 1, self.triangles.len())
    }

    fn sample(&self) -> Option<usize> {
        match self.quality {
            Quality::Fast => Some(16),
            Quality::Default => Some(4),
            Quality::High => Some(2),
        }
    }

    #[inline(always)]
    fn alike(&self, items: &[BuildItem], notes: &Pieces) -> bool {
        if self.firsts.len() < 2 {
            return true;
        }
        let triangle = |item: &BuildItem| notes.pairs.pieces[item.id as usize].triangles[0];
        let mesh = |item| {
            self.firsts
                .partition_point(|first| *first <= triangle(item))
        };
        let first = mesh(&items[0]);
        items.iter().all(|item| mesh(item) == first)
    }

    #[inline(always)]
    fn fit(&self, items: &[BuildItem], notes: &mut Pieces) -> bool {
        if items.len() > MAX_LEAF_TRIANGLES || !self.alike(items, notes) {
            return false;
        }
        let shared = notes.share(items);
        let fits = shared.is_some();
        notes.fitting.extend(shared);
        if fits {
            notes.last[items[0].id as usize] = notes.fitting.len() as u32;
        }
        fits
    }

    #[inline(always)]
    fn emit(
        &self,
        items: &[BuildItem],
        notes: &mut Pieces,
        ids: &mut Vec<u32>,
        blocks: &mut Vec<NodeBlock>,
    ) -> u32 {
        // A binary leaf has at most 4 pieces and so 16 vertices; anything larger was asked for by `fit`.
        let made;
        let known = (notes.last[items[0].id as usize] as usize).wrapping_sub(1);
        let shared = match notes.fitting.get(known) {
            Some(shared) => shared,
            None => {
                made = notes.share(items);
                let Some(shared) = &made else {
                    unreachable!("a leaf that does not fit")
                };
                shared
            }
        };
        debug_assert_eq!(
            shared.triangles,
            items
                .iter()
                .map(|item| notes.pairs.pieces[item.id as usize].count as usize)
                .sum()
        );
        let mut vertices = [[0.0; 3]; MAX_LEAF_TRIANGLES];
        for (vertex, &index) in vertices.iter_mut().zip(&shared.vertices[..shared.count]) {
            *vertex = self.vertex(index);
        }
        let index = blocks.len() as u32;
        let corners = &shared.corners[..shared.triangles];
        blocks.push(NodeBlock {
            leaf: LeafNode::new(&vertices[..shared.count], corners, ids.len() as u32),
        });
        for item in items {
            let piece = &notes.pairs.pieces[item.id as usize];
            ids.extend_from_slice(&piece.triangles[..piece.count as usize]);
        }
        index | LEAF
    }
}
