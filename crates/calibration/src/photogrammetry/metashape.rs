//! Metashape's `cameras.xml`: sensors with calibrations, cameras with chunk_from_camera, a transform of the chunk or of
//! each component. Sources: Metashape's manual, "Camera models"; Agisoft's forum, topics 6437 and 15797. OpenCV's p1 is
//! Metashape's p2, and the reverse.

use std::collections::HashMap;

use glam::{DMat3, DVec3};
use raycam_scene::{ErrorCode, Lens, LensModel, NoticeCode, PixelCenter, counted};

use crate::document::check_rigid;
use crate::document::rigid;
use crate::document::xml_element::{XmlElement, XmlFile};
use crate::intrinsics::{brown_lens, lens_of, refuse_terms, set_panorama};
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

/// Names of a calibration's terms; only older exports contain `fx`, `fy` and `skew`.
const TERMS: [&str; 16] =
    ["f", "fx", "fy", "cx", "cy", "b1", "b2", "skew", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4"];
/// Names of a calibration's other elements.
const OTHER: [&str; 8] =
    ["resolution", "width", "height", "projection", "date", "pixel_width", "pixel_height", "layer"];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let start = text.trim_start().starts_with('<');
    start && (text.contains("<chunk") || text.contains("<calibration") && text.contains("<projection>"))
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let file = XmlFile::parse(source.text()?, &source.path)?;
    let root = file.root();
    if root.name() == "calibration" {
        let mut record = CameraRecord::new(source.stem().unwrap_or_else(|| "camera".into()), PixelCenter::Half);
        let kind = root.child("projection").map_or("frame", |at| at.text());
        intrinsics(&root, kind, &mut record)?;
        return Ok(Calibration { records: vec![record], ..Calibration::default() });
    }
    let mut calibration = Calibration::default();
    let chunks: Vec<_> = root.all("chunk").collect();
    let enabled = |chunk: &&XmlElement<'_>| chunk.attribute("enabled") != Some("false");
    let chunk = chunks.iter().find(enabled).or(chunks.first()).copied().ok_or_else(|| {
        root.fail(
            "the file contains no \
        chunk",
        )
    })?;
    if chunks.len() > 1 {
        calibration.note(
            NoticeCode::FirstOnly,
            format!(
                "the file contains {} chunks, each of them a separate world; the first enabled chunk is used, {:?}",
                chunks.len(),
                chunk.attribute("label").unwrap_or("without a label")
            ),
        );
    }
    world_notices(&chunk, &mut calibration);
    cameras(&chunk, &mut calibration)?;
    Ok(calibration)
}

/// Adds notices about the world of the cameras.
fn world_notices(chunk: &XmlElement<'_>, calibration: &mut Calibration) {
    let reference = chunk.child("reference").map_or("", |at| at.text());
    if ["GEOGCS", "PROJCS", "GEOCCS", "GEOGCRS", "PROJCRS"].iter().any(|word| reference.contains(word)) {
        calibration.note(
            NoticeCode::PlacedCameras,
            "the cameras are in geocentric metres (ECEF, values of about 6e6), because the chunk has a geographic \
             reference; they are not in latitude and longitude or in projected coordinates",
        );
    }
    if chunk.child("transform").is_none() && chunk.all("component").all(|at| at.child("transform").is_none()) {
        calibration
            .note(NoticeCode::PlacedCameras, "the chunk has no transform; the cameras keep the chunk's axes and unit");
    }
}

fn cameras(chunk: &XmlElement<'_>, calibration: &mut Calibration) -> Result<()> {
    let sensors = chunk.child("sensors").ok_or_else(|| chunk.fail("the file contains no sensors"))?;
    let sensors: HashMap<&str, XmlElement<'_>> =
        sensors.all("sensor").filter_map(|at| Some((at.attribute("id")?, at))).collect();
    let placed = chunk.child("transform").map(|at| Similarity::read(&at, "translation")).transpose()?;
    let mut components = HashMap::new();
    for at in chunk.all("component") {
        if let (Some(id), Some(transform)) = (at.attribute("id"), at.child("transform")) {
            components.insert(id, Similarity::read(&transform, "translation")?);
        }
    }
    let list = chunk.child("cameras").ok_or_else(|| chunk.fail("the file contains no cameras"))?;
    let by_id: HashMap<&str, XmlElement<'_>> =
        list.all("camera").filter_map(|at| Some((at.attribute("id")?, at))).collect();
    let mut made: HashMap<&str, CameraRecord> = HashMap::new();
    let mut names = std::collections::HashSet::new();
    let (mut disabled, mut rolling, mut slaves) = (0, 0, 0);
    let mut initial = std::collections::BTreeSet::new();
    for at in list.all("camera") {
        let label = at.attribute("label").or(at.attribute("id")).unwrap_or("camera");
        let master = at.attribute("master_id").and_then(|id| by_id.get(id)).filter(|_| at.child("transform").is_none());
        let placement = match master {
            None => own_place(&at)?,
            Some(master) => place_by_master(&at, master, &sensors)?,
        };
        let Some((r, c)) = placement else {
            let message = "omitted, because the transform is missing (not aligned, or slave of a rig)";
            calibration.note_about(NoticeCode::IgnoredElement, format!("camera {label:?}"), message);
            continue;
        };
        slaves += usize::from(master.is_some());
        disabled += usize::from(at.attribute("enabled") == Some("false"));
        rolling += usize::from(at.child("rolling_shutter").is_some());
        let id = at.attribute("sensor_id").unwrap_or_default();
        if !made.contains_key(id) {
            let sensor = sensors.get(id).ok_or_else(|| at.fail(format_args!("unknown sensor {id:?}")))?;
            let mut record = CameraRecord::new("", PixelCenter::Half);
            if !sensor_intrinsics(sensor, &mut record)? {
                initial.insert(id);
            }
            made.insert(id, record);
        }
        let mut record = made[id].clone();
        record.name = label.to_owned();
        if !names.insert(record.name.clone()) {
            record.name = format!("{label}#{}", at.attribute("id").unwrap_or_default());
        }
        record.image = Some(label.to_owned());
        let component = at.attribute("component_id").or(master.and_then(|at| at.attribute("component_id")));
        let world = component.and_then(|id| components.get(id)).or(placed.as_ref());
        let (r, c) = world.map_or((r, c), |world| (world.rotation * r, world.point(c)));
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        calibration.records.push(record);
    }
    let mut notice = |code, text: String| calibration.note(code, text);
    if slaves > 0 {
        let place = "placed relative to the master, with the sensor's rotation and location, in the chunk's unit";
        notice(NoticeCode::PlacedCameras, format!("{} {place}", counted(slaves, "slave camera")));
    }
    if disabled > 0 {
        notice(
            NoticeCode::HiddenPart,
            format!("{} included, though disabled in Metashape", counted(disabled, "camera")),
        );
    }
    if rolling > 0 {
        notice(NoticeCode::IgnoredFeature, format!("the rolling shutter of {} is ignored", counted(rolling, "camera")));
    }
    for id in initial {
        notice(
            NoticeCode::MissingValue,
            format!("sensor {id} has no adjusted calibration; the initial calibration is used"),
        );
    }
    Ok(())
}

/// Reads chunk_from_camera; `None` if the camera has no transform.
fn own_place(at: &XmlElement<'_>) -> Result<Option<(DMat3, DVec3)>> {
    let Some(transform) = at.child("transform") else { return Ok(None) };
    let rows = check_rigid(&transform.numbers()?).map_err(|message| transform.fail(message))?;
    Ok(Some(rigid(&rows)))
}

/// Returns chunk_from_camera of a slave camera, computed from its master; `None` if the master's transform or a mount
/// is unknown, or if the mounts belong to different rigs.
///
/// The master camera's sensor need not be the master of the slave camera's sensor, but both sensors belong to one rig.
fn place_by_master<'a>(
    at: &XmlElement<'a>,
    master: &XmlElement<'a>,
    sensors: &HashMap<&str, XmlElement<'a>>,
) -> Result<Option<(DMat3, DVec3)>> {
    let mount = |at: &XmlElement<'a>| rig_mount(at.attribute("sensor_id").unwrap_or_default(), sensors);
    let (Some((r, c)), Some((rig, slave)), Some((other, own))) = (own_place(master)?, mount(at)?, mount(master)?)
    else {
        return Ok(None);
    };
    if rig != other && rig.is_some() && other.is_some() {
        return Ok(None);
    }
    let r = r * own.rotation.transpose();
    Ok(Some((r * slave.rotation, c + r * (slave.translation - own.translation))))
}

/// Reads the mount of a sensor on a rig. Returns the sensor that defines the rig's axes (`None` if the file does not
/// specify this sensor), and the transform from the given sensor's axes to the rig's axes. A sensor may be mounted on
/// another sensor. Returns `None` for a slave without rotation and location.
fn rig_mount<'a>(
    id: &'a str,
    sensors: &HashMap<&str, XmlElement<'a>>,
) -> Result<Option<(Option<&'a str>, Similarity)>> {
    let (mut id, mut mount) = (id, Similarity::IDENTITY);
    for _ in 0..=sensors.len() {
        let Some(sensor) = sensors.get(id) else { return Ok(None) };
        let master = sensor.attribute("master_id").filter(|master| *master != id);
        if sensor.child("rotation").is_none() && sensor.child("location").is_none() {
            return Ok(master.is_none().then_some((Some(id), mount)));
        }
        let own = Similarity::read(sensor, "location")?;
        let translation = own.point(mount.translation);
        mount = Similarity { rotation: own.rotation * mount.rotation, translation, scale: 1.0 };
        match master {
            Some(master) => id = master,
            None => return Ok(Some((None, mount))),
        }
    }
    Err(sensors[id].fail("the sensor is indirectly its own master; expected a master without master_id"))
}

/// A similarity transform, such as world_from_chunk: rotation, scale and translation.
struct Similarity {
    rotation: DMat3,
    translation: DVec3,
    scale: f64,
}

impl Similarity {
    const IDENTITY: Self = Self { rotation: DMat3::IDENTITY, translation: DVec3::ZERO, scale: 1.0 };

    /// Reads the elements `rotation` and `scale`, and the translation from the element of the given name.
    fn read(at: &XmlElement<'_>, translation: &str) -> Result<Self> {
        let rotation = match at.child("rotation") {
            Some(r) => {
                let matrix = DMat3::from_cols_array(&r.numbers()?).transpose();
                crate::document::check_rotation(matrix).map_err(|message| r.fail(message))?;
                matrix
            }
            None => DMat3::IDENTITY,
        };
        let translation = at.child(translation).map(|t| t.numbers::<3>()).transpose()?.unwrap_or_default();
        let [scale] = at.child("scale").map(|s| s.numbers()).transpose()?.unwrap_or([1.0]);
        if scale <= 0.0 {
            return Err(at.fail(format_args!("scale is {scale}; expected a number greater than 0")));
        }
        Ok(Self { rotation, translation: DVec3::from_array(translation), scale })
    }

    fn point(&self, x: DVec3) -> DVec3 {
        self.scale * (self.rotation * x) + self.translation
    }
}

/// Reads the size, K and lens of a sensor; returns false if only an initial calibration exists.
fn sensor_intrinsics(sensor: &XmlElement<'_>, record: &mut CameraRecord) -> Result<bool> {
    let kind = sensor.attribute("type").unwrap_or("frame");
    if let Some(at) = sensor.child("resolution") {
        record.size = Some(resolution(&at)?);
    }
    let class = |wanted: &str| {
        sensor.children().find(|at| at.name() == "calibration" && at.attribute("class").unwrap_or("adjusted") == wanted)
    };
    let adjusted = class("adjusted");
    match adjusted.or_else(|| class("initial")) {
        Some(at) => intrinsics(&at, at.attribute("type").unwrap_or(kind), record)?,
        None if kind == "spherical" => set_panorama(record).map_err(|message| sensor.fail(message))?,
        None => return Err(sensor.fail("the sensor contains no calibration")),
    }
    Ok(adjusted.is_some() || kind == "spherical")
}

fn resolution(at: &XmlElement<'_>) -> Result<[u32; 2]> {
    let side = |name: &str| at.attribute(name).and_then(|word| word.parse().ok());
    side("width")
        .zip(side("height"))
        .map(|(w, h)| [w, h])
        .ok_or_else(|| at.fail("expected whole numbers as the attributes width and height"))
}

fn intrinsics(at: &XmlElement<'_>, kind: &str, record: &mut CameraRecord) -> Result<()> {
    if let Some(inner) = at.child("resolution") {
        record.size = Some(resolution(&inner)?);
    } else if let (Some(w), Some(h)) = (at.child("width"), at.child("height")) {
        let [w, h] = [w.numbers::<1>()?[0], h.numbers::<1>()?[0]];
        record.size = Some([w as u32, h as u32]);
    }
    let size = record.size.ok_or_else(|| at.fail("the sensor contains no resolution"))?;
    let mut terms: HashMap<&str, f64> = HashMap::new();
    for inner in at.children() {
        if TERMS.contains(&inner.name()) {
            terms.insert(inner.name(), inner.numbers::<1>()?[0]);
        } else if !OTHER.contains(&inner.name()) && inner.text().parse::<f64>().is_ok_and(|value| value != 0.0) {
            return Err(
                inner.fail(format_args!("unsupported lens term with the value {}; calibrate without it", inner.text()))
            );
        }
    }
    let term = |name: &str| terms.get(name).copied().unwrap_or(0.0);
    let fail = |message: String| at.fail(message);
    if kind == "spherical" {
        return set_panorama(record).map_err(fail);
    }
    let old = terms.contains_key("fx");
    let half = size.map(|side| 0.5 * f64::from(side));
    let (fx, fy, skew, middle) = match old {
        true => (term("fx"), term("fy"), term("skew"), [0.0; 2]),
        false => (term("f") + term("b1"), term("f"), term("b2"), half),
    };
    if fx <= 0.0 || fy <= 0.0 {
        return Err(at.fail("the calibration contains no focal length (f)"));
    }
    let (cx, cy) = (term("cx") + middle[0], term("cy") + middle[1]);
    record.k = Some(DMat3::from_cols(DVec3::new(fx, 0.0, 0.0), DVec3::new(skew, fy, 0.0), DVec3::new(cx, cy, 1.0)));
    // p1 and p2 of OpenCV; except in old exports, Metashape's p1 and p2 are exchanged.
    let [p1, p2] = if old { [term("p1"), term("p2")] } else { [term("p2"), term("p1")] };
    refuse_terms([("p3", term("p3")), ("p4", term("p4"))]).map_err(fail)?;
    let [k1, k2, k3, k4] = ["k1", "k2", "k3", "k4"].map(term);
    record.lens = match kind {
        "frame" => refuse_terms([("k4", k4)]).and_then(|()| brown_lens(k1, k2, p1, p2, k3)).map_err(fail)?,
        "fisheye" | "equidistant_fisheye" if p1 == 0.0 && p2 == 0.0 => {
            lens_of(LensModel::Fisheye, &[k1, k2, k3, k4]).map_err(fail)?
        }
        "fisheye" | "equidistant_fisheye" => {
            Lens::new(LensModel::ThinPrismFisheye, &[k1, k2, p1, p2, k3, k4, 0.0, 0.0])
                .map_err(|e| at.fail_as(ErrorCode::InvalidLens, e))?
        }
        _ => {
            return Err(at.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported sensor type {kind:?}; expected frame, fisheye, equidistant_fisheye or spherical"
                ),
            ));
        }
    };
    Ok(())
}
