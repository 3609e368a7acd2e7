//! A few axis-aligned boxes that together bound a mesh, for culling.

use crate::aabb::Aabb;
use crate::blas::Bvh;
use crate::node::{NodeRef, node};

impl Bvh {
    /// At most `count` boxes (at least one) that together contain all triangles; each box is given by its lower and
    /// upper corner in mesh coordinates. Empty for an empty mesh.
    pub fn bounding_boxes(&self, count: usize) -> Vec<[[f32; 3]; 2]> {
        if self.triangle_count() == 0 {
            return vec![];
        }
        let mut boxes = vec![(*self.bounds(), self.root())];
        loop {
            // The inner node with the largest area is replaced by its children until the number of boxes would exceed
            // `count`.
            let inner = |(_, (_, at)): &(usize, &(Aabb, NodeRef))| !at.is_leaf();
            let large = |a: &Aabb, b: &Aabb| a.half_area().total_cmp(&b.half_area());
            let largest = boxes.iter().enumerate().filter(inner);
            let Some((i, &(_, at))) = largest.max_by(|(_, (a, _)), (_, (b, _))| large(a, b)) else { break };
            let node = node(self.blocks(), at);
            let children = node.child_count as usize;
            if boxes.len() - 1 + children > count {
                break;
            }
            boxes.swap_remove(i);
            boxes.extend((0..children).map(|k| (node.child_bounds(k), node.children[k])));
        }
        let scale = self.scale();
        let in_mesh = |(b, _): (Aabb, NodeRef)| [b.lower, b.upper].map(|corner| corner.map(|x| x / scale));
        boxes.into_iter().map(in_mesh).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::Bvh;

    #[test]
    fn bounding_boxes_contain_every_triangle() {
        // A ring of small triangles: the boxes must not cover its middle.
        let mut vertices = vec![];
        for i in 0..3000u32 {
            let turn = i as f32 * 0.7;
            let at = [turn.cos(), turn.sin(), 0.1 * (3.0 * turn).sin()];
            vertices.extend([at, [at[0] + 0.01, at[1], at[2]], [at[0], at[1] + 0.01, at[2]]]);
        }
        let triangles: Vec<_> = (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let bvh = Bvh::build(&vertices, &triangles).unwrap();
        for count in [1, 10, 100, 100_000] {
            let boxes = bvh.bounding_boxes(count);
            assert!(!boxes.is_empty() && boxes.len() <= count);
            let within = |v: [f32; 3], [lower, upper]: &[[f32; 3]; 2]| {
                (0..3).all(|axis| lower[axis] <= v[axis] && v[axis] <= upper[axis])
            };
            for triangle in &triangles {
                let corners = triangle.map(|i| vertices[i as usize]);
                assert!(boxes.iter().any(|b| corners.iter().all(|&v| within(v, b))));
            }
            assert_eq!(boxes.iter().any(|b| within([0.0; 3], b)), count == 1);
        }
        assert!(Bvh::build(&[], &[]).unwrap().bounding_boxes(9).is_empty());
    }
}
