//! View of a map that contains only the keys of one camera.

use std::cell::OnceCell;
use std::collections::HashMap;
use std::rc::Rc;

use crate::document::lens_keys::plain;
use crate::document::{Cursor, DocumentNode, Value};
use crate::opencv::keys::{
    K, OTHER, RECTIFIED, contradiction, is_base, is_k_of_coefficients, is_keyed, is_rigid_transform, without_mark,
    without_unit,
};
use raycam_formats::Result;

/// View of a map that contains only the keys of one camera: keys without a marker, or keys that end or begin with a
/// marker of the camera.
#[derive(Clone)]
pub(super) struct KeyView<'a> {
    pub(super) at: Cursor<'a>,
    /// Markers of the camera, such as `1` and `left`; empty for keys without a marker.
    pub(super) side: Vec<String>,
    /// Maps that enclose this map, the innermost first; their size, skew and lens model also apply to the camera.
    pub(super) above: Vec<Rc<KeyView<'a>>>,
    /// For each [`KeyView::base`] of the map's keys, the indices of its entries; computed once.
    places: OnceCell<Rc<HashMap<String, Vec<usize>>>>,
    mentions_fisheye: OnceCell<bool>,
}

/// True if any of a key's bases is one of these names.
fn is_any(bases: &[String], names: &[&str]) -> bool {
    bases.iter().any(|base| names.contains(&base.as_str()))
}

impl<'a> KeyView<'a> {
    /// Creates a view of the keys without a marker.
    pub(super) fn new(at: Cursor<'a>) -> Self {
        Self::marked(at, vec![])
    }

    /// Creates a view of the keys with a marker of a camera.
    pub(super) fn marked(at: Cursor<'a>, side: Vec<String>) -> Self {
        Self { at, side, above: vec![], places: OnceCell::new(), mentions_fisheye: OnceCell::new() }
    }

    /// Creates a view of a map inside other maps, the innermost first.
    pub(super) fn below(at: Cursor<'a>, above: Vec<Rc<Self>>) -> Self {
        Self { above, ..Self::new(at) }
    }

    /// Value of a key with one of these names in this map, or otherwise in the innermost enclosing map with such a key.
    pub(super) fn inherited(&self, names: &[&str]) -> Result<Option<Cursor<'a>>> {
        let own = self.find_value(names)?;
        let above = || self.above.iter().find_map(|outer| outer.find_value(names).transpose()).transpose();
        own.map_or_else(above, |own| Ok(Some(own)))
    }

    /// The key without the camera's marker, and the same key without the word `camera`; empty for keys of another
    /// camera.
    pub(super) fn base(&self, key: &str) -> Vec<String> {
        let key_words = key;
        let key = plain(key);
        let mut bases = match &self.side[..] {
            [] => vec![key],
            side => side.iter().flat_map(|mark| without_mark(&key, mark)).map(str::to_owned).collect(),
        };
        let without_units = |base: &String| without_unit(key_words, base);
        bases.extend(bases.iter().filter_map(without_units).collect::<Vec<_>>());
        // The key may contain the matrix's shape, as in `camera_matrix_3x3`.
        let without_shape =
            |base: &String| ["3x3", "4x4", "3x4"].iter().find_map(|shape| base.strip_suffix(shape)).map(str::to_owned);
        bases.extend(bases.iter().filter_map(without_shape).collect::<Vec<_>>());
        let short = |base: &String| {
            let rest = base.strip_prefix("camera").or_else(|| base.strip_prefix("cam"))?;
            let told_apart = !rest.is_empty() && !OTHER.contains(&rest) && !is_base(base);
            told_apart.then(|| rest.to_owned())
        };
        bases.extend(bases.iter().filter_map(short).collect::<Vec<_>>());
        bases
    }

    /// True if a key has one of these names.
    pub(super) fn has_name(&self, key: &str, names: &[&str]) -> bool {
        is_any(&self.base(key), names)
    }

    /// Indices of the map's entries whose keys have one of these names, in the map's order.
    fn places(&self, names: &[&str]) -> Vec<usize> {
        let places = self.places.get_or_init(|| {
            let mut places = HashMap::<String, Vec<usize>>::new();
            for (place, (key, _)) in self.entries().iter().enumerate() {
                self.base(key).into_iter().for_each(|base| places.entry(base).or_default().push(place));
            }
            Rc::new(places)
        });
        let mut found: Vec<usize> = names.iter().filter_map(|name| places.get(*name)).flatten().copied().collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    fn entries(&self) -> &'a [(String, DocumentNode)] {
        match &self.at.node.value {
            Value::Map(entries) => entries,
            _ => &[],
        }
    }

    /// Key and value of an entry.
    fn entry(&self, place: usize) -> (&'a str, Cursor<'a>) {
        let (key, node) = &self.entries()[place];
        (key, self.at.child(key, node))
    }

    /// Values of all keys with these names, in this map and in the map of the intrinsics.
    pub(super) fn all(&self, names: &[&str]) -> Vec<Cursor<'a>> {
        let inner = self.intrinsics().map(|inner| inner.all(names)).unwrap_or_default();
        let of_k = self.places(&K);
        let own = self.places(names).into_iter().filter_map(|place| {
            let (key, at) = self.entry(place);
            let is_other = || is_keyed(&at) || is_rigid_transform(&at) || is_k_of_coefficients(key, &at);
            let is_unused = at.is_null() || of_k.contains(&place) && is_other();
            (!is_unused).then_some(at)
        });
        own.chain(inner).collect()
    }

    /// View of a separate map of intrinsics with named numbers: `intrinsics: {fx: ..., fy: ...}`.
    pub(super) fn intrinsics(&self) -> Option<KeyView<'a>> {
        let mut values = self.places(&K).into_iter().map(|place| self.entry(place).1);
        values.find(is_keyed).map(KeyView::new)
    }

    /// True if a key or a word of the map contains "fisheye".
    pub(super) fn mentions_fisheye(&self) -> bool {
        let says = |word: &str| plain(word).contains("fisheye");
        let entry_says = |(key, node): &(String, DocumentNode)| {
            says(key) || matches!(&node.value, Value::Scalar(word) if says(word))
        };
        *self.mentions_fisheye.get_or_init(|| self.entries().iter().any(entry_says))
    }

    /// Value of a key with one of these names; several such keys must have equal values.
    pub(super) fn find_value(&self, names: &[&str]) -> Result<Option<Cursor<'a>>> {
        let found = self.all(names);
        let words = |at: &Cursor<'_>| match at.numbers() {
            Ok(numbers) => format!("{numbers:?}"),
            Err(_) => format!("{:?}", at.node.value),
        };
        if let Some(other) = found.iter().skip(1).find(|other| words(other) != words(&found[0])) {
            return Err(contradiction(other, &found[0], ""));
        }
        Ok(found.into_iter().next())
    }

    /// True if the key belongs to a rectified pair.
    pub(super) fn is_rectified(&self, key: &str) -> bool {
        is_any(&self.base(key), &RECTIFIED)
    }

    /// True if the reader recognises the key.
    pub(super) fn knows(&self, key: &str) -> bool {
        let is_coefficients = plain(key) == "k" && self.at.get(key).is_some_and(|at| is_k_of_coefficients(key, &at));
        !is_coefficients && self.base(key).iter().any(|base| is_base(base))
    }
}
