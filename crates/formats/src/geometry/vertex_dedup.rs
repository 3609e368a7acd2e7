//! Vertices from corners with attributes of their own: a position is repeated only where its attributes differ.

use std::collections::HashMap;

/// A corner of a face: indices of a position, of texture coordinates and of a normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Corner {
    pub(crate) position: u32,
    /// Or [`NO_INDEX`].
    pub(crate) uv: u32,
    /// Or [`NO_INDEX`].
    pub(crate) normal: u32,
}

impl Corner {
    /// A corner that has nothing but its position.
    pub(crate) fn plain(position: u32) -> Self {
        Self { position, uv: NO_INDEX, normal: NO_INDEX }
    }
}

/// No such attribute.
pub(crate) const NO_INDEX: u32 = u32::MAX;
/// Attribute of a vertex that no corner has claimed yet.
const UNUSED: u32 = u32::MAX - 1;
/// Vertices of one position in a linked list; further ones are hashed, so that no file makes the search slow.
const MAX_CHAIN: usize = 32;

/// The vertices of one mesh as they are found.
pub(crate) struct VertexDeduper {
    /// Corner of each vertex; `uv` is above every index where no corner uses the vertex.
    pub(crate) corner_of: Vec<Corner>,
    /// The next vertex at the same position.
    next: Vec<u32>,
    /// The first vertex of each position.
    first: Vec<u32>,
    crowded: HashMap<(u32, u32, u32), u32>,
}

impl VertexDeduper {
    /// For positions below `count`.
    pub(crate) fn new(count: usize) -> Self {
        Self { corner_of: Vec::new(), next: Vec::new(), first: vec![NO_INDEX; count], crowded: HashMap::new() }
    }

    /// Begins another mesh.
    pub(crate) fn clear(&mut self) {
        for corner in self.corner_of.drain(..) {
            self.first[corner.position as usize] = NO_INDEX;
        }
        self.next.clear();
        self.crowded.clear();
    }

    /// Reserves the next vertices for these positions, in this order: a mesh without seams keeps the order of the file.
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

    /// The vertex of a corner whose position is reserved.
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
