//! Nodes: the tree of transforms, and the objects, cameras and lights attached to it.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, DVec4};
use raycam_scene::animation::{self as rig, NodeCamera, NodeObject, NodeTree, Transform};
use raycam_scene::world::Variant;
use raycam_scene::{ErrorCode, Mesh, NoticeCode, Object, World};

use crate::error::Result;
use crate::gltf::document::Document;
use crate::gltf::json::Node;
use crate::gltf::json::lenient::Lenient;
use crate::gltf::world::builder::Builder;
use crate::gltf::world::builder::ImportedMesh;

/// Path of the list of material variants in the document.
const VARIANTS: &str = "extensions.KHR_materials_variants.variants";

/// Order of the node tree: the indices of the nodes, parents before children, and the parent of each node.
struct NodeOrder {
    order: Vec<usize>,
    parents: Vec<Option<usize>>,
}

impl Builder<'_, '_> {
    /// Adds the objects, lights and cameras of the scene's nodes, in their rest state.
    pub(crate) fn nodes(&mut self) -> Result<()> {
        let document = self.document;
        let nodes = &document.root.nodes;
        let tree = document.node_order()?;
        let roots = self.scene_roots(&tree)?;
        let mut shown = vec![false; nodes.len()];
        for &root in &roots {
            shown[root] = true;
        }
        let mut rig = NodeTree { skins: self.skins()?, ..NodeTree::default() };
        for (i, node) in nodes.iter().enumerate() {
            if let Some(message) = node.transform_warning() {
                self.diagnostics.note(NoticeCode::InvalidFile, format!("nodes[{i}]"), message);
            }
            rig.nodes.push(rig::Node {
                parent: tree.parents[i],
                transform: self.rest_transform(i, node)?,
                visible: node.extensions.visibility.as_ref().is_none_or(|v| v.visible),
                weights: document.weights(node),
            });
        }
        let mut visible = vec![true; nodes.len()];
        let mut world_from_node = vec![DAffine3::IDENTITY; nodes.len()];
        for &i in &tree.order {
            let local = rig.nodes[i].transform.parent_from_node();
            (world_from_node[i], visible[i]) = match tree.parents[i] {
                Some(parent) => {
                    shown[i] |= shown[parent];
                    let seen = visible[parent] && rig.nodes[i].visible;
                    (world_from_node[parent] * local, seen)
                }
                None => (local, rig.nodes[i].visible),
            };
        }
        rig.order = tree.order;
        rig.animations = self.animations(&rig.nodes)?;
        let channels = rig.animations.iter().flat_map(|a| &a.channels);
        rig.materials = self.animated_materials(channels.map(|channel| channel.target));
        let moving = !rig.animations.is_empty();
        if moving {
            rig.hidden_mesh =
                self.world.add_mesh(Mesh { vertices: vec![DVec3::ZERO], triangles: vec![[0; 3]], ..Mesh::default() });
        }
        let variants = document.root.extensions.variants().iter();
        self.world.variants =
            variants.map(|variant| Variant { name: variant.name.clone(), materials: Vec::new() }).collect();
        // Nodes are added in the order of the document, because object ids are assigned in this order.
        for i in (0..nodes.len()).filter(|&i| shown[i]) {
            self.add_node(i, world_from_node[i], visible[i], &mut rig)?;
        }
        if moving || rig.objects.iter().any(|mount| mount.deformable.is_some()) {
            let world = World { node_tree: Some(Arc::new(rig)), ..std::mem::take(&mut self.world) };
            self.world = world.at_rest().map_err(|error| document.scene("nodes", error))?;
            self.world.node_tree = self.world.node_tree.take().filter(|_| moving);
        }
        Ok(())
    }

    /// Transform of a node in its rest state; invalid values are omitted, with a notice.
    fn rest_transform(&mut self, i: usize, node: &Node) -> Result<Transform> {
        if let Some(matrix) = node.matrix {
            let matrix = DMat4::from_cols_array(&matrix);
            let place = format!("nodes[{i}].matrix");
            let affine = if matrix.row(3) == DVec4::W && matrix.is_finite() {
                Ok(DAffine3::from_mat4(matrix))
            } else {
                let message = format!("its last row is {}; expected 0 0 0 1 (NODE_MATRIX_NON_TRS)", matrix.row(3));
                Err(self.document.fault(ErrorCode::InvalidMatrix, message))
            };
            let affine = self.or_omitted(&place, "the matrix", affine)?;
            return Ok(Transform::Matrix(affine.unwrap_or(DAffine3::IDENTITY)));
        }
        let xyzw = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let rotation = normalize_quaternion(xyzw).ok_or_else(|| {
            self.document.fault(ErrorCode::NotARotation, format!("{xyzw:?} has no direction (ROTATION_NON_UNIT)"))
        });
        let rotation = self.or_omitted(&format!("nodes[{i}].rotation"), "the rotation", rotation)?;
        Ok(Transform::Trs {
            translation: DVec3::from(node.translation.unwrap_or_default()),
            rotation: rotation.unwrap_or(DQuat::IDENTITY),
            scale: DVec3::from(node.scale.unwrap_or([1.0; 3])),
        })
    }

    /// Adds the camera, the light and the objects of node `i`.
    fn add_node(&mut self, i: usize, transform: DAffine3, visible: bool, rig: &mut NodeTree) -> Result<()> {
        let node = &self.document.root.nodes[i];
        let moving = !rig.animations.is_empty();
        let place = format!("nodes[{i}]");
        let at = format!("{place}.camera");
        let camera = match &node.camera {
            None => None,
            Some(Lenient::Valid(camera)) => Some(*camera),
            Some(Lenient::Faulty(fault)) => {
                let fault = Err(self.document.fault(ErrorCode::WrongType, format!("{fault} (TYPE_MISMATCH)")));
                self.or_omitted(&at, "the camera", fault)?
            }
        };
        if let Some(camera) = camera {
            let added = self.camera(&at, camera, &node.name, transform);
            let added = self.or_omitted(&at, "the camera", added)?;
            rig.cameras.extend(added.flatten().map(|added| NodeCamera {
                camera: added,
                node: i,
                definition: camera,
                base: self.world.cameras[added].camera.clone(),
            }));
        }
        if !visible && (node.mesh.is_some() || node.extensions.light.is_some()) {
            self.diagnostics.note(NoticeCode::HiddenPart, &place, "hidden by KHR_node_visibility");
        }
        if let Some(light) = node.extensions.light.as_ref().filter(|_| visible) {
            let place = format!("{place}.extensions.KHR_lights_punctual.light");
            let added = match light {
                Lenient::Valid(light) => self.light(&place, light.light, i, transform),
                Lenient::Faulty(fault) => {
                    Err(self.document.fault(ErrorCode::WrongType, format!("{fault} (TYPE_MISMATCH)")))
                }
            };
            rig.lights.extend(self.or_omitted(&place, "the light", added)?.flatten());
        }
        if let Some(mesh) = node.mesh.filter(|_| visible || moving)
            && let Some(imported) = self.mesh(&format!("{place}.mesh"), mesh)?
        {
            self.objects(i, &imported, transform, rig)?;
        }
        Ok(())
    }

    /// Nodes of the scene to show: the default scene, otherwise the first, otherwise all nodes.
    fn scene_roots(&mut self, tree: &NodeOrder) -> Result<Vec<usize>> {
        let document = self.document;
        let root = &document.root;
        let index = match root.scene {
            Some(index) => index,
            None if root.scenes.is_empty() => {
                return Ok((0..root.nodes.len()).filter(|&i| tree.parents[i].is_none()).collect());
            }
            None => 0,
        };
        let scene = document.get(&root.scenes, index, "scene", "scenes")?;
        if root.scenes.len() > 1 {
            let message = format!(
                "scene {index} {:?} is shown (the default); the file contains {} scenes",
                scene.name,
                root.scenes.len()
            );
            self.diagnostics.note(NoticeCode::FirstOnly, "scenes", message);
        }
        for (i, &node) in scene.nodes.iter().enumerate() {
            let place = format!("scenes[{index}].nodes[{i}]");
            document.get(&root.nodes, node, &place, "nodes")?;
            if tree.parents[node].is_some() {
                self.diagnostics.note(
                    NoticeCode::InvalidFile,
                    place,
                    "a scene refers to a node that has a parent \
                    (SCENE_NON_ROOT_NODE)",
                );
            }
        }
        Ok(scene.nodes.clone())
    }

    /// Creates the object of a node, or an object for each instance of the node.
    fn objects(
        &mut self,
        index: usize,
        imported: &ImportedMesh,
        world_from_node: DAffine3,
        rig: &mut NodeTree,
    ) -> Result<()> {
        let document = self.document;
        let (place, node) = (&format!("nodes[{index}]"), &document.root.nodes[index]);
        let mesh_name = node.mesh.and_then(|mesh| document.root.meshes.get(mesh));
        let mesh_name = mesh_name.map_or("", |mesh| &mesh.name);
        let name = match (&node.name[..], mesh_name) {
            ("", "") => place,
            ("", name) => name,
            (name, _) => name,
        };
        let skin = self.skin_of_node(place, node, rig)?;
        let moving = !rig.animations.is_empty();
        let shape = imported.shape.as_ref();
        let skin = skin.filter(|_| shape.is_some_and(|shape| !shape.joints.is_empty()));
        for node_from_mesh in self.instances(place, node)? {
            let mut world_from_mesh = world_from_node * node_from_mesh;
            let mut mesh = imported.mesh;
            let flat = !world_from_mesh.inverse().is_finite();
            if skin.is_some() {
                world_from_mesh = DAffine3::IDENTITY;
            } else if flat && moving {
                // The flat scale is removed from the rest state, because the animation applies it at the times at which
                // the node is flat.
                world_from_mesh.matrix3 = DMat3::IDENTITY;
            } else if flat {
                let whole = self.world.meshes[mesh].clone();
                let size = whole.vertices.len() + whole.triangles.len();
                document.charge(place, size as u64, 64)?;
                match rig::flattened(&whole, world_from_mesh) {
                    Some(_) if shape.is_some() => world_from_mesh.matrix3 = DMat3::IDENTITY,
                    Some(flat) => {
                        mesh = self.world.add_mesh(flat);
                        world_from_mesh = DAffine3::IDENTITY;
                    }
                    None => {
                        let message = "mesh omitted: the node's transform flattens it to a line or a point";
                        self.diagnostics.note(NoticeCode::DroppedGeometry, place, message);
                        continue;
                    }
                }
            }
            // Each deformed object requires its own mesh; the first object uses the imported mesh.
            if let Some(shape) = shape
                && rig.objects.iter().any(|mount| mount.mesh == mesh)
            {
                let size = shape.mesh.vertices.len() + shape.mesh.triangles.len();
                document.charge(place, size as u64, 64)?;
                self.world.meshes.push(shape.mesh.clone());
                mesh = self.world.meshes.len() - 1;
            }
            let materials = imported.materials.clone();
            let object = Object::new(name, mesh, materials, world_from_mesh);
            let object = self.world.add_object(object).map_err(|error| document.scene(place, error))?;
            self.apply_variants(object, node, imported)?;
            if moving || shape.is_some() {
                rig.objects.push(NodeObject {
                    object,
                    node: index,
                    node_from_mesh,
                    mesh,
                    deformable: shape.cloned(),
                    skin,
                    rest: None,
                });
            }
        }
        Ok(())
    }

    /// Index of a node's skin; `None` for a node without a skin, and for an invalid skin, which causes a notice.
    fn skin_of_node(&mut self, place: &str, node: &Node, rig: &NodeTree) -> Result<Option<usize>> {
        let Some(skin) = node.skin else { return Ok(None) };
        let place = format!("{place}.skin");
        let found = self.document.get(&rig.skins, skin, &place, "skins").map(|skin| !skin.joints.is_empty());
        Ok(self.or_omitted(&place, "the skin", found)?.filter(|valid| *valid).map(|_| skin))
    }

    /// Sets the materials of an object in each variant (`KHR_materials_variants`).
    fn apply_variants(&mut self, object: usize, node: &Node, imported: &ImportedMesh) -> Result<()> {
        let document = self.document;
        let mesh = node.mesh.and_then(|mesh| document.root.meshes.get(mesh));
        for (slot, &primitive) in imported.primitives.iter().enumerate() {
            let json = mesh.and_then(|mesh| mesh.primitives.get(primitive));
            let mappings = json.and_then(|json| json.extensions.variants.as_ref());
            for mapping in mappings.iter().flat_map(|ext| &ext.mappings) {
                let place = "meshes.primitives.extensions.KHR_materials_variants";
                let material = self.material_index(place, Some(mapping.material));
                let Some(material) = self.or_omitted(place, "the variant's material", material)? else { continue };
                for &variant in &mapping.variants {
                    let count = self.world.variants.len();
                    match self.world.variants.get_mut(variant) {
                        Some(variant) => variant.materials.push((object, slot, material)),
                        None => {
                            let fault = Err::<(), _>(document.unresolved(place, VARIANTS, variant, count));
                            self.or_omitted(place, "the variant", fault)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Instances of `EXT_mesh_gpu_instancing`; a node without this extension has one instance at its own position.
    fn instances(&mut self, place: &str, node: &Node) -> Result<Vec<DAffine3>> {
        let document = self.document;
        let Some(attributes) = node.extensions.instances() else { return Ok(vec![DAffine3::IDENTITY]) };
        let place = format!("{place}.extensions.EXT_mesh_gpu_instancing.attributes");
        let (mut translations, mut rotations, mut scales) = (None, None, None);
        let mut count = None;
        for (name, &index) in attributes {
            let place = format!("{place}.{name}");
            if !matches!(&name[..], "TRANSLATION" | "ROTATION" | "SCALE") {
                self.diagnostics.note(NoticeCode::IgnoredKey, place, "ignored");
                continue;
            }
            let elements = document.elements(index, &place)?;
            if *count.get_or_insert(elements.count) != elements.count {
                return Err(document.fault(
                    ErrorCode::WrongShape,
                    format!("{place}: {} elements; expected as many as in the other attributes", elements.count),
                ));
            }
            // An instance is a separate object, which takes more memory than a vertex.
            let amount = 16 * elements.count as u64;
            self.assets.budget.take_elements(document.path, amount)?;
            match &name[..] {
                "TRANSLATION" => translations = Some(elements.floats::<3>()?),
                "ROTATION" => rotations = Some(elements.floats::<4>()?),
                _ => scales = Some(elements.floats::<3>()?),
            }
        }
        let count = count.unwrap_or(0);
        document.charge(&place, count as u64, 512)?;
        let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        Ok((0..count)
            .map(|i| {
                let translation = translations.as_ref().map_or(DVec3::ZERO, |all| wide(all[i]));
                let scale = scales.as_ref().map_or(DVec3::ONE, |all| wide(all[i]));
                let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |all| {
                    normalize_quaternion(all[i].map(f64::from)).unwrap_or(DQuat::IDENTITY)
                });
                DAffine3::from_scale_rotation_translation(scale, rotation, translation)
            })
            .collect())
    }
}

/// Rotation of a quaternion that is not 0.
fn normalize_quaternion(xyzw: [f64; 4]) -> Option<DQuat> {
    let quaternion = DVec4::from_array(xyzw).try_normalize()?;
    Some(DQuat::from_vec4(quaternion))
}

impl Document<'_> {
    /// Validates the tree of nodes, and returns its order: each node has at most one parent, and no node is its own
    /// ancestor.
    fn node_order(&self) -> Result<NodeOrder> {
        let nodes = &self.root.nodes;
        let mut parents = vec![None; nodes.len()];
        for (i, node) in nodes.iter().enumerate() {
            for (j, &child) in node.children.iter().enumerate() {
                let place = format!("nodes[{i}].children[{j}]");
                self.get(nodes, child, &place, "nodes")?;
                if let Some(other) = parents[child].replace(i) {
                    return Err(self.fault(
                        ErrorCode::CyclicReference,
                        format!("{place}: node {child} is also a child of nodes[{other}] (NODE_PARENT_OVERRIDE)"),
                    ));
                }
            }
        }
        let mut order: Vec<usize> = (0..nodes.len()).filter(|&i| parents[i].is_none()).collect();
        let mut next = 0;
        while let Some(&i) = order.get(next) {
            order.extend(&nodes[i].children);
            next += 1;
        }
        if order.len() < nodes.len() {
            let mut reached = vec![false; nodes.len()];
            order.iter().for_each(|&i| reached[i] = true);
            let i = reached.iter().position(|reached| !reached).unwrap_or(0);
            let message = format!("nodes[{i}] belongs to a loop of nodes (NODE_LOOP)");
            return Err(self.fault(ErrorCode::CyclicReference, message));
        }
        Ok(NodeOrder { order, parents })
    }

    /// Weights of a node's morph targets: the node's own weights, otherwise the mesh's weights, otherwise 0.
    fn weights(&self, node: &Node) -> Vec<f32> {
        let mesh = node.mesh.and_then(|mesh| self.root.meshes.get(mesh));
        let targets = mesh.into_iter().flat_map(|mesh| &mesh.primitives);
        let count = targets.map(|primitive| primitive.targets.len()).max();
        let given = node.weights.as_ref();
        let given = given.or(mesh.and_then(|mesh| mesh.weights.as_ref()));
        let mut weights = given.cloned().unwrap_or_default();
        weights.resize(count.unwrap_or(0), 0.0);
        weights
    }
}
