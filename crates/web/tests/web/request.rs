//! Requests for images as JSON.

use raycam_render::{Channel, Integrator, Settings};
use raycam_scene::NoticeCode;
use raycam_scene::render_options::RenderOptions;
use raycam_web::request::settings;

#[test]
fn missing_options_have_the_worlds_value_or_the_default() {
    let world = RenderOptions { seed: Some(7), samples: Some(3), time_limit: Some(2.0), ..RenderOptions::default() };
    let request = r#"{"samples": 5, "integrator": "path", "channels": ["depth"], "region": [1, 2, 3, 4]}"#;
    let (found, notices) = settings(request, &world).unwrap();
    let expected = Settings {
        integrator: Integrator::Path,
        samples: 5,
        seed: 7,
        channels: vec![Channel::Depth],
        region: Some([1, 2, 3, 4]),
        ..Settings::default()
    };
    assert_eq!(found, expected);
    assert_eq!(notices[0].code, NoticeCode::UnusedOption);
    let (found, _) = settings(r#"{"noise_threshold": 0.5}"#, &RenderOptions::default()).unwrap();
    assert_eq!((found.samples, found.integrator), (1 << 14, Integrator::Direct));
    assert_eq!(found.channels.len(), Channel::all().filter(|channel| !channel.is_pass()).count());
}

#[test]
fn unknown_names_are_refused() {
    for (request, word) in [
        (r#"{"sample": 5}"#, "sample"),
        (r#"{"channels": ["deep"]}"#, "deep"),
        (r#"{"integrator": "fast"}"#, "fast"),
        (r#"{"samples": -1}"#, "-1"),
        (r#"{"samples": 0}"#, "samples: 0"),
        (r#"{"surface": "second"}"#, "second"),
    ] {
        let error = settings(request, &RenderOptions::default()).unwrap_err();
        assert!(error.contains(word), "{error}");
    }
}
