//! Trees over boxes of different sizes and arrangements.

use super::*;
use crate::Bvh;
use crate::build::prim_ref::PrimRef;
use crate::limits::MAX_DEPTH;
use crate::node::NodeBlock;

/// A builder with one box per leaf. The field is the sampling rate: one in this number of boxes is sampled for the top
/// of the tree; `None` uses all boxes.
struct Boxes(Option<usize>);

impl LeafBuilder for Boxes {
    const LEAVES_ARE_BLOCKS: bool = false;
    const TYPICAL_LEAF_PRIMS: usize = 1;
    type Scratch = ();
    fn begin_treelet(&self, prims: &mut [PrimRef], _notes: &mut ()) -> usize {
        prims.len()
    }
    fn fits(&self, prims: &[PrimRef], _notes: &mut ()) -> bool {
        prims.len() == 1
    }
    fn create_leaf(
        &self,
        prims: &[PrimRef],
        _notes: &mut (),
        ids: &mut Vec<u32>,
        _blocks: &mut Vec<NodeBlock>,
    ) -> NodeRef {
        ids.push(prims[0].id);
        NodeRef::leaf(prims[0].id as usize)
    }
    fn max_binary_leaf_prims(&self) -> usize {
        1
    }
    fn bin_count(&self, prims: usize) -> usize {
        if prims > TREELET_SIZE { 64 } else { 16 }
    }
    fn sample_stride(&self) -> Option<usize> {
        self.0
    }
}

/// Asserts that every box is in the tree once and inside all boxes above it, that leaves come last, and that no path is
/// too long; returns the longest path.
fn check(tree: &BuiltBvh, boxes: &[([f32; 3], [f32; 3])]) -> usize {
    let mut seen = vec![false; boxes.len()];
    let mut deepest = 0;
    let mut open = vec![(tree.root, tree.bounds.lower, tree.bounds.upper, 0)];
    while let Some((at, lower, upper, depth)) = open.pop() {
        deepest = deepest.max(depth);
        if at.is_leaf() {
            let id = at.index();
            assert!(!std::mem::replace(&mut seen[id], true), "box {id} is in two leaves");
            let (l, u) = boxes[id];
            assert!((0..3).all(|a| lower[a] <= l[a] && u[a] <= upper[a]), "box {id} is not inside its parent's bounds");
            continue;
        }
        let node = crate::node::node(&tree.blocks, at);
        assert!(node.child_count > 0);
        let below = &node.children[..node.child_count as usize];
        assert!(below.is_sorted_by_key(|child| child.is_leaf()), "{at:?}: a leaf precedes an inner node");
        for k in 0..node.child_count as usize {
            let l = [node.bounds[0][k], node.bounds[2][k], node.bounds[4][k]];
            let u = [node.bounds[1][k], node.bounds[3][k], node.bounds[5][k]];
            assert!(
                (0..3).all(|a| lower[a] <= l[a] && u[a] <= upper[a]),
                "child {k} of {at:?} is not inside its parent's bounds"
            );
            open.push((node.children[k], l, u, depth + 1));
        }
    }
    assert!(seen.iter().all(|s| *s), "a box is missing");
    assert!(deepest <= MAX_DEPTH, "{deepest} levels");
    deepest
}

fn built(boxes: &[([f32; 3], [f32; 3])], sample: Option<usize>) -> BuiltBvh {
    let prims = boxes.iter().zip(0..);
    let prims: Vec<_> = prims.map(|(b, id)| PrimRef::new(b.0, b.1, id)).collect();
    build(Dispatch::detect(), prims.as_slice(), &Boxes(sample))
}

#[test]
fn trees_contain_every_box_once() {
    const N: u32 = 12 * TREELET_SIZE as u32;
    let point = |x: f32| ([x; 3], [x; 3]);
    let same = vec![point(1.0); N as usize];
    let spread: Vec<_> = (0..N).map(|i| point((i.wrapping_mul(2_654_435_761) >> 8) as f32)).collect();
    // Each box is half the size of the previous box, so the heuristic alone would create a tree as deep as a list.
    let shrinking: Vec<_> = (0..140).map(|i| ([0.0; 3], [0.5f32.powi(i - 30); 3])).collect();
    let nested: Vec<_> = (0..N).map(|i| ([-1.0 - i as f32; 3], [1.0 + i as f32; 3])).collect();
    // All boxes that the sample does not contain are at the same position.
    let hidden = (0..N as usize)
        .map(|i| {
            let shown = i % 4 == kd_sample::sample_offset(i / 4) % 4;
            point(if shown { i as f32 } else { 0.5 })
        })
        .collect();
    for boxes in [same, spread, shrinking, nested, hidden, vec![point(0.0)]] {
        for sample in [None, Some(1), Some(4), Some(16)] {
            check(&built(&boxes, sample), &boxes);
        }
    }
}

/// Triangles without common edges, in eight clusters.
fn clouds(count: u32, seed: u32) -> Vec<[f32; 3]> {
    let random = |i: u32, k: u32| {
        let word = u64::from((seed * count + i) * 8 + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let word = (word ^ word >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (word >> 40) as f32 / (1 << 24) as f32
    };
    let corner = |i: u32| {
        let (triangle, cloud) = (i / 3, i / 3 % 8);
        std::array::from_fn(|axis| {
            let k = axis as u32;
            let (centroid, size) = (random(cloud, k + 3), 0.2 * random(cloud + 8, k + 3));
            let about = random(triangle, k) + random(triangle + count, k) - 1.0;
            centroid + size * about + 0.003 * random(i + 2 * count, k)
        })
    };
    (0..3 * count).map(corner).collect()
}

#[test]
fn node_boxes_contain_their_children() {
    for (seed, parts) in (0..12).zip((9..).step_by(2)) {
        let count = parts * TREELET_SIZE as u32;
        let vertices = clouds(count, seed);
        let triangles: Vec<_> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        {
            let bvh = Bvh::build(&vertices, &triangles).unwrap();
            let mut open = vec![bvh.root()];
            while let Some(at) = open.pop() {
                let node = crate::node::node(bvh.blocks(), at);
                for k in 0..node.child_count as usize {
                    let (Aabb { lower, upper }, child) = (node.child_bounds(k), node.children[k]);
                    let mut below = vec![];
                    if child.is_leaf() {
                        let [a, b, c, d, e, f] = crate::node::leaf(bvh.blocks(), child).bounds;
                        below.push(Aabb { lower: [a, c, e], upper: [b, d, f] });
                    } else {
                        let inner = crate::node::node(bvh.blocks(), child);
                        below.extend((0..inner.child_count as usize).map(|k| inner.child_bounds(k)));
                        open.push(child);
                    }
                    let within =
                        |Aabb { lower: l, upper: u }: &Aabb| (0..3).all(|a| lower[a] <= l[a] && u[a] <= upper[a]);
                    assert!(below.iter().all(within), "clouds {seed}");
                }
            }
        }
    }
}

#[test]
fn tree_does_not_depend_on_the_number_of_threads() {
    let boxes: Vec<_> = (0..20 * TREELET_SIZE as u32)
        .map(|i| {
            let x = |k: u32| ((i * 3 + k).wrapping_mul(2_654_435_761) >> 8) as f32;
            ([x(0), x(1), x(2)], [x(0) + 9e3, x(1) + 9e3, x(2) + 9e3])
        })
        .collect();
    for sample in [None, Some(4)] {
        let trees = [1, 2, 5].map(|n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| built(&boxes, sample))
        });
        for tree in &trees[1..] {
            assert_eq!(tree.root, trees[0].root);
            assert_eq!(tree.ids, trees[0].ids);
            let nodes = |tree: &BuiltBvh| {
                // SAFETY: this tree has no leaf blocks.
                let node = |block: &NodeBlock| unsafe { (block.node.bounds, block.node.children) };
                tree.blocks.iter().map(node).collect::<Vec<_>>()
            };
            assert!(nodes(tree) == nodes(&trees[0]));
        }
    }
}

/// Asserts that one child of the root is flat at z = 0, and that all other children are above z = 0.001.
fn check_floor(blocks: &[NodeBlock], root: NodeRef, case: &str) {
    let root = crate::node::node(blocks, root);
    let children = (0..root.child_count as usize).map(|k| root.child_bounds(k));
    let (floor, others): (Vec<_>, Vec<_>) = children.partition(|bounds| bounds.lower[2] < 0.001);
    assert_eq!(floor.len(), 1, "{case}");
    assert_eq!([floor[0].lower[2], floor[0].upper[2]], [0.0; 2], "{case}");
    assert!(!others.is_empty(), "{case}");
}

#[test]
fn large_floors_are_children_of_the_root() {
    for n in [30, 100, TREELET_SIZE / 2, 3 * TREELET_SIZE, 12 * TREELET_SIZE] {
        let place = |i: usize, k: u32| ((i as u32 * 3 + k).wrapping_mul(2_654_435_761) >> 16) as f32 / 65_536.0;
        let small = |i: usize| {
            let lower = [place(i, 0), place(i, 1), 0.001 + place(i, 2)];
            (lower, lower.map(|x| x + 0.01))
        };
        let mut boxes: Vec<_> = (0..n).map(small).collect();
        // Some large floors are in the sample, and others are not.
        boxes.insert(n / 2, ([-1.0, -1.0, 0.0], [2.0, 2.0, 0.0]));
        for sample in [None, Some(4), Some(16)] {
            let tree = built(&boxes, sample);
            check(&tree, &boxes);
            check_floor(&tree.blocks, tree.root, &format!("{n} boxes, {sample:?}"));
        }
        let corners =
            boxes.iter().flat_map(|(lower, upper)| [*lower, *upper, [lower[0], upper[1], 0.5 * (lower[2] + upper[2])]]);
        let corners: Vec<_> = corners.collect();
        let triangles: Vec<_> = (0..=n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let bvh = Bvh::build(&corners, &triangles).unwrap();
        check_floor(bvh.blocks(), bvh.root(), &format!("{n} triangles"));
    }
}

#[test]
fn large_floors_form_their_own_part() {
    let shared = BuildContext { leaves: &Boxes(None), dispatch: Dispatch::detect() };
    let small = |i: usize| {
        let x = (i as u32).wrapping_mul(2_654_435_761) as f32 * 2.0_f32.powi(-32);
        PrimRef::new([x, 0.5, 0.0], [x, 0.5, 0.1 * x], i as u32)
    };
    let mut prims: Vec<_> = (0..3 * TREELET_SIZE).map(small).collect();
    prims.insert(TREELET_SIZE, PrimRef::new([0.0; 3], [1.0, 1.0, 0.0], u32::MAX));
    let whole = parallel_split::prim_info(shared.dispatch, &prims);
    let top_plan::TopNode::Split(_, halves) = parallel_split::split_to_treelets(&mut prims, whole, 0, &shared) else {
        panic!("expected a split; got one treelet");
    };
    let [top_plan::TopNode::Treelet(floor), _] = &*halves else {
        panic!("the first half must be a treelet, not a split");
    };
    assert_eq!((floor.count, prims[0].id), (1, u32::MAX));
}
