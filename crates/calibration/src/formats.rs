//! Table of calibration formats, and the functions that read and write files according to this table.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{Budget, FormatError, Result};
use raycam_scene::{ErrorCode, Notice, NoticeCode, counted};

use crate::calibration_tools::{anipose, basalt, camodocal, kalibr, mrcal};
use crate::datasets::{
    bop_set, cityscapes, coco, euroc_set, kitti_set, nu_scenes, replicator, scannetpp_iphone, tartan_air, vehicles,
    virtual_kitti,
};
use crate::devices::{aria, aria_mps, real_sense, zed};
use crate::document::number_lines::line_with_decimal_commas;
use crate::document::{unread, zip_members};
use crate::files::{about_cameras, notice_of_repairs};
use crate::photogrammetry::{alice_vision, bundler, kapture, metashape, open_mvg, open_sfm, reality_capture, xmp};
use crate::radiance_fields::{camera_path, nerf, nerf_splits, polycam, record3d, splats};
use crate::slam_settings::{ncamera, orb_slam, ov2slam, vins};
use crate::trajectory::{arkit, euroc, kitti360, matrices, matrix_folder, open3d, redwood, tum};
use crate::unknown_file::unknown_file;
use crate::view_synthesis::{llff, middlebury, mvsnet, neus, pmvs, real_estate};
use crate::{
    Calibration, CameraRecord, Folder, OutputFiles, ReadHints, bop, colmap, kitti, open_folder, opencv, plausibility,
    ros,
};

type Detect = fn(&InputFile, &str) -> bool;
type Read = fn(&InputFile, &mut AssetRoot, &ReadHints) -> Result<Calibration>;
type Write = fn(&[CameraRecord], &Path) -> Result<OutputFiles>;
type DetectFolder = fn(&Folder, &mut AssetRoot) -> bool;
type ReadFolder = fn(&Folder, &mut AssetRoot, &ReadHints) -> Result<Calibration>;

/// Format of calibrations or poses.
struct CalibrationFormat {
    name: &'static str,
    /// True if a file has this format, judged by its bytes, name and text (empty for binary files).
    detect: Detect,
    read: Read,
    write: Option<Write>,
    /// Functions that recognise and read a folder, if the format has folders that no single file represents.
    folder: Option<(DetectFolder, ReadFolder)>,
    /// True if the format specifies which cameras belong to a rig.
    supports_rigs: bool,
    /// True if the format specifies neither direction nor axes of its poses, so that the caller may specify them.
    open_poses: bool,
}

const fn reader(name: &'static str, detect: Detect, read: Read) -> CalibrationFormat {
    CalibrationFormat { name, detect, read, write: None, folder: None, supports_rigs: false, open_poses: false }
}

impl CalibrationFormat {
    const fn written(self, write: Write) -> Self {
        Self { write: Some(write), ..self }
    }

    const fn in_folders(self, detect: DetectFolder, read: ReadFolder) -> Self {
        Self { folder: Some((detect, read)), ..self }
    }

    const fn with_rigs(self) -> Self {
        Self { supports_rigs: true, ..self }
    }

    const fn with_open_poses(self) -> Self {
        Self { open_poses: true, ..self }
    }
}

/// All formats. The first format that recognises a file reads it. Formats with reliable markers, such as keys, precede
/// formats that are recognised only by the number of values per line.
const FORMATS: &[CalibrationFormat] = &[
    reader("colmap", colmap::text::detect, colmap::text::read).written(colmap::text::write).with_rigs(),
    reader("colmap-binary", colmap::binary::detect, colmap::binary::read).written(colmap::binary::write).with_rigs(),
    reader("kalibr", kalibr::detect, kalibr::read).written(kalibr::write).with_rigs(),
    reader("ros", ros::detect, ros::read).written(ros::write).in_folders(ros::detect_pair, ros::read_pair),
    reader("ov2slam", ov2slam::detect, ov2slam::read),
    reader("ncamera", ncamera::detect, ncamera::read),
    reader("orb-slam", orb_slam::detect, orb_slam::read).written(orb_slam::write).with_rigs(),
    reader("vins", vins::detect, vins::read),
    reader("camodocal", camodocal::detect, camodocal::read).written(camodocal::write),
    reader("anipose", anipose::detect, anipose::read),
    reader("basalt", basalt::detect, basalt::read),
    reader("mrcal", mrcal::detect, mrcal::read),
    reader("zed", zed::detect, zed::read),
    reader("realsense", real_sense::detect, real_sense::read),
    reader("metashape", metashape::detect, metashape::read),
    reader("realitycapture", reality_capture::detect, reality_capture::read),
    reader("realitycapture-xmp", xmp::detect, xmp::read).in_folders(xmp::detect_folder, xmp::read_folder),
    reader("bundler", bundler::detect, bundler::read),
    reader("openmvg", open_mvg::detect, open_mvg::read),
    reader("alicevision", alice_vision::detect, alice_vision::read),
    reader("opensfm", open_sfm::detect, open_sfm::read),
    reader("kapture", kapture::detect, kapture::read).in_folders(kapture::detect_folder, kapture::read_folder),
    reader("middlebury", middlebury::detect, middlebury::read),
    reader("mvsnet", mvsnet::detect, mvsnet::read).in_folders(mvsnet::detect_folder, mvsnet::read_folder),
    reader("neus", neus::detect, neus::read),
    reader("pmvs", pmvs::detect, pmvs::read).in_folders(pmvs::detect_folder, pmvs::read_folder),
    reader("llff", llff::detect, llff::read),
    reader("realestate10k", real_estate::detect, real_estate::read),
    reader("open3d", open3d::detect, open3d::read),
    reader("polycam", polycam::detect, polycam::read).in_folders(polycam::detect_folder, polycam::read_folder),
    reader("record3d", record3d::detect, record3d::read),
    reader("camera-path", camera_path::detect, camera_path::read),
    reader("nerf", nerf::detect, nerf::read).written(nerf::write),
    reader("blender", nerf::detect_blender, nerf::read).written(nerf::write_blender),
    reader("blender-splits", nerf::detect_blender, nerf::read)
        .written(nerf_splits::write)
        .in_folders(nerf_splits::detect, nerf_splits::read),
    reader("3dgs", splats::detect, splats::read).written(splats::write),
    reader("hot3d", aria::detect, aria::read),
    reader("aria-mps", aria_mps::detect, aria_mps::read),
    reader("bop", bop::detect, bop::read).written(bop::write).in_folders(bop_set::detect, bop_set::read),
    reader("coco", coco::detect, coco::read),
    reader("euroc", euroc::detect, euroc::read).written(euroc::write).in_folders(euroc_set::detect, euroc_set::read),
    reader("arkit", arkit::detect, arkit::read).in_folders(arkit::detect_folder, arkit::read_folder),
    reader("nuscenes", nu_scenes::detect, nu_scenes::read).in_folders(nu_scenes::detect_folder, nu_scenes::read_folder),
    reader("replicator", replicator::detect, replicator::read)
        .in_folders(replicator::detect_folder, replicator::read_folder),
    reader("cityscapes", cityscapes::detect, cityscapes::read),
    reader("scannetpp-iphone", scannetpp_iphone::detect, scannetpp_iphone::read),
    reader("virtual-kitti", virtual_kitti::detect, virtual_kitti::read),
    reader("tartanair", tartan_air::detect, tartan_air::read),
    reader("argoverse", vehicles::detect_argoverse, vehicles::read_argoverse),
    reader("waymo", vehicles::detect_waymo, vehicles::read_waymo),
    reader("opencv", opencv::read::detect, opencv::read::read)
        .written(opencv::write::write)
        .in_folders(opencv::pair_folder::detect_folder, opencv::pair_folder::read_folder),
    reader("kitti", kitti::detect, kitti::read)
        .written(kitti::write)
        .in_folders(kitti_set::detect, kitti_set::read)
        .with_rigs(),
    reader("kitti-360", kitti360::detect, kitti360::read),
    reader("redwood", redwood::detect, redwood::read),
    reader("poses", matrices::detect, matrices::read)
        .written(matrices::write)
        .in_folders(matrix_folder::detect, matrix_folder::read)
        .with_open_poses(),
    reader("kitti-poses", kitti::detect_poses, kitti::read_poses).written(kitti::write_poses),
    reader("tum", tum::detect, tum::read).written(tum::write),
    reader("tum-intrinsics", tum::detect_intrinsics, tum::read_intrinsics).written(tum::write_intrinsics),
];

/// Names of the formats that [`read`] supports.
pub fn formats() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().map(|format| format.name)
}

/// Names of the formats that [`write()`] supports.
pub fn written_formats() -> impl Iterator<Item = &'static str> {
    FORMATS.iter().filter(|format| format.write.is_some()).map(|format| format.name)
}

/// Names of all formats, for messages.
fn format_list() -> String {
    formats().collect::<Vec<_>>().join(", ")
}

fn format_named(name: &str) -> Result<&'static CalibrationFormat> {
    FORMATS.iter().find(|format| format.name == name).ok_or_else(|| {
        let hint = raycam_scene::suggestion(name, formats());
        let known = format_list();
        let message = format!("unknown calibration format {name:?}{hint} (available: {known})");
        FormatError::encode(ErrorCode::UnknownName.message(message))
    })
}

/// Reads the cameras in a file or a folder; the contents of a folder determine how it is opened.
///
/// `format` is one of [`formats`]; by default, the file's name and contents determine the format. `known` contains
/// values that the file does not specify.
///
/// # Errors
/// See [`FormatError`].
pub fn read(path: &Path, format: Option<&str>, known: &ReadHints, budget: &Budget) -> Result<Calibration> {
    let format = format.map(format_named).transpose()?;
    if path.is_dir() {
        return read_folder(path, format, known, budget);
    }
    let mut assets = AssetRoot::containing(path, budget).fixed();
    let source = assets.read(path)?;
    decode_in(source, format, known, &mut assets)
}

fn read_folder(
    path: &Path,
    format: Option<&'static CalibrationFormat>,
    known: &ReadHints,
    budget: &Budget,
) -> Result<Calibration> {
    let (folder, mut assets) = open_folder::open(path, budget);
    let wanted = |found: &CalibrationFormat| format.is_none_or(|format| format.name == found.name);
    let mut files = Vec::new();
    for file in open_folder::candidates(&folder) {
        let (source, inside) = open_folder::read_file(path, &file, budget)?;
        if let Some(found) = detected(&source).filter(|found| wanted(found)) {
            files.push((file, found, source, inside));
        }
    }
    let whole = |found: &&CalibrationFormat| wanted(found) && found.folder.is_some();
    let mut folders = Vec::new();
    for found in FORMATS.iter().filter(whole) {
        if let Some((detect, read)) = found.folder
            && detect(&folder, &mut assets)
            && (found.name != "opencv" || is_opencv_pair(&folder, &mut assets))
        {
            folders.push((found, read));
        }
    }
    // A data set contains K, sizes and poses, so it is preferred to the files in it that contain only poses.
    if folders.len() == 1 {
        files.retain(|(_, found, ..)| !matches!(found.name, "kitti-poses" | "bop" | "tum"));
    }
    match (&files[..], &folders[..]) {
        ([_], []) => {
            let (_, found, source, mut inside) = files.remove(0);
            decode_in(source, Some(found), known, &mut inside)
        }
        ([], [(found, read)]) => {
            let calibration = read(&folder, &mut assets, known)?;
            finish(calibration, found, path, known)
        }
        ([], []) => read_only_file(&folder, &wanted, known, budget),
        _ => {
            let files = files.iter().map(|(file, found, ..)| {
                let file = file.strip_prefix(path).unwrap_or(file);
                format!("{} (format={:?})", file.display(), found.name)
            });
            let names = files.chain(folders.iter().map(|(found, _)| format!("format={:?}", found.name)));
            Err(FormatError::unsupported(
                path,
                format!(
                    "the folder contains several calibrations; open one of {}",
                    names.collect::<Vec<_>>().join(", ")
                ),
            ))
        }
    }
}

/// Reads the cameras of the only calibration file in a folder; its name does not matter.
fn read_only_file(
    folder: &Folder,
    wanted: &dyn Fn(&CalibrationFormat) -> bool,
    known: &ReadHints,
    budget: &Budget,
) -> Result<Calibration> {
    let mut found = Vec::new();
    for file in open_folder::small_files(folder) {
        let (source, inside) = open_folder::read_file(&folder.path, &file, budget)?;
        if let Some(format) = detected(&source).filter(|format| wanted(format)) {
            found.push((source, format, inside));
        }
    }
    if let Some(whole) = naming_the_others(&found) {
        let (source, format, mut inside) = found.swap_remove(whole);
        return decode_in(source, Some(format), known, &mut inside);
    }
    if found.is_empty() {
        found = of_camera_folders(folder, wanted, budget)?;
    }
    match &found[..] {
        [] => Err(FormatError::unsupported(
            &folder.path,
            "no calibration found in the folder; expected a COLMAP model (also in sparse/0), transforms.json, pose/, \
             cams/, XMP files, cameras.xml, sensor.yaml in cam0/ or another file that lists all cameras. Open a single \
             file instead",
        )),
        [_] => {
            let (source, format, mut inside) = found.remove(0);
            let name = source.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let mut calibration = decode_in(source, Some(format), known, &mut inside)?;
            calibration.note(
                NoticeCode::AssumedConvention,
                format!("{name} is the only calibration in the folder; it was opened as {}", format.name),
            );
            Ok(calibration)
        }
        _ => read_several_files(folder, found, known),
    }
}

/// Reads the cameras of a folder with several files, if the files contain one camera each.
fn read_several_files(
    folder: &Folder,
    found: Vec<(InputFile, &'static CalibrationFormat, AssetRoot)>,
    known: &ReadHints,
) -> Result<Calibration> {
    let is_named_set = is_set_of_cameras(found.iter().map(|(source, ..)| source));
    let read = |(source, format, mut inside): (InputFile, &'static CalibrationFormat, AssetRoot)| {
        let calibration = (format.read)(&source, &mut inside, known);
        (source, format, calibration)
    };
    let files: Vec<ReadFile> = found.into_iter().map(read).collect();
    if is_named_set || files.iter().all(is_placed_camera) {
        return join_single_cameras(folder, files, known);
    }
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let some = files.iter().take(8);
    let names: Vec<_> = some.map(|(source, format, _)| format!("{} ({})", name(&source.path), format.name)).collect();
    Err(FormatError::unsupported(
        &folder.path,
        format!(
            "the folder contains {} calibrations, but no file that lists all cameras; open one of {}{}",
            files.len(),
            names.join(", "),
            if files.len() > 8 { ", ..." } else { "" }
        ),
    ))
}

/// File of a folder with its format and the cameras in it.
type ReadFile = (InputFile, &'static CalibrationFormat, Result<Calibration>);

/// True for a file that contains exactly one camera, with K and with a pose.
fn is_placed_camera((.., calibration): &ReadFile) -> bool {
    calibration.as_ref().is_ok_and(
        |calibration| matches!(&calibration.records[..], [camera] if camera.k.is_some() && camera.pose.is_some()),
    )
}

/// Index of the only file that refers to all other files, such as VINS' settings, which refer to a file for each
/// camera.
fn naming_the_others(found: &[(InputFile, &'static CalibrationFormat, AssetRoot)]) -> Option<usize> {
    let names = |source: &InputFile, other: &InputFile| {
        let name = other.path.file_name().unwrap_or_default().to_string_lossy();
        source.text().is_ok_and(|text| text.contains(&*name))
    };
    let mut whole = (0..found.len())
        .filter(|&i| found.len() > 1 && (0..found.len()).all(|j| i == j || names(&found[i].0, &found[j].0)));
    whole.next().filter(|_| whole.next().is_none())
}

/// Finds the calibration file of each subfolder, if every camera has its own subfolder: for example `left/calib.json`
/// and `right/calib.json`, or `cam0/` and `cam1/`. Returns each file with its format and its assets; nothing unless
/// every subfolder contains exactly one such file.
fn of_camera_folders(
    folder: &Folder,
    wanted: &dyn Fn(&CalibrationFormat) -> bool,
    budget: &Budget,
) -> Result<Vec<(InputFile, &'static CalibrationFormat, AssetRoot)>> {
    let mut found = Vec::new();
    let inner = folder.names.iter().filter(|name| folder.path.join(name).is_dir());
    let inner: Vec<&String> = inner.take(open_folder::MAX_FILES).collect();
    if !is_set_of_names(inner.iter().map(|name| name.to_lowercase())) {
        return Ok(found);
    }
    for name in inner {
        let (inner, _) = open_folder::open(&folder.path.join(name), budget);
        let mut own = Vec::new();
        for file in open_folder::small_files(&inner) {
            let (source, inside) = open_folder::read_file(&folder.path, &file, budget)?;
            if let Some(format) = detected(&source).filter(|format| wanted(format)) {
                own.push((source, format, inside));
            }
        }
        match own.pop() {
            Some(only) if own.is_empty() => found.push(only),
            _ => return Ok(vec![]),
        }
    }
    Ok(found)
}

/// True if the files of the left and the right camera in the folder are recognised as `opencv`, and not as a format
/// that precedes it in the table.
fn is_opencv_pair(folder: &Folder, assets: &mut AssetRoot) -> bool {
    let sides = opencv::pair_folder::sides(folder, assets);
    sides.iter().all(|source| detected(source).is_some_and(|format| format.name == "opencv"))
}

/// True for a set of files with one camera each: their names differ only in a number or in the words left and right, or
/// each file is in a different folder.
fn is_set_of_cameras<'a>(sources: impl Iterator<Item = &'a InputFile>) -> bool {
    let sources: Vec<&InputFile> = sources.collect();
    let stems = sources.iter().map(|source| source.stem().unwrap_or_default().to_lowercase());
    let folders: HashSet<_> = sources.iter().map(|source| source.path.parent()).collect();
    is_set_of_names(stems) || folders.len() == sources.len() && sources.len() > 1
}

/// True for names that differ only in a number, or in the words left and right.
fn is_set_of_names(names: impl Iterator<Item = String>) -> bool {
    let base = |name: String| {
        let sides = name.replace("left", "").replace("right", "");
        sides.chars().filter(|c| !c.is_ascii_digit()).collect::<String>()
    };
    let bases: Vec<String> = names.map(base).collect();
    bases.len() > 1 && bases.iter().all(|name| *name == bases[0])
}

/// Joins the cameras of a folder with one file per camera, with their mounts.
fn join_single_cameras(folder: &Folder, files: Vec<ReadFile>, known: &ReadHints) -> Result<Calibration> {
    let mut all = Calibration::default();
    let format = files[0].1;
    for (source, _, calibration) in files {
        let inner = source.path.parent().filter(|parent| *parent != folder.path).and_then(Path::file_name);
        let stem = inner.map_or_else(|| source.stem().unwrap_or_default(), |name| name.to_string_lossy().into_owned());
        let calibration = calibration?;
        let alone = calibration.records.len() == 1;
        for mut record in calibration.records {
            record.name = if alone { stem.clone() } else { format!("{stem}/{}", record.name) };
            if let Some(mount) = &mut record.mount {
                mount.name.clone_from(&record.name);
                (mount.rig, mount.frame) = ("rig".into(), "rig".into());
            }
            all.records.push(record);
        }
        all.notices.extend(calibration.notices.into_iter().map(|notice| notice.in_context(&stem)));
        all.used_convention |= calibration.used_convention;
    }
    let is_placed = |record: &CameraRecord| record.pose.is_some() || record.matrix.is_some();
    if !all.records.iter().all(is_placed) {
        let missing = all.records.iter().filter(|record| !is_placed(record));
        let names: Vec<&str> = missing.map(|record| record.name.as_str()).collect();
        let message = "the file contains no pose; the camera is at the origin";
        all.notices.push(about_cameras(NoticeCode::MissingValue, names.into_iter(), message));
    }
    finish(all, format, &folder.path, known)
}

/// Detects the format of a file by its bytes and its name.
fn detected(source: &InputFile) -> Option<&'static CalibrationFormat> {
    let text = std::str::from_utf8(&source.bytes).unwrap_or("");
    if unread::named_format(&source.path, text).is_some() {
        return None;
    }
    FORMATS.iter().find(|format| (format.detect)(source, text))
}

/// Reads the cameras in the bytes of a single file. `path` names the file in errors; files to which it refers are read
/// from the folder of `path`.
///
/// # Errors
/// See [`FormatError`].
pub fn decode(
    bytes: Vec<u8>,
    path: &Path,
    format: Option<&str>,
    known: &ReadHints,
    budget: &Budget,
) -> Result<Calibration> {
    let mut assets = AssetRoot::containing(path, budget).fixed();
    assets.budget.take_bytes(path, bytes.len() as u64)?;
    let source = InputFile::new(path, bytes);
    decode_in(source, format.map(format_named).transpose()?, known, &mut assets)
}

fn decode_in(
    mut source: InputFile,
    format: Option<&'static CalibrationFormat>,
    known: &ReadHints,
    assets: &mut AssetRoot,
) -> Result<Calibration> {
    source = zip_members::unpacked(source, &mut assets.budget)?;
    refuse_decimal_commas(&source)?;
    let named = format.is_some();
    let Some(format) = format.or_else(|| detected(&source)) else { return Err(unknown_file(&source, &format_list())) };
    let calibration = (format.read)(&source, assets, known);
    calibration.and_then(|calibration| finish(calibration, format, &source.path, known)).map_err(|error| match error {
        FormatError::Syntax { path, location, message } if !named => {
            let text = format!("{message} (read as {})", format.name);
            FormatError::Syntax { path, location, message: message.with_text(text) }
        }
        error => error,
    })
}

/// Returns an error for numbers with decimal commas. Readers would split such numbers at the commas, and read wrong
/// numbers.
fn refuse_decimal_commas(source: &InputFile) -> Result<()> {
    let text = std::str::from_utf8(&source.bytes).unwrap_or("");
    let Some((line, numbers)) = line_with_decimal_commas(text) else { return Ok(()) };
    let first = numbers.split(|c: char| c.is_whitespace() || c == ';').next().unwrap_or(numbers);
    Err(FormatError::line(
        &source.path,
        line,
        format!("{first}: numbers with decimal commas; expected decimal points, as in {}", first.replace(',', ".")),
    ))
}

/// If all cameras with a size have the same size, assigns this size to the cameras that have K but no size, and returns
/// a notice.
fn lend_size(records: &mut [CameraRecord], known: &ReadHints) -> Option<Notice> {
    let size = records.iter().find_map(|record| record.size).filter(|_| known.size.is_none())?;
    let lacks = |record: &CameraRecord| record.size.is_none() && record.k.is_some();
    if records.iter().any(|record| !lacks(record) && record.size != Some(size)) {
        return None;
    }
    let mut lent = 0;
    for record in records.iter_mut().filter(|record| lacks(record)) {
        record.size = Some(size);
        lent += 1;
    }
    (lent > 0).then(|| {
        let message = format!(
            "the file has no size for {}; the other cameras' size is used, {} x {} (set another size with size= or --size)",
            counted(lent, "camera"),
            size[0],
            size[1]
        );
        Notice::new(NoticeCode::AssumedConvention, message)
    })
}

/// Gives unique names to poses with equal times, which a trajectory may contain; returns a notice about them.
fn name_repeated_times(records: &mut [CameraRecord]) -> Option<Notice> {
    let mut counts = HashMap::<String, usize>::new();
    let mut repeated = Vec::new();
    for record in records.iter_mut().filter(|record| record.time.is_some()) {
        let count = counts.entry(record.name.clone()).or_default();
        *count += 1;
        if *count > 1 {
            repeated.push(record.name.clone());
            record.name = format!("{}#{count}", record.name);
        }
    }
    let first = repeated.first()?;
    let message =
        format!("{} renamed, for example to {first}#2: same time as another pose", counted(repeated.len(), "pose"));
    Some(about_cameras(NoticeCode::Renamed, repeated.iter().map(String::as_str), message))
}

/// Fills in values that a file does not specify, and validates its cameras.
fn finish(
    mut calibration: Calibration,
    format: &CalibrationFormat,
    path: &Path,
    known: &ReadHints,
) -> Result<Calibration> {
    if calibration.records.is_empty() {
        let said = calibration.notices.iter().map(Notice::to_string).collect::<Vec<_>>().join("; ");
        let said = if said.is_empty() { said } else { format!(" ({said})") };
        return Err(FormatError::whole(
            path,
            format!("the file contains no camera; it was read as {}{said}", format.name),
        ));
    }
    if !known.poses.is_empty() && !format.open_poses && !calibration.used_convention {
        return Err(FormatError::whole(
            path,
            format!(
                "{} specifies the direction and the axes of its poses; omit direction= and axes= (--direction and --axes)",
                format.name
            ),
        ));
    }
    if let Some(intrinsics) = &known.intrinsics
        && !calibration.poses_of_body
        && calibration.records.iter().any(|record| record.k.is_none() && record.matrix.is_none())
        && intrinsics.pose.as_ref().is_some_and(|pose| !pose.is_identity())
    {
        calibration.note(
            NoticeCode::IgnoredKey,
            "the poses are interpreted as those of the camera itself; the pose in the intrinsics (a mount, such as \
             T_BS or T_cam_imu) is ignored. For the poses of a body, use the rig: rig.at_pose(R, C), or raycam \
             dataset WORLD -o FOLDER --rig FILE --poses FILE",
        );
    }
    calibration.notices.extend(name_repeated_times(&mut calibration.records));
    calibration.notices.extend(lend_size(&mut calibration.records, known));
    let mut repaired = Vec::new();
    for record in &mut calibration.records {
        known.fill_missing(record, path)?;
        repaired.extend(record.orthonormalize().map(|off| (record.name.clone(), off)));
    }
    calibration.notices.extend(notice_of_repairs(&repaired));
    calibration.notices.extend(plausibility::check_cameras(&calibration.records, path)?);
    calibration.notices = Notice::group(calibration.notices);
    Ok(calibration)
}

/// Returns the files that store the cameras in `format`; `path` is the location to which they will be written.
///
/// # Errors
/// [`FormatError::Encode`] for data that the format cannot store.
pub fn write(records: &[CameraRecord], path: &Path, format: &str) -> Result<OutputFiles> {
    let format = format_named(format)?;
    if records.is_empty() {
        return Err(FormatError::encode("no camera to write; expected at least one"));
    }
    let Some(write) = format.write else {
        let known = written_formats().collect::<Vec<_>>().join(", ");
        return Err(FormatError::encode(format!(
            "format {} cannot be written; available for writing: {known}",
            format.name
        )));
    };
    let mut written = write(records, path)?;
    for record in records.iter().filter(|record| !record.unsupported.is_empty()) {
        written.notices.push(Notice::new(
            NoticeCode::NotWritten,
            format!(
                "camera {:?}: its {} not written, because calibration files store only K, a lens and one pose; use a \
             world file to store everything",
                record.name,
                match record.unsupported[..] {
                    [one] => format!("{one} is"),
                    _ => format!("{} are", record.unsupported.join(" and ")),
                }
            ),
        ));
    }
    if !format.supports_rigs && records.iter().any(|record| record.mount.is_some()) {
        written.notices.push(Notice::new(
            NoticeCode::NotWritten,
            format!("{} cannot store which cameras belong to a rig; they keep their poses in the world", format.name),
        ));
    }
    Ok(written)
}
