//! The top of a large tree, chosen from a sample of its items: cells of space, each of which becomes a treelet.
//!
//! Only the sample is binned and moved, over and over. All other items are looked at once, to see into which cell they
//! fall, and made where that is built: they never stand in memory all together.

use std::array;
use std::sync::Arc;

use rayon::prelude::*;

use crate::build::large_prims::Large;
use crate::build::prim_ref::{Item, Octet, Range};
use crate::build::top_plan::{Stock, Top};
use crate::build::treelet::Part;
use crate::build::{Leaves, MAX_DEPTH, Shared, TREELET, parallel_split};
use crate::simd::Portable;

/// Cells are cut to this depth: below it there are levels left to halve as many items as there can be.
const DEEPEST: usize = MAX_DEPTH - 32;

/// What a tree is built over.
pub trait Source: Sync {
    /// How many there are.
    fn count(&self) -> usize;
    /// The box of one.
    fn item(&self, at: usize) -> Item;

    /// Asks for the memory that some are made of, where it may not be at hand, if there are that many.
    #[inline(always)]
    fn ask(&self, _items: std::ops::Range<usize>) {}

    /// The boxes of some, after those that are there.
    fn items(&self, ids: &[u32], items: &mut Vec<Item>) {
        items.extend(ids.iter().map(|&id| self.item(id as usize)));
    }
}

impl Source for [Item] {
    fn count(&self) -> usize {
        self.len()
    }

    fn item(&self, at: usize) -> Item {
        self[at]
    }
}

/// Space cut in two, over and over.
enum Cut {
    Plane {
        bounds: Octet,
        axis: usize,
        /// Centres below it are on the left.
        at: f32,
        halves: Box<[Cut; 2]>,
    },
    Cell(Octet),
}

/// A node of the tree of planes, as it is searched.
#[derive(Clone, Copy)]
struct Step {
    /// Nothing is on the right of a cell's.
    at: f32,
    axis: u32,
    /// The left child, which the right one follows; of a cell it is the cell itself.
    next: u32,
    /// The number of the cell.
    cell: u32,
}

/// Which centres are in a cell.
#[derive(Clone, Copy)]
struct Region {
    lower: [f32; 3],
    upper: [f32; 3],
}

impl Region {
    #[inline(always)]
    fn holds(&self, centre: &[f32; 4]) -> bool {
        (0..3).fold(true, |inside, a| {
            inside & (self.lower[a] <= centre[a]) & (centre[a] < self.upper[a])
        })
    }
}

/// Some items that stand together in what was given.
struct Chunk {
    /// Sorted by cell.
    ids: Vec<u32>,
    /// Where each cell starts, and the end.
    starts: Vec<u32>,
}

impl Chunk {
    fn ids(&self, cell: usize) -> &[u32] {
        &self.ids[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// The top of the tree over many items, found by looking at one of `rate`, and what the treelets are made of.
pub fn divide<'a, L: Leaves, S: Source + ?Sized>(
    source: &'a S,
    rate: usize,
    shared: &Shared<L>,
) -> (Option<Top>, Vec<Stock<'a>>) {
    let groups = source.count() / rate;
    let mut sample: Vec<_> = (0..groups)
        .into_par_iter()
        .with_min_len(TREELET)
        .map(|group| source.item(group * rate + jitter(group) % rate))
        .collect();
    let whole = parallel_split::range(shared.machine, &sample);
    let large = Large::taken(&mut sample, &whole);
    let range = match sample.len() == groups {
        true => whole,
        false => parallel_split::range(shared.machine, &sample),
    };
    let cut = cut(&mut sample, range, 1, (rate, shared));
    drop(sample);
    let mut tree = Planes::default();
    let everywhere = Region {
        lower: [f32::NEG_INFINITY; 3],
        upper: [f32::INFINITY; 3],
    };
    tree.steps.push(Step::EMPTY);
    tree.add(&cut, 0, everywhere, 0);
    let size = source.count().div_ceil(CHUNKS).max(16 * TREELET);
    let chunks: Vec<_> = (0..source.count().div_ceil(size))
        .into_par_iter()
        .map(|i| {
            let end = source.count().min((i + 1) * size);
            tree.sort(source, i * size..end, large)
        })
        .collect();
    let mut finish = Finish {
        source,
        shared,
        chunks: Arc::new(chunks),
        cells: 0,
        stocks: vec![],
    };
    // Their cell comes after all others, see [`Planes::sort`].
    let large = finish.cell(tree.regions.len(), whole.bounds, 1);
    let top = match (large, finish.top(&cut, 1)) {
        (Some(large), Some(rest)) => Some(Top::Split(whole.bounds, Box::new([large, rest]))),
        (large, rest) => large.or(rest),
    };
    (top, finish.stocks)
}

/// How many items are asked for at a time, before they are made.
const ASKED: usize = 16;

/// Of so many items more than this are elsewhere than the one before where it pays to look for all of them.
const SCATTERED: usize = 3;

/// The most chunks.
const CHUNKS: usize = 64;

/// Which items of a group are in the sample: not always the same one, or it would be always the same side of every house.
pub fn jitter(group: usize) -> usize {
    ((group as u32).wrapping_mul(0x9e37_79b1) >> 16) as usize
}

/// Cuts until about [`TREELET`] items are left in each cell.
fn cut<L: Leaves>(
    items: &mut [Item],
    range: Range,
    depth: usize,
    (rate, shared): (usize, &Shared<L>),
) -> Cut {
    if items.len() > TREELET / rate && depth < DEEPEST {
        let bins = shared.leaves.bins(items.len() * rate);
        if let Some((binning, plane)) = parallel_split::plane(shared.machine, items, &range, bins) {
            let (middle, left, right) =
                parallel_split::partition(shared.machine, items, &binning, &plane);
            let (a, b) = items.split_at_mut(middle);
            let (a, b) = rayon::join(
                || cut(a, left, depth + 1, (rate, shared)),
                || cut(b, right, depth + 1, (rate, shared)),
            );
            return Cut::Plane {
                bounds: range.bounds,
                axis: plane.axis,
                at: plane.at(&binning),
                halves: Box::new([a, b]),
            };
        }
    }
    Cut::Cell(range.bounds)
}

/// What is left to do once all items are in cells.
struct Finish<'a, 'b, L: Leaves, S: ?Sized> {
    source: &'a S,
    shared: &'b Shared<'b, L>,
    chunks: Arc<Vec<Chunk>>,
    /// How many are done.
    cells: usize,
    stocks: Vec<Stock<'a>>,
}

impl<L: Leaves, S: Source + ?Sized> Finish<'_, '_, L, S> {
    /// The tree of cells; `None` where nothing is.
    fn top(&mut self, cut: &Cut, depth: usize) -> Option<Top> {
        match cut {
            Cut::Plane { bounds, halves, .. } => {
                let left = self.top(&halves[0], depth + 1);
                let right = self.top(&halves[1], depth + 1);
                match (left, right) {
                    (Some(left), Some(right)) => Some(Top::Split(*bounds, Box::new([left, right]))),
                    (left, right) => left.or(right),
                }
            }
            Cut::Cell(bounds) => {
                self.cells += 1;
                self.cell(self.cells - 1, *bounds, depth)
            }
        }
    }

    fn cell(&mut self, cell: usize, bounds: Octet, depth: usize) -> Option<Top> {
        let (source, chunks) = (self.source, self.chunks.clone());
        let count = chunks.iter().map(|chunk| chunk.ids(cell).len()).sum();
        let make = move |items: &mut Vec<Item>| {
            chunks
                .iter()
                .for_each(|chunk| source.items(chunk.ids(cell), items));
        };
        if count > 2 * TREELET {
            // The sample did not show them, or not that they lie apart.
            let mut items = Vec::with_capacity(count);
            make(&mut items);
            let range = parallel_split::range(self.shared.machine, &items);
            let top = parallel_split::divide(&mut items, range, depth, self.shared);
            self.stocks.push(Stock::Items(items));
            return Some(top);
        }
        if count == 0 {
            return None;
        }
        self.stocks.push(Stock::Made(Box::new(make)));
        Some(Top::Part(Part {
            bounds,
            count,
            depth,
        }))
    }
}

/// The planes, in an order in which they are searched.
#[derive(Default)]
struct Planes {
    steps: Vec<Step>,
    regions: Vec<Region>,
    /// How many planes there are above a cell at most.
    depth: usize,
}

impl Step {
    const EMPTY: Step = Step {
        at: f32::INFINITY,
        axis: 0,
        next: 0,
        cell: 0,
    };
}

impl Planes {
    /// Adds what is below `depth` planes.
    fn add(&mut self, cut: &Cut, step: usize, region: Region, depth: usize) {
        let Cut::Plane {
            axis, at, halves, ..
        } = cut
        else {
            self.steps[step] = Step {
                next: step as u32,
                cell: self.regions.len() as u32,
                ..Step::EMPTY
            };
            self.regions.push(region);
            self.depth = self.depth.max(depth);
            return;
        };
        let next = self.steps.len();
        self.steps.extend([Step::EMPTY; 2]);
        self.steps[step] = Step {
            at: *at,
            axis: *axis as u32,
            next: next as u32,
            cell: 0,
        };
        let (mut left, mut right) = (region, region);
        (left.upper[*axis], right.lower[*axis]) = (*at, *at);
        self.add(&halves[0], next, left, depth + 1);
        self.add(&halves[1], next + 1, right, depth + 1);
    }

    /// The cells of some centres: one step of all of them after the other, so that none waits for what another loads.
    #[inline(always)]
    fn search<const N: usize>(&self, centres: &[[f32; 4]; N]) -> [u32; N] {
        let mut at = [0; N];
        for _ in 0..self.depth {
            for (at, centre) in at.iter_mut().zip(centres) {
                let step = &self.steps[*at as usize];
                *at = step.next + u32::from(centre[step.axis as usize & 3] >= step.at);
            }
        }
        at.map(|at| self.steps[at as usize].cell)
    }

    /// Sorts items by their cells, large ones into another after those.
    fn sort<S: Source + ?Sized>(
        &self,
        source: &S,
        items: std::ops::Range<usize>,
        large: Large,
    ) -> Chunk {
        let apart = self.regions.len() as u32;
        let mut starts = vec![0; self.regions.len() + 2];
        let mut cells = Vec::with_capacity(items.len());
        let (mut cell, mut scattered) = (0, false);
        for first in items.clone().step_by(ASKED) {
            let here = first..items.end.min(first + ASKED);
            source.ask(here.end..here.end + ASKED);
            let (mut found, mut moves) = ([apart; ASKED], 0);
            if scattered {
                let item = |i: usize| source.item(here.end.min(first + i + 1) - 1);
                let made: [_; ASKED] = array::from_fn(item);
                let of_all: [_; ASKED] = self.search(&array::from_fn(|i| made[i].centre().array()));
                for ((found, item), of_this) in found.iter_mut().zip(&made).zip(of_all) {
                    if !large.is::<Portable>(item) {
                        moves += usize::from(cell != of_this);
                        cell = of_this;
                        *found = cell;
                    }
                }
            } else {
                for (found, at) in found.iter_mut().zip(here.clone()) {
                    let item = source.item(at);
                    if !large.is::<Portable>(&item) {
                        let centre = item.centre().array();
                        // Most are where the one before is.
                        if !self.regions[cell as usize].holds(&centre) {
                            [cell] = self.search(&[centre]);
                            moves += 1;
                        }
                        *found = cell;
                    }
                }
            }
            scattered = moves > SCATTERED;
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
        let mut ids = vec![0; items.len()];
        for (id, cell) in items.rev().zip(cells.into_iter().rev()) {
            let start = &mut starts[cell as usize];
            *start -= 1;
            ids[*start as usize] = id as u32;
        }
        Chunk { ids, starts }
    }
}
