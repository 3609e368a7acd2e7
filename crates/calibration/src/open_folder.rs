//! Folders whose contents determine how they are opened.

use std::path::{Component, Path, PathBuf};

use crate::Folder;
use crate::document::zip_members;
use raycam_formats::Budget;
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

/// Names of files that contain the calibration of a whole folder; of each row, only the first existing file is used.
const FILES: [&[&str]; 30] = [
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
    &["extrinsic.txt", "intrinsic.txt"],
    &["intrinsics.yml", "intrinsics.yaml", "intrinsics.xml"],
    &["camera_path.json"],
    &["camchain.yaml", "kalibr_imucam_chain.yaml"],
    &["camera_matrix.npy", "mtx.npy", "K.npy", "cameraMatrix.npy", "K1.npy", "camera_matrix_left.npy"],
    &["annotations/instances.json"],
    &["camera_info.yaml"],
    &["calibration.yaml", "calibration.yml", "calibration.json", "calibration.xml"],
    &["camera.yaml", "camera.yml", "camera.json", "camera.xml"],
];

/// Extensions of calibration files; the extension of a compressed file is the extension before `.gz`. If several files
/// could be a calibration, `MAX_BYTES` and `MAX_FILES` limit the files that are examined.
const ENDINGS: [&str; 22] = [
    "yaml",
    "yml",
    "json",
    "jsonl",
    "xml",
    "txt",
    "csv",
    "npz",
    "npy",
    "ini",
    "cfg",
    "conf",
    "out",
    "sfm",
    "log",
    "traj",
    "tum",
    "pincam",
    "xmp",
    "cameramodel",
    "camera",
    "r3d",
];

/// Extensions of the files that are examined as calibrations if a folder is opened, without the point.
pub fn file_endings() -> impl Iterator<Item = &'static str> {
    ENDINGS.into_iter()
}

const MAX_BYTES: u64 = 4 << 20;
pub(crate) const MAX_FILES: usize = 64;

/// Opens a folder, together with the assets to which its files may refer, including assets next to the folder.
pub(crate) fn open(path: &Path, budget: &Budget) -> (Folder, AssetRoot) {
    let root = match path.components().next_back() {
        Some(Component::Normal(_)) => path.parent().unwrap_or(path),
        _ => path,
    };
    let assets = AssetRoot::new(root, budget).fixed();
    (Folder::open(path, &assets), assets)
}

/// Files of a folder that may be calibrations of the whole folder.
pub(crate) fn candidates(folder: &Folder) -> Vec<PathBuf> {
    let plain_or_packed = |name: &&str| [folder.path.join(name), folder.path.join(format!("{name}.gz"))];
    let first = |names: &&[&str]| names.iter().flat_map(plain_or_packed).find(|path| path.is_file());
    FILES.iter().filter_map(first).collect()
}

/// Files of a folder that may be calibrations by their extension: the only such file, or all small files; no file if
/// there are too many. If the folder contains a single file and that file is small, it may have any extension.
pub(crate) fn small_files(folder: &Folder) -> Vec<PathBuf> {
    let small = |path: &PathBuf| path.metadata().is_ok_and(|data| data.len() <= MAX_BYTES);
    let paths = folder.names.iter().filter(|name| !name.starts_with('.')).map(|name| folder.path.join(name));
    let files: Vec<PathBuf> = paths.filter(|path| path.is_file()).collect();
    if let [only] = &files[..]
        && small(only)
    {
        return files;
    }
    let mut found: Vec<PathBuf> = files.into_iter().filter(|path| has_known_ending(path)).take(MAX_FILES + 1).collect();
    if found.len() > 1 {
        found.retain(small);
    }
    if found.len() > MAX_FILES { vec![] } else { found }
}

fn has_known_ending(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.rsplit_once('.').is_some_and(|(_, ending)| ENDINGS.contains(&ending))
}

/// Reads a file of a folder, with the assets that the file may refer to.
pub(crate) fn read_file(folder: &Path, file: &Path, budget: &Budget) -> Result<(InputFile, AssetRoot)> {
    let root = match folder.components().next_back() {
        Some(Component::Normal(_)) => folder.parent().unwrap_or(folder),
        _ => folder,
    };
    let mut assets = AssetRoot::of_file(file, Some(root), budget).fixed();
    let packed = assets.read(file)?;
    let source = zip_members::unpacked(packed, &mut assets.budget)?;
    Ok((source, assets))
}
