//! Formats of NeRF and its successors: poses world_from_camera in JSON, usually with OpenGL's axes, and pixel centres
//! at (0.5, 0.5).

pub(crate) mod camera_path;
pub(crate) mod nerf;
pub(crate) mod nerf_splits;
pub(crate) mod polycam;
pub(crate) mod record3d;
pub(crate) mod splats;
