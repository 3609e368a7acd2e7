//! Reading and writing of OpenCV's calibrations.

mod camera;
mod keys;
mod lens;
pub(crate) mod pair_folder;
mod partner;
mod pose;
mod projection;
pub(crate) mod read;
mod stereo;
mod storage;
pub(crate) mod write;
