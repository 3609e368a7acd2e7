//! Folders of poses, a 4x4 matrix for each picture: ScanNet's export (`pose/0.txt`, `intrinsic/`), 7-Scenes
//! (`frame-000000.pose.txt`), tsdf-fusion's (`camera-intrinsics.txt` beside them). Source: ScanNet's SensorData.py.

use glam::DMat3;
use raycam_scene::PixelCenter;

use crate::calibration::files::{Calibration, ReadHints};
use crate::calibration::folder::Folder;
use crate::calibration::picture_size::size_of_picture;
use crate::calibration::record::CameraRecord;
use crate::calibration::trajectory::convention::convention_of;
use crate::calibration::trajectory::matrices::{MatrixLayout, checked, intrinsics, layout, matrices};
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;

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

/// The folder with the poses, and their names in it.
fn find_poses(folder: &Folder, assets: &mut AssetRoot) -> Option<(Folder, Vec<String>)> {
    for inner in ["pose", "poses", ""] {
        if !(inner.is_empty() || folder.has(inner)) {
            continue;
        }
        let place = if inner.is_empty() { Folder::open(&folder.path, assets) } else { folder.inner(inner, assets) };
        let mut names: Vec<String> = place.ending(".pose.txt").cloned().collect();
        if names.is_empty() {
            let numbered = |name: &&String| name.contains(|c: char| c.is_ascii_digit()) && !name.contains("intrinsic");
            names = place.ending(".txt").filter(numbered).cloned().collect();
        }
        let Some(first) = names.first() else { continue };
        let Ok(source) = place.read(first, assets) else { continue };
        if matches!(layout(source.text().unwrap_or_default()), Some(MatrixLayout::Blocks(_))) {
            return Some((place, names));
        }
    }
    None
}

pub(crate) fn detect(folder: &Folder, assets: &mut AssetRoot) -> bool {
    find_poses(folder, assets).is_some()
}

pub(crate) fn read(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration, FormatError> {
    let fail = || FormatError::unsupported(&folder.path, "expected a folder of 4x4 poses, one file for each picture");
    let (place, names) = find_poses(folder, assets).ok_or_else(fail)?;
    let mut calibration = Calibration::default();
    let convention = convention_of(&place.name(), hints, &mut calibration.notices);
    let mut lost = Vec::new();
    let mut size = None;
    let scene = if place.path == folder.path { folder.inner("..", assets) } else { Folder::open(&folder.path, assets) };
    let pictures = ["color", "rgb", "images"].map(|name| (name, scene.inner(name, assets)));
    for name in &names {
        let source = place.read(name, assets)?;
        let text = source.text()?;
        let found = matrices(text, &source.path, layout(text).unwrap_or(MatrixLayout::Blocks(4)))?;
        let [(_, line, matrix)] = found[..] else {
            return Err(FormatError::whole(&source.path, format!("{} matrices, expected one", found.len())));
        };
        let stem = name.trim_end_matches(".txt").trim_end_matches(".pose");
        let rows = checked(matrix).map_err(|message| FormatError::line(&source.path, line, message))?;
        let Some(rows) = rows else {
            lost.push(stem);
            continue;
        };
        let mut record = CameraRecord::new(stem, PixelCenter::Integer);
        record.pose = Some(convention.pose(&rows));
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
        // Pictures under other names than the poses: the first of them has the size.
        size = pictures.iter().find_map(|(_, folder)| size_of_picture(assets, &folder.file("any"), &folder.names));
    }
    if let Some(first) = lost.first() {
        calibration.notices.push(format!("{} lost frames without a pose are left out: {first} ...", lost.len()));
    }
    if hints.intrinsics.is_none() {
        with_intrinsics(&scene, &place, size, assets, &mut calibration)?;
    }
    Ok(calibration)
}

/// Gives the cameras K of the scene, and the size of its pictures.
fn with_intrinsics(
    scene: &Folder,
    place: &Folder,
    size: Option<[u32; 2]>,
    assets: &mut AssetRoot,
    calibration: &mut Calibration,
) -> Result<(), FormatError> {
    let mut found: Vec<(String, DMat3)> = Vec::new();
    for folder in [scene, place] {
        for name in INTRINSICS {
            let Ok(source) = folder.read(name, assets) else { continue };
            let text = source.text()?;
            if layout(text) == Some(MatrixLayout::Intrinsics) {
                found.push((name.into(), intrinsics(text, &source.path)?));
            }
        }
    }
    let Some((name, k)) = found.first() else { return Ok(()) };
    calibration.notices.push(format!(
        "K is that of {name}{}",
        match size {
            Some([width, height]) => format!(", the size that of the first picture, {width} x {height}"),
            None => String::new(),
        }
    ));
    if let Some((other, _)) = found.iter().find(|(_, other)| other != k) {
        calibration.notices.push(format!("{other} has another K, which is not used: --intrinsics {other} does"));
    }
    for record in &mut calibration.records {
        (record.k, record.size) = (Some(*k), size);
    }
    Ok(())
}
