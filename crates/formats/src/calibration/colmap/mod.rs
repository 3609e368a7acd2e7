//! COLMAP's model: what its text and its binary files say alike. Source: COLMAP's documentation, "Output Format", and
//! `scene/reconstruction_io_text.cc`; the centre of the first pixel is (0.5, 0.5), poses are camera from world.

pub(crate) mod binary;
pub(crate) mod text;

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use raycam_scene::{PixelCenter, camera};

use super::{Calibration, CameraRecord, Pose, RigMount, Rotation};
use crate::error::FormatError;

/// Quaternion w x y z, translation x y z.
pub(super) type RigidPose = [f64; 7];

/// A row of `cameras`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ColmapCamera {
    pub(super) id: u32,
    pub(super) model: String,
    pub(super) size: [u32; 2],
    pub(super) params: Vec<f64>,
}

/// A row of `images`.
pub(super) struct ColmapImage {
    pub(super) id: u32,
    pub(super) pose: RigidPose,
    pub(super) camera: u32,
    pub(super) name: String,
}

/// A row of `rigs`: its cameras, each with its pose from the rig, nothing for the one that is the rig's origin.
pub(super) struct Rig {
    pub(super) id: u32,
    pub(super) cameras: Vec<(u32, Option<RigidPose>)>,
}

/// A row of `frames`: where a rig stood, and its images.
pub(super) struct Frame {
    pub(super) id: u32,
    pub(super) rig: u32,
    pub(super) pose: RigidPose,
    /// ColmapCamera and image.
    pub(super) images: Vec<(u32, u32)>,
}

/// A model, without its points.
#[derive(Default)]
pub(super) struct Reconstruction {
    pub(super) cameras: Vec<ColmapCamera>,
    pub(super) images: Vec<ColmapImage>,
    pub(super) rigs: Vec<Rig>,
    pub(super) frames: Vec<Frame>,
}

fn pose(rigid: &RigidPose) -> Pose {
    let [w, x, y, z, tx, ty, tz] = *rigid;
    Pose::camera_from_world(Rotation::Quaternion([w, x, y, z]), DVec3::new(tx, ty, tz))
}

/// Whether its numbers are a pose.
pub(super) fn is_rigid(rigid: &RigidPose) -> bool {
    rigid.iter().all(|v| v.is_finite()) && rigid[..4].iter().map(|v| v * v).sum::<f64>() > 1e-12
}

impl Reconstruction {
    /// The cameras of the images, or those without images where there are none.
    pub(super) fn calibration(&self, path: &Path) -> Result<Calibration, FormatError> {
        let fail = |message: String| FormatError::whole(path, message);
        let mut calibration = Calibration::default();
        let mut cameras = HashMap::new();
        for camera in &self.cameras {
            let (k, lens) = camera::lens_from_colmap(&camera.model, &camera.params)
                .map_err(|error| fail(format!("camera {}: {error}", camera.id)))?;
            let mut record = CameraRecord::new(camera.id.to_string(), PixelCenter::Half);
            (record.size, record.k, record.lens) = (Some(camera.size), Some(k), lens);
            if cameras.insert(camera.id, record).is_some() {
                return Err(fail(format!("camera {} is there twice", camera.id)));
            }
        }
        let placed = self.poses_from_frames(&fail)?;
        for image in &self.images {
            let Some(camera) = cameras.get(&image.camera) else {
                return Err(fail(format!(
                    "image {}: there is no camera {}",
                    image.id, image.camera
                )));
            };
            let mut record = camera.clone();
            record.name.clone_from(&image.name);
            record.image = Some(image.name.clone());
            // What an image says of itself are the same numbers, but for rounding, where it is not out of date.
            let own = pose(&image.pose);
            let (placed, mount) = placed
                .get(&image.id)
                .cloned()
                .unwrap_or_else(|| (own.clone(), None));
            record.pose = Some(if poses_equal(&own, &placed) {
                own
            } else {
                placed
            });
            record.mount = mount;
            calibration.records.push(record);
        }
        if self.images.is_empty() {
            let ids = self
                .cameras
                .iter()
                .filter_map(|camera| cameras.remove(&camera.id));
            calibration.records = ids.collect();
        }
        Ok(calibration)
    }

    /// The poses that rigs and frames give, by image: they are what counts where they are. Rigs of one camera are none.
    fn poses_from_frames(
        &self,
        fail: &dyn Fn(String) -> FormatError,
    ) -> Result<HashMap<u32, (Pose, Option<RigMount>)>, FormatError> {
        let rigs: HashMap<u32, &Rig> = self.rigs.iter().map(|rig| (rig.id, rig)).collect();
        let mut placed = HashMap::new();
        for frame in &self.frames {
            let rig = rigs
                .get(&frame.rig)
                .ok_or_else(|| fail(format!("frames: there is no rig {}", frame.rig)))?;
            let body = pose(&frame.pose);
            for &(camera, image) in &frame.images {
                let Some((_, from_rig)) = rig.cameras.iter().find(|(id, _)| *id == camera) else {
                    return Err(fail(format!(
                        "frames: rig {} has no camera {camera}",
                        rig.id
                    )));
                };
                let here = from_rig
                    .as_ref()
                    .map_or_else(|| body.clone(), |from_rig| pose(from_rig).compose(&body));
                let mount = (rig.cameras.len() > 1).then(|| RigMount {
                    rig: rig.id.to_string(),
                    frame: frame.id.to_string(),
                    name: camera.to_string(),
                    camera: from_rig.as_ref().map_or_else(Pose::identity, pose),
                    body: body.clone(),
                });
                placed.insert(image, (here, mount));
            }
        }
        Ok(placed)
    }

    /// The model of cameras; equal intrinsics become one camera, but on a rig, where each camera is its own.
    pub(super) fn from_records(records: &[CameraRecord]) -> Result<Self, FormatError> {
        let mut model = Self::default();
        let mut owners: Vec<Option<(&str, &str)>> = Vec::new();
        for (i, record) in records.iter().enumerate() {
            let k = record.k_with(PixelCenter::Half, "COLMAP")?;
            let (name, params) = camera::colmap_from_lens(k, &record.lens).map_err(|error| {
                FormatError::Encode(format!("camera {:?}: {error}", record.name))
            })?;
            let mut camera = ColmapCamera {
                id: 0,
                model: name.into(),
                size: record.require_size("COLMAP")?,
                params,
            };
            let owner = record.mount.as_ref().map(|m| (&m.rig[..], &m.name[..]));
            let same = |(other, its): (&ColmapCamera, &Option<_>)| {
                *its == owner
                    && (&other.model, other.size, &other.params)
                        == (&camera.model, camera.size, &camera.params)
            };
            let id = match model.cameras.iter().zip(&owners).position(same) {
                Some(other) => other as u32 + 1,
                None => {
                    camera.id = model.cameras.len() as u32 + 1;
                    model.cameras.push(camera);
                    owners.push(owner);
                    model.cameras.len() as u32
                }
            };
            let image = record.image.as_ref().unwrap_or(&record.name);
            if image.is_empty() || image.contains(char::is_whitespace) || image.contains('\0') {
                return Err(record.unsupported_error(
                    "COLMAP",
                    &format!("the image name {image:?}: it has spaces or is empty"),
                ));
            }
            let (rotation, t) = record.require_pose()?.r_t();
            let [w, x, y, z] = rotation.quaternion();
            model.images.push(ColmapImage {
                id: i as u32 + 1,
                pose: [w, x, y, z, t.x, t.y, t.z],
                camera: id,
                name: image.clone(),
            });
        }
        model.add_rigs_and_frames(records)?;
        Ok(model)
    }
}

// Rigs and frames of what is written -----------------------------------------------------------------------

fn rigid(pose: &Pose) -> RigidPose {
    let (rotation, t) = pose.r_t();
    let [w, x, y, z] = rotation.quaternion();
    [w, x, y, z, t.x, t.y, t.z]
}

impl Reconstruction {
    /// Gives every image its frame, and every camera its rig: COLMAP's rigs have the axes of their first camera.
    fn add_rigs_and_frames(&mut self, records: &[CameraRecord]) -> Result<(), FormatError> {
        let mut rigs: Vec<(&str, Placed<'_>)> = Vec::new();
        let mut frames: Vec<(&str, &str, Frame)> = Vec::new();
        for (image, record) in self.images.iter().zip(records) {
            let Some(mount) = &record.mount else { continue };
            let known = rigs.iter().position(|(name, _)| *name == mount.rig);
            let rig = known.unwrap_or_else(|| {
                rigs.push((&mount.rig, Placed::default()));
                rigs.len() - 1
            });
            let sensors = &mut rigs[rig].1;
            match sensors.iter().find(|(id, ..)| *id == image.camera) {
                None => sensors.push((image.camera, &mount.camera)),
                Some((_, pose)) if !poses_equal(pose, &mount.camera) => {
                    return Err(record.unsupported_error(
                        "COLMAP",
                        &format!(
                            "a rig whose camera {:?} stands here and there on it",
                            mount.name
                        ),
                    ));
                }
                Some(_) => {}
            }
            let reference = sensors[0].1;
            let same = |(rig, frame, _): &(&str, &str, Frame)| {
                (*rig, *frame) == (&mount.rig[..], &mount.frame[..])
            };
            let place = frames.iter().position(same).unwrap_or_else(|| {
                let body = match reference.is_identity() {
                    true => mount.body.clone(),
                    false => reference.compose(&mount.body),
                };
                let frame = Frame {
                    id: frames.len() as u32 + 1,
                    rig: rig as u32 + 1,
                    pose: rigid(&body),
                    images: vec![],
                };
                frames.push((&mount.rig, &mount.frame, frame));
                frames.len() - 1
            });
            let images = &mut frames[place].2.images;
            if images.iter().any(|(camera, _)| *camera == image.camera) {
                return Err(record.unsupported_error(
                    "COLMAP",
                    &format!("two pictures of one camera in the frame {:?}", mount.frame),
                ));
            }
            images.push((image.camera, image.id));
        }
        self.rigs = rigs
            .iter()
            .enumerate()
            .map(|(i, (_, sensors))| Rig {
                id: i as u32 + 1,
                cameras: from_first(sensors),
            })
            .collect();
        self.frames = frames.into_iter().map(|(_, _, frame)| frame).collect();
        // Every other camera is a rig of its own.
        let mut own = HashMap::new();
        for (image, record) in self.images.iter().zip(records) {
            if record.mount.is_some() {
                continue;
            }
            let rig = *own.entry(image.camera).or_insert_with(|| {
                let id = self.rigs.len() as u32 + 1;
                self.rigs.push(Rig {
                    id,
                    cameras: vec![(image.camera, None)],
                });
                id
            });
            self.frames.push(Frame {
                id: self.frames.len() as u32 + 1,
                rig,
                pose: image.pose,
                images: vec![(image.camera, image.id)],
            });
        }
        Ok(())
    }
}

/// Cameras, and their poses from the body.
type Placed<'a> = Vec<(u32, &'a Pose)>;

/// The same from the first camera, which has none.
fn from_first(sensors: &Placed<'_>) -> Vec<(u32, Option<RigidPose>)> {
    let Some((reference, rest)) = sensors.split_first() else {
        return vec![];
    };
    let back = reference.1.inverted();
    let from_rig = |(id, pose): &(u32, &Pose)| {
        let pose = match reference.1.is_identity() {
            true => (*pose).clone(),
            false => pose.compose(&back),
        };
        (*id, Some(rigid(&pose)))
    };
    let rest = rest.iter().map(from_rig);
    std::iter::once((reference.0, None)).chain(rest).collect()
}

/// Whether two poses are the same, but for rounding.
fn poses_equal(a: &Pose, b: &Pose) -> bool {
    let ((r, c), (r2, c2)) = (a.r_c(), b.r_c());
    let off = (r - r2)
        .to_cols_array()
        .into_iter()
        .fold(0.0, |m: f64, v| m.max(v.abs()));
    off <= 1e-9 && (c - c2).length() <= 1e-9 * (1.0 + c.length())
}
