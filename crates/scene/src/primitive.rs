//! Primitive shapes as meshes: box, plane, sphere, cylinder, cone, torus.
