//! The table of calibration formats, and reading and writing by it.

use std::path::Path;

use crate::budget::Budget;
use crate::calibration::document::unread;
use crate::calibration::files::{Calibration, OutputFiles, ReadHints};
use crate::calibration::record::CameraRecord;
use crate::calibration::{bop, colmap, kalibr, kitti, nerf, opencv, ros, tum};
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;

type Read = fn(&InputFile, &mut AssetRoot, &ReadHints) -> Result<Calibration, FormatError>;
type Write = fn(&[CameraRecord], &Path) -> Result<OutputFiles, FormatError>;

/// A format of calibrations or poses.
struct CalibrationFormat {
    name: &'static str,
    /// True if a file looks like this format, by its name and its text (empty for binary files and folders).
    detect: fn(&Path, &str) -> bool,
    read: Read,
    write: Write,
    /// True if the format tells which cameras stand on a rig.
    supports_rigs: bool,
}

/// Every format; the first that recognises a file reads it.
const FORMATS: &[CalibrationFormat] = &[
    CalibrationFormat {
        name: "colmap",
        detect: colmap::text::detect,
        read: colmap::text::read,
        write: colmap::text::write,
        supports_rigs: true,
    },
    CalibrationFormat {
        name: "colmap-binary",
        detect: colmap::binary::detect,
        read: colmap::binary::read,
        write: colmap::binary::write,
        supports_rigs: true,
    },
    CalibrationFormat {
        name: "kalibr",
        detect: kalibr::detect,
        read: kalibr::read,
        write: kalibr::write,
        supports_rigs: true,
    },
    CalibrationFormat { name: "ros", detect: ros::detect, read: ros::read, write: ros::write, supports_rigs: false },
    CalibrationFormat {
        name: "nerf",
        detect: nerf::detect,
        read: nerf::read,
        write: nerf::write,
        supports_rigs: false,
    },
    CalibrationFormat {
        name: "blender",
        detect: nerf::detect_blender,
        read: nerf::read,
        write: nerf::write_blender,
        supports_rigs: false,
    },
    CalibrationFormat { name: "bop", detect: bop::detect, read: bop::read, write: bop::write, supports_rigs: false },
    CalibrationFormat {
        name: "opencv",
        detect: opencv::read::detect,
        read: opencv::read::read,
        write: opencv::write::write,
        supports_rigs: false,
    },
    CalibrationFormat {
        name: "kitti",
        detect: kitti::detect,
        read: kitti::read,
        write: kitti::write,
        supports_rigs: true,
    },
    CalibrationFormat {
        name: "kitti-poses",
        detect: kitti::detect_poses,
        read: kitti::read_poses,
        write: kitti::write_poses,
        supports_rigs: false,
    },
    CalibrationFormat { name: "tum", detect: tum::detect, read: tum::read, write: tum::write, supports_rigs: false },
];

/// The names of the formats of [`read`] and [`write`].
pub fn formats() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().map(|format| format.name)
}

/// The names of all formats, for messages.
fn format_list() -> String {
    formats().collect::<Vec<_>>().join(", ")
}

fn format_named(name: &str) -> Result<&'static CalibrationFormat, FormatError> {
    FORMATS.iter().find(|format| format.name == name).ok_or_else(|| {
        let hint = raycam_scene::suggestion(name, formats());
        let known = format_list();
        FormatError::Encode(format!("no calibration format is called {name:?}{hint} (there are: {known})"))
    })
}

/// The cameras in a file, or in the folder of a COLMAP model.
///
/// `format` is one of [`formats`]; without it, name and contents tell. `known` is what the file leaves open.
///
/// # Errors
/// See [`FormatError`].
pub fn read(path: &Path, format: Option<&str>, known: &ReadHints, budget: &Budget) -> Result<Calibration, FormatError> {
    let format = format.map(format_named).transpose()?;
    if path.is_dir() {
        let (folder, first) = first_of_folder(path)?;
        let mut assets = AssetRoot::new(&path.join(folder), budget);
        let source = assets.read_reference(Path::new(""), first)?;
        return decode_in(source, format, known, &mut assets);
    }
    let mut assets = AssetRoot::containing(path, budget);
    let source = assets.read(path)?;
    decode_in(source, format, known, &mut assets)
}

/// The folder below `path`, and the file in it, that reading begins with.
fn first_of_folder(path: &Path) -> Result<(&'static str, &'static str), FormatError> {
    let places = [
        ("", ["cameras.txt", "cameras.bin"]),
        ("sparse/0", ["cameras.txt", "cameras.bin"]),
        ("sparse", ["cameras.txt", "cameras.bin"]),
        ("", ["transforms.json", "transforms_train.json"]),
    ];
    let found = places.into_iter().filter_map(|(folder, names)| {
        let first = names.into_iter().find(|name| path.join(folder).join(name).exists())?;
        Some((folder, first))
    });
    let found: Vec<_> = found.collect();
    match found[..] {
        [one] => Ok(one),
        [] => Err(FormatError::unsupported(
            path,
            "a folder without cameras.txt, cameras.bin, sparse/0 and transforms.json; expected a COLMAP model, a NeRF set, \
             or a file",
        )),
        _ => {
            let names = found.iter().map(|(folder, name)| Path::new(folder).join(name).display().to_string());
            Err(FormatError::unsupported(
                path,
                format!("a folder with several calibrations: give one of {}", names.collect::<Vec<_>>().join(", ")),
            ))
        }
    }
}

/// The cameras in the bytes of a single file. `path` names it in errors; nothing else is read.
///
/// # Errors
/// See [`FormatError`].
pub fn decode(
    bytes: Vec<u8>,
    path: &Path,
    format: Option<&str>,
    known: &ReadHints,
    budget: &Budget,
) -> Result<Calibration, FormatError> {
    let mut assets = AssetRoot::containing(path, budget);
    assets.budget.take_bytes(path, bytes.len() as u64)?;
    let source = InputFile::new(path, bytes);
    decode_in(source, format.map(format_named).transpose()?, known, &mut assets)
}

fn decode_in(
    source: InputFile,
    format: Option<&'static CalibrationFormat>,
    known: &ReadHints,
    assets: &mut AssetRoot,
) -> Result<Calibration, FormatError> {
    let text = std::str::from_utf8(&source.bytes).unwrap_or("");
    let found = format.or_else(|| FORMATS.iter().find(|format| (format.detect)(&source.path, text)));
    let Some(format) = found else {
        let known = format_list();
        if let Some((name, way)) = unread::name_of(text) {
            return Err(FormatError::unsupported(
                &source.path,
                format!("a file of {name}, which raycam does not read: {way} (it reads {known})"),
            ));
        }
        return Err(FormatError::unsupported(
            &source.path,
            format!(
                "not a calibration that raycam knows; it reads {known}. Named (--format NAME, format=\"NAME\"), the \
                 format's reader says in which line the file is something else"
            ),
        ));
    };
    let mut calibration = (format.read)(&source, assets, known)?;
    if calibration.records.is_empty() {
        return Err(FormatError::whole(&source.path, format!("no camera in it, read as {}", format.name)));
    }
    if let Some(intrinsics) = &known.intrinsics
        && calibration.records.iter().any(|record| record.k.is_none() && record.matrix.is_none())
        && intrinsics.pose.as_ref().is_some_and(|pose| !pose.is_identity())
    {
        calibration.notices.push(
            "the poses are taken as those of the camera itself: the pose that intrinsics have (a mount, as T_BS or \
             T_cam_imu) is not used. For the poses of a body, use the rig: --rig FILE --poses, rig.at_pose(R, C)"
                .into(),
        );
    }
    for record in &mut calibration.records {
        known.fill_missing(record, &source.path)?;
        if let Some(notice) = record.orthonormalize() {
            calibration.notices.push(notice);
        }
    }
    Ok(calibration)
}

/// The files of `format` that hold the cameras; `path` is where they will be.
///
/// # Errors
/// [`FormatError::Encode`] names what the format cannot hold.
pub fn write(records: &[CameraRecord], path: &Path, format: &str) -> Result<OutputFiles, FormatError> {
    let format = format_named(format)?;
    if records.is_empty() {
        return Err(FormatError::Encode("no camera to write".into()));
    }
    let mut written = (format.write)(records, path)?;
    for record in records.iter().filter(|record| !record.unsupported.is_empty()) {
        written.notices.push(format!(
            "camera {:?}: its {} not written: calibration files hold K, a lens and one pose; world files hold all of it",
            record.name,
            match record.unsupported[..] {
                [one] => format!("{one} is"),
                _ => format!("{} are", record.unsupported.join(" and ")),
            }
        ));
    }
    if !format.supports_rigs && records.iter().any(|record| record.mount.is_some()) {
        written.notices.push(format!(
            "{} does not say which cameras stand on a rig; they are where they stand in the world",
            format.name
        ));
    }
    Ok(written)
}
