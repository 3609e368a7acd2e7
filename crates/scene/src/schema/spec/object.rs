//! `[[object]]`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::camera::sensor::LidarSurface;
use crate::schema::keys::{Keys, by_key};
use crate::schema::shorthand::{Category, Color, Refine, Splat, Visible, Wraps};
use crate::schema::spec::displace::DisplaceSpec;
use crate::schema::spec::medium::MediumSpec;
use crate::schema::spec::shape::{BoxShape, ConeShape, CylinderShape, PlaneShape, SphereShape, TorusShape};
use crate::schema::spec::slots::slot_tables;
use crate::schema::spec::texture::{TextureSpec, TexturesSpec};

/// An object: exactly one shape (`box`, `plane`, `sphere`, `cylinder`, `cone`, `torus`, `mesh`, `vertices` with
/// `triangles`, or `instance_of`), its placement and its material.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ObjectSpec {
    /// Unique name in the world; default: derived from the shape.
    pub name: Option<String>,
    /// A class for data sets: a name, or a whole number that is its id. Names get the free ids from 1 on, in order of
    /// first use.
    pub category: Option<Category>,

    /// False hides the object: it is excluded from images, shadows, light and queries, and keeps its index. A table
    /// such as { camera = false, shadow = true, reflection = true } hides it from some rays only: from the camera, from
    /// lights, on which it then casts no shadow, or from mirrors, glass and indirect light. Queries still find the
    /// object. Default: true.
    pub visible: Option<Visible>,
    /// True if images with a transparent background or a camera's background show the object's shadows but not the
    /// object, for example for a ground that the photo already shows. Default: false.
    pub shadow_catcher: Option<bool>,
    /// Properties of the surface for lidars, such as { reflectance = 0.8, retroreflection = 300 }; derived from the
    /// material if not given. A mirror or glass with such values scatters light instead.
    pub lidar: Option<LidarSurface>,

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
    /// A mesh file in the world file's folder or below: OBJ, PLY, STL, OFF or glTF.
    pub mesh: Option<String>,
    /// True if the mesh file is rotated from its own up axis (y in glTF) to the world's. Default: true without
    /// `matrix`, false with `matrix`, which applies to the file's own axes.
    pub upright: Option<bool>,
    /// Corner positions, with `triangles`.
    pub vertices: Option<Vec<[f64; 3]>>,
    /// Corner indices from 0, counter-clockwise as seen from outside.
    pub triangles: Option<Vec<[u32; 3]>>,
    /// The name of an earlier object whose mesh is shared, and whose material is shared unless specified here.
    pub instance_of: Option<String>,

    /// Subdivision: a number of levels of Loop's scheme, or { levels, scheme = "loop" or "midpoint" }.
    pub refine: Option<Refine>,
    /// True, or a table { max_edge, zero, max_triangles }, moves the surface itself by the texture `height`: the mesh
    /// is refined until edges are as short as a texel, and its vertices move along the normals. Default: only the
    /// shading normals are bent.
    pub displace: Option<DisplaceSpec>,
    /// Linear colours per triangle (before `refine`), each 0 to 1; an empty list removes the file's colours.
    pub face_colors: Option<Vec<[f32; 3]>>,
    /// Linear colours per vertex, interpolated, each 0 to 1.
    pub vertex_colors: Option<Vec<[f32; 3]>>,
    /// Texture coordinates per vertex; v = 0 is the top row of the image, as in glTF.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Shading normals per vertex; any length except 0.
    pub normals: Option<Vec<[f32; 3]>>,

    /// Position of the object's origin in the world.
    pub location: Option<[f64; 3]>,
    /// Rotation about the forward axis (x in a z-up world) in degrees, applied first.
    pub roll: Option<f64>,
    /// Rotation about the left axis (y in a z-up world) in degrees, applied second.
    pub pitch: Option<f64>,
    /// Rotation about the up axis in degrees, applied last; positive values turn left.
    pub yaw: Option<f64>,
    /// One factor, or one per axis, applied before the rotation; negative factors mirror.
    pub scale: Option<Splat<3>>,
    /// The affine transform world_from_mesh, 3x4 or 4x4, instead of location, angles and scale.
    pub matrix: Option<Vec<[f64; 4]>>,

    /// The reflection model; default: the lecture's model with `diffuse`, `specular` and `shininess`.
    #[serde(rename = "type")]
    pub type_: Option<MaterialType>,
    /// The base colour: linear red, green, blue from 0 to 1, or "#rrggbb" in 8-bit sRGB. It multiplies the mesh's
    /// colours. Default: white if the mesh has colours, otherwise light grey (0.8).
    pub color: Option<Color>,
    /// An image file in the world file's folder or below, rows of texels, or a table with an `image` and its lookup
    /// options. It multiplies the base colour.
    pub texture: Option<Box<TextureSpec>>,
    /// Textures of the other values by name, and `normal`, `height` and `occlusion`.
    pub textures: Option<Box<TexturesSpec>>,
    /// Wrap mode of texture coordinates outside 0..1, for textures that do not specify their own: "repeat", "clamp" or
    /// "mirror", or a list of one for u and one for v.
    pub wrap: Option<Wraps>,
    /// Height of the value 1 in the texture `height`, in metres of the world; negative values turn hills into dents.
    /// Default 1.
    pub height_scale: Option<f32>,
    /// Fraction of light reflected diffusely, times the base colour: 0 to 1; default 1.
    pub diffuse: Option<f32>,
    /// Fraction of light reflected around the mirror direction, 0 to 1: a number or linear RGB; default 0. With type =
    /// "principled": strength of the dielectric's reflection, a number; default 1.
    pub specular: Option<Splat<3>>,
    /// Phong exponent of the specular reflection, >= 0; larger values give sharper highlights. Default 32.
    pub shininess: Option<f32>,
    /// Linear emitted radiance in W/(m² sr): a number, or red, green and blue, >= 0.
    pub emission: Option<Splat<3>>,
    /// Opacity, 0 to 1, multiplied by the texture's alpha; default 1.
    pub opacity: Option<f32>,
    /// Use of the opacity and of the texture's alpha. Default: "blend" if `opacity` is given or the image specified
    /// here has alpha; otherwise the mesh file's setting.
    pub alpha: Option<AlphaMode>,

    /// With type = "metal": the metal's name ("gold", "silver", "copper", "aluminium", "iron", ...) instead of a color.
    pub metal: Option<String>,
    /// With type = "metal", "glass" or "principled": perceptual roughness, 0 to 1; 0 for mirrors and clear glass.
    pub roughness: Option<f32>,
    /// With type = "glass" or "principled": the index of refraction, >= 1; default 1.5.
    pub ior: Option<f32>,
    /// With type = "glass" or "principled": true if the mesh's surfaces are thin walls, false if they enclose a solid.
    pub thin: Option<bool>,
    /// With type = "glass" or "principled": strength of the dispersion, 20 / Abbe number.
    pub dispersion: Option<f32>,
    /// With type = "glass" or "principled": colour of white light after `attenuation_distance` in the medium.
    pub attenuation_color: Option<Color>,
    /// With type = "glass" or "principled": distance in metres after which white light has the `attenuation_color`;
    /// default: no absorption.
    pub attenuation_distance: Option<f32>,
    /// With type = "glass" or "principled": a whole number, default 0. Where closed meshes of clear media overlap, the
    /// medium with the highest priority fills the space; among equal priorities, the inner medium.
    pub priority: Option<i32>,
    /// With type = "glass", "principled" or "boundary": the matter inside the closed mesh, by the name of a preset or
    /// by its coefficients per metre.
    pub medium: Option<MediumSpec>,
    /// With type = "principled": 0 for a dielectric (default) to 1 for a metal.
    pub metallic: Option<f32>,
    /// With type = "principled": colour of the dielectric's reflection.
    pub specular_color: Option<Color>,
    /// With type = "principled": fraction of light that is transmitted instead of reflected diffusely, 0 to 1.
    pub transmission: Option<f32>,
    /// With type = "principled": strength of a clear coat, 0 to 1.
    pub clearcoat: Option<f32>,
    /// With type = "principled": roughness of the clear coat, 0 to 1.
    pub clearcoat_roughness: Option<f32>,
    /// With type = "principled": colour of the sheen of cloth.
    pub sheen_color: Option<Color>,
    /// With type = "principled": roughness of the sheen, 0 to 1.
    pub sheen_roughness: Option<f32>,
    /// With type = "principled": strength of a thin film, 0 to 1.
    pub iridescence: Option<f32>,
    /// With type = "principled": the film's index of refraction; default 1.3.
    pub iridescence_ior: Option<f32>,
    /// With type = "principled": the film's thickness in nanometres; default 400.
    pub iridescence_thickness: Option<f32>,
    /// With type = "principled": strength of the anisotropy, 0 to 1; it stretches highlights along the tangent.
    pub anisotropy: Option<f32>,
    /// With type = "principled": direction of the anisotropy in degrees counter-clockwise from the tangent.
    pub anisotropy_rotation: Option<f64>,
    /// With type = "principled": fraction of diffuse light that is transmitted instead of reflected, 0 to 1.
    pub diffuse_transmission: Option<f32>,
    /// With type = "principled": colour of diffusely transmitted light; default white.
    pub diffuse_transmission_color: Option<Color>,

    /// Changes of single material slots, which are applied after the keys above: a table of material keys for each slot,
    /// such as { windows = { type = "glass" } }. A slot is specified by its number (from 0) or by the name of its
    /// material. A name changes all slots with this material name; if both match, the number takes precedence.
    #[serde(deserialize_with = "slot_tables")]
    pub slots: Option<BTreeMap<String, ObjectSpec>>,
}

/// Number of optional keys of [`ObjectSpec`], except name, category, visible, shadow_catcher and lidar.
pub(crate) const KEYS: usize = 59;

impl ObjectSpec {
    /// Returns the keys that are present.
    pub(crate) fn keys(&self) -> Keys<KEYS> {
        Keys(by_key! { self, is_some:
            "box" box_, plane, sphere, cylinder, cone, torus, mesh, upright, vertices, triangles, instance_of,
            refine, displace, face_colors, vertex_colors, uvs, normals,
            location, roll, pitch, yaw, scale, matrix,
            "type" type_, color, texture, textures, wrap, height_scale, diffuse, specular, shininess, emission, opacity, alpha,
            metal, roughness, ior, thin, dispersion, attenuation_color, attenuation_distance, priority, medium,
            metallic, specular_color, transmission, clearcoat, clearcoat_roughness, sheen_color, sheen_roughness,
            iridescence, iridescence_ior, iridescence_thickness, anisotropy, anisotropy_rotation,
            diffuse_transmission, diffuse_transmission_color, slots,
        })
    }
}

/// Use of the opacity and of a texture's alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AlphaMode {
    /// Both are ignored: the surface is fully opaque.
    Opaque,
    /// The product of both values is the fraction of the surface that is visible.
    Blend,
}

/// Reflection models with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MaterialType {
    /// Only diffuse.
    Matte,
    /// A metal, given by its name or by its color.
    Metal,
    /// A dielectric: glass, water, a pane.
    Glass,
    /// glTF's metallic-roughness with its extensions.
    Principled,
    /// The base colour itself, independent of light.
    Unlit,
    /// The border of a `medium`: it neither reflects nor refracts, and does not appear in ground truth.
    Boundary,
}
