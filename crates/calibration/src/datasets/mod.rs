//! Data sets that are opened by their folder or by their camera tables.

pub(crate) mod bop_set;
pub(crate) mod cityscapes;
pub(crate) mod coco;
pub(crate) mod euroc_set;
pub(crate) mod kitti_set;
pub(crate) mod nu_scenes;
pub(crate) mod replicator;
pub(crate) mod scannetpp_iphone;
pub(crate) mod tartan_air;
pub(crate) mod vehicles;
pub(crate) mod virtual_kitti;
