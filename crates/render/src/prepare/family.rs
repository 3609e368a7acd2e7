//! Parts of prepared worlds that related worlds share; each part is built once while its input exists.
//!
//! A part is kept as long as its input exists outside the family. A world at another time, a copy or a changed world
//! therefore finds the parts that other worlds have built, even after these other worlds have been dropped.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Part that was built from a single input.
pub(crate) trait BuiltPart {
    /// Type of the input.
    type Input;

    /// Input that the part was built from.
    fn input(&self) -> &Arc<Self::Input>;
}

/// Built parts by the addresses of their inputs.
#[derive(Debug)]
pub(crate) struct SharedParts<P> {
    /// The lock is held only for look-ups. No part is built or freed during a look-up, and a forked process finds the
    /// lock free.
    parts: Mutex<HashMap<usize, Arc<P>>>,
}

impl<P> Default for SharedParts<P> {
    fn default() -> Self {
        Self { parts: Mutex::default() }
    }
}

impl<P: BuiltPart> SharedParts<P> {
    fn lock(&self) -> MutexGuard<'_, HashMap<usize, Arc<P>>> {
        self.parts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The part that was built from an input, if it exists.
    pub fn built_of(&self, input: &Arc<P::Input>) -> Option<Arc<P>> {
        self.lock().get(&Arc::as_ptr(input).addr()).cloned()
    }

    /// Returns any part for which `fits` returns true.
    pub fn find_part(&self, fits: impl Fn(&P) -> bool) -> Option<Arc<P>> {
        self.lock().values().find(|part| fits(part)).cloned()
    }

    /// Stores the parts of a world, and frees parts whose inputs no longer exist.
    pub fn keep<'a>(&self, used: impl Iterator<Item = &'a Arc<P>>)
    where
        P: 'a,
    {
        let mut parts = self.lock();
        parts.extend(used.map(|part| (Arc::as_ptr(part.input()).addr(), part.clone())));
        let unused =
            |_: &usize, part: &mut Arc<P>| Arc::strong_count(part) == 1 && Arc::strong_count(part.input()) == 1;
        let freed: Vec<_> = parts.extract_if(unused).collect();
        drop(parts);
        drop(freed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Length(Arc<String>, usize);

    impl BuiltPart for Length {
        type Input = String;

        fn input(&self) -> &Arc<String> {
            &self.0
        }
    }

    #[test]
    fn prepared_parts_are_freed_with_their_input() {
        let known = SharedParts::default();
        let [short, long] = ["a", "abc"].map(|text| Arc::new(String::from(text)));
        for text in [&short, &long] {
            known.keep([&Arc::new(Length(text.clone(), text.len()))].into_iter());
        }
        assert_eq!(known.built_of(&long).map(|part| part.1), Some(3));
        assert!(known.find_part(|part| part.1 == 1).is_some());
        drop(short);
        known.keep([].into_iter());
        assert!(known.find_part(|part| part.1 == 1).is_none());
        assert_eq!(known.built_of(&long).map(|part| part.1), Some(3));
    }
}
