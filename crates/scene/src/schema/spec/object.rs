//! `[[object]]`.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::schema::keys::{Keys, by_key};
use crate::schema::shorthand::{Category, Color, Refine, Splat, Wraps};
use crate::schema::spec::shape::{BoxShape, ConeShape, CylinderShape, PlaneShape, SphereShape, TorusShape};
use crate::schema::spec::texture::{TextureSpec, TexturesSpec};

/// An object: exactly one shape (`box`, `plane`, `sphere`, `cylinder`, `cone`, `torus`, `mesh`, `vertices` with
/// `triangles`, or `instance_of`), where it stands and what it is made of.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ObjectSpec {
    /// Unique in the world; made from the shape where not given.
    pub name: Option<String>,
    /// A class, for data sets: a name, or a whole number that is its id. Names get the free ids from 1 in the order in
    /// which they come.
    pub category: Option<Category>,

    /// False hides it: it is in no picture, shadow, light or query, and its number stays. True where not given.
    pub visible: Option<bool>,
    /// True if pictures with a transparent background, or a camera's own, show its shadows and not the object itself, as of
    /// a ground that a photograph shows already. False where not given.
    pub shadow_catcher: Option<bool>,

    /// A box centred at the origin.
    #[serde(rename = "box")]
    pub box_: Option<BoxShape>,
    /// A rectangle in the xy plane that faces +z.
    pub plane: Option<PlaneShape>,
    /// A sphere around the origin.
    pub sphere: Option<SphereShape>,
    /// A closed cylinder around the z axis.
    pub cylinder: Option<CylinderShape>,
    /// A closed cone around the z axis, its tip up.
    pub cone: Option<ConeShape>,
    /// A torus around the z axis.
    pub torus: Option<TorusShape>,
    /// A mesh file beside the world file: OBJ, PLY, STL, OFF or glTF.
    pub mesh: Option<String>,
    /// True if the mesh file is turned from its own up axis (y in glTF) to the world's. Default: true without `matrix`,
    /// false with `matrix`, which applies to the file's own axes.
    pub upright: Option<bool>,
    /// Corner positions, with `triangles`.
    pub vertices: Option<Vec<[f64; 3]>>,
    /// Corner indices from 0, counter-clockwise seen from outside.
    pub triangles: Option<Vec<[u32; 3]>>,
    /// The name of an earlier object whose mesh (and, where nothing else is said, material) this one shares.
    pub instance_of: Option<String>,

    /// Subdivision: a number of levels of Loop's scheme, or { levels, scheme = "loop" or "midpoint" }.
    pub refine: Option<Refine>,
    /// Linear colours per triangle (before `refine`), each 0 to 1.
    pub face_colors: Option<Vec<[f32; 3]>>,
    /// Linear colours per vertex, interpolated, each 0 to 1.
    pub vertex_colors: Option<Vec<[f32; 3]>>,
    /// Texture coordinates per vertex; v = 0 is the top row of the image, as in glTF.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Shading normals per vertex, of any length but 0.
    pub normals: Option<Vec<[f32; 3]>>,

    /// The place of its origin in the world.
    pub location: Option<[f64; 3]>,
    /// Turn about the forward axis (x of a z-up world) in degrees, first.
    pub roll: Option<f64>,
    /// Turn about the left axis (y of a z-up world) in degrees, second.
    pub pitch: Option<f64>,
    /// Turn about the up axis in degrees, last; positive turns left.
    pub yaw: Option<f64>,
    /// One factor, or one per axis, before turning; negative ones mirror.
    pub scale: Option<Splat<3>>,
    /// Instead of location, angles and scale: the affine transform world_from_mesh, 3x4 or 4x4.
    pub matrix: Option<Vec<[f64; 4]>>,

    /// The model of reflection; the lecture's `diffuse`, `specular` and `shininess` where not given.
    #[serde(rename = "type")]
    pub type_: Option<MaterialType>,
    /// The base colour: linear red, green, blue from 0 to 1, or "#rrggbb" in 8-bit sRGB. White where the mesh has colours of
    /// its own, which it multiplies, and light grey (0.8) where it has none.
    pub color: Option<Color>,
    /// An image file beside the world file, rows of texels, or a table of an `image` and how it is looked up. It multiplies
    /// the base colour.
    pub texture: Option<Box<TextureSpec>>,
    /// Textures of the other values, by their names, and `normal` and `occlusion`.
    pub textures: Option<Box<TexturesSpec>>,
    /// The wrap mode of textures that have none of their own, beyond 0..1: "repeat", "clamp" or "mirror", or one of them for u and
    /// one for v.
    pub wrap: Option<Wraps>,
    /// The share of light reflected equally everywhere, times the base colour: 0 to 1, 1 where not given.
    pub diffuse: Option<f32>,
    /// The share of light reflected around the mirror direction, 0 to 1: a number or linear RGB; 0 where not given. With
    /// type = "principled": the strength of the dielectric's reflection, a number, 1 where not given.
    pub specular: Option<Splat<3>>,
    /// The Phong exponent of the specular share, >= 0: larger is sharper; 32 where not given.
    pub shininess: Option<f32>,
    /// Linear radiance that the surface shines by itself, in W/(m² sr): a number or red, green, blue >= 0.
    pub emission: Option<Splat<3>>,
    /// 0 to 1: the share of it that is there, times the alpha of its texture; 1 where not given.
    pub opacity: Option<f32>,
    /// The use of opacity and of the alpha of its texture. Where not given, "blend" if `opacity` is given or the image
    /// named here has alpha; else what the mesh file says.
    pub alpha: Option<AlphaMode>,

    /// With type = "metal": its name ("gold", "silver", "copper", "aluminium", "iron", ...) instead of a color.
    pub metal: Option<String>,
    /// With type = "metal", "glass" or "principled": perceptual roughness 0 to 1, 0 for mirrors and clear glass.
    pub roughness: Option<f32>,
    /// With type = "glass" or "principled": the index of refraction, >= 1; 1.5 where not given.
    pub ior: Option<f32>,
    /// With type = "glass" or "principled": whether its surfaces are thin walls instead of the skin of something solid.
    pub thin: Option<bool>,
    /// With type = "glass" or "principled": how differently it refracts colours: 20 / Abbe number.
    pub dispersion: Option<f32>,
    /// With type = "glass" or "principled": what is left of white light after `attenuation_distance`.
    pub attenuation_color: Option<Color>,
    /// With type = "glass" or "principled": metres; no absorption where not given.
    pub attenuation_distance: Option<f32>,
    /// With type = "glass" or "principled": where closed meshes of clear matter overlap, the one of the highest priority is
    /// there; a whole number, 0 where not given. Of equals it is the one within the other.
    pub priority: Option<i32>,
    /// With type = "principled": 0 dielectric (where not given) to 1 metal.
    pub metallic: Option<f32>,
    /// With type = "principled": the colour of the dielectric's reflection.
    pub specular_color: Option<Color>,
    /// With type = "principled": the share of light that passes instead of being reflected diffusely, 0 to 1.
    pub transmission: Option<f32>,
    /// With type = "principled": the strength of a clear coat, 0 to 1.
    pub clearcoat: Option<f32>,
    /// With type = "principled": its roughness, 0 to 1.
    pub clearcoat_roughness: Option<f32>,
    /// With type = "principled": the colour of the sheen of cloth.
    pub sheen_color: Option<Color>,
    /// With type = "principled": its roughness, 0 to 1.
    pub sheen_roughness: Option<f32>,
    /// With type = "principled": the strength of a thin film, 0 to 1.
    pub iridescence: Option<f32>,
    /// With type = "principled": the film's index of refraction; 1.3 where not given.
    pub iridescence_ior: Option<f32>,
    /// With type = "principled": its thickness in nanometres; 400 where not given.
    pub iridescence_thickness: Option<f32>,
    /// With type = "principled": how much longer highlights are along the tangent, 0 to 1.
    pub anisotropy: Option<f32>,
    /// With type = "principled": degrees counter-clockwise from the tangent.
    pub anisotropy_rotation: Option<f64>,
    /// With type = "principled": the share of diffuse light that goes on instead of back, 0 to 1.
    pub diffuse_transmission: Option<f32>,
    /// With type = "principled": what colours it; white where not given.
    pub diffuse_transmission_color: Option<Color>,
}

/// How many optional keys [`ObjectSpec`] has, besides name, category, visible and shadow_catcher.
pub(crate) const KEYS: usize = 55;

impl ObjectSpec {
    /// Which keys were written.
    pub(crate) fn keys(&self) -> Keys<KEYS> {
        Keys(by_key! { self, is_some:
            "box" box_, plane, sphere, cylinder, cone, torus, mesh, upright, vertices, triangles, instance_of,
            refine, face_colors, vertex_colors, uvs, normals,
            location, roll, pitch, yaw, scale, matrix,
            "type" type_, color, texture, textures, wrap, diffuse, specular, shininess, emission, opacity, alpha,
            metal, roughness, ior, thin, dispersion, attenuation_color, attenuation_distance, priority,
            metallic, specular_color, transmission, clearcoat, clearcoat_roughness, sheen_color, sheen_roughness,
            iridescence, iridescence_ior, iridescence_thickness, anisotropy, anisotropy_rotation,
            diffuse_transmission, diffuse_transmission_color,
        })
    }
}

/// The use of opacity and of a texture's alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AlphaMode {
    /// Neither counts: all of it is there.
    Opaque,
    /// Their product is the share that is there.
    Blend,
}

/// The models of reflection that have a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MaterialType {
    /// Diffuse alone.
    Matte,
    /// A metal, by its name or by its color.
    Metal,
    /// A dielectric: glass, water, a pane.
    Glass,
    /// glTF's metallic-roughness with its extensions.
    Principled,
    /// The base colour itself, whatever the light.
    Unlit,
}
