//! Calibrations and poses: cameras from the files that other tools write, and back.
//!
//! Every format is a row of one table, [`formats`](self::formats): its name, how it is recognised, its reader and its
//! writer. Between them stands [`CameraRecord`], which keeps numbers the way the file has them, so that what is read is
//! written back to the last bit.

mod bop;
mod colmap;
mod document;
mod files;
mod formats;
mod kalibr;
mod kitti;
mod nerf;
mod opencv;
mod pose;
mod record;
mod rig;
mod rig_mount;
mod ros;
mod tum;

pub use self::files::{Calibration, OutputFiles, ReadHints};
pub use self::formats::{decode, formats, read, write};
pub use self::pose::{Pose, Rotation};
pub use self::record::CameraRecord;
pub use self::rig_mount::RigMount;
