//! Output channels (AOVs), as a table with one row per channel.

use crate::film::light_name::LightName;

/// Number type of a channel's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelType {
    /// float32.
    F32,
    /// float64.
    F64,
    /// int32.
    I32,
}

/// Output channel of a frame. All channels except `Color`, its parts (`Emission` to `Light`), `Coverage`, `Alpha`,
/// `Shadow` and `Error` describe the exact ray through the pixel centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Linear Rec. 709 radiance, filtered over the pixel's samples. Background: radiance of the environment, or
    /// black.
    Color,
    /// Linear Rec. 709 base colour, unlit: material, face or vertex colour and texture. Background: 0.
    Albedo,
    /// z along the camera's principal axis, in metres. Background: +inf.
    Depth,
    /// Length of the ray from the camera centre to the surface, in metres. Background: +inf.
    Distance,
    /// Surface point in world coordinates. Background: NaN.
    Position,
    /// Unit geometric normal in world coordinates, on the side that faces the camera. Background: 0.
    Normal,
    /// Unit geometric normal in camera axes (x right, y down, z forward). On surfaces that face the camera z is
    /// negative. Background: 0.
    NormalCamera,
    /// Unit shading normal, interpolated from vertex normals, in world coordinates, on the side that faces the camera;
    /// the geometric normal if the mesh has no vertex normals. Background: 0.
    ShadingNormal,
    /// Unit shading normal in camera axes. Background: 0.
    ShadingNormalCamera,
    /// Index of the object. Background: -1.
    Instance,
    /// Index of the object's category in [`raycam_scene::world::category`]. Background, and an object without a
    /// category: -1.
    Category,
    /// Index of the triangle in its mesh. Background: -1.
    Triangle,
    /// Barycentric coordinates of the surface point; their sum is 1. Background: 0.
    Barycentric,
    /// Texture coordinates; v = 0 is the top row of the image. Background, and a mesh without texture coordinates:
    /// NaN.
    Uv,
    /// Index of the material in the world. Background: -1.
    Material,
    /// Fraction of the pixel's samples that hit the same object as the centre ray; the background counts as an object.
    /// The value is 1 if the pixel shows only one object. The setting `surface` chooses first or solid surfaces.
    Coverage,
    /// Fraction of the pixel's samples, weighted by the filter, that hit a surface. With
    /// [`crate::Settings::transparent_background`] the colour is premultiplied by alpha. Partly opaque surfaces count
    /// in proportion to their opacity, mirrors and glass fully.
    Alpha,
    /// Fraction of each colour's light that shadow catchers leave to the background; 1 without a shadow. A single frame
    /// always has 1, because the channel is a ratio of two frames.
    Shadow,
    /// Fraction of light of each colour that fog and other media let pass between the camera and the surface.
    /// Background: the fraction along an infinite ray, 1 without fog.
    Transmittance,
    /// Light that reaches the camera without any scattering: emissive and unlit surfaces, lamps and the environment.
    /// With `direct` and `indirect`, and with `diffuse`, `specular` and `volume`, the sum is the colour. With the
    /// integrators `flat` and `ao`, this channel contains all of the colour. Background: radiance of the environment.
    Emission,
    /// Light that a surface or a medium scatters once. Background: 0, or light that fog scatters.
    Direct,
    /// Light that is scattered more than once. Background: 0, or light that fog scatters.
    Indirect,
    /// Light that the first visible surface scatters by its diffuse lobes. Background: 0.
    Diffuse,
    /// Light that the first visible surface scatters by all other lobes: highlights, reflections and refraction.
    /// Background: 0.
    Specular,
    /// Light that a medium in front of all surfaces scatters. Background: the same.
    Volume,
    /// Light of one source: `light:NAME`, where NAME is a light of the world or `surfaces`, all emissive and unlit
    /// surfaces. The sum over all sources is the colour. Background: radiance of the source.
    Light(LightName),
    /// Perceptual roughness, 0 to 1; 1 for surfaces without highlights. Background: 0.
    Roughness,
    /// Metalness, 0 to 1. Background: 0.
    Metallic,
    /// Normalised object coordinates: the surface point in the object's axes, relative to the object's box, whose
    /// diagonal has length 1 and whose centre is (0.5, 0.5, 0.5). Background: NaN.
    Nocs,
    /// Pixel coordinates in the image of the world's first projector, for surface points that receive the projector's
    /// light directly, in the pixel convention of the projector's camera. NaN for points that the projector does not
    /// illuminate: outside its image, behind another surface, or turned away; and in worlds without a projector.
    /// Background: NaN.
    ProjectorUv,
    /// Estimated standard error of the colour's luminance, from independent replications of the sample sequence.
    /// Requesting this channel changes the samples drawn. The value is +inf with one sample per pixel.
    Error,
}

/// A row of the channel table.
struct ChannelInfo {
    channel: Channel,
    name: &'static str,
    pixel_type: PixelType,
    components: usize,
}

const fn info(channel: Channel, name: &'static str, kind: PixelType, components: usize) -> ChannelInfo {
    ChannelInfo { channel, name, pixel_type: kind, components }
}

const CHANNELS: [ChannelInfo; 30] = [
    info(Channel::Color, "color", PixelType::F32, 3),
    info(Channel::Albedo, "albedo", PixelType::F32, 3),
    info(Channel::Depth, "depth", PixelType::F32, 1),
    info(Channel::Distance, "distance", PixelType::F32, 1),
    info(Channel::Position, "position", PixelType::F64, 3),
    info(Channel::Normal, "normal", PixelType::F32, 3),
    info(Channel::NormalCamera, "normal_camera", PixelType::F32, 3),
    info(Channel::ShadingNormal, "shading_normal", PixelType::F32, 3),
    info(Channel::ShadingNormalCamera, "shading_normal_camera", PixelType::F32, 3),
    info(Channel::Instance, "instance", PixelType::I32, 1),
    info(Channel::Category, "category", PixelType::I32, 1),
    info(Channel::Triangle, "triangle", PixelType::I32, 1),
    info(Channel::Barycentric, "barycentric", PixelType::F32, 3),
    info(Channel::Uv, "uv", PixelType::F32, 2),
    info(Channel::Material, "material", PixelType::I32, 1),
    info(Channel::Coverage, "coverage", PixelType::F32, 1),
    info(Channel::Alpha, "alpha", PixelType::F32, 1),
    info(Channel::Shadow, "shadow", PixelType::F32, 3),
    info(Channel::Transmittance, "transmittance", PixelType::F32, 3),
    info(Channel::Emission, "emission", PixelType::F32, 3),
    info(Channel::Direct, "direct", PixelType::F32, 3),
    info(Channel::Indirect, "indirect", PixelType::F32, 3),
    info(Channel::Diffuse, "diffuse", PixelType::F32, 3),
    info(Channel::Specular, "specular", PixelType::F32, 3),
    info(Channel::Volume, "volume", PixelType::F32, 3),
    info(Channel::Roughness, "roughness", PixelType::F32, 1),
    info(Channel::Metallic, "metallic", PixelType::F32, 1),
    info(Channel::Nocs, "nocs", PixelType::F32, 3),
    info(Channel::ProjectorUv, "projector_uv", PixelType::F32, 2),
    info(Channel::Error, "error", PixelType::F32, 1),
];

impl Channel {
    /// Returns all channels except the channels of single lights, in the order of the table.
    pub fn all() -> impl Iterator<Item = Channel> {
        CHANNELS.iter().map(|row| row.channel)
    }

    /// Returns the channel with this name.
    pub fn from_name(name: &str) -> Option<Channel> {
        let row = CHANNELS.iter().find(|row| row.name == name);
        row.map(|row| row.channel).or_else(|| LightName::from_channel(name).map(Channel::Light))
    }

    /// Row of the table; `None` for a channel that shows the light of one source.
    fn row(self) -> Option<&'static ChannelInfo> {
        CHANNELS.iter().find(|row| row.channel == self)
    }

    /// Returns the name in files and in Python.
    pub fn name(self) -> &'static str {
        match self {
            Channel::Light(name) => name.channel(),
            _ => self.row().map_or("", |row| row.name),
        }
    }

    /// Returns the number type of the values.
    pub fn pixel_type(self) -> PixelType {
        self.row().map_or(PixelType::F32, |row| row.pixel_type)
    }

    /// Returns the number of values per pixel.
    pub fn components(self) -> usize {
        self.row().map_or(3, |row| row.components)
    }

    /// True if the channel needs the exact ray through the pixel centre.
    pub(crate) fn is_ground_truth(self) -> bool {
        !matches!(self, Channel::Color | Channel::Alpha | Channel::Shadow | Channel::Error) && !self.is_pass()
    }

    /// True if the channel is a part of the colour.
    pub fn is_pass(self) -> bool {
        use Channel as C;
        let is_lobe = matches!(self, C::Diffuse | C::Specular | C::Volume);
        is_lobe || matches!(self, C::Emission | C::Direct | C::Indirect | C::Light(_))
    }

    /// True if the values contain light.
    pub(crate) fn shows_light(self) -> bool {
        self.is_pass() || matches!(self, Channel::Color | Channel::Error)
    }

    /// True if the values change with the number of samples.
    pub(crate) fn depends_on_samples(self) -> bool {
        self.is_pass() || matches!(self, Channel::Color | Channel::Alpha | Channel::Coverage | Channel::Error)
    }

    /// Returns the bytes per pixel.
    pub(crate) fn bytes(self) -> u64 {
        let value = match self.pixel_type() {
            PixelType::F32 | PixelType::I32 => 4,
            PixelType::F64 => 8,
        };
        value * self.components() as u64
    }
}
