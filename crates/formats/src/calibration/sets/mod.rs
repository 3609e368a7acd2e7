//! Data sets that raycam writes, opened as folders: the cameras that made them.

pub(crate) mod bop_set;
pub(crate) mod coco;
pub(crate) mod euroc_set;
pub(crate) mod kitti_set;
