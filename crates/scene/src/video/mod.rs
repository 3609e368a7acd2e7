//! Videos: orbits and keyframes, and the world at a time.

mod rig;
pub(crate) mod track;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use self::track::Track;
use crate::camera::{Camera, Pose};
use crate::error::SceneError;
use crate::math::rotation;
use crate::schema::{KeyframeInterpolation, KeyframeSpec, OrbitSpec, VideoSpec};
pub use crate::world::at_time::WorldTime;
use crate::world::{Object, Up, World};

/// The most frames of a video: more than nine hours at 30 a second.
pub const MAX_FRAMES: f64 = 1_000_000.0;

/// A `[video]` whose object names are resolved and whose keyframes are in order.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Video {
    fps: f64,
    seconds: f64,
    up: Up,
    orbit: Option<OrbitSpec>,
    camera: KeyframedMotion,
    /// By object id.
    pub(crate) objects: Vec<(usize, KeyframedMotion)>,
    /// By the index of the rig.
    rigs: Vec<(usize, KeyframedMotion)>,
}

/// What keyframes say of one mover. `rotation` is world_from_body, body axes x forward, y left, z up.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct KeyframedMotion {
    location: Track<DVec3>,
    rotation: Track<DQuat>,
    target: Track<DVec3>,
}

impl Video {
    /// A video of this world.
    ///
    /// # Errors
    /// [`SceneError::Schema`] where keyframes of one mover are not in order of time, say nothing or contradict each
    /// other, an object is unknown, or values make no sense.
    pub fn new(spec: &VideoSpec, world: &World) -> Result<Self, SceneError> {
        let fail = |key: &str, message: String| Err(SceneError::schema(key, message));
        let mut camera = Mover::default();
        let mut objects: Vec<(usize, Mover)> = Vec::new();
        let mut rigs: Vec<(usize, Mover)> = Vec::new();
        for (i, key) in spec.keyframe.iter().enumerate() {
            let place = format!("keyframe[{i}]");
            let mover = match (&key.object, &key.rig) {
                (None, None) => &mut camera,
                (Some(name), None) => {
                    let id = world
                        .find_object(name)
                        .map_err(|error| error.in_context(&format!("{place}.object")))?;
                    mover_mut(&mut objects, id)
                }
                (None, Some(name)) => {
                    let id = world
                        .find_rig(name)
                        .map_err(|error| error.in_context(&format!("{place}.rig")))?;
                    mover_mut(&mut rigs, id)
                }
                (Some(_), Some(_)) => {
                    let message = "object is given too: expected one of the two".into();
                    return fail(&format!("{place}.rig"), message);
                }
            };
            mover
                .add(key, world.up, spec.interpolation)
                .map_err(|error| error.in_context(&place))?;
        }
        if spec.orbit.is_some() && camera.time.is_some() {
            return fail(
                "orbit",
                "keyframes of the camera are given too: expected one of the two".into(),
            );
        }
        if let Some(orbit) = &spec.orbit
            && !(DVec3::from_array(orbit.target).is_finite() && orbit.degrees.is_finite())
        {
            return fail(
                "orbit",
                format!(
                    "target {:?}, degrees {}: expected finite numbers",
                    orbit.target, orbit.degrees
                ),
            );
        }
        let last = objects
            .iter()
            .chain(&rigs)
            .filter_map(|(_, mover)| mover.time)
            .chain(camera.time)
            .fold(0.0, f64::max);
        let (fps, seconds) = (
            spec.fps,
            spec.seconds.unwrap_or(if last > 0.0 { last } else { 4.0 }),
        );
        check_length(fps, seconds)?;
        let motions = |movers: Vec<(usize, Mover)>| {
            let motions = movers.into_iter().map(|(id, mover)| (id, mover.motion));
            motions.collect()
        };
        Ok(Self {
            fps,
            seconds,
            up: world.up,
            orbit: spec.orbit.clone(),
            camera: camera.motion,
            objects: motions(objects),
            rigs: motions(rigs),
        })
    }

    /// Whether it is one for a world of so many objects and rigs.
    ///
    /// # Errors
    /// [`SceneError`] where it moves others, or has no length or no end.
    pub(crate) fn validate(&self, objects: usize, rigs: usize) -> Result<(), SceneError> {
        if let Some((id, _)) = self.rigs.iter().find(|(id, _)| *id >= rigs) {
            return Err(SceneError::World(format!(
                "the video moves rig {id} of {rigs}"
            )));
        }
        if let Some((id, _)) = self.objects.iter().find(|(id, _)| *id >= objects) {
            return Err(SceneError::World(format!(
                "the video moves object {id} of {objects}"
            )));
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

    /// How many frames it has: `fps * seconds` to the nearest, at least one.
    pub fn frame_count(&self) -> usize {
        ((self.fps * self.seconds).round() as usize).max(1)
    }

    /// When a frame is, in seconds: `frame / fps`, so that an orbit of 360 degrees repeats without a stop.
    pub fn time(&self, frame: usize) -> f64 {
        frame as f64 / self.fps
    }

    /// `base` (one of the world's cameras, or another) as the video moves it, at a time in seconds. One that stands while
    /// its shutter is open moves on as the video does; the time is that of the middle of its motion.
    ///
    /// # Errors
    /// [`SceneError::Camera`] where it has to look straight up or down at its target.
    pub fn camera_at(&self, base: &Camera, time: f64) -> Result<Camera, SceneError> {
        let moved = self.camera_pose(base, time)?;
        let still = self.orbit.is_none() && self.camera == KeyframedMotion::default();
        let Some(shutter) = base
            .motion()
            .filter(|shutter| shutter.is_static() && !still)
        else {
            return Ok(moved);
        };
        let motion = shutter.resampled(|since_middle| {
            let then = self.camera_pose(base, time + since_middle)?;
            Ok(Pose {
                r: then.r(),
                c: then.c(),
            })
        })?;
        moved.with_motion(motion)
    }

    fn camera_pose(&self, base: &Camera, time: f64) -> Result<Camera, SceneError> {
        if let Some(orbit) = &self.orbit {
            let angle = orbit.degrees * (time / self.seconds);
            if angle == 0.0 {
                return Ok(base.clone());
            }
            let turn = DMat3::from_axis_angle(self.up.axis(), angle.to_radians());
            let target = DVec3::from_array(orbit.target);
            let eye = target + turn * (base.c() - target);
            return base.at_pose(base.r() * turn.transpose(), eye);
        }
        let location = self.camera.location.evaluate(time);
        let eye = location.unwrap_or(base.c());
        if let Some(target) = self.camera.target.evaluate(time) {
            let facing = Camera::look_at(
                eye,
                target,
                self.up.axis(),
                DMat3::IDENTITY,
                base.size(),
                base.pixel_center(),
            )?;
            return base.at_pose(facing.r(), eye);
        }
        match (self.camera.rotation.evaluate(time), location) {
            (None, None) => Ok(base.clone()),
            (None, Some(eye)) => base.at_pose(base.r(), eye),
            (Some(rotation), _) => {
                let body_from_world = DMat3::from_quat(rotation).transpose();
                base.at_pose(rotation::CAMERA_FROM_BODY * body_from_world, eye)
            }
        }
    }
}

impl KeyframedMotion {
    /// Where an object is at a time.
    pub(crate) fn world_from_mesh_at(
        &self,
        object: &Object,
        up: Up,
        time: f64,
    ) -> Result<DAffine3, SceneError> {
        let location = self
            .location
            .evaluate(time)
            .unwrap_or(object.world_from_mesh.translation);
        let world_from_body = match (self.target.evaluate(time), self.rotation.evaluate(time)) {
            (Some(target), _) => rotation::rotation_towards(target - location, up.axis()).ok_or_else(|| {
                SceneError::World(format!(
                    "object {:?} at {location} cannot face {target} at {time} s: it is there, or straight above or \
                     below it",
                    object.name
                ))
            })?,
            (None, Some(rotation)) => DMat3::from_quat(rotation),
            (None, None) => {
                return Ok(DAffine3 { translation: location, ..object.world_from_mesh });
            }
        };
        // At zero roll, pitch and yaw the body's axes are the reference axes, and the object is as its mesh is.
        let rotation = world_from_body * rotation::world_from_reference(up).transpose();
        Ok(DAffine3::from_mat3_translation(
            rotation * object.scale_shear,
            location,
        ))
    }
}

/// The mover of an id, new where there is none yet.
fn mover_mut(movers: &mut Vec<(usize, Mover)>, id: usize) -> &mut Mover {
    let found = movers.iter().position(|(known, _)| *known == id);
    let found = found.unwrap_or_else(|| {
        movers.push((id, Mover::default()));
        movers.len() - 1
    });
    &mut movers[found].1
}

/// The keyframes of one mover, as they come in.
#[derive(Default)]
struct Mover {
    /// Of the last keyframe so far.
    time: Option<f64>,
    motion: KeyframedMotion,
}

impl Mover {
    fn add(
        &mut self,
        key: &KeyframeSpec,
        up: Up,
        interpolation: KeyframeInterpolation,
    ) -> Result<(), SceneError> {
        let fail = |key: &str, message: String| Err(SceneError::schema(key, message));
        let time = key.time;
        if !(time.is_finite() && time >= 0.0) {
            return fail("time", format!("{time}: expected finite seconds >= 0"));
        }
        if let Some(last) = self.time.replace(time)
            && time <= last
        {
            return fail(
                "time",
                format!("{time} comes after {last}: keyframes of one mover go in order of time"),
            );
        }
        let interpolation = key.interpolation.unwrap_or(interpolation);
        let angles = [key.roll, key.pitch, key.yaw];
        let numbers = [key.location, key.target]
            .into_iter()
            .flatten()
            .flatten()
            .chain(angles.into_iter().flatten());
        if let Some(number) = numbers.into_iter().find(|number| !number.is_finite()) {
            return fail(
                "",
                format!("{number}: locations, targets and angles must be finite"),
            );
        }
        if let Some(location) = key.location {
            self.motion
                .location
                .push(time, DVec3::from_array(location), interpolation);
        }
        if let Some(target) = key.target {
            self.motion
                .target
                .push(time, DVec3::from_array(target), interpolation);
        }
        if angles.iter().any(Option::is_some) {
            let [roll, pitch, yaw] = angles.map(Option::unwrap_or_default);
            let rotation =
                rotation::world_from_reference(up) * rotation::rotation_from_rpy(roll, pitch, yaw);
            self.motion
                .rotation
                .push(time, DQuat::from_mat3(&rotation), interpolation);
        } else if key.location.is_none() && key.target.is_none() {
            return fail(
                "",
                "it says nothing: give location, roll, pitch and yaw, or target".into(),
            );
        }
        if !(self.motion.rotation.is_empty() || self.motion.target.is_empty()) {
            return fail(
                "",
                "one mover has both angles and targets: give all its keyframes one of them".into(),
            );
        }
        Ok(())
    }
}

/// Whether a video has an end.
fn check_length(fps: f64, seconds: f64) -> Result<(), SceneError> {
    if !(fps.is_finite() && fps > 0.0) {
        return Err(SceneError::schema(
            "fps",
            format!("{fps}: expected a finite number greater than 0"),
        ));
    }
    if !(seconds.is_finite() && seconds > 0.0 && fps * seconds <= MAX_FRAMES) {
        return Err(SceneError::schema(
            "seconds",
            format!("{seconds}: expected more than 0, and at most {MAX_FRAMES} frames"),
        ));
    }
    Ok(())
}
