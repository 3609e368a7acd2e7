//! Reading and writing of OpenCV's calibrations.

mod by_name;
mod camera;
mod camera_maps;
mod directed_pose;
mod key_view;
mod keys;
mod lens;
mod one_camera;
pub(crate) mod pair_folder;
mod partner;
mod pose;
mod poses_by_name;
pub(crate) mod projection;
mod quaternion_pose;
pub(crate) mod read;
mod separate_maps;
mod stacks;
mod stereo;
mod storage;
mod unread_parts;
pub(crate) mod write;
