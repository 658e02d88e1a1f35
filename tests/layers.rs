//! The layer table of ARCHITECTURE.md, enforced: every module of the core imports only what lies below it.

use std::{
    fs,
    path::{Path, PathBuf},
};

const ALLOWED: &[(&str, &[&str])] = &[
    ("geo", &[]),
    ("subdiv", &[]),
    ("dem", &["geo"]),
    ("cage", &["subdiv", "geo"]),
    ("fas", &["cage", "subdiv", "geo"]),
    ("pyramid", &["cage", "dem", "geo"]),
    ("stream", &["pyramid", "geo"]),
    ("reference", &["fas", "subdiv", "pyramid", "geo"]),
    (
        "terrain",
        &[
            "reference",
            "stream",
            "fas",
            "pyramid",
            "cage",
            "dem",
            "subdiv",
            "geo",
        ],
    ),
];

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("the entry can be read").path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Modules named after `crate::` in a text, also inside `use crate::{a::…, b::…}`.
fn imports(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + 7..];
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut word = String::new();
            let mut taken = false;
            for letter in group.chars() {
                match letter {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => {
                        word.clear();
                        taken = false;
                    }
                    ':' if depth == 0 && !taken => {
                        found.push(word.trim().to_owned());
                        taken = true;
                    }
                    _ if depth == 0 && !taken => word.push(letter),
                    _ => {}
                }
            }
        } else {
            found.push(
                rest.chars()
                    .take_while(|c| c.is_alphanumeric() || *c == '_')
                    .collect(),
            );
        }
    }
    found
}

#[test]
fn modules_import_only_what_lies_below_them() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../engine/core/src");
    let names: Vec<_> = ALLOWED.iter().map(|(name, _)| *name).collect();
    let mut wrong = Vec::new();
    for (module, allowed) in ALLOWED {
        let mut files = Vec::new();
        rust_files(&source.join(module), &mut files);
        assert!(!files.is_empty(), "{module} has no files");
        for file in files {
            let text = fs::read_to_string(&file).expect("a source file is text");
            for import in imports(&text) {
                let inside = import == *module || allowed.contains(&import.as_str());
                if names.contains(&import.as_str()) && !inside {
                    wrong.push(format!("{} imports {import}", file.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_the_render_crate_names_wgpu() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for folder in ["engine/core/src", "tools/drumlin/src", "shaders/src"] {
        let mut files = Vec::new();
        rust_files(&root.join(folder), &mut files);
        for file in files {
            let text = fs::read_to_string(&file).expect("a source file is text");
            assert!(!text.contains("wgpu::"), "{} names wgpu", file.display());
        }
    }
}

#[test]
fn every_stage_has_three_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let stems = |folder: &str, extension: &str, skip: &[&str]| -> Vec<String> {
        let mut stems: Vec<_> = fs::read_dir(root.join(folder))
            .expect("the folder can be read")
            .map(|entry| entry.expect("the entry can be read").path())
            .filter(|path| path.extension().is_some_and(|found| found == extension))
            .map(|path| {
                path.file_stem()
                    .expect("a file has a stem")
                    .to_string_lossy()
                    .into_owned()
            })
            .filter(|stem| !skip.contains(&stem.as_str()))
            .collect();
        stems.sort();
        stems
    };
    let kernels = stems("shaders/stages", "wgsl", &[]);
    let references = stems("engine/core/src/reference", "rs", &["mod", "shared"]);
    let renders = stems("engine/render/src/stages", "rs", &["mod"]);
    assert_eq!(kernels, references, "shaders/stages and core/reference");
    assert_eq!(kernels, renders, "shaders/stages and render/stages");
}
