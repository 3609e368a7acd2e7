//! Images that Python passes as arrays. Each array is converted to an image first; in the description, a name
//! replaces the array, like the name of an image file.

use std::sync::Arc;

use numpy::{PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_formats::{AssetRoot, FormatError};
use raycam_scene::{
    AssetLoader, ColorUse, IesProfile, Image, MeshFile, SingleMesh, Texels, Texture, TextureSampler, Up, Wrap,
};

use crate::arrays::NewArray;
use crate::error::{check_memory, world_error};
use crate::world::shared_files::SharedFiles;

/// Prefix of the names that replace arrays; the array's number follows. No file has such a name.
const MARK: &str = "\0array ";
/// File name of a light's image that was given as an array.
pub(crate) const NAME: &str = "array";

/// The images of a description that were given as arrays, in the order of their numbers.
#[derive(Default)]
pub(crate) struct ArrayImages(Vec<Arc<Image>>);

impl ArrayImages {
    /// Extracts the image arrays of `texture`, `textures` and `image` from a description, at any depth. Python's dicts
    /// are unchanged; the returned copy contains names in place of arrays.
    pub(crate) fn take_arrays<'py>(
        &mut self,
        description: &Bound<'py, PyAny>,
        key: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = description.py();
        if let Ok(dict) = description.cast::<PyDict>() {
            let copy = PyDict::new(py);
            for (name, value) in dict {
                let is_image = |word: &str| word.starts_with("texture") || word == "image";
                let inner = match name.extract::<String>() {
                    Ok(word) if is_image(&word) => "image".to_owned(),
                    Ok(word) if key != "image" => word,
                    _ => key.to_owned(),
                };
                copy.set_item(name, self.take_arrays(&value, &inner)?)?;
            }
            return Ok(copy.into_any());
        }
        if let Ok(list) = description.cast::<pyo3::types::PyList>()
            && matches!(key, "object" | "light")
        {
            let items = list.iter().map(|item| self.take_arrays(&item, key)).collect::<PyResult<Vec<_>>>()?;
            return Ok(pyo3::types::PyList::new(py, items)?.into_any());
        }
        if key == "image"
            && let Ok(array) = description.cast::<PyUntypedArray>()
            && array.ndim() >= 2
        {
            self.0.push(Arc::new(image_of_array(array)?));
            return Ok(format!("{MARK}{}", self.0.len() - 1).into_pyobject(py)?.into_any());
        }
        Ok(description.clone())
    }

    fn image_named(&self, name: &str, color_use: ColorUse) -> Option<Arc<Image>> {
        let image = self.0.get(name.strip_prefix(MARK)?.parse::<usize>().ok()?)?;
        let texels = match (&image.texels, color_use) {
            (Texels::Linear16(texels), ColorUse::Color) => Texels::from_srgb16(texels.clone()),
            (Texels::Srgb8(texels), ColorUse::Data) => Texels::Linear8(texels.clone()),
            _ => return Some(image.clone()),
        };
        Some(Arc::new(Image::new("", image.size, texels)))
    }
}

/// True if the name refers to an array.
pub(crate) fn is_array(name: &str) -> bool {
    name.starts_with(MARK)
}

/// Converts an array [h, w] or [h, w, 1..4] to an image. Integers and booleans are sRGB in colours and linear
/// elsewhere; floats are linear.
fn image_of_array(array: &Bound<'_, PyUntypedArray>) -> PyResult<Image> {
    let shape = array.shape().to_vec();
    let (height, width, channels) = match shape[..] {
        [height, width] => (height, width, 1),
        [height, width, channels @ 1..=4] => (height, width, channels),
        _ => return Err(world_error(format!("image of shape {shape:?}; expected [h, w] or [h, w, 1..4]"))),
    };
    if height == 0 || width == 0 || height > 65_536 || width > 65_536 {
        return Err(world_error(format!("image of {width} x {height} texels; expected 1 to 65536 columns and rows")));
    }
    // Checks the memory for the RGBA texels, and for copies in another order or width.
    let texel_bytes = if array.dtype().kind() == b'f' { 48 } else { 8 };
    check_memory(&format!("an image of {width} x {height} texels"), width * height * texel_bytes)?;
    let texels = if let Ok(bytes) = array.cast::<PyArrayDyn<u8>>() {
        Texels::Srgb8(texels_of(bytes, channels, 255)?)
    } else if array.dtype().kind() == b'b' {
        let bytes = array.call_method1("astype", ("uint8",))?.cast_into::<PyArrayDyn<u8>>()?;
        let texels = texels_of(&bytes, channels, 1)?;
        Texels::Srgb8(texels.into_iter().map(|texel| texel.map(|value| value * 255)).collect())
    } else if array.dtype().kind() == b'u' && array.dtype().itemsize() == 2 {
        // The values are converted to colours later, if the key that contains the image expects colours.
        let values = array.call_method1("astype", ("uint16",))?.cast_into::<PyArrayDyn<u16>>()?;
        Texels::Linear16(texels_of(&values, channels, u16::MAX)?)
    } else if array.dtype().kind() == b'f' {
        let floats = array.call_method1("astype", ("float32",))?.cast_into::<PyArrayDyn<f32>>()?;
        let texels = texels_of(&floats, channels, 1.0)?;
        let odd = texels.as_flattened().iter().filter(|value| !value.is_finite()).count();
        if odd > 0 {
            let message = format!(
                "infinite or NaN values ({odd} of {}); replace them, for example with numpy.nan_to_num",
                texels.as_flattened().len()
            );
            return Err(world_error(format!("image of {width} x {height} texels: {message}")));
        }
        Texels::Float(texels)
    } else {
        return Err(world_error(format!("image of dtype {}; expected uint8, uint16, bool or floats", array.dtype())));
    };
    Ok(Image::new("", [width as u32, height as u32], texels))
}

/// Converts grey, grey and alpha, RGB or RGBA to RGBA.
fn texels_of<T: numpy::Element + Copy>(array: &NewArray<'_, T>, channels: usize, opaque: T) -> PyResult<Vec<[T; 4]>> {
    let view = array.readonly();
    let copied: Vec<T>;
    // `as_slice` also accepts Fortran order, so the order is checked.
    let data = match view.as_slice().ok().filter(|_| view.is_c_contiguous()) {
        Some(data) => data,
        None => {
            copied = view.as_array().iter().copied().collect(); // iteration is in C order for any strides
            &copied[..]
        }
    };
    Ok(match channels {
        1 => data.iter().map(|&v| [v, v, v, opaque]).collect(),
        2 => data.as_chunks().0.iter().map(|&[v, a]| [v, v, v, a]).collect(),
        3 => data.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, opaque]).collect(),
        _ => data.as_chunks().0.to_vec(),
    })
}

/// Sources of a description's images and meshes: files, arrays, and files that other worlds have read.
pub(crate) struct FilesAndArrays<'a> {
    pub(crate) files: &'a mut AssetRoot,
    pub(crate) arrays: &'a ArrayImages,
    /// The files that were already read for other worlds.
    shared: Option<&'a SharedFiles>,
    /// The number of notices before the last mesh file was read.
    notice_count: usize,
}

impl<'a> FilesAndArrays<'a> {
    pub(crate) fn new(files: &'a mut AssetRoot, arrays: &'a ArrayImages) -> Self {
        Self { files, arrays, shared: None, notice_count: 0 }
    }

    /// With `shared`, files that several worlds use are read only once.
    pub(crate) fn sharing(self, shared: Option<&'a SharedFiles>) -> Self {
        Self { shared, ..self }
    }
}

impl AssetLoader for FilesAndArrays<'_> {
    type Error = FormatError;

    fn mesh(&mut self, file: &str) -> Result<MeshFile, FormatError> {
        self.notice_count = self.files.notices().len();
        self.files.mesh(file)
    }

    fn shared_mesh(&mut self, file: &str, up: Option<Up>) -> Option<SingleMesh> {
        let (mesh, notices) = self.shared?.mesh(file, up)?;
        self.files.repeat_notices(&notices);
        Some(mesh)
    }

    fn share_mesh(&mut self, file: &str, up: Option<Up>, mesh: &SingleMesh) {
        if let Some(shared) = self.shared {
            shared.keep_mesh(file, up, mesh, &self.files.notices()[self.notice_count..]);
        }
    }

    fn texture(&mut self, file: &str, wrap: [Wrap; 2], color_use: ColorUse) -> Result<Texture, FormatError> {
        if let Some(image) = self.arrays.image_named(file, color_use) {
            return Ok(Texture { image, sampler: TextureSampler { wrap, ..TextureSampler::default() } });
        }
        let read = |files: &mut AssetRoot| files.texture(file, wrap, color_use);
        match self.shared {
            Some(shared) => shared.texture(self.files, (file, wrap, color_use), read),
            None => read(self.files),
        }
    }

    fn environment(&mut self, file: &str) -> Result<Arc<Image>, FormatError> {
        if let Some(image) = self.arrays.image_named(file, ColorUse::Color) {
            self.files.check_environment_shape("the environment's array", image.size);
            return Ok(image);
        }
        match self.shared {
            Some(shared) => shared.environment(self.files, file, |files| files.environment(file)),
            None => self.files.environment(file),
        }
    }

    fn profile(&mut self, file: &str) -> Result<IesProfile, FormatError> {
        self.files.profile(file)
    }

    fn store_texture(&mut self, image: Arc<Image>) -> Result<Arc<Image>, FormatError> {
        AssetLoader::store_texture(self.files, image)
    }

    fn picture(&mut self, file: &str) -> Result<String, FormatError> {
        self.files.picture(file)
    }

    fn bytes(&mut self, file: &str) -> Result<Vec<u8>, FormatError> {
        self.files.bytes(file)
    }

    fn in_context(error: FormatError, key: &str) -> FormatError {
        AssetRoot::in_context(error, key)
    }
}
