//! Sixteen triangles against one ray: the watertight test of Woop, Benthin and Wald 2013.
//!
//! The ray is sheared to the axis along which it runs most; the triangle is hit where its three edge functions do not
//! differ in sign. Each is a difference of two rounded products, never fused: two triangles that share an edge compute
//! the same value with opposite sign, so no ray passes between them, and where a value is 0 float64 decides exactly.
//! Front and back are both hit. The edges count as inside.

use super::local::TriangleRay;
use crate::block::Leaf;
use crate::simd::{Isa, Vector};

/// Where a ray meets the triangles of a leaf; only the lanes that the test names are written.
#[repr(C, align(64))]
pub struct Found {
    pub t: [f32; 16],
    pub u: [f32; 16],
    pub v: [f32; 16],
}

impl Found {
    pub const NOTHING: Found = Found {
        t: [0.0; 16],
        u: [0.0; 16],
        v: [0.0; 16],
    };
}

/// Bit i: the ray meets triangle i at a t of `0..=t_max`.
#[inline(always)]
pub fn test<I: Isa>(leaf: &Leaf, ray: &TriangleRay, t_max: f32, found: &mut Found) -> u32 {
    let [kx, ky, kz] = ray.axes;
    let relative = |axis: usize| {
        // SAFETY: each row of `vertex` holds 16 floats.
        let row = unsafe { I::F16::load(leaf.vertex[axis].as_ptr()) };
        row.sub(I::F16::splat(ray.origin[axis]))
    };
    let (rx, ry, rz) = (relative(kx), relative(ky), relative(kz));
    let px = rx.sub(I::F16::splat(ray.shear[0]).mul(rz));
    let py = ry.sub(I::F16::splat(ray.shear[1]).mul(rz));
    let (ia, ib, ic) = (
        I::index(leaf.corner[0]),
        I::index(leaf.corner[1]),
        I::index(leaf.corner[2]),
    );
    let (ax, bx, cx) = (I::lookup(px, ia), I::lookup(px, ib), I::lookup(px, ic));
    let (ay, by, cy) = (I::lookup(py, ia), I::lookup(py, ib), I::lookup(py, ic));
    let mut u = cx.mul(by).sub(cy.mul(bx));
    let mut v = ax.mul(cy).sub(ay.mul(cx));
    let mut w = bx.mul(ay).sub(by.mul(ax));
    let zero = I::F16::splat(0.0);
    let inside = <I::F16 as Vector>::or(zero.le(u.min(v).min(w)), u.max(v).max(w).le(zero));
    let mut hit = <I::F16 as Vector>::bits(inside) & leaf.solid;
    if hit == 0 {
        return 0;
    }
    let smallest = u.abs().min(v.abs()).min(w.abs());
    let unsure = <I::F16 as Vector>::bits(smallest.eq(zero)) & hit;
    if unsure != 0 {
        let mut edges = [[0.0; 16]; 3];
        let mut corners = [[0.0; 16]; 6];
        for (array, vector) in corners.iter_mut().zip([ax, ay, bx, by, cx, cy]) {
            // SAFETY: each array holds 16 floats.
            unsafe { vector.store(array.as_mut_ptr()) };
        }
        for (array, vector) in edges.iter_mut().zip([u, v, w]) {
            // SAFETY: each array holds 16 floats.
            unsafe { vector.store(array.as_mut_ptr()) };
        }
        hit = decide(&corners, unsure, hit, &mut edges);
        // SAFETY: each array holds 16 floats.
        [u, v, w] = edges.map(|array| unsafe { I::F16::load(array.as_ptr()) });
    }
    let det = u.add(v).add(w);
    let (wa, wb, wc) = (u.div(det), v.div(det), w.div(det));
    let (za, zb, zc) = (I::lookup(rz, ia), I::lookup(rz, ib), I::lookup(rz, ic));
    let depth = wa.mul(za).add(wb.mul(zb)).add(wc.mul(zc));
    let mut t = depth.mul(I::F16::splat(ray.shear[2]));
    // Into the triangle's own interval of t: see TRIANGLE_PAD.
    let mut enter = I::F16::splat(f32::NEG_INFINITY);
    let mut leave = I::F16::splat(f32::INFINITY);
    for axis in 0..3 {
        let r = relative(axis);
        let (a, b, c) = (I::lookup(r, ia), I::lookup(r, ib), I::lookup(r, ic));
        let (lower, upper) = (a.min(b).min(c), a.max(b).max(c));
        let (first, last) = if ray.reciprocal[axis] < 0.0 {
            (upper, lower)
        } else {
            (lower, upper)
        };
        let reciprocal = I::F16::splat(ray.reciprocal[axis]);
        enter = enter.max(first.mul(reciprocal).sub(I::F16::splat(ray.pad[axis])));
        leave = leave.min(last.mul(reciprocal).add(I::F16::splat(ray.pad[axis])));
    }
    t = t.min(leave).max(enter);
    let counts = <I::F16 as Vector>::and(zero.le(t), t.le(I::F16::splat(t_max)));
    hit &= <I::F16 as Vector>::bits(counts);
    if hit != 0 {
        // SAFETY: each array holds 16 floats.
        unsafe {
            t.store(found.t.as_mut_ptr());
            wb.store(found.u.as_mut_ptr());
            wc.store(found.v.as_mut_ptr());
        }
    }
    hit
}

/// Decides the lanes of `unsure` by float64, in which the products are exact; returns the lanes of `hit` that stay.
#[cold]
#[inline(never)]
fn decide(corners: &[[f32; 16]; 6], unsure: u32, mut hit: u32, edges: &mut [[f32; 16]; 3]) -> u32 {
    for lane in (0..16).filter(|lane| unsure >> lane & 1 != 0) {
        let [ax, ay, bx, by, cx, cy] = corners.map(|c| f64::from(c[lane]));
        let (u, v, w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
        let det = u + v + w;
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        if !inside || det == 0.0 {
            hit &= !(1 << lane);
            continue;
        }
        for (edge, value) in edges.iter_mut().zip([u, v, w]) {
            edge[lane] = (value / det) as f32;
        }
    }
    hit
}
