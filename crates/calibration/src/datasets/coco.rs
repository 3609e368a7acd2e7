//! COCO's `images` with raycam's keys: `camera`, `K`, `R` (camera_from_world), `C`, `model`, `distortion`, `time`.

use glam::DVec3;
use raycam_scene::{Lens, LensModel, NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, check_rotation, yaml};
use crate::{Calibration, CameraRecord, Pose, ReadHints};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    ["\"images\"", "\"annotations\"", "\"file_name\"", "\"K\"", "\"pixel_center\""].iter().all(|key| text.contains(key))
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let mut without = 0;
    for at in root.require("images")?.list()? {
        let file = at.require("file_name")?.word()?;
        let center = match at.get("pixel_center").map_or(Ok("integer"), |at| at.word())? {
            "half" => PixelCenter::Half,
            _ => PixelCenter::Integer,
        };
        let mut record = CameraRecord::new(file, center);
        record.image = Some(file.to_owned());
        record.size = Some([at.require("width")?.count()?, at.require("height")?.count()?]);
        record.time = at.get("time").map(|at| at.number()).transpose()?;
        if let Some(p) = at.get("P") {
            let p = p.array::<12>()?;
            record.matrix = Some([0, 1, 2].map(|i| [0, 1, 2, 3].map(|j| p[4 * i + j])));
            calibration.records.push(record);
            continue;
        }
        let (Some(k), Some(r), Some(c)) = (at.get("K"), at.get("R"), at.get("C")) else {
            at.refuse_lens("")?;
            without += 1;
            continue;
        };
        record.k = Some(k.matrix3()?);
        let rotation = r.matrix3()?;
        check_rotation(rotation).map_err(|message| r.fail(message))?;
        record.pose = Some(Pose::from_r_c(rotation, DVec3::from_array(c.array()?)));
        let model = at.get("model").map_or(Ok("pinhole"), |at| at.word())?;
        let d = at.get("distortion").map_or(Ok(vec![]), |at| at.numbers())?;
        record.lens = match model {
            "pinhole" if d.is_empty() => Lens::Pinhole,
            _ => LensModel::from_name(model).and_then(|model| Lens::new(model, &d)).map_err(|error| at.fail(error))?,
        };
        calibration.records.push(record);
    }
    if without > 0 {
        calibration.note(NoticeCode::IgnoredElement, format!("{} omitted: no K, R and C", counted(without, "image")));
    }
    Ok(calibration)
}
