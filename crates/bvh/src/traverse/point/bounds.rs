//! Lower bounds of the distance from a point to boxes and triangles, in float32.

use crate::limits::MACHINE_EPSILON;
use crate::node::{LeafNode, WideNode};
use crate::simd::{Isa, Vector};
use crate::traverse::triangle::edge::{corners, indices, vertices_minus};

/// Rounding error of a squared distance, as a fraction of the squared distance.
const SQUARE_ERROR: f32 = 16.0 * MACHINE_EPSILON;

/// Error bound of the distance to a triangle, as a fraction of the largest coordinate relative to the point. Divided by
/// the squared sine of the angle at the first corner, this fraction bounds the error of the foot of the perpendicular.
const TRIANGLE_ERROR: f32 = 32.0 * MACHINE_EPSILON;

/// Maximum coordinate of a point for which bounds are computed; for larger coordinates, squares overflow, and
/// everything counts as near.
const MAX_POINT: f32 = (1u64 << 50) as f32;

/// Lower limit of squared lengths, for triangles whose largest relative coordinate is 1 to 2.
const TINY: f32 = 1e-30;

type Triple<V> = [V; 3];

/// A point in the coordinates of a tree, and the distance up to which boxes and triangles are considered.
#[derive(Clone, Copy)]
pub struct Sphere {
    pub center: [f32; 3],
    /// The error bound for the coordinates of the centre and the vertices.
    pub error: f32,
    /// The radius, without allowance for errors.
    pub radius: f32,
    /// The ratio of the largest to the smallest factor by which the transform to tree coordinates scales lengths.
    pub condition: f32,
}

impl Sphere {
    /// Creates the sphere around a point. If the point is too far away, everything counts as near.
    pub fn new(center: [f32; 3], error: f32, condition: f32) -> Sphere {
        let reach = center.iter().fold(0.0, |most: f32, x| most.max(x.abs()));
        let is_known = reach <= MAX_POINT && error <= MAX_POINT;
        let (center, error) = if is_known { (center, error) } else { ([0.0; 3], f32::MAX) };
        Sphere { center, error, radius: f32::MAX, condition }
    }

    /// The greatest squared float32 distance of a box that may be near. It is finite, because unused children are
    /// infinitely far away.
    #[inline(always)]
    pub fn squared_limit(&self) -> f32 {
        let radius = self.radius + 4.0 * self.error;
        (radius * radius * (1.0 + SQUARE_ERROR) + f32::MIN_POSITIVE).min(f32::MAX)
    }
}

/// The squared distances from the sphere's centre to the boxes of a node's children.
#[inline(always)]
pub fn box_distances<I: Isa>(node: &WideNode, sphere: &Sphere) -> I::F32x8 {
    let x = squared_gaps::<I>(node, sphere, 0);
    let y = squared_gaps::<I>(node, sphere, 1);
    x.add(y).add(squared_gaps::<I>(node, sphere, 2))
}

/// The squared distances from the sphere's centre to the children's slabs along an axis.
#[inline(always)]
fn squared_gaps<I: Isa>(node: &WideNode, sphere: &Sphere, axis: usize) -> I::F32x8 {
    // SAFETY: each row of bounds contains 8 floats.
    let lower = unsafe { I::F32x8::load(node.bounds[2 * axis].as_ptr()) };
    // SAFETY: as above.
    let upper = unsafe { I::F32x8::load(node.bounds[2 * axis + 1].as_ptr()) };
    let at = I::F32x8::splat(sphere.center[axis]);
    let gap = lower.sub(at).max(at.sub(upper)).max(I::F32x8::splat(0.0));
    gap.mul(gap)
}

/// Bit i: triangle i of the leaf may be near. Triangles that are certainly farther than the nearest triangle of the
/// leaf are excluded, unless a filter may reject it.
#[inline(always)]
pub fn near_triangles<I: Isa>(leaf: &LeafNode, sphere: &Sphere, is_unfiltered: bool) -> u32 {
    // This function contains no closures, because their code would be compiled without the selected instruction set.
    let [x, y, z] = sphere.center;
    let x = vertices_minus::<I>(leaf, 0, x);
    let y = vertices_minus::<I>(leaf, 1, y);
    let z = vertices_minus::<I>(leaf, 2, z);
    let reach = x.abs().max(y.abs()).max(z.abs()).reduce_max().max(f32::MIN_POSITIVE);
    // `unit` is a power of two that scales the largest coordinate to the range 1 to 2, so that products neither
    // overflow nor underflow.
    let unit = f32::from_bits(reach.to_bits() & 0x7f80_0000).max(f32::MIN_POSITIVE).recip();
    let (scale, reach) = (I::F32x16::splat(unit), reach * unit);
    let index = indices::<I>(leaf);
    let x = corners::<I>(x.mul(scale), &index);
    let y = corners::<I>(y.mul(scale), &index);
    let z = corners::<I>(z.mul(scale), &index);
    let [a, b, c] = [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]];
    let (squared, conditioning) = triangle_distances::<I>(a, b, c);
    let error = I::F32x16::splat(TRIANGLE_ERROR * reach).mul(conditioning.add(I::F32x16::splat(1.0)));
    let used = (1u32 << leaf.count) - 1;
    let coordinate_error = 4.0 * sphere.error * unit;
    let mut radius = sphere.radius * unit + coordinate_error;
    if is_unfiltered {
        let nearest = least_upper_bound::<I>(squared, error, used) + coordinate_error;
        radius = radius.min(nearest * sphere.condition * (1.0 + SQUARE_ERROR) + coordinate_error);
    }
    let limit = error.add(I::F32x16::splat(radius));
    let limit = limit.mul(limit).add(I::F32x16::splat(f32::MIN_POSITIVE));
    // A NaN distance counts as near.
    let near = <I::F32x16 as Vector>::to_bitmask(squared.le(limit));
    let far = <I::F32x16 as Vector>::to_bitmask(limit.le(squared));
    (near | !far) & used
}

/// An upper bound on the distance to the nearest triangle of those in the mask `used`.
#[inline(always)]
fn least_upper_bound<I: Isa>(squared: I::F32x16, error: I::F32x16, used: u32) -> f32 {
    let squared = <I::F32x16 as Vector>::select(I::F32x16::from_bitmask(used), squared, I::F32x16::splat(f32::MAX));
    let least = squared.reduce_min();
    let is_nearest = squared.eq(I::F32x16::splat(least));
    let error = <I::F32x16 as Vector>::select(is_nearest, error, I::F32x16::splat(0.0)).reduce_max();
    least.sqrt() + error
}

#[inline(always)]
fn dot<I: Isa>(a: Triple<I::F32x16>, b: Triple<I::F32x16>) -> I::F32x16 {
    a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}

#[inline(always)]
fn sub<I: Isa>(a: Triple<I::F32x16>, b: Triple<I::F32x16>) -> Triple<I::F32x16> {
    [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])]
}

/// The squared distances from the origin to triangles, and the reciprocals of the squared sines of the angles at the
/// first corners.
#[inline(always)]
fn triangle_distances<I: Isa>(
    a: Triple<I::F32x16>,
    b: Triple<I::F32x16>,
    c: Triple<I::F32x16>,
) -> (I::F32x16, I::F32x16) {
    let (zero, tiny) = (I::F32x16::splat(0.0), I::F32x16::splat(TINY));
    let (e, f) = (sub::<I>(b, a), sub::<I>(c, a));
    let (ee, ef, ff) = (dot::<I>(e, e), dot::<I>(e, f), dot::<I>(f, f));
    let (ae, af) = (dot::<I>(a, e), dot::<I>(a, f));
    let (v, w) = (ef.mul(af).sub(ff.mul(ae)), ef.mul(ae).sub(ee.mul(af)));
    let lengths = ee.mul(ff);
    let det = lengths.sub(ef.mul(ef));
    let inside = <I::F32x16 as Vector>::and(zero.le(v.min(w)), v.add(w).le(det));
    let normal =
        [e[1].mul(f[2]).sub(e[2].mul(f[1])), e[2].mul(f[0]).sub(e[0].mul(f[2])), e[0].mul(f[1]).sub(e[1].mul(f[0]))];
    let height = dot::<I>(normal, a);
    let plane = height.mul(height).div(dot::<I>(normal, normal).max(tiny));
    let segments = segment_distances::<I>(a, e, ee).min(segment_distances::<I>(a, f, ff)).min(segment_distances::<I>(
        b,
        sub::<I>(c, b),
        zero,
    ));
    let squared = <I::F32x16 as Vector>::select(inside, plane, segments);
    let flat = det.le(tiny);
    let conditioning = <I::F32x16 as Vector>::select(flat, I::F32x16::splat(f32::MAX), lengths.div(det.max(tiny)));
    (squared, conditioning)
}

/// The squared distances from the origin to the segments from `a` along `e`; `known` is a lower bound on the squared
/// length of `e`, such as 0.
#[inline(always)]
fn segment_distances<I: Isa>(a: Triple<I::F32x16>, e: Triple<I::F32x16>, known: I::F32x16) -> I::F32x16 {
    let (zero, one) = (I::F32x16::splat(0.0), I::F32x16::splat(1.0));
    let squared_length = known.max(dot::<I>(e, e)).max(I::F32x16::splat(TINY));
    let t = zero.sub(dot::<I>(a, e)).div(squared_length).max(zero).min(one);
    let foot = [a[0].add(t.mul(e[0])), a[1].add(t.mul(e[1])), a[2].add(t.mul(e[2]))];
    dot::<I>(foot, foot)
}
