//! Animation: a tree of nodes that carries objects, lights and cameras, and channels that move it (glTF 2.0, sections
//! 3.5, 3.7.3 and 3.11).

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

/// The node hierarchy of a world, with what is attached to it and what animates it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeTree {
    /// The tree.
    pub nodes: Vec<Node>,
    /// Indices of all nodes, parents before children.
    pub order: Vec<usize>,
    /// Skins of deformable meshes.
    pub skins: Vec<Skin>,
    /// The objects that hang on nodes.
    pub objects: Vec<NodeObject>,
    /// The lights that hang on nodes.
    pub lights: Vec<NodeLight>,
    /// The cameras that hang on nodes.
    pub cameras: Vec<NodeCamera>,
    /// The materials that move.
    pub materials: Vec<AnimatedMaterial>,
    /// Animations of the nodes.
    pub animations: Vec<Animation>,
    /// The world's empty mesh, used by hidden objects.
    pub hidden_mesh: usize,
}

/// A node of the tree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Index of the parent; `None` for a root.
    pub parent: Option<usize>,
    /// parent_from_node.
    pub transform: Transform,
    /// False hides it and all nodes below it.
    pub visible: bool,
    /// How much of each morph target its mesh has.
    pub weights: Vec<f32>,
}

/// The transform of a node: a matrix, or translation, rotation and scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Transform {
    /// Cannot be animated.
    Matrix(DAffine3),
    /// Translation * rotation * scale.
    Trs {
        /// In the parent's coordinates.
        translation: DVec3,
        /// A unit quaternion.
        rotation: DQuat,
        /// Per axis.
        scale: DVec3,
    },
}

impl Transform {
    /// As a matrix.
    pub fn parent_from_node(&self) -> DAffine3 {
        match self {
            Self::Matrix(matrix) => *matrix,
            Self::Trs { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(*scale, *rotation, *translation)
            }
        }
    }
}

/// Joints that bend meshes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skin {
    /// Node of each joint.
    pub joints: Vec<usize>,
    /// joint_from_mesh of each, in the pose in which the mesh was made.
    pub inverse_bind: Vec<DAffine3>,
}

/// An object that hangs on a node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeObject {
    /// Index into the world's objects.
    pub object: usize,
    /// Index into [`NodeTree::nodes`].
    pub node: usize,
    /// The mesh in the node's coordinates, for one of several instances.
    pub node_from_mesh: DAffine3,
    /// The world's mesh that the object shows when it is visible.
    pub mesh: usize,
    /// The mesh with its targets and joints, if it is deformable.
    pub deformable: Option<Arc<DeformableMesh>>,
    /// Index into [`NodeTree::skins`].
    pub skin: Option<usize>,
    /// The mesh at rest.
    pub rest: Option<Arc<Mesh>>,
}

/// Channels that run together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Animation {
    /// Empty if absent.
    pub name: String,
    /// All of them.
    pub channels: Vec<Channel>,
}

impl Animation {
    /// The time of its last keyframe, in seconds.
    pub fn duration(&self) -> f64 {
        let ends = self.channels.iter().map(|channel| channel.sampler.end_time());
        ends.fold(0.0, f64::max)
    }
}

/// A value over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// The animated property.
    pub target: AnimationTarget,
    /// How.
    pub sampler: Arc<AnimationSampler>,
}

/// A property that a channel animates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum AnimationTarget {
    /// Three numbers, of the node of this index.
    Translation(usize),
    /// A quaternion x, y, z, w, of the node of this index.
    Rotation(usize),
    /// Three numbers, of the node of this index.
    Scale(usize),
    /// One weight a morph target, of the node of this index.
    Weights(usize),
    /// Visibility of the node of this index: 0 hides it.
    Visible(usize),
    /// A property of the material of this index.
    Material(usize, MaterialProperty),
    /// A property of all lights of a definition.
    Light(usize, LightProperty),
    /// Vertical field of view of all cameras of a definition, in radians.
    FieldOfView(usize),
    /// Half the width (0) or height (1) that an orthographic camera of this definition sees, in units of the world.
    Magnification(usize, usize),
}

impl AnimationTarget {
    /// How many numbers it needs at least.
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
    fn a_transform_scales_before_it_rotates_and_translates() {
        let transform = Transform::Trs {
            translation: DVec3::new(10.0, 0.0, 0.0),
            rotation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
            scale: DVec3::new(2.0, 3.0, 4.0),
        };
        let point = transform.parent_from_node().transform_point3(DVec3::X);
        assert!((point - DVec3::new(10.0, 2.0, 0.0)).length() < 1e-12, "{point}");
    }
}
