//! The world at a time of an animation: its nodes are evaluated, and its parts are moved and deformed.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::animation::{
    AnimatedMaterial, AnimationTarget, Node, NodeCamera, NodeLight, NodeObject, NodeTree, Skin, Transform,
};
use crate::camera::Camera;
use crate::error::Result;
use crate::mesh::Mesh;

/// State of all nodes at a time.
pub(crate) struct EvaluatedNodes {
    pub(crate) world_from_node: Vec<DAffine3>,
    pub(crate) visible: Vec<bool>,
    pub(crate) weights: Vec<Vec<f32>>,
    pub(crate) materials: Vec<AnimatedMaterial>,
    pub(crate) lights: Vec<NodeLight>,
    pub(crate) cameras: Vec<NodeCamera>,
}

impl NodeTree {
    /// True if an animation moves an object's node or one of its ancestors.
    pub(crate) fn moves_object(&self, object: usize) -> bool {
        let moves = |node: usize| {
            let targets =
                self.animations.iter().flat_map(|animation| &animation.channels).map(|channel| channel.target);
            targets.into_iter().any(|target| match target {
                AnimationTarget::Translation(i) | AnimationTarget::Rotation(i) | AnimationTarget::Scale(i) => i == node,
                _ => false,
            })
        };
        let mut node = self.objects.iter().find(|mount| mount.object == object).map(|mount| mount.node);
        while let Some(here) = node {
            if moves(here) {
                return true;
            }
            node = self.nodes.get(here).and_then(|node| node.parent);
        }
        false
    }

    /// Returns the transforms of all nodes at a time of an animation, or at rest.
    pub(crate) fn evaluate(&self, moment: Option<(usize, f64)>) -> EvaluatedNodes {
        let mut nodes = self.nodes.clone();
        let channels = moment.and_then(|(animation, _)| self.animations.get(animation));
        let (mut materials, mut lights) = (self.materials.clone(), self.lights.clone());
        let mut cameras = self.cameras.clone();
        for channel in channels.iter().flat_map(|animation| &animation.channels) {
            let value = channel.sampler.evaluate(moment.map_or(0.0, |(_, time)| time));
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

    /// True if joints and morph weights of a mesh are equal in two states.
    pub(crate) fn same_deformation(&self, mount: &NodeObject, a: &EvaluatedNodes, b: &EvaluatedNodes) -> bool {
        let joints = mount.skin.map_or(&[][..], |skin| &self.skins[skin].joints);
        a.weights[mount.node] == b.weights[mount.node]
            && joints.iter().all(|&joint| a.world_from_node[joint] == b.world_from_node[joint])
    }

    /// Returns the deformed mesh of an object; `None` if the object is not deformable.
    pub(crate) fn deformed_mesh(&self, mount: &NodeObject, pose: &EvaluatedNodes) -> Option<Mesh> {
        let shape = mount.deformable.as_ref()?;
        let joints: Option<Vec<_>> = mount.skin.map(|skin| {
            let Skin { joints, inverse_bind } = &self.skins[skin];
            let pairs = joints.iter().zip(inverse_bind);
            pairs.map(|(&joint, inverse)| pose.world_from_node[joint] * *inverse).collect()
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
        (Transform::Trs { scale, .. }, AnimationTarget::Scale(_)) => *scale = DVec3::from_slice(value),
        (_, AnimationTarget::Weights(_)) => node.weights = value.iter().map(|&v| v as f32).collect(),
        (_, AnimationTarget::Visible(_)) => node.visible = value[0] != 0.0,
        // Matrices are never animated, because the reader rejects such files.
        _ => {}
    }
}

/// Returns the camera with its pose set by a node; unchanged if the node flattens it.
pub(crate) fn camera_at_node(camera: &Camera, world_from_node: DAffine3) -> Result<Camera> {
    let Some(world_from_camera) = camera_axes(world_from_node) else { return Ok(camera.clone()) };
    camera.at_pose(world_from_camera.transpose(), world_from_node.translation)
}

/// Axes (right, down, forward) of a camera that looks along -z with y up, without scale, shear and mirroring.
fn camera_axes(world_from_node: DAffine3) -> Option<DMat3> {
    let back = world_from_node.z_axis.try_normalize()?;
    let right = world_from_node.x_axis;
    let right = (right - right.dot(back) * back).try_normalize()?;
    let up = back.cross(right);
    Some(DMat3::from_cols(right, -up, -back))
}
