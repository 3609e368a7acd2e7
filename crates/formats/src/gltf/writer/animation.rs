//! Animations: channels of nodes, and `KHR_animation_pointer` for other properties.

use std::collections::HashMap;
use std::sync::Arc;

use raycam_scene::NoticeCode;
use raycam_scene::animation::{
    Animation, AnimationSampler, AnimationTarget, MaterialProperty, NodeTree, SamplerInterpolation,
};
use serde_json::{Value, json};

use crate::gltf::world::animation_pointer::{
    CAMERA_PROPERTIES, LIGHT_PATH, LIGHT_PROPERTIES, MATERIAL_PROPERTIES, TEXTURES, UV_PROPERTIES,
};
use crate::gltf::writer::binary::BufferTarget;
use crate::gltf::writer::document::Writer;

impl Writer<'_> {
    /// Writes all animations of the node tree.
    pub(super) fn animations(&mut self, rig: &NodeTree) {
        for animation in &rig.animations {
            let (mut samplers, mut channels) = (Vec::new(), Vec::new());
            let mut known = HashMap::new();
            for channel in &animation.channels {
                let rotation = matches!(channel.target, AnimationTarget::Rotation(_));
                let weights = matches!(channel.target, AnimationTarget::Weights(_));
                let targets = self.channel_targets(channel.target, rig);
                if targets.is_empty() {
                    self.note(
                        NoticeCode::IgnoredAnimation,
                        format!(
                            "animation {:?}: a channel is omitted, because its target is not written",
                            animation.name
                        ),
                    );
                    continue;
                }
                let key = (Arc::as_ptr(&channel.sampler), rotation, weights);
                let sampler = *known.entry(key).or_insert_with(|| {
                    samplers.push(self.sampler(&channel.sampler, weights));
                    samplers.len() - 1
                });
                for target in targets {
                    channels.push(json!({ "sampler": sampler, "target": target }));
                }
            }
            if channels.is_empty() {
                self.note(
                    NoticeCode::IgnoredAnimation,
                    format!("animation {:?} omitted: none of its targets exist", animation.name),
                );
                continue;
            }
            let Animation { name, .. } = animation;
            let mut json = json!({ "samplers": samplers, "channels": channels });
            if !name.is_empty() {
                json["name"] = json!(name);
            }
            self.push("animations", json);
        }
    }

    fn sampler(&mut self, sampler: &AnimationSampler, weights: bool) -> Value {
        let times: Vec<[f32; 1]> = sampler.times().iter().map(|&time| [time]).collect();
        let (values, other) = (sampler.values(), BufferTarget::Other);
        let input = self.binary.floats(&times, other, true);
        let output = match sampler.width() {
            2 if !weights => self.binary.floats(values.as_chunks::<2>().0, other, false),
            3 if !weights => self.binary.floats(values.as_chunks::<3>().0, other, false),
            4 if !weights => self.binary.floats(values.as_chunks::<4>().0, other, false),
            _ => self.binary.floats(values.as_chunks::<1>().0, other, false),
        };
        let interpolation = match sampler.interpolation() {
            SamplerInterpolation::Step => "STEP",
            SamplerInterpolation::Linear => "LINEAR",
            SamplerInterpolation::CubicSpline => "CUBICSPLINE",
        };
        json!({ "input": input, "output": output, "interpolation": interpolation })
    }

    /// Targets of a channel in the file; lights and cameras may have several.
    fn channel_targets(&mut self, target: AnimationTarget, rig: &NodeTree) -> Vec<Value> {
        let node = |node: usize, path: &str| vec![json!({ "node": node, "path": path })];
        let pointers = match target {
            AnimationTarget::Translation(i) => return node(i, "translation"),
            AnimationTarget::Rotation(i) => return node(i, "rotation"),
            AnimationTarget::Scale(i) => return node(i, "scale"),
            AnimationTarget::Weights(i) => {
                let mounted = |mount: &raycam_scene::animation::NodeObject| {
                    mount.node == i && mount.node_from_mesh == glam::DAffine3::IDENTITY
                };
                let found = rig.objects.iter().any(mounted);
                return if found { node(i, "weights") } else { Vec::new() };
            }
            AnimationTarget::Visible(i) => {
                vec![format!("/nodes/{i}/extensions/KHR_node_visibility/visible")]
            }
            AnimationTarget::Material(i, property) => {
                let path = material_path(property);
                path.iter().map(|path| format!("/materials/{i}/{path}")).collect()
            }
            AnimationTarget::Light(definition, property) => {
                let path = LIGHT_PROPERTIES.iter().find(|(_, other)| *other == property);
                let path = path.map_or("", |(path, _)| path);
                let copies = self.light_definition.iter().filter(|(of, _)| *of == definition);
                copies.map(|(_, i)| format!("{LIGHT_PATH}{i}/{path}")).collect()
            }
            AnimationTarget::FieldOfView(definition) | AnimationTarget::Magnification(definition, _) => {
                let path = CAMERA_PROPERTIES.iter().find(|(_, of)| of(definition) == target);
                let path = path.map_or("", |(path, _)| path);
                let copies = self.camera_definition.iter().filter(|(of, _)| *of == definition);
                copies.map(|(_, i)| format!("/cameras/{i}/{path}")).collect()
            }
        };
        let pointer = |pointer: &String| {
            let extension = json!({ "KHR_animation_pointer": { "pointer": pointer } });
            json!({ "path": "pointer", "extensions": extension })
        };
        if !pointers.is_empty() {
            self.extensions.insert("KHR_animation_pointer");
        }
        pointers.iter().map(pointer).collect()
    }
}

/// Path of a property below its material.
fn material_path(property: MaterialProperty) -> Option<String> {
    if let MaterialProperty::Uv(used, part) = property {
        let (texture, ..) = TEXTURES.iter().find(|(_, other, _)| *other == used)?;
        let (part, _) = UV_PROPERTIES.iter().find(|(_, other)| *other == part)?;
        return Some(format!("{texture}{part}"));
    }
    let (path, _) = MATERIAL_PROPERTIES.iter().find(|(_, other)| *other == property)?;
    Some((*path).into())
}
