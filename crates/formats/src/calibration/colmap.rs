//! COLMAP's model: what its text and its binary files say alike. Source: COLMAP's documentation, "Output Format", and
//! `scene/reconstruction_io_text.cc`; the centre of the first pixel is (0.5, 0.5), poses are camera from world.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;
use raycam_scene::{PixelCenter, camera};

use super::{Calibration, Pose, Record, Rotation};
use crate::error::FormatError;

/// Quaternion w x y z, translation x y z.
pub(super) type Rigid = [f64; 7];

/// A row of `cameras`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Camera {
    pub(super) id: u32,
    pub(super) model: String,
    pub(super) size: [u32; 2],
    pub(super) params: Vec<f64>,
}

/// A row of `images`.
pub(super) struct Image {
    pub(super) id: u32,
    pub(super) pose: Rigid,
    pub(super) camera: u32,
    pub(super) name: String,
}

/// A row of `rigs`: its cameras, each with its pose from the rig, nothing for the one that is the rig's origin.
pub(super) struct Rig {
    pub(super) id: u32,
    pub(super) cameras: Vec<(u32, Option<Rigid>)>,
}

/// A row of `frames`: where a rig stood, and its images.
pub(super) struct Frame {
    pub(super) rig: u32,
    pub(super) pose: Rigid,
    /// Camera and image.
    pub(super) images: Vec<(u32, u32)>,
}

/// A model, without its points.
#[derive(Default)]
pub(super) struct Model {
    pub(super) cameras: Vec<Camera>,
    pub(super) images: Vec<Image>,
    pub(super) rigs: Vec<Rig>,
    pub(super) frames: Vec<Frame>,
}

fn pose(rigid: &Rigid) -> Pose {
    let [w, x, y, z, tx, ty, tz] = *rigid;
    Pose::camera_from_world(Rotation::Quaternion([w, x, y, z]), DVec3::new(tx, ty, tz))
}

/// Whether its numbers are a pose.
pub(super) fn is_rigid(rigid: &Rigid) -> bool {
    rigid.iter().all(|v| v.is_finite()) && rigid[..4].iter().map(|v| v * v).sum::<f64>() > 1e-12
}

impl Model {
    /// The cameras of the images, or those without images where there are none.
    pub(super) fn calibration(&self, path: &Path) -> Result<Calibration, FormatError> {
        let fail = |message: String| FormatError::whole(path, message);
        let mut calibration = Calibration::default();
        let mut cameras = HashMap::new();
        for camera in &self.cameras {
            let (k, lens) = camera::lens_from_colmap(&camera.model, &camera.params)
                .map_err(|error| fail(format!("camera {}: {error}", camera.id)))?;
            let mut record = Record::new(camera.id.to_string(), PixelCenter::Half);
            (record.size, record.k, record.lens) = (Some(camera.size), Some(k), lens);
            if cameras.insert(camera.id, record).is_some() {
                return Err(fail(format!("camera {} is there twice", camera.id)));
            }
        }
        let placed = self.placed(&fail)?;
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
            record.pose = Some(
                placed
                    .get(&image.id)
                    .cloned()
                    .unwrap_or_else(|| pose(&image.pose)),
            );
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

    /// The poses that rigs and frames give, by image: they are what counts where they are.
    fn placed(
        &self,
        fail: &dyn Fn(String) -> FormatError,
    ) -> Result<HashMap<u32, Pose>, FormatError> {
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
                    .map_or_else(|| body.clone(), |from_rig| pose(from_rig).after(&body));
                placed.insert(image, here);
            }
        }
        Ok(placed)
    }

    /// The model of cameras; equal intrinsics become one camera.
    pub(super) fn of(records: &[Record]) -> Result<Self, FormatError> {
        let mut model = Self::default();
        for (i, record) in records.iter().enumerate() {
            let k = record.k_with(PixelCenter::Half, "COLMAP")?;
            let (name, params) = camera::colmap_from_lens(k, &record.lens)
                .map_err(|error| record.cannot("COLMAP", &error.to_string()))?;
            let mut camera = Camera {
                id: 0,
                model: name.into(),
                size: record.need_size("COLMAP")?,
                params,
            };
            let same = |other: &&Camera| {
                (&other.model, other.size, &other.params)
                    == (&camera.model, camera.size, &camera.params)
            };
            let id = match model.cameras.iter().find(same) {
                Some(other) => other.id,
                None => {
                    camera.id = model.cameras.len() as u32 + 1;
                    model.cameras.push(camera);
                    model.cameras.len() as u32
                }
            };
            let image = record.image.as_ref().unwrap_or(&record.name);
            if image.is_empty() || image.contains(char::is_whitespace) || image.contains('\0') {
                return Err(record.cannot(
                    "COLMAP",
                    &format!("the image name {image:?}: it has spaces or is empty"),
                ));
            }
            let (rotation, t) = record.need_pose()?.r_t();
            let [w, x, y, z] = rotation.quaternion();
            model.images.push(Image {
                id: i as u32 + 1,
                pose: [w, x, y, z, t.x, t.y, t.z],
                camera: id,
                name: image.clone(),
            });
        }
        Ok(model)
    }
}
