//! Lens of an OpenCV file. Its coefficients are OpenCV's, from `cv2.calibrateCamera` or from `cv2.fisheye.calibrate`;
//! if a file is ambiguous, reading fails with a message that lists the lens models.

use raycam_scene::{Lens, LensModel, counted};

use crate::ReadHints;
use crate::document::{Cursor, Value, lens_keys::plain, lens_named};
use crate::opencv::key_view::KeyView;
use crate::opencv::keys;
use raycam_formats::Result;

/// Reads the lens, with the model specified by the file or the caller.
pub(super) fn read(view: &KeyView<'_>, hints: &ReadHints) -> Result<Lens> {
    let (shown, numbers) = coefficients(view)?;
    let shown = shown.unwrap_or_else(|| view.at.clone());
    let fail = |error: &dyn std::fmt::Display| shown.fail(error);
    if let Some(xi) = view.find_value(&keys::XI)? {
        let xi = match xi.node.value {
            Value::Scalar(_) => xi.number()?,
            _ => xi.array::<1>()?[0],
        };
        return omnidirectional(view, &shown, xi, &numbers);
    }
    let stated = stated(view)?;
    if let (Some((at, stated)), Some(lens)) = (&stated, hints.lens)
        && lens_named(stated, &numbers).is_ok_and(|made| made.coefficients().is_some_and(|(model, _)| model != lens))
    {
        return Err(at.fail(format_args!("the file specifies {stated:?}, but lens is {:?}; omit lens", lens.name())));
    }
    if let Some(lens) = hints.lens {
        let plain = numbers.is_empty() && lens == LensModel::OpenCv;
        return if plain { Ok(Lens::Pinhole) } else { Lens::new(lens, &numbers).map_err(|error| fail(&error)) };
    }
    match stated {
        Some((_, stated)) => lens_named(stated, &numbers).map_err(|message| fail(&message)),
        None if may_be_fisheye(view, &shown, &numbers) => Err(shown.fail(
            "four coefficients of an unknown lens model: k1 k2 p1 p2 of cv2.calibrateCamera, or k1 k2 k3 k4 of \
             cv2.fisheye. Specify the model (--lens opencv or fisheye, model=\"opencv\" or \"fisheye\" in Python), or \
             write distortion_model into the file",
        )),
        None => lens_named("opencv", &numbers).map_err(|message| fail(&message)),
    }
}

/// The lens of a camera with the key `xi`, which is a parameter of lens model omni. If the file specifies another model, `xi`
/// must be 0.
fn omnidirectional(view: &KeyView<'_>, shown: &Cursor<'_>, xi: f64, numbers: &[f64]) -> Result<Lens> {
    match stated(view)? {
        Some((_, name)) if xi == 0.0 && !is_omni(name) => {
            lens_named(name, numbers).map_err(|message| shown.fail(message))
        }
        Some((at, name)) if !is_omni(name) => Err(at.fail(format_args!(
            "{name:?} is specified, but xi = {xi} requires lens model omni; remove xi, or change the model to omni"
        ))),
        _ => Lens::new(LensModel::Omni, &[&[xi], numbers].concat()).map_err(|error| shown.fail(error)),
    }
}

/// True for a name of lens model omni.
fn is_omni(name: &str) -> bool {
    let name = plain(name);
    name.contains("omni") || name == "mei"
}

/// Value of the coefficients' key, or otherwise the map under a key of the lens model, such as
/// `lens: {type: fisheye, coeffs: [...]}`.
fn lens_value<'a>(view: &KeyView<'a>) -> Result<Option<Cursor<'a>>> {
    let map = || view.all(&keys::MODEL).into_iter().find(keys::is_keyed);
    Ok(view.find_value(&keys::LENS)?.or_else(map))
}

/// Reads coefficients from a list or by name; returns the list's node and the coefficients.
fn coefficients<'a>(view: &KeyView<'a>) -> Result<(Option<Cursor<'a>>, Vec<f64>)> {
    let mut list = lens_value(view)?;
    // The value may be a map with the model and the coefficients.
    while let Some(at) = list.as_ref().filter(|at| keys::is_keyed(at)) {
        let inner = KeyView::new(at.clone());
        let Some(found) = inner.find_value(&keys::LENS)?.or(inner.find_value(&keys::PARAMETERS)?) else { break };
        at.unread_keys(|key| {
            inner.has_name(key, &keys::LENS) || inner.has_name(key, &keys::PARAMETERS) || is_model(key)
        })?;
        list = Some(found);
    }
    if let Some(at) = view.find_value(&keys::RADIAL)? {
        return radial_and_tangential(view, list, at);
    }
    if let Some(map) = list.as_ref().filter(|at| keys::is_keyed(at)).map(|at| KeyView::new(at.clone()))
        && let Some(at) = map.find_value(&keys::RADIAL)?
    {
        let is_own = |key: &str| map.has_name(key, &keys::RADIAL) || map.has_name(key, &keys::TANGENTIAL);
        map.at.unread_keys(|key| is_own(key) || is_model(key))?;
        return radial_and_tangential(&map, None, at);
    }
    let named = match &list {
        Some(at) if keys::is_keyed(at) => KeyView::new(at.clone()),
        _ => view.clone(),
    };
    let mut values: Vec<(usize, f64)> = Vec::new();
    for (i, key) in keys::COEFFICIENTS.into_iter().enumerate() {
        let mut found = named.all(&[key]).into_iter();
        // Only single numbers are coefficients, because K1 may also be the matrix of a pair's first camera.
        if let Some(at) = found.find(|at| matches!(at.node.value, Value::Scalar(_))) {
            values.push((i, at.number()?));
        }
    }
    if let (Some(at), false) = (&list, list.as_ref().is_some_and(keys::is_keyed)) {
        if let Some(&(i, _)) = values.iter().find(|(_, value)| *value != 0.0) {
            return Err(at.fail(format_args!(
                "the lens coefficients are given twice, here and as {}; remove one of the two keys",
                keys::COEFFICIENTS[i]
            )));
        }
        let numbers = match (&at.node.value, at.numbers()) {
            (Value::Scalar(_), Err(_)) => vec![at.number()?],
            (_, numbers) => numbers?,
        };
        return Ok((list.clone(), numbers));
    }
    if let Some(at) = &list {
        at.unread_keys(|key| keys::COEFFICIENTS.contains(&plain(key).as_str()) || is_model(key))?;
    }
    let is_fisheye = stated(view)?.is_some_and(|(_, word)| word == "fisheye");
    let fisheye = |i: usize| [0, 1, 4, 5].iter().position(|&k| k == i);
    if is_fisheye || values.iter().any(|&(i, value)| i == 5 && value != 0.0) && !values.iter().any(|v| v.0 == 6) {
        // A fisheye lens has only the coefficients k1 k2 k3 k4.
        let mut four = vec![0.0; 4];
        for &(i, value) in values.iter().filter(|(_, value)| *value != 0.0) {
            let place = fisheye(i).ok_or_else(|| {
                named.at.fail(format_args!(
                    "{} is {value}, but lens model fisheye has only k1 k2 k3 k4",
                    keys::COEFFICIENTS[i]
                ))
            })?;
            four[place] = value;
        }
        return Ok((Some(named.at), four));
    }
    let last = values.iter().filter(|(_, value)| *value != 0.0).map(|(i, _)| *i).max();
    let count = last.map_or(0, |last| [4, 5, 8, 12].into_iter().find(|count| last < *count).unwrap_or(12));
    let mut numbers = vec![0.0; count];
    for (i, value) in values.into_iter().filter(|(i, _)| *i < count) {
        numbers[i] = value;
    }
    Ok((list.or((count > 0).then_some(named.at)), numbers))
}

/// Reads coefficients from two lists, as in MATLAB.
fn radial_and_tangential<'a>(
    view: &KeyView<'a>,
    list: Option<Cursor<'a>>,
    at: Cursor<'a>,
) -> Result<(Option<Cursor<'a>>, Vec<f64>)> {
    if let Some(other) = list {
        return Err(at.fail(format_args!(
            "the lens coefficients are given twice, here and as {}; remove one of the two keys",
            other.key
        )));
    }
    let k = at.numbers()?;
    let p = view.find_value(&keys::TANGENTIAL)?.map_or(Ok([0.0; 2]), |at| at.array())?;
    let numbers = match k[..] {
        [k1, k2] => vec![k1, k2, p[0], p[1]],
        [k1, k2, k3] => vec![k1, k2, p[0], p[1], k3],
        [k1, k2, k3, k4, k5, k6] => vec![k1, k2, p[0], p[1], k3, k4, k5, k6],
        _ => {
            return Err(at.fail(format_args!(
                "{}; expected k1 k2, optionally with k3, or k1 to k6",
                counted(k.len(), "number")
            )));
        }
    };
    Ok((Some(at), numbers))
}

/// Returns the node and the name of the lens model that the file specifies: in the camera's map or, otherwise, in the
/// innermost enclosing map that names a model.
fn stated<'a>(view: &KeyView<'a>) -> Result<Option<(Cursor<'a>, &'a str)>> {
    if let Some(found) = stated_here(view)? {
        return Ok(Some(found));
    }
    // The model may be named in the map of the coefficients or in the map of the intrinsics.
    let inner = lens_value(view)?.filter(keys::is_keyed).map(KeyView::new);
    let maps = view.all(&keys::MODEL).into_iter().filter(keys::is_keyed).map(KeyView::new);
    for inner in inner.into_iter().chain(view.intrinsics()).chain(maps) {
        if let Some(found) = stated_here(&inner)? {
            return Ok(Some(found));
        }
    }
    // The key of the map may contain the model, as in `fisheye_params`.
    let key = plain(&view.at.key);
    if key.contains("fisheye") && !key.contains("nonfisheye") {
        return Ok(Some((view.at.clone(), "fisheye")));
    }
    // A key of this map takes precedence over the same key of an enclosing map, even if its value names only a
    // projection.
    let own = model_keys(view);
    for outer in &view.above {
        if let Some(found) = stated_here(outer)? {
            return Ok(Some(found).filter(|(at, _)| !own.contains(&plain(at.name()))));
        }
    }
    Ok(None)
}

/// Keys of a map that specify the lens model by a word, without case and separators.
fn model_keys(view: &KeyView<'_>) -> Vec<String> {
    let words = view.all(&keys::MODEL).into_iter().filter(|at| at.word().is_ok());
    words.map(|at| plain(at.name())).collect()
}

/// Same as [`stated`], for the keys of one map only.
fn stated_here<'a>(view: &KeyView<'a>) -> Result<Option<(Cursor<'a>, &'a str)>> {
    let is_word = |at: &Cursor<'_>| matches!(at.node.value, Value::Scalar(_));
    if let Some(at) = view.all(&keys::FISHEYE).into_iter().find(is_word) {
        match at.word()? {
            "0" | "false" | "False" | "no" => return Ok(Some((at, "opencv"))),
            "1" | "true" | "True" | "yes" => return Ok(Some((at, "fisheye"))),
            other => return Err(at.fail(format_args!("{other:?}; expected 0 or 1"))),
        }
    }
    let mut found: Option<(Cursor<'a>, &'a str)> = None;
    for at in view.all(&keys::MODEL).into_iter().filter(is_word) {
        let key = plain(at.name());
        let Some(name) = model_of(&key, &at, view)? else { continue };
        if let Some((other, before)) = &found
            && *before != name
        {
            return Err(at.fail(format_args!(
                "{:?}, but {} (line {}) specifies another lens model; remove one of the two keys",
                at.word()?,
                other.key,
                other.node.line
            )));
        }
        found = Some((at, name));
    }
    Ok(found.or_else(|| fisheye_under_another_key(view)))
}

/// True for a key of the lens model.
fn is_model(key: &str) -> bool {
    let key = plain(key);
    keys::MODEL.contains(&&key[..]) || keys::FISHEYE.contains(&&key[..])
}

/// Words in keys whose value is a name or a remark, not a lens model.
const NAMES: [&str; 16] = [
    "name",
    "file",
    "path",
    "image",
    "comment",
    "description",
    "note",
    "title",
    "id",
    "serial",
    "topic",
    "date",
    "device",
    "brand",
    "folder",
    "frame",
];

/// Finds "fisheye" in the value of a key that is neither a known key nor a name, as in `calibration_method:
/// cv2.fisheye`.
fn fisheye_under_another_key<'a>(view: &KeyView<'a>) -> Option<(Cursor<'a>, &'a str)> {
    if !view.mentions_fisheye() {
        return None;
    }
    let entries = view.at.entries().unwrap_or_default();
    entries.into_iter().find_map(|(key, at)| {
        let key = plain(key);
        // The value of a key `camera` may be a name; the value of `camera_method` is not a name.
        let is_name = key == "camera" || NAMES.iter().any(|word| key.contains(word));
        let word = at.word().ok().map(plain)?;
        let fisheye =
            word.contains("fisheye") && !["non", "fisheye6", "prism"].iter().any(|other| word.contains(other));
        (fisheye && !is_name && !keys::MODEL.contains(&&key[..])).then_some((at, "fisheye"))
    })
}

/// Lens model named by the value of a key in [`keys::MODEL`]; `None` if the value names only a projection or a product.
fn model_of<'a>(key: &str, at: &Cursor<'a>, view: &KeyView<'a>) -> Result<Option<&'a str>> {
    let word = at.word()?;
    let name = plain(word);
    let strict = keys::STRICT_MODEL.iter().any(|known| key.ends_with(known));
    Ok(match &name[..] {
        // These names specify only the projection; the lens model has a separate key, or is OpenCV's.
        "" | "pinhole" | "perspective" | "standard" | "opencvpinhole" | "rectilinear" => None,
        "opencv" | "brown" | "brownconrady" | "radtan" | "radialtangential" | "plumbbob" | "rational"
        | "rationalpolynomial" | "thinprism" | "pinholeopencv" | "pinholeradtan" | "opencvstandard" => Some("opencv"),
        "equidistant" | "equi" | "kannalabrandt" | "kannalabrandt4" | "kannalabrandt8" | "kb" | "kb4" | "kb8"
        | "pinholeequi" | "pinholeequidistant" => Some("fisheye"),
        // In MC-Calib, 0 is Brown's model and 1 is Kannala's.
        "0" if key.ends_with("distortiontype") && is_mc_calib(view) => Some("opencv"),
        "1" if key.ends_with("distortiontype") && is_mc_calib(view) => Some("fisheye"),
        _ if name.contains("fisheye") && !name.contains("fisheye6") && !name.contains("prism") => Some("fisheye"),
        _ if strict || LENS_WORDS.iter().any(|lens| name.contains(lens)) => Some(word),
        _ => None,
    })
}

/// Words in the names of lens models; values without these words are names of products or sensors.
const LENS_WORDS: [&str; 18] = [
    "omni",
    "mei",
    "scaramuzza",
    "ocam",
    "poly",
    "spline",
    "sphere",
    "ucm",
    "fov",
    "atan",
    "division",
    "stereographic",
    "equisolid",
    "cahvor",
    "theta",
    "equirect",
    "cylind",
    "prism",
];

/// True if the file was written by MC-Calib.
fn is_mc_calib(view: &KeyView<'_>) -> bool {
    let has = |at: &Cursor<'_>| at.get("nb_camera").is_some() || at.get("camera_group").is_some();
    has(&view.at) || view.above.iter().any(|outer| has(&outer.at))
}

/// True if four coefficients may also belong to `cv2.fisheye`, whose tutorials write DIM, K and D.
fn may_be_fisheye(view: &KeyView<'_>, shown: &Cursor<'_>, numbers: &[f64]) -> bool {
    if numbers.len() != 4 {
        return false;
    }
    let key = plain(shown.name());
    let is_d = key.starts_with('d') && !key.starts_with("dist") && !key.starts_with("dc");
    let named = shown.is_map() && shown.get("data").is_none();
    let only_radial = named && view.all(&["p1", "p2"]).is_empty() && !view.all(&["k4"]).is_empty();
    let stereo_calib = view.at.get("M1").is_some();
    let hinted = !view.all(&["dim"]).is_empty()
        || shown.file_name().is_some_and(|name| plain(&name).contains("fisheye"))
        || view.mentions_fisheye()
        || view.above.iter().any(|outer| outer.mentions_fisheye());
    (is_d && !stereo_calib) || only_radial || hinted
}
