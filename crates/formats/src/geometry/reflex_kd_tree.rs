//! k-d tree (Bentley 1975) of a polygon's corners, used to find a reflex corner inside an ear.

use glam::DVec2;

/// Maximum number of corners in a leaf.
const LEAF_POINTS: usize = 8;

/// A k-d tree over fixed points, each of which can be marked.
pub(crate) struct ReflexKdTree {
    /// Indices of the points; the points of a node are contiguous.
    order: Vec<u32>,
    /// Index in `order` of each point.
    position: Vec<u32>,
    /// Nodes of the tree; the two children of a node are adjacent.
    nodes: Vec<KdNode>,
    marked: Vec<bool>,
}

struct KdNode {
    low: DVec2,
    high: DVec2,
    start: u32,
    end: u32,
    /// Index of the first of two children, or 0 in a leaf.
    children: u32,
    /// Number of marked points.
    marks: u32,
}

/// Twice the signed area of a triangle: positive if it turns left.
pub(crate) fn signed_area2(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

impl ReflexKdTree {
    /// Returns a tree over these points, none of them marked.
    pub(crate) fn new(points: &[DVec2]) -> Self {
        let mut tree = Self {
            order: (0..points.len() as u32).collect(),
            position: vec![0; points.len()],
            nodes: vec![KdNode::new(0, points.len())],
            marked: vec![false; points.len()],
        };
        let mut at = 0;
        while at < tree.nodes.len() {
            let KdNode { start, end, low, high, .. } = tree.nodes[at];
            let (start, end) = (start as usize, end as usize);
            let own = &mut tree.order[start..end];
            let sides = own.iter().map(|&i| points[i as usize]);
            let (low, high) = sides.fold((low, high), |(l, h), p| (l.min(p), h.max(p)));
            (tree.nodes[at].low, tree.nodes[at].high) = (low, high);
            if end - start > LEAF_POINTS {
                let axis = usize::from(high.y - low.y > high.x - low.x);
                let half = own.len() / 2;
                own.select_nth_unstable_by(half, |&a, &b| {
                    let key = |i: u32| points[i as usize].to_array()[axis];
                    key(a).total_cmp(&key(b)).then(a.cmp(&b))
                });
                tree.nodes[at].children = tree.nodes.len() as u32;
                tree.nodes.push(KdNode::new(start, start + half));
                tree.nodes.push(KdNode::new(start + half, end));
            }
            at += 1;
        }
        for (place, &point) in tree.order.iter().enumerate() {
            tree.position[point as usize] = place as u32;
        }
        tree
    }

    pub(crate) fn is_marked(&self, point: u32) -> bool {
        self.marked[point as usize]
    }

    pub(crate) fn mark(&mut self, point: u32, marked: bool) {
        if std::mem::replace(&mut self.marked[point as usize], marked) == marked {
            return;
        }
        let place = self.position[point as usize];
        let mut at = 0;
        loop {
            let node = &mut self.nodes[at];
            if marked {
                node.marks += 1;
            } else {
                node.marks -= 1;
            }
            if node.children == 0 {
                return;
            }
            let first = node.children as usize;
            at = first + usize::from(place >= self.nodes[first].end);
        }
    }

    /// Returns a marked point that is in the closed counter-clockwise triangle but is not one of the triangle's
    /// corners, and the number of nodes and points visited.
    pub(crate) fn find_inside(&self, points: &[DVec2], triangle: [DVec2; 3]) -> (Option<u32>, u64) {
        let [a, b, c] = triangle;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let (mut stack, mut steps) = (vec![0_u32], 0);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            steps += 1;
            let apart = node.marks == 0
                || node.low.cmpgt(high).any()
                || node.high.cmplt(low).any()
                || [(a, b), (b, c), (c, a)].into_iter().any(|(a, b)| node.is_right_of(a, b));
            if apart {
                continue;
            }
            if node.children > 0 {
                stack.extend([node.children, node.children + 1]);
                continue;
            }
            let own = &self.order[node.start as usize..node.end as usize];
            steps += own.len() as u64;
            let found = own.iter().find(|&&point| {
                let p = points[point as usize];
                // A point at the same position as a corner belongs to a bridge to a hole and is not an obstacle.
                self.marked[point as usize]
                    && p != a
                    && p != b
                    && p != c
                    && signed_area2(a, b, p) >= 0.0
                    && signed_area2(b, c, p) >= 0.0
                    && signed_area2(c, a, p) >= 0.0
            });
            if found.is_some() {
                return (found.copied(), steps);
            }
        }
        (None, steps)
    }
}

impl KdNode {
    fn new(start: usize, end: usize) -> Self {
        Self {
            low: DVec2::INFINITY,
            high: DVec2::NEG_INFINITY,
            start: start as u32,
            end: end as u32,
            children: 0,
            marks: 0,
        }
    }

    /// True if the whole box is to the right of the line from a to b. Rounding is monotone: the sign at the leftmost
    /// corner bounds the sign, computed in the same way, of every point inside.
    fn is_right_of(&self, a: DVec2, b: DVec2) -> bool {
        let along = b - a;
        let x = if along.y > 0.0 { self.low.x } else { self.high.x };
        let y = if along.x > 0.0 { self.high.y } else { self.low.y };
        signed_area2(a, b, DVec2::new(x, y)) < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tree_search_finds_the_same_points_as_a_full_search() {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            // The coordinates have few distinct values, so that points coincide and lie on sides.
            ((state >> 60) as f64) / 4.0
        };
        let points: Vec<DVec2> = (0..300).map(|_| DVec2::new(random(), random())).collect();
        let mut tree = ReflexKdTree::new(&points);
        let (mut found, mut none) = (0, 0);
        for round in 0..3000_u32 {
            let point = round * 7 % 300;
            tree.mark(point, round % 3 == 0);
            assert_eq!(tree.is_marked(point), round % 3 == 0);
            let [a, b, c] = [(); 3].map(|()| DVec2::new(random(), random()));
            if signed_area2(a, b, c) <= 0.0 {
                continue;
            }
            let lies_inside = |p: DVec2| {
                let corner = p == a || p == b || p == c;
                !corner && signed_area2(a, b, p) >= 0.0 && signed_area2(b, c, p) >= 0.0 && signed_area2(c, a, p) >= 0.0
            };
            let any = (0..300).any(|i| tree.is_marked(i) && lies_inside(points[i as usize]));
            let (inside, _) = tree.find_inside(&points, [a, b, c]);
            assert_eq!(inside.is_some(), any);
            if let Some(inside) = inside {
                assert!(tree.is_marked(inside) && lies_inside(points[inside as usize]));
                found += 1;
            } else {
                none += 1;
            }
        }
        assert!(found > 100 && none > 100, "{found} {none}");
    }
}
