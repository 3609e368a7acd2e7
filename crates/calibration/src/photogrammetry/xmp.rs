//! RealityCapture's XMP files, with one file next to each image: `xcr:Rotation` is camera_from_world, `xcr:Position`
//! the centre. Sources: Epic's support article on XMP metadata; AliceVision's importer of known poses.

use glam::{DMat3, DVec3};
use raycam_scene::{ErrorCode, NoticeCode, PixelCenter};

use crate::document::check_rotation;
use crate::document::xml_element::{XmlElement, XmlFile};
use crate::intrinsics::require_known_size;
use crate::photogrammetry::reality_capture::{FILM, TANGENTIAL, lens};
use crate::picture_size::PictureSizes;
use crate::{Calibration, CameraRecord, Folder, Pose, ReadHints};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

/// Possible extensions of the image that belongs to an XMP file.
const PICTURES: [&str; 6] = ["jpg", "JPG", "jpeg", "JPEG", "png", "PNG"];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("x:xmpmeta") && text.contains("xcr:")
}

pub(crate) fn detect_folder(folder: &Folder, _: &mut AssetRoot) -> bool {
    folder.ending(".xmp").next().is_some()
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    let stem = source.stem().unwrap_or_default();
    let mut sizes = PictureSizes::new(assets, &source.path, pictures(&stem), hints.size);
    add(source, assets, &mut sizes, &mut calibration)?;
    calibration.notices.extend(sizes.notices());
    Ok(calibration)
}

pub(crate) fn read_folder(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    let stems = folder.ending(".xmp").filter_map(|name| name.strip_suffix(".xmp"));
    let mut sizes = PictureSizes::new(assets, &folder.file("any"), stems.flat_map(pictures), hints.size);
    for name in folder.ending(".xmp") {
        add(&folder.read(name, assets)?, assets, &mut sizes, &mut calibration)?;
    }
    calibration.notices.extend(sizes.notices());
    Ok(calibration)
}

/// Names that the image of an XMP file may have.
fn pictures(stem: &str) -> [String; 6] {
    PICTURES.map(|ending| format!("{stem}.{ending}"))
}

/// Adds the camera of a file; if the file contains no pose, adds a notice instead.
fn add(
    source: &InputFile,
    assets: &mut AssetRoot,
    sizes: &mut PictureSizes,
    calibration: &mut Calibration,
) -> Result<()> {
    let file = XmlFile::parse(source.text()?, &source.path)?;
    let root = file.root();
    let stem = source.stem().unwrap_or_else(|| "camera".into());
    if !root.all("Description").any(|at| value(&at, "Rotation").is_some() && value(&at, "Position").is_some()) {
        let message = "omitted, because Rotation or Position is missing";
        calibration.note_about(NoticeCode::IgnoredElement, format!("file {stem}"), message);
        return Ok(());
    }
    let at = root.all("Description").find(|at| value(at, "FocalLength35mm").is_some());
    let at = at.ok_or_else(|| root.fail("the file contains no xcr:FocalLength35mm"))?;
    let number = |name: &str, otherwise: f64| match value(&at, name) {
        Some(word) => at.numbers_of::<1>(name, word).map(|[value]| value),
        None => Ok(otherwise),
    };
    let mut record = CameraRecord::new(stem.clone(), PixelCenter::Half);
    let pictures = pictures(&stem);
    record.image = pictures.iter().find(|name| assets.is_file(&source.path, name.as_bytes())).cloned();
    let size = sizes.size(assets, &source.path, &pictures);
    let size = require_known_size(size, &source.path, "RealityCapture's XMP")?;
    record.size = Some(size);
    let [w, h] = size.map(f64::from);
    let longer = w.max(h);
    let (focal, aspect) = (number("FocalLength35mm", 0.0)?, number("AspectRatio", 1.0)?);
    let fx = focal * longer / FILM;
    let fy = fx * aspect;
    if fx <= 0.0 || fy <= 0.0 {
        return Err(at.fail(format_args!(
            "FocalLength35mm is {focal}, AspectRatio is {aspect}; expected numbers greater than 0"
        )));
    }
    record.k = Some(DMat3::from_cols(
        DVec3::new(fx, 0.0, 0.0),
        DVec3::new(number("Skew", 0.0)? * longer, fy, 0.0),
        DVec3::new(
            0.5 * w + number("PrincipalPointU", 0.0)? * longer,
            0.5 * h + number("PrincipalPointV", 0.0)? * longer,
            1.0,
        ),
    ));
    let terms = value(&at, "DistortionCoeficients").or_else(|| value(&at, "DistortionCoefficients"));
    let terms = terms.map_or(Ok([0.0; 6]), |text| at.numbers_of("DistortionCoeficients", text))?;
    let model = value(&at, "DistortionModel").unwrap_or("perspective");
    let zero = terms == [0.0; 6];
    if !zero && !["brown3", "brown4", "brown3t2", "brown4t2"].contains(&model) {
        return Err(at.fail_as(
            ErrorCode::UnsupportedFeature,
            format_args!(
                "unsupported DistortionModel {model:?} with DistortionCoeficients {terms:?}; expected brown3, brown4, \
             brown3t2 or brown4t2"
            ),
        ));
    }
    let (made, matters) = lens(terms).map_err(|message| at.fail(message))?;
    record.lens = made;
    if matters {
        calibration.note(NoticeCode::IgnoredFeature, TANGENTIAL);
    }
    if value(&at, "Coordinates") == Some("relative") {
        calibration.note(
            NoticeCode::PlacedCameras,
            "Coordinates is \"relative\"; the world's origin is RealityCapture's local origin",
        );
    }
    let (Some(r), Some(c)) = (value(&at, "Rotation"), value(&at, "Position")) else {
        return Err(at.fail("Rotation or Position is missing in the rdf:Description with FocalLength35mm"));
    };
    let r = DMat3::from_cols_array(&at.numbers_of("Rotation", r)?).transpose();
    check_rotation(r).map_err(|message| at.fail(format_args!("Rotation: {message}")))?;
    record.pose = Some(Pose::from_r_c(r, DVec3::from_array(at.numbers_of("Position", c)?)));
    calibration.records.push(record);
    Ok(())
}

/// Returns the text of an attribute of a description or, if it is missing, of the child element with this name.
fn value<'f>(at: &XmlElement<'f>, name: &str) -> Option<&'f str> {
    at.attribute(name).or_else(|| Some(at.child(name)?.text()))
}
