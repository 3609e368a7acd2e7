//! Folders, opened by what lies in them.

use std::path::{Component, Path, PathBuf};

use crate::budget::Budget;
use crate::calibration::folder::Folder;
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;
use crate::io::lexer;

/// Files that are a calibration of a whole folder by their name; the first of a line alone counts.
const FILES: [&[&str]; 29] = [
    &["cameras.bin", "cameras.txt"],
    &["sparse/0/cameras.bin", "sparse/0/cameras.txt"],
    &["sparse/cameras.bin", "sparse/cameras.txt"],
    &["colmap/sparse/0/cameras.bin", "colmap/sparse/0/cameras.txt"],
    &["transforms.json"],
    &["cameras.json"],
    &["metadata.json", "metadata"],
    &["reconstruction.json"],
    &["sfm_data.json"],
    &["cameras.sfm", "sfm.json"],
    &["cameras.xml"],
    &["poses_bounds.npy"],
    &["cameras_sphere.npz", "cameras.npz"],
    &["traj.txt", "traj_w_c.txt"],
    &["groundtruth.txt"],
    &["cam0_to_world.txt"],
    &["calib_cam_to_pose.txt"],
    &["calib_cam_to_cam.txt"],
    &["calib.txt"],
    &["scene_camera.json"],
    &["bundle.out"],
    &["intrinsics.yml", "intrinsics.yaml", "intrinsics.xml"],
    &["camera_path.json"],
    &["camchain.yaml", "kalibr_imucam_chain.yaml"],
    &["camera_matrix.npy", "mtx.npy", "K.npy", "cameraMatrix.npy", "K1.npy", "camera_matrix_left.npy"],
    &["annotations/instances.json"],
    &["camera_info.yaml"],
    &["calibration.yaml", "calibration.yml", "calibration.json", "calibration.xml"],
    &["camera.yaml", "camera.yml", "camera.json", "camera.xml"],
];

/// Endings of calibrations, and the largest file and the most files of any name that are looked into.
const ENDINGS: [&str; 17] = [
    "yaml",
    "yml",
    "json",
    "xml",
    "txt",
    "csv",
    "npz",
    "npy",
    "ini",
    "conf",
    "out",
    "sfm",
    "log",
    "traj",
    "pincam",
    "xmp",
    "cameramodel",
];
const MAX_BYTES: u64 = 4 << 20;
const MAX_FILES: usize = 64;

/// A folder with the assets that its files may name: those beside it too.
pub(crate) fn open(path: &Path, budget: &Budget) -> (Folder, AssetRoot) {
    let root = match path.components().next_back() {
        Some(Component::Normal(_)) => path.parent().unwrap_or(path),
        _ => path,
    };
    let assets = AssetRoot::new(root, budget);
    (Folder::open(path, &assets), assets)
}

/// The files of a folder that may be calibrations of it as a whole.
pub(crate) fn candidates(folder: &Folder) -> Vec<PathBuf> {
    let first = |names: &&[&str]| names.iter().map(|name| folder.path.join(name)).find(|path| path.is_file());
    FILES.iter().filter_map(first).collect()
}

/// Small files of a folder whose endings are those of calibrations; none of a folder with too many of them.
pub(crate) fn small_files(folder: &Folder) -> Vec<PathBuf> {
    let ending =
        |path: &Path| path.extension().map(|ending| ending.to_ascii_lowercase().to_string_lossy().into_owned());
    let known = |path: &PathBuf| ending(path).is_some_and(|ending| ENDINGS.contains(&ending.as_str()));
    let small = |path: &PathBuf| path.metadata().is_ok_and(|data| data.is_file() && data.len() <= MAX_BYTES);
    let paths = folder.names.iter().filter(|name| !name.starts_with('.')).map(|name| folder.path.join(name));
    let found: Vec<PathBuf> = paths.filter(known).filter(small).take(MAX_FILES + 1).collect();
    if found.len() > MAX_FILES { vec![] } else { found }
}

/// A file of a folder, with the assets that it may name.
pub(crate) fn read_file(folder: &Path, file: &Path, budget: &Budget) -> Result<(InputFile, AssetRoot), FormatError> {
    let root = match folder.components().next_back() {
        Some(Component::Normal(_)) => folder.parent().unwrap_or(folder),
        _ => folder,
    };
    let mut assets = AssetRoot::of_file(file, Some(root), budget);
    let mut source = assets.read(file)?;
    source.bytes = lexer::without_utf16(source.bytes);
    Ok((source, assets))
}
