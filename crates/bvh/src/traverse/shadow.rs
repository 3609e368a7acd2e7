//! Packets through the scene: any hits.

use super::Any;
use super::fan::Apex;
use super::interleaved::{Work, trace};
use super::line::{Member, within};
use super::packet::{Packet, SIZE};
use super::stack::MaskStack;
use super::steps::any;
use super::together::{ALL_TRIANGLES, FEW, NO_RAY, groups, outer_pad, prefetch, scaled};
use super::triangle::{Found, test_rays};
use crate::block::{LEAF, Leaf, NO_CHILD, leaf, node};
use crate::mesh::Bvh;
use crate::ray::{Coherence, Ray};
use crate::scene::Scene;
use crate::simd::Isa;

/// How much work is put aside before it is done, or a little more.
const ASIDE: usize = 512;

/// How many packets are not made after one that fell apart.
const SKIP: u32 = 12;

/// Whether there is any hit, for any number of rays.
#[inline(always)]
pub fn occluded<I: Isa>(scene: &Scene, rays: &[Ray], dark: &mut [bool], coherence: Coherence) {
    dark.fill(false);
    let mut room = [NO_RAY; SIZE];
    let mut aside: Vec<Work> = Vec::new();
    let mut packet = Packet::NONE;
    // Where packets fall apart into many pieces, the next few are not made.
    let mut skip = 0u32;
    for (k, given) in rays.chunks(SIZE).enumerate() {
        let number = k * SIZE;
        let before = aside.len();
        let local = scaled(scene, given, &mut room);
        let whole = |aside: &mut Vec<Work>, i: usize| {
            aside.push(Work {
                ray: given[i],
                number: number + i,
                start: NO_CHILD,
            })
        };
        let apex = Apex::of(local);
        let packed = skip == 0
            && scene.direct
            && packet.set::<I>(local, &scene.extent, outer_pad(scene), apex)
            && !(coherence == Coherence::Unknown
                && apex == Apex::Origin
                && packet.spread() > scene.reach / 16.0);
        if !packed {
            (0..given.len()).for_each(|i| whole(&mut aside, i));
            skip = skip.saturating_sub(1);
        } else if scene.root != NO_CHILD {
            let met = occluded_in_mesh::<I>(&scene.placed[0].bvh, &packet, |i, start| {
                aside.push(Work {
                    ray: given[i],
                    number: number + i,
                    start,
                });
            });
            for (i, dark) in dark[number..][..given.len()].iter_mut().enumerate() {
                *dark = met >> i & 1 != 0;
            }
        }
        if skip == 0 && aside.len() - before > 2 * SIZE {
            skip = SKIP;
        }
        if aside.len() >= ASIDE {
            trace::<I, _, true>(
                scene,
                &mut Any {
                    work: aside.drain(..),
                    dark,
                },
            );
        }
    }
    trace::<I, _, true>(
        scene,
        &mut Any {
            work: aside.drain(..),
            dark,
        },
    );
}

/// Bit i: ray i meets something. Rays that are few at a node are handed to `alone` with it.
#[inline(always)]
fn occluded_in_mesh<I: Isa>(mesh: &Bvh, packet: &Packet, mut alone: impl FnMut(usize, u32)) -> u64 {
    let blocks = mesh.blocks();
    let mut stack = MaskStack::new();
    let mut found = Found::NOTHING;
    let t_max = packet.farthest::<I>();
    let mut dark = 0u64;
    let (mut at, mut active) = (mesh.root(), packet.active);
    loop {
        if active.count_ones() <= FEW {
            while active != 0 {
                alone(active.trailing_zeros() as usize, at);
                active &= active - 1;
            }
        } else if at & LEAF == 0 {
            let node = node(blocks, at);
            let (mut mask, _) = packet.fan.children::<I>(node, t_max);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                let entered = packet.enter::<I>(|row| node.bounds[row][lane], active);
                if entered != 0 {
                    prefetch::<I>(blocks, node.child[lane]);
                    stack.push(node.child[lane], entered);
                }
            }
        } else {
            let leaf = leaf(blocks, at);
            dark |= dark_in_leaf::<I>(leaf, active, packet, &mut found);
        }
        loop {
            let Some((next, mask)) = stack.pop() else {
                return dark;
            };
            (at, active) = (next, mask & !dark);
            if active != 0 {
                break;
            }
        }
    }
}

/// The rays of `active` that meet something in a leaf.
#[inline(always)]
fn dark_in_leaf<I: Isa>(leaf: &Leaf, mut active: u64, packet: &Packet, found: &mut Found) -> u64 {
    let mut dark = 0;
    let mut triangles = u32::MAX;
    if active.count_ones() > ALL_TRIANGLES {
        triangles = packet.candidates::<I>(leaf);
    }
    if triangles.count_ones() * groups(active) < active.count_ones() {
        while triangles != 0 {
            let k = triangles.trailing_zeros() as usize;
            triangles &= triangles - 1;
            for group in 0..SIZE / 16 {
                let lanes = ((active & !dark) >> (16 * group)) as u32 & 0xffff;
                if lanes != 0 {
                    dark |= u64::from(test_rays::<I>(leaf, k, packet, group, lanes, found))
                        << (16 * group);
                }
            }
        }
        return dark;
    }
    while active != 0 {
        let i = active.trailing_zeros() as usize & (SIZE - 1);
        active &= active - 1;
        let ray = Member(packet, i);
        if any(leaf, within::<I>(leaf, ray), ray, packet.t_max[i]) {
            dark |= 1 << i;
        }
    }
    dark
}
