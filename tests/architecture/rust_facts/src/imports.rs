//! Imports between the files of a crate.
//!
//! A path (`use crate::a::X`, `super::a::f(…)`, `a::f(…)` after `use crate::a`) leads to the file that *defines* the
//! name; re-exports are followed and do not count as imports of their own. A module that is only imported does not
//! count, but names that are used through the module do. `mod child;` is no import. Method calls are not resolved.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

use crate::{product, relative};

type Names = Vec<String>;
const MAX_DEPTH: usize = 20;

/// For each file under `source`, the other files whose definitions it names.
pub fn imports(source: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let mut modules = Modules(Vec::new());
    modules.read_file(source.join("lib.rs"), source, None);
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (number, module) in modules.0.iter().enumerate() {
        let own = found.entry(relative(&module.file, source)).or_default();
        let targets = modules.targets(number);
        own.extend(targets.iter().filter(|target| **target != module.file).map(|target| relative(target, source)));
    }
    found
}

/// A module: its file, its definitions, and the names that it uses.
#[derive(Default)]
struct Module {
    file: PathBuf,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    items: BTreeSet<String>,
    bindings: BTreeMap<String, Names>,
    public_bindings: BTreeSet<String>,
    globs: Vec<Names>,
    paths: BTreeSet<Names>,
    words: BTreeSet<String>,
}

/// The target of a path: a module, or the file that defines a name.
enum Found<'a> {
    Module(usize),
    File(&'a Path),
}

struct Modules(Vec<Module>);

impl Modules {
    fn read_file(&mut self, file: PathBuf, folder: &Path, parent: Option<usize>) -> usize {
        let items = product::parse(&file).items;
        self.read_items(file, &items, folder, parent)
    }

    /// Reads a module; `folder` contains the files of its child modules.
    fn read_items(&mut self, file: PathBuf, items: &[syn::Item], folder: &Path, parent: Option<usize>) -> usize {
        let number = self.0.len();
        self.0.push(Module { file: file.clone(), parent, ..Module::default() });
        let mut module = Module { file: file.clone(), parent, ..Module::default() };
        for item in items {
            module.items.extend(name_of(item));
            let syn::Item::Mod(child) = item else {
                module.visit_item(item);
                continue;
            };
            let name = child.ident.to_string();
            let inner = folder.join(&name);
            let files = [folder.join(format!("{name}.rs")), inner.join("mod.rs")];
            if let Some((_, items)) = &child.content {
                module.children.insert(name, self.read_items(file.clone(), items, &inner, Some(number)));
            } else if let Some(file) = files.into_iter().find(|file| file.exists()) {
                module.children.insert(name, self.read_file(file, &inner, Some(number)));
            }
        }
        self.0[number] = module;
        number
    }

    fn targets(&self, number: usize) -> BTreeSet<&Path> {
        let module = &self.0[number];
        let used = |name: &String| !module.public_bindings.contains(name) || module.words.contains(name);
        let bindings = module.bindings.iter().filter(|(name, _)| used(name)).map(|(_, path)| path);
        let mut found: BTreeSet<&Path> =
            bindings.chain(&module.paths).filter_map(|path| self.file_of(number, path)).collect();
        for glob in &module.globs {
            match self.resolve(number, glob, 0) {
                Some(Found::File(file)) => drop(found.insert(file)), // the variants of an enum
                Some(Found::Module(target)) => {
                    let names = &self.0[target];
                    let shown = |word: &&String| names.items.contains(*word) || names.bindings.contains_key(*word);
                    for word in module.words.iter().filter(shown) {
                        found.extend(self.file_of(target, &["self".to_owned(), word.clone()]));
                    }
                }
                None => {}
            }
        }
        found
    }

    fn file_of(&self, number: usize, path: &[String]) -> Option<&Path> {
        match self.resolve(number, path, 0)? {
            Found::File(file) => Some(file),
            Found::Module(_) => None,
        }
    }

    /// The module or the defining file that a path leads to; returns none for names of other crates.
    fn resolve(&self, number: usize, path: &[String], depth: usize) -> Option<Found<'_>> {
        let module = &self.0[number];
        let (head, rest) = path.split_first().filter(|_| depth <= MAX_DEPTH)?;
        let mut here = match head.as_str() {
            "crate" => 0,
            "self" => number,
            "super" => module.parent?,
            _ if module.children.contains_key(head) => module.children[head],
            _ if module.bindings.get(head).is_some_and(|bound| bound[..] != path[..1]) => {
                match self.resolve(number, &module.bindings[head], depth + 1)? {
                    Found::Module(target) => target,
                    file @ Found::File(_) => return Some(file),
                }
            }
            _ if module.items.contains(head) => return Some(Found::File(&module.file)),
            _ => return None,
        };
        for name in rest {
            let next =
                if name == "super" { self.0[here].parent.map(Found::Module) } else { self.shown(here, name, depth) };
            match next {
                Some(Found::Module(target)) => here = target,
                Some(file) => return Some(file),
                None => return Some(Found::File(&self.0[here].file)), // a macro in the module defines the name
            }
        }
        Some(Found::Module(here))
    }

    /// A child, a definition or a re-export of a module.
    fn shown(&self, number: usize, name: &str, depth: usize) -> Option<Found<'_>> {
        let module = &self.0[number];
        if let Some(child) = module.children.get(name) {
            return Some(Found::Module(*child));
        }
        if module.items.contains(name) {
            return Some(Found::File(&module.file));
        }
        if let Some(path) = module.bindings.get(name) {
            return self.resolve(number, path, depth + 1);
        }
        if depth >= MAX_DEPTH {
            return None;
        }
        module.globs.iter().find_map(|glob| match self.resolve(number, glob, depth + 1)? {
            Found::Module(source) if source != number => self.shown(source, name, depth + 1),
            _ => None,
        })
    }
}

impl Module {
    fn add_path(&mut self, names: Names) {
        self.words.insert(names[0].clone());
        if names.len() > 1 {
            self.paths.insert(names);
        }
    }

    fn add_use(&mut self, tree: &syn::UseTree, mut path: Names, public: bool) {
        match tree {
            syn::UseTree::Path(tree) => {
                path.push(tree.ident.to_string());
                self.add_use(&tree.tree, path, public);
            }
            syn::UseTree::Group(tree) => tree.items.iter().for_each(|tree| self.add_use(tree, path.clone(), public)),
            syn::UseTree::Glob(_) => self.globs.push(path),
            syn::UseTree::Name(tree) => self.bind(tree.ident.to_string(), &tree.ident, path, public),
            syn::UseTree::Rename(tree) => self.bind(tree.rename.to_string(), &tree.ident, path, public),
        }
    }

    fn bind(&mut self, mut name: String, last: &syn::Ident, mut path: Names, public: bool) {
        if last != "self" {
            path.push(last.to_string());
        } else if name == "self" {
            name = path.last().cloned().unwrap_or_default();
        }
        if path.is_empty() {
            return;
        }
        if public {
            self.public_bindings.insert(name.clone());
        }
        self.bindings.insert(name, path);
    }

    /// Paths within the arguments of a macro.
    fn add_tokens(&mut self, tokens: TokenStream) {
        let mut names = Names::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Punct(sign) if sign.as_char() == ':' => colons += 1,
                TokenTree::Ident(word) => {
                    if colons != 2 && !names.is_empty() {
                        self.add_path(std::mem::take(&mut names));
                    }
                    names.push(word.to_string());
                    colons = 0;
                }
                other => {
                    if !names.is_empty() {
                        self.add_path(std::mem::take(&mut names));
                    }
                    colons = 0;
                    if let TokenTree::Group(group) = other {
                        self.add_tokens(group.stream());
                    }
                }
            }
        }
        if !names.is_empty() {
            self.add_path(names);
        }
    }
}

impl<'ast> Visit<'ast> for Module {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.leading_colon.is_none() {
            self.add_path(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        self.visit_path(&item.path);
        self.add_tokens(item.tokens.clone());
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.add_use(&item.tree, Names::new(), !matches!(item.vis, syn::Visibility::Inherited));
    }

    fn visit_vis_restricted(&mut self, _: &'ast syn::VisRestricted) {}

    fn visit_attribute(&mut self, _: &'ast syn::Attribute) {}
}

fn name_of(item: &syn::Item) -> Option<String> {
    let name = match item {
        syn::Item::Const(item) => &item.ident,
        syn::Item::Enum(item) => &item.ident,
        syn::Item::Fn(item) => &item.sig.ident,
        syn::Item::Macro(item) => item.ident.as_ref()?,
        syn::Item::Static(item) => &item.ident,
        syn::Item::Struct(item) => &item.ident,
        syn::Item::Trait(item) => &item.ident,
        syn::Item::Type(item) => &item.ident,
        syn::Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(name.to_string())
}
