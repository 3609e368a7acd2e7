//! Nodes and leaves of the wide BVH: 256-byte blocks, each an inner node of eight children or a leaf of sixteen
//! triangles.

use crate::aabb::Aabb;

/// Reference to a node or a leaf: an index into the blocks of a tree, with [`NodeRef::LEAF_FLAG`] for leaves. A leaf of
/// the TLAS has no block; its index refers to a subtree of an instance.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeRef(u32);

impl NodeRef {
    /// The bit that distinguishes leaves from inner nodes.
    pub const LEAF_FLAG: u32 = 1 << 31;

    /// The root of an empty tree and the reference of an unused child. Its leaf flag is set.
    pub const EMPTY: NodeRef = NodeRef(u32::MAX);

    /// Creates a reference to an inner node.
    #[inline(always)]
    pub fn node(index: usize) -> NodeRef {
        NodeRef(index as u32)
    }

    /// Creates a reference to a leaf.
    #[inline(always)]
    pub const fn leaf(index: usize) -> NodeRef {
        NodeRef(index as u32 | Self::LEAF_FLAG)
    }

    /// True for leaves and for [`NodeRef::EMPTY`].
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF_FLAG != 0
    }

    /// The index of the block, without the leaf flag.
    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & !Self::LEAF_FLAG) as usize
    }

    /// The reference after the indices of all blocks have increased by `base`.
    #[inline(always)]
    pub fn offset(self, base: usize) -> NodeRef {
        NodeRef(self.0 + base as u32)
    }
}

/// The largest number of triangles, and of distinct vertices, in a leaf.
pub const MAX_LEAF_TRIANGLES: usize = 16;

/// An inner node: the AABBs of eight children in SoA. An unused child has an inverted box, which no ray enters.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct WideNode {
    /// The children's bounds in six rows: lower x, upper x, lower y, upper y, lower z, upper z.
    pub bounds: [[f32; 8]; 6],
    /// The children; [`NodeRef::EMPTY`] in unused slots.
    pub children: [NodeRef; 8],
    /// The number of children; their slots come first.
    pub child_count: u32,
    _pad: [u32; 7],
}

impl WideNode {
    /// Returns a node without children.
    pub const EMPTY: WideNode = WideNode {
        bounds: {
            let (lower, upper) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
            [lower, upper, lower, upper, lower, upper]
        },
        children: [NodeRef::EMPTY; 8],
        child_count: 0,
        _pad: [0; 7],
    };

    /// Adds a child in the first unused slot.
    pub fn push_child(&mut self, bounds: Aabb, child: NodeRef) {
        let lane = self.child_count as usize;
        self.set_child_bounds(lane, bounds);
        self.children[lane] = child;
        self.child_count += 1;
    }

    /// Sets the bounds of the child in slot `lane`.
    pub fn set_child_bounds(&mut self, lane: usize, Aabb { lower, upper }: Aabb) {
        for axis in 0..3 {
            self.bounds[2 * axis][lane] = lower[axis];
            self.bounds[2 * axis + 1][lane] = upper[axis];
        }
    }

    /// The bounds of the child in slot `lane`.
    pub fn child_bounds(&self, lane: usize) -> Aabb {
        let corner = |side: usize| std::array::from_fn(|axis| self.bounds[2 * axis + side][lane]);
        Aabb { lower: corner(0), upper: corner(1) }
    }
}

/// A leaf: up to sixteen triangles that share up to sixteen vertices.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct LeafNode {
    /// x, y and z of the vertices; unused entries repeat the first vertex.
    pub vertices: [[f32; 16]; 3],
    /// First, second and third corners, packed by [`crate::simd::pack_indices`].
    pub packed_indices: [u64; 3],
    /// Position of the first triangle in the primitive ids of the mesh.
    pub first_prim: u32,
    /// The number of triangles.
    pub count: u32,
    /// Bit i: the float32 area of triangle i is not 0, so rays can hit the triangle.
    pub non_degenerate: u32,
    /// The bounds of the vertices: lower x, upper x, lower y, upper y, lower z, upper z.
    pub bounds: [f32; 6],
    /// Bit i: triangle i is a sliver, whose depth may need float64.
    sliver_mask: u32,
}

/// A triangle is a sliver if its longest edge squared exceeds this ratio times twice its area.
const SLIVER_RATIO: f64 = 64.0;

impl LeafNode {
    /// Creates a leaf of triangles, given by their corners as indices into `vertices`.
    #[inline(always)]
    pub fn new(vertices: &[[f32; 3]], corners: &[[u8; 3]], first: u32) -> LeafNode {
        let mut vertex = [0, 1, 2].map(|axis| [vertices[0][axis]; MAX_LEAF_TRIANGLES]);
        for (lane, at) in vertices.iter().enumerate() {
            for axis in 0..3 {
                vertex[axis][lane] = at[axis];
            }
        }
        let mut lanes = [[0; MAX_LEAF_TRIANGLES]; 3];
        let mut places = [[[0.0; MAX_LEAF_TRIANGLES]; 3]; 3];
        for (triangle, corners) in corners.iter().enumerate() {
            for k in 0..3 {
                lanes[k][triangle] = corners[k];
                for axis in 0..3 {
                    places[k][axis][triangle] = vertices[corners[k] as usize][axis].into();
                }
            }
        }
        let (solid, thin) = classify_triangles(&places);
        let bounds = std::array::from_fn(|k| {
            let along = vertex[k / 2].into_iter();
            match k % 2 {
                0 => along.fold(f32::INFINITY, |a, b| if b < a { b } else { a }),
                _ => along.fold(f32::NEG_INFINITY, |a, b| if b > a { b } else { a }),
            }
        });
        let corner = lanes.map(|lanes| crate::simd::pack_indices(&lanes));
        LeafNode {
            vertices: vertex,
            packed_indices: corner,
            first_prim: first,
            count: corners.len() as u32,
            non_degenerate: solid,
            bounds,
            sliver_mask: thin,
        }
    }

    /// True if triangle `k` is a sliver.
    #[inline(always)]
    pub fn is_sliver(&self, k: usize) -> bool {
        self.sliver_mask >> k & 1 != 0
    }

    /// True if any triangle is a sliver.
    #[inline(always)]
    pub fn has_slivers(&self) -> bool {
        self.sliver_mask != 0
    }

    /// Moves the triangles to new corner positions; returns the triangles' bounds. Shared vertices stay shared.
    pub fn refit(&mut self, triangles: impl Iterator<Item = [[f32; 3]; 3]>) -> Aabb {
        let mut vertices = [[0.0; 3]; MAX_LEAF_TRIANGLES];
        let mut corners = [[0; 3]; MAX_LEAF_TRIANGLES];
        let (mut used, mut count) = (0, 0);
        for (k, triangle) in triangles.enumerate() {
            for (c, vertex) in triangle.into_iter().enumerate() {
                let lane = crate::simd::packed_index(self.packed_indices[c], k);
                vertices[lane as usize] = vertex;
                corners[k][c] = lane;
                used = used.max(lane as usize + 1);
            }
            count = k + 1;
        }
        *self = Self::new(&vertices[..used], &corners[..count], self.first_prim);
        let corner = |side: usize| std::array::from_fn(|axis| self.bounds[2 * axis + side]);
        Aabb { lower: corner(0), upper: corner(1) }
    }
}

/// Two bit masks: triangles with an area, and slivers. `corners` is indexed by corner, axis and triangle. This loop has
/// no branches, so that the compiler vectorises it.
#[inline(always)]
fn classify_triangles(corners: &[[[f64; MAX_LEAF_TRIANGLES]; 3]; 3]) -> (u32, u32) {
    let (mut solid, mut thin) = ([0; MAX_LEAF_TRIANGLES], [0; MAX_LEAF_TRIANGLES]);
    for i in 0..MAX_LEAF_TRIANGLES {
        let triangle = std::array::from_fn(|k| std::array::from_fn(|axis| corners[k][axis][i]));
        let [x, y, z] = cross(triangle);
        solid[i] = u32::from((x != 0.0) | (y != 0.0) | (z != 0.0)) << i;
        thin[i] = u32::from(is_sliver(triangle)) << i;
    }
    let all = |bits: [u32; MAX_LEAF_TRIANGLES]| bits.into_iter().fold(0, |all, bit| all | bit);
    (all(solid), all(thin))
}

/// (b - a) x (c - a) of a triangle a, b, c.
#[inline(always)]
pub fn cross([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let (e, f): ([f64; 3], [f64; 3]) =
        (std::array::from_fn(|axis| b[axis] - a[axis]), std::array::from_fn(|axis| c[axis] - a[axis]));
    [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
}

#[inline(always)]
fn is_sliver([a, b, c]: [[f64; 3]; 3]) -> bool {
    let square = |p: [f64; 3]| p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    let edge = |p: [f64; 3], q: [f64; 3]| square([p[0] - q[0], p[1] - q[1], p[2] - q[2]]);
    let more = |a: f64, b: f64| if b > a { b } else { a };
    let longest = more(more(edge(a, b), edge(b, c)), edge(c, a));
    longest * longest > SLIVER_RATIO * SLIVER_RATIO * square(cross([a, b, c]))
}

/// An inner node or a leaf; the reference to the block specifies which.
#[repr(C)]
#[derive(Clone, Copy)]
pub union NodeBlock {
    pub node: WideNode,
    pub leaf: LeafNode,
}

const _: () = assert!(size_of::<WideNode>() == 256 && size_of::<LeafNode>() == 256 && size_of::<NodeBlock>() == 256);

/// The inner node that `at` refers to.
#[inline(always)]
pub fn node(blocks: &[NodeBlock], at: NodeRef) -> &WideNode {
    debug_assert!(!at.is_leaf() && at.index() < blocks.len());
    // SAFETY: the references of a tree refer to its own blocks, and distinguish nodes from leaves.
    unsafe { &blocks.get_unchecked(at.0 as usize).node }
}

/// The leaf that `at` refers to.
#[inline(always)]
pub fn leaf(blocks: &[NodeBlock], at: NodeRef) -> &LeafNode {
    debug_assert!(at.is_leaf() && at != NodeRef::EMPTY);
    // SAFETY: as in `node`.
    unsafe { &blocks.get_unchecked(at.index()).leaf }
}
