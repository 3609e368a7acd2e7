//! Folders of poses with a 4x4 matrix for each image: ScanNet's export (`pose/0.txt`, `intrinsic/`), 7-Scenes
//! (`frame-000000.pose.txt`), tsdf-fusion's (with `camera-intrinsics.txt` in the same folder), NumPy arrays (`.npy`,
//! `.npz`), CSV, JSON; and folders of camera matrices P (DTU's `pos_001.txt`). Source: ScanNet's SensorData.py.

use std::path::PathBuf;

use glam::DMat3;
use raycam_scene::{NoticeCode, counted};

use crate::picture_size::size_of_picture;
use crate::trajectory::matrices::{
    MatrixContent, MatrixLayout, content_of, has_camera_matrices, intrinsics, layout, poses_of,
};
use crate::trajectory::matrix_tree::PosesOfTree;
use crate::{Calibration, Folder, ReadHints, opencv};
use raycam_formats::io::AssetRoot;
use raycam_formats::{FormatError, Result};

/// Files with K, in the folder of the scene.
const INTRINSICS: [&str; 9] = [
    "intrinsic/intrinsic_color.txt",
    "intrinsic/intrinsic_depth.txt",
    "intrinsics/intrinsic_color.txt",
    "camera-intrinsics.txt",
    "intrinsics.txt",
    "intrinsic.txt",
    "intrinsics_color.txt",
    "K.txt",
    "camera.txt",
];

/// Folders with the images of a scene.
const PICTURES: [&str; 3] = ["color", "rgb", "images"];
/// Folders of a scene that may contain its poses; the last name, which is empty, is the scene's own folder.
const PLACES: [&str; 7] = ["pose", "poses", "cam_poses", "c2w", "w2c", "extrinsics", ""];
/// Extensions of files with one pose each; the first extension for which a file exists is used.
const ENDINGS: [&str; 6] = [".pose.txt", ".txt", ".npy", ".npz", ".csv", ".json"];

/// Finds the folder with the poses; returns the folder, the names of its pose files, and the contents of the first
/// file.
fn find_poses(folder: &Folder, assets: &mut AssetRoot) -> Option<(Folder, Vec<String>, PosesOfTree)> {
    for inner in PLACES {
        if !(inner.is_empty() || folder.has(inner)) {
            continue;
        }
        let place = if inner.is_empty() { Folder::open(&folder.path, assets) } else { folder.inner(inner, assets) };
        for ending in ENDINGS {
            let names: Vec<String> = place.ending(ending).filter(|name| may_be_pose(name)).cloned().collect();
            let Some(first) = names.first() else { continue };
            let Ok(source) = place.read(first, assets) else { continue };
            // Files with K and a pose are one camera each.
            if opencv::read::detect(&source, source.text().unwrap_or_default()) {
                continue;
            }
            let found = poses_of(&source, assets).ok().filter(|found| found.matrices.len() == 1);
            // A folder with a single camera matrix does not count as a folder with a matrix for each image.
            let is_folder = |found: &PosesOfTree| names.len() > 1 || !has_camera_matrices(&found.matrices);
            if let Some(found) = found.filter(is_folder) {
                return Some((place, names, found));
            }
        }
    }
    None
}

/// True for a name that may belong to the pose of an image, not to K or another array of the scene.
fn may_be_pose(name: &str) -> bool {
    name.ends_with(".pose.txt") || name.contains(|c: char| c.is_ascii_digit()) && !name.contains("intrinsic")
}

pub(crate) fn detect(folder: &Folder, assets: &mut AssetRoot) -> bool {
    find_poses(folder, assets).is_some()
}

pub(crate) fn read(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let fail = || FormatError::unsupported(&folder.path, "expected a folder of 4x4 poses, one file per image");
    let (place, names, mut first) = find_poses(folder, assets).ok_or_else(fail)?;
    let mut calibration = Calibration { notices: std::mem::take(&mut first.notices), ..Calibration::default() };
    let content = content_of(&first, &place.name(), hints, &mut calibration.notices);
    let mut size = None;
    let alone = place.path == folder.path && !PICTURES.iter().any(|name| folder.has(name));
    let scene = if alone { folder.inner("..", assets) } else { Folder::open(&folder.path, assets) };
    let pictures = PICTURES.map(|name| (name, scene.inner(name, assets)));
    for name in &names {
        let source = place.read(name, assets)?;
        let found = poses_of(&source, assets)?;
        let [(_, line, matrix)] = found.matrices[..] else {
            return Err(FormatError::whole(
                &source.path,
                format!("the file contains {}; expected one", counted(found.matrices.len(), "matrix")),
            ));
        };
        if found.key != first.key {
            return Err(FormatError::whole(
                &source.path,
                format!(
                    "the pose has the key {:?}, but in the first file the key is {:?}; expected equal keys",
                    found.key, first.key
                ),
            ));
        }
        let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| stem).trim_end_matches(".pose");
        let record = content.record(stem.to_owned(), matrix);
        let Some(mut record) = record.map_err(|message| FormatError::line(&source.path, line, message))? else {
            calibration.note_about(
                NoticeCode::IgnoredElement,
                format!("frame {stem}"),
                "omitted, because the pose contains numbers that are not finite",
            );
            continue;
        };
        for ending in ["jpg", "png"] {
            let own = format!("{stem}.color.{ending}");
            if place.has(&own) {
                record.image = Some(own);
            }
            let file = format!("{stem}.{ending}");
            if let Some((inner, _)) = pictures.iter().find(|(_, pictures)| pictures.has(&file)) {
                record.image = Some(format!("{inner}/{file}"));
            }
        }
        if let (None, Some(image)) = (size, &record.image) {
            let from = if image.contains('/') { scene.file("any") } else { place.file("any") };
            size = size_of_picture(assets, &from, [image]);
        }
        calibration.records.push(record);
    }
    if size.is_none() {
        // Image names differ from pose names, so the first image determines the size.
        size = pictures.iter().find_map(|(_, folder)| size_of_picture(assets, &folder.file("any"), &folder.names));
    }
    if matches!(content, MatrixContent::CameraMatrices) {
        calibration.records.iter_mut().for_each(|record| record.size = size);
    } else if hints.intrinsics.is_none() {
        with_intrinsics(&scene, &place, size, assets, &mut calibration)?;
    }
    Ok(calibration)
}

/// Assigns the scene's K and the size of the scene's images to the cameras.
fn with_intrinsics(
    scene: &Folder,
    place: &Folder,
    size: Option<[u32; 2]>,
    assets: &mut AssetRoot,
    calibration: &mut Calibration,
) -> Result<()> {
    let mut found: Vec<(&str, PathBuf, DMat3)> = Vec::new();
    for folder in [scene, place] {
        for name in INTRINSICS {
            let Ok(source) = folder.read(name, assets) else { continue };
            let text = source.text()?;
            if layout(text) == Some(MatrixLayout::Intrinsics) {
                found.push((name, source.path.clone(), intrinsics(text, &source.path)?));
            }
        }
    }
    let Some((name, _, k)) = found.first() else { return Ok(()) };
    calibration.note(
        NoticeCode::UsedOtherFile,
        format!(
            "K was read from {name}{}",
            match size {
                Some([width, height]) => format!(", and the size, {width} x {height}, from the first image"),
                None => String::new(),
            }
        ),
    );
    if let Some((_, other, _)) = found.iter().find(|(.., other)| other != k) {
        calibration.note(
            NoticeCode::IgnoredElement,
            format!(
                "{other} contains another K, which is ignored; to use it, add --intrinsics {other} (in Python, pass \
                 the file's camera as intrinsics=)",
                other = other.display()
            ),
        );
    }
    for record in &mut calibration.records {
        (record.k, record.size) = (Some(*k), size);
    }
    Ok(())
}
