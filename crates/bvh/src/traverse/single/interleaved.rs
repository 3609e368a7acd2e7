//! Interleaved traversal of incoherent rays, similar to AMAC (O. Kocberber, B. Falsafi and B. Grot, "Asynchronous
//! Memory Access Chaining", VLDB 2015).
//!
//! One thread advances 24 rays in turn, so that the prefetch for one ray overlaps the work for the other rays. Rays at
//! nodes and rays at leaves are processed in separate loops, because the kind of a ray's next step is unpredictable.
//! The rays that are ready for each kind of step are a bit mask; a queue in memory would add a store-to-load dependency
//! per step.

use std::mem::MaybeUninit;

use crate::node::NodeRef;
use crate::scene::Scene;
use crate::simd::Isa;

/// Number of rays that a thread advances in turn.
const RAYS_IN_FLIGHT: usize = 24;

/// Up to this number of rays, [`traverse_rays`] traces the rays one after the other, because creating all states would
/// take longer.
const FEW_RAYS: usize = 2;

/// If at most this number of rays are at nodes, these rays wait while rays at leaves advance.
const MAX_WAITING_NODES: u32 = 8;

/// A ray in flight, advanced one step at a time.
pub trait RayInFlight<'a> {
    /// The next node, leaf or instance; [`NodeRef::EMPTY`] at the end of a tree.
    fn node(&self) -> NodeRef;

    /// True while the ray is in the TLAS, whose leaves are instances.
    fn is_in_tlas(&self) -> bool;

    /// Tests the ray against the children of one inner node.
    fn step_node<I: Isa>(&mut self);

    /// Tests one leaf; returns true if triangles remain for [`RayInFlight::step_triangles`].
    fn step_leaf<I: Isa>(&mut self) -> bool;

    /// Loads a triangle for [`RayInFlight::step_triangles`]; a separate loop overlaps the loads of many rays.
    #[inline(always)]
    fn load_triangle<I: Isa>(&mut self) {}

    /// Intersects the remaining triangles of a leaf.
    fn step_triangles<I: Isa>(&mut self);

    /// Enters or leaves an instance; returns true if the ray is done.
    fn step_instance(&mut self, scene: &'a Scene) -> bool;
}

/// Source of rays and sink of their hits.
pub trait RaySource<R> {
    /// Starts the next ray that may hit anything; returns false if no such ray is left.
    fn start(&mut self, state: &mut R) -> bool;

    /// Stores the hit of a ray that is done.
    fn finish(&mut self, state: &mut R);
}

/// Bit masks of the ray states, by the kind of their next step; bit i is state i.
#[derive(Default)]
struct ReadyMasks {
    nodes: u32,
    /// Rays at leaves, in the TLAS or in a BLAS.
    leaves: u32,
    /// Rays that have reached the end of a tree.
    finished: u32,
    /// Rays in the TLAS, whose leaves are instances.
    in_tlas: u32,
}

impl ReadyMasks {
    /// Adds a new state, or a state after a step within its tree.
    #[inline(always)]
    fn add<'a>(&mut self, i: u32, state: &impl RayInFlight<'a>) {
        self.leaves |= u32::from(state.node().is_leaf()) << i;
        self.finished |= u32::from(state.node() == NodeRef::EMPTY) << i;
    }

    /// Adds a state that may have entered or left an instance.
    #[inline(always)]
    fn add_with_level<'a>(&mut self, i: u32, state: &impl RayInFlight<'a>) {
        self.nodes |= u32::from(!state.node().is_leaf()) << i;
        self.in_tlas = self.in_tlas & !(1 << i) | u32::from(state.is_in_tlas()) << i;
        self.add(i, state);
    }
}

/// Removes the lowest bit; returns its index.
#[inline(always)]
fn pop_lowest_bit(bits: &mut u32) -> u32 {
    let i = bits.trailing_zeros();
    *bits &= *bits - 1;
    i
}

/// Traces all rays of a source. `idle` creates a state without a ray; states are created in place, because they are
/// large.
#[inline(always)]
pub fn traverse_interleaved<'a, I: Isa, R: RayInFlight<'a>>(
    scene: &'a Scene,
    idle: impl Fn() -> R,
    source: &mut impl RaySource<R>,
) {
    traverse_states::<I, R, RAYS_IN_FLIGHT>(scene, idle, source);
}

/// [`traverse_interleaved`] for a source of at most `count` rays, which may be one or two.
#[inline(always)]
pub fn traverse_rays<'a, I: Isa, R: RayInFlight<'a>>(
    scene: &'a Scene,
    count: usize,
    idle: impl Fn() -> R,
    source: &mut impl RaySource<R>,
) {
    if count <= FEW_RAYS {
        traverse_states::<I, R, 1>(scene, idle, source);
    } else {
        traverse_states::<I, R, RAYS_IN_FLIGHT>(scene, idle, source);
    }
}

#[inline(always)]
fn traverse_states<'a, I: Isa, R: RayInFlight<'a>, const STATES: usize>(
    scene: &'a Scene,
    idle: impl Fn() -> R,
    source: &mut impl RaySource<R>,
) {
    let mut memory: [MaybeUninit<R>; STATES] = [const { MaybeUninit::uninit() }; STATES];
    // `std::array::from_fn` is not used, because it would copy each state, which is several kilobytes large.
    for state in &mut memory {
        state.write(idle());
    }
    // SAFETY: all states have been written, and `MaybeUninit<R>` has the layout of `R`.
    let states = unsafe { &mut *std::ptr::from_mut(&mut memory).cast::<[R; STATES]>() };
    let mut ready = ReadyMasks::default();
    for (i, state) in states.iter_mut().enumerate() {
        if !source.start(state) {
            break;
        }
        ready.add_with_level(i as u32, state);
    }
    loop {
        while ready.nodes.count_ones() > MAX_WAITING_NODES || ready.leaves == 0 {
            if ready.nodes == 0 {
                return;
            }
            let mut left = ready.nodes;
            while left != 0 {
                let i = pop_lowest_bit(&mut left);
                // SAFETY: a bit of a mask is set only for an existing state.
                let state = unsafe { states.get_unchecked_mut(i as usize) };
                state.step_node::<I>();
                ready.add(i, state);
            }
            ready.nodes &= !ready.leaves;
        }
        let mut instances = ready.finished | ready.leaves & ready.in_tlas;
        let mut left = ready.leaves & !instances;
        (ready.leaves, ready.finished) = (0, 0);
        let (stepped, mut with_candidates) = (left, 0u32);
        while left != 0 {
            let i = pop_lowest_bit(&mut left);
            // SAFETY: as above.
            let state = unsafe { states.get_unchecked_mut(i as usize) };
            with_candidates |= u32::from(state.step_leaf::<I>()) << i;
            ready.add(i, state);
        }
        // These rays stay at their leaves until their triangles are processed.
        ready.leaves &= !with_candidates;
        let mut left = with_candidates;
        while left != 0 {
            let i = pop_lowest_bit(&mut left);
            // SAFETY: as above.
            unsafe { states.get_unchecked_mut(i as usize) }.load_triangle::<I>();
        }
        while with_candidates != 0 {
            let i = pop_lowest_bit(&mut with_candidates);
            // SAFETY: as above.
            let state = unsafe { states.get_unchecked_mut(i as usize) };
            state.step_triangles::<I>();
            ready.add(i, state);
        }
        ready.nodes |= stepped & !ready.leaves;
        while instances != 0 {
            let i = pop_lowest_bit(&mut instances);
            // SAFETY: as above.
            let state = unsafe { states.get_unchecked_mut(i as usize) };
            if state.step_instance(scene) {
                source.finish(state);
                if !source.start(state) {
                    continue;
                }
            }
            ready.add_with_level(i, state);
        }
    }
}
