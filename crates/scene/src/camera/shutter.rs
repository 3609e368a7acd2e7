//! Motion of a camera while its shutter is open: motion blur and rolling shutter.

use glam::{DMat3, DQuat, DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Result, SceneError};
use crate::math::hermite::Interpolate;

/// Order in which a sensor is read, line by line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Readout")]
pub enum ReadoutDirection {
    /// Rows, beginning with the top row.
    #[default]
    Down,
    /// Rows, beginning with the bottom row.
    Up,
    /// Columns, beginning with the left column.
    Right,
    /// Columns, beginning with the right column.
    Left,
}

/// Pose of a camera or body: rotation and centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// camera_from_world.
    pub r: DMat3,
    /// Centre in the world.
    pub c: DVec3,
}

impl Pose {
    /// The pose at the origin, with the axes of the world.
    pub const IDENTITY: Self = Self { r: DMat3::IDENTITY, c: DVec3::ZERO };

    /// Returns the world pose of a part that is mounted on a body with this pose; `mount` is the part's pose in the
    /// axes of the body.
    pub fn compose(&self, mount: &Self) -> Self {
        Self { r: mount.r * self.r, c: self.c + self.r.transpose() * mount.c }
    }
}

/// Number of straight steps that approximate a path.
const PATH_STEPS: u32 = 32;

/// Shutter, and the camera's path while it is open. Times are in seconds from the opening of the first line.
///
/// Lines open one after the other, the first at 0 and the last shortly before `readout`; each stays open for
/// `exposure`. The line at the fraction f of the image's height (or width) is open from `f readout` to `f readout +
/// exposure`. A pixel's ground truth belongs to the middle of its line's exposure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShutterMotion {
    exposure: f64,
    readout: f64,
    direction: ReadoutDirection,
    /// Poses in order of time.
    poses: Vec<(f64, Pose)>,
    /// Mount of the camera, if `poses` are the poses of a body: camera_from_body, and the camera's centre in the body's
    /// axes.
    camera_from_body: Option<Pose>,
}

impl ShutterMotion {
    /// Creates a motion from poses at times. Between two poses, the centre moves along a line and the rotation along
    /// the shortest arc at constant speed (Shoemake, "Animating rotation with quaternion curves", 1985). Before the
    /// first and after the last pose, the camera does not move.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if exposure or readout is negative or not finite, if times are not in order, or if there
    /// are no poses.
    pub fn new(exposure: f64, readout: f64, direction: ReadoutDirection, poses: Vec<(f64, Pose)>) -> Result<Self> {
        let fail = |message: String| Err(SceneError::camera(message));
        for (name, time) in [("exposure", exposure), ("readout", readout)] {
            if !(time >= 0.0 && time.is_finite()) {
                return fail(format!("{name} is {time}; expected a finite number of seconds >= 0"));
            }
        }
        if poses.is_empty() {
            return fail("no poses for a moving camera; expected at least one".into());
        }
        if let Some((time, _)) = poses.iter().find(|(time, _)| !time.is_finite()) {
            return fail(format!("pose at {time} s; expected a finite time"));
        }
        if let Some(pair) = poses.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
            return fail(format!(
                "pose at {} s follows a pose at {} s; expected increasing times",
                pair[1].0, pair[0].0
            ));
        }
        Ok(Self { exposure, readout, direction, poses, camera_from_body: None })
    }

    /// Returns the motion of a camera that the moving body carries.
    pub fn with_camera_from_body(self, mount: Pose) -> Self {
        Self { camera_from_body: Some(mount), ..self }
    }

    /// True if the camera does not move: only moving objects are blurred during the exposure.
    pub fn is_static(&self) -> bool {
        self.poses.len() == 1
    }

    /// Returns the same shutter along another path. `way` returns the pose at a time relative to the middle of the
    /// exposures; the path is approximated by `PATH_STEPS` straight steps.
    ///
    /// # Errors
    /// Errors of the path.
    pub fn resampled(&self, way: impl Fn(f64) -> Result<Pose>) -> Result<Self> {
        let whole = self.total_duration();
        let steps = if whole > 0.0 { PATH_STEPS } else { 0 };
        let pose = |step: u32| {
            let time = whole * f64::from(step) / f64::from(steps.max(1));
            Ok((time, way(time - 0.5 * whole)?))
        };
        let poses = (0..=steps).map(pose).collect::<Result<_>>()?;
        let moving = Self::new(self.exposure, self.readout, self.direction, poses)?;
        Ok(Self { camera_from_body: self.camera_from_body, ..moving })
    }

    /// Time until the last line closes, in seconds.
    pub fn total_duration(&self) -> f64 {
        self.readout + self.exposure
    }

    /// Camera on the body whose poses are [`ShutterMotion::poses`]; `None` if they are the camera's own.
    pub fn camera_from_body(&self) -> Option<&Pose> {
        self.camera_from_body.as_ref()
    }

    /// Exposure time of a line, in seconds.
    pub fn exposure(&self) -> f64 {
        self.exposure
    }

    /// Readout time from the first line to the last, in seconds.
    pub fn readout(&self) -> f64 {
        self.readout
    }

    /// Order in which the lines are read.
    pub fn direction(&self) -> ReadoutDirection {
        self.direction
    }

    /// Times in seconds, and the poses of the camera, or of the body that carries it.
    pub fn poses(&self) -> &[(f64, Pose)] {
        &self.poses
    }

    /// Returns the same motion with each pose replaced by the result of `moved`.
    pub fn map_poses(&self, moved: impl Fn(&Pose) -> Pose) -> Self {
        let poses = self.poses.iter().map(|(time, pose)| (*time, moved(pose)));
        Self { poses: poses.collect(), ..self.clone() }
    }

    /// Pose of the camera in the middle of all exposures, which is a moving camera's nominal pose.
    pub fn mid_exposure_pose(&self) -> Pose {
        self.pose_at(0.5 * self.total_duration())
    }

    /// Pose of the camera at a time.
    pub fn pose_at(&self, time: f64) -> Pose {
        let pose = self.body_pose(time);
        self.camera_from_body.map_or(pose, |mount| pose.compose(&mount))
    }

    /// Pose at a time of the body that carries the camera, or of the camera itself.
    fn body_pose(&self, time: f64) -> Pose {
        let next = self.poses.partition_point(|(key, _)| *key <= time);
        let Some(before) = next.checked_sub(1) else {
            return self.poses.first().map_or(Pose::IDENTITY, |first| first.1);
        };
        let (start, from) = self.poses[before];
        let Some(&(end, to)) = self.poses.get(next) else { return from };
        let s = (time - start) / (end - start);
        if s == 0.0 {
            return from;
        }
        // The rotation is computed relative to the first pose, so that a zero rotation keeps the pose exactly.
        let turn = DQuat::from_mat3(&(to.r * from.r.transpose()));
        let part = DQuat::IDENTITY.offset_by(DQuat::IDENTITY.delta_to(turn) * s);
        Pose { r: DMat3::from_quat(part) * from.r, c: from.c + s * (to.c - from.c) }
    }

    /// Time at a fraction of the exposure of a pixel's line; 0.5 is the middle. `pixel` is relative to the image's
    /// corner; beyond the edges, the time of the edge is returned.
    pub fn line_time(&self, pixel: DVec2, size: [u32; 2], part: f64) -> f64 {
        self.line_fraction(pixel, size) * self.readout + part * self.exposure
    }

    /// Position of a pixel's line in the order of readout, from 0 to 1.
    pub fn line_fraction(&self, pixel: DVec2, size: [u32; 2]) -> f64 {
        let [width, height] = size.map(f64::from);
        let (x, y) = (pixel.x / width, pixel.y / height);
        let line = match self.direction {
            ReadoutDirection::Down => y,
            ReadoutDirection::Up => 1.0 - y,
            ReadoutDirection::Right => x,
            ReadoutDirection::Left => 1.0 - x,
        };
        line.clamp(0.0, 1.0)
    }
}
