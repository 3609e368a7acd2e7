//! Concatenation of treelets in their order, while further treelets are being built. Each treelet is copied once, from
//! the scratch memory in which it was built.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::mem::{MaybeUninit, take};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::build::traits::{BuildContext, LeafBuilder};
use crate::build::treelet::{Scratch, SubtreeRoot, Treelet, TreeletJob};
use crate::node::NodeBlock;
use crate::platform::huge_page_vec::{HugePageVec, copy_to_uninit};

/// All treelets, concatenated.
pub struct ConcatenatedTree {
    /// Nodes and leaves of the treelets, after the blocks reserved for the top of the tree.
    pub blocks: HugePageVec<NodeBlock>,
    pub ids: Vec<u32>,
    /// The roots of each treelet.
    pub roots: Vec<Vec<SubtreeRoot>>,
}

/// Blocks and ids of a treelet that does not fit into the estimated capacity.
type Overflow = (Box<[NodeBlock]>, Box<[u32]>);

/// Output memory that has not been written: blocks and ids.
type OutputSlices<'a> = (&'a mut [MaybeUninit<NodeBlock>], &'a mut [MaybeUninit<u32>]);

/// Assigns output ranges to treelets in order.
struct OrderedWriter<'a> {
    /// The next treelet in order.
    next: usize,
    /// Finished treelets with larger indices than `next`.
    out_of_order: BTreeMap<usize, Treelet>,
    /// Treelets whose memory can be reused.
    free_list: Vec<Treelet>,
    spare: OutputSlices<'a>,
    /// Number of blocks and ids assigned so far.
    used: [usize; 2],
    roots: Vec<Vec<SubtreeRoot>>,
    /// Treelets that do not fit into the estimated capacity.
    overflow: Vec<Overflow>,
}

/// A treelet with its output range.
struct ReservedTreelet<'a> {
    treelet: Treelet,
    starts: [usize; 2],
    spare: OutputSlices<'a>,
}

impl<'a> OrderedWriter<'a> {
    /// Assigns output ranges to a treelet and to the finished treelets that follow it.
    fn reserve<L: LeafBuilder>(&mut self, index: usize, treelet: Treelet) -> Vec<ReservedTreelet<'a>> {
        self.out_of_order.insert(index, treelet);
        let mut reserved = vec![];
        while let Some(mut treelet) = self.out_of_order.remove(&self.next) {
            self.next += 1;
            let starts = self.used;
            let lengths = [treelet.blocks.len(), treelet.ids.len()];
            self.used = [0, 1].map(|k| starts[k] + lengths[k]);
            self.roots.push(treelet.relocated_roots::<L>(starts));
            let (blocks, ids) = (&mut self.spare.0, &mut self.spare.1);
            if self.overflow.is_empty() && lengths[0] <= blocks.len() && lengths[1] <= ids.len() {
                let (here, rest) = take(blocks).split_at_mut(lengths[0]);
                let (ids_here, ids_rest) = take(ids).split_at_mut(lengths[1]);
                self.spare = (rest, ids_rest);
                reserved.push(ReservedTreelet { treelet, starts, spare: (here, ids_here) });
            } else {
                treelet.relocate::<L>(starts);
                let overflow = (treelet.blocks.as_slice().into(), treelet.ids.as_slice().into());
                self.overflow.push(overflow);
            }
        }
        reserved
    }
}

/// Builds and concatenates all treelets, with `free` unwritten blocks at the start.
pub fn build_and_concat<L: LeafBuilder>(
    jobs: Vec<TreeletJob>,
    free: usize,
    shared: &BuildContext<L>,
) -> ConcatenatedTree {
    let (expected_blocks, expected_ids) = shared.leaves.size_estimate();
    let mut pages = HugePageVec::with_capacity(free + expected_blocks);
    let mut ids = Vec::with_capacity(expected_ids);
    let output = Mutex::new(OrderedWriter {
        next: 0,
        out_of_order: BTreeMap::new(),
        free_list: vec![],
        spare: (&mut pages.spare_capacity_mut()[free..], ids.spare_capacity_mut()),
        used: [free, 0],
        roots: Vec::with_capacity(jobs.len()),
        overflow: vec![],
    });
    let count = jobs.len();
    let jobs = Mutex::new(jobs.into_iter().enumerate());
    let work = || {
        let mut scratch = None;
        loop {
            let Some((index, job)) = lock(&jobs).next() else { return };
            let mut treelet = lock(&output).free_list.pop().unwrap_or_default();
            treelet.build(job, shared, scratch.get_or_insert_with(Scratch::default));
            let reserved = lock(&output).reserve::<L>(index, treelet);
            for mut reserved in reserved {
                reserved.treelet.relocate::<L>(reserved.starts);
                copy_to_uninit(reserved.spare.0, &reserved.treelet.blocks);
                copy_to_uninit(reserved.spare.1, &reserved.treelet.ids);
                lock(&output).free_list.push(reserved.treelet);
            }
        }
    };
    // Each thread repeatedly builds the next treelet, so that few treelets finish out of order. A single treelet never
    // uses rayon, because the caller may not be in a pool.
    if count <= 1 {
        work();
    } else {
        let threads = rayon::current_num_threads().min(count);
        rayon::scope(|scope| (0..threads).for_each(|_| scope.spawn(|_| work())));
    }
    let output = output.into_inner().unwrap_or_else(PoisonError::into_inner);
    let OrderedWriter { used, roots, overflow, .. } = output;
    let missing = overflow.iter().fold([0; 2], |n, overflow| [n[0] + overflow.0.len(), n[1] + overflow.1.len()]);
    // SAFETY: all assigned blocks and ids outside the overflow have been written, except the `free` blocks at the
    // start, which are documented as unwritten.
    unsafe {
        pages.set_len_and_shrink(used[0] - missing[0]);
        ids.set_len(used[1] - missing[1]);
    }
    if overflow.is_empty() {
        return ConcatenatedTree { blocks: pages, ids, roots };
    }
    let mut parts = vec![Cow::Borrowed(&*pages)];
    for (blocks, late_ids) in overflow {
        ids.extend_from_slice(&late_ids);
        parts.push(Cow::Owned(blocks.into_vec()));
    }
    ConcatenatedTree { blocks: HugePageVec::concat_parallel(used[0], parts), ids, roots }
}

/// Locks a mutex, even if another thread has panicked while it held the lock; such a panic leaves no partial update.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
