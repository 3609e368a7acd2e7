//! Helper functions that several tests use.
#![allow(dead_code, reason = "each test file uses only some of these functions")]

use glam::{DMat3, DQuat, DVec3};
use raycam_scene::schema::{Entry, SpannedValue, Value};
use raycam_scene::{AssetLoader, ColorUse, IesProfile, MeshFile, SceneError, Texture, Wrap};

/// Parses a description from JSON text, which is the shortest notation.
pub fn node(json: &str) -> SpannedValue {
    from_json(&serde_json::from_str(json).expect("valid JSON"))
}

fn from_json(json: &serde_json::Value) -> SpannedValue {
    use serde_json::Value as Json;
    SpannedValue::from(match json {
        Json::Null => Value::Null,
        Json::Bool(v) => Value::Bool(*v),
        Json::Number(v) => v.as_i64().map_or(Value::Float(v.as_f64().expect("a float")), Value::Integer),
        Json::String(v) => Value::String(v.clone()),
        Json::Array(items) => Value::List(items.iter().map(from_json).collect()),
        Json::Object(entries) => Value::Table(
            entries
                .iter()
                .map(|(key, value)| Entry { key: key.clone(), key_span: None, value: from_json(value) })
                .collect(),
        ),
    })
}

/// Loader with constant files: every mesh file is this model, and every image is one red texel.
pub struct FakeFiles(pub MeshFile);

impl AssetLoader for FakeFiles {
    type Error = SceneError;

    fn mesh(&mut self, _: &str) -> Result<MeshFile, SceneError> {
        Ok(self.0.clone())
    }

    fn texture(&mut self, file: &str, wrap: [Wrap; 2], _: ColorUse) -> Result<Texture, SceneError> {
        Ok(Texture::from_srgb8(file, [1, 1], [[255, 0, 0]], wrap))
    }

    fn profile(&mut self, _: &str) -> Result<IesProfile, SceneError> {
        Ok(IesProfile { vertical: vec![0.0, 90.0], horizontal: vec![0.0], candela: vec![100.0, 0.0] })
    }

    fn in_context(error: SceneError, key: &str) -> SceneError {
        error.in_context(key)
    }
}

/// Reproducible random numbers in 0..1 (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A random rotation.
pub fn rotation(random: &mut Random) -> DMat3 {
    let axis = loop {
        let axis = DVec3::from_array(std::array::from_fn(|_| random.between(-1.0, 1.0)));
        if axis.length() > 0.1 {
            break axis.normalize();
        }
    };
    DMat3::from_quat(DQuat::from_axis_angle(axis, random.between(-3.2, 3.2)))
}
