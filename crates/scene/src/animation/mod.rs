//! Animation: a tree of nodes with attached objects, lights and cameras, and the channels that move the nodes (glTF
//! 2.0, sections 3.5, 3.7.3 and 3.11).

mod deform;
pub(crate) mod evaluate;
pub(crate) mod node_attachment;
mod property;
mod sampler;

use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

pub use crate::animation::node_attachment::{LightProperty, NodeCamera, NodeLight};
pub use deform::{DeformableMesh, JointSet, MorphTarget, flattened};
pub use property::{AnimatedMaterial, MaterialProperty, TextureSlotKind, UvProperty, UvTransform};
pub use sampler::{AnimationSampler, SamplerInterpolation};

use crate::mesh::Mesh;

/// Node hierarchy of a world, with the parts attached to it and its animations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeTree {
    /// All nodes of the tree.
    pub nodes: Vec<Node>,
    /// Indices of all nodes, parents before children.
    pub order: Vec<usize>,
    /// Skins of deformable meshes.
    pub skins: Vec<Skin>,
    /// Objects attached to nodes.
    pub objects: Vec<NodeObject>,
    /// Lights attached to nodes.
    pub lights: Vec<NodeLight>,
    /// Cameras attached to nodes.
    pub cameras: Vec<NodeCamera>,
    /// Animated materials.
    pub materials: Vec<AnimatedMaterial>,
    /// Animations of the nodes.
    pub animations: Vec<Animation>,
    /// The world's empty mesh, used by hidden objects.
    pub hidden_mesh: usize,
}

/// Node of the tree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Index of the parent; `None` for a root.
    pub parent: Option<usize>,
    /// Transform parent_from_node.
    pub transform: Transform,
    /// False hides the node and all its descendants.
    pub visible: bool,
    /// Weight of each morph target of the node's mesh.
    pub weights: Vec<f32>,
}

/// Transform of a node: a matrix, or translation, rotation and scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Transform {
    /// A matrix, which cannot be animated.
    Matrix(DAffine3),
    /// Translation * rotation * scale.
    Trs {
        /// Translation in the parent's coordinates.
        translation: DVec3,
        /// Rotation as a unit quaternion.
        rotation: DQuat,
        /// Scale per axis.
        scale: DVec3,
    },
}

impl Transform {
    /// Returns the transform as a matrix.
    pub fn parent_from_node(&self) -> DAffine3 {
        match self {
            Self::Matrix(matrix) => *matrix,
            Self::Trs { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(*scale, *rotation, *translation)
            }
        }
    }
}

/// Joints that deform meshes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skin {
    /// Node of each joint.
    pub joints: Vec<usize>,
    /// The transform joint_from_mesh of each joint, in the pose in which the mesh was modelled.
    pub inverse_bind: Vec<DAffine3>,
}

/// Object attached to a node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeObject {
    /// Index into the world's objects.
    pub object: usize,
    /// Index into [`NodeTree::nodes`].
    pub node: usize,
    /// Transform node_from_mesh; the identity unless the node places several instances of its mesh.
    pub node_from_mesh: DAffine3,
    /// Index into the world's meshes: the object's mesh while it is visible.
    pub mesh: usize,
    /// Mesh with its morph targets and joints, if it is deformable.
    pub deformable: Option<Arc<DeformableMesh>>,
    /// Index into [`NodeTree::skins`].
    pub skin: Option<usize>,
    /// The mesh at rest, without animation.
    pub rest: Option<Arc<Mesh>>,
}

/// Channels that play together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Animation {
    /// Name; empty if absent.
    pub name: String,
    /// All channels of the animation.
    pub channels: Vec<Channel>,
}

impl Animation {
    /// Time of the last keyframe, in seconds.
    pub fn duration(&self) -> f64 {
        let ends = self.channels.iter().map(|channel| channel.sampler.end_time());
        ends.fold(0.0, f64::max)
    }
}

/// A property and its value over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// The animated property.
    pub target: AnimationTarget,
    /// Keyframes and interpolation.
    pub sampler: Arc<AnimationSampler>,
}

/// Property that a channel animates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum AnimationTarget {
    /// Translation of the node with this index: three numbers.
    Translation(usize),
    /// Rotation of the node with this index: a quaternion x, y, z, w.
    Rotation(usize),
    /// Scale of the node with this index: three numbers.
    Scale(usize),
    /// Morph weights of the node with this index: one number per morph target.
    Weights(usize),
    /// Visibility of the node with this index: 0 hides it.
    Visible(usize),
    /// Property of the material with this index.
    Material(usize, MaterialProperty),
    /// A property of all lights whose definition has this index.
    Light(usize, LightProperty),
    /// Vertical field of view of all cameras whose definition has this index, in radians.
    FieldOfView(usize),
    /// Half the width (0) or height (1) of the view of all orthographic cameras whose definition has this index, in
    /// world units.
    Magnification(usize, usize),
}

impl AnimationTarget {
    /// Minimum number of components that a value of the property requires.
    pub fn component_count(self) -> usize {
        use MaterialProperty as P;
        match self {
            Self::Translation(_) | Self::Scale(_) => 3,
            Self::Rotation(_) | Self::Material(_, P::BaseColor) => 4,
            Self::Light(_, LightProperty::Color) => 3,
            Self::Material(
                _,
                P::EmissionColor | P::SpecularColor | P::AttenuationColor | P::SheenColor | P::DiffuseTransmissionColor,
            ) => 3,
            Self::Material(_, P::Uv(_, UvProperty::Offset | UvProperty::Scale)) => 2,
            _ => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn node_transforms_scale_before_they_rotate_and_translate() {
        let transform = Transform::Trs {
            translation: DVec3::new(10.0, 0.0, 0.0),
            rotation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
            scale: DVec3::new(2.0, 3.0, 4.0),
        };
        let point = transform.parent_from_node().transform_point3(DVec3::X);
        assert!((point - DVec3::new(10.0, 2.0, 0.0)).length() < 1e-12, "{point}");
    }
}
