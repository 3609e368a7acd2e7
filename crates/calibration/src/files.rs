//! Calibration files: contents after reading, hints for reading, and files to write.

use std::path::Path;

use raycam_scene::{LensModel, Notice, NoticeCode};

use crate::CameraRecord;
use raycam_formats::{FormatError, Result};

/// Contents of a file or folder of cameras.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Calibration {
    /// Cameras in file order.
    pub records: Vec<CameraRecord>,
    /// Notices about everything that was omitted or repaired.
    pub notices: Vec<Notice>,
    /// True if the file contains the poses of a body, and its reader has reported how the mount was used.
    pub poses_of_body: bool,
    /// True if the reader has used the direction and axes of poses that the caller specified.
    pub(crate) used_convention: bool,
}

/// Creates a notice about the cameras with these names.
pub(crate) fn about_cameras<'a>(
    code: NoticeCode,
    names: impl ExactSizeIterator<Item = &'a str>,
    message: impl Into<String>,
) -> Notice {
    Notice::about_all(code, names.map(|name| format!("camera {name:?}")), message)
}

/// Notice about cameras, by name, whose matrix differs from a rotation by this amount.
pub(crate) fn notice_of_repairs(repaired: &[(String, f64)]) -> Option<Notice> {
    let most = repaired.iter().map(|(_, off)| *off).reduce(f64::max)?;
    let message = format!("R differs from a rotation by up to {most:.1e}; the nearest rotation is used");
    Some(about_cameras(NoticeCode::RepairedRotation, repaired.iter().map(|(name, _)| name.as_str()), message))
}

impl Calibration {
    pub(crate) fn note(&mut self, code: NoticeCode, message: impl Into<String>) {
        self.notices.push(Notice::new(code, message));
    }

    /// Adds a notice about `subject`, such as a key or a camera; notices with the same message are grouped at the end.
    pub(crate) fn note_about(&mut self, code: NoticeCode, subject: impl Into<String>, message: impl Into<String>) {
        self.notices.push(Notice::about(code, subject, message));
    }
}

/// Direction and camera axes of a file's poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PoseConvention {
    /// True for world_from_camera, false for camera_from_world.
    pub(crate) world_from_camera: bool,
    /// True for OpenGL's axes (x right, y up, z backward), false for OpenCV's.
    pub(crate) opengl: bool,
}

/// Direction and camera axes of the poses, as far as the caller specifies them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoseHints {
    /// True for world_from_camera, false for camera_from_world; None if the caller does not specify it.
    pub world_from_camera: Option<bool>,
    /// True for OpenGL's axes (x right, y up, z backward), false for OpenCV's; None if the caller does not specify them.
    pub opengl: Option<bool>,
}

impl PoseHints {
    /// True if the caller specifies neither direction nor axes.
    pub(crate) fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// Returns the convention of poses with this direction; OpenCV's axes unless the caller specifies the axes.
    pub(crate) fn directed(self, world_from_camera: bool) -> PoseConvention {
        PoseConvention { world_from_camera, opengl: self.opengl.unwrap_or(false) }
    }
}

/// Data that a file may lack: trajectories have no intrinsics, some files no image size.
#[derive(Clone, Debug, Default)]
pub struct ReadHints {
    /// Image size (columns, rows), for files without one.
    pub size: Option<[u32; 2]>,
    /// Camera that provides size, K and lens, for files that contain only poses.
    pub intrinsics: Option<CameraRecord>,
    /// Lens model of the coefficients, if the file does not specify it.
    pub lens: Option<LensModel>,
    /// Direction and axes of poses, if the file does not specify them.
    pub poses: PoseHints,
}

/// Files of a calibration that are to be written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OutputFiles {
    /// For each file, its name relative to the path of the calibration (empty for that path itself), and its bytes.
    pub files: Vec<(String, Vec<u8>)>,
    /// Notices about values that the format stores differently, or cannot store.
    pub notices: Vec<Notice>,
}

impl OutputFiles {
    /// Creates a single file at the path of the calibration.
    pub(crate) fn one(text: String) -> Self {
        Self { files: vec![(String::new(), text.into_bytes())], notices: vec![] }
    }
}

impl ReadHints {
    /// Fills in data that a camera's file lacks, and validates the camera.
    pub(crate) fn fill_missing(&self, record: &mut CameraRecord, path: &Path) -> Result<()> {
        if let (None, None, Some(intrinsics)) = (record.k, record.matrix, &self.intrinsics) {
            record.k = intrinsics.k;
            record.lens = intrinsics.lens.clone();
            record.size = intrinsics.size;
            record.pixel_center = intrinsics.pixel_center;
        }
        if record.size.is_none() {
            record.size = self.size;
        }
        let model = record.lens.coefficients().map(|(model, _)| model);
        if let Some(lens) = self.lens
            && model != Some(lens)
            && !(model.is_none() && lens == LensModel::OpenCv)
        {
            return Err(FormatError::whole(
                path,
                format!(
                    "camera {:?} has lens model {:?} in its file, but lens is {:?}; omit lens, which is only for files \
                     that do not specify a lens model",
                    record.name,
                    model.map_or("pinhole", LensModel::name),
                    lens.name()
                ),
            ));
        }
        if record.size.is_some() && (record.k.is_some() || record.matrix.is_some()) {
            let mut check = record.clone();
            check.orthonormalize();
            check.camera().map_err(|error| FormatError::whole(path, format!("camera {:?}: {error}", record.name)))?;
        }
        Ok(())
    }
}
