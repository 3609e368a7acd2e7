//! The table of render options: ranges, defaults and precedence.

use raycam_scene::render_options::{AmbientOcclusion, Filter, Integrator, OptionRange, RENDER_OPTIONS, RenderOptions};
use raycam_scene::schema::json_schema;
use raycam_scene::{SceneError, ViewTransform};

/// Options from a JSON table.
fn options(json: &str) -> RenderOptions {
    serde_json::from_str(json).unwrap()
}

#[test]
fn every_option_has_a_description_in_the_json_schema() {
    let schema = serde_json::to_value(json_schema()).unwrap();
    let properties = schema["$defs"]["RenderOptions"]["properties"].as_object().unwrap();
    assert_eq!(properties.len(), RENDER_OPTIONS.len());
    for option in RENDER_OPTIONS {
        let described = properties[option.name]["description"].as_str().unwrap();
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(described), words(option.help()), "{}", option.name);
    }
}

#[test]
fn every_default_is_valid_and_options_without_a_default_are_off() {
    let defaults = RenderOptions::defaults();
    defaults.validate().unwrap();
    let given: Vec<_> = defaults.values().map(|(option, _)| option.name).collect();
    assert_eq!(given, ["integrator", "samples", "filter", "seed", "ambient_occlusion", "exposure", "view"]);
    assert_eq!(defaults.integrator, Some(Integrator::Direct));
}

#[test]
fn values_outside_the_range_are_refused_with_name_and_range() {
    for (json, name) in [
        (r#"{"samples": 0}"#, "samples"),
        (r#"{"samples": 16777217}"#, "samples"),
        (r#"{"max_depth": 0}"#, "max_depth"),
        (r#"{"threads": 0}"#, "threads"),
        (r#"{"threads": 1025}"#, "threads"),
        (r#"{"noise_threshold": 0}"#, "noise_threshold"),
        (r#"{"noise_threshold": -0.5}"#, "noise_threshold"),
        (r#"{"noise_threshold": 1e-60}"#, "noise_threshold"),
        (r#"{"clamp": 1e39}"#, "clamp"),
        (r#"{"time_limit": 0}"#, "time_limit"),
        (r#"{"ambient_occlusion": -1}"#, "ambient_occlusion"),
        (r#"{"exposure": 100.5}"#, "exposure"),
        (r#"{"exposure": -1e9}"#, "exposure"),
    ] {
        let SceneError::Schema { path, message, .. } = options(json).validate().unwrap_err() else { panic!("{json}") };
        let range = RENDER_OPTIONS.iter().find(|option| option.name == name).unwrap().range;
        assert_eq!(path, name);
        assert!(message.ends_with(&format!("expected {range}")), "{message}");
    }
    for json in [
        r#"{"samples": 1}"#,
        r#"{"samples": 16777216, "threads": 1024, "max_depth": 4294967295}"#,
        r#"{"seed": 18446744073709551615}"#,
        r#"{"clamp": 3e38, "time_limit": 1e-9, "exposure": -100}"#,
        r#"{"ambient_occlusion": false}"#,
    ] {
        options(json).validate().unwrap();
    }
    let nan = RenderOptions { exposure: Some(f64::NAN), ..RenderOptions::default() };
    assert!(nan.validate().is_err());
}

#[test]
fn noise_threshold_and_time_limit_cannot_be_combined() {
    assert!(options(r#"{"noise_threshold": 0.1, "time_limit": 1}"#).validate().is_err());
}

#[test]
fn given_options_take_precedence_over_the_worlds_and_the_defaults() {
    let world = options(r#"{"samples": 3, "seed": 7, "ambient_occlusion": 2.5}"#);
    let found = options(r#"{"samples": 5, "filter": "blackman-harris"}"#).or(&world).complete().unwrap();
    assert_eq!(found.samples, Some(5));
    assert_eq!(found.seed, Some(7));
    assert_eq!(found.filter, Some(Filter::BlackmanHarris));
    assert_eq!(found.view, Some(ViewTransform::Standard));
    assert_eq!(found.ambient_occlusion.and_then(AmbientOcclusion::max_distance), Some(2.5));
    assert_eq!(found.clamp, None);
}

#[test]
fn adaptive_sampling_raises_the_default_number_of_samples() {
    for json in [r#"{"noise_threshold": 0.1}"#, r#"{"time_limit": 1}"#] {
        assert_eq!(options(json).complete().unwrap().samples, Some(16384));
    }
    assert_eq!(options(r#"{"time_limit": 1, "samples": 9}"#).complete().unwrap().samples, Some(9));
    assert_eq!(options("{}").complete().unwrap().samples, Some(16));
}

#[test]
fn enum_names_are_read_and_written_equally() {
    for &name in Integrator::NAMES {
        assert_eq!(Integrator::from_name(name).unwrap().name(), name);
        assert_eq!(options(&format!(r#"{{"integrator": "{name}"}}"#)).integrator, Integrator::from_name(name));
    }
    assert_eq!(Integrator::from_name("bdpt"), None);
    let names = RENDER_OPTIONS.iter().filter(|option| matches!(option.range, OptionRange::Names(_)));
    assert_eq!(names.count(), 3);
}
