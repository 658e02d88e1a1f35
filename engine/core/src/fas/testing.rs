//! Cages for the tests of this module.

use std::{fs, path::PathBuf};

use crate::cage::{Cage, CageBudget, read_obj};

/// A file of the shared reference; says that it was skipped where there is none.
pub(super) fn reference(name: &str) -> Option<PathBuf> {
    let folder =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference/catmull-clark");
    if folder.is_dir() {
        return Some(folder.join(name));
    }
    assert!(
        std::env::var_os("CI").is_none(),
        "no ../shared/reference in CI"
    );
    println!("skipped: no ../shared/reference");
    None
}

/// A cage of the shared reference.
pub(super) fn cage(name: &str) -> Option<Cage> {
    let path = reference(&format!("{name}.obj"))?;
    Some(read_obj(&fs::read(path).expect("a file"), CageBudget::default()).expect("a cage"))
}
