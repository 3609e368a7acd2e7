//! Skins of deformable meshes.

use glam::{DAffine3, DMat4};
use raycam_scene::ErrorCode;
use raycam_scene::animation::Skin;

use crate::error::Result;
use crate::gltf::world::builder::Builder;

impl Builder<'_, '_> {
    /// All skins of the document.
    pub(crate) fn skins(&mut self) -> Result<Vec<Skin>> {
        let document = self.document;
        let mut skins = Vec::new();
        for (i, json) in document.root.skins.iter().enumerate() {
            for (j, &joint) in json.joints.iter().enumerate() {
                let place = format!("skins[{i}].joints[{j}]");
                document.get(&document.root.nodes, joint, &place, "nodes")?;
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
                let matrices = elements.floats::<16>()?;
                for (inverse, matrix) in inverse_bind.iter_mut().zip(matrices) {
                    let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
                    *inverse = DAffine3::from_mat4(matrix);
                }
            }
            skins.push(Skin { joints: json.joints.clone(), inverse_bind });
        }
        Ok(skins)
    }
}
