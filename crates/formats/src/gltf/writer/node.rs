//! Nodes: what stands where. A world that moves keeps the tree it moves by; others are flat.

use std::sync::Arc;

use glam::DAffine3;
use raycam_scene::World;
use raycam_scene::animation::{NodeTree, Transform};
use serde_json::{Map, Value, json};

use super::mesh::SlotVariants;
use crate::gltf::writer::{Writer, transform};

impl Writer<'_> {
    /// Adds everything there is, and returns the roots.
    pub(super) fn nodes(&mut self, rig: Option<&NodeTree>) -> Vec<usize> {
        let world = self.world;
        let mut done = [
            vec![false; world.objects.len()],
            vec![false; world.lights.len()],
            vec![false; world.cameras.len()],
        ];
        let mut roots = Vec::new();
        if let Some(rig) = rig {
            self.tree(rig, &mut done, &mut roots);
        }
        let [objects, lights, cameras] = done;
        for (i, object) in world
            .objects
            .iter()
            .enumerate()
            .filter(|(i, _)| !objects[*i])
        {
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
        for (_, camera) in world
            .cameras
            .iter()
            .enumerate()
            .filter(|(i, _)| !cameras[*i])
        {
            if let Some((index, world_from_node)) = self.camera(camera) {
                let leaf = json!({ "name": camera.name, "camera": index });
                roots.push(self.placed(world_from_node, leaf));
            }
        }
        roots
    }

    /// What moves the world, where it is as its animations find it: another moment is written as it stands.
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
        self.note("a moment of an animation: written as it stands, without the animation".into());
        None
    }

    /// The tree of a rig, at the same indices, and what hangs on it.
    fn tree(&mut self, rig: &NodeTree, done: &mut [Vec<bool>; 3], roots: &mut Vec<usize>) {
        let world = self.world;
        let mut nodes: Vec<Map<String, Value>> = Vec::new();
        for node in &rig.nodes {
            let mut json = match &node.transform {
                Transform::Trs {
                    translation,
                    rotation,
                    scale,
                } => transform::parts(*translation, *rotation, *scale),
                Transform::Matrix(matrix) => {
                    let matrix = glam::DMat4::from(*matrix).to_cols_array().to_vec();
                    Map::from_iter([("matrix".into(), json!(matrix))])
                }
            };
            if !node.visible {
                let hidden = json!({ "visible": false });
                self.extend(&mut json, "KHR_node_visibility", hidden);
            }
            nodes.push(json);
        }
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
        for (i, node) in rig.nodes.iter().enumerate() {
            match node.parent {
                Some(parent) => children[parent].push(i),
                None => roots.push(i),
            }
        }
        // A node carries one of each kind; more of them get nodes of their own below it.
        let mut more: Vec<(usize, Map<String, Value>)> = Vec::new();
        let mut hang = |nodes: &mut Vec<Map<String, Value>>,
                        on: usize,
                        key: &str,
                        leaf: Map<String, Value>,
                        place: DAffine3| {
            if place == DAffine3::IDENTITY && !nodes[on].contains_key(key) {
                nodes[on].extend(leaf);
                return;
            }
            let mut json = transform::nodes(place)
                .into_iter()
                .next()
                .unwrap_or_default();
            json.extend(leaf);
            more.push((on, json));
        };
        for mount in &rig.objects {
            let object = &world.objects[mount.object];
            done[0][mount.object] = true;
            let shape = mount.deformable.as_deref();
            let mesh = shape.map_or(&world.meshes[mount.mesh], |shape| &shape.mesh);
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
            hang(&mut nodes, mount.node, "mesh", leaf, mount.node_from_mesh);
        }
        for mount in &rig.lights {
            done[1][mount.light] = true;
            let base = &world.lights[mount.light];
            if let Some(placed) = self.light(mount.light, base) {
                let mut leaf = Map::new();
                let light = json!({ "light": placed.index });
                self.extend(&mut leaf, "KHR_lights_punctual", light);
                self.light_definition.push((mount.definition, placed.index));
                hang(
                    &mut nodes,
                    mount.node,
                    "extensions",
                    leaf,
                    DAffine3::IDENTITY,
                );
            }
        }
        for mount in &rig.cameras {
            done[2][mount.camera] = true;
            let camera = &world.cameras[mount.camera];
            let Some((index, _)) = self.camera(camera) else {
                continue;
            };
            self.camera_definition.push((mount.definition, index));
            let mut leaf = Map::new();
            leaf.insert("camera".into(), json!(index));
            if !nodes[mount.node].contains_key("name") {
                leaf.insert("name".into(), json!(camera.name));
            }
            hang(&mut nodes, mount.node, "camera", leaf, DAffine3::IDENTITY);
        }
        let count = nodes.len();
        for (i, (on, _)) in more.iter().enumerate() {
            children[*on].push(count + i);
        }
        for (json, children) in nodes.iter_mut().zip(children) {
            if !children.is_empty() {
                json.insert("children".into(), json!(children));
            }
        }
        for json in nodes
            .into_iter()
            .chain(more.into_iter().map(|(_, json)| json))
        {
            self.push("nodes", json);
        }
        for skin in &rig.skins {
            let column = |m: &DAffine3| glam::DMat4::from(*m).as_mat4().to_cols_array();
            let matrices: Vec<_> = skin.inverse_bind.iter().map(column).collect();
            let other = super::binary::BufferTarget::Other;
            let matrices = self.binary.floats(&matrices, other, false);
            let json = json!({ "joints": skin.joints, "inverseBindMatrices": matrices });
            self.push("skins", json);
        }
    }

    /// A node at a place, or two of them; the index of the upper one.
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

    /// What materials an object has in the variants, by slot.
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
