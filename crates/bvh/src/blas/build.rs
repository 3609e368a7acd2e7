//! Building the BLAS of a mesh, or of several meshes flattened into one.

use rayon::prelude::*;

use crate::blas::Bvh;
use crate::build;
use crate::build::triangle_leaves::TrianglePrims;
use crate::error::BuildError;
use crate::limits::{MAX_COORD, MAX_TRIANGLES};
use crate::platform::dispatch::Dispatch;

impl Bvh {
    /// Builds the BVH of indexed triangles. Triangles without area are kept, and rays never hit them.
    ///
    /// Runs in parallel on the caller's rayon pool; the result does not depend on the pool.
    pub fn build(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<Self, BuildError> {
        Self::build_with(Dispatch::detect(), vertices, triangles, &[])
    }

    /// Same as [`Bvh::build`], for several meshes in one tree; `mesh_offsets` contains the index of each mesh's first
    /// triangle.
    pub(crate) fn build_flattened(
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        mesh_offsets: &[u32],
    ) -> Result<Self, BuildError> {
        Self::build_with(Dispatch::detect(), vertices, triangles, mesh_offsets)
    }

    fn build_with(
        dispatch: Dispatch,
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        mesh_offsets: &[u32],
    ) -> Result<Self, BuildError> {
        let scale = power_of_two_scale(validate_mesh(vertices, triangles)?);
        let mesh = TrianglePrims { vertices, triangles, scale, mesh_offsets };
        let tree = build::build(dispatch, &mesh, &mesh);
        Ok(Self { blocks: tree.blocks, root: tree.root, prim_ids: tree.ids, bounds: tree.bounds, scale })
    }
}

/// Power of two that scales `reach`, the largest coordinate, into the range of tree coordinates, without overflow or
/// underflow; 1 except for extreme scenes.
pub(crate) fn power_of_two_scale(reach: f32) -> f32 {
    if reach == 0.0 || (1.0 / (1 << 20) as f32..=MAX_COORD).contains(&reach) {
        return 1.0;
    }
    let power = f64::from_bits(f64::from(reach).to_bits() & (0x7ff << 52));
    (1.0 / power).min(f64::from(2f32.powi(126))) as f32
}

/// Number of vertices or triangles per parallel task of the validation.
const VALIDATION_CHUNK: usize = 1 << 14;

/// Validates a mesh; returns its largest absolute coordinate.
pub(crate) fn validate_mesh(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<f32, BuildError> {
    if triangles.len() > MAX_TRIANGLES {
        return Err(BuildError::TooLarge { what: "triangles", given: triangles.len(), limit: MAX_TRIANGLES });
    }
    // Without their signs, the bits of floats have the same order as the floats, with NaN and infinity last. A
    // vectorised maximum detects whether any value is invalid; the invalid value is searched for only if there is one.
    let largest = |words: &[[u32; 3]]| words.as_flattened().iter().fold(0, |a, &b| a.max(b));
    let size = |v: &[[f32; 3]]| {
        let sizes = v.as_flattened().iter().map(|x| x.to_bits() << 1 >> 1);
        sizes.fold(0, u32::max)
    };
    let reach = f32::from_bits(vertices.par_chunks(VALIDATION_CHUNK).map(size).max().unwrap_or(0));
    if !reach.is_finite() {
        let bad = |v: &[f32; 3]| !v.iter().all(|x| x.is_finite());
        let at = vertices.par_iter().position_first(bad).unwrap_or_default();
        return Err(BuildError::NonFinite { what: format!("vertex {at}") });
    }
    let last = triangles.par_chunks(VALIDATION_CHUNK).map(largest).max();
    if last.is_some_and(|last| last as usize >= vertices.len()) {
        let outside = |index: &u32| *index as usize >= vertices.len();
        let flat = triangles.as_flattened();
        let at = flat.par_iter().position_first(outside).unwrap_or_default();
        return Err(BuildError::IndexOutOfRange { triangle: at / 3, index: flat[at], vertices: vertices.len() });
    }
    Ok(reach)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::NodeBlock;
    use crate::platform::dispatch::InstructionSet;

    type Indexed = (&'static str, Vec<[f32; 3]>, Vec<[u32; 3]>);

    /// Three kinds of meshes: a height field, whose triangles share vertices; triangles of any size and position; many
    /// copies of a few triangles.
    fn meshes(side: u32) -> [Indexed; 3] {
        let random = |i: u32| (i.wrapping_mul(2_654_435_761) >> 9) as f32 / (1 << 22) as f32 - 1.0;
        let across = side + 1;
        let heights = (0..across * across).map(|i| [(i % across) as f32, (i / across) as f32, random(i)]).collect();
        let cells = (0..side * side).flat_map(|k| {
            let a = k / side * across + k % side;
            [[a, a + 1, a + across], [a + 1, a + across + 1, a + across]]
        });
        let n = 2 * side * side;
        let apart = (0..3 * n).map(|i| {
            let [centre, size] = [random(i / 3), 0.3 * random(i / 3 + 7).powi(8)];
            std::array::from_fn(|a| centre * (a as f32 + 0.5) + size * random(3 * i + a as u32))
        });
        let alone = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [1.0; 3]];
        let few = [[0, 1, 2], [1, 2, 3], [0, 1, 3]];
        [
            ("heights", heights, cells.collect()),
            ("apart", apart.collect(), (0..n).map(alone).collect()),
            ("copies", corners.to_vec(), (0..n as usize).map(|i| few[i % 3]).collect()),
        ]
    }

    fn bytes(bvh: &Bvh) -> Vec<u8> {
        let mut bytes: Vec<_> = bvh
            .blocks
            .iter()
            // SAFETY: nodes and leaves consist of plain numbers, without padding bytes.
            .flat_map(|block| unsafe { std::mem::transmute::<NodeBlock, [u8; 256]>(*block) })
            .collect();
        let corners = [bvh.bounds.lower, bvh.bounds.upper].into_iter().flatten();
        let floats = corners.chain([bvh.scale]).flat_map(f32::to_ne_bytes);
        let root = [bvh.root.index() as u32, u32::from(bvh.root.is_leaf())];
        let words = bvh.prim_ids.iter().chain(&root);
        bytes.extend(words.flat_map(|word| word.to_ne_bytes()).chain(floats));
        bytes
    }

    #[test]
    fn trees_are_identical_for_every_instruction_set_and_thread_count() {
        // The mesh is large enough for several treelets, for sampling, and for binning by several threads.
        let side = if cfg!(miri) { 12 } else { 132 };
        let counts: &[usize] = if cfg!(miri) { &[2] } else { &[1, 2, 5] };
        for (name, vertices, triangles) in meshes(side) {
            let build = |isa, threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let dispatch = Dispatch::try_new(isa).unwrap();
                let mesh = || Bvh::build_with(dispatch, &vertices, &triangles, &[]);
                bytes(&pool.unwrap().install(mesh).unwrap())
            };
            let expected = build(InstructionSet::Portable, 1);
            let available = InstructionSet::ALL.into_iter();
            for isa in available.filter(|isa| isa.is_available()) {
                for &threads in counts {
                    let same = build(isa, threads) == expected;
                    assert!(same, "{name}, {}, {threads} threads", isa.name());
                }
            }
        }
    }
}
