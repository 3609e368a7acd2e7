//! Reading and writing of OpenCV's calibrations.

mod camera;
mod directed_pose;
mod keys;
mod lens;
pub(crate) mod pair_folder;
mod partner;
mod pose;
pub(crate) mod projection;
mod quaternion_pose;
pub(crate) mod read;
mod stacks;
mod stereo;
pub(crate) mod storage;
pub(crate) mod write;
