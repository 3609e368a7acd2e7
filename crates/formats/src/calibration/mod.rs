//! Calibrations and poses: cameras from the files that other tools write, and back.
//!
//! Every format is a row of one table, [`formats`](self::formats): its name, how it is recognised, its reader and its
//! writer. Between them stands [`CameraRecord`], which keeps numbers the way the file has them, so that what is read is
//! written back to the last bit.

mod bop;
mod colmap;
mod document;
mod files;
mod folder;
mod formats;
mod intrinsics;
mod kalibr;
mod kitti;
mod multi_view;
mod open_folder;
mod opencv;
mod photogrammetry;
mod picture_size;
mod plausibility;
mod pose;
mod record;
mod rig;
mod rig_mount;
mod ros;
mod sets;
mod slam;
mod trajectory;
mod transforms;

pub use self::files::{Calibration, OutputFiles, PoseConvention, ReadHints};
pub(crate) use self::folder::Folder;
pub use self::formats::{decode, formats, read, write, written_formats};
pub use self::pose::{Pose, Rotation};
pub use self::record::CameraRecord;
pub use self::rig_mount::RigMount;
