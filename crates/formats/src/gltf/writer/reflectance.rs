//! Conversion of materials to glTF's material model.

use raycam_scene::{HeightUnit, Material, MaterialModel, NoticeCode, Principled};

use crate::gltf::writer::document::Writer;

impl Writer<'_> {
    /// Adds notices about properties of bodies and surfaces that glTF cannot represent.
    fn note_missing_properties(&mut self, material: &Material) {
        let name = &material.name;
        if material.priority != 0 {
            self.note(
                NoticeCode::NotWritten,
                format!(
                    "material {name:?}: its priority among overlapping media is omitted, because glTF has no priorities"
                ),
            );
        }
        if material.medium.is_some() {
            self.note(
                NoticeCode::NotWritten,
                format!("material {name:?}: its medium is not written: glTF has no media"),
            );
        }
        if material.reflectance.is_some() {
            self.note(
                NoticeCode::NotWritten,
                format!("material {name:?}: its reflectance for lidars is not written: glTF has no such texture"),
            );
        }
        if let Some(map) = material.height_map
            && (map.unit == HeightUnit::Metre || material.normal_map.is_some())
        {
            self.note(
                NoticeCode::NotWritten,
                format!("material {name:?}: its height map is not written: glTF has no height maps"),
            );
        }
    }

    /// Converts a material to glTF's material model: the base colour and the principled model, which is `None` for an
    /// unlit material. Approximations cause a notice.
    pub(super) fn gltf_material(&mut self, material: &Material) -> ([f32; 3], Option<Principled>) {
        let (color, name) = (material.color, &material.name);
        self.note_missing_properties(material);
        match &material.model {
            MaterialModel::Unlit => (color, None),
            MaterialModel::Boundary => {
                let message =
                    format!("material {name:?}: the boundary of a medium is written as clear glass of index 1");
                self.note(NoticeCode::ApproximatedValue, message);
                let transmission = 1.0.into();
                let clear = Principled {
                    metallic: 0.0.into(),
                    ior: 1.0,
                    transmission,
                    thickness: 1.0.into(),
                    ..Principled::default()
                };
                (color, Some(clear))
            }
            MaterialModel::Principled(principled) => (color, Some((**principled).clone())),
            MaterialModel::Phong { diffuse, specular, shininess } => {
                let mut principled = Principled { metallic: 0.0.into(), specular: 0.0.into(), ..Principled::default() };
                if *specular != [0.0; 3] {
                    self.note(
                        NoticeCode::ApproximatedValue,
                        format!(
                            "material {name:?}: its Phong lobe of exponent {shininess} is approximated by a roughness"
                        ),
                    );
                    // The microfacet lobe is as wide as the Phong lobe: B. Walter et al., EGSR 2007, give alpha² = 2 /
                    // (n + 2) for Blinn-Phong.
                    let alpha = (2.0 / (shininess + 2.0)).sqrt();
                    principled.roughness = alpha.sqrt().into();
                    principled.specular = 1.0.into();
                    // A dielectric of index 1.5 reflects 0.04 along the normal.
                    principled.specular_color = specular.map(|v| v / 0.04).into();
                }
                (color.map(|v| v * diffuse), Some(principled))
            }
            MaterialModel::Metal(metal) => {
                self.note(
                    NoticeCode::ApproximatedValue,
                    format!(
                        "material {name:?}: its index of refraction is converted to its reflectance colour at \
                        normal incidence"
                    ),
                );
                let along = |i: usize| {
                    let (n, k) = (metal.ior[i], metal.extinction[i]);
                    ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)
                };
                let principled = Principled { roughness: metal.roughness.into(), ..Principled::default() };
                let color = std::array::from_fn(|i| (color[i] * along(i)).clamp(0.0, 1.0));
                (color, Some(principled))
            }
            MaterialModel::Glass(glass) => {
                let principled = Principled {
                    metallic: 0.0.into(),
                    roughness: glass.roughness.into(),
                    ior: glass.ior,
                    transmission: 1.0.into(),
                    thickness: if glass.thin { 0.0 } else { 1.0 }.into(),
                    attenuation_color: glass.attenuation_color,
                    attenuation_distance: glass.attenuation_distance,
                    dispersion: glass.dispersion,
                    ..Principled::default()
                };
                (color, Some(principled))
            }
        }
    }
}
