//! Prints facts about the Rust sources of a repository as JSON: `rust-facts ROOT`.
//!
//! For each crate under `ROOT/crates`, `files` describes each file (see [`file_facts`]) and `imports` lists, for each
//! file under `src`, the files whose definitions it names.

mod imports;
mod product;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::{env, fs};

use proc_macro2::{TokenStream, TokenTree};
use serde_json::{Value, json};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

fn main() {
    let root = PathBuf::from(env::args().nth(1).expect("rust-facts requires the repository's folder"));
    let mut crates = BTreeMap::new();
    for folder in folders(&root.join("crates")) {
        let files: BTreeMap<String, Value> =
            rust_files(&folder).iter().map(|path| (relative(path, &root), file_facts(path))).collect();
        let source = folder.join("src");
        let imports = if source.join("lib.rs").exists() { imports::imports(&source) } else { BTreeMap::new() };
        crates.insert(relative(&folder, &root.join("crates")), json!({"files": files, "imports": imports}));
    }
    println!("{}", json!(crates));
}

/// Facts about one file: its identifiers (`words`) and included paths, its types, its functions with their numbers of
/// lines, and the enums in `match` expressions without a catch-all arm. Types, functions and enums exclude test items.
fn file_facts(path: &Path) -> Value {
    let text = fs::read_to_string(path).expect("a readable file");
    let tokens: TokenStream = text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut words = BTreeSet::new();
    collect_words(tokens, &mut words);
    let mut facts = Facts::default();
    facts.visit_file(&product::parse(path));
    json!({
        "words": words, "types": facts.types, "functions": facts.functions, "matched": facts.matched,
        "macros": facts.macros,
    })
}

fn collect_words(tokens: TokenStream, words: &mut BTreeSet<String>) {
    for token in tokens {
        match token {
            TokenTree::Ident(word) => drop(words.insert(word.to_string())),
            TokenTree::Group(group) => collect_words(group.stream(), words),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

#[derive(Default)]
struct Facts {
    types: BTreeSet<String>,
    functions: Vec<(String, usize)>,
    matched: BTreeSet<String>,
    macros: Vec<(String, String)>,
    aliases: BTreeMap<String, String>,
    own_type: Option<String>,
}

impl Facts {
    fn add_function(&mut self, signature: &syn::Signature, body: &syn::Block) {
        let lines = body.span().end().line + 1 - signature.span().start().line;
        self.functions.push((signature.ident.to_string(), lines));
    }

    /// The enum of a variant's path: `Light` for `Light::Sun`, also under another name, and for `Self::Sun`.
    fn enum_of(&self, path: &syn::Path) -> Option<String> {
        let name = path.segments.iter().rev().nth(1)?.ident.to_string();
        if name == "Self" { self.own_type.clone() } else { Some(self.aliases.get(&name).cloned().unwrap_or(name)) }
    }
}

impl<'ast> Visit<'ast> for Facts {
    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.add_function(&item.sig, &item.block);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.add_function(&item.sig, &item.block);
        visit::visit_impl_item_fn(self, item);
    }

    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        if let syn::Type::Path(own) = &*item.self_ty {
            self.own_type = own.path.segments.last().map(|segment| segment.ident.to_string());
        }
        visit::visit_item_impl(self, item);
        self.own_type = None;
    }

    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        self.types.insert(item.ident.to_string());
        visit::visit_item_struct(self, item);
    }

    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        self.types.insert(item.ident.to_string());
        self.matched.insert(item.ident.to_string());
        visit::visit_item_enum(self, item);
    }

    fn visit_use_rename(&mut self, item: &'ast syn::UseRename) {
        self.aliases.insert(item.rename.to_string(), item.ident.to_string());
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        let name = item.path.segments.last().map_or(String::new(), |segment| segment.ident.to_string());
        if let (true, Ok(literal)) = (name.starts_with("include"), item.parse_body::<syn::LitStr>()) {
            self.macros.push((name, literal.value()));
        }
    }

    fn visit_expr_match(&mut self, item: &'ast syn::ExprMatch) {
        if !item.arms.iter().any(|arm| is_catch_all(&arm.pat)) {
            let mut variants = Variants::default();
            item.arms.iter().for_each(|arm| variants.visit_pat(&arm.pat));
            let enums: Vec<String> = variants.0.iter().filter_map(|path| self.enum_of(path)).collect();
            self.matched.extend(enums);
        }
        visit::visit_expr_match(self, item);
    }
}

/// Paths that a pattern names.
#[derive(Default)]
struct Variants(Vec<syn::Path>);

impl Visit<'_> for Variants {
    fn visit_path(&mut self, path: &syn::Path) {
        self.0.push(path.clone());
    }
}

/// True for `_` and lower-case names, and for tuples, `Some`, `Ok` and `Err` that contain only such patterns.
fn is_catch_all(pattern: &syn::Pat) -> bool {
    match pattern {
        syn::Pat::Wild(_) | syn::Pat::Rest(_) => true,
        syn::Pat::Ident(name) => {
            name.subpat.is_none() && name.ident.to_string().starts_with(|first: char| first.is_lowercase())
        }
        syn::Pat::Tuple(tuple) => tuple.elems.iter().all(is_catch_all),
        syn::Pat::TupleStruct(tuple) => {
            ["Some", "Ok", "Err"].iter().any(|name| tuple.path.is_ident(name)) && tuple.elems.iter().all(is_catch_all)
        }
        syn::Pat::Reference(reference) => is_catch_all(&reference.pat),
        syn::Pat::Paren(inner) => is_catch_all(&inner.pat),
        _ => false,
    }
}

fn folders(parent: &Path) -> Vec<PathBuf> {
    children(parent).into_iter().filter(|path| path.is_dir()).collect()
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let inner = |path: PathBuf| if path.is_dir() { rust_files(&path) } else { vec![path] };
    let found = children(folder).into_iter().filter(|path| !path.ends_with("target")).flat_map(inner);
    found.filter(|path| path.extension().is_some_and(|ending| ending == "rs")).collect()
}

fn children(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("a readable folder").path()).collect();
    paths.sort();
    paths
}

/// The path from `root`, with slashes.
fn relative(path: &Path, root: &Path) -> String {
    let parts = path.strip_prefix(root).expect("a path inside the root").iter();
    parts.map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}
