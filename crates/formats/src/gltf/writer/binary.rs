//! Binary chunk with its buffer views and accessors. Equal bytes are written once.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use serde_json::{Map, Value, json};

/// Use of a buffer view (3.6.2.2).
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum BufferTarget {
    Vertices,
    Indices,
    Other,
}

/// Start and length of a buffer view in bytes, and its index.
type ViewSpan = (usize, usize, usize);

/// Contents of the binary chunk, with its buffer views and accessors.
#[derive(Default)]
pub(in crate::gltf) struct BinaryChunk {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    /// Buffer views by the hash of their bytes, their use, and the type of their accessors. Accessors of
    /// different types must not share a view (3.6.2.4).
    known: HashMap<(u64, BufferTarget, String), Vec<ViewSpan>>,
    known_accessors: HashMap<String, usize>,
}

impl BinaryChunk {
    /// Returns the index of a buffer view with these bytes, which are added if necessary.
    pub(super) fn view(&mut self, data: &[u8], target: BufferTarget) -> usize {
        self.view_for(data, target, String::new())
    }

    /// Same as [`Self::view`], for accessors of the type `like`.
    fn view_for(&mut self, data: &[u8], target: BufferTarget, like: String) -> usize {
        let mut hasher = DefaultHasher::new();
        data.hash(&mut hasher);
        let same = self.known.entry((hasher.finish(), target, like)).or_default();
        let found = same.iter().find(|(start, length, _)| self.bytes[*start..start + length] == *data);
        if let Some(&(_, _, index)) = found {
            return index;
        }
        let start = self.bytes.len().next_multiple_of(4);
        self.bytes.resize(start, 0);
        self.bytes.extend_from_slice(data);
        let mut view = json!({ "buffer": 0, "byteOffset": start, "byteLength": data.len() });
        match target {
            BufferTarget::Vertices => view["target"] = json!(34962),
            BufferTarget::Indices => view["target"] = json!(34963),
            BufferTarget::Other => {}
        }
        self.views.push(view);
        same.push((start, data.len(), self.views.len() - 1));
        self.views.len() - 1
    }

    /// Returns the index of an accessor of float32 elements. With `bounds`, the accessor contains the minimum and
    /// maximum, which glTF requires for positions and times.
    pub(super) fn floats<const N: usize>(&mut self, values: &[[f32; N]], target: BufferTarget, bounds: bool) -> usize {
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        let mut more = Map::new();
        if bounds {
            let fold = |start: f32, pick: fn(f32, f32) -> f32| {
                let ends: [f32; N] =
                    values.iter().fold([start; N], |ends, v| std::array::from_fn(|i| pick(ends[i], v[i])));
                ends.map(f64::from).to_vec()
            };
            more.insert("min".into(), json!(fold(f32::INFINITY, f32::min)));
            more.insert("max".into(), json!(fold(f32::NEG_INFINITY, f32::max)));
        }
        self.accessor(&bytes, 5126, kind(N), values.len(), target, more)
    }

    /// Returns the index of an accessor with four joints per vertex.
    pub(super) fn joints(&mut self, values: &[[u16; 4]]) -> usize {
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        let count = values.len();
        self.accessor(&bytes, 5123, "VEC4", count, BufferTarget::Vertices, Map::new())
    }

    /// Returns the index of an accessor of indices into this number of vertices, in 16 bits if possible. The maximum of
    /// the type is not a valid index (3.7.2.1).
    pub(super) fn indices(&mut self, values: &[u32], vertices: usize) -> usize {
        let (code, bytes): (_, Vec<u8>) = if vertices <= usize::from(u16::MAX) {
            let short = values.iter().flat_map(|&v| (v as u16).to_le_bytes());
            (5123, short.collect())
        } else {
            (5125, values.iter().flat_map(|v| v.to_le_bytes()).collect())
        };
        let count = values.len();
        self.accessor(&bytes, code, "SCALAR", count, BufferTarget::Indices, Map::new())
    }

    fn accessor(
        &mut self,
        bytes: &[u8],
        component: u32,
        kind: &str,
        count: usize,
        target: BufferTarget,
        more: Map<String, Value>,
    ) -> usize {
        let mut accessor = json!({ "componentType": component, "type": kind, "count": count });
        for (key, value) in more {
            accessor[key] = value;
        }
        accessor["bufferView"] = json!(self.view_for(bytes, target, accessor.to_string()));
        *self.known_accessors.entry(accessor.to_string()).or_insert_with(|| {
            self.accessors.push(accessor);
            self.accessors.len() - 1
        })
    }

    /// Returns the buffer views, the accessors and the bytes.
    pub(super) fn into_parts(self) -> (Vec<Value>, Vec<Value>, Vec<u8>) {
        (self.views, self.accessors, self.bytes)
    }
}

fn kind(components: usize) -> &'static str {
    match components {
        1 => "SCALAR",
        2 => "VEC2",
        3 => "VEC3",
        4 => "VEC4",
        _ => "MAT4",
    }
}
