//! Serde representation of textures that stores a shared image only once.

use std::collections::HashMap;
use std::sync::Arc;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::counted::counted;
use crate::texture::{Image, Texture, TextureSampler};

#[derive(Serialize)]
struct SerializedTextures<'a> {
    images: Vec<&'a Image>,
    textures: Vec<(usize, TextureSampler)>,
}

#[derive(Deserialize)]
struct DeserializedTextures {
    images: Vec<Arc<Image>>,
    textures: Vec<(usize, TextureSampler)>,
}

pub(crate) fn serialize<S: Serializer>(textures: &[Arc<Texture>], serializer: S) -> Result<S::Ok, S::Error> {
    let mut images: Vec<&Image> = Vec::new();
    let mut known = HashMap::new();
    let textures = textures
        .iter()
        .map(|texture| {
            let index = *known.entry(Arc::as_ptr(&texture.image)).or_insert_with(|| {
                images.push(&texture.image);
                images.len() - 1
            });
            (index, texture.sampler)
        })
        .collect();
    SerializedTextures { images, textures }.serialize(serializer)
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Arc<Texture>>, D::Error> {
    let DeserializedTextures { images, textures } = DeserializedTextures::deserialize(deserializer)?;
    let texture = |(index, sampler): (usize, TextureSampler)| match images.get(index) {
        Some(image) => Ok(Arc::new(Texture { image: image.clone(), sampler })),
        None => Err(D::Error::custom(format_args!(
            "image {index} does not exist; the world has {}",
            counted(images.len(), "image")
        ))),
    };
    textures.into_iter().map(texture).collect()
}
