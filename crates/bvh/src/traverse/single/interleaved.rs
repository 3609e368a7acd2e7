//! Rays that run apart: several are traced in turn on one thread, each a step at a time, while the memory that the
//! others' next steps need is on its way. Those at nodes and those at leaves are told apart, so that the same code
//! runs for many in a row: which kind of step a ray needs next is what no processor can guess. Bits tell them, not lists
//! in memory: whose turn is next would have to be read there after what was just written, and steps would not overlap.

use crate::node::NO_CHILD;
use crate::ray::{Hit, Ray};
use crate::scene::Scene;
use crate::simd::Isa;
use crate::traverse::single::ray_state::Slot;

/// How many rays take turns.
const SLOTS: usize = 24;

/// Rays at nodes that wait for those at leaves.
const FEW: u32 = 8;

/// A ray to be traced.
#[derive(Clone, Copy)]
pub struct Work {
    pub ray: Ray,
    /// What to answer it by.
    pub number: usize,
    /// Where in the mesh of which instance to start, and to end with it; [`NO_CHILD`] for the root of everything.
    pub start: u32,
    pub instance: u32,
}

/// Where a batch gets its rays from and brings its answers to.
pub trait Batch {
    fn next(&mut self) -> Option<Work>;
    fn answer(&mut self, number: usize, hit: Hit);
}

/// The steps that rays need next: bit i is that of slot i.
#[derive(Default)]
struct Turns {
    nodes: u32,
    /// Those at leaves, among others.
    leaves: u32,
    /// Those at the end of a tree.
    ends: u32,
    /// Those above the instances, where leaves are instances.
    above: u32,
}

impl Turns {
    /// Adds a slot that is where a step took it, or a new one.
    #[inline(always)]
    fn add(&mut self, i: u32, slot: &Slot) {
        self.leaves |= (slot.at >> 31) << i;
        self.ends |= u32::from(slot.at == NO_CHILD) << i;
    }

    /// Adds a slot that may have gone into an instance or out of one.
    #[inline(always)]
    fn add_anywhere(&mut self, i: u32, slot: &Slot) {
        self.nodes |= (slot.at >> 31 ^ 1) << i;
        self.above = self.above & !(1 << i) | u32::from(slot.mesh.is_none()) << i;
        self.add(i, slot);
    }
}

/// Takes the lowest bit.
#[inline(always)]
fn lowest(bits: &mut u32) -> u32 {
    let i = bits.trailing_zeros();
    *bits &= *bits - 1;
    i
}

/// Traces a batch. With `ANY`, any hit will do: of the answer, only whether there is an instance counts.
#[inline(always)]
pub fn trace<I: Isa, B: Batch, const ANY: bool>(scene: &Scene, batch: &mut B) {
    let mut slots: [Slot; SLOTS] = std::array::from_fn(|_| Slot::idle());
    let mut turns = Turns::default();
    for (i, slot) in slots.iter_mut().enumerate() {
        if !refill(slot, scene, batch) {
            break;
        }
        turns.add_anywhere(i as u32, slot);
    }
    loop {
        while turns.nodes.count_ones() > FEW || turns.leaves == 0 {
            if turns.nodes == 0 {
                return;
            }
            let mut left = turns.nodes;
            while left != 0 {
                let i = lowest(&mut left);
                // SAFETY: slots, no more of them, set the bits.
                let slot = unsafe { slots.get_unchecked_mut(i as usize) };
                slot.step_node::<I, ANY>();
                turns.add(i, slot);
            }
            turns.nodes &= !turns.leaves;
        }
        let mut instances = turns.ends | turns.leaves & turns.above;
        let mut left = turns.leaves & !instances;
        (turns.leaves, turns.ends) = (0, 0);
        let (stepped, mut near) = (left, 0u32);
        while left != 0 {
            let i = lowest(&mut left);
            // SAFETY: as above.
            let slot = unsafe { slots.get_unchecked_mut(i as usize) };
            if ANY {
                slot.step_any::<I>();
            } else {
                slot.step_leaf::<I>();
                near |= u32::from(slot.near != 0) << i;
            }
            turns.add(i, slot);
        }
        // Those are still where they were.
        turns.leaves &= !near;
        while near != 0 {
            let i = lowest(&mut near);
            // SAFETY: as above.
            let slot = unsafe { slots.get_unchecked_mut(i as usize) };
            slot.step_near::<I>();
            turns.add(i, slot);
        }
        turns.nodes |= stepped & !turns.leaves;
        while instances != 0 {
            let i = lowest(&mut instances);
            // SAFETY: as above.
            let slot = unsafe { slots.get_unchecked_mut(i as usize) };
            if slot.step_instance::<ANY>(scene) {
                batch.answer(slot.number, slot.hit);
                if !refill(slot, scene, batch) {
                    continue;
                }
            }
            turns.add_anywhere(i, slot);
        }
    }
}

/// Starts the next ray that can meet anything, and answers those before it.
#[inline(always)]
fn refill<'a, B: Batch>(slot: &mut Slot<'a>, scene: &'a Scene, batch: &mut B) -> bool {
    while let Some(work) = batch.next() {
        if slot.start(scene, work) {
            return true;
        }
        batch.answer(work.number, Hit::MISS);
    }
    false
}
