//! One file for each concept of the crate.

mod aperture;
mod camera;
mod category;
mod common;
mod counted;
mod counts;
mod displace;
mod edit;
mod infinite;
mod lens;
mod mesh;
mod motion;
mod oriented_box;
mod pose;
mod primitive;
mod refine;
mod render_options;
mod rig;
mod schema;
mod sensor;
mod style;
mod texture;
mod texture_memory;
mod variant;
mod video;
mod world;
