//! Animations, including `KHR_animation_pointer`.

use std::sync::Arc;

use raycam_scene::animation::{
    Animation, AnimationSampler, AnimationTarget, Channel, Node, SamplerInterpolation, Transform,
};
use raycam_scene::{ErrorCode, NoticeCode};

use crate::error::Result;
use crate::gltf::json;
use crate::gltf::world::builder::Builder;

impl Builder<'_, '_> {
    /// All animations of the document; `nodes` are the document's nodes.
    pub(crate) fn animations(&mut self, nodes: &[Node]) -> Result<Vec<Animation>> {
        let document = self.document;
        let mut animations = Vec::new();
        for i in 0..document.root.animations.len() {
            let place = format!("animations[{i}]");
            let json = document.get_valid(&document.root.animations, i, &place, "animations");
            let Some(json) = self.or_omitted(&place, "the animation", json)? else { continue };
            let mut channels = Vec::new();
            for j in 0..json.channels.len() {
                let read = self.channel(&place, json, j, nodes);
                let read = self.or_omitted(&format!("{place}.channels[{j}]"), "the channel", read)?;
                channels.extend(read.unwrap_or_default());
            }
            animations.push(Animation { name: json.name.clone(), channels });
        }
        Ok(animations)
    }

    /// Creates the world's channels, one per target, for channel `index` of an animation.
    fn channel(
        &mut self,
        animation: &str,
        json: &json::Animation,
        index: usize,
        nodes: &[Node],
    ) -> Result<Vec<Channel>> {
        let document = self.document;
        let place = format!("{animation}.channels[{index}]");
        let channel = document.get_valid(&json.channels, index, &place, &format!("{animation}.channels"))?;
        let targets = self.channel_targets(&place, channel, nodes)?;
        let Some(&target) = targets.first() else { return Ok(Vec::new()) };
        let (at, samplers) = (format!("{place}.sampler"), format!("{animation}.samplers"));
        let sampler = document.get_valid(&json.samplers, channel.sampler, &at, &samplers)?;
        let at = format!("{samplers}[{}]", channel.sampler);
        let width = match target {
            AnimationTarget::Weights(node) => nodes[node].weights.len(),
            target => target.component_count(),
        };
        let rotation = matches!(target, AnimationTarget::Rotation(_));
        let sampler = Arc::new(self.sampler(&at, sampler, width, rotation)?);
        Ok(targets.into_iter().map(|target| Channel { target, sampler: sampler.clone() }).collect())
    }

    /// Targets of a channel, all of the same kind; empty, with a notice, if raycam animates none of these targets.
    fn channel_targets(
        &mut self,
        place: &str,
        channel: &json::Channel,
        nodes: &[Node],
    ) -> Result<Vec<AnimationTarget>> {
        let document = self.document;
        let json = &channel.target;
        let pointer = json.extensions.pointer.as_ref().map(|p| &p.pointer[..]);
        let (node, path) = match (&json.path[..], pointer, json.node) {
            ("pointer", Some(pointer), _) => {
                let node = pointer.strip_prefix("/nodes/").and_then(|rest| rest.split_once('/'));
                let node = node.and_then(|(node, path)| Some((node.parse::<usize>().ok()?, path)));
                match node {
                    Some((node, path)) => (node, path),
                    None => {
                        let found = document.resolve_pointer(pointer);
                        if found.is_none() {
                            self.diagnostics.note(
                                NoticeCode::IgnoredAnimation,
                                place,
                                format!("{pointer} cannot be animated"),
                            );
                        }
                        let mut found = found.unwrap_or_default();
                        // Channels for weights of a mesh without morph targets have no effect and are omitted.
                        found.retain(
                            |target| !matches!(target, AnimationTarget::Weights(i) if nodes[*i].weights.is_empty()),
                        );
                        return Ok(found);
                    }
                }
            }
            (path, _, Some(node)) => (node, path),
            (_, _, None) => {
                self.diagnostics.note(NoticeCode::IgnoredAnimation, place, "a channel without a target has no effect");
                return Ok(Vec::new());
            }
        };
        let at = format!("{place}.target.node");
        let found = document.get(nodes, node, &at, "nodes")?;
        let target = match path {
            "translation" => AnimationTarget::Translation(node),
            "rotation" => AnimationTarget::Rotation(node),
            "scale" => AnimationTarget::Scale(node),
            "weights" if found.weights.is_empty() => {
                let message = "a weights channel of a node without morph targets has no effect \
                    (ANIMATION_CHANNEL_TARGET_NODE_WEIGHTS_NO_MORPHS)";
                self.diagnostics.note(NoticeCode::IgnoredAnimation, place, message);
                return Ok(Vec::new());
            }
            "weights" => AnimationTarget::Weights(node),
            "extensions/KHR_node_visibility/visible" => AnimationTarget::Visible(node),
            path => {
                self.diagnostics.note(
                    NoticeCode::IgnoredAnimation,
                    place,
                    format!("{path:?} of a node cannot be animated (VALUE_NOT_IN_LIST)"),
                );
                return Ok(Vec::new());
            }
        };
        let of_transform = matches!(
            target,
            AnimationTarget::Translation(_) | AnimationTarget::Rotation(_) | AnimationTarget::Scale(_)
        );
        if of_transform && matches!(found.transform, Transform::Matrix(_)) {
            let message = "a node with a matrix cannot be animated \
                           (ANIMATION_CHANNEL_TARGET_NODE_MATRIX)";
            self.diagnostics.note(NoticeCode::InvalidFile, place, message);
            return Ok(Vec::new());
        }
        Ok(vec![target])
    }

    fn sampler(
        &mut self,
        place: &str,
        json: &json::AnimationSampler,
        width: usize,
        rotation: bool,
    ) -> Result<AnimationSampler> {
        let document = self.document;
        let interpolation = match &json.interpolation[..] {
            "STEP" => SamplerInterpolation::Step,
            "LINEAR" => SamplerInterpolation::Linear,
            "CUBICSPLINE" => SamplerInterpolation::CubicSpline,
            other => {
                return Err(document.fault(
                    ErrorCode::UnknownName,
                    format!(
                        "{place}.interpolation: {other:?}; expected STEP, LINEAR or CUBICSPLINE (VALUE_NOT_IN_LIST)"
                    ),
                ));
            }
        };
        let times = document.elements(json.input, &format!("{place}.input"))?.floats::<1>()?.into_flattened();
        let output = document.elements(json.output, &format!("{place}.output"))?;
        let values = match output.arity {
            2 => output.floats::<2>()?.into_flattened(),
            3 => output.floats::<3>()?.into_flattened(),
            4 => output.floats::<4>()?.into_flattened(),
            _ => output.floats::<1>()?.into_flattened(),
        };
        // The code is glTF-Validator's name of the fault.
        let code = if times.first().is_some_and(|first| *first < 0.0) {
            "ACCESSOR_ANIMATION_INPUT_NEGATIVE"
        } else if times.is_empty() || !times.is_sorted_by(|a, b| a < b) {
            "ACCESSOR_ANIMATION_INPUT_NON_INCREASING"
        } else {
            "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_COUNT"
        };
        let place = &format!("{place} ({code})");
        AnimationSampler::new(times, values, width, interpolation, rotation)
            .map_err(|error| document.scene(place, error))
    }
}
