use naga::{
    AddressSpace, ScalarKind, TypeInner,
    valid::{Capabilities, ValidationFlags, Validator},
};

use super::*;

fn parsed(name: &str) -> naga::Module {
    let text = stage(name).unwrap_or_else(|| panic!("stage {name} imports what does not exist"));
    naga::front::wgsl::parse_str(&text)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&text)))
}

/// `pack2x16float` is WebGPU core; naga asks because old OpenGL lacks it.
fn validator() -> Validator {
    Validator::new(
        ValidationFlags::all(),
        Capabilities::SHADER_FLOAT16_IN_FLOAT32,
    )
}

#[test]
fn every_stage_validates_without_any_extra() {
    for name in STAGES {
        let module = parsed(name);
        validator()
            .validate(&module)
            .unwrap_or_else(|error| panic!("{name}: {error:?}"));
    }
}

#[test]
fn stages_and_sources_are_the_same_list() {
    let names: Vec<_> = SOURCES.iter().map(|source| source.0).collect();
    assert_eq!(names, STAGES);
    assert!(stage("no such stage").is_none());
}

#[test]
fn every_shared_file_stands_alone_and_is_imported_once() {
    for (name, text) in SHARED {
        let whole = shared(name).unwrap();
        naga::front::wgsl::parse_str(&whole)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&whole)));
        let users = SOURCES
            .iter()
            .chain(SHARED)
            .filter(|file| file.1.contains(&format!("#import {name}\n")))
            .count();
        assert!(users > 0, "nobody imports {name}");
        assert!(!text.is_empty());
    }
    assert_eq!(
        stage("draw").unwrap().matches("struct DrawnTile").count(),
        1
    );
}

#[test]
fn stages_keep_to_webgpu_core() {
    for name in STAGES {
        let module = parsed(name);
        // The limit holds for what one entry point uses.
        let info = validator().validate(&module).expect("tested above");
        for (index, entry) in module.entry_points.iter().enumerate() {
            let storage_buffers = module
                .global_variables
                .iter()
                .filter(|(_, variable)| matches!(variable.space, AddressSpace::Storage { .. }))
                .filter(|(handle, _)| !info.get_entry_point(index)[*handle].is_empty())
                .count();
            assert!(
                storage_buffers <= 8,
                "{name}, {} uses {storage_buffers} storage buffers",
                entry.name
            );
        }
        for (_, kind) in module.types.iter() {
            let (TypeInner::Scalar(scalar)
            | TypeInner::Vector { scalar, .. }
            | TypeInner::Atomic(scalar)) = kind.inner
            else {
                continue;
            };
            assert!(
                scalar.width <= 4 || scalar.kind == ScalarKind::AbstractInt,
                "{name} has 64-bit numbers"
            );
        }
        for entry in &module.entry_points {
            let [x, y, z] = entry.workgroup_size;
            assert!(x * y * z <= 256, "{name}::{}", entry.name);
        }
    }
}

#[test]
fn bind_groups_are_the_frame_the_tiles_and_the_stage() {
    // Tiles and features arrive outside any frame: their stages have group 0 alone.
    for name in STAGES
        .iter()
        .filter(|name| !["decode", "refine"].contains(name))
    {
        for (_, variable) in parsed(name).global_variables.iter() {
            let Some(binding) = &variable.binding else {
                continue;
            };
            let name = variable.name.as_deref().unwrap_or_default();
            let group = match name {
                "frame" => 0,
                "tiles" | "page_0" | "page_1" | "page_2" | "page_3" | "color_layers"
                | "color_sampler" => 1,
                _ => 2,
            };
            assert_eq!(binding.group, group, "{name}");
        }
    }
}

/// Browsers want parentheses where naga does not: around shifts in sums, and around `&`, `|`, `^` beside anything else.
#[test]
fn operators_of_different_kinds_are_in_parentheses() {
    for (name, text) in SOURCES.iter().chain(SHARED) {
        for (number, line) in (1..).zip(text.lines()) {
            let code = line.split("//").next().unwrap_or_default();
            if let Some(level) = mixed_level(code) {
                panic!("{name}.wgsl:{number}: {level} needs parentheses: {code}");
            }
        }
    }
}

/// The operators of one level of brackets that must not stand beside each other.
fn mixed_level(code: &str) -> Option<String> {
    let mut levels = vec![String::new()];
    let words: Vec<char> = code
        .replace("->", "  ")
        .replace("array<", "array ")
        .chars()
        .collect();
    let mut at = 0;
    while at < words.len() {
        let two: String = words[at..words.len().min(at + 2)].iter().collect();
        let top = levels.last_mut()?;
        match words[at] {
            '(' | '[' | '{' => levels.push(String::new()),
            ')' | ']' | '}' => {
                let done = levels.pop()?;
                if is_mixed(&done) {
                    return Some(done);
                }
                if levels.is_empty() {
                    levels.push(String::new());
                }
            }
            ',' | ';' => {
                if is_mixed(top) {
                    return Some(top.clone());
                }
                top.clear();
            }
            '=' if two != "==" => top.clear(),
            _ if two == "<<" || two == ">>" => {
                top.push('s');
                at += 1;
            }
            _ if two == "&&" || two == "||" => {
                if is_mixed(top) {
                    return Some(top.clone());
                }
                top.push(if two == "&&" { 'A' } else { 'O' });
                at += 1;
            }
            '&' | '|' | '^' => top.push(words[at]),
            '+' | '*' | '/' | '%' => top.push('a'),
            '<' | '>' => top.push('c'),
            _ if two == "==" || two == "!=" => {
                top.push('c');
                at += 1;
            }
            _ => {}
        }
        at += 1;
    }
    levels.iter().find(|level| is_mixed(level)).cloned()
}

fn is_mixed(level: &str) -> bool {
    let kinds: std::collections::BTreeSet<char> = level.chars().collect();
    let has = |kind: char| kinds.contains(&kind);
    let bits = ['&', '|', '^']
        .into_iter()
        .filter(|&kind| has(kind))
        .count();
    let others = ['s', 'a', 'c', 'A', 'O']
        .into_iter()
        .filter(|&kind| has(kind))
        .count();
    bits > 1 || bits == 1 && others > 0 || has('s') && has('a') || has('A') && has('O')
}
