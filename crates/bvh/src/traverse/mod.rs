//! From a batch of rays to its answers.

mod exact;
pub mod local;
mod single;
mod triangle;

use crate::block::{LEAF, NO_CHILD};
use crate::dispatch::kernel;
use crate::ray::{Coherence, ExactHit, ExactRay, Hit, NOTHING, Ray};
use crate::scene::{ExactTriangles, Placed, Scene};
use crate::simd::Isa;
use exact::closest_exact_batch;
use local::LocalRay;
use single::{Best, NO_SLOT, Stack, enter_children, trace};

kernel! {
    /// The nearest hits.
    fn closest(scene: &Scene, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) = closest_batch
}
kernel! {
    /// Whether there is any hit.
    fn occluded(scene: &Scene, rays: &[Ray], dark: &mut [bool], coherence: Coherence) = occluded_batch
}
kernel! {
    /// The nearest hits in float64.
    fn closest_exact(
        scene: &Scene, rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit],
    ) = closest_exact_batch
}

#[inline(always)]
fn closest_batch<I: Isa>(scene: &Scene, rays: &[Ray], hits: &mut [Hit], _coherence: Coherence) {
    for (ray, hit) in rays.iter().zip(hits) {
        *hit = closest_one::<I, false>(scene, ray);
    }
}

#[inline(always)]
fn occluded_batch<I: Isa>(scene: &Scene, rays: &[Ray], dark: &mut [bool], _coherence: Coherence) {
    for (ray, dark) in rays.iter().zip(dark) {
        *dark = closest_one::<I, true>(scene, ray).instance != NOTHING;
    }
}

/// The ray of the scene in the coordinates of a placed mesh.
#[inline(always)]
fn transformed(placed: &Placed, origin: [f32; 3], direction: [f32; 3]) -> Option<LocalRay> {
    let m = &placed.mesh_from_scene;
    let turned = |v: [f32; 3], row: usize| m[row][0] * v[0] + m[row][1] * v[1] + m[row][2] * v[2];
    LocalRay::new(
        std::array::from_fn(|row| turned(origin, row) + m[row][3]),
        std::array::from_fn(|row| turned(direction, row)),
        placed.bvh.reach(),
        0.0,
    )
}

/// One ray through the scene; with `ANY`, the first hit that turns up.
#[inline(always)]
fn closest_one<I: Isa, const ANY: bool>(scene: &Scene, ray: &Ray) -> Hit {
    let mut hit = Hit::MISS;
    let unit = scene.unit as f32;
    let (origin, direction) = (
        ray.origin.map(|x| x * unit),
        ray.direction.map(|x| x * unit),
    );
    let distance = origin[0].abs().max(origin[1].abs()).max(origin[2].abs());
    let slack = if scene.direct {
        0.0
    } else {
        scene.slack(distance)
    };
    let Some(outer) = LocalRay::new(origin, direction, scene.reach, slack) else {
        return hit;
    };
    if ray.t_max.is_nan() || ray.t_max < 0.0 || scene.root == NO_CHILD {
        return hit;
    }
    let mut t_max = ray.t_max;
    let visit = |instance: u32, hit: &mut Hit, t_max: &mut f32| -> bool {
        let placed = &scene.placed[instance as usize];
        let local = if scene.direct {
            LocalRay::new(origin, direction, placed.bvh.reach(), 0.0)
        } else {
            transformed(placed, origin, direction)
        };
        let Some(local) = local else { return false };
        let mut best = Best::nothing(local.inner_t(*t_max));
        let any = trace::<I, ANY>(&placed.bvh, &local, &mut best);
        if ANY {
            hit.instance = if any { instance } else { hit.instance };
            return any;
        }
        if best.slot != NO_SLOT {
            let t = local.outer_t(best.t);
            if (t, instance) < (hit.t, hit.instance) {
                *hit = Hit {
                    t,
                    u: best.u,
                    v: best.v,
                    instance,
                    triangle: placed.bvh.id(best.slot),
                };
                *t_max = t;
            }
        }
        false
    };
    if scene.direct {
        visit(0, &mut hit, &mut t_max);
        return hit;
    }
    let mut stack = Stack::new();
    let mut enter = [0.0; 8];
    let mut at = scene.root;
    loop {
        if at & LEAF == 0 {
            let node = scene.node(at);
            let into = enter_children::<I>(node, &outer, outer.inner_t(t_max), &mut enter);
            if into != 0 {
                at = stack.push_children(node, &enter, into);
                continue;
            }
        } else if visit(at & !LEAF, &mut hit, &mut t_max) {
            return hit;
        }
        match stack.pop(outer.inner_t(t_max)) {
            Some(next) => at = next,
            None => return hit,
        }
    }
}
