//! One triangle, or two with a common edge: what leaves are filled with.

/// One triangle, or two with a common edge.
#[derive(Clone, Copy)]
pub struct TrianglePair {
    /// The fourth vertex is the third again where there is single triangle.
    pub vertices: [u32; 4],
    /// Their ids; the same twice where there is single.
    pub triangles: [u32; 2],
    /// The corners of the second_corners triangle among the vertices; those of the first are 0, 1 and 2.
    pub second_corners: [u8; 3],
    /// How many triangles there are.
    pub count: u8,
}

impl TrianglePair {
    /// One triangle.
    pub fn single(id: u32, corners: [u32; 3]) -> TrianglePair {
        let [a, b, c] = corners;
        TrianglePair {
            vertices: [a, b, c, c],
            triangles: [id; 2],
            second_corners: [0; 3],
            count: 1,
        }
    }

    /// Both together, where they have at least two vertices in common.
    #[inline(always)]
    pub fn try_pair(&self, other: &TrianglePair) -> Option<TrianglePair> {
        let [a, b, c, _] = self.vertices;
        let (mut fourth, mut strangers) = (c, 0);
        let mut second_corners = [0; 3];
        for (place, &vertex) in second_corners.iter_mut().zip(&other.vertices) {
            let known = vertex == a || vertex == b || vertex == c;
            *place = match vertex {
                _ if vertex == a => 0,
                _ if vertex == b => 1,
                _ if vertex == c => 2,
                _ => 3,
            };
            fourth = if known { fourth } else { vertex };
            strangers += u32::from(!known);
        }
        (strangers <= 1).then_some(TrianglePair {
            vertices: [a, b, c, fourth],
            triangles: [self.triangles[0], other.triangles[0]],
            second_corners,
            count: 2,
        })
    }
}
