//! Conversion of `[video]` to the motion of cameras, objects and rigs.

use glam::{DMat3, DQuat, DVec3};

use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::math::polar::polar;
use crate::math::rotation;
use crate::schema::build_object::affine;
use crate::schema::spec::video::{KeyframeSpec, VideoSpec};
use crate::up::Up;
use crate::video::{KeyframeInterpolation, KeyframedMotion, Video, check_length};
use crate::world::World;

impl VideoSpec {
    /// Returns the described video of a world, which may refer to the world's objects, rigs and cameras by name.
    ///
    /// # Errors
    /// [`SceneError::Schema`] if keyframes of one mover are not in order of time, are empty or contradict each other,
    /// if an object, rig or camera is unknown, or if values are invalid.
    pub fn build(&self, world: &World) -> Result<Video> {
        let fail = |code, key: &str, message: String| Err(SceneError::schema(code, key, message));
        let mut camera = Mover::default();
        let mut objects: Vec<(usize, Mover)> = Vec::new();
        let mut rigs: Vec<(usize, Mover)> = Vec::new();
        let mut cameras: Vec<(usize, Mover)> = Vec::new();
        for (i, key) in self.keyframe.iter().enumerate() {
            let place = format!("keyframe[{i}]");
            if key.matrix.is_some() && key.object.is_none() && key.camera.is_none() {
                let message = "applies only to objects and named cameras; use location and angles, or target".into();
                return fail(ErrorCode::ConflictingValues, &format!("{place}.matrix"), message);
            }
            let mover = match (&key.object, &key.rig, &key.camera) {
                (None, None, None) => &mut camera,
                (Some(name), None, None) => {
                    let id = world.find_object(name).map_err(|error| error.in_context(&format!("{place}.object")))?;
                    mover_mut(&mut objects, id)
                }
                (None, Some(name), None) => {
                    let id = world.find_rig(name).map_err(|error| error.in_context(&format!("{place}.rig")))?;
                    mover_mut(&mut rigs, id)
                }
                (None, None, Some(name)) => {
                    let id = world.own_camera(name).map_err(|error| error.in_context(&format!("{place}.camera")))?;
                    mover_mut(&mut cameras, id)
                }
                _ => {
                    let message = "object, rig and camera are alternatives; expected only one of them".into();
                    return fail(ErrorCode::ConflictingValues, &place, message);
                }
            };
            mover.add(key, world.up, self.interpolation).map_err(|error| error.in_context(&place))?;
        }
        if self.orbit.is_some() && camera.time.is_some() {
            return fail(
                ErrorCode::ConflictingValues,
                "orbit",
                "cannot be combined with keyframes of the camera; use only one of them".into(),
            );
        }
        if let Some(orbit) = &self.orbit
            && !(DVec3::from_array(orbit.target).is_finite() && orbit.degrees.is_finite())
        {
            return fail(
                ErrorCode::OutOfRange,
                "orbit",
                format!("target {:?}, degrees {}; expected finite numbers", orbit.target, orbit.degrees),
            );
        }
        let movers = objects.iter().chain(&rigs).chain(&cameras);
        let last = movers.filter_map(|(_, mover)| mover.time).chain(camera.time).fold(0.0, f64::max);
        let (fps, seconds) = (self.fps, self.seconds.unwrap_or(if last > 0.0 { last } else { 4.0 }));
        check_length(fps, seconds)?;
        let motions = |movers: Vec<(usize, Mover)>| {
            let motions = movers.into_iter().map(|(id, mover)| (id, mover.motion));
            motions.collect()
        };
        Ok(Video {
            fps,
            seconds,
            up: world.up,
            orbit: self.orbit.clone(),
            camera: camera.motion,
            objects: motions(objects),
            rigs: motions(rigs),
            cameras: motions(cameras),
        })
    }
}

/// Keyframes of one object, rig or camera, collected while they are read.
#[derive(Default)]
struct Mover {
    /// Time of the last keyframe so far.
    time: Option<f64>,
    motion: KeyframedMotion,
    /// True if the keyframes so far have matrices; `None` before the first keyframe.
    has_matrices: Option<bool>,
}

impl Mover {
    fn add(&mut self, key: &KeyframeSpec, up: Up, interpolation: KeyframeInterpolation) -> Result<()> {
        let fail = |code, key: &str, message: String| Err(SceneError::schema(code, key, message));
        let time = key.time;
        if !(time.is_finite() && time >= 0.0) {
            return fail(ErrorCode::OutOfRange, "time", format!("{time}; expected a finite number of seconds >= 0"));
        }
        if let Some(last) = self.time.replace(time)
            && time <= last
        {
            return fail(
                ErrorCode::OutOfRange,
                "time",
                format!("{time} follows {last}; expected increasing times for the keyframes of each object or camera"),
            );
        }
        let interpolation = key.interpolation.unwrap_or(interpolation);
        if *self.has_matrices.get_or_insert(key.matrix.is_some()) != key.matrix.is_some() {
            return fail(
                ErrorCode::ConflictingValues,
                "",
                "only some keyframes of one object or camera have a matrix; use a matrix in all of them or in none"
                    .into(),
            );
        }
        if let Some(rows) = &key.matrix {
            return self.add_matrix(key, rows, up, interpolation);
        }
        let angles = [key.roll, key.pitch, key.yaw];
        let numbers = [key.location, key.target].into_iter().flatten().flatten().chain(angles.into_iter().flatten());
        if let Some(number) = numbers.into_iter().find(|number| !number.is_finite()) {
            return fail(ErrorCode::OutOfRange, "", format!("{number}; locations, targets and angles must be finite"));
        }
        if let Some(location) = key.location {
            self.motion.location.push(time, DVec3::from_array(location), interpolation);
        }
        if let Some(target) = key.target {
            self.motion.target.push(time, DVec3::from_array(target), interpolation);
        }
        if angles.iter().any(Option::is_some) {
            let [roll, pitch, yaw] = angles.map(Option::unwrap_or_default);
            self.motion.angles.push(time, DVec3::new(roll, pitch, yaw), interpolation);
        } else if key.location.is_none() && key.target.is_none() {
            return fail(
                ErrorCode::MissingValue,
                "",
                "empty keyframe; expected location, roll, pitch and yaw, or target".into(),
            );
        }
        if !(self.motion.angles.is_empty() || self.motion.target.is_empty()) {
            return fail(
                ErrorCode::ConflictingValues,
                "",
                "some keyframes have angles and others targets; use only one of them for each object or camera".into(),
            );
        }
        Ok(())
    }
}

impl Mover {
    fn add_matrix(
        &mut self,
        key: &KeyframeSpec,
        rows: &[[f64; 4]],
        up: Up,
        interpolation: KeyframeInterpolation,
    ) -> Result<()> {
        let fail = |code, key: &str, message: &str| Err(SceneError::schema(code, key, message));
        let others = [
            ("location", key.location.is_some()),
            ("target", key.target.is_some()),
            ("roll", key.roll.is_some()),
            ("pitch", key.pitch.is_some()),
            ("yaw", key.yaw.is_some()),
        ];
        if let Some((name, _)) = others.into_iter().find(|(_, given)| *given) {
            return fail(
                ErrorCode::ConflictingValues,
                name,
                "cannot be combined with \"matrix\", which already contains it; use only one of them",
            );
        }
        let transform = affine(rows).map_err(|error| error.in_context("matrix"))?;
        let Some((turn, stretch)) = polar(transform.matrix3) else {
            return fail(
                ErrorCode::InvalidMatrix,
                "matrix",
                "the matrix mirrors the object, which keyframes cannot do; expected a determinant \
                greater than 0",
            );
        };
        let motion = &mut self.motion;
        motion.location.push(key.time, transform.translation, interpolation);
        if key.camera.is_some() {
            if !stretch.abs_diff_eq(DMat3::IDENTITY, 1e-6) {
                return fail(
                    ErrorCode::NotARotation,
                    "matrix",
                    "a camera's matrix must consist of a rotation and a translation",
                );
            }
            let world_from_body = turn * rotation::CAMERA_FROM_BODY;
            motion.rotation.push(key.time, DQuat::from_mat3(&world_from_body), interpolation);
            return Ok(());
        }
        let world_from_body = turn * rotation::world_from_reference(up);
        motion.rotation.push(key.time, DQuat::from_mat3(&world_from_body), interpolation);
        let [x, y, z] = [stretch.x_axis, stretch.y_axis, stretch.z_axis];
        let linear = KeyframeInterpolation::Linear;
        motion.stretch[0].push(key.time, DVec3::new(x.x, y.y, z.z), linear);
        motion.stretch[1].push(key.time, DVec3::new(z.y, z.x, y.x), linear);
        Ok(())
    }
}

/// Returns the keyframes of the part with this id; adds an empty entry for a new id.
fn mover_mut(movers: &mut Vec<(usize, Mover)>, id: usize) -> &mut Mover {
    let found = movers.iter().position(|(known, _)| *known == id);
    let found = found.unwrap_or_else(|| {
        movers.push((id, Mover::default()));
        movers.len() - 1
    });
    &mut movers[found].1
}
