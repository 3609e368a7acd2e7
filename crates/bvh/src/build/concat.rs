//! Brings treelets into the tree while they are built: each goes to where the one before it ends, straight from the
//! memory it was built in, which is used again for another.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::mem::{MaybeUninit, take};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::build::treelet::{Job, Root, Scratch, Treelet};
use crate::build::{Leaves, Shared};
use crate::node::NodeBlock;
use crate::platform::huge_page_vec::{Pages, write};

/// All treelets, one after the other.
pub struct Joined {
    /// Those that were left free for the nodes above come first.
    pub blocks: Pages<NodeBlock>,
    pub ids: Vec<u32>,
    /// By treelet.
    pub roots: Vec<Vec<Root>>,
}

/// Blocks and ids that found no room.
type Late = (Box<[NodeBlock]>, Box<[u32]>);

/// What is free for blocks and for ids.
type Room<'a> = (&'a mut [MaybeUninit<NodeBlock>], &'a mut [MaybeUninit<u32>]);

/// Where the next treelet goes.
struct Output<'a> {
    /// It: all before it have their places.
    next: usize,
    /// Those after it that are built.
    waiting: BTreeMap<usize, Treelet>,
    /// Those that are in their places: for others.
    idle: Vec<Treelet>,
    room: Room<'a>,
    /// How many blocks and ids there are so far.
    used: [usize; 2],
    roots: Vec<Vec<Root>>,
    /// Once there is no more room: those that follow.
    late: Vec<Late>,
}

/// A treelet and where it goes.
struct Placed<'a> {
    treelet: Treelet,
    starts: [usize; 2],
    room: Room<'a>,
}

impl<'a> Output<'a> {
    /// Takes a treelet; gives places to it and to those that waited for it.
    fn take<L: Leaves>(&mut self, number: usize, treelet: Treelet) -> Vec<Placed<'a>> {
        self.waiting.insert(number, treelet);
        let mut placed = vec![];
        while let Some(mut treelet) = self.waiting.remove(&self.next) {
            self.next += 1;
            let starts = self.used;
            let lengths = [treelet.blocks.len(), treelet.ids.len()];
            self.used = [0, 1].map(|k| starts[k] + lengths[k]);
            self.roots.push(treelet.moved_roots::<L>(starts));
            let (blocks, ids) = (&mut self.room.0, &mut self.room.1);
            if self.late.is_empty() && lengths[0] <= blocks.len() && lengths[1] <= ids.len() {
                let (here, rest) = take(blocks).split_at_mut(lengths[0]);
                let (ids_here, ids_rest) = take(ids).split_at_mut(lengths[1]);
                self.room = (rest, ids_rest);
                placed.push(Placed {
                    treelet,
                    starts,
                    room: (here, ids_here),
                });
            } else {
                treelet.relocate::<L>(starts);
                let late = (
                    treelet.blocks.as_slice().into(),
                    treelet.ids.as_slice().into(),
                );
                self.late.push(late);
            }
        }
        placed
    }
}

/// Builds all treelets and joins them, leaving `free` blocks at the start. Those are not written.
pub fn join<L: Leaves>(jobs: Vec<Job>, free: usize, shared: &Shared<L>) -> Joined {
    let (expected_blocks, expected_ids) = shared.leaves.expected();
    let mut pages = Pages::with_capacity(free + expected_blocks);
    let mut ids = Vec::with_capacity(expected_ids);
    let output = Mutex::new(Output {
        next: 0,
        waiting: BTreeMap::new(),
        idle: vec![],
        room: (&mut pages.room()[free..], ids.spare_capacity_mut()),
        used: [free, 0],
        roots: Vec::with_capacity(jobs.len()),
        late: vec![],
    });
    let threads = rayon::current_num_threads().min(jobs.len());
    let jobs = Mutex::new(jobs.into_iter().enumerate());
    let work = || {
        let mut scratch = None;
        loop {
            let Some((number, job)) = lock(&jobs).next() else {
                return;
            };
            let mut treelet = lock(&output).idle.pop().unwrap_or_default();
            treelet.build(job, shared, scratch.get_or_insert_with(Scratch::default));
            let placed = lock(&output).take::<L>(number, treelet);
            for mut placed in placed {
                placed.treelet.relocate::<L>(placed.starts);
                write(placed.room.0, &placed.treelet.blocks);
                write(placed.room.1, &placed.treelet.ids);
                lock(&output).idle.push(placed.treelet);
            }
        }
    };
    // In turn, not by halves: few wait then for those before them.
    rayon::scope(|scope| (0..threads).for_each(|_| scope.spawn(|_| work())));
    let output = output.into_inner().unwrap_or_else(PoisonError::into_inner);
    let Output {
        used, roots, late, ..
    } = output;
    let missing = late
        .iter()
        .fold([0; 2], |n, late| [n[0] + late.0.len(), n[1] + late.1.len()]);
    // SAFETY: what is used and did not come late is written, but for the free ones, of which that is said.
    unsafe {
        pages.finish(used[0] - missing[0]);
        ids.set_len(used[1] - missing[1]);
    }
    if late.is_empty() {
        return Joined {
            blocks: pages,
            ids,
            roots,
        };
    }
    let mut parts = vec![Cow::Borrowed(&*pages)];
    for (blocks, late_ids) in late {
        ids.extend_from_slice(&late_ids);
        parts.push(Cow::Owned(blocks.into_vec()));
    }
    Joined {
        blocks: Pages::collect(used[0], parts),
        ids,
        roots,
    }
}

/// What was locked when a thread panicked was left whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
