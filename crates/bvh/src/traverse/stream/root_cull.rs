//! Culling of rays that enter no child of the root, sixteen at a time, before they are sorted or set up. In open scenes
//! many rays miss.

use crate::limits::{MACHINE_EPSILON, MAX_COORD};
use crate::node::{WideNode, node};
use crate::ray::Ray;
use crate::scene::Scene;
use crate::simd::{Isa, Vector};
use crate::traverse::trav_ray::{MAX_ORIGIN, MAX_RECIPROCAL, ORIGIN_PAD, RELATIVE_PAD, SLAB_PAD};

/// Number of rays in a trial, after which the culling rate is evaluated.
pub const TRIAL_RAYS: usize = 512;

/// Culling saves time if it removes at least one in this number of rays.
const MIN_CULL_RATE: usize = 12;

/// Culling of rays against the AABBs of the root's children.
pub struct RootCull<'a> {
    scene: &'a Scene,
    /// The root; `None` if the root is a leaf, or if rays must be scaled first.
    root: Option<&'a WideNode>,
}

impl<'a> RootCull<'a> {
    /// Creates the culling at the root of the TLAS, or of the only BLAS of a single-level scene.
    #[inline(always)]
    pub fn new(scene: &'a Scene) -> RootCull<'a> {
        let (blocks, root) = match (scene.is_single_mesh, &*scene.instances) {
            (true, [instance]) => (instance.bvh.blocks(), instance.bvh.root()),
            _ => (scene.blocks(), scene.root),
        };
        let root = (!root.is_leaf() && scene.scale == 1.0).then(|| node(blocks, root));
        RootCull { scene, root }
    }

    /// Removes rays that miss the root's children, from position `from` on, unless the back-off skips this step.
    #[inline(always)]
    pub fn cull<I: Isa>(&self, rays: &[Ray], ray_ids: &mut Vec<u32>, from: usize) {
        if let Some(root) = self.root
            && I::HAS_FMA
            && !self.scene.root_cull_backoff.should_skip()
        {
            let asked = ray_ids.len() - from;
            let away = self.compact::<I>(root, rays, ray_ids, from);
            self.scene.root_cull_backoff.record(MIN_CULL_RATE * away > asked);
        }
    }

    /// Keeps the rays that may hit anything, in their order; returns the number of removed rays.
    #[inline(always)]
    fn compact<I: Isa>(&self, root: &WideNode, rays: &[Ray], ray_ids: &mut Vec<u32>, from: usize) -> usize {
        let mut kept = from;
        for start in (from..ray_ids.len()).step_by(16) {
            let some = &ray_ids[start..ray_ids.len().min(start + 16)];
            let every = u32::MAX >> (32 - some.len());
            let some = std::array::from_fn(|i| *some.get(i).unwrap_or(&some[0]));
            let asked = some.map(|ray_id| &rays[ray_id as usize]);
            let mut staying = self.intersects_root::<I>(root, asked) & every;
            while staying != 0 {
                ray_ids[kept] = some[staying.trailing_zeros() as usize & 15];
                staying &= staying - 1;
                kept += 1;
            }
        }
        let away = ray_ids.len() - kept;
        ray_ids.truncate(kept);
        away
    }

    /// Bit i: ray i may enter a child, is not finite, or is parallel to an axis. Slabs are padded at least as much as
    /// the slabs of packets.
    #[inline(always)]
    fn intersects_root<I: Isa>(&self, root: &WideNode, rays: [&Ray; 16]) -> u32 {
        let scene = self.scene;
        let rays = rays.map(|ray| std::ptr::from_ref(ray).cast::<f32>());
        // SAFETY: a ray is seven floats: origin, direction, t_max.
        let ([x, y, z, _], [dx, dy, dz, t_max]) =
            unsafe { (I::load_transposed(rays), I::load_transposed(rays.map(|ray| ray.wrapping_add(3)))) };
        let zero = I::F32x16::splat(0.0);
        let (origin, direction) = ([x, y, z], [dx, dy, dz]);
        let distance = x.abs().max(y.abs()).max(z.abs());
        let steepest = dx.abs().max(dy.abs()).max(dz.abs());
        let flattest = dx.abs().min(dy.abs()).min(dz.abs());
        // The sum is NaN if a component is not finite, as in `Packet::setup`.
        let sum = (x.add(y).add(z)).add(dx.add(dy).add(dz)).mul(zero);
        let mut sane = distance.le(I::F32x16::splat(MAX_ORIGIN));
        let more = [
            steepest.le(I::F32x16::splat(MAX_COORD)),
            I::F32x16::splat(1.0 / MAX_COORD).le(steepest),
            I::F32x16::splat(1.0).le(flattest.mul(I::F32x16::splat(MAX_RECIPROCAL))),
            sum.eq(zero),
            zero.le(t_max),
        ];
        for also in more {
            sane = <I::F32x16 as Vector>::and(sane, also);
        }
        let slack = if scene.is_single_mesh {
            zero
        } else {
            let within = distance.le(I::F32x16::splat(scene.max_abs_coord));
            let rounding = |within| I::F32x16::splat(scene.relative_padding(within));
            I::F32x16::select(within, rounding(true), rounding(false))
                .mul(distance.add(I::F32x16::splat(scene.max_abs_coord)))
                .mul(I::F32x16::splat(1.0 + 8.0 * MACHINE_EPSILON))
        };
        // This value is at least the extent along the major axis.
        let mut farthest = zero;
        for axis in 0..3 {
            let above = I::F32x16::splat(scene.bounds.upper[axis]).sub(origin[axis]);
            let below = origin[axis].sub(I::F32x16::splat(scene.bounds.lower[axis]));
            farthest = farthest.max(above.max(below));
        }
        let end_pad = farthest.div(steepest).mul(I::F32x16::splat(SLAB_PAD));
        let mut backwards = [sane; 3];
        let (mut near, mut far) = ([[zero; 2]; 3], [[zero; 2]; 3]);
        for axis in 0..3 {
            let (o, reciprocal) = (origin[axis], I::F32x16::splat(1.0).div(direction[axis]));
            backwards[axis] = reciprocal.le(zero);
            let wide = (o.mul(reciprocal).abs().mul(I::F32x16::splat(ORIGIN_PAD)))
                .add(slack.mul(reciprocal.abs()))
                .add(end_pad);
            let (n, f) = (
                reciprocal.mul(I::F32x16::splat(1.0 - RELATIVE_PAD)),
                reciprocal.mul(I::F32x16::splat(1.0 + RELATIVE_PAD)),
            );
            near[axis] = [n, o.mul(n).add(wide)];
            far[axis] = [f, o.mul(f).sub(wide)];
        }
        let mut entered = <I::F32x16 as Vector>::from_bitmask(0);
        for child in 0..root.child_count as usize {
            let (mut enter, mut leave) = (zero, t_max);
            for axis in 0..3 {
                let lower = I::F32x16::splat(root.bounds[2 * axis][child & 7]);
                let upper = I::F32x16::splat(root.bounds[2 * axis + 1][child & 7]);
                let first = I::F32x16::select(backwards[axis], upper, lower);
                let last = I::F32x16::select(backwards[axis], lower, upper);
                enter = enter.max(first.mul_sub(near[axis][0], near[axis][1]));
                leave = leave.min(last.mul_sub(far[axis][0], far[axis][1]));
            }
            entered = <I::F32x16 as Vector>::or(entered, enter.le(leave));
        }
        let bits = <I::F32x16 as Vector>::to_bitmask;
        bits(entered) | !bits(sane) & 0xffff
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::aabb::Aabb;
    use crate::simd::Portable;
    use crate::{Bvh, Instance};

    /// A wide floor and 400 small triangles above it; the scene contains `copies` instances of this mesh, side by side.
    fn scene(copies: usize) -> Scene {
        let random = |i: usize, k: usize| ((i * 3 + k) as f32 * 12.9898).sin();
        let mut vertices = vec![[-9.0, -1.0, -9.0], [9.0, -1.0, -9.0], [0.0, -1.0, 9.0]];
        for i in 0..400 {
            let at = [0, 1, 2].map(|k| 0.5 * random(i, k));
            for corner in 0..3 {
                vertices.push([0, 1, 2].map(|k| at[k] + 0.02 * random(i + 7 * corner, k)));
            }
        }
        let triangles: Vec<_> = (0..401).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let bvh = Arc::new(Bvh::build(&vertices, &triangles).unwrap());
        let place = |i: usize| Instance {
            bvh: bvh.clone(),
            world_from_mesh: [[1.0, 0.0, 0.0, 30.0 * i as f32], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        };
        Scene::build((0..copies).map(place).collect(), [0.0; 3]).unwrap()
    }

    /// Random rays across the scene; every other one is aimed at, or one ulp next to, a corner of a root box.
    fn rays(root: &WideNode, count: usize) -> Vec<Ray> {
        let random = |i: usize| ((i as f32 * 78.233).sin() * 43_758.547).fract();
        let ray = |i: usize| {
            let origin = [0, 1, 2].map(|k| 2.0 * random(6 * i + k));
            let Aabb { lower, upper } = root.child_bounds(i / 2 % root.child_count as usize);
            let to: [f32; 3] = std::array::from_fn(|k| match i % 2 {
                0 => 2.0 * random(6 * i + 3 + k),
                _ if i >> (k + 5) & 1 == 0 => lower[k],
                _ => upper[k].next_up(),
            });
            let direction = std::array::from_fn(|k| to[k] - origin[k]);
            let t_max = [1.0, f32::INFINITY, f32::INFINITY][i % 3];
            Ray { origin, direction, t_max }
        };
        (0..count).map(ray).collect()
    }

    /// True if a ray enters a child, in float64.
    fn enters(root: &WideNode, ray: &Ray) -> bool {
        (0..root.child_count as usize).any(|child| {
            let Aabb { lower, upper } = root.child_bounds(child);
            let (mut enter, mut leave) = (0.0, f64::from(ray.t_max));
            for k in 0..3 {
                let [o, d] = [ray.origin[k], ray.direction[k]].map(f64::from);
                let [a, b] = [lower[k], upper[k]].map(|x| (f64::from(x) - o) / d);
                (enter, leave) = (a.min(b).max(enter), a.max(b).min(leave));
            }
            enter <= leave
        })
    }

    #[test]
    fn rays_entering_a_box_are_never_culled() {
        for copies in [1, 3] {
            let scene = scene(copies);
            let cull = RootCull::new(&scene);
            let root = cull.root.unwrap();
            let (mut away, mut missing) = (0, 0);
            for some in rays(root, 64_000).chunks(16) {
                let staying = cull.intersects_root::<Portable>(root, std::array::from_fn(|i| &some[i]));
                for (i, ray) in some.iter().enumerate() {
                    let stays = staying >> i & 1 != 0;
                    assert!(stays || !enters(root, ray), "{ray:?}");
                    // Rays aimed at corners (odd i) are not counted, because the padding keeps rays that miss a corner
                    // by an ulp.
                    missing += usize::from(i % 2 == 0 && !enters(root, ray));
                    away += usize::from(i % 2 == 0 && !stays);
                }
            }
            // Almost all rays that miss are culled.
            assert!(missing > 2000 && away > missing - missing / 20, "{away} of {missing}");
        }
    }

    #[test]
    fn infinite_and_axis_parallel_rays_are_not_culled() {
        let scene = scene(1);
        let cull = RootCull::new(&scene);
        let away = Ray { origin: [0.0, 20.0, 0.0], direction: [1.0, 1.0, 2.0], t_max: 1.0 };
        let mut rays = [away; 16];
        rays[1].direction[0] = 0.0;
        rays[2].direction = [f32::NAN; 3];
        rays[3].origin[2] = f32::NAN;
        rays[4].t_max = f32::NAN;
        rays[5].direction[1] = f32::INFINITY;
        rays[6].origin[0] = -1e30;
        rays[7].direction = [1e-30; 3];
        rays[8].t_max = -1.0;
        let staying = cull.intersects_root::<Portable>(cull.root.unwrap(), rays.each_ref());
        assert_eq!(staying, 0b1_1111_1110);
    }

    #[test]
    fn culling_keeps_the_order_of_rays() {
        let scene = scene(1);
        let cull = RootCull::new(&scene);
        let root = cull.root.unwrap();
        let rays = rays(root, 1000);
        let mut ray_ids: Vec<u32> = (0..1000).rev().collect();
        let mut expected = ray_ids.clone();
        expected.retain(|i| {
            let all = [&rays[*i as usize]; 16];
            *i >= 990 || cull.intersects_root::<Portable>(root, all) & 1 != 0
        });
        let away = cull.compact::<Portable>(root, &rays, &mut ray_ids, 10);
        assert_eq!(ray_ids, expected);
        assert!(away == 1000 - expected.len() && away > 100, "{away}");
    }
}
