//! The top of a large tree, built from a sample of its primitives: a k-d tree whose cells become treelets.
//!
//! Only the sample is binned and partitioned repeatedly. The remaining primitives are assigned to their cells once.
//! They are generated when their cell's treelet is built, so they are never all in memory at the same time.

use crate::build::traits::PrimSource;
use crate::limits::MAX_DEPTH;
use std::array;
use std::sync::Arc;

use rayon::prelude::*;

use crate::build::large_prims::LargePrimFilter;
use crate::build::parallel_split;
use crate::build::prim_ref::{PackedBounds, PrimInfo, PrimRef};
use crate::build::top_plan::{TopNode, TreeletInput};
use crate::build::traits::{BuildContext, LeafBuilder, TREELET_SIZE};
use crate::build::treelet::TreeletDesc;
use crate::simd::Portable;

/// Depth limit of cells, which leaves enough levels below to halve 2^32 primitives.
const MAX_KD_DEPTH: usize = MAX_DEPTH - 32;

/// A k-d tree over centroids.
enum KdNode {
    Split {
        bounds: PackedBounds,
        axis: usize,
        /// Centroids below this coordinate are on the left.
        at: f32,
        children: Box<[KdNode; 2]>,
    },
    Leaf(PackedBounds),
}

/// A node of the k-d tree, laid out for searching.
#[derive(Clone, Copy)]
struct KdStep {
    /// The split coordinate; infinity for a cell.
    at: f32,
    axis: u32,
    /// Index of the left child; the right child has the next index. A cell contains its own index.
    next: u32,
    /// The index of the cell; 0 for an inner node.
    cell: u32,
}

/// A cell's half-open box, which contains the centroids of the cell's primitives.
#[derive(Clone, Copy)]
struct CellBounds {
    lower: [f32; 3],
    upper: [f32; 3],
}

impl CellBounds {
    #[inline(always)]
    fn contains(&self, centroid: &[f32; 4]) -> bool {
        (0..3).fold(true, |inside, a| inside & (self.lower[a] <= centroid[a]) & (centroid[a] < self.upper[a]))
    }
}

/// The primitives of a contiguous range of the source, sorted by cell.
struct SortedChunk {
    /// Primitive ids, sorted by cell.
    ids: Vec<u32>,
    /// Offset in `ids` of each cell's first primitive, and the length of `ids`.
    starts: Vec<u32>,
}

impl SortedChunk {
    fn ids(&self, cell: usize) -> &[u32] {
        &self.ids[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// Builds the top of the tree from a sample of one in `rate` primitives. Returns the top (`None` if there are no
/// primitives) and the input of the treelets.
pub fn build_sampled_top<'a, L: LeafBuilder, S: PrimSource + ?Sized>(
    source: &'a S,
    rate: usize,
    shared: &BuildContext<L>,
) -> (Option<TopNode>, Vec<TreeletInput<'a>>) {
    let groups = source.count() / rate;
    let mut sample: Vec<_> = (0..groups)
        .into_par_iter()
        .with_min_len(TREELET_SIZE)
        .map(|group| source.prim(group * rate + sample_offset(group) % rate))
        .collect();
    let whole = parallel_split::prim_info(shared.dispatch, &sample);
    let large = LargePrimFilter::remove_from_sample(&mut sample, &whole);
    let range = match sample.len() == groups {
        true => whole,
        false => parallel_split::prim_info(shared.dispatch, &sample),
    };
    let node = build_kd(&mut sample, range, 1, (rate, shared));
    drop(sample);
    let mut tree = KdTree::default();
    let everywhere = CellBounds { lower: [f32::NEG_INFINITY; 3], upper: [f32::INFINITY; 3] };
    tree.steps.push(KdStep::EMPTY);
    tree.add(&node, 0, everywhere, 0);
    let size = source.count().div_ceil(MAX_CHUNKS).max(16 * TREELET_SIZE);
    let chunks: Vec<_> = (0..source.count().div_ceil(size))
        .into_par_iter()
        .map(|i| {
            let end = source.count().min((i + 1) * size);
            tree.bin_by_cell(source, i * size..end, large)
        })
        .collect();
    let mut finish = CellFinisher { source, shared, chunks: Arc::new(chunks), cells: 0, inputs: vec![] };
    // The cell of large primitives comes last, see [`KdTree::bin_by_cell`].
    let large = finish.cell(tree.regions.len(), whole.bounds, 1);
    let top = match (large, finish.top(&node, 1)) {
        (Some(large), Some(rest)) => Some(TopNode::Split(whole.bounds, Box::new([large, rest]))),
        (large, rest) => large.or(rest),
    };
    (top, finish.inputs)
}

/// Number of primitives whose cells are searched together.
const SEARCH_BATCH: usize = 16;

/// Maximum number of cell changes between consecutive primitives of a batch; after a batch with more changes, the cells
/// of the next batch are searched together.
const MAX_CELL_CHANGES: usize = 3;

/// Maximum number of chunks into which the primitives are divided.
const MAX_CHUNKS: usize = 64;

/// Position, modulo the group's size, of the sampled primitive within its group: pseudo-random, because the triangles
/// of regular meshes repeat periodically.
pub fn sample_offset(group: usize) -> usize {
    ((group as u32).wrapping_mul(0x9e37_79b1) >> 16) as usize
}

/// Splits the sample until each cell represents about [`TREELET_SIZE`] primitives.
fn build_kd<L: LeafBuilder>(
    prims: &mut [PrimRef],
    range: PrimInfo,
    depth: usize,
    (rate, shared): (usize, &BuildContext<L>),
) -> KdNode {
    if prims.len() > TREELET_SIZE / rate && depth < MAX_KD_DEPTH {
        let bins = shared.leaves.bin_count(prims.len() * rate);
        if let Some((mapping, plane)) = parallel_split::best_split(shared.dispatch, prims, &range, bins) {
            let (middle, left, right) = parallel_split::partition(shared.dispatch, prims, &mapping, &plane);
            let (a, b) = prims.split_at_mut(middle);
            let (a, b) = rayon::join(
                || build_kd(a, left, depth + 1, (rate, shared)),
                || build_kd(b, right, depth + 1, (rate, shared)),
            );
            return KdNode::Split {
                bounds: range.bounds,
                axis: plane.axis,
                at: plane.position(&mapping),
                children: Box::new([a, b]),
            };
        }
    }
    KdNode::Leaf(range.bounds)
}

/// Turns cells into treelets once all primitives are assigned.
struct CellFinisher<'a, 'b, L: LeafBuilder, S: ?Sized> {
    source: &'a S,
    shared: &'b BuildContext<'b, L>,
    chunks: Arc<Vec<SortedChunk>>,
    /// Number of cells finished so far.
    cells: usize,
    inputs: Vec<TreeletInput<'a>>,
}

impl<L: LeafBuilder, S: PrimSource + ?Sized> CellFinisher<'_, '_, L, S> {
    /// The binary tree over the cells; `None` if all are empty.
    fn top(&mut self, node: &KdNode, depth: usize) -> Option<TopNode> {
        match node {
            KdNode::Split { bounds, children, .. } => {
                let left = self.top(&children[0], depth + 1);
                let right = self.top(&children[1], depth + 1);
                match (left, right) {
                    (Some(left), Some(right)) => Some(TopNode::Split(*bounds, Box::new([left, right]))),
                    (left, right) => left.or(right),
                }
            }
            KdNode::Leaf(bounds) => {
                self.cells += 1;
                self.cell(self.cells - 1, *bounds, depth)
            }
        }
    }

    fn cell(&mut self, cell: usize, bounds: PackedBounds, depth: usize) -> Option<TopNode> {
        let (source, chunks) = (self.source, self.chunks.clone());
        let count = chunks.iter().map(|chunk| chunk.ids(cell).len()).sum();
        let make = move |prims: &mut Vec<PrimRef>| {
            chunks.iter().for_each(|chunk| source.prims(chunk.ids(cell), prims));
        };
        if count > 2 * TREELET_SIZE {
            // The sample contained too few of these primitives, or none, to split the cell further.
            let mut prims = Vec::with_capacity(count);
            make(&mut prims);
            let range = parallel_split::prim_info(self.shared.dispatch, &prims);
            let top = parallel_split::split_to_treelets(&mut prims, range, depth, self.shared);
            self.inputs.push(TreeletInput::Prims(prims));
            return Some(top);
        }
        if count == 0 {
            return None;
        }
        self.inputs.push(TreeletInput::Deferred(Box::new(make)));
        Some(TopNode::Treelet(TreeletDesc { bounds, count, depth }))
    }
}

/// The k-d tree as an array of steps, for searching.
#[derive(Default)]
struct KdTree {
    steps: Vec<KdStep>,
    regions: Vec<CellBounds>,
    /// The largest depth of a cell.
    depth: usize,
}

impl KdStep {
    const EMPTY: KdStep = KdStep { at: f32::INFINITY, axis: 0, next: 0, cell: 0 };
}

impl KdTree {
    /// Adds the subtree of `node` at `depth`.
    fn add(&mut self, node: &KdNode, step: usize, region: CellBounds, depth: usize) {
        let KdNode::Split { axis, at, children, .. } = node else {
            self.steps[step] = KdStep { next: step as u32, cell: self.regions.len() as u32, ..KdStep::EMPTY };
            self.regions.push(region);
            self.depth = self.depth.max(depth);
            return;
        };
        let next = self.steps.len();
        self.steps.extend([KdStep::EMPTY; 2]);
        self.steps[step] = KdStep { at: *at, axis: *axis as u32, next: next as u32, cell: 0 };
        let (mut left, mut right) = (region, region);
        (left.upper[*axis], right.lower[*axis]) = (*at, *at);
        self.add(&children[0], next, left, depth + 1);
        self.add(&children[1], next + 1, right, depth + 1);
    }

    /// Finds the cells of several centroids, which descend level by level together so that their memory loads overlap.
    #[inline(always)]
    fn find_cells<const N: usize>(&self, centroids: &[[f32; 4]; N]) -> [u32; N] {
        let mut at = [0; N];
        for _ in 0..self.depth {
            for (at, centroid) in at.iter_mut().zip(centroids) {
                let step = &self.steps[*at as usize];
                *at = step.next + u32::from(centroid[step.axis as usize & 3] >= step.at);
            }
        }
        at.map(|at| self.steps[at as usize].cell)
    }

    /// Sorts primitives by cell; large primitives have a separate cell, which comes last.
    fn bin_by_cell<S: PrimSource + ?Sized>(
        &self,
        source: &S,
        prims: std::ops::Range<usize>,
        large: LargePrimFilter,
    ) -> SortedChunk {
        let large_cell = self.regions.len() as u32;
        let mut starts = vec![0; self.regions.len() + 2];
        let mut cells = Vec::with_capacity(prims.len());
        let (mut cell, mut scattered) = (0, false);
        for first in prims.clone().step_by(SEARCH_BATCH) {
            let here = first..prims.end.min(first + SEARCH_BATCH);
            let (mut found, mut changes) = ([large_cell; SEARCH_BATCH], 0);
            if scattered {
                let prim = |i: usize| source.prim(here.end.min(first + i + 1) - 1);
                let made: [_; SEARCH_BATCH] = array::from_fn(prim);
                let of_all: [_; SEARCH_BATCH] = self.find_cells(&array::from_fn(|i| made[i].centroid().array()));
                for ((found, prim), of_this) in found.iter_mut().zip(&made).zip(of_all) {
                    if !large.matches::<Portable>(prim) {
                        changes += usize::from(cell != of_this);
                        cell = of_this;
                        *found = cell;
                    }
                }
            } else {
                for (found, at) in found.iter_mut().zip(here.clone()) {
                    let prim = source.prim(at);
                    if !large.matches::<Portable>(&prim) {
                        let centroid = prim.centroid().array();
                        // Neighbouring primitives are usually in the same cell.
                        if !self.regions[cell as usize].contains(&centroid) {
                            [cell] = self.find_cells(&[centroid]);
                            changes += 1;
                        }
                        *found = cell;
                    }
                }
            }
            scattered = changes > MAX_CELL_CHANGES;
            for cell in &found[..here.len()] {
                cells.push(*cell);
                starts[*cell as usize] += 1;
            }
        }
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        let mut ids = vec![0; prims.len()];
        for (id, cell) in prims.rev().zip(cells.into_iter().rev()) {
            let start = &mut starts[cell as usize];
            *start -= 1;
            ids[*start as usize] = id as u32;
        }
        SortedChunk { ids, starts }
    }
}
