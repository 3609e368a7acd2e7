//! Folder of an EuRoC or TUM-VI sequence: `cam0/sensor.yaml` and further cameras, mounted on the body.

use crate::rig::on_a_body;
use crate::{Calibration, Folder, ReadHints, opencv};
use raycam_formats::io::AssetRoot;
use raycam_formats::{FormatError, Result};
use raycam_scene::NoticeCode;

fn find_cameras(folder: &Folder, assets: &AssetRoot) -> Option<(Folder, Vec<String>)> {
    for place in [Folder::open(&folder.path, assets), folder.inner("mav0", assets)] {
        let cameras = place.names.iter().filter(|name| name.starts_with("cam"));
        let cameras: Vec<String> =
            cameras.filter(|name| place.inner(name, assets).has("sensor.yaml")).cloned().collect();
        if !cameras.is_empty() {
            return Some((place, cameras));
        }
    }
    None
}

pub(crate) fn detect(folder: &Folder, assets: &mut AssetRoot) -> bool {
    find_cameras(folder, assets).is_some()
}

pub(crate) fn read(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let fail = || {
        FormatError::unsupported(&folder.path, "cam0/sensor.yaml not found; expected a folder of the EuRoC data set")
    };
    let (place, cameras) = find_cameras(folder, assets).ok_or_else(fail)?;
    let mut calibration = Calibration::default();
    for name in cameras {
        let found = opencv::read::read(&place.read(&format!("{name}/sensor.yaml"), assets)?, assets, hints)?;
        for mut record in found.records {
            record.name.clone_from(&name);
            on_a_body(&mut record, "rig");
            calibration.records.push(record);
        }
        calibration.notices.extend(found.notices.into_iter().map(|notice| notice.in_context(&name)));
    }
    calibration.note(
        NoticeCode::PlacedCameras,
        "camera poses are relative to the body (T_BS); for its trajectory, use data.csv of \
         state_groundtruth_estimate0 or mocap0 (raycam dataset WORLD -o FOLDER --rig FOLDER --poses data.csv, or \
         rig.at_pose(R, C))",
    );
    Ok(calibration)
}
