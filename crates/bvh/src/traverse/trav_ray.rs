//! A ray set up for the slab tests of one tree.

use std::hint::select_unpredictable;

use crate::aabb::Aabb;
use crate::limits::{MACHINE_EPSILON, MAX_COORD};

/// Padding of slabs, so that rounding loses no hit and the order of traversal changes no hit.
///
/// Let u = [`MACHINE_EPSILON`], o the origin, r the reciprocal and s the shear of a ray. A slab is entered at `bound *
/// n - (o * n + pad)`, fused, where n = r (1 - [`RELATIVE_PAD`]). It is left at `bound * f - (o * f - pad)`, where f =
/// r (1 + [`RELATIVE_PAD`]). Rounding is monotonic, so the slabs of a box contain the slabs of everything inside the
/// box. A hit's t is clamped to the slabs of its own triangle. Across the major axis, these slabs are padded like the
/// slabs of a box. Along the major axis, they are not padded, so that a wall across the ray is hit at its exact
/// distance. No box is therefore culled wrongly by a nearer t.
///
/// This requires only that the triangle's own slabs have a t in common. The rounded and sheared corners of an accepted
/// triangle enclose the ray exactly. Each sheared coordinate is x - s z, with an error of u |s z| from the product and
/// a relative error from the difference. The hit point is therefore in the slab of z, and its distance from the slabs
/// of x and y is at most 3 u T. T is the greatest t of anything in the tree along the major axis. All other errors are
/// relative to the computed t, and at most 7 u in total, except for the error 2 u |o r| from the rounding of `o * r`.
/// [`RELATIVE_PAD`] and a pad of 4 u T + 3 u |o r| exceed all these errors.
///
/// The pads are small and not a fraction of the largest coordinate: a ray that starts very close to a wall does not
/// enter the wall's boxes.
pub const SLAB_PAD: f32 = 4.0 * MACHINE_EPSILON;
pub const ORIGIN_PAD: f32 = 3.0 * MACHINE_EPSILON;
pub const RELATIVE_PAD: f32 = 12.0 * MACHINE_EPSILON;

/// The pad of a slab that is nearly parallel to the ray, as a multiple of T. The reciprocal r of such a slab is
/// clamped, see [`MAX_RECIPROCAL`].
const PARALLEL_PAD: f32 = 2.0;

/// The largest coordinate of a ray's origin. Products of this value and [`MAX_COORD`] stay finite.
pub const MAX_ORIGIN: f32 = (1u64 << 50) as f32;
/// The largest reciprocal of a direction. Smaller components are clamped; the resulting error is 2^-40 of the scene's
/// size.
pub const MAX_RECIPROCAL: f32 = (1u128 << 70) as f32;

/// Reciprocals and offsets of a ray for the planes on one side of slabs.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct SlabPlanes {
    pub reciprocal: [f32; LANES],
    pub offset: [f32; LANES],
}

/// Number of lanes: three axes and padding, because compilers vectorise four lanes but not three.
const LANES: usize = 4;

/// The length of a row of [`crate::node::WideNode::bounds`].
pub const BOUNDS_ROW: u32 = 8;

impl SlabPlanes {
    const EMPTY: SlabPlanes = SlabPlanes { reciprocal: [0.0; LANES], offset: [0.0; LANES] };

    /// The t at which the ray crosses a plane across an axis.
    #[inline(always)]
    pub fn t_at(&self, axis: usize, plane: f32) -> f32 {
        plane.mul_add(self.reciprocal[axis], -self.offset[axis])
    }
}

/// A ray in the coordinates of a tree, with the constants of its slab and triangle tests.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct TravRay {
    pub origin: [f32; LANES],
    /// Reciprocals of the direction's components; always finite.
    pub reciprocal: [f32; LANES],
    /// Reciprocals and offsets for entering slabs: a slab is entered at `bound * reciprocal - offset`.
    pub near: SlabPlanes,
    /// Reciprocals and offsets for leaving slabs; see [`SLAB_PAD`].
    pub far: SlabPlanes,
    /// The shear that maps the ray to its major axis: the shear of x, the shear of y, and the scale of z.
    pub shear: [f32; LANES],
    /// The major axis, along which the direction has its largest component, comes last; the two axes that follow it
    /// cyclically come first.
    pub axes: [u32; LANES],
    /// Per axis, the first float of the row of [`crate::node::WideNode::bounds`] where boxes are entered:
    /// [`BOUNDS_ROW`] times its index. The row where boxes are left is this value `^ BOUNDS_ROW`.
    pub near_rows: [u32; LANES],
    /// The ratio of t along this ray to t along the given ray: a power of two.
    pub t_scale: f64,
}

impl TravRay {
    /// A ray that is not set up.
    pub const EMPTY: TravRay = TravRay {
        origin: [0.0; LANES],
        reciprocal: [0.0; LANES],
        near: SlabPlanes::EMPTY,
        far: SlabPlanes::EMPTY,
        shear: [0.0; LANES],
        axes: [0, 1, 2, 0],
        near_rows: [0; LANES],
        t_scale: 1.0,
    };

    /// A ray set up by [`TravRay::setup`], or `None` for a ray that cannot hit anything.
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3], bounds: &Aabb, padding: f32) -> Option<TravRay> {
        let mut ray = TravRay::EMPTY;
        ray.setup(origin, direction, bounds, padding).then_some(ray)
    }

    /// Sets up a ray for a tree whose boxes get an additional absolute `padding`. Returns false without further effect
    /// if the ray is invalid and therefore misses: it is not finite, has no direction, or starts beyond 2^50. The
    /// function writes in place, because a copy right after the stores would stall on store forwarding.
    #[inline(always)]
    pub fn setup(&mut self, origin: [f32; 3], direction: [f32; 3], bounds: &Aabb, padding: f32) -> bool {
        let lanes = |[x, y, z]: [f32; 3]| [x, y, z, z];
        let largest = |v: [f32; LANES]| {
            let [x, y, z, _] = v.map(f32::abs);
            let most = if x > y { x } else { y };
            if most > z { most } else { z }
        };
        let (origin, mut direction) = (lanes(origin), lanes(direction));
        let mut steepest = largest(direction);
        // The sum is NaN if a component is not finite; comparisons alone would not detect NaN.
        let sum: [f32; LANES] = std::array::from_fn(|i| (origin[i] + direction[i]) * 0.0);
        let sane = (sum[0] + sum[1] + sum[2] == 0.0) & (largest(origin) <= MAX_ORIGIN);
        let mut t_scale = 1.0;
        if !(sane && (1.0 / MAX_COORD..=MAX_COORD).contains(&steepest)) {
            if !sane || steepest == 0.0 {
                return false;
            }
            (direction, t_scale) = normalize_direction(direction, steepest);
            steepest = largest(direction);
        }
        let size = direction.map(f32::abs);
        let z = select_unpredictable(size[0] == steepest, 0, select_unpredictable(size[1] == steepest, 1, 2));
        let axes = [[1, 2, 0, 0], [2, 0, 1, 0], [0, 1, 2, 0]][z];
        let mut reciprocal = direction.map(|d| 1.0 / d);
        let end = bounds.max_distance_along(z, [origin[z]; 2]) * reciprocal[z].abs();
        let mut pad = [end * SLAB_PAD; LANES];
        if size[0].min(size[1]).min(size[2]) * MAX_RECIPROCAL < 1.0 {
            (reciprocal, pad) = fix_parallel_axes(direction, reciprocal, end, pad);
        }
        (self.near, self.far) = slab_planes(origin, reciprocal, padding, pad);
        (self.origin, self.reciprocal) = (origin, reciprocal);
        let [x, y] = [axes[0] as usize, axes[1] as usize];
        let across = [direction[x], direction[y], 1.0, 1.0];
        self.shear = across.map(|d| d / direction[z]);
        self.axes = axes;
        let row = |i: usize| 2 * i as u32 + (reciprocal[i].to_bits() >> 31);
        self.near_rows = std::array::from_fn(|i| row(i) * BOUNDS_ROW);
        self.t_scale = t_scale;
        true
    }

    /// True if the ray is not parallel to any axis, as required by [`TravRay::translate`].
    #[inline(always)]
    pub fn has_no_parallel_axis(&self) -> bool {
        let [x, y, z, _] = self.reciprocal.map(f32::abs);
        x < MAX_RECIPROCAL && y < MAX_RECIPROCAL && z < MAX_RECIPROCAL
    }

    /// Same as [`TravRay::setup`] for another tree, with another origin and the same direction, which is not parallel
    /// to any axis.
    #[inline(always)]
    pub fn translate(&mut self, [x, y, z]: [f32; 3], bounds: &Aabb) -> bool {
        let origin = [x, y, z, z];
        let largest = origin.iter().fold(0.0, |m: f32, x| m.max(x.abs()));
        if largest > MAX_ORIGIN {
            return false;
        }
        let main = self.axes[2] as usize;
        let end = bounds.max_distance_along(main, [origin[main]; 2]) * self.reciprocal[main].abs();
        (self.near, self.far) = slab_planes(origin, self.reciprocal, 0.0, [end * SLAB_PAD; LANES]);
        self.origin = origin;
        true
    }

    /// Converts t along this ray to t along the given ray.
    #[inline(always)]
    pub fn to_outer_t(&self, t: f32) -> f32 {
        if self.t_scale == 1.0 { t } else { (f64::from(t) / self.t_scale) as f32 }
    }

    /// Converts t along the given ray to t along this ray.
    #[inline(always)]
    pub fn to_local_t(&self, t: f32) -> f32 {
        scale_t(t, self.t_scale)
    }
}

/// The padded planes where a ray enters and leaves slabs.
#[inline(always)]
fn slab_planes(
    origin: [f32; LANES],
    reciprocal: [f32; LANES],
    padding: f32,
    pad: [f32; LANES],
) -> (SlabPlanes, SlabPlanes) {
    let wide: [f32; LANES] = std::array::from_fn(|i| {
        (origin[i] * reciprocal[i]).abs() * ORIGIN_PAD + padding * reciprocal[i].abs() + pad[i]
    });
    let side = |factor: f32, sign: f32| {
        let reciprocal = reciprocal.map(|r| r * factor);
        let offset = std::array::from_fn(|i| origin[i] * reciprocal[i] + sign * wide[i]);
        SlabPlanes { reciprocal, offset }
    };
    (side(1.0 - RELATIVE_PAD, 1.0), side(1.0 + RELATIVE_PAD, -1.0))
}

/// Converts t to t along a ray whose t is `scale` times as large.
#[inline(always)]
pub fn scale_t(t: f32, scale: f64) -> f32 {
    if scale == 1.0 { t } else { (f64::from(t) * scale) as f32 }
}

/// The direction, divided by a power of two so that its largest component is in 1..2; and this divisor.
#[cold]
fn normalize_direction(direction: [f32; LANES], steepest: f32) -> ([f32; LANES], f64) {
    // A float64 that is converted from a nonzero float32 is never subnormal, so its exponent bits give its power of
    // two.
    let power = f64::from_bits(f64::from(steepest).to_bits() & (0x7ff << 52));
    (direction.map(|d| (f64::from(d) / power) as f32), power)
}

/// The reciprocals and pads of a ray nearly parallel to an axis.
#[cold]
fn fix_parallel_axes(
    direction: [f32; LANES],
    mut reciprocal: [f32; LANES],
    end: f32,
    mut pad: [f32; LANES],
) -> ([f32; LANES], [f32; LANES]) {
    for (axis, d) in direction.into_iter().enumerate() {
        if d.abs() * MAX_RECIPROCAL < 1.0 {
            reciprocal[axis] = MAX_RECIPROCAL.copysign(d);
            pad[axis] = end * PARALLEL_PAD;
        }
    }
    (reciprocal, pad)
}
