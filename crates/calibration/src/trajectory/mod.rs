//! Trajectories: poses without intrinsics, one per image.

pub(crate) mod arkit;
pub(crate) mod body;
pub(crate) mod convention;
pub(crate) mod euroc;
pub(crate) mod kitti360;
pub(crate) mod matrices;
pub(crate) mod matrix_folder;
pub(crate) mod matrix_tree;
pub(crate) mod named_columns;
pub(crate) mod open3d;
pub(crate) mod redwood;
pub(crate) mod stated_order;
pub(crate) mod times;
pub(crate) mod tum;
