//! Traversal stacks of single rays and of packets.

use std::mem::MaybeUninit;

use std::hint::select_unpredictable;

use crate::limits::MAX_DEPTH;
use crate::node::{NodeRef, WideNode};
use crate::simd::{Isa, Vector};

/// Capacity of a stack. A path has at most `MAX_DEPTH` nodes in the TLAS and as many in a BLAS, and each node leaves at
/// most 7 children on the stack. Both trees have a sentinel, and [`Stack::push`] writes 8 entries at once. With eight
/// more entries, the size of a ray state is an odd number of cache lines, see
/// [`crate::traverse::single::ray_state::RayState`].
const STACK_SIZE: usize = 2 * (7 * MAX_DEPTH + 1) + 8 + 8;

/// Node references with the t at which the ray enters them.
pub struct Stack {
    pub len: usize,
    nodes: [MaybeUninit<NodeRef>; STACK_SIZE],
    enter: [MaybeUninit<f32>; STACK_SIZE],
}

impl Stack {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            len: 0,
            nodes: [const { MaybeUninit::uninit() }; STACK_SIZE],
            enter: [const { MaybeUninit::uninit() }; STACK_SIZE],
        }
    }

    /// Pushes the children of the nonempty `mask`, with near children on top; returns the nearest child instead of
    /// pushing it.
    #[inline(always)]
    pub fn push<I: Isa>(&mut self, node: &WideNode, enter: I::F32x8, mask: u32) -> NodeRef {
        self.push_ordered::<I>(node, enter, mask).0
    }

    /// Same as [`Stack::push`]; also returns the permutation that sorts the lanes, with the nearest last.
    #[inline(always)]
    fn push_ordered<I: Isa>(&mut self, node: &WideNode, enter: I::F32x8, mask: u32) -> (NodeRef, I::Permutation) {
        debug_assert!(self.len + 8 <= STACK_SIZE && mask != 0);
        // SAFETY: the depth of trees is limited, so that `STACK_SIZE` leaves room for 8 more entries (see its
        // documentation). References are stored as floats, with which no arithmetic is done.
        unsafe {
            let order = I::sort_descending(enter, mask);
            let child = I::permute8(I::F32x8::load(node.children.as_ptr().cast()), order);
            child.store(self.nodes.as_mut_ptr().add(self.len).cast());
            let enter = I::permute8(enter, order);
            enter.store(self.enter.as_mut_ptr().add(self.len).cast());
            self.len += mask.count_ones() as usize - 1;
            (self.nodes.get_unchecked(self.len).assume_init(), order)
        }
    }

    /// Pushes [`NodeRef::EMPTY`], which [`Stack::pop_unchecked`] returns at the end of a tree.
    #[inline(always)]
    pub fn push_sentinel(&mut self) {
        debug_assert!(self.len < STACK_SIZE);
        // SAFETY: the depth of trees is limited, so that `STACK_SIZE` leaves room (see its documentation).
        unsafe { self.nodes.get_unchecked_mut(self.len) }.write(NodeRef::EMPTY);
        self.len += 1;
    }

    /// Pops an entry above a sentinel, regardless of its distance.
    #[inline(always)]
    pub fn pop_unchecked(&mut self) -> NodeRef {
        debug_assert!(self.len > 0);
        self.len -= 1;
        // SAFETY: entries below the previous `len` have been written; a stack with a sentinel is not empty before the
        // sentinel is removed.
        unsafe { self.nodes.get_unchecked(self.len).assume_init() }
    }

    /// Returns [`Stack::pop_unchecked`] if `done` is true, otherwise `at`. Branch-free.
    #[inline(always)]
    pub fn pop_if(&mut self, done: bool, at: NodeRef) -> NodeRef {
        debug_assert!(self.len > 0);
        // SAFETY: as in `pop_unchecked`.
        let last = unsafe { self.nodes.get_unchecked(self.len - 1).assume_init() };
        self.len -= usize::from(done);
        select_unpredictable(done, last, at)
    }

    /// Pushes all children of `mask` except one, which is returned: with `WITH_DISTANCE` the nearest child, otherwise
    /// the last child. If `mask` is empty, pops an entry instead. Branch-free, because the case is unpredictable.
    #[inline(always)]
    pub fn push_children_or_pop<I: Isa, const WITH_DISTANCE: bool>(
        &mut self,
        node: &WideNode,
        enter: I::F32x8,
        mask: <I::F32x8 as Vector>::Mask,
    ) -> NodeRef {
        debug_assert!(self.len > 0 && self.len + 8 <= STACK_SIZE);
        let lane = I::argmin(enter, mask);
        let mask = <I::F32x8 as Vector>::to_bitmask(mask);
        let rest = mask & !(1 << lane);
        // SAFETY: as in `push` and `pop_unchecked`.
        unsafe {
            let child = I::compress(I::F32x8::load(node.children.as_ptr().cast()), rest);
            child.store(self.nodes.as_mut_ptr().add(self.len).cast());
            if WITH_DISTANCE {
                let enter = I::compress(enter, rest);
                enter.store(self.enter.as_mut_ptr().add(self.len).cast());
            }
            // The code selects an address, because the compiler would turn the selection of a value into a branch.
            let last = self.nodes.as_ptr().add(self.len - 1).cast();
            let next = select_unpredictable(mask == 0, last, node.children.as_ptr().add(lane));
            self.len = self.len + rest.count_ones() as usize - usize::from(mask == 0);
            *next
        }
    }

    /// Removes the entries from `base` on that the ray enters after `t_max`.
    #[inline(always)]
    pub fn cull(&mut self, base: usize, t_max: f32) {
        let mut len = base;
        for i in base..self.len {
            // SAFETY: entries below `len` were written by `push`.
            unsafe {
                let enter = self.enter.get_unchecked(i).assume_init();
                *self.nodes.get_unchecked_mut(len) = *self.nodes.get_unchecked(i);
                self.enter.get_unchecked_mut(len).write(enter);
                len += usize::from(enter <= t_max);
            }
        }
        self.len = len;
    }

    /// Pops the last entry above `base` that the ray enters no later than `t_max`.
    #[inline(always)]
    pub fn pop(&mut self, base: usize, t_max: f32) -> Option<NodeRef> {
        while self.len > base {
            self.len -= 1;
            // SAFETY: entries below the previous `len` were written by `push`.
            let (child, enter) = unsafe {
                (self.nodes.get_unchecked(self.len).assume_init(), self.enter.get_unchecked(self.len).assume_init())
            };
            if enter <= t_max {
                return Some(child);
            }
        }
        None
    }
}

/// Node references with the rays of a packet that enter them.
pub struct MaskStack {
    len: usize,
    entries: [MaybeUninit<(NodeRef, u64)>; STACK_SIZE],
}

impl MaskStack {
    #[inline(always)]
    pub fn new() -> Self {
        Self { len: 0, entries: [const { MaybeUninit::uninit() }; STACK_SIZE] }
    }

    #[inline(always)]
    pub fn push(&mut self, child: NodeRef, mask: u64) {
        debug_assert!(self.len < STACK_SIZE);
        // SAFETY: the depth of trees is limited, so that the length is less than `STACK_SIZE` (see its documentation).
        unsafe { self.entries.get_unchecked_mut(self.len) }.write((child, mask));
        self.len += 1;
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<(NodeRef, u64)> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: entries below the previous `len` were written by `push`.
        Some(unsafe { self.entries.get_unchecked(self.len).assume_init() })
    }
}

/// A [`Stack`] for a packet, which also stores the rays that enter each node.
pub struct PacketStack {
    stack: Stack,
    rays: [MaybeUninit<u64>; STACK_SIZE],
}

/// The numbers of the eight lanes, as bits of floats.
static LANE_IDS: [u32; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

impl PacketStack {
    #[inline(always)]
    pub fn new() -> Self {
        Self { stack: Stack::new(), rays: [const { MaybeUninit::uninit() }; STACK_SIZE] }
    }

    /// Same as [`Stack::push`]; `entered` contains the rays that enter each child. Also returns the rays that enter the
    /// nearest child.
    #[inline(always)]
    pub fn push<I: Isa>(&mut self, node: &WideNode, enter: I::F32x8, mask: u32, entered: &[u64; 8]) -> (NodeRef, u64) {
        let len = self.stack.len;
        let (child, order) = self.stack.push_ordered::<I>(node, enter, mask);
        let mut lanes = [0u32; 8];
        // SAFETY: both arrays contain eight words; words that are not floats are only moved.
        unsafe { I::permute8(I::F32x8::load(LANE_IDS.as_ptr().cast()), order).store(lanes.as_mut_ptr().cast()) };
        // All eight entries are always written, because a branch on their number would often be mispredicted.
        for (i, lane) in lanes.iter().enumerate() {
            // SAFETY: `STACK_SIZE` leaves room for 8 more entries than `len`, see `push_ordered`.
            unsafe { self.rays.get_unchecked_mut(len + i) }.write(entered[*lane as usize & 7]);
        }
        let nearest = lanes[(self.stack.len - len) & 7];
        (child, entered[nearest as usize & 7])
    }

    /// Same as [`Stack::pop`]; also returns the rays that enter the node, and the earliest t at which a ray enters it.
    #[inline(always)]
    pub fn pop(&mut self, t_max: f32) -> Option<(NodeRef, u64, f32)> {
        let child = self.stack.pop(0, t_max)?;
        let last = self.stack.len;
        // SAFETY: `push` writes both values next to the child that was removed.
        let (rays, enter) = unsafe {
            (self.rays.get_unchecked(last).assume_init(), self.stack.enter.get_unchecked(last).assume_init())
        };
        Some((child, rays, enter))
    }
}
