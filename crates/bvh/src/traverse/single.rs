//! One ray through one tree.

use super::local::LocalRay;
use super::triangle::{Found, test};
use crate::block::{LEAF, NO_CHILD, Node};
use crate::build::MAX_DEPTH;
use crate::mesh::Bvh;
use crate::simd::{Isa, Vector};

/// A path has at most `MAX_DEPTH` nodes and each leaves at most 7 children for later, so no stack grows beyond this.
pub const STACK: usize = 7 * MAX_DEPTH + 1;

/// What is left to visit, with the t at which the ray enters it.
pub struct Stack {
    entries: [std::mem::MaybeUninit<(f32, u32)>; STACK],
    len: usize,
}

impl Stack {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            entries: [const { std::mem::MaybeUninit::uninit() }; STACK],
            len: 0,
        }
    }

    #[inline(always)]
    fn push(&mut self, t: f32, child: u32) {
        debug_assert!(self.len < STACK);
        // SAFETY: `STACK` bounds the length, by the depth of every tree (see there).
        unsafe { self.entries.get_unchecked_mut(self.len) }.write((t, child));
        self.len += 1;
    }

    /// The last entry that is entered no later than `t_max`.
    #[inline(always)]
    pub fn pop(&mut self, t_max: f32) -> Option<u32> {
        while self.len > 0 {
            self.len -= 1;
            // SAFETY: entries below `len` were written by `push`.
            let (t, child) = unsafe { self.entries.get_unchecked(self.len).assume_init() };
            if t <= t_max {
                return Some(child);
            }
        }
        None
    }

    /// Puts the children of `hit` on the stack, the farthest first, and returns the nearest.
    #[inline(always)]
    pub fn push_children(&mut self, node: &Node, enter: &[f32; 8], mut hit: u32) -> u32 {
        let mut lane = hit.trailing_zeros() as usize;
        hit &= hit - 1;
        let mut nearest = (enter[lane & 7], node.child[lane & 7]);
        let base = self.len;
        while hit != 0 {
            lane = hit.trailing_zeros() as usize;
            hit &= hit - 1;
            let mut entry = (enter[lane & 7], node.child[lane & 7]);
            if entry.0 < nearest.0 {
                std::mem::swap(&mut entry, &mut nearest);
            }
            // Insertion: the farther ones sink below.
            let mut at = self.len;
            self.push(entry.0, entry.1);
            // SAFETY: `at` is below `len`, and all entries from `base` on were written just now.
            unsafe {
                while at > base && self.entries.get_unchecked(at - 1).assume_init().0 < entry.0 {
                    *self.entries.get_unchecked_mut(at) = *self.entries.get_unchecked(at - 1);
                    at -= 1;
                }
                self.entries.get_unchecked_mut(at).write(entry);
            }
        }
        nearest.1
    }
}

/// The nearest hit so far, in t of the local ray.
#[derive(Clone, Copy, Debug)]
pub struct Best {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    /// Position in the mesh's list of ids, or [`NO_SLOT`].
    pub slot: u32,
}

/// No triangle yet.
pub const NO_SLOT: u32 = u32::MAX;

impl Best {
    /// Nothing at `t_max` or before.
    #[inline(always)]
    pub fn nothing(t_max: f32) -> Best {
        Best {
            t: t_max,
            u: 0.0,
            v: 0.0,
            slot: NO_SLOT,
        }
    }

    /// Takes the triangles of `hit` where they come first by (t, id).
    #[inline(always)]
    pub fn take(&mut self, mesh: &Bvh, first: u32, mut hit: u32, found: &Found) {
        while hit != 0 {
            let lane = hit.trailing_zeros() as usize & 15;
            hit &= hit - 1;
            let (t, slot) = (found.t[lane], first + lane as u32);
            let before = t < self.t
                || t == self.t && (self.slot == NO_SLOT || mesh.id(slot) < mesh.id(self.slot));
            if before {
                *self = Best {
                    t,
                    u: found.u[lane],
                    v: found.v[lane],
                    slot,
                };
            }
        }
    }
}

/// Which children of a node the ray enters no later than `t_max`, and where.
#[inline(always)]
pub fn enter_children<I: Isa>(
    node: &Node,
    ray: &LocalRay,
    t_max: f32,
    enter: &mut [f32; 8],
) -> u32 {
    let near = |axis: usize| {
        // SAFETY: `entry` is one of the six rows, each of 8 floats.
        let bound = unsafe { I::F8::load(node.bounds.get_unchecked(ray.entry[axis]).as_ptr()) };
        bound.mul_sub_loose(
            I::F8::splat(ray.reciprocal[axis]),
            I::F8::splat(ray.near[axis]),
        )
    };
    let far = |axis: usize| {
        // SAFETY: as above; the lowest bit chooses between the two rows of an axis.
        let bound = unsafe { I::F8::load(node.bounds.get_unchecked(ray.entry[axis] ^ 1).as_ptr()) };
        bound.mul_sub_loose(
            I::F8::splat(ray.reciprocal[axis]),
            I::F8::splat(ray.far[axis]),
        )
    };
    let t_enter = near(0).max(near(1)).max(near(2).max(I::F8::splat(0.0)));
    let t_leave = far(0).min(far(1)).min(far(2).min(I::F8::splat(t_max)));
    // SAFETY: the array holds 8 floats.
    unsafe { t_enter.store(enter.as_mut_ptr()) };
    <I::F8 as Vector>::bits(t_enter.le(t_leave))
}

/// Lowers `best` to the nearest hit in the mesh; with `ANY`, stops at the first hit there is and returns true.
#[inline(always)]
pub fn trace<I: Isa, const ANY: bool>(mesh: &Bvh, ray: &LocalRay, best: &mut Best) -> bool {
    let mut at = mesh.root();
    if at == NO_CHILD {
        return false;
    }
    let mut stack = Stack::new();
    let mut enter = [0.0; 8];
    let mut found = Found::NOTHING;
    loop {
        if at & LEAF == 0 {
            let node = mesh.node(at);
            let hit = enter_children::<I>(node, ray, best.t, &mut enter);
            if hit != 0 {
                at = stack.push_children(node, &enter, hit);
                continue;
            }
        } else {
            let leaf = mesh.leaf(at);
            let hit = test::<I>(leaf, ray, best.t, &mut found);
            if hit != 0 {
                if ANY {
                    return true;
                }
                best.take(mesh, leaf.first, hit, &found);
            }
        }
        match stack.pop(best.t) {
            Some(next) => at = next,
            None => return false,
        }
    }
}
