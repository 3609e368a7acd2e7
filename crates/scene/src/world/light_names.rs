//! Names of lights, by which channels refer to them.

use crate::light::{Light, LightTraits};
use crate::world::names::Names;

/// Name by which channels refer to the light of all emissive surfaces.
pub const SURFACES: &str = "surfaces";

/// Names of lights, in order: the name in a light's traits, otherwise the light's type. Repeated names get a number:
/// `point`, `point-2`. Lights without an entry in `traits` have the default traits.
pub fn light_names(lights: &[Light], traits: &[LightTraits]) -> Vec<String> {
    let given = |index: usize| traits.get(index).and_then(|traits| traits.name.as_deref());
    let mut known = Names::from_used([SURFACES].into_iter());
    let mut names: Vec<Option<String>> =
        (0..lights.len()).map(|index| given(index).map(|name| known.unique(name))).collect();
    for (name, light) in names.iter_mut().zip(lights) {
        name.get_or_insert_with(|| known.unique(light.type_name()));
    }
    names.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_names_are_unique_and_prefer_given_names() {
        let lights = [Light::uniform_sky([1.0; 3]), Light::uniform_sky([1.0; 3]), Light::uniform_sky([1.0; 3])];
        let named = |name: &str| LightTraits { name: Some(name.into()), ..LightTraits::default() };
        assert_eq!(light_names(&lights, &[]), ["sky", "sky-2", "sky-3"]);
        let traits = [LightTraits::default(), named("key"), named("sky")];
        assert_eq!(light_names(&lights, &traits), ["sky-2", "key", "sky"]);
        assert_eq!(light_names(&lights[..1], &[named(SURFACES)]), ["surfaces-2"]);
    }
}
