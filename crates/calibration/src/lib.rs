//! Reading and writing of cameras and poses in the files of other tools.
//!
//! Every format is a row of one table, [`formats()`]: its name, its detection, its reader and its writer.
//! Readers and writers use [`CameraRecord`], which keeps the numbers exactly as in the file, so that a calibration that
//! is read and written again is unchanged to the last bit. Files, budgets and errors come from `raycam_formats`.
//!
//! | folder or file | formats |
//! |---|---|
//! | `colmap` | `colmap`, `colmap-binary` |
//! | `opencv` | `opencv`: OpenCV's FileStorage and the many spellings of it in YAML, JSON, XML and NumPy files |
//! | `ros` | `ros`: CameraInfo messages and files |
//! | `kitti` | `kitti`, `kitti-poses` |
//! | `bop` | `bop` |
//! | `calibration_tools` | `kalibr`, `camodocal`, `mrcal`, `basalt`, `anipose` |
//! | `slam_settings` | `orb-slam`, `ov2slam`, `vins`, `ncamera`: settings files of SLAM and odometry programs |
//! | `devices` | `realsense`, `zed`, `hot3d`, `aria-mps`: calibrations stored in a device or printed by its SDK |
//! | `photogrammetry` | `metashape`, `realitycapture`, `realitycapture-xmp`, `bundler`, `openmvg`, `alicevision`, `opensfm`, `kapture` |
//! | `view_synthesis` | `middlebury`, `mvsnet`, `neus`, `pmvs`, `llff`, `realestate10k`: benchmarks for stereo and view synthesis |
//! | `radiance_fields` | `nerf`, `blender`, `blender-splits`, `3dgs`, `polycam`, `record3d`, `camera-path` |
//! | `trajectory` | `tum`, `tum-intrinsics`, `euroc`, `poses`, `open3d`, `arkit`, `kitti-360`, `redwood` |
//! | `datasets` | `coco`, `nuscenes`, `replicator`, `argoverse`, `waymo`, `cityscapes`, `virtual-kitti`, `tartanair`, `scannetpp-iphone`, and the folders of BOP, EuRoC and KITTI |
//!
//! The other modules are shared: `document` parses YAML, JSON, XML, INI and NumPy files into one tree, `pose` and
//! `record` store the numbers, and `plausibility` checks the cameras of every format.
#![forbid(unsafe_code)]

mod bop;
mod calibration_tools;
mod colmap;
mod datasets;
mod devices;
mod document;
mod files;
mod folder;
mod formats;
mod intrinsics;
mod kitti;
mod open_folder;
mod opencv;
mod photogrammetry;
mod picture_size;
mod plausibility;
mod pose;
mod pose_map;
mod quaternion_key;
mod radiance_fields;
mod record;
mod rig;
mod rig_mount;
mod ros;
mod slam_settings;
mod trajectory;
mod unknown_file;
mod view_synthesis;

pub use self::files::{Calibration, OutputFiles, PoseHints, ReadHints};
pub(crate) use self::folder::Folder;
pub use self::formats::{decode, formats, read, write, written_formats};
pub use self::open_folder::file_endings;
pub use self::pose::{Pose, Rotation};
pub use self::record::CameraRecord;
pub use self::rig_mount::RigMount;
