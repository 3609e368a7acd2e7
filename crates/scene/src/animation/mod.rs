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

use crate::error::SceneError;
use crate::mesh::Mesh;
use crate::world::World;

/// What a world needs to move.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeTree {
    /// The tree.
    pub nodes: Vec<Node>,
    /// Indices of all nodes, parents before children.
    pub order: Vec<usize>,
    /// What bends meshes.
    pub skins: Vec<Skin>,
    /// The objects that hang on nodes.
    pub objects: Vec<NodeObject>,
    /// The lights that hang on nodes.
    pub lights: Vec<NodeLight>,
    /// The cameras that hang on nodes.
    pub cameras: Vec<NodeCamera>,
    /// The materials that move.
    pub materials: Vec<AnimatedMaterial>,
    /// What moves the nodes.
    pub animations: Vec<Animation>,
    /// The world's mesh that cannot be seen: what hidden objects show.
    #[serde(rename = "nothing")]
    pub hidden_mesh: usize,
}

/// A node of the tree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// What it moves with.
    pub parent: Option<usize>,
    /// Where it is in its parent.
    pub transform: Transform,
    /// Whether it and what is below it can be seen.
    pub visible: bool,
    /// How much of each morph target its mesh has.
    pub weights: Vec<f32>,
}

/// Where a node is: a matrix, or its parts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Transform {
    /// Cannot be animated.
    Matrix(DAffine3),
    /// Translation * rotation * scale.
    #[serde(rename = "Parts")]
    Trs {
        /// In the parent's coordinates.
        translation: DVec3,
        /// Of unit length.
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
            Self::Trs {
                translation,
                rotation,
                scale,
            } => DAffine3::from_scale_rotation_translation(*scale, *rotation, *translation),
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
    /// The mesh in the node's coordinates, where it is an instance of several.
    pub node_from_mesh: DAffine3,
    /// The world's mesh that the object shows when it is not hidden; its own where it has a shape.
    pub mesh: usize,
    /// What bends, where the mesh does.
    #[serde(rename = "shape")]
    pub deformable: Option<Arc<DeformableMesh>>,
    /// Index into [`NodeTree::skins`].
    pub skin: Option<usize>,
    /// The mesh as it is when nothing has moved yet.
    pub rest: Option<Arc<Mesh>>,
}

/// Channels that run together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Animation {
    /// Empty where it has none.
    pub name: String,
    /// All of them.
    pub channels: Vec<Channel>,
}

impl Animation {
    /// The time of its last keyframe, in seconds.
    pub fn duration(&self) -> f64 {
        let ends = self
            .channels
            .iter()
            .map(|channel| channel.sampler.end_time());
        ends.fold(0.0, f64::max)
    }
}

/// A value over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// What it moves.
    pub target: AnimationTarget,
    /// How.
    pub sampler: Arc<AnimationSampler>,
}

/// What a channel moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum AnimationTarget {
    /// Of a node: three numbers.
    Translation(usize),
    /// Of a node: a quaternion x, y, z, w.
    Rotation(usize),
    /// Of a node: three numbers.
    Scale(usize),
    /// Of a node: as many as its mesh has morph targets.
    Weights(usize),
    /// Of a node: not 0 where it can be seen.
    Visible(usize),
    /// Of a material.
    Material(usize, MaterialProperty),
    /// Of all lights of a definition.
    Light(usize, LightProperty),
    /// Of all cameras of a definition: their vertical field of view in radians.
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
                P::EmissionColor
                | P::SpecularColor
                | P::AttenuationColor
                | P::SheenColor
                | P::DiffuseTransmissionColor,
            ) => 3,
            Self::Material(_, P::Uv(_, UvProperty::Offset | UvProperty::Scale)) => 2,
            _ => 1,
        }
    }
}

impl NodeTree {
    /// Whether every index leads somewhere, in a world with so many objects, meshes, lights, cameras and materials.
    ///
    /// # Errors
    /// [`SceneError::World`] where one does not.
    pub(crate) fn validate(&self, world: &World) -> Result<(), SceneError> {
        let nodes = self.nodes.len();
        let node = |node: usize| node < nodes;
        let in_skin = |skin: &Skin| {
            skin.joints.iter().all(|&joint| node(joint))
                && skin.joints.len() == skin.inverse_bind.len()
        };
        let mounted = |mount: &NodeObject| {
            mount.object < world.objects.len()
                && node(mount.node)
                && mount.mesh < world.meshes.len()
                && mount.skin.is_none_or(|skin| skin < self.skins.len())
        };
        let light = |mount: &NodeLight| mount.light < world.lights.len() && node(mount.node);
        let camera = |mount: &NodeCamera| mount.camera < world.cameras.len() && node(mount.node);
        let moving = |moving: &AnimatedMaterial| moving.material < world.materials.len();
        let shows_nothing = self.animations.is_empty() || self.hidden_mesh < world.meshes.len();
        let good = self.order.iter().all(|&i| node(i))
            && self.nodes.iter().all(|n| n.parent.is_none_or(node))
            && self.skins.iter().all(in_skin)
            && self.objects.iter().all(mounted)
            && self.lights.iter().all(light)
            && self.cameras.iter().all(camera)
            && self.materials.iter().all(moving)
            && shows_nothing;
        if good {
            return Ok(());
        }
        let message = "an animation that moves what the world does not have";
        Err(SceneError::World(message.into()))
    }
}
