//! The steps that every traversal is made of.

use crate::blas::Bvh;
use crate::node::{LeafNode, WideNode};
use crate::ray::Ray;
use crate::scene::{Placed, Scene};
use crate::simd::{Isa, Vector};
use crate::traverse::trav_ray::{LocalRay, ROW, Side};
use crate::traverse::triangle::single::{Line, Met, meet_one};

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

    /// Takes those of the triangles `near` of a leaf that the ray meets, where they come first by (t, id); whether one
    /// was.
    #[inline(always)]
    pub fn take(&mut self, mesh: &Bvh, leaf: &LeafNode, mut near: u32, ray: impl Line) -> bool {
        let mut closer = false;
        while near != 0 {
            let lane = near.trailing_zeros();
            near &= near - 1;
            let Some(Met { t, u, v }) = meet_one(leaf, lane as usize, ray, self.t) else {
                continue;
            };
            let slot = leaf.first + lane;
            if t < self.t || self.slot == NO_SLOT || mesh.id(slot) < mesh.id(self.slot) {
                *self = Best { t, u, v, slot };
                closer = true;
            }
        }
        closer
    }
}

/// Whether the ray meets any of the triangles `near` of a leaf.
#[inline(always)]
pub fn any(leaf: &LeafNode, mut near: u32, ray: impl Line, t_max: f32) -> bool {
    while near != 0 {
        let lane = near.trailing_zeros() as usize;
        near &= near - 1;
        if meet_one(leaf, lane, ray, t_max).is_some() {
            return true;
        }
    }
    false
}

/// Which children of a node the ray enters no later than `t_max`, and where.
#[inline(always)]
pub fn enter_children<I: Isa>(
    node: &WideNode,
    ray: &LocalRay,
    t_max: f32,
) -> (<I::F8 as Vector>::Mask, I::F8) {
    let [x, y, z, _] = ray.entry;
    let enter = passes::<I>(node, &ray.near, 0, x);
    let enter = enter.max(passes::<I>(node, &ray.near, 1, y));
    let t_enter = enter
        .max(passes::<I>(node, &ray.near, 2, z))
        .max(I::F8::splat(0.0));
    let leave = passes::<I>(node, &ray.far, 0, x ^ ROW);
    let leave = leave.min(passes::<I>(node, &ray.far, 1, y ^ ROW));
    let t_leave = leave
        .min(passes::<I>(node, &ray.far, 2, z ^ ROW))
        .min(I::F8::splat(t_max));
    (t_enter.le(t_leave), t_enter)
}

/// The t at which a ray passes a row of bounds, by where it begins.
#[inline(always)]
fn passes<I: Isa>(node: &WideNode, side: &Side, axis: usize, row: u32) -> I::F8 {
    debug_assert!(row.is_multiple_of(ROW) && row < 6 * ROW);
    // SAFETY: `row` begins one of the six, each of 8 floats; a bit chooses between the two of an axis.
    let bound = unsafe { I::F8::load(node.bounds.as_ptr().cast::<f32>().add(row as usize)) };
    bound.mul_sub(
        I::F8::splat(side.reciprocal[axis]),
        I::F8::splat(side.offset[axis]),
    )
}

/// Makes `local` the ray of the scene in the coordinates of a placed mesh, as [`LocalRay::aim`] does.
#[inline(always)]
pub fn transform(local: &mut LocalRay, scene: &Scene, placed: &Placed, ray: &Ray) -> bool {
    let unit = scene.unit as f32;
    let scaled = Ray {
        origin: ray.origin.map(|x| x * unit),
        direction: ray.direction.map(|x| x * unit),
        ..*ray
    };
    let Ray {
        origin, direction, ..
    } = placed.local(&scaled);
    local.aim(origin, direction, placed.bvh.extent(), 0.0)
}

impl Scene {
    /// Makes `outer` the ray in the coordinates of the tree over instances, or of the only mesh if that is in its place, as
    /// [`LocalRay::aim`] does.
    #[inline(always)]
    pub fn aim(&self, outer: &mut LocalRay, ray: &Ray) -> bool {
        let unit = self.unit as f32;
        let (mut o, mut d) = (ray.origin, ray.direction);
        if unit != 1.0 {
            (o, d) = (o.map(|x| x * unit), d.map(|x| x * unit));
        }
        let slack = if self.direct {
            0.0
        } else {
            let distance = o[0].abs().max(o[1].abs()).max(o[2].abs());
            self.rounding(self.is_within(o)) * (distance + self.reach)
        };
        outer.aim(o, d, &self.extent, slack)
    }
}
