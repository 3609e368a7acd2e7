//! Videos: orbits and keyframes, and the world at a time.

mod rig;
pub(crate) mod track;

use glam::{DMat3, DQuat, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use self::track::KeyframeInterpolation;
use self::track::Track;
use crate::camera::{Camera, Pose};
use crate::counted::counted;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::math::rotation;
use crate::up::Up;

/// Maximum number of frames in a video: more than nine hours at 30 frames per second.
pub const MAX_FRAMES: f64 = 1_000_000.0;

/// Moves the camera around the vertical axis through a target; the first frame equals the still image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "OrbitSpec")]
pub struct Orbit {
    /// Centre of the orbit.
    pub target: [f64; 3],
    /// Angle over the whole video in degrees, counter-clockwise as seen from above; default 360.
    #[serde(default = "full_turn")]
    pub degrees: f64,
}

fn full_turn() -> f64 {
    360.0
}

/// A `[video]` with resolved object names and keyframes in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Video {
    pub(crate) fps: f64,
    pub(crate) seconds: f64,
    pub(crate) up: Up,
    pub(crate) orbit: Option<Orbit>,
    pub(crate) camera: KeyframedMotion,
    /// Motions of objects, by object id.
    pub(crate) objects: Vec<(usize, KeyframedMotion)>,
    /// Motions of rigs, by the index of the rig.
    pub(crate) rigs: Vec<(usize, KeyframedMotion)>,
    /// Motions of cameras, by the index of the camera.
    pub(crate) cameras: Vec<(usize, KeyframedMotion)>,
}

/// Tracks of a moving camera, object or rig. Rotations are world_from_body, with body axes x forward, y left, z up.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeyframedMotion {
    pub(crate) location: Track<DVec3>,
    /// Roll, pitch and yaw in degrees. They are interpolated as numbers, so that 0 to 720 is two turns.
    pub(crate) angles: Track<DVec3>,
    /// Rotations of keyframes with matrices; they are interpolated along the shorter arc.
    pub(crate) rotation: Track<DQuat>,
    pub(crate) target: Track<DVec3>,
    /// Diagonal and off-diagonal elements (yz, xz, xy) of an object's stretch, which replaces its scale and shear.
    pub(crate) stretch: [Track<DVec3>; 2],
}

impl KeyframedMotion {
    /// The rotation world_from_body at a time, if keyframes specify it.
    pub(crate) fn rotation_at(&self, up: Up, time: f64) -> Option<DMat3> {
        if let Some(angles) = self.angles.evaluate(time) {
            return Some(
                rotation::world_from_reference(up) * rotation::rotation_from_rpy(angles.x, angles.y, angles.z),
            );
        }
        self.rotation.evaluate(time).map(DMat3::from_quat)
    }

    /// The stretch at a time, if keyframes specify it.
    pub(crate) fn stretch_at(&self, time: f64) -> Option<DMat3> {
        let [diagonal, rest] = &self.stretch;
        let (d, r) = (diagonal.evaluate(time)?, rest.evaluate(time)?);
        Some(DMat3::from_cols_array_2d(&[[d.x, r.z, r.y], [r.z, d.y, r.x], [r.y, r.x, d.z]]))
    }
}

impl Video {
    /// Checks that the video moves only objects, rigs and cameras with indices below these counts.
    ///
    /// # Errors
    /// [`SceneError`] if the video moves unknown parts, or if its length is zero or infinite.
    pub(crate) fn validate(&self, objects: usize, rigs: usize, cameras: usize) -> Result<()> {
        if let Some((id, _)) = self.cameras.iter().find(|(id, _)| *id >= cameras) {
            return Err(SceneError::World(ErrorCode::IndexOutOfRange.message(format!(
                "the video moves camera index {id}, but the world has {}",
                counted(cameras, "camera")
            ))));
        }
        if let Some((id, _)) = self.rigs.iter().find(|(id, _)| *id >= rigs) {
            return Err(SceneError::World(
                ErrorCode::IndexOutOfRange
                    .message(format!("the video moves rig index {id}, but the world has {}", counted(rigs, "rig"))),
            ));
        }
        if let Some((id, _)) = self.objects.iter().find(|(id, _)| *id >= objects) {
            return Err(SceneError::World(ErrorCode::IndexOutOfRange.message(format!(
                "the video moves object index {id}, but the world has {}",
                counted(objects, "object")
            ))));
        }
        check_length(self.fps, self.seconds)
    }

    /// Frames per second.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// Length in seconds.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Number of frames: `fps * seconds`, rounded to the nearest integer, but at least one.
    pub fn frame_count(&self) -> usize {
        ((self.fps * self.seconds).round() as usize).max(1)
    }

    /// Time of a frame in seconds: `frame / fps`, so that an orbit of 360 degrees repeats without a pause.
    pub fn time(&self, frame: usize) -> f64 {
        frame as f64 / self.fps
    }

    /// Returns the camera `base`, moved by the video to its pose at a time in seconds. If the world's camera `index`
    /// has its own keyframes, these move `base`; otherwise, the orbit or the keyframes of all cameras do. A camera
    /// without its own motion continues to move with the video while its shutter is open; the time is the middle of
    /// its motion.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if the camera would have to look straight up or down at its target.
    pub fn camera_at(&self, base: &Camera, index: Option<usize>, time: f64) -> Result<Camera> {
        let own = self.cameras.iter().find(|(id, _)| Some(*id) == index).map(|(_, motion)| motion);
        let moved = self.camera_pose(base, own, time)?;
        let still = own.is_none() && self.orbit.is_none() && self.camera == KeyframedMotion::default();
        let Some(shutter) = base.motion().filter(|shutter| shutter.is_static() && !still) else {
            return Ok(moved);
        };
        let motion = shutter.resampled(|since_middle| {
            let then = self.camera_pose(base, own, time + since_middle)?;
            Ok(Pose { r: then.r(), c: then.c() })
        })?;
        moved.with_motion(motion)
    }

    /// `base` moved by its own keyframes or, without these, by the orbit or the keyframes of all cameras.
    fn camera_pose(&self, base: &Camera, own: Option<&KeyframedMotion>, time: f64) -> Result<Camera> {
        if let Some(orbit) = self.orbit.as_ref().filter(|_| own.is_none()) {
            let angle = orbit.degrees * (time / self.seconds);
            if angle == 0.0 {
                return Ok(base.clone());
            }
            let turn = DMat3::from_axis_angle(self.up.axis(), angle.to_radians());
            let target = DVec3::from_array(orbit.target);
            let eye = target + turn * (base.c() - target);
            return base.at_pose(base.r() * turn.transpose(), eye);
        }
        let motion = own.unwrap_or(&self.camera);
        let location = motion.location.evaluate(time);
        let eye = location.unwrap_or(base.c());
        if let Some(target) = motion.target.evaluate(time) {
            let facing =
                Camera::look_at(eye, target, self.up.axis(), DMat3::IDENTITY, base.size(), base.pixel_center())?;
            return base.at_pose(facing.r(), eye);
        }
        match (motion.rotation_at(self.up, time), location) {
            (None, None) => Ok(base.clone()),
            (None, Some(eye)) => base.at_pose(base.r(), eye),
            (Some(world_from_body), _) => base.at_pose(rotation::CAMERA_FROM_BODY * world_from_body.transpose(), eye),
        }
    }
}

/// Checks the length of a video.
pub(crate) fn check_length(fps: f64, seconds: f64) -> Result<()> {
    if !(fps.is_finite() && fps > 0.0) {
        return Err(SceneError::schema(
            ErrorCode::OutOfRange,
            "fps",
            format!("{fps}; expected a finite number greater than 0"),
        ));
    }
    if !(seconds.is_finite() && seconds > 0.0 && fps * seconds <= MAX_FRAMES) {
        return Err(SceneError::schema(
            ErrorCode::OutOfRange,
            "seconds",
            format!("{seconds}; expected a number greater than 0, and at most {MAX_FRAMES} frames"),
        ));
    }
    Ok(())
}
