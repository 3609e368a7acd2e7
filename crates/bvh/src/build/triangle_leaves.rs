//! Leaves of up to sixteen triangles with shared vertices.

use crate::build::prim_ref::PrimRef;
use crate::build::traits::{LeafBuilder, PrimSource, TREELET_SIZE};
use crate::build::triangle_pairs::PairFinder;
use crate::node::{LeafNode, MAX_LEAF_TRIANGLES, NodeBlock, NodeRef};
use crate::simd::prefetch;

/// The triangles of a mesh as build primitives.
pub struct TrianglePrims<'a> {
    pub vertices: &'a [[f32; 3]],
    pub triangles: &'a [[u32; 3]],
    pub scale: f32,
    /// The first triangle of each mesh, if there are several meshes. A leaf contains triangles of one mesh only, so
    /// that its bounds are tight.
    pub mesh_offsets: &'a [u32],
}

/// Scratch memory for the leaves of a treelet.
pub struct LeafScratch {
    pairs: PairFinder,
    /// Hash table of vertices. The upper half of an entry is the vertex; the lower half is the leaf and the vertex's
    /// position in the leaf.
    vertex_table: Box<[u64; VERTEX_TABLE_SIZE]>,
    leaf: u32,
    /// Candidate leaves: runs of primitives whose vertices fit into one leaf.
    candidate_leaves: Vec<LeafVertices>,
    /// For each primitive, the last candidate leaf that begins with it; candidates are numbered from 1.
    candidate_of_prim: Vec<u32>,
}

const VERTEX_TABLE_SIZE: usize = 1 << 10;

impl Default for LeafScratch {
    fn default() -> Self {
        Self {
            pairs: PairFinder::default(),
            vertex_table: Box::new([0; VERTEX_TABLE_SIZE]),
            leaf: 0,
            candidate_leaves: vec![],
            candidate_of_prim: vec![],
        }
    }
}

/// The distinct vertices of a leaf, and the triangles' corners as indices into these vertices.
struct LeafVertices {
    vertices: [u32; MAX_LEAF_TRIANGLES + 4],
    count: usize,
    corners: [[u8; 3]; MAX_LEAF_TRIANGLES],
    triangles: usize,
}

impl LeafScratch {
    /// Deduplicates the vertices of primitives; `None` if there are too many vertices or triangles for a leaf.
    #[inline(always)]
    fn dedup_vertices(&mut self, prims: &[PrimRef]) -> Option<LeafVertices> {
        // If there are too many triangles, the vertices need not be looked up.
        let count = |prim: &PrimRef| usize::from(self.pairs.pairs[prim.id as usize].count);
        if prims.iter().map(count).sum::<usize>() > MAX_LEAF_TRIANGLES {
            return None;
        }
        self.leaf += 1;
        if self.leaf >> 28 != 0 {
            self.vertex_table.fill(0);
            self.leaf = 1;
        }
        let leaf = u64::from(self.leaf);
        let mut shared = LeafVertices {
            vertices: [0; MAX_LEAF_TRIANGLES + 4],
            count: 0,
            corners: [[0; 3]; MAX_LEAF_TRIANGLES],
            triangles: 0,
        };
        for prim in prims {
            let pair = &self.pairs.pairs[prim.id as usize];
            let mut lanes = [0; 4];
            for (lane, &vertex) in lanes.iter_mut().zip(&pair.vertices) {
                let mut at = (vertex.wrapping_mul(0x9e37_79b1) >> 22) as usize % VERTEX_TABLE_SIZE;
                let key = u64::from(vertex) << 32 | leaf << 4;
                loop {
                    let found = self.vertex_table[at];
                    let here = found >> 4 & 0x0fff_ffff == leaf;
                    if here && found >> 32 != u64::from(vertex) {
                        at = (at + 1) % VERTEX_TABLE_SIZE;
                        continue;
                    }
                    *lane = if here { found as usize & 15 } else { shared.count };
                    shared.vertices[shared.count] = vertex;
                    shared.count += usize::from(!here);
                    self.vertex_table[at] = key | (*lane as u64 & 15);
                    break;
                }
            }
            if shared.count > MAX_LEAF_TRIANGLES {
                return None;
            }
            let lane = |k: u8| lanes[k as usize & 3] as u8;
            shared.corners[shared.triangles] = [lane(0), lane(1), lane(2)];
            if pair.count == 2 {
                shared.corners[shared.triangles + 1] = pair.second_corners.map(lane);
            }
            shared.triangles += pair.count as usize;
        }
        Some(shared)
    }
}

impl TrianglePrims<'_> {
    /// The bounds of a triangle as a primitive.
    #[inline(always)]
    fn prim_ref_of(&self, id: u32, corners: [u32; 3]) -> PrimRef {
        let [a, b, c] = corners.map(|i| self.vertex(i));
        let least = |a: f32, b: f32| if a < b { a } else { b };
        let most = |a: f32, b: f32| if a > b { a } else { b };
        let lower = std::array::from_fn(|i| least(least(a[i], b[i]), c[i]));
        let upper = std::array::from_fn(|i| most(most(a[i], b[i]), c[i]));
        PrimRef::new(lower, upper, id)
    }

    #[inline(always)]
    fn vertex(&self, index: u32) -> [f32; 3] {
        debug_assert!((index as usize) < self.vertices.len());
        // SAFETY: `validate_mesh` has checked that every corner index is less than the number of vertices.
        unsafe { self.vertices.get_unchecked(index as usize) }.map(|x| x * self.scale)
    }
}

impl PrimSource for TrianglePrims<'_> {
    fn count(&self) -> usize {
        self.triangles.len()
    }

    #[inline(always)]
    fn prim(&self, t: usize) -> PrimRef {
        self.prim_ref_of(t as u32, self.triangles[t])
    }

    fn prims(&self, ids: &[u32], prims: &mut Vec<PrimRef>) {
        prims.reserve(ids.len());
        let mut corners = [[0; 3]; 64];
        for ids in ids.chunks(corners.len()) {
            for (corners, &id) in corners.iter_mut().zip(ids) {
                *corners = self.triangles[id as usize];
                // Vertices may be scattered in memory, so all are prefetched before the first is read.
                for vertex in *corners {
                    prefetch(self.vertices.as_ptr().wrapping_add(vertex as usize));
                }
            }
            let made = ids.iter().zip(&corners).map(|(&id, &corners)| self.prim_ref_of(id, corners));
            prims.extend(made);
        }
    }
}

impl LeafBuilder for TrianglePrims<'_> {
    const LEAVES_ARE_BLOCKS: bool = true;
    const TYPICAL_LEAF_PRIMS: usize = 10;
    type Scratch = LeafScratch;

    #[inline(always)]
    fn begin_treelet(&self, prims: &mut [PrimRef], scratch: &mut LeafScratch) -> usize {
        scratch.candidate_leaves.clear();
        scratch.candidate_of_prim.clear();
        scratch.candidate_of_prim.resize(prims.len(), 0);
        scratch.pairs.pair_triangles(self.triangles, prims)
    }

    fn max_binary_leaf_prims(&self) -> usize {
        // Four pairs without a common vertex have 16 vertices, the maximum of a leaf.
        4
    }

    fn bin_count(&self, prims: usize) -> usize {
        match prims {
            // Large ranges require many bins, so that planes are close to the ends of the geometry.
            _ if prims > 16 * TREELET_SIZE => 256,
            _ if prims > TREELET_SIZE => 64,
            _ if prims < 24 => 8,
            _ => 16,
        }
    }

    fn size_estimate(&self) -> (usize, usize) {
        // The estimate is a third more blocks than meshes of hair require, which fill leaves less than other meshes.
        let blocks = (self.triangles.len() + self.vertices.len()) / 10;
        (blocks + 1, self.triangles.len())
    }

    fn sample_stride(&self) -> Option<usize> {
        Some(4)
    }

    #[inline(always)]
    fn same_geometry(&self, prims: &[PrimRef], scratch: &LeafScratch) -> bool {
        if self.mesh_offsets.len() < 2 {
            return true;
        }
        let triangle = |prim: &PrimRef| scratch.pairs.pairs[prim.id as usize].triangles[0];
        let mesh = |prim| self.mesh_offsets.partition_point(|first| *first <= triangle(prim));
        let first = mesh(&prims[0]);
        prims.iter().all(|prim| mesh(prim) == first)
    }

    #[inline(always)]
    fn fits(&self, prims: &[PrimRef], scratch: &mut LeafScratch) -> bool {
        if prims.len() > MAX_LEAF_TRIANGLES || !self.same_geometry(prims, scratch) {
            return false;
        }
        let shared = scratch.dedup_vertices(prims);
        let fits = shared.is_some();
        scratch.candidate_leaves.extend(shared);
        if fits {
            scratch.candidate_of_prim[prims[0].id as usize] = scratch.candidate_leaves.len() as u32;
        }
        fits
    }

    #[inline(always)]
    fn create_leaf(
        &self,
        prims: &[PrimRef],
        scratch: &mut LeafScratch,
        ids: &mut Vec<u32>,
        blocks: &mut Vec<NodeBlock>,
    ) -> NodeRef {
        // A binary leaf has at most 4 pairs and therefore at most 16 vertices; larger leaves were tested by `fits`.
        let made;
        let known = (scratch.candidate_of_prim[prims[0].id as usize] as usize).wrapping_sub(1);
        let shared = match scratch.candidate_leaves.get(known) {
            Some(shared) => shared,
            None => {
                made = scratch.dedup_vertices(prims);
                let Some(shared) = &made else { unreachable!("the primitives do not fit into a leaf") };
                shared
            }
        };
        debug_assert_eq!(
            shared.triangles,
            prims.iter().map(|prim| scratch.pairs.pairs[prim.id as usize].count as usize).sum()
        );
        let mut vertices = [[0.0; 3]; MAX_LEAF_TRIANGLES];
        for (vertex, &index) in vertices.iter_mut().zip(&shared.vertices[..shared.count]) {
            *vertex = self.vertex(index);
        }
        let leaf = NodeRef::leaf(blocks.len());
        let corners = &shared.corners[..shared.triangles];
        blocks.push(NodeBlock { leaf: LeafNode::new(&vertices[..shared.count], corners, ids.len() as u32) });
        for prim in prims {
            let pair = &scratch.pairs.pairs[prim.id as usize];
            ids.extend_from_slice(&pair.triangles[..pair.count as usize]);
        }
        leaf
    }
}
