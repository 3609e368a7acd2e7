//! Bodies of lamps: objects in the shape of a light, so that the light occludes and appears in ground truth.
//!
//! The light's radiance does not change. The body is an object that reflects nothing; its surface is the light's
//! surface, or is inside the light's surface by at most 0.1 % of the radius.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec3};

use crate::error::{Result, SceneError};
use crate::light::{Light, LightVisibility};
use crate::material::{Material, MaterialModel};
use crate::mesh::{Mesh, primitive};
use crate::world::{Object, RayVisibility, World};

/// Subdivision level of a sphere's icosphere, which has 5,120 triangles.
const SPHERE_LEVEL: u32 = 4;
/// Number of triangles of a disk.
const DISK_SEGMENTS: u32 = 256;

/// Shape of a light with a size; its mesh is at the origin and has unit size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LampShape {
    Rectangle,
    Disk,
    Sphere,
}

impl LampShape {
    /// Shape and placement of a light; `None` for a light without a size.
    fn of_light(light: &Light) -> Option<(Self, DAffine3)> {
        match *light {
            Light::Rectangle { position, u, v, .. } => {
                let [u, v] = [u, v].map(DVec3::from);
                let normal = u.cross(v);
                let axes = DMat3::from_cols(u, v, normal / normal.length().sqrt());
                Some((Self::Rectangle, DAffine3::from_mat3_translation(axes, position.into())))
            }
            Light::Disk { position, direction, radius, .. } => {
                let normal = DVec3::from(direction).normalize();
                let (right, up) = normal.any_orthonormal_pair();
                let axes = DMat3::from_cols(right, up, right.cross(up)) * DMat3::from_diagonal(DVec3::splat(radius));
                Some((Self::Disk, DAffine3::from_mat3_translation(axes, position.into())))
            }
            Light::Point { position, radius, .. } | Light::Spot { position, radius, .. } if radius > 0.0 => {
                let axes = DMat3::from_diagonal(DVec3::splat(radius));
                Some((Self::Sphere, DAffine3::from_mat3_translation(axes, position.into())))
            }
            _ => None,
        }
    }

    /// Creates the shape's mesh; a flat mesh faces +z.
    fn mesh(self) -> Result<Mesh> {
        match self {
            Self::Rectangle => primitive::plane([1.0; 2]),
            Self::Disk => Ok(disk()),
            Self::Sphere => primitive::sphere(1.0, SPHERE_LEVEL),
        }
    }
}

/// A disk of radius 1 that faces +z, with all vertices but the centre on its edge.
fn disk() -> Mesh {
    let edge = (0..DISK_SEGMENTS).map(|i| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(DISK_SEGMENTS)).sin_cos();
        DVec3::new(cos, sin, 0.0)
    });
    let triangles = (0..DISK_SEGMENTS).map(|i| [0, 1 + i, 1 + (i + 1) % DISK_SEGMENTS]).collect();
    Mesh { vertices: [DVec3::ZERO].into_iter().chain(edge).collect(), triangles, ..Mesh::default() }
}

/// The material of bodies: white with the integrator `flat`, otherwise black, because it reflects nothing.
fn body_material() -> Material {
    let model = MaterialModel::Phong { diffuse: 0.0, specular: [0.0; 3], shininess: 32.0 };
    Material { name: "lamp".into(), model, ..Material::default() }
}

/// Kinds of rays to which the body of a light is visible.
fn ray_visibility(visible: LightVisibility) -> RayVisibility {
    RayVisibility { camera: visible.camera, reflection: visible.reflection, shadow: true }
}

impl World {
    /// Index of the object that is the body of a light; `None` if the light has no body.
    pub fn lamp_body(&self, light: usize) -> Option<usize> {
        self.objects.iter().position(|object| object.lamp == Some(light))
    }

    /// Checks that a light can have a body.
    ///
    /// # Errors
    /// [`SceneError::World`] for a light without a size.
    pub(crate) fn check_lamp_body(light: &Light) -> Result<()> {
        if LampShape::of_light(light).is_some() {
            return Ok(());
        }
        let remedy = match light {
            Light::Point { .. } | Light::Spot { .. } => "give it a radius",
            _ => "only area and disk lights, and bulbs and spots with a radius, can have a body",
        };
        Err(SceneError::light(format!(
            "a light of type {:?} without a size cannot have a body; {remedy}",
            light.type_name()
        )))
    }

    /// Adds, changes or removes the body of a light according to its traits.
    ///
    /// # Errors
    /// [`SceneError::World`] for a light without a size.
    pub(crate) fn update_lamp_body(&mut self, number: usize) -> Result<()> {
        let traits = self.traits_of_light(number);
        let body = self.lamp_body(number);
        if !traits.has_body {
            return body.map_or(Ok(()), |body| self.remove_object(body));
        }
        let light = &self.lights[number];
        Self::check_lamp_body(light)?;
        let name = traits.name.clone().unwrap_or_else(|| light.type_name().to_owned());
        let Some((shape, world_from_mesh)) = LampShape::of_light(light) else { return Ok(()) };
        let before = self.parts_in_use();
        let mesh = self.lamp_mesh(shape)?;
        let rays = ray_visibility(traits.visible);
        match body {
            Some(body) => {
                self.place_object(body, world_from_mesh)?;
                (self.objects[body].mesh, self.objects[body].ray_visibility) = (mesh, rays);
                self.remove_unused(&before);
            }
            None => {
                let material = self.lamp_material()?;
                let object = Object::new(name, mesh, vec![material], world_from_mesh);
                self.add_object(Object { lamp: Some(number), ray_visibility: rays, ..object })?;
            }
        }
        Ok(())
    }

    /// Returns the index of a shape's mesh, which is shared with the bodies of other lights.
    fn lamp_mesh(&mut self, shape: LampShape) -> Result<usize> {
        let is_of_shape = |light: usize| {
            self.lights.get(light).and_then(LampShape::of_light).is_some_and(|(other, _)| other == shape)
        };
        let mesh = shape.mesh()?;
        let same = |object: &&Object| object.lamp.is_some_and(is_of_shape) && *self.meshes[object.mesh] == mesh;
        if let Some(object) = self.objects.iter().find(same) {
            return Ok(object.mesh);
        }
        Ok(self.add_mesh(mesh))
    }

    /// Returns the index of the bodies' material, which is shared with the bodies of other lights.
    fn lamp_material(&mut self) -> Result<usize> {
        let material = body_material();
        let materials = self.objects.iter().filter(|object| object.lamp.is_some()).flat_map(|body| &body.materials);
        match materials.copied().find(|&own| self.materials[own] == material) {
            Some(known) => Ok(known),
            None => self.add_material(material),
        }
    }
}
