//! Boxes to be placed in a tree, and the boxes of many of them.

use crate::simd::{Isa, Quad, Vector};

/// Eight floats that are read together: a lower corner, any number, a negated upper corner, any number. The union of
/// two boxes is then one minimum.
pub type Octet = [f32; 8];

/// A box to be placed in the tree; 32 bytes.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub struct Item {
    lower: [f32; 3],
    /// What the box belongs to.
    pub id: u32,
    negated_upper: [f32; 3],
    pad: f32,
}

impl Item {
    /// A box with its id.
    #[inline(always)]
    pub fn new(lower: [f32; 3], upper: [f32; 3], id: u32) -> Self {
        Self {
            lower,
            id,
            negated_upper: upper.map(|x| -x),
            pad: 0.0,
        }
    }

    /// The lower corner.
    #[cfg(test)]
    pub fn lower(&self) -> [f32; 3] {
        self.lower
    }

    /// The box of both, with the id of the first.
    #[inline(always)]
    pub fn joined(&self, b: &Item) -> Item {
        let least = |a: [f32; 3], b: [f32; 3]| {
            std::array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
        };
        Item {
            lower: least(self.lower, b.lower),
            negated_upper: least(self.negated_upper, b.negated_upper),
            ..*self
        }
    }

    /// The surface of the box of both, beside the surfaces of both boxes.
    #[inline(always)]
    pub fn join_cost(&self, b: &Item) -> f32 {
        let [a, b, both] = [self, b, &self.joined(b)].map(|item| {
            let [x, y, z] = std::array::from_fn(|i| item.lower[i] + item.negated_upper[i]);
            x * y + y * z + z * x
        });
        if a + b > 0.0 { both / (a + b) } else { 1.0 }
    }

    /// All of it, as floats.
    #[inline(always)]
    pub fn octet<I: Isa>(&self) -> I::F8 {
        // SAFETY: an item is eight 32-bit words, any of which is a float.
        unsafe { I::F8::load(std::ptr::from_ref(self).cast()) }
    }

    /// Twice the centre, and 0.
    #[inline(always)]
    pub fn centre(&self) -> Quad {
        // An id read as a float is a tiny number, and arithmetic on those is slow: it goes.
        let [x, y, z] = self.lower;
        let lower = Quad::new([x, y, z, f32::from_bits(self.id)]).three();
        let [x, y, z] = self.negated_upper;
        lower.sub(Quad::new([x, y, z, self.pad]))
    }
}

/// The box of nothing.
pub const NOTHING: Octet = [f32::INFINITY; 8];

/// Lower and upper corner of a box.
pub fn corners(bounds: &Octet) -> ([f32; 3], [f32; 3]) {
    let [a, b, c, _, d, e, f, _] = *bounds;
    ([a, b, c], [-d, -e, -f])
}

/// How far a box reaches along each axis, and 0.
#[inline(always)]
pub fn extent<I: Isa>(bounds: I::F8) -> Quad {
    let [lower, negated_upper] = I::quads(bounds);
    // The ids' lane is no number to calculate with. All factors of a surface are negated.
    lower.three().add(negated_upper.three())
}

/// Half the surfaces of four boxes, given their extents.
#[inline(always)]
pub fn half_areas(extents: [Quad; 4]) -> Quad {
    let [x, y, z, _] = Quad::transpose(extents);
    x.mul(y).add(y.mul(z)).add(z.mul(x))
}

/// Half the surface of a box.
#[inline(always)]
pub fn half_area<I: Isa>(bounds: I::F8) -> f32 {
    // Both factors of each product are negated. The ids' lane is no number to calculate with.
    let [lower, negated_upper] = I::quads(bounds);
    lower.three().add(negated_upper).pair_products()
}

/// The box of some items and the box of their (doubled) centres.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct Range {
    pub bounds: Octet,
    pub centre_lower: Quad,
    pub centre_upper: Quad,
}

impl Range {
    /// The range of nothing.
    pub fn empty() -> Range {
        Range {
            bounds: NOTHING,
            centre_lower: Quad::splat(f32::INFINITY),
            centre_upper: Quad::splat(f32::NEG_INFINITY),
        }
    }

    /// The range of `items`.
    #[inline(always)]
    pub fn of<I: Isa>(items: &[Item]) -> Range {
        let mut range = Self::empty();
        let mut bounds = I::F8::splat(f32::INFINITY);
        for item in items {
            bounds = bounds.min(item.octet::<I>());
            let centre = item.centre();
            range.centre_lower = range.centre_lower.min(centre);
            range.centre_upper = range.centre_upper.max(centre);
        }
        // SAFETY: as many floats as it holds.
        unsafe { bounds.store(range.bounds.as_mut_ptr()) };
        range
    }

    /// The range of both.
    pub fn merged(&self, b: &Range) -> Range {
        Range {
            bounds: std::array::from_fn(|i| self.bounds[i].min(b.bounds[i])),
            centre_lower: self.centre_lower.min(b.centre_lower),
            centre_upper: self.centre_upper.max(b.centre_upper),
        }
    }

    /// The lower and the upper corner of the box of the (doubled) centres.
    #[cfg(test)]
    pub fn centres(&self) -> ([f32; 3], [f32; 3]) {
        let three = |corner: Quad| {
            let [x, y, z, _] = corner.array();
            [x, y, z]
        };
        (three(self.centre_lower), three(self.centre_upper))
    }
}
