//! The channels a frame may have: one table, a row per channel.

/// What one pixel of a channel is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelType {
    /// float32.
    F32,
    /// float64.
    F64,
    /// int32.
    I32,
}

/// What a frame can say about each pixel. All but `Color`, `Coverage`, `Alpha` and `Error` describe the exact pixel-centre ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Linear Rec. 709 radiance, filtered over the pixel's samples. Background: the sky's radiance, or black.
    Color,
    /// Linear Rec. 709 base colour of the surface, whatever the light: material, face or vertex colour and texture.
    /// Background: 0.
    Albedo,
    /// z along the camera's principal axis, in metres. Background: +inf.
    Depth,
    /// Length of the ray from the camera centre to the surface, in metres. Background: +inf.
    Distance,
    /// The surface point, in world coordinates. Background: NaN.
    Position,
    /// The unit normal of the triangle in the world, on the side that faces the camera. Background: 0.
    Normal,
    /// The same in the camera's axes, x right, y down, z forward: towards the camera z is negative. Background: 0.
    NormalCamera,
    /// The unit normal of the smooth surface that the triangle stands for, from its corners' normals, in the world and on
    /// the side that faces the camera; the triangle's own where the mesh has none. Background: 0.
    ShadingNormal,
    /// The same in the camera's axes. Background: 0.
    ShadingNormalCamera,
    /// Index of the object. Background: -1.
    Instance,
    /// The object's category, by its number in [`raycam_scene::world::category`]. Background, and an object without: -1.
    Category,
    /// Index of the triangle within its object's mesh. Background: -1.
    Triangle,
    /// Weights of the triangle's three corners at the surface point; their sum is 1. Background: 0.
    Barycentric,
    /// Texture coordinates; v = 0 is the top row of the image. Background, and a mesh without: NaN.
    Uv,
    /// Index of the material in the world. Background: -1.
    Material,
    /// The fraction of the pixel's samples that see the same object as the pixel-centre ray, the background counting as
    /// one: 1 is a pure pixel. Of the surfaces that the ground truth tells of, the first ones or the solid ones.
    Coverage,
    /// The fraction of the pixel's samples, as the filter weighs them, that meet anything but the sky: where it is left
    /// out ([`crate::Settings::transparent`]), the colour is premultiplied by it. What is see-through by its opacity
    /// counts in part, mirrors and glass count in full.
    Alpha,
    /// The estimated standard error of the colour's luminance, by the scatter of independent sequences of samples: asking
    /// for it draws other samples than not asking. With one sample per pixel: +inf.
    Error,
}

/// A row of the channel table.
struct ChannelInfo {
    channel: Channel,
    name: &'static str,
    pixel_type: PixelType,
    components: usize,
}

const fn info(
    channel: Channel,
    name: &'static str,
    kind: PixelType,
    components: usize,
) -> ChannelInfo {
    ChannelInfo {
        channel,
        name,
        pixel_type: kind,
        components,
    }
}

const CHANNELS: [ChannelInfo; 18] = [
    info(Channel::Color, "color", PixelType::F32, 3),
    info(Channel::Albedo, "albedo", PixelType::F32, 3),
    info(Channel::Depth, "depth", PixelType::F32, 1),
    info(Channel::Distance, "distance", PixelType::F32, 1),
    info(Channel::Position, "position", PixelType::F64, 3),
    info(Channel::Normal, "normal", PixelType::F32, 3),
    info(Channel::NormalCamera, "normal_camera", PixelType::F32, 3),
    info(Channel::ShadingNormal, "shading_normal", PixelType::F32, 3),
    info(
        Channel::ShadingNormalCamera,
        "shading_normal_camera",
        PixelType::F32,
        3,
    ),
    info(Channel::Instance, "instance", PixelType::I32, 1),
    info(Channel::Category, "category", PixelType::I32, 1),
    info(Channel::Triangle, "triangle", PixelType::I32, 1),
    info(Channel::Barycentric, "barycentric", PixelType::F32, 3),
    info(Channel::Uv, "uv", PixelType::F32, 2),
    info(Channel::Material, "material", PixelType::I32, 1),
    info(Channel::Coverage, "coverage", PixelType::F32, 1),
    info(Channel::Alpha, "alpha", PixelType::F32, 1),
    info(Channel::Error, "error", PixelType::F32, 1),
];

impl Channel {
    /// Every channel, in the order of the table.
    pub fn all() -> impl Iterator<Item = Channel> {
        CHANNELS.iter().map(|row| row.channel)
    }

    /// The channel of that name.
    pub fn from_name(name: &str) -> Option<Channel> {
        CHANNELS
            .iter()
            .find(|row| row.name == name)
            .map(|row| row.channel)
    }

    /// Its name in files and in Python.
    pub fn name(self) -> &'static str {
        CHANNELS[self as usize].name
    }

    /// What its values are stored as.
    pub fn pixel_type(self) -> PixelType {
        CHANNELS[self as usize].pixel_type
    }

    /// Values per pixel.
    pub fn components(self) -> usize {
        CHANNELS[self as usize].components
    }

    /// Whether it comes from the exact ray through the pixel centre.
    pub(crate) fn is_ground_truth(self) -> bool {
        !matches!(self, Channel::Color | Channel::Alpha | Channel::Error)
    }

    /// Bytes per pixel.
    pub(crate) fn bytes(self) -> u64 {
        let value = match self.pixel_type() {
            PixelType::F32 | PixelType::I32 => 4,
            PixelType::F64 => 8,
        };
        value * self.components() as u64
    }
}
