//! Axis-aligned bounding boxes of nodes, meshes and subtrees.

/// An axis-aligned bounding box in float32, given by its lower and upper corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    pub lower: [f32; 3],
    pub upper: [f32; 3],
}

impl Aabb {
    /// Bounds of the empty set: the identity element of the union.
    pub const EMPTY: Aabb = Aabb { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    /// Bounds that are used for a tree without triangles: only the origin.
    pub const ORIGIN: Aabb = Aabb { lower: [0.0; 3], upper: [0.0; 3] };

    /// Coordinate of the bounding plane in row `row`, in the order of [`crate::node::WideNode::bounds`]: lower x, upper
    /// x, lower y, upper y, lower z, upper z.
    #[inline(always)]
    pub fn plane(&self, row: usize) -> f32 {
        [&self.lower, &self.upper][row % 2][row / 2]
    }

    /// Half the surface area of the box.
    pub fn half_area(&self) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.upper[axis] - self.lower[axis]);
        x * y + y * z + z * x
    }

    /// The largest absolute value of the box's coordinates.
    #[inline(always)]
    pub fn max_abs_coord(&self) -> f32 {
        (0..3).fold(0.0, |r, axis| self.lower[axis].abs().max(self.upper[axis].abs()).max(r))
    }

    /// Largest distance along an axis between a point of the box and a point of the interval from `least` to
    /// `greatest`.
    #[inline(always)]
    pub fn max_distance_along(&self, axis: usize, [least, greatest]: [f32; 2]) -> f32 {
        (self.upper[axis] - least).max(greatest - self.lower[axis])
    }
}
