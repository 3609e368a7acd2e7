//! The world at a time.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::animation::evaluate::{EvaluatedNodes, camera_at_node};
use crate::animation::node_attachment::move_light;
use crate::animation::{NodeTree, flattened};
use crate::camera::Camera;
use crate::counted::counted;
use crate::error::{Result, SceneError, suggestion};
use crate::error_code::ErrorCode;
use crate::math::rotation;
use crate::up::Up;
use crate::video::KeyframedMotion;
use crate::video::track::Track;
use crate::world::{Object, World, WorldTime};

impl World {
    /// Returns the world at a time: moved by one of its animations, if it has any, and by its video. Parts that do not
    /// move are shared. Of the cameras, only cameras with their own keyframes move; see `Video::camera_at`.
    ///
    /// # Errors
    /// The errors of [`World::animated_at`] and of [`World::at_video_time`].
    pub fn at_time(&self, clock: WorldTime) -> Result<World> {
        let moved = match (&self.node_tree, clock.animation) {
            (None, None) => self.at_video_time(clock.time)?,
            _ => self.animated_at(clock.animation.unwrap_or(0), clock.time)?.at_video_time(clock.time)?,
        };
        Ok(World { time: Some(clock), ..moved })
    }

    /// Returns the world in the middle of the exposure of a pixel's line; unchanged if the world has no time.
    ///
    /// # Errors
    /// The errors of [`World::at_time`].
    pub fn at_line(&self, camera: &Camera, pixel: DVec2) -> Result<World> {
        let Some(clock) = self.time else { return Ok(self.clone()) };
        self.at_time(WorldTime { time: clock.time + camera.shutter_offset(pixel, 0.5), ..clock })
    }

    /// True if any part moves.
    pub fn is_animated(&self) -> bool {
        let animated = self.node_tree.iter().any(|rig| !rig.animations.is_empty());
        animated || self.video.iter().any(|video| !video.objects.is_empty())
    }

    /// Returns the world at a time of its video in seconds; objects and cameras with their own keyframes are moved,
    /// geometry is shared. Other cameras are unchanged; see `Video::camera_at`.
    ///
    /// # Errors
    /// [`SceneError::World`] if an object would have to face a point straight above or below it, or its own location.
    pub fn at_video_time(&self, time: f64) -> Result<World> {
        let mut moved = World { time: Some(WorldTime { time, animation: None }), ..self.clone() };
        for (id, motion) in self.video.iter().flat_map(|video| &video.objects) {
            if let Some(object) = moved.objects.get_mut(*id) {
                object.world_from_mesh = motion.world_from_mesh_at(object, self.up, time)?;
            }
        }
        if let Some(video) = &self.video {
            for (id, _) in &video.cameras {
                if let Some(named) = moved.cameras.get_mut(*id) {
                    named.camera = video.camera_at(&named.camera, Some(*id), time)?;
                }
            }
        }
        Ok(moved)
    }

    /// Returns the index of the world's camera that has the pose of `base` and keyframes of its own in the video.
    pub fn keyframed_camera(&self, base: &Camera) -> Option<usize> {
        let mut moving = self.video.iter().flat_map(|video| &video.cameras).map(|(id, _)| *id);
        moving.find(|id| {
            let named = self.cameras.get(*id).map(|named| &named.camera);
            named.is_some_and(|camera| camera.r() == base.r() && camera.c() == base.c())
        })
    }

    /// Returns the motions of the objects that the video moves, by ascending object, if nothing else moves the world.
    pub fn object_motions(&self) -> Option<Vec<ObjectMotion<'_>>> {
        let is_animated = self.node_tree.is_some() || self.time.is_some_and(|clock| clock.animation.is_some());
        let moved = self.video.iter().flat_map(|video| &video.objects);
        let mut motions: Vec<_> = moved
            .filter_map(|(id, motion)| {
                Some(ObjectMotion { id: *id, object: self.objects.get(*id)?, motion, up: self.up })
            })
            .collect();
        motions.sort_by_key(|motion| motion.id);
        let is_unique = motions.windows(2).all(|pair| pair[0].id < pair[1].id);
        (is_unique && !is_animated).then_some(motions)
    }

    /// Returns the index of the animation with this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_animation(&self, name: &str) -> Result<usize> {
        let animations = self.node_tree.iter().flat_map(|rig| &rig.animations);
        let names: Vec<&str> = animations.map(|animation| &animation.name[..]).collect();
        names.iter().position(|other| *other == name).ok_or_else(|| {
            let near = suggestion(name, names.iter().copied());
            SceneError::unknown_name(format!(
                "no animation named {name:?}; the world has {}{near}",
                counted(names.len(), "animation")
            ))
        })
    }

    /// Returns the world at a time in seconds of one of its animations. Parts that do not move are shared; deformed
    /// meshes keep their triangles.
    ///
    /// # Errors
    /// [`SceneError::World`] if the animation does not exist.
    pub fn animated_at(&self, animation: usize, time: f64) -> Result<World> {
        let count = self.node_tree.as_ref().map_or(0, |rig| rig.animations.len());
        match &self.node_tree {
            Some(rig) if animation < count => self.apply_pose(&rig.evaluate(Some((animation, time))), rig),
            _ => Err(SceneError::World(ErrorCode::IndexOutOfRange.message(format!(
                "animation {animation} does not exist; the world has {}",
                counted(count, "animation")
            )))),
        }
    }

    /// Returns the world with its nodes at rest. The node tree keeps each mesh at rest, so that meshes that do not
    /// change are not computed again.
    ///
    /// # Errors
    /// [`SceneError::World`] if a camera cannot be placed.
    pub fn at_rest(mut self) -> Result<World> {
        let Some(mut rig) = self.node_tree.take() else { return Ok(self) };
        let pose = rig.evaluate(None);
        let rests: Vec<_> = (rig.objects.iter()).map(|mount| rig.deformed_mesh(mount, &pose).map(Arc::new)).collect();
        for (mount, rest) in Arc::make_mut(&mut rig).objects.iter_mut().zip(rests) {
            mount.rest = rest;
        }
        self.node_tree = Some(rig.clone());
        self.apply_pose(&pose, &rig)
    }

    fn apply_pose(&self, pose: &EvaluatedNodes, rig: &NodeTree) -> Result<World> {
        let mut world = self.clone();
        let rest = rig.evaluate(None);
        for mount in &rig.objects {
            let object = &mut world.objects[mount.object];
            // The joints place a skinned mesh; the transform of its node is not applied.
            let placed = match mount.skin {
                Some(_) => DAffine3::IDENTITY,
                None => pose.world_from_node[mount.node] * mount.node_from_mesh,
            };
            let (is_visible, is_solid) = (pose.visible[mount.node], placed.inverse().is_finite());
            if !is_visible || !is_solid {
                let mesh = is_visible.then(|| rig.deformed_mesh(mount, pose));
                let mesh = mesh.as_ref().map(|bent| bent.as_ref().unwrap_or(&world.meshes[mount.mesh]));
                let flat = mesh.and_then(|mesh| flattened(mesh, placed));
                (object.mesh, object.world_from_mesh) = match flat {
                    Some(_) => (world.meshes.len(), DAffine3::IDENTITY),
                    None => (rig.hidden_mesh, DAffine3::from_translation(placed.translation)),
                };
                world.meshes.extend(flat.map(Arc::new));
                continue;
            }
            (object.mesh, object.world_from_mesh) = (mount.mesh, placed);
            object.scale_shear = placed.matrix3;
            if let Some(rest_mesh) = &mount.rest {
                let is_bent = !rig.same_deformation(mount, pose, &rest);
                let bent = is_bent.then(|| rig.deformed_mesh(mount, pose)).flatten();
                world.meshes[mount.mesh] = bent.map_or_else(|| rest_mesh.clone(), Arc::new);
            }
        }
        for mount in &pose.lights {
            let world_from_node = pose.world_from_node[mount.node];
            let along = (-world_from_node.matrix3.z_axis).try_normalize();
            let mut light = mount.clone().light();
            move_light(&mut light, world_from_node.translation, along);
            world.lights[mount.light] = light;
        }
        for mount in &pose.cameras {
            world.cameras[mount.camera].camera = camera_at_node(&mount.base, pose.world_from_node[mount.node])?;
        }
        for moving in &pose.materials {
            world.materials[moving.material] = moving.clone().material();
        }
        Ok(world)
    }
}

/// The motion of an object by the video's keyframes.
#[derive(Clone, Copy, Debug)]
pub struct ObjectMotion<'a> {
    /// Index of the object.
    pub id: usize,
    object: &'a Object,
    motion: &'a KeyframedMotion,
    up: Up,
}

impl ObjectMotion<'_> {
    /// Returns world_from_mesh at a time of the video in seconds.
    ///
    /// # Errors
    /// [`SceneError::World`] if the object would have to face a point straight above or below it, or its own location.
    pub fn world_from_mesh_at(&self, time: f64) -> Result<DAffine3> {
        self.motion.world_from_mesh_at(self.object, self.up, time)
    }

    /// True if the object keeps its size and its shape, and can be placed at every time.
    pub fn is_rigid(&self) -> bool {
        self.motion.target.is_empty() && self.motion.stretch.iter().all(Track::is_empty)
    }

    /// True if the object keeps its size, its shape and its orientation.
    pub fn is_translation(&self) -> bool {
        self.is_rigid() && self.motion.angles.is_empty() && self.motion.rotation.is_empty()
    }

    /// For a rigid object, the linear part of world_from_mesh up to a rotation.
    pub fn shape(&self) -> DMat3 {
        if self.is_translation() { self.object.world_from_mesh.matrix3 } else { self.object.scale_shear }
    }

    /// Returns a box that contains the mesh's origin at all times from `start` to `end`.
    pub fn locations_during(&self, [start, end]: [f64; 2]) -> [DVec3; 2] {
        let still = self.object.world_from_mesh.translation;
        let at = self.motion.location.evaluate(start).unwrap_or(still);
        let reach = self.motion.location.max_speed([start, end]) * (end - start);
        [at - reach, at + reach]
    }
}

impl KeyframedMotion {
    /// Returns world_from_mesh of an object at a time.
    pub(crate) fn world_from_mesh_at(&self, object: &Object, up: Up, time: f64) -> Result<DAffine3> {
        let location = self.location.evaluate(time).unwrap_or(object.world_from_mesh.translation);
        let world_from_body = match (self.target.evaluate(time), self.rotation_at(up, time)) {
            (Some(target), _) => rotation::rotation_towards(target - location, up.axis()).ok_or_else(|| {
                SceneError::world(format!(
                    "object {:?} at {location} cannot face {target} at {time} s; expected a target that is not the \
                     object's location, and not straight above or below the object",
                    object.name
                ))
            })?,
            (None, Some(world_from_body)) => world_from_body,
            (None, None) => return Ok(DAffine3 { translation: location, ..object.world_from_mesh }),
        };
        // At zero roll, pitch and yaw the body's axes equal the reference axes, and the object has its mesh's
        // orientation.
        let rotation = world_from_body * rotation::world_from_reference(up).transpose();
        let shape = self.stretch_at(time).unwrap_or(object.scale_shear);
        Ok(DAffine3::from_mat3_translation(rotation * shape, location))
    }
}
