//! A ray made ready for one tree.

/// Half an ulp of 1: the relative error of one rounding.
pub const EPS: f32 = 1.0 / (1 << 24) as f32;

/// What a coordinate may be off by, in [`EPS`] of the largest coordinate at hand (see [`LocalRay::new`]).
///
/// An accepted triangle's rounded and sheared corners enclose the ray exactly, and rounding and shear move a corner by
/// less than 6 such units; a triangle's slab computed here is off by less than 4 and a node's by less than 6. So the box
/// of an accepted triangle, padded by `TRIANGLE_PAD` = 12, has a (computed) interval of t that is not empty and inside
/// that of any box around it, padded by `BOX_PAD` = 24. On the main axis, where 1 / direction is smallest, a triangle
/// needs no padding: a wall across the ray is hit at its own distance.
/// A hit's t is clamped to the triangle's own interval: it then lies in the interval of every box above the triangle,
/// no box is culled by a nearer t wrongly, and the answer does not depend on the tree or the order of its traversal.
pub const TRIANGLE_PAD: f32 = 12.0 * EPS;
pub const BOX_PAD: f32 = 24.0 * EPS;

/// Largest coordinate of a ray's origin, next to meshes that reach at most [`REACH_LIMIT`]: products of two stay finite.
pub const ORIGIN_LIMIT: f32 = (1u64 << 50) as f32;
/// Meshes and scenes are scaled by a power of two where they reach farther than this.
pub const REACH_LIMIT: f32 = (1 << 30) as f32;
/// The largest reciprocal of a direction: what is flatter runs as if it were this steep, off by 2^-40 of the scene.
pub const STEEPEST: f32 = (1u128 << 70) as f32;

/// What the test of triangles needs of a ray.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct TriangleRay {
    pub origin: [f32; 3],
    /// One over the direction, finite.
    pub reciprocal: [f32; 3],
    /// By how much a triangle's own interval of t is padded on each axis.
    pub pad: [f32; 3],
    /// Shear that takes the ray to its main axis: x, y, and the scale of z.
    pub shear: [f32; 3],
    /// The axis along which the ray runs most comes last, after the two that follow it.
    pub axes: [usize; 3],
}

/// A ray in the coordinates of a tree, with what its tests need.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct LocalRay {
    pub triangle: TriangleRay,
    /// `origin * reciprocal`, padded: a slab begins at `bound * reciprocal - near`.
    pub near: [f32; 3],
    /// ... and ends at `bound * reciprocal - far`.
    pub far: [f32; 3],
    /// Per axis, the row of [`crate::block::Node::bounds`] where boxes are entered; `row ^ 1` is where they are left.
    pub entry: [usize; 3],
    /// The largest coordinate of ray and tree.
    pub magnitude: f32,
    /// t along this ray is `t_scale` times that of the ray it was made of: a power of two.
    pub t_scale: f64,
}

impl LocalRay {
    /// No ray yet.
    pub const NONE: LocalRay = LocalRay {
        triangle: TriangleRay {
            origin: [0.0; 3],
            reciprocal: [0.0; 3],
            pad: [0.0; 3],
            shear: [0.0; 3],
            axes: [0, 1, 2],
        },
        near: [0.0; 3],
        far: [0.0; 3],
        entry: [0; 3],
        magnitude: 0.0,
        t_scale: 1.0,
    };

    /// A ray against a tree whose coordinates are at most `reach`, which pads boxes by `slack` in addition, a length;
    /// `None` for a ray that meets nothing by definition: not finite, without direction, or from beyond 2^50.
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3], reach: f32, slack: f32) -> Option<LocalRay> {
        let largest = |v: [f32; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let steepest = largest(direction);
        let distance = largest(origin);
        // The sum is NaN or infinite exactly if a component is, which `max` would hide.
        let sum = origin[0]
            + origin[1]
            + origin[2]
            + (direction[0] * 0.0 + direction[1] * 0.0 + direction[2] * 0.0);
        if !(sum.is_finite() && distance <= ORIGIN_LIMIT && steepest > 0.0) {
            return None;
        }
        let (mut direction, mut t_scale) = (direction, 1.0);
        if !(1.0 / REACH_LIMIT..=REACH_LIMIT).contains(&steepest) {
            (direction, t_scale) = rescaled(direction, steepest);
        }
        let magnitude = distance + reach;
        let box_pad = BOX_PAD * magnitude + slack;
        let triangle_pad = TRIANGLE_PAD * magnitude;
        let reciprocal = direction.map(|d| {
            if d.abs() * STEEPEST >= 1.0 {
                1.0 / d
            } else {
                STEEPEST.copysign(d)
            }
        });
        let z = if direction[0].abs() >= direction[1].abs()
            && direction[0].abs() >= direction[2].abs()
        {
            0
        } else if direction[1].abs() >= direction[2].abs() {
            1
        } else {
            2
        };
        let (x, y) = ([1, 2, 0][z], [2, 0, 1][z]);
        let at = |axis: usize| origin[axis] * reciprocal[axis];
        let wide = |axis: usize| box_pad * reciprocal[axis].abs();
        Some(LocalRay {
            triangle: TriangleRay {
                origin,
                reciprocal,
                pad: std::array::from_fn(|axis| {
                    if axis == z {
                        0.0
                    } else {
                        triangle_pad * reciprocal[axis].abs()
                    }
                }),
                shear: [
                    direction[x] / direction[z],
                    direction[y] / direction[z],
                    1.0 / direction[z],
                ],
                axes: [x, y, z],
            },
            near: [at(0) + wide(0), at(1) + wide(1), at(2) + wide(2)],
            far: [at(0) - wide(0), at(1) - wide(1), at(2) - wide(2)],
            entry: std::array::from_fn(|axis| 2 * axis + usize::from(reciprocal[axis] < 0.0)),
            magnitude,
            t_scale,
        })
    }

    /// t of the ray this one was made of.
    #[inline(always)]
    pub fn outer_t(&self, t: f32) -> f32 {
        if self.t_scale == 1.0 {
            t
        } else {
            (f64::from(t) / self.t_scale) as f32
        }
    }

    /// t along this ray.
    #[inline(always)]
    pub fn inner_t(&self, t: f32) -> f32 {
        if self.t_scale == 1.0 {
            t
        } else {
            (f64::from(t) * self.t_scale) as f32
        }
    }
}

/// The direction with its largest component in 1..2, and by what it was divided.
#[cold]
fn rescaled(direction: [f32; 3], steepest: f32) -> ([f32; 3], f64) {
    // The exponent of a float64 that came from a float32 is never subnormal.
    let power = f64::from_bits(f64::from(steepest).to_bits() & (0x7ff << 52));
    (direction.map(|d| (f64::from(d) / power) as f32), power)
}
