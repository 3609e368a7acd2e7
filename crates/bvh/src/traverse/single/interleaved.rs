//! Interleaved traversal of incoherent rays, in the manner of AMAC (O. Kocberber, B. Falsafi and B. Grot, "Asynchronous
//! Memory Access Chaining", VLDB 2015).
//!
//! One thread advances 24 rays round-robin, so that one ray's prefetch overlaps the others' work. Rays at nodes and
//! rays at leaves are processed in separate loops, since the kind of a ray's next step is unpredictable. Ready rays are
//! bit masks by next step; a queue in memory would add a store-to-load dependency per step.

use crate::node::NodeRef;
use crate::ray::Hit;
use crate::scene::Scene;
use crate::simd::Isa;
use crate::traverse::single::ray_state::{RayState, RayTask};

/// Rays in flight per thread.
const RAYS_IN_FLIGHT: usize = 24;

/// Rays at nodes that may wait while rays at leaves advance.
const MAX_WAITING_NODES: u32 = 8;

/// Source of rays and sink of hits.
pub trait RaySource {
    fn next(&mut self) -> Option<RayTask>;
    fn report(&mut self, number: usize, hit: Hit);
}

/// Rays by next step; bit i is state i.
#[derive(Default)]
struct ReadyMasks {
    nodes: u32,
    /// Rays at leaves, in the TLAS or in a BLAS.
    leaves: u32,
    /// Rays at the end of a tree.
    finished: u32,
    /// Rays in the TLAS, whose leaves are instances.
    in_tlas: u32,
}

impl ReadyMasks {
    /// Adds a state after a step within its tree, or a new one.
    #[inline(always)]
    fn add(&mut self, i: u32, state: &RayState) {
        self.leaves |= u32::from(state.node.is_leaf()) << i;
        self.finished |= u32::from(state.node == NodeRef::EMPTY) << i;
    }

    /// Adds a state that may have entered or left an instance.
    #[inline(always)]
    fn add_with_level(&mut self, i: u32, state: &RayState) {
        self.nodes |= u32::from(!state.node.is_leaf()) << i;
        self.in_tlas = self.in_tlas & !(1 << i) | u32::from(state.mesh.is_none()) << i;
        self.add(i, state);
    }
}

/// Removes the lowest bit; its index.
#[inline(always)]
fn pop_lowest_bit(bits: &mut u32) -> u32 {
    let i = bits.trailing_zeros();
    *bits &= *bits - 1;
    i
}

/// Traces all rays of a source. With `ANY_HIT`, only the presence of an instance in a hit is valid.
#[inline(always)]
pub fn traverse_interleaved<I: Isa, B: RaySource, const ANY_HIT: bool>(scene: &Scene, source: &mut B) {
    let mut states: [RayState; RAYS_IN_FLIGHT] = std::array::from_fn(|_| RayState::idle());
    let mut ready = ReadyMasks::default();
    for (i, state) in states.iter_mut().enumerate() {
        if !refill(state, scene, source) {
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
                // SAFETY: states, no more of them, set the bits.
                let state = unsafe { states.get_unchecked_mut(i as usize) };
                state.step_node::<I, ANY_HIT>();
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
            // SAFETY: as in_tlas.
            let state = unsafe { states.get_unchecked_mut(i as usize) };
            if ANY_HIT {
                state.step_leaf_any_hit::<I>();
            } else {
                state.step_leaf::<I>();
                with_candidates |= u32::from(state.candidates != 0) << i;
            }
            ready.add(i, state);
        }
        // Their nodes have not changed.
        ready.leaves &= !with_candidates;
        while with_candidates != 0 {
            let i = pop_lowest_bit(&mut with_candidates);
            // SAFETY: as in_tlas.
            let state = unsafe { states.get_unchecked_mut(i as usize) };
            state.step_triangles::<I>();
            ready.add(i, state);
        }
        ready.nodes |= stepped & !ready.leaves;
        while instances != 0 {
            let i = pop_lowest_bit(&mut instances);
            // SAFETY: as in_tlas.
            let state = unsafe { states.get_unchecked_mut(i as usize) };
            if state.step_instance::<ANY_HIT>(scene) {
                source.report(state.ray_id, state.hit);
                if !refill(state, scene, source) {
                    continue;
                }
            }
            ready.add_with_level(i, state);
        }
    }
}

/// Starts the next ray that can hit anything; reports misses of those before it.
#[inline(always)]
fn refill<'a, B: RaySource>(state: &mut RayState<'a>, scene: &'a Scene, source: &mut B) -> bool {
    while let Some(task) = source.next() {
        if state.begin(scene, task) {
            return true;
        }
        source.report(task.ray_id, Hit::MISS);
    }
    false
}
