//! Calibrations and poses: cameras from the files that other tools write, and back.
//!
//! Every format is a row of one table: its name, how it is recognised, its reader and its writer. Between them stands
//! [`Record`], which keeps numbers the way the file has them, so that what is read is written back to the last bit.

mod bop;
mod colmap;
pub(crate) mod document;
mod kalibr;
mod kitti;
mod nerf;
pub(crate) mod opencv;
mod pose;
mod record;
pub(crate) mod rig_mount;
mod ros;
mod tum;

use std::path::{Path, PathBuf};

pub use self::pose::{Pose, Rotation};
pub use self::record::Record;
use crate::budget::Budget;
pub use crate::calibration::rig_mount::Mount;
use crate::error::FormatError;
use crate::io::asset_root::{Folder, Source};

/// What a file of cameras holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Calibration {
    /// The cameras, in the order of the file.
    pub records: Vec<Record>,
    /// What was left out or mended, in words.
    pub notices: Vec<String>,
}

/// What a format does not say, and the reader is told: trajectories have no intrinsics, some files no size.
#[derive(Clone, Debug, Default)]
pub struct Known {
    /// Columns and rows, where the file has none.
    pub size: Option<[u32; 2]>,
    /// The camera whose size, K and lens the poses get, where the file has none.
    pub intrinsics: Option<Record>,
}

/// Files to write: their names, relative to where the calibration is to be ("" for that path itself), and bytes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Written {
    /// The files.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the format holds in another way, in words.
    pub notices: Vec<String>,
}

impl Written {
    fn one(text: String) -> Self {
        Self {
            files: vec![(String::new(), text.into_bytes())],
            notices: vec![],
        }
    }
}

type Read = fn(&Source, &mut Folder, &Known) -> Result<Calibration, FormatError>;
type Write = fn(&[Record], &Path) -> Result<Written, FormatError>;

/// A format of calibrations or poses.
struct Format {
    name: &'static str,
    /// Whether a file looks like it, by its name and its text (empty for binary files and folders).
    is: fn(&Path, &str) -> bool,
    read: Read,
    write: Write,
    /// Whether it says which cameras stand on a rig.
    rigs: bool,
}

/// Every format; the first that recognises a file reads it.
const FORMATS: &[Format] = &[
    Format {
        name: "colmap",
        is: colmap::text::is,
        read: colmap::text::read,
        write: colmap::text::write,
        rigs: true,
    },
    Format {
        name: "colmap-binary",
        is: colmap::binary::is,
        read: colmap::binary::read,
        write: colmap::binary::write,
        rigs: true,
    },
    Format {
        name: "kalibr",
        is: kalibr::is,
        read: kalibr::read,
        write: kalibr::write,
        rigs: true,
    },
    Format {
        name: "ros",
        is: ros::is,
        read: ros::read,
        write: ros::write,
        rigs: false,
    },
    Format {
        name: "nerf",
        is: nerf::is,
        read: nerf::read,
        write: nerf::write,
        rigs: false,
    },
    Format {
        name: "blender",
        is: nerf::is_blender,
        read: nerf::read,
        write: nerf::write_blender,
        rigs: false,
    },
    Format {
        name: "bop",
        is: bop::is,
        read: bop::read,
        write: bop::write,
        rigs: false,
    },
    Format {
        name: "opencv",
        is: opencv::read::is,
        read: opencv::read::read,
        write: opencv::write::write,
        rigs: false,
    },
    Format {
        name: "kitti",
        is: kitti::is,
        read: kitti::read,
        write: kitti::write,
        rigs: true,
    },
    Format {
        name: "kitti-poses",
        is: kitti::is_poses,
        read: kitti::read_poses,
        write: kitti::write_poses,
        rigs: false,
    },
    Format {
        name: "tum",
        is: tum::is,
        read: tum::read,
        write: tum::write,
        rigs: false,
    },
];

/// The names of the formats of [`read`] and [`write`].
pub fn formats() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().map(|format| format.name)
}

/// The same in a sentence.
fn listed() -> String {
    formats().collect::<Vec<_>>().join(", ")
}

fn find(name: &str) -> Result<&'static Format, FormatError> {
    FORMATS
        .iter()
        .find(|format| format.name == name)
        .ok_or_else(|| {
            let hint = raycam_scene::suggestion(name, formats());
            let known = listed();
            FormatError::Encode(format!(
                "no calibration format is called {name:?}{hint} (there are: {known})"
            ))
        })
}

/// The cameras in a file, or in the folder of a COLMAP model.
///
/// `format` is one of [`formats`]; without it, name and contents tell. `known` is what the file leaves open.
///
/// # Errors
/// See [`FormatError`].
pub fn read(
    path: &Path,
    format: Option<&str>,
    known: &Known,
    budget: &Budget,
) -> Result<Calibration, FormatError> {
    let format = format.map(find).transpose()?;
    if path.is_dir() {
        let mut folder = Folder::new(path, budget);
        let first = ["cameras.txt", "cameras.bin"]
            .into_iter()
            .find(|name| path.join(name).exists());
        let Some(first) = first else {
            return Err(FormatError::unsupported(
                path,
                "a folder without cameras.txt and cameras.bin; expected a COLMAP model, or a file",
            ));
        };
        let source = folder.follow(Path::new(""), first)?;
        return decode_in(source, format, known, &mut folder);
    }
    let mut folder = Folder::around(path, budget);
    let source = folder.read(path)?;
    decode_in(source, format, known, &mut folder)
}

/// The cameras in the bytes of a single file. `path` names it in errors; nothing else is read.
///
/// # Errors
/// See [`FormatError`].
pub fn decode(
    bytes: Vec<u8>,
    path: &Path,
    format: Option<&str>,
    known: &Known,
    budget: &Budget,
) -> Result<Calibration, FormatError> {
    let mut folder = Folder::around(path, budget);
    folder.budget.take_bytes(path, bytes.len() as u64)?;
    let source = Source::new(path, bytes);
    decode_in(source, format.map(find).transpose()?, known, &mut folder)
}

fn decode_in(
    source: Source,
    format: Option<&'static Format>,
    known: &Known,
    folder: &mut Folder,
) -> Result<Calibration, FormatError> {
    let text = std::str::from_utf8(&source.bytes).unwrap_or("");
    let found = format.or_else(|| {
        FORMATS
            .iter()
            .find(|format| (format.is)(&source.path, text))
    });
    let Some(format) = found else {
        let known = listed();
        return Err(FormatError::unsupported(
            &source.path,
            format!(
                "not a calibration that raycam knows; it reads {known}. Named (--format NAME, format=\"NAME\"), the \
                 format's reader says in which line the file is something else"
            ),
        ));
    };
    let mut calibration = (format.read)(&source, folder, known)?;
    if calibration.records.is_empty() {
        return Err(FormatError::whole(
            &source.path,
            format!("no camera in it, read as {}", format.name),
        ));
    }
    for record in &mut calibration.records {
        record.complete(known, &source.path)?;
        if let Some(notice) = record.mend() {
            calibration.notices.push(notice);
        }
    }
    Ok(calibration)
}

/// The files of `format` that hold the cameras; `path` is where they will be.
///
/// # Errors
/// [`FormatError::Encode`] names what the format cannot hold.
pub fn write(records: &[Record], path: &Path, format: &str) -> Result<Written, FormatError> {
    let format = find(format)?;
    if records.is_empty() {
        return Err(FormatError::Encode("no camera to write".into()));
    }
    let mut written = (format.write)(records, path)?;
    for record in records.iter().filter(|record| !record.lost.is_empty()) {
        written.notices.push(format!(
            "camera {:?}: its {} not written: calibration files hold K, a lens and one pose; world files hold all of it",
            record.name,
            match record.lost[..] {
                [one] => format!("{one} is"),
                _ => format!("{} are", record.lost.join(" and ")),
            }
        ));
    }
    if !format.rigs && records.iter().any(|record| record.mount.is_some()) {
        written.notices.push(format!(
            "{} does not say which cameras stand on a rig; they are where they stand in the world",
            format.name
        ));
    }
    Ok(written)
}

/// The text of a file, or where it is none.
fn text(source: &Source) -> Result<&str, FormatError> {
    std::str::from_utf8(&source.bytes)
        .map_err(|error| FormatError::byte(&source.path, error.valid_up_to(), "not UTF-8 text"))
}

/// The name of a file without its last extension.
fn stem(path: &Path) -> String {
    let path: PathBuf = path.into();
    path.file_stem().map_or_else(
        || "camera".into(),
        |stem| stem.to_string_lossy().into_owned(),
    )
}
