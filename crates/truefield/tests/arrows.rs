//! The arrows of ARCHITECTURE.md: each module imports only what stands to its left.
//!
//! Reads every `crate::` and `super::` path of the sources, in `use` lines and elsewhere; unit
//! tests (`mod tests`) may look anywhere. A new top-level module needs a line in [`ARROWS`].

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Module, and what it may import beside itself, `error` and `run`.
const ARROWS: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("run", &[]),
    ("simd", &[]),
    ("geom", &[]),
    ("distance", &["geom"]),
    ("grid", &["geom", "distance"]),
    ("lattice", &["geom", "distance", "grid"]),
    ("mesh", &["geom", "distance"]),
    ("bvh", &["simd", "geom", "distance", "grid", "mesh"]),
    ("source", &["simd", "geom", "distance", "grid", "mesh", "bvh"]),
    ("field", &["simd", "geom", "distance", "grid", "lattice", "mesh", "bvh", "source"]),
    ("build", &["simd", "geom", "distance", "grid", "lattice", "mesh", "bvh", "source", "field"]),
    ("op", &["simd", "geom", "distance", "grid", "lattice", "mesh", "bvh", "source", "field", "build"]),
    ("product", &["simd", "geom", "distance", "grid", "lattice", "mesh", "bvh", "source", "field", "build", "op"]),
    // The laws ask, and know nobody who answers.
    ("laws", &["geom", "distance", "grid", "mesh"]),
];

#[test]
fn no_arrow_runs_the_wrong_way() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let names = reexports(&fs::read_to_string(root.join("lib.rs")).expect("src/lib.rs"));
    let files = sources(&root);
    assert!(files.len() > 5, "found only {} source files under {}", files.len(), root.display());
    let mut wrong = String::new();
    for file in &files {
        let text = fs::read_to_string(file).expect("a source file");
        let relative = file.strip_prefix(&root).expect("a file below src");
        for fault in faults(&module_path(relative), &text, &names) {
            writeln!(wrong, "  src/{}:{fault}", relative.display()).expect("a string takes everything");
        }
    }
    assert!(wrong.is_empty(), "imports against the arrows of ARCHITECTURE.md:\n{wrong}");
}

#[test]
fn the_core_knows_nothing_of_python() {
    let manifest = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml")).expect("Cargo.toml");
    assert!(!manifest.contains("pyo3") && !manifest.contains("truefield-python"), "the core must not depend on the Python crate");
}

#[test]
fn made_up_imports_are_judged() {
    let names = reexports("pub use geom::{Aabb, DVec3};\npub use source::mesh::Surface;\n");
    let judge = |path: &[&str], text: &str| {
        let path: Vec<String> = path.iter().map(|s| (*s).to_owned()).collect();
        faults(&path, text, &names).len()
    };
    // Along the arrows.
    assert_eq!(judge(&["bvh", "tree"], "use crate::mesh::TriangleMesh;\nuse crate::{error::Result, geom::{Aabb, DVec3}, run::Run};"), 0);
    assert_eq!(judge(&["source", "mesh"], "use super::implicit::Implicit; use crate::Aabb;"), 0);
    assert_eq!(judge(&["run"], "use crate::error::{Error, Result};"), 0);
    // Against them: plain, grouped, renamed, through super, in an expression, through a re-export.
    assert_eq!(judge(&["geom", "aabb"], "use crate::grid::Grid;"), 1);
    assert_eq!(judge(&["geom"], "use crate::grid::Grid;"), 1);
    assert_eq!(judge(&["field", "complete"], "use crate::{\n    geom::{Aabb, DVec3},\n    build::complete::complete as c,\n};"), 1);
    assert_eq!(judge(&["mesh"], "pub(crate) use super::bvh::Tree;"), 1);
    assert_eq!(judge(&["mesh", "check"], "use super::super::{bvh, geom};"), 1);
    assert_eq!(judge(&["build", "complete"], "fn f() { let x = crate::product::contour::trace(); }"), 1);
    assert_eq!(judge(&["mesh"], "use crate::Surface;"), 1);
    assert_eq!(judge(&["run"], "use crate::geom::Aabb;"), 1);
    assert_eq!(judge(&["bvh"], "mod inner { use super::super::source::X; }"), 1);
    // Neither comments nor strings import; unit tests may look anywhere; unknown modules need a place.
    assert_eq!(
        judge(
            &["geom"],
            "// use crate::grid::Grid;\n/* crate::grid */ const S: &str = \"crate::grid\"; fn f<'a>(c: char) -> bool { c == '\"' }"
        ),
        0
    );
    assert_eq!(judge(&["geom"], "#[cfg(test)]\nmod tests { use super::*; use crate::source::mesh::Surface; }\nuse crate::grid::Grid;"), 1);
    assert_eq!(judge(&["geom"], "use crate::somewhere::Thing;"), 1);
    assert_eq!(judge(&["somewhere"], "use crate::geom::Aabb;"), 1);
    assert_eq!(judge(&["geom"], "use crate::*;"), 1);
}

/// What is wrong with the imports of one file, as "line: sentence".
fn faults(path: &[String], text: &str, names: &BTreeMap<String, String>) -> Vec<String> {
    let Some(from) = path.first() else { return Vec::new() };
    if path.last().is_some_and(|name| name == "tests") {
        return Vec::new();
    }
    let Some((_, allowed)) = ARROWS.iter().find(|(name, _)| name == from) else {
        return vec![format!("1: module `{from}` has no place among the arrows; give it one in tests/arrows.rs")];
    };
    let mut found = Vec::new();
    for (line, head) in imports(path, text) {
        let target = names.get(&head).unwrap_or(&head);
        let known = ARROWS.iter().any(|(name, _)| name == target);
        let fine = target == from || allowed.contains(&target.as_str()) || target == "error" || (target == "run" && from != "error");
        if !known {
            found.push(format!("{line}: `{from}` imports `{head}`, which is no module of the table in tests/arrows.rs"));
        } else if !fine {
            found.push(format!("{line}: `{from}` must not import `{target}`"));
        }
    }
    found
}

/// Line and first segment after `crate::` of every path that a file names.
fn imports(path: &[String], text: &str) -> Vec<(usize, String)> {
    let tokens = tokens(text);
    let token = |i: usize| tokens.get(i).map_or("", |(_, t)| t.as_str());
    let mut found = Vec::new();
    let mut inner: Vec<Option<String>> = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        let line = tokens[i].0;
        match token(i) {
            "mod" if token(i + 2) == "{" => {
                inner.push(Some(token(i + 1).to_owned()));
                i += 2;
            }
            "{" => inner.push(None),
            "}" => {
                inner.pop();
            }
            "crate" | "super" if token(i + 1) == "::" && (i == 0 || token(i - 1) != "::") => {
                let mut here = path.to_vec();
                here.extend(inner.iter().flatten().cloned());
                if token(i) == "crate" {
                    here.clear();
                } else {
                    here.pop();
                }
                i += 2;
                while token(i) == "super" && token(i + 1) == "::" {
                    here.pop();
                    i += 2;
                }
                let in_tests = inner.iter().flatten().any(|name| name == "tests");
                if !in_tests {
                    match here.into_iter().next() {
                        Some(head) => found.push((line, head)),
                        None => found.extend(heads(&tokens[i..]).into_iter().map(|head| (line, head))),
                    }
                }
                continue;
            }
            _ => {}
        }
        i += 1;
    }
    found
}

/// The first segments of the path or of the `{group}` that starts here.
fn heads(tokens: &[(usize, String)]) -> Vec<String> {
    let Some((_, first)) = tokens.first() else { return Vec::new() };
    if first != "{" {
        return vec![first.clone()];
    }
    let (mut depth, mut start, mut found) = (0, false, Vec::new());
    for (_, token) in tokens {
        match token.as_str() {
            "{" => {
                depth += 1;
                start = depth == 1;
            }
            "}" => {
                depth -= 1;
                if depth == 0 {
                    break;
                }
            }
            "," => start = depth == 1,
            _ if start => {
                found.push(token.clone());
                start = false;
            }
            _ => {}
        }
    }
    found
}

/// Identifiers, `::` and single signs with their lines; comments, strings and characters left out.
fn tokens(text: &str) -> Vec<(usize, String)> {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let (mut i, mut line, mut found) = (0, 1, Vec::new());
    while i < chars.len() {
        let start = i;
        match at(i) {
            '/' if at(i + 1) == '/' => {
                while i < chars.len() && at(i) != '\n' {
                    i += 1;
                }
            }
            '/' if at(i + 1) == '*' => {
                let mut depth = 0;
                while i < chars.len() {
                    if at(i) == '/' && at(i + 1) == '*' {
                        depth += 1;
                        i += 2;
                    } else if at(i) == '*' && at(i + 1) == '/' {
                        depth -= 1;
                        i += 2;
                        if depth == 0 {
                            break;
                        }
                    } else {
                        i += 1;
                    }
                }
            }
            'r' if (at(i + 1) == '"' || at(i + 1) == '#' && (at(i + 2) == '"' || at(i + 2) == '#')) && (i == 0 || !word(at(i - 1))) => {
                let hashes = chars[i + 1..].iter().take_while(|c| **c == '#').count();
                i += hashes + 2;
                while i < chars.len() && !(at(i) == '"' && (1..=hashes).all(|n| at(i + n) == '#')) {
                    i += 1;
                }
                i += hashes + 1;
            }
            '"' => {
                i += 1;
                while i < chars.len() && at(i) != '"' {
                    i += if at(i) == '\\' { 2 } else { 1 };
                }
                i += 1;
            }
            '\'' if at(i + 1) == '\\' => {
                i += 3;
                while i < chars.len() && at(i) != '\'' {
                    i += 1;
                }
                i += 1;
            }
            '\'' if at(i + 2) == '\'' => i += 3,
            ':' if at(i + 1) == ':' => {
                found.push((line, "::".to_owned()));
                i += 2;
            }
            c if word(c) => {
                while word(at(i)) {
                    i += 1;
                }
                found.push((line, chars[start..i].iter().collect()));
            }
            c => {
                if !c.is_whitespace() {
                    found.push((line, c.to_string()));
                }
                i += 1;
            }
        }
        line += chars[start..i.min(chars.len())].iter().filter(|c| **c == '\n').count();
    }
    found
}

fn word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// `pub use module::{Name, ..}` of lib.rs: which module a name of the crate root comes from.
fn reexports(lib: &str) -> BTreeMap<String, String> {
    let tokens = tokens(lib);
    let mut names = BTreeMap::new();
    for (i, window) in tokens.windows(2).enumerate() {
        if window[0].1 == "pub" && window[1].1 == "use" {
            let statement: Vec<&str> = tokens[i + 2..].iter().map(|(_, t)| t.as_str()).take_while(|t| *t != ";").collect();
            for (k, name) in statement.iter().enumerate().skip(1) {
                let last = statement.get(k + 1).is_none_or(|next| matches!(*next, "," | "}"));
                if last && name.chars().next().is_some_and(char::is_alphabetic) {
                    names.insert((*name).to_owned(), statement[0].to_owned());
                }
            }
        }
    }
    names
}

/// `geom/aabb.rs` is the module `geom::aabb`; `lib.rs` is the root.
fn module_path(file: &Path) -> Vec<String> {
    let mut path: Vec<String> = file.with_extension("").components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    if path.last().is_some_and(|last| last == "mod" || last == "lib") {
        path.pop();
    }
    path
}

/// All Rust files below a folder, sorted.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}
