//! A world in a pose of its rig.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::animation::deform::flattened;
use crate::animation::node_attachment::move_light;
use crate::animation::{
    AnimatedMaterial, AnimationTarget, Node, NodeCamera, NodeLight, NodeObject, NodeTree, Skin,
    Transform,
};
use crate::camera::Camera;
use crate::error::{SceneError, suggestion};
use crate::mesh::Mesh;
use crate::world::World;

/// What nodes are at a time.
struct EvaluatedNodes {
    world_from_node: Vec<DAffine3>,
    visible: Vec<bool>,
    weights: Vec<Vec<f32>>,
    materials: Vec<AnimatedMaterial>,
    lights: Vec<NodeLight>,
    cameras: Vec<NodeCamera>,
}

impl World {
    /// The number of the animation of this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_animation(&self, name: &str) -> Result<usize, SceneError> {
        let animations = self.node_tree.iter().flat_map(|rig| &rig.animations);
        let names: Vec<&str> = animations.map(|animation| &animation.name[..]).collect();
        names
            .iter()
            .position(|other| *other == name)
            .ok_or_else(|| {
                let count = names.len();
                let near = suggestion(name, names.iter().copied());
                SceneError::World(format!("no animation {name:?} among {count}{near}"))
            })
    }

    /// The world at a time in seconds of one of its animations. What does not move is shared; meshes that bend keep
    /// their triangles.
    ///
    /// # Errors
    /// [`SceneError::World`] where there is no such animation.
    pub fn animated_at(&self, animation: usize, time: f64) -> Result<World, SceneError> {
        let count = self
            .node_tree
            .as_ref()
            .map_or(0, |rig| rig.animations.len());
        match &self.node_tree {
            Some(rig) if animation < count => {
                self.apply_pose(&rig.evaluate(Some((animation, time))), rig)
            }
            _ => Err(SceneError::World(format!(
                "animation {animation}, but the world has {count}"
            ))),
        }
    }

    /// The world as its rig is when nothing has moved yet; each mesh that bends is kept there for comparison.
    ///
    /// # Errors
    /// [`SceneError::World`] where a camera cannot be placed.
    pub fn at_rest(mut self) -> Result<World, SceneError> {
        let Some(rig) = &mut self.node_tree else {
            return Ok(self);
        };
        let rig = Arc::make_mut(rig);
        let pose = rig.evaluate(None);
        let rests: Vec<_> = (rig.objects.iter())
            .map(|mount| rig.deformed_mesh(mount, &pose).map(Arc::new))
            .collect();
        for (mount, rest) in rig.objects.iter_mut().zip(rests) {
            mount.rest = rest;
        }
        let rig = Arc::new(rig.clone());
        self.node_tree = Some(rig.clone());
        self.apply_pose(&pose, &rig)
    }

    fn apply_pose(&self, pose: &EvaluatedNodes, rig: &NodeTree) -> Result<World, SceneError> {
        let mut world = self.clone();
        let rest = rig.evaluate(None);
        for mount in &rig.objects {
            let object = &mut world.objects[mount.object];
            // Joints say where a bent mesh is, whatever the node does.
            let skinned = mount.skin.is_some();
            let placed = match skinned {
                true => DAffine3::IDENTITY,
                false => pose.world_from_node[mount.node] * mount.node_from_mesh,
            };
            let mut flat = None;
            if !placed.inverse().is_finite() {
                let mesh = rig.deformed_mesh(mount, pose);
                flat = flattened(mesh.as_ref().unwrap_or(&world.meshes[mount.mesh]), placed);
            }
            if let Some(flat) = flat.filter(|_| pose.visible[mount.node]) {
                world.meshes.push(Arc::new(flat));
                object.mesh = world.meshes.len() - 1;
                object.world_from_mesh = DAffine3::IDENTITY;
                continue;
            }
            if !pose.visible[mount.node] || !placed.inverse().is_finite() {
                object.mesh = rig.hidden_mesh;
                let place = placed.translation;
                object.world_from_mesh = DAffine3::from_translation(place);
                continue;
            }
            (object.mesh, object.world_from_mesh) = (mount.mesh, placed);
            object.scale_shear = placed.matrix3;
            if let Some(rest_mesh) = &mount.rest {
                let mesh = &mut world.meshes[mount.mesh];
                *mesh = if rig.same_deformation(mount, pose, &rest) {
                    rest_mesh.clone()
                } else {
                    rig.deformed_mesh(mount, pose)
                        .map_or(rest_mesh.clone(), Arc::new)
                };
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
            let camera = &mut world.cameras[mount.camera].camera;
            *camera = camera_at_node(&mount.base, pose.world_from_node[mount.node])?;
        }
        for moving in &pose.materials {
            world.materials[moving.material] = moving.clone().material();
        }
        Ok(world)
    }
}

impl NodeTree {
    /// All nodes at a time of an animation, or at rest.
    fn evaluate(&self, moment: Option<(usize, f64)>) -> EvaluatedNodes {
        let mut nodes = self.nodes.clone();
        let channels = moment.and_then(|(animation, _)| self.animations.get(animation));
        let (mut materials, mut lights) = (self.materials.clone(), self.lights.clone());
        let mut cameras = self.cameras.clone();
        for channel in channels.iter().flat_map(|animation| &animation.channels) {
            let value = channel
                .sampler
                .evaluate(moment.map_or(0.0, |(_, time)| time));
            if value.len() < channel.target.component_count() {
                continue;
            }
            match channel.target {
                AnimationTarget::Translation(i)
                | AnimationTarget::Rotation(i)
                | AnimationTarget::Scale(i)
                | AnimationTarget::Weights(i)
                | AnimationTarget::Visible(i) => {
                    if let Some(node) = nodes.get_mut(i) {
                        set_node_property(node, channel.target, &value);
                    }
                }
                AnimationTarget::Material(material, property) => {
                    let same = materials.iter_mut().filter(|m| m.material == material);
                    same.for_each(|moving| moving.set(property, &value));
                }
                AnimationTarget::Light(definition, property) => {
                    let same = lights.iter_mut().filter(|l| l.definition == definition);
                    same.for_each(|light| light.set(property, &value));
                }
                AnimationTarget::FieldOfView(definition) => {
                    let same = cameras.iter_mut().filter(|c| c.definition == definition);
                    same.for_each(|camera| camera.set_fov(value[0]));
                }
                AnimationTarget::Magnification(definition, axis) => {
                    let same = cameras.iter_mut().filter(|c| c.definition == definition);
                    same.for_each(|camera| camera.set_magnification(axis, value[0]));
                }
            }
        }
        let mut world_from_node = vec![DAffine3::IDENTITY; nodes.len()];
        let mut visible = vec![true; nodes.len()];
        for &i in &self.order {
            let local = nodes[i].transform.parent_from_node();
            (world_from_node[i], visible[i]) = match nodes[i].parent {
                Some(up) => (world_from_node[up] * local, visible[up] && nodes[i].visible),
                None => (local, nodes[i].visible),
            };
        }
        EvaluatedNodes {
            world_from_node,
            visible,
            weights: nodes.into_iter().map(|node| node.weights).collect(),
            materials,
            lights,
            cameras,
        }
    }

    /// Whether what bends a mesh is the same in two poses.
    fn same_deformation(&self, mount: &NodeObject, a: &EvaluatedNodes, b: &EvaluatedNodes) -> bool {
        let joints = mount.skin.map_or(&[][..], |skin| &self.skins[skin].joints);
        a.weights[mount.node] == b.weights[mount.node]
            && joints
                .iter()
                .all(|&joint| a.world_from_node[joint] == b.world_from_node[joint])
    }

    /// The mesh of an object that bends.
    fn deformed_mesh(&self, mount: &NodeObject, pose: &EvaluatedNodes) -> Option<Mesh> {
        let shape = mount.deformable.as_ref()?;
        let joints: Option<Vec<_>> = mount.skin.map(|skin| {
            let Skin {
                joints,
                inverse_bind,
            } = &self.skins[skin];
            let pairs = joints.iter().zip(inverse_bind);
            pairs
                .map(|(&joint, inverse)| pose.world_from_node[joint] * *inverse)
                .collect()
        });
        Some(shape.deform(&pose.weights[mount.node], joints.as_deref()))
    }
}

fn set_node_property(node: &mut Node, target: AnimationTarget, value: &[f64]) {
    match (&mut node.transform, target) {
        (Transform::Trs { translation, .. }, AnimationTarget::Translation(_)) => {
            *translation = DVec3::from_slice(value);
        }
        (Transform::Trs { rotation, .. }, AnimationTarget::Rotation(_)) => {
            let turn = DQuat::from_slice(value);
            if turn.length_squared() > 0.0 {
                *rotation = turn.normalize();
            }
        }
        (Transform::Trs { scale, .. }, AnimationTarget::Scale(_)) => {
            *scale = DVec3::from_slice(value)
        }
        (_, AnimationTarget::Weights(_)) => {
            node.weights = value.iter().map(|&v| v as f32).collect();
        }
        (_, AnimationTarget::Visible(_)) => node.visible = value[0] != 0.0,
        // Reading refuses to animate a matrix.
        _ => {}
    }
}

/// The camera with the same picture, on a node; as it is where the node flattens it.
fn camera_at_node(camera: &Camera, world_from_node: DAffine3) -> Result<Camera, SceneError> {
    let Some(world_from_camera) = camera_axes(world_from_node) else {
        return Ok(camera.clone());
    };
    camera.at_pose(world_from_camera.transpose(), world_from_node.translation)
}

/// The axes (right, down, forward) of a camera that looks along -z with y up; without scale, shear and mirroring.
fn camera_axes(world_from_node: DAffine3) -> Option<DMat3> {
    let back = world_from_node.z_axis.try_normalize()?;
    let right = world_from_node.x_axis;
    let right = (right - right.dot(back) * back).try_normalize()?;
    let up = back.cross(right);
    Some(DMat3::from_cols(right, -up, -back))
}
