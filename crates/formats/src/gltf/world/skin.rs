//! Skins of deformable meshes.

use glam::{DAffine3, DMat4};
use raycam_scene::ErrorCode;
use raycam_scene::animation::Skin;

use crate::error::Result;
use crate::gltf::world::builder::Builder;

impl Builder<'_, '_> {
    /// All skins of the document. An invalid skin has no joints, so that its meshes are shown in their rest shape.
    pub(crate) fn skins(&mut self) -> Result<Vec<Skin>> {
        let count = self.document.root.skins.len();
        let mut skins = Vec::with_capacity(count);
        for i in 0..count {
            let skin = self.skin(i);
            let skin = self.or_omitted(&format!("skins[{i}]"), "the skin", skin)?;
            skins.push(skin.unwrap_or_else(|| Skin { joints: Vec::new(), inverse_bind: Vec::new() }));
        }
        Ok(skins)
    }

    fn skin(&self, i: usize) -> Result<Skin> {
        let document = self.document;
        let json = &document.root.skins[i];
        for (j, &joint) in json.joints.iter().enumerate() {
            document.get(&document.root.nodes, joint, &format!("skins[{i}].joints[{j}]"), "nodes")?;
        }
        let mut inverse_bind = vec![DAffine3::IDENTITY; json.joints.len()];
        if let Some(index) = json.inverse_bind_matrices {
            let place = format!("skins[{i}].inverseBindMatrices");
            let elements = document.elements(index, &place)?;
            if elements.count < json.joints.len() {
                return Err(document.fault(
                    ErrorCode::WrongShape,
                    format!(
                        "{place}: {} matrices for {} joints; expected equal numbers (INVALID_IBM_ACCESSOR_COUNT)",
                        elements.count,
                        json.joints.len()
                    ),
                ));
            }
            for (inverse, matrix) in inverse_bind.iter_mut().zip(elements.floats::<16>()?) {
                *inverse = DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)));
            }
        }
        Ok(Skin { joints: json.joints.clone(), inverse_bind })
    }
}
