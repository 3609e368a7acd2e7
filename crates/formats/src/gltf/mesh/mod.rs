//! Primitives as meshes: attributes and indices from accessors or Draco streams, morph targets, joints, tangents.
//!
//! Uses the document; independent of worlds.

pub(crate) mod attributes;
pub(crate) mod material_requirements;
pub(crate) mod primitive;
pub(crate) mod skin_morph;
pub(crate) mod tangent;
pub(crate) mod vertex_window;
