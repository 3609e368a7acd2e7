//! Data sets, opened as folders or by their tables of cameras.

pub(crate) mod bop_set;
pub(crate) mod coco;
pub(crate) mod euroc_set;
pub(crate) mod kitti_set;
pub(crate) mod nu_scenes;
pub(crate) mod replicator;
pub(crate) mod vehicles;
