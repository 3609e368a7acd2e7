//! The two cameras of a pair in separate files, left and right, with R and T in a third file.

use crate::document::Cursor;
use crate::opencv::key_view::KeyView;
use crate::opencv::pose::read_r_t;
use crate::opencv::read::{detect, read};
use crate::opencv::stereo::place_second;
use crate::opencv::storage::parse;
use crate::{Calibration, Folder, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};
use raycam_scene::{NoticeCode, counted};

const ENDINGS: [&str; 5] = [".yml", ".yaml", ".xml", ".json", ".npz"];

/// The file whose name begins with a given word, if there is only one such file.
fn file_of<'a>(folder: &'a Folder, word: &str) -> Option<&'a String> {
    let known = |name: &&String| {
        let lower = name.to_lowercase();
        let unpacked = lower.strip_suffix(".gz").unwrap_or(&lower);
        lower.starts_with(word) && ENDINGS.iter().any(|ending| unpacked.ends_with(ending))
    };
    let mut found = folder.names.iter().filter(known);
    found.next().filter(|_| found.next().is_none())
}

pub(crate) fn detect_folder(folder: &Folder, assets: &mut AssetRoot) -> bool {
    let sources = sides(folder, assets);
    sources.len() == 2
        && sources.iter().all(|source| {
            let text = source.text().unwrap_or_default();
            detect(source, text) && !crate::ros::detect(source, text)
        })
}

/// Reads the files of the left and of the right camera.
pub(crate) fn sides(folder: &Folder, assets: &mut AssetRoot) -> Vec<InputFile> {
    let names = ["left", "right"].into_iter().filter_map(|side| file_of(folder, side));
    names.filter_map(|name| folder.read(name, assets).ok()).collect()
}

pub(crate) fn read_folder(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let fail = || {
        FormatError::unsupported(
            &folder.path,
            "expected two calibration files, one with a name that begins with left and one with right",
        )
    };
    let mut calibration = Calibration::default();
    for side in ["left", "right"] {
        let name = file_of(folder, side).ok_or_else(fail)?;
        let mut found = read(&folder.read(name, assets)?, assets, hints)?;
        let [record] = &mut found.records[..] else {
            let message = format!(
                "the file contains {}; expected only the {side} camera",
                counted(found.records.len(), "camera")
            );
            return Err(FormatError::whole(&folder.file(name), message));
        };
        record.name = side.into();
        calibration.records.append(&mut found.records);
        calibration.notices.extend(found.notices.into_iter().map(|notice| notice.in_context(name)));
    }
    let mut pose = None;
    for word in ["extrinsic", "stereo"] {
        if let (None, Some(name)) = (&pose, file_of(folder, word)) {
            let source = folder.read(name, assets)?;
            let node = parse(&source, assets)?;
            pose = read_r_t(&KeyView::new(Cursor::root(&node, &source.path)))?;
            if pose.is_some() {
                calibration.note(
                    NoticeCode::UsedOtherFile,
                    format!("R and T were read from {name}; they map points from the left camera to the right camera"),
                );
            }
        }
    }
    place_second(pose, &mut calibration).map_err(|error| FormatError::whole(&folder.path, error.to_string()))?;
    Ok(calibration)
}
