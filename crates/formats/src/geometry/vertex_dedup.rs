//! Vertices from corners with separate attribute indices: a position is repeated only if its attributes differ.

use std::collections::HashMap;

/// Corner of a face: indices of a position, of texture coordinates and of a normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Corner {
    pub(crate) position: u32,
    /// Index of the texture coordinates, or [`NO_INDEX`].
    pub(crate) uv: u32,
    /// Index of the normal, or [`NO_INDEX`].
    pub(crate) normal: u32,
}

impl Corner {
    /// Returns a corner with only a position.
    pub(crate) fn plain(position: u32) -> Self {
        Self { position, uv: NO_INDEX, normal: NO_INDEX }
    }
}

/// Index that marks a missing attribute.
pub(crate) const NO_INDEX: u32 = u32::MAX;
/// Index of texture coordinates and of a normal in a reserved vertex that no corner has used yet.
const UNUSED: u32 = u32::MAX - 1;
/// Maximum length of the linked list of vertices at one position; further vertices are hashed, so that no file makes
/// the search slow.
const MAX_CHAIN: usize = 32;

/// Vertices of one mesh, in the order in which they are found.
pub(crate) struct VertexDeduper {
    /// Corner of each vertex; in a vertex that no corner uses, `uv` is above every valid index.
    pub(crate) corner_of: Vec<Corner>,
    /// Next vertex at the same position.
    next: Vec<u32>,
    /// First vertex of each position.
    first: Vec<u32>,
    crowded: HashMap<(u32, u32, u32), u32>,
}

impl VertexDeduper {
    /// Creates an empty set of vertices for positions below `count`.
    pub(crate) fn new(count: usize) -> Self {
        Self { corner_of: Vec::new(), next: Vec::new(), first: vec![NO_INDEX; count], crowded: HashMap::new() }
    }

    /// Removes all vertices, so that the memory can be reused for another mesh.
    pub(crate) fn clear(&mut self) {
        for corner in self.corner_of.drain(..) {
            self.first[corner.position as usize] = NO_INDEX;
        }
        self.next.clear();
        self.crowded.clear();
    }

    /// Reserves the next vertices for these positions, in this order, so that a mesh without seams keeps the order of
    /// the file.
    pub(crate) fn reserve(&mut self, positions: impl Iterator<Item = u32>) {
        for position in positions {
            if self.first[position as usize] == NO_INDEX {
                self.first[position as usize] = self.push(Corner { position, uv: UNUSED, normal: UNUSED });
            }
        }
    }

    fn push(&mut self, corner: Corner) -> u32 {
        self.corner_of.push(corner);
        self.next.push(NO_INDEX);
        (self.corner_of.len() - 1) as u32
    }

    /// Vertex of a corner whose position is reserved.
    pub(crate) fn vertex_of(&mut self, corner: Corner) -> u32 {
        let mut vertex = self.first[corner.position as usize];
        for place in 1..=MAX_CHAIN {
            let found = &mut self.corner_of[vertex as usize];
            if found.uv == UNUSED {
                *found = corner;
            }
            if *found == corner {
                return vertex;
            }
            if self.next[vertex as usize] != NO_INDEX {
                vertex = self.next[vertex as usize];
            } else if place < MAX_CHAIN {
                let new = self.push(corner);
                self.next[vertex as usize] = new;
                return new;
            }
        }
        let key = (corner.position, corner.uv, corner.normal);
        if let Some(&known) = self.crowded.get(&key) {
            return known;
        }
        let new = self.push(corner);
        self.crowded.insert(key, new);
        new
    }
}
