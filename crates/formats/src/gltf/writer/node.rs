//! Nodes, which place objects, lights and cameras. An animated world keeps its node tree; in other worlds,
//! all nodes are roots.

use std::sync::Arc;

use glam::DAffine3;
use raycam_scene::animation::{Node, NodeTree, Transform};
use raycam_scene::{NoticeCode, World};
use serde_json::{Map, Value, json};

use crate::gltf::writer::document::Writer;
use crate::gltf::writer::mesh::SlotVariants;
use crate::gltf::writer::transform;

/// Nodes under construction.
struct NodeList {
    nodes: Vec<Map<String, Value>>,
    /// Child nodes that are not part of `nodes` yet, each with the index of its parent.
    below: Vec<(usize, Map<String, Value>)>,
}

impl NodeList {
    /// Attaches a mesh, light or camera (`leaf`) to a node, under `key`. If the node already has this key, or if the
    /// leaf's pose differs from the node's, the leaf is placed in a new child of the node.
    fn attach(&mut self, node: usize, key: &str, leaf: Map<String, Value>, place: DAffine3) {
        if place == DAffine3::IDENTITY && !self.nodes[node].contains_key(key) {
            self.nodes[node].extend(leaf);
            return;
        }
        let mut json = transform::nodes(place).into_iter().next().unwrap_or_default();
        json.extend(leaf);
        self.below.push((node, json));
    }
}

impl Writer<'_> {
    /// Adds the nodes of all objects, lights and cameras; returns the indices of the root nodes.
    pub(super) fn nodes(&mut self, rig: Option<&NodeTree>) -> Vec<usize> {
        let world = self.world;
        let mut done =
            [vec![false; world.objects.len()], vec![false; world.lights.len()], vec![false; world.cameras.len()]];
        let mut roots = Vec::new();
        if let Some(rig) = rig {
            self.tree(rig, &mut done, &mut roots);
        }
        let [objects, lights, cameras] = done;
        for (i, object) in world.objects.iter().enumerate().filter(|(i, object)| object.visible && !objects[*i]) {
            let mesh = &world.meshes[object.mesh];
            let index = self.mesh(mesh, None, &object.materials, &self.variants(i), &[]);
            let leaf = json!({ "name": object.name, "mesh": index });
            roots.push(self.placed(object.world_from_mesh, leaf));
        }
        for (i, light) in world.lights.iter().enumerate().filter(|(i, _)| !lights[*i]) {
            if let Some(placed) = self.light(i, light) {
                let mut leaf = Map::new();
                let light = json!({ "light": placed.index });
                self.extend(&mut leaf, "KHR_lights_punctual", light);
                roots.push(self.placed(placed.world_from_node, leaf.into()));
            }
        }
        for (_, camera) in world.cameras.iter().enumerate().filter(|(i, _)| !cameras[*i]) {
            if let Some((index, world_from_node)) = self.camera(camera) {
                let leaf = json!({ "name": camera.name, "camera": index });
                roots.push(self.placed(world_from_node, leaf));
            }
        }
        roots
    }

    /// The world's node tree, if the world is in its rest state. A world at another time is written without the
    /// animation, with a notice.
    pub(super) fn rig(&mut self) -> Option<Arc<NodeTree>> {
        let rig = self.world.node_tree.clone()?;
        let rested = self.world.clone().at_rest().ok();
        let same = |rested: &World| {
            rested.objects == self.world.objects
                && rested.lights == self.world.lights
                && rested.cameras == self.world.cameras
                && rested.materials == self.world.materials
                && rested.meshes == self.world.meshes
        };
        if rested.as_ref().is_some_and(same) {
            return Some(rig);
        }
        self.note(NoticeCode::NotWritten, "the world is written at its current time, without the animation");
        None
    }

    /// Writes the nodes of the tree, with the same indices as in the tree, and the objects, lights and cameras that are
    /// attached to them.
    fn tree(&mut self, rig: &NodeTree, done: &mut [Vec<bool>; 3], roots: &mut Vec<usize>) {
        let nodes = rig.nodes.iter().map(|node| self.node_keys(node)).collect();
        let mut nodes = NodeList { nodes, below: Vec::new() };
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); rig.nodes.len()];
        for (i, node) in rig.nodes.iter().enumerate() {
            match node.parent {
                Some(parent) => children[parent].push(i),
                None => roots.push(i),
            }
        }
        let [objects, lights, cameras] = done;
        self.tree_objects(rig, &mut nodes, objects);
        self.tree_lights(rig, &mut nodes, lights);
        self.tree_cameras(rig, &mut nodes, cameras);
        let NodeList { mut nodes, below } = nodes;
        let count = nodes.len();
        for (i, (parent, _)) in below.iter().enumerate() {
            children[*parent].push(count + i);
        }
        for (json, children) in nodes.iter_mut().zip(children) {
            if !children.is_empty() {
                json.insert("children".into(), json!(children));
            }
        }
        let below = below.into_iter().map(|(_, json)| json);
        for json in nodes.into_iter().chain(below) {
            self.push("nodes", json);
        }
        for skin in &rig.skins {
            let column = |m: &DAffine3| glam::DMat4::from(*m).as_mat4().to_cols_array();
            let matrices: Vec<_> = skin.inverse_bind.iter().map(column).collect();
            let other = crate::gltf::writer::binary::BufferTarget::Other;
            let matrices = self.binary.floats(&matrices, other, false);
            let json = json!({ "joints": skin.joints, "inverseBindMatrices": matrices });
            self.push("skins", json);
        }
    }

    /// JSON keys for the transform and the visibility of a node.
    fn node_keys(&mut self, node: &Node) -> Map<String, Value> {
        let mut json = match &node.transform {
            Transform::Trs { translation, rotation, scale } => transform::parts(*translation, *rotation, *scale),
            Transform::Matrix(matrix) => {
                let matrix = glam::DMat4::from(*matrix).to_cols_array().to_vec();
                Map::from_iter([("matrix".into(), json!(matrix))])
            }
        };
        if !node.visible {
            let hidden = json!({ "visible": false });
            self.extend(&mut json, "KHR_node_visibility", hidden);
        }
        json
    }

    fn tree_objects(&mut self, rig: &NodeTree, nodes: &mut NodeList, done: &mut [bool]) {
        for mount in rig.objects.iter().filter(|mount| self.world.objects[mount.object].visible) {
            let object = &self.world.objects[mount.object];
            done[mount.object] = true;
            let shape = mount.deformable.as_deref();
            let mesh = shape.map_or(&self.world.meshes[mount.mesh], |shape| &shape.mesh);
            let variants = self.variants(mount.object);
            let weights = match shape {
                Some(shape) if !shape.targets.is_empty() => &rig.nodes[mount.node].weights[..],
                _ => &[],
            };
            let index = self.mesh(mesh, shape, &object.materials, &variants, weights);
            let mut leaf = Map::new();
            leaf.insert("name".into(), json!(object.name));
            leaf.insert("mesh".into(), json!(index));
            if let Some(skin) = mount.skin {
                leaf.insert("skin".into(), json!(skin));
            }
            nodes.attach(mount.node, "mesh", leaf, mount.node_from_mesh);
        }
    }

    fn tree_lights(&mut self, rig: &NodeTree, nodes: &mut NodeList, done: &mut [bool]) {
        for mount in &rig.lights {
            done[mount.light] = true;
            let base = &self.world.lights[mount.light];
            if let Some(placed) = self.light(mount.light, base) {
                let mut leaf = Map::new();
                let light = json!({ "light": placed.index });
                self.extend(&mut leaf, "KHR_lights_punctual", light);
                self.light_definition.push((mount.definition, placed.index));
                nodes.attach(mount.node, "extensions", leaf, DAffine3::IDENTITY);
            }
        }
    }

    fn tree_cameras(&mut self, rig: &NodeTree, nodes: &mut NodeList, done: &mut [bool]) {
        for mount in &rig.cameras {
            done[mount.camera] = true;
            let camera = &self.world.cameras[mount.camera];
            let Some((index, _)) = self.camera(camera) else { continue };
            self.camera_definition.push((mount.definition, index));
            let mut leaf = Map::new();
            leaf.insert("camera".into(), json!(index));
            if !nodes.nodes[mount.node].contains_key("name") {
                leaf.insert("name".into(), json!(camera.name));
            }
            nodes.attach(mount.node, "camera", leaf, DAffine3::IDENTITY);
        }
    }

    /// Adds the one or two nodes that represent this transform; returns the index of the outer node.
    fn placed(&mut self, world_from_node: DAffine3, leaf: Value) -> usize {
        let mut below = leaf;
        let mut index = 0;
        for mut json in transform::nodes(world_from_node).into_iter().rev() {
            if let Value::Object(leaf) = below {
                json.extend(leaf);
            }
            index = self.push("nodes", json);
            below = json!({ "children": [index] });
        }
        index
    }

    /// Returns the materials of an object in the world's variants.
    fn variants(&self, object: usize) -> SlotVariants {
        let mut found = SlotVariants::new();
        for (number, variant) in self.world.variants.iter().enumerate() {
            for &(other, slot, material) in &variant.materials {
                if other != object {
                    continue;
                }
                match found.iter_mut().find(|(known, _)| *known == slot) {
                    Some((_, pairs)) => pairs.push((number, material)),
                    None => found.push((slot, vec![(number, material)])),
                }
            }
        }
        found
    }
}
