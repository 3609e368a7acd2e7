//! NeRF's sets of three files: `transforms_train.json`, `transforms_val.json` and `transforms_test.json`. Source:
//! nerf's load_blender.py.

use std::path::Path;

use crate::radiance_fields::nerf;
use crate::{Calibration, CameraRecord, Folder, OutputFiles, ReadHints};
use raycam_formats::Result;
use raycam_formats::io::AssetRoot;
use raycam_scene::{Notice, NoticeCode, counted};

const SPLITS: [&str; 3] = ["train", "val", "test"];

fn file_of(split: &str) -> String {
    format!("transforms_{split}.json")
}

pub(crate) fn detect(folder: &Folder, _: &mut AssetRoot) -> bool {
    SPLITS.iter().any(|split| folder.has(&file_of(split)))
}

/// Reads the cameras of all splits; their names begin with the name of the split.
pub(crate) fn read(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    let splits = || SPLITS.into_iter().filter(|split| folder.has(&file_of(split)));
    let mut known = hints.clone();
    for split in splits() {
        if known.size.is_some() {
            break;
        }
        let found = nerf::read(&folder.read(&file_of(split), assets)?, assets, hints);
        known.size = found.ok().and_then(|found| found.records.first()?.size);
    }
    for split in splits() {
        let file = folder.read(&file_of(split), assets)?;
        // The size of a split without images is the size of the other splits.
        let mut found = match nerf::read(&file, assets, hints) {
            Err(_) if known.size != hints.size => {
                let mut found = nerf::read(&file, assets, &known)?;
                let count = found.records.len();
                let notice = "without image files get the image size of another split; if their size \
                              differs, set it with --size WIDTHxHEIGHT or size=(width, height)";
                found
                    .notices
                    .push(Notice::new(NoticeCode::AssumedConvention, format!("{} {notice}", counted(count, "camera"))));
                found
            }
            found => found?,
        };
        for mut record in std::mem::take(&mut found.records) {
            if !nerf::is_in_split(&record, split) {
                record.name = format!("{split}/{}", record.name);
            }
            calibration.records.push(record);
        }
        calibration.notices.extend(found.notices.into_iter().map(|notice| notice.in_context(file_of(split))));
    }
    Ok(calibration)
}

/// Writes one file for each split. A camera's name begins with its split; all other cameras belong to train.
pub(crate) fn write(records: &[CameraRecord], path: &Path) -> Result<OutputFiles> {
    let mut written = OutputFiles::default();
    let mut unnamed = 0;
    for split in SPLITS {
        let mut own = Vec::new();
        for record in records {
            let named = SPLITS.into_iter().find(|split| nerf::is_in_split(record, split));
            unnamed += usize::from(named.is_none() && split == SPLITS[0]);
            if named.unwrap_or(SPLITS[0]) == split {
                own.push(record.clone());
            }
        }
        if own.is_empty() {
            written.files.push((file_of(split), b"{\n  \"frames\": []\n}\n".to_vec()));
            continue;
        }
        let files = nerf::write_blender(&own, path)?;
        written.files.extend(files.files.into_iter().map(|(_, bytes)| (file_of(split), bytes)));
        written.notices.extend(files.notices);
    }
    if unnamed > 0 {
        written.notices.push(Notice::new(
            NoticeCode::Renamed,
            format!(
                "cameras whose names do not begin with train/, val/ or test/ are written to transforms_train.json ({})",
                counted(unnamed, "camera")
            ),
        ));
    }
    Ok(written)
}
