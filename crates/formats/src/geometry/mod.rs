//! Meshes from faces: triangulation, welding and splitting of vertices. Uses only `io`.

pub(crate) mod colors;
pub(crate) mod directionless;
pub(crate) mod ear_clipping;
pub(crate) mod finite;
pub(crate) mod polygons;
pub(crate) mod reflex_kd_tree;
#[cfg(test)]
mod tests;
pub(crate) mod vertex_dedup;
pub(crate) mod weld;
