//! Animations, `KHR_animation_pointer` included.

use std::sync::Arc;

use raycam_scene::animation::{
    Animation, Channel, Interpolation, Node, Sampler, Target, Transform,
};

use super::Builder;
use super::json;
use crate::error::FormatError;

impl Builder<'_, '_> {
    /// All animations of the document, of nodes that are `nodes`.
    pub(super) fn animations(&mut self, nodes: &[Node]) -> Result<Vec<Animation>, FormatError> {
        let document = self.document;
        let mut animations = Vec::new();
        for (i, json) in document.root.animations.iter().enumerate() {
            let mut channels = Vec::new();
            for (j, channel) in json.channels.iter().enumerate() {
                let place = format!("animations[{i}].channels[{j}]");
                let targets = self.targets(&place, channel, nodes)?;
                let Some(&target) = targets.first() else {
                    continue;
                };
                let at = format!("{place}.sampler");
                let sampler = document.get(&json.samplers, channel.sampler, &at)?;
                let at = format!("animations[{i}].samplers[{}]", channel.sampler);
                let width = match target {
                    Target::Weights(node) => nodes[node].weights.len(),
                    target => target.width(),
                };
                let rotation = matches!(target, Target::Rotation(_));
                let sampler = Arc::new(self.sampler(&at, sampler, width, rotation)?);
                channels.extend(targets.into_iter().map(|target| Channel {
                    target,
                    sampler: sampler.clone(),
                }));
            }
            animations.push(Animation {
                name: json.name.clone(),
                channels,
            });
        }
        Ok(animations)
    }

    /// What a channel moves, all of the same kind; nothing, with a notice, where nothing of it moves here.
    fn targets(
        &mut self,
        place: &str,
        channel: &json::Channel,
        nodes: &[Node],
    ) -> Result<Vec<Target>, FormatError> {
        let document = self.document;
        let json = &channel.target;
        let pointer = json.extensions.pointer.as_ref().map(|p| &p.pointer[..]);
        let (node, path) = match (&json.path[..], pointer, json.node) {
            ("pointer", Some(pointer), _) => {
                let node = pointer
                    .strip_prefix("/nodes/")
                    .and_then(|rest| rest.split_once('/'));
                let node = node.and_then(|(node, path)| Some((node.parse::<usize>().ok()?, path)));
                match node {
                    Some((node, path)) => (node, path),
                    None => {
                        let found = document.pointed_at(pointer);
                        if found.is_none() {
                            self.ledger
                                .note(place, format!("{pointer} is not animated"));
                        }
                        let mut found = found.unwrap_or_default();
                        // Of a mesh without morph targets.
                        found.retain(|target| {
                            !matches!(target, Target::Weights(i) if nodes[*i].weights.is_empty())
                        });
                        return Ok(found);
                    }
                }
            }
            (path, _, Some(node)) => (node, path),
            (_, _, None) => {
                self.ledger
                    .note(place, "a channel without a target moves nothing");
                return Ok(Vec::new());
            }
        };
        let at = format!("{place}.target.node");
        let found = document.get(nodes, node, &at)?;
        let target = match path {
            "translation" => Target::Translation(node),
            "rotation" => Target::Rotation(node),
            "scale" => Target::Scale(node),
            "weights" if found.weights.is_empty() => {
                let message = "a channel of weights of a node without morph targets \
                               (ANIMATION_CHANNEL_TARGET_NODE_WEIGHTS_NO_MORPHS)";
                self.ledger.note(place, message);
                return Ok(Vec::new());
            }
            "weights" => Target::Weights(node),
            "extensions/KHR_node_visibility/visible" => Target::Visible(node),
            path => {
                let message = format!("{path:?} of a node is not animated (VALUE_NOT_IN_LIST)");
                self.ledger.note(place, message);
                return Ok(Vec::new());
            }
        };
        let of_transform = matches!(
            target,
            Target::Translation(_) | Target::Rotation(_) | Target::Scale(_)
        );
        if of_transform && matches!(found.transform, Transform::Matrix(_)) {
            let message = "a node with a matrix cannot be animated \
                           (ANIMATION_CHANNEL_TARGET_NODE_MATRIX)";
            self.ledger.note(place, message);
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
    ) -> Result<Sampler, FormatError> {
        let document = self.document;
        let interpolation = match &json.interpolation[..] {
            "STEP" => Interpolation::Step,
            "LINEAR" => Interpolation::Linear,
            "CUBICSPLINE" => Interpolation::CubicSpline,
            other => {
                return Err(document.fault(format!(
                    "{place}.interpolation: {other:?} (VALUE_NOT_IN_LIST)"
                )));
            }
        };
        let ledger = &mut self.ledger;
        let input = document.elements(json.input, &format!("{place}.input"), ledger)?;
        let times = input.floats::<1>(document, ledger)?.into_flattened();
        let output = document.elements(json.output, &format!("{place}.output"), ledger)?;
        let values = match output.arity {
            2 => output.floats::<2>(document, ledger)?.into_flattened(),
            3 => output.floats::<3>(document, ledger)?.into_flattened(),
            4 => output.floats::<4>(document, ledger)?.into_flattened(),
            _ => output.floats::<1>(document, ledger)?.into_flattened(),
        };
        // As glTF-Validator calls what is wrong with them, if something is.
        let code = if times.first().is_some_and(|first| *first < 0.0) {
            "ACCESSOR_ANIMATION_INPUT_NEGATIVE"
        } else if times.is_empty() || !times.is_sorted_by(|a, b| a < b) {
            "ACCESSOR_ANIMATION_INPUT_NON_INCREASING"
        } else {
            "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_COUNT"
        };
        let place = &format!("{place} ({code})");
        Sampler::new(times, values, width, interpolation, rotation)
            .map_err(|error| document.scene(place, error))
    }
}
