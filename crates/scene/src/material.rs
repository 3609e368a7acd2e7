//! Materials: a base colour and how the surface reflects it.

use crate::color::Rgb;
use crate::error::SceneError;
use crate::mesh::Mesh;

/// What a surface is made of. The base colour at a point is the product of `color`, the mesh's face or vertex colour
/// and the texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Empty when it has none.
    pub name: String,
    /// Linear base colour, each channel 0..=1.
    pub color: Rgb,
    /// Index into the world's textures.
    pub texture: Option<usize>,
    /// How the base colour is reflected.
    pub reflectance: Reflectance,
}

/// The closed set of reflection models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflectance {
    /// The lecture's: Lambert of albedo `diffuse * base colour` plus the energy-conserving modified Phong lobe of
    /// Lafortune and Willems (1994) with albedo `specular` and exponent `shininess`.
    Lecture {
        /// 0..=1.
        diffuse: f32,
        /// Linear, 0..=1 per channel.
        specular: Rgb,
        /// The Phong exponent, >= 0.
        shininess: f32,
    },
    /// The base colour itself, whatever the light.
    Unlit,
}

impl Reflectance {
    /// The lecture's, where nothing is said: all diffuse.
    pub const DEFAULT: Self = Self::Lecture {
        diffuse: 1.0,
        specular: [0.0; 3],
        shininess: 32.0,
    };
}

impl Material {
    /// The material of a mesh that says nothing of its own: white, to show the colours that the mesh has, or light grey
    /// where it has none.
    pub fn plain(mesh: &Mesh) -> Self {
        let colored = mesh.vertex_colors.is_some() || mesh.face_colors.is_some();
        let color = if colored { [1.0; 3] } else { [0.8; 3] };
        Self {
            name: String::new(),
            color,
            texture: None,
            reflectance: Reflectance::DEFAULT,
        }
    }

    /// The same, with this name where it has none.
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        if self.name.is_empty() {
            self.name = name.into();
        }
        self
    }

    /// Whether its values make sense.
    ///
    /// # Errors
    /// [`SceneError::World`]: colours and shares outside 0..=1, a shininess that is negative or not finite.
    pub fn validate(&self) -> Result<(), SceneError> {
        let share = |name: &str, values: &[f32]| {
            if values.iter().all(|v| (0.0..=1.0).contains(v)) {
                return Ok(());
            }
            Err(SceneError::World(format!(
                "{name} {values:?}: expected 0..=1"
            )))
        };
        share("color", &self.color)?;
        match self.reflectance {
            Reflectance::Unlit => Ok(()),
            Reflectance::Lecture {
                diffuse,
                specular,
                shininess,
            } => {
                share("diffuse", &[diffuse])?;
                share("specular", &specular)?;
                if !(shininess.is_finite() && shininess >= 0.0) {
                    return Err(SceneError::World(format!(
                        "shininess {shininess}: expected a finite number >= 0, the Phong exponent"
                    )));
                }
                Ok(())
            }
        }
    }

    /// The largest share of light that comes back in any channel, where it is more than arrives.
    pub fn excess_reflectance(&self) -> Option<f32> {
        let Reflectance::Lecture {
            diffuse, specular, ..
        } = self.reflectance
        else {
            return None;
        };
        let total = (0..3)
            .map(|i| diffuse * self.color[i] + specular[i])
            .fold(0.0, f32::max);
        (total > 1.0 + 1e-6).then_some(total)
    }
}
