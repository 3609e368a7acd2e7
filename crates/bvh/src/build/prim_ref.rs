//! The builder's primitives, and the common bounds of several primitives.

use crate::aabb::Aabb;
use crate::simd::{F32x4, Isa, Vector};

/// A bounding box packed for SIMD: lower corner, padding, negated upper corner, padding. The union of two boxes is a
/// single minimum operation.
pub type PackedBounds = [f32; 8];

/// A build primitive: a bounding box with an id; 32 bytes.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub struct PrimRef {
    lower: [f32; 3],
    /// Id of the triangle, pair or instance in the box.
    pub id: u32,
    negated_upper: [f32; 3],
    pad: f32,
}

impl PrimRef {
    /// Creates the primitive with this bounding box.
    #[inline(always)]
    pub fn new(lower: [f32; 3], upper: [f32; 3], id: u32) -> Self {
        Self { lower, id, negated_upper: upper.map(|x| -x), pad: 0.0 }
    }

    /// The lower corner.
    #[cfg(test)]
    pub fn lower(&self) -> [f32; 3] {
        self.lower
    }

    /// The union of both boxes, with the id of the first.
    #[inline(always)]
    pub fn union(&self, b: &PrimRef) -> PrimRef {
        let least = |a: [f32; 3], b: [f32; 3]| std::array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] });
        PrimRef {
            lower: least(self.lower, b.lower),
            negated_upper: least(self.negated_upper, b.negated_upper),
            ..*self
        }
    }

    /// The surface area of the union of two boxes, divided by the sum of their surface areas.
    #[inline(always)]
    pub fn merge_area_ratio(&self, b: &PrimRef) -> f32 {
        let [a, b, both] = [self, b, &self.union(b)].map(|prim| {
            let [x, y, z] = std::array::from_fn(|i| prim.lower[i] + prim.negated_upper[i]);
            x * y + y * z + z * x
        });
        if a + b > 0.0 { both / (a + b) } else { 1.0 }
    }

    /// Loads the primitive as eight floats; one of these floats has the bits of the id.
    #[inline(always)]
    pub fn load<I: Isa>(&self) -> I::F32x8 {
        // SAFETY: a primitive consists of eight 32-bit words, and every 32-bit word is a valid float.
        unsafe { I::F32x8::load(std::ptr::from_ref(self).cast()) }
    }

    /// Twice the box's centre; the fourth lane is 0.
    #[inline(always)]
    pub fn centroid(&self) -> F32x4 {
        // The id is replaced by 0, because small ids are denormal as floats, and arithmetic on denormals is slow.
        let [x, y, z] = self.lower;
        let lower = F32x4::new([x, y, z, f32::from_bits(self.id)]).zero_w();
        let [x, y, z] = self.negated_upper;
        lower.sub(F32x4::new([x, y, z, self.pad]))
    }
}

/// The bounds of the empty set.
pub const EMPTY_BOUNDS: PackedBounds = [f32::INFINITY; 8];

/// Converts packed bounds to an AABB.
pub fn unpack_bounds(bounds: &PackedBounds) -> Aabb {
    let [a, b, c, _, d, e, f, _] = *bounds;
    Aabb { lower: [a, b, c], upper: [-d, -e, -f] }
}

/// The negated extent along each axis; the fourth lane is 0.
#[inline(always)]
pub fn diagonal<I: Isa>(bounds: I::F32x8) -> F32x4 {
    let [lower, negated_upper] = I::split_f32x4(bounds);
    // The lane of the id contains no coordinate, so it is ignored. The negative signs cancel in the products of an
    // area.
    lower.zero_w().add(negated_upper.zero_w())
}

/// Half the surface areas of four boxes, from their diagonals.
#[inline(always)]
pub fn half_areas(extents: [F32x4; 4]) -> F32x4 {
    let [x, y, z, _] = F32x4::transpose(extents);
    x.mul(y).add(y.mul(z)).add(z.mul(x))
}

/// Half the area of a box.
#[inline(always)]
pub fn half_area<I: Isa>(bounds: I::F32x8) -> f32 {
    // The extents are negated; the negative signs cancel in the products of the area. The lane of the id contains no
    // coordinate, so it is ignored.
    let [lower, negated_upper] = I::split_f32x4(bounds);
    lower.zero_w().add(negated_upper).half_area()
}

/// The bounds of some primitives and of their (doubled) centroids.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct PrimInfo {
    pub bounds: PackedBounds,
    pub centroid_lower: F32x4,
    pub centroid_upper: F32x4,
}

impl PrimInfo {
    /// The bounds of no primitives.
    pub fn empty() -> PrimInfo {
        PrimInfo {
            bounds: EMPTY_BOUNDS,
            centroid_lower: F32x4::splat(f32::INFINITY),
            centroid_upper: F32x4::splat(f32::NEG_INFINITY),
        }
    }

    /// The bounds of `prims`.
    #[inline(always)]
    pub fn from_prims<I: Isa>(prims: &[PrimRef]) -> PrimInfo {
        let mut range = Self::empty();
        let mut bounds = I::F32x8::splat(f32::INFINITY);
        for prim in prims {
            bounds = bounds.min(prim.load::<I>());
            let centroid = prim.centroid();
            range.centroid_lower = range.centroid_lower.min(centroid);
            range.centroid_upper = range.centroid_upper.max(centroid);
        }
        // SAFETY: the pointer refers to as many floats as the struct contains.
        unsafe { bounds.store(range.bounds.as_mut_ptr()) };
        range
    }

    /// The union of both bounds.
    pub fn merged(&self, b: &PrimInfo) -> PrimInfo {
        PrimInfo {
            bounds: std::array::from_fn(|i| self.bounds[i].min(b.bounds[i])),
            centroid_lower: self.centroid_lower.min(b.centroid_lower),
            centroid_upper: self.centroid_upper.max(b.centroid_upper),
        }
    }

    /// The bounds of the (doubled) centroids.
    #[cfg(test)]
    pub fn centroid_bounds(&self) -> ([f32; 3], [f32; 3]) {
        let three = |corner: F32x4| {
            let [x, y, z, _] = corner.array();
            [x, y, z]
        };
        (three(self.centroid_lower), three(self.centroid_upper))
    }
}
