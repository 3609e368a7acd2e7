//! One triangle, or two with a common edge: what leaves are filled with.

/// One triangle, or two with a common edge.
#[derive(Clone, Copy)]
pub struct Piece {
    /// The fourth vertex is the third again where there is one triangle.
    pub vertices: [u32; 4],
    /// Their ids; the same twice where there is one.
    pub triangles: [u32; 2],
    /// The corners of the second triangle among the vertices; those of the first are 0, 1 and 2.
    pub second: [u8; 3],
    /// How many triangles there are.
    pub count: u8,
}

impl Piece {
    /// One triangle.
    pub fn one(id: u32, corners: [u32; 3]) -> Piece {
        let [a, b, c] = corners;
        Piece {
            vertices: [a, b, c, c],
            triangles: [id; 2],
            second: [0; 3],
            count: 1,
        }
    }

    /// Both together, where they have at least two vertices in common.
    #[inline(always)]
    pub fn joined(&self, other: &Piece) -> Option<Piece> {
        let [a, b, c, _] = self.vertices;
        let (mut fourth, mut strangers) = (c, 0);
        let mut second = [0; 3];
        for (place, &vertex) in second.iter_mut().zip(&other.vertices) {
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
        (strangers <= 1).then_some(Piece {
            vertices: [a, b, c, fourth],
            triangles: [self.triangles[0], other.triangles[0]],
            second,
            count: 2,
        })
    }
}
