//! Morph targets and joints of a primitive's vertices.

use raycam_scene::animation::{DeformableMesh, JointSet, MorphTarget};
use raycam_scene::{ErrorCode, NoticeCode};

use crate::error::Result;
use crate::gltf::json::Primitive;
use crate::gltf::json::extensions::Attributes;
use crate::gltf::mesh::tangent::resample;
use crate::gltf::mesh::vertex_window::VertexWindow;
use crate::io::Diagnostics;

/// Morph targets and joints of vertices: a [`DeformableMesh`] without its mesh.
#[derive(Default)]
pub(crate) struct SkinMorph {
    targets: Vec<MorphTarget>,
    joints: Vec<JointSet>,
}

impl VertexWindow<'_> {
    /// Morph targets and joints of the vertices.
    pub(crate) fn skin_morph(
        &self,
        place: &str,
        primitive: &Primitive,
        diagnostics: &mut Diagnostics,
    ) -> Result<SkinMorph> {
        let mut skin_morph = SkinMorph::default();
        for (i, attributes) in primitive.targets.iter().enumerate() {
            let target = self.target(&format!("targets[{i}]"), attributes, diagnostics)?;
            skin_morph.targets.push(target);
        }
        for set in 0.. {
            let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
            let found = (self.elements(&joints)?, self.elements(&weights)?);
            let (Some(joints), Some(weights)) = found else { break };
            let joints = joints.integers::<4>()?;
            let weights = weights.floats::<4>()?;
            if weights.as_flattened().iter().any(|&weight| weight < 0.0) {
                let message = format!("{place}.attributes.WEIGHTS_{set}: negative weight (ACCESSOR_WEIGHTS_NEGATIVE)");
                return Err(self.document.fault(ErrorCode::OutOfRange, message));
            }
            let narrow = |all: [u32; 4]| all.map(|joint| joint.min(u32::from(u16::MAX)) as u16);
            let joints = joints.into_iter().map(narrow).collect();
            skin_morph.joints.push((joints, weights));
        }
        skin_morph.normalize();
        Ok(skin_morph)
    }

    fn target(&self, place: &str, attributes: &Attributes, diagnostics: &mut Diagnostics) -> Result<MorphTarget> {
        let mut target = MorphTarget::default();
        for (name, &index) in attributes {
            let elements = self.accessor(index, &format!("{place}.{name}"))?;
            match (&name[..], elements.arity) {
                ("POSITION", _) => target.vertices = Some(elements.floats()?),
                ("NORMAL", _) => target.normals = Some(elements.floats()?),
                ("TANGENT", _) => target.tangents = Some(elements.floats()?),
                ("TEXCOORD_0", _) => target.uvs = Some(elements.floats()?),
                ("COLOR_0", 3) => target.colors = Some(elements.floats()?),
                ("COLOR_0", _) => {
                    let colors = elements.floats::<4>()?;
                    target.colors = Some(colors.into_iter().map(|[r, g, b, _]| [r, g, b]).collect());
                }
                _ => diagnostics.note(NoticeCode::IgnoredAnimation, format!("{place}.{name}"), "cannot be morphed"),
            }
        }
        Ok(target)
    }
}

impl SkinMorph {
    /// Merges repeated joints of a vertex (3.7.3.3), and normalises its weights to the sum 1 over all sets.
    fn normalize(&mut self) {
        let count = self.joints.first().map_or(0, |(joints, _)| joints.len());
        for vertex in 0..count {
            for later in 1..4 * self.joints.len() {
                let (joints, weights) = &self.joints[later / 4];
                let (joint, weight) = (joints[vertex][later % 4], weights[vertex][later % 4]);
                let first = (0..later).find(|&first| {
                    let (joints, weights) = &self.joints[first / 4];
                    joints[vertex][first % 4] == joint && weights[vertex][first % 4] > 0.0
                });
                if let Some(first) = first.filter(|_| weight > 0.0) {
                    self.joints[first / 4].1[vertex][first % 4] += weight;
                    self.joints[later / 4].1[vertex][later % 4] = 0.0;
                }
            }
            let sum: f32 = self.joints.iter().flat_map(|(_, weights)| weights[vertex]).sum();
            if sum > 0.0 {
                for (_, weights) in &mut self.joints {
                    weights[vertex] = weights[vertex].map(|weight| weight / sum);
                }
            }
        }
    }

    /// Repeats the data of split vertices: `sources` contains the source of each vertex.
    pub(crate) fn resample(&mut self, sources: &[u32]) {
        for target in &mut self.targets {
            target.vertices.iter_mut().for_each(|all| resample(all, sources));
            target.normals.iter_mut().for_each(|all| resample(all, sources));
            target.tangents.iter_mut().for_each(|all| resample(all, sources));
            target.uvs.iter_mut().for_each(|all| resample(all, sources));
            target.colors.iter_mut().for_each(|all| resample(all, sources));
        }
        for (joints, weights) in &mut self.joints {
            resample(joints, sources);
            resample(weights, sources);
        }
    }

    /// Concatenates several primitives, each with its number of vertices; `None` if no primitive is deformed.
    pub(crate) fn concat(parts: &[(usize, Self)]) -> Option<Self> {
        let targets = parts.iter().map(|(_, part)| part.targets.len()).max()?;
        let sets = parts.iter().map(|(_, part)| part.joints.len()).max()?;
        if targets + sets == 0 {
            return None;
        }
        let target = |i: usize| MorphTarget {
            vertices: gather_or_zero(parts, |part| part.targets.get(i)?.vertices.as_ref()),
            normals: gather_or_zero(parts, |part| part.targets.get(i)?.normals.as_ref()),
            tangents: gather_or_zero(parts, |part| part.targets.get(i)?.tangents.as_ref()),
            uvs: gather_or_zero(parts, |part| part.targets.get(i)?.uvs.as_ref()),
            colors: gather_or_zero(parts, |part| part.targets.get(i)?.colors.as_ref()),
        };
        let set = |i: usize| {
            let joints = gather_or_zero(parts, |part| part.joints.get(i).map(|(joints, _)| joints));
            let weights = gather_or_zero(parts, |part| part.joints.get(i).map(|(_, weights)| weights));
            (joints.unwrap_or_default(), weights.unwrap_or_default())
        };
        Some(Self { targets: (0..targets).map(target).collect(), joints: (0..sets).map(set).collect() })
    }

    pub(crate) fn shape(self, mesh: std::sync::Arc<raycam_scene::Mesh>) -> DeformableMesh {
        DeformableMesh { mesh, targets: self.targets, joints: self.joints }
    }
}

/// Concatenates one array over all parts, with zeros for parts without this array; `None` if no part has the array.
fn gather_or_zero<T: Copy + Default>(
    parts: &[(usize, SkinMorph)],
    of: impl Fn(&SkinMorph) -> Option<&Vec<T>>,
) -> Option<Vec<T>> {
    parts.iter().find_map(|(_, part)| of(part))?;
    let mut all = Vec::new();
    for (count, part) in parts {
        match of(part) {
            Some(values) => all.extend_from_slice(values),
            None => all.resize(all.len() + count, T::default()),
        }
    }
    Some(all)
}
