//! Conversion between COLMAP's reconstruction, without its points, and camera records.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use raycam_scene::{PixelCenter, camera};

use crate::rig_mount::RigMount;
use crate::{Calibration, CameraRecord, Pose, Rotation};
use raycam_formats::{FormatError, Result};

/// A pose: quaternion w x y z, then translation x y z.
pub(crate) type RigidPose = [f64; 7];

/// A row of `cameras`: the intrinsics of one or several images.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ColmapCamera {
    pub(crate) id: u32,
    pub(crate) model: String,
    pub(crate) size: [u32; 2],
    pub(crate) params: Vec<f64>,
}

/// A row of `images`: the pose of an image (camera from world), and its camera.
pub(crate) struct ColmapImage {
    pub(crate) id: u32,
    pub(crate) pose: RigidPose,
    pub(crate) camera: u32,
    pub(crate) name: String,
}

/// Row of `rigs`: its cameras, each with its pose (camera from rig); the pose is `None` for the camera that defines the
/// rig's axes.
pub(crate) struct Rig {
    pub(crate) id: u32,
    pub(crate) cameras: Vec<(u32, Option<RigidPose>)>,
    /// Cameras of the rig without a pose in `rigs`; their images use the poses of `images`.
    pub(crate) unplaced: Vec<u32>,
}

/// Row of `frames`: the pose of a rig, and its images.
pub(crate) struct Frame {
    pub(crate) id: u32,
    pub(crate) rig: u32,
    pub(crate) pose: RigidPose,
    /// For each image of the frame, the id of its camera and its own id.
    pub(crate) images: Vec<(u32, u32)>,
}

/// A reconstruction of COLMAP (its "model") without the points.
#[derive(Default)]
pub(crate) struct Reconstruction {
    pub(crate) cameras: Vec<ColmapCamera>,
    pub(crate) images: Vec<ColmapImage>,
    pub(crate) rigs: Vec<Rig>,
    pub(crate) frames: Vec<Frame>,
}

fn pose(rigid: &RigidPose) -> Pose {
    let [w, x, y, z, tx, ty, tz] = *rigid;
    Pose::camera_from_world(Rotation::Quaternion([w, x, y, z]), DVec3::new(tx, ty, tz))
}

/// True if all components are finite and the quaternion is not 0.
pub(crate) fn is_rigid(rigid: &RigidPose) -> bool {
    rigid.iter().all(|v| v.is_finite()) && rigid[..4].iter().map(|v| v * v).sum::<f64>() > 1e-12
}

impl Reconstruction {
    /// Returns a camera for every image or, if there are no images, every camera of `cameras`.
    pub(crate) fn calibration(&self, path: &Path) -> Result<Calibration> {
        let fail = |message: String| FormatError::whole(path, message);
        let mut calibration = Calibration::default();
        let mut cameras = HashMap::new();
        for camera in &self.cameras {
            let (k, lens) = camera::lens_from_colmap(&camera.model, &camera.params)
                .map_err(|error| fail(format!("camera {}: {error}", camera.id)))?;
            let mut record = CameraRecord::new(camera.id.to_string(), PixelCenter::Half);
            (record.size, record.k, record.lens) = (Some(camera.size), Some(k), lens);
            if cameras.insert(camera.id, record).is_some() {
                return Err(fail(format!("camera {} is defined twice", camera.id)));
            }
        }
        let placed = self.poses_from_frames(&fail)?;
        for image in &self.images {
            let Some(camera) = cameras.get(&image.camera) else {
                return Err(fail(format!("image {}: unknown camera {}", image.id, image.camera)));
            };
            let mut record = camera.clone();
            record.name.clone_from(&image.name);
            record.image = Some(image.name.clone());
            // If the image's own pose is equal up to rounding, it is kept, because it has the file's exact digits.
            let own = pose(&image.pose);
            let (placed, mount) = placed.get(&image.id).cloned().unwrap_or_else(|| (own.clone(), None));
            record.pose = Some(if poses_equal(&own, &placed) { own } else { placed });
            record.mount = mount;
            calibration.records.push(record);
        }
        if self.images.is_empty() {
            let ids = self.cameras.iter().filter_map(|camera| cameras.remove(&camera.id));
            calibration.records = ids.collect();
        }
        Ok(calibration)
    }

    /// Poses of the images and mounts of their cameras, according to rigs and frames, by image id. These poses take
    /// precedence over the poses in `images`. A rig with one camera does not define a mount.
    fn poses_from_frames(
        &self,
        fail: &dyn Fn(String) -> FormatError,
    ) -> Result<HashMap<u32, (Pose, Option<RigMount>)>> {
        let rigs: HashMap<u32, &Rig> = self.rigs.iter().map(|rig| (rig.id, rig)).collect();
        let mut placed = HashMap::new();
        for frame in &self.frames {
            let rig = rigs.get(&frame.rig).ok_or_else(|| fail(format!("frames: unknown rig {}", frame.rig)))?;
            let body = pose(&frame.pose);
            for &(camera, image) in &frame.images {
                let Some((_, from_rig)) = rig.cameras.iter().find(|(id, _)| *id == camera) else {
                    if rig.unplaced.contains(&camera) {
                        continue;
                    }
                    return Err(fail(format!("frames: rig {} has no camera {camera}", rig.id)));
                };
                let here = from_rig.as_ref().map_or_else(|| body.clone(), |from_rig| pose(from_rig).compose(&body));
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

    /// Converts camera records to a model. Equal intrinsics are merged into one camera, except on rigs, where each
    /// camera stays separate.
    pub(crate) fn from_records(records: &[CameraRecord], names_fit: impl Fn(&str) -> bool) -> Result<Self> {
        let mut model = Self::default();
        let mut owners: Vec<Option<(&str, &str)>> = Vec::new();
        for (i, record) in records.iter().enumerate() {
            let k = record.k_with(PixelCenter::Half, "COLMAP")?;
            let (name, params) = camera::colmap_from_lens(k, &record.lens)
                .map_err(|error| FormatError::encode(format!("camera {:?}: {error}", record.name)))?;
            let mut camera = ColmapCamera { id: 0, model: name.into(), size: record.require_size("COLMAP")?, params };
            let owner = record.mount.as_ref().map(|m| (&m.rig[..], &m.name[..]));
            let same = |(other, its): (&ColmapCamera, &Option<_>)| {
                *its == owner
                    && (&other.model, other.size, &other.params) == (&camera.model, camera.size, &camera.params)
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
            if image.is_empty() || !names_fit(image) {
                return Err(record.unsupported_error(
                    "COLMAP",
                    &format!(
                        "the image name {image:?}, which is empty or contains spaces; use format colmap-binary, which \
                        allows spaces"
                    ),
                ));
            }
            model.images.push(ColmapImage {
                id: i as u32 + 1,
                pose: rigid(&record.require_pose()?),
                camera: id,
                name: image.clone(),
            });
        }
        model.add_rigs_and_frames(records)?;
        Ok(model)
    }
}

impl Reconstruction {
    /// Adds a frame for every image and a rig for every camera. The axes of a rig are the axes of its first camera.
    fn add_rigs_and_frames(&mut self, records: &[CameraRecord]) -> Result<()> {
        let mut rigs: Vec<(&str, Vec<PosedCamera<'_>>)> = Vec::new();
        let mut frames: Vec<(&str, &str, Frame)> = Vec::new();
        for (image, record) in self.images.iter().zip(records) {
            let Some(mount) = &record.mount else { continue };
            let known = rigs.iter().position(|(name, _)| *name == mount.rig);
            let rig = known.unwrap_or_else(|| {
                rigs.push((&mount.rig, Vec::new()));
                rigs.len() - 1
            });
            let cameras = &mut rigs[rig].1;
            add_rig_camera(cameras, image.camera, record, mount)?;
            let reference = cameras[0].1;
            let same = |(rig, frame, _): &(&str, &str, Frame)| (*rig, *frame) == (&mount.rig[..], &mount.frame[..]);
            let frame = frames.iter().position(same).unwrap_or_else(|| {
                let body = match reference.is_identity() {
                    true => mount.body.clone(),
                    false => reference.compose(&mount.body),
                };
                let frame =
                    Frame { id: frames.len() as u32 + 1, rig: rig as u32 + 1, pose: rigid(&body), images: vec![] };
                frames.push((&mount.rig, &mount.frame, frame));
                frames.len() - 1
            });
            let images = &mut frames[frame].2.images;
            if images.iter().any(|(camera, _)| *camera == image.camera) {
                return Err(record.unsupported_error(
                    "COLMAP",
                    &format!("two images of one camera in the frame {:?}; expected one image per camera", mount.frame),
                ));
            }
            images.push((image.camera, image.id));
        }
        let rigs = rigs.iter().enumerate().map(|(i, (_, cameras))| Rig {
            id: i as u32 + 1,
            cameras: poses_from_reference(cameras),
            unplaced: vec![],
        });
        self.rigs = rigs.collect();
        self.frames = frames.into_iter().map(|(_, _, frame)| frame).collect();
        self.add_single_camera_rigs(records);
        Ok(())
    }

    /// Adds a rig for each camera that does not belong to a rig, and a frame for each image of this camera.
    fn add_single_camera_rigs(&mut self, records: &[CameraRecord]) {
        let mut rig_of_camera = HashMap::new();
        for (image, record) in self.images.iter().zip(records) {
            if record.mount.is_some() {
                continue;
            }
            let rig = *rig_of_camera.entry(image.camera).or_insert_with(|| {
                let id = self.rigs.len() as u32 + 1;
                self.rigs.push(Rig { id, cameras: vec![(image.camera, None)], unplaced: vec![] });
                id
            });
            self.frames.push(Frame {
                id: self.frames.len() as u32 + 1,
                rig,
                pose: image.pose,
                images: vec![(image.camera, image.id)],
            });
        }
    }
}

/// Id of a camera, and its pose relative to the body of its rig.
type PosedCamera<'a> = (u32, &'a Pose);

/// Adds a camera to a rig, unless the rig already contains the camera; returns an error if the camera has a different
/// pose in the rig.
fn add_rig_camera<'a>(
    cameras: &mut Vec<PosedCamera<'a>>,
    camera: u32,
    record: &CameraRecord,
    mount: &'a RigMount,
) -> Result<()> {
    match cameras.iter().find(|(id, ..)| *id == camera) {
        None => cameras.push((camera, &mount.camera)),
        Some((_, pose)) if !poses_equal(pose, &mount.camera) => {
            return Err(record.unsupported_error(
                "COLMAP",
                &format!("several poses of camera {:?} on its rig; expected one pose", mount.name),
            ));
        }
        Some(_) => {}
    }
    Ok(())
}

/// Poses of a rig's cameras relative to its first camera, which is the reference and has no pose.
fn poses_from_reference(cameras: &[PosedCamera<'_>]) -> Vec<(u32, Option<RigidPose>)> {
    let Some((reference, rest)) = cameras.split_first() else { return vec![] };
    let back = reference.1.inverted();
    let from_reference = |(id, pose): &PosedCamera<'_>| {
        let pose = match reference.1.is_identity() {
            true => (*pose).clone(),
            false => pose.compose(&back),
        };
        (*id, Some(rigid(&pose)))
    };
    let rest = rest.iter().map(from_reference);
    std::iter::once((reference.0, None)).chain(rest).collect()
}

/// Converts a pose to a quaternion and a translation.
fn rigid(pose: &Pose) -> RigidPose {
    let (rotation, t) = pose.r_t();
    let [w, x, y, z] = rotation.quaternion();
    [w, x, y, z, t.x, t.y, t.z]
}

/// True if two poses are equal up to rounding.
fn poses_equal(a: &Pose, b: &Pose) -> bool {
    let ((r, c), (r2, c2)) = (a.r_c(), b.r_c());
    let off = (r - r2).to_cols_array().into_iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    off <= 1e-9 && (c - c2).length() <= 1e-9 * (1.0 + c.length())
}
