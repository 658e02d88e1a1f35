//! The WGSL of the stages, and the assembler that joins it.
//!
//! A stage is one text in `stages/`; what several stages need is in `shared/`. `#import name` is the only directive:
//! the text of `shared/name.wgsl` takes its place, the first time it is asked for. Whoever builds pipelines takes the
//! text from [`stage`]; this crate knows no GPU library.

mod sources;

pub use sources::{SHARED, SOURCES};

/// The stages in the order in which they run.
pub const STAGES: &[&str] = &["decode", "refine", "depth", "balance", "emit", "draw"];

/// The whole text of a stage; none when there is no such stage, or when it imports what does not exist.
///
/// ```
/// let text = drumlin_shaders::stage("depth").unwrap();
/// assert!(text.contains("struct Frame") && !text.contains("#import"));
/// ```
#[must_use]
pub fn stage(name: &str) -> Option<String> {
    let mut imported = Vec::new();
    let mut text = String::new();
    append(find(SOURCES, name)?, &mut imported, &mut text)?;
    Some(text)
}

/// The text of a shared file with what it imports, for tests that look into it alone.
#[must_use]
pub fn shared(name: &str) -> Option<String> {
    let mut imported = Vec::new();
    let mut text = String::new();
    append(find(SHARED, name)?, &mut imported, &mut text)?;
    Some(text)
}

fn find(files: &'static [(&'static str, &'static str)], name: &str) -> Option<&'static str> {
    files.iter().find(|file| file.0 == name).map(|file| file.1)
}

fn append(source: &'static str, imported: &mut Vec<&'static str>, text: &mut String) -> Option<()> {
    for line in source.lines() {
        match line.strip_prefix("#import ").map(str::trim) {
            None => {
                text.push_str(line);
                text.push('\n');
            }
            Some(name) if imported.contains(&name) => {}
            Some(name) => {
                imported.push(name);
                append(find(SHARED, name)?, imported, text)?;
            }
        }
    }
    Some(())
}

#[cfg(test)]
mod tests;
