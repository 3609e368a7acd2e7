//! How triangles become leaves: those with a common edge go in pairs, and a leaf names each vertex once.

use crate::block::{Block, LEAF, LEAF_SIZE, Leaf};
use crate::build::{BuildItem, Leaves, TREELET};
use crate::mesh::Quality;

/// The triangles as the builder sees them.
pub struct Triangles<'a> {
    pub vertices: &'a [[f32; 3]],
    pub triangles: &'a [[u32; 3]],
    pub scale: f32,
    pub quality: Quality,
}

/// A pair whose box is larger than this part of both boxes together stays two: rays would meet it in vain.
const PAIR: f32 = 0.85;

/// One triangle, or two with a common edge.
#[derive(Clone, Copy)]
struct Piece {
    /// The fourth vertex is the third again where there is one triangle.
    vertices: [u32; 4],
    triangles: [u32; 2],
    /// The corners of the second triangle among the vertices; those of the first are 0, 1 and 2.
    second: [u8; 3],
    /// How many triangles there are.
    count: u8,
}

impl Piece {
    fn one(id: u32, corners: [u32; 3]) -> Piece {
        let [a, b, c] = corners;
        Piece {
            vertices: [a, b, c, c],
            triangles: [id; 2],
            second: [0; 3],
            count: 1,
        }
    }

    /// Both together, where they have at least two vertices in common.
    #[inline(always)]
    fn joined(&self, other: &Piece) -> Option<Piece> {
        let [a, b, c, _] = self.vertices;
        let (mut fourth, mut strangers) = (c, 0);
        let mut second = [0; 3];
        for (place, &vertex) in second.iter_mut().zip(&other.vertices) {
            let known = vertex == a || vertex == b || vertex == c;
            *place = match vertex {
                _ if vertex == a => 0,
                _ if vertex == b => 1,
                _ if vertex == c => 2,
                _ => 3,
            };
            fourth = if known { fourth } else { vertex };
            strangers += u32::from(!known);
        }
        (strangers <= 1).then_some(Piece {
            vertices: [a, b, c, fourth],
            triangles: [self.triangles[0], other.triangles[0]],
            second,
            count: 2,
        })
    }
}

/// The edges of the open triangles of a treelet, by a hash of their vertices; one that another has taken the place of
/// is forgotten.
const EDGES: usize = 1 << 14;

/// What a thread knows of the triangles of the treelet it builds.
pub struct Pieces {
    pieces: Vec<Piece>,
    /// Item, counted from 1.
    edges: Box<[u16; EDGES]>,
    /// By a hash of the vertex: it in the upper half; in the lower one which leaf it was seen in and at what place.
    seen: Box<[u64; SEEN]>,
    leaf: u32,
}

const SEEN: usize = 1 << 10;

impl Default for Pieces {
    fn default() -> Self {
        Self {
            pieces: vec![],
            edges: Box::new([0; EDGES]),
            seen: Box::new([0; SEEN]),
            leaf: 0,
        }
    }
}

/// The different vertices of some triangles, and each triangle's corners among them.
struct Shared {
    vertices: [u32; LEAF_SIZE + 4],
    count: usize,
    corners: [[u8; 3]; LEAF_SIZE],
    triangles: usize,
}

impl Pieces {
    /// `None` where there are too many vertices or triangles for a leaf.
    #[inline(always)]
    fn share(&mut self, items: &[BuildItem]) -> Option<Shared> {
        self.leaf += 1;
        if self.leaf >> 28 != 0 {
            self.seen.fill(0);
            self.leaf = 1;
        }
        let leaf = u64::from(self.leaf);
        let mut shared = Shared {
            vertices: [0; LEAF_SIZE + 4],
            count: 0,
            corners: [[0; 3]; LEAF_SIZE],
            triangles: 0,
        };
        for item in items {
            let piece = &self.pieces[item.id as usize];
            if shared.triangles + piece.count as usize > LEAF_SIZE {
                return None;
            }
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
            if shared.count > LEAF_SIZE {
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
    #[inline(always)]
    fn vertex(&self, index: u32) -> [f32; 3] {
        debug_assert!((index as usize) < self.vertices.len());
        // SAFETY: `check` has seen every index of every triangle.
        unsafe { self.vertices.get_unchecked(index as usize) }.map(|x| x * self.scale)
    }

    /// The box of a triangle.
    #[inline(always)]
    pub fn item(&self, t: usize) -> BuildItem {
        let [a, b, c] = self.triangles[t].map(|i| self.vertex(i));
        let lower = std::array::from_fn(|i| a[i].min(b[i]).min(c[i]));
        let upper = std::array::from_fn(|i| a[i].max(b[i]).max(c[i]));
        BuildItem::new(lower, upper, t as u32)
    }
}

impl Leaves for Triangles<'_> {
    const IN_BLOCKS: bool = true;
    const USUAL: usize = 10;
    type Notes = Pieces;

    /// Finds the pairs: each triangle takes the best of the open neighbours among those before it, if there is a good one.
    fn enter(&self, items: &mut [BuildItem], notes: &mut Pieces) -> usize {
        let Pieces { pieces, edges, .. } = notes;
        pieces.clear();
        edges.fill(0);
        let mut n = 0;
        for i in 0..items.len() {
            let mut item = items[i];
            let corners = self.triangles[item.id as usize];
            let piece = Piece::one(item.id, corners);
            let mut best: Option<(f32, usize, Piece)> = None;
            let mut places = [0; 3];
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let hash = (a ^ b).wrapping_mul(0x9e37_79b1)
                    ^ (a.wrapping_add(b)).wrapping_mul(0x85eb_ca6b);
                places[k] = (hash >> 18) as usize % EDGES;
                let other = edges[places[k]] as usize;
                let Some(other) = other.checked_sub(1) else {
                    continue;
                };
                let neighbour: &Piece = &pieces[other];
                if neighbour.count == 1
                    && let Some(pair) = neighbour.joined(&piece)
                {
                    let ratio = items[other].join_cost(&item);
                    if ratio <= best.map_or(PAIR, |b| b.0) {
                        best = Some((ratio, other, pair));
                    }
                }
            }
            if let Some((_, other, pair)) = best {
                pieces[other] = pair;
                items[other] = items[other].joined(&item);
                continue;
            }
            for place in places {
                edges[place] = n as u16 + 1;
            }
            item.id = n as u32;
            items[n] = item;
            pieces.push(piece);
            n += 1;
        }
        n
    }

    fn binary_leaf(&self) -> usize {
        // At most 4: four pairs without a common vertex have 16, which is what a leaf holds.
        match self.quality {
            Quality::Fast | Quality::Default => 4,
            Quality::High => 2,
        }
    }

    fn bins(&self, items: usize) -> Option<usize> {
        match self.quality {
            Quality::Fast if items > TREELET => None,
            // There a plane matters that lies just where something ends.
            Quality::Default | Quality::High if items > 16 * TREELET => Some(256),
            Quality::Default if items > TREELET => Some(64),
            Quality::High if items > TREELET => Some(256),
            Quality::Fast => Some(8),
            Quality::Default if items < 24 => Some(8),
            Quality::Default => Some(16),
            Quality::High if items < 24 => Some(16),
            Quality::High => Some(32),
        }
    }

    #[inline(always)]
    fn fit(&self, items: &[BuildItem], notes: &mut Pieces) -> bool {
        items.len() <= LEAF_SIZE && notes.share(items).is_some()
    }

    #[inline(always)]
    fn emit(
        &self,
        items: &[BuildItem],
        notes: &mut Pieces,
        ids: &mut Vec<u32>,
        blocks: &mut Vec<Block>,
    ) -> u32 {
        // A binary leaf has at most 4 pieces and so 16 vertices; anything larger was asked for by `fit`.
        let Some(shared) = notes.share(items) else {
            unreachable!("a leaf that does not fit")
        };
        let mut vertices = [[0.0; 3]; LEAF_SIZE];
        for (vertex, &index) in vertices.iter_mut().zip(&shared.vertices[..shared.count]) {
            *vertex = self.vertex(index);
        }
        let index = blocks.len() as u32;
        let corners = &shared.corners[..shared.triangles];
        blocks.push(Block {
            leaf: Leaf::new(&vertices[..shared.count], corners, ids.len() as u32),
        });
        for item in items {
            let piece = &notes.pieces[item.id as usize];
            ids.extend_from_slice(&piece.triangles[..piece.count as usize]);
        }
        index | LEAF
    }
}
