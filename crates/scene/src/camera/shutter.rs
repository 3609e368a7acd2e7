//! A camera that moves while its shutter is open: motion blur and rolling shutter.

use glam::{DMat3, DQuat, DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Result, SceneError};
use crate::math::hermite::Interpolate;

/// The way in which a sensor is read, line after line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Readout")]
pub enum ReadoutDirection {
    /// Rows, the top one first.
    #[default]
    Down,
    /// Rows, the bottom one first.
    Up,
    /// Columns, the left one first.
    Right,
    /// Columns, the right one first.
    Left,
}

/// A rotation and a centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// camera_from_world.
    pub r: DMat3,
    /// The centre in the world.
    pub c: DVec3,
}

impl Pose {
    /// At the origin, with the axes of the world.
    pub const IDENTITY: Self = Self { r: DMat3::IDENTITY, c: DVec3::ZERO };

    /// The pose in the world of something that this body carries; `mount` is its pose in the axes of the body.
    pub fn compose(&self, mount: &Self) -> Self {
        Self { r: mount.r * self.r, c: self.c + self.r.transpose() * mount.c }
    }
}

/// Steps in which a way is followed.
const PATH_STEPS: u32 = 32;

/// The shutter and the way of the camera while it is open. Times are in seconds from when the first line opens.
///
/// A line opens when it is its turn: the first at 0, the last a little before `readout`, and stays open for `exposure`.
/// A line at the fraction f of the image's height (or width) is open, at its middle, from `f readout` to
/// `f readout + exposure`. The ground truth of a pixel is that of the middle of its line's exposure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShutterMotion {
    exposure: f64,
    readout: f64,
    direction: ReadoutDirection,
    /// In order of time.
    poses: Vec<(f64, Pose)>,
    /// The camera on the body whose poses these are: camera_from_body, and its centre there.
    camera_from_body: Option<Pose>,
}

impl ShutterMotion {
    /// Poses at times; between two, the centre moves on a line and the rotation by the shortest way at constant speed
    /// (Shoemake, "Animating rotation with quaternion curves", 1985); before the first and after the last it stands.
    ///
    /// # Errors
    /// [`SceneError::Camera`] where exposure and readout are negative or not finite, times are not in order, or there
    /// are no poses.
    pub fn new(exposure: f64, readout: f64, direction: ReadoutDirection, poses: Vec<(f64, Pose)>) -> Result<Self> {
        let fail = |message: String| Err(SceneError::camera(message));
        for (name, time) in [("exposure", exposure), ("readout", readout)] {
            if !(time >= 0.0 && time.is_finite()) {
                return fail(format!("{name} is {time}: expected finite seconds >= 0"));
            }
        }
        if poses.is_empty() {
            return fail("a moving camera needs a pose at least".into());
        }
        if let Some((time, _)) = poses.iter().find(|(time, _)| !time.is_finite()) {
            return fail(format!("a pose at {time} s: expected a finite time"));
        }
        if let Some(pair) = poses.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
            return fail(format!(
                "a pose at {} s comes after one at {} s: expected poses in order of time",
                pair[1].0, pair[0].0
            ));
        }
        Ok(Self { exposure, readout, direction, poses, camera_from_body: None })
    }

    /// The motion of a camera that the moving body carries.
    pub fn with_camera_from_body(self, mount: Pose) -> Self {
        Self { camera_from_body: Some(mount), ..self }
    }

    /// True if the camera does not move: it is an exposure, in which moving objects are blurred.
    pub fn is_static(&self) -> bool {
        self.poses.len() == 1
    }

    /// The same shutter along a way, whose poses are those at a time from the middle of the exposures. It is followed
    /// in [`PATH_STEPS`] straight steps.
    ///
    /// # Errors
    /// The errors of the way.
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

    /// How long it takes until the last line closes, in seconds.
    pub fn total_duration(&self) -> f64 {
        self.readout + self.exposure
    }

    /// The camera on the body whose poses are [`ShutterMotion::poses`]; the camera itself if there is none.
    pub fn camera_from_body(&self) -> Option<&Pose> {
        self.camera_from_body.as_ref()
    }

    /// How long a line is open, in seconds.
    pub fn exposure(&self) -> f64 {
        self.exposure
    }

    /// How long it takes from the first line to the last, in seconds.
    pub fn readout(&self) -> f64 {
        self.readout
    }

    /// The order of the lines.
    pub fn direction(&self) -> ReadoutDirection {
        self.direction
    }

    /// Times in seconds, and where the camera, or the body that carries it, is then.
    pub fn poses(&self) -> &[(f64, Pose)] {
        &self.poses
    }

    /// The same for poses that something has moved.
    pub fn map_poses(&self, moved: impl Fn(&Pose) -> Pose) -> Self {
        let poses = self.poses.iter().map(|(time, pose)| (*time, moved(pose)));
        Self { poses: poses.collect(), ..self.clone() }
    }

    /// The middle of all exposures: the pose that a moving camera calls its own.
    pub fn mid_exposure_pose(&self) -> Pose {
        self.pose_at(0.5 * self.total_duration())
    }

    /// The pose of the camera at a time.
    pub fn pose_at(&self, time: f64) -> Pose {
        let pose = self.body_pose(time);
        self.camera_from_body.map_or(pose, |mount| pose.compose(&mount))
    }

    /// The pose at a time of the body that carries the camera, or of the camera itself.
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
        // As a turn of the first pose, which a rotation of nothing leaves to the last digit.
        let turn = DQuat::from_mat3(&(to.r * from.r.transpose()));
        let part = DQuat::IDENTITY.offset_by(DQuat::IDENTITY.delta_to(turn) * s);
        Pose { r: DMat3::from_quat(part) * from.r, c: from.c + s * (to.c - from.c) }
    }

    /// When the line of a pixel is at a part of its exposure, 0.5 in the middle. `pixel` counts from the corner of the
    /// image; beyond its edges the time is that of the edge.
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
