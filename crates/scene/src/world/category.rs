//! Categories: the classes that objects belong to, by name and by number.

use std::collections::{BTreeMap, HashMap};

use crate::world::World;

/// Numbers of a world's categories.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Categories {
    /// Name of every category, indexed by its number.
    pub names: BTreeMap<i32, String>,
    /// The number of each object's category; -1 for an object without a category.
    pub of_objects: Vec<i32>,
}

impl World {
    /// Returns the categories of the world's objects. A name that is a whole number, as in `category = 7`, is that
    /// number. Other names get the free numbers from 1 on, in the order of the objects; many formats use 0 for the
    /// background.
    pub fn categories(&self) -> Categories {
        let numbered = self.objects.iter().filter_map(|object| {
            let name = object.category.as_ref()?;
            Some((number(name)?, name.clone()))
        });
        let mut names: BTreeMap<i32, String> = numbered.collect();
        let mut known: HashMap<String, i32> = names.iter().map(|(&id, name)| (name.clone(), id)).collect();
        let mut next = 1;
        let mut of_objects = Vec::with_capacity(self.objects.len());
        for object in &self.objects {
            let Some(name) = &object.category else {
                of_objects.push(-1);
                continue;
            };
            let id = *known.entry(name.clone()).or_insert_with(|| {
                while names.contains_key(&next) {
                    next += 1;
                }
                names.insert(next, name.clone());
                next
            });
            of_objects.push(id);
        }
        Categories { names, of_objects }
    }
}

/// Number that a name represents, if it has the canonical form of a number.
fn number(name: &str) -> Option<i32> {
    let id: i32 = name.parse().ok()?;
    (id >= 0 && id.to_string() == name).then_some(id)
}
