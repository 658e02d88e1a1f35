//! `--input-list`: a text file that names inputs, for more of them than a command line holds.

use std::{fs, path::Path, path::PathBuf};

use anyhow::{Context, Result, bail};

/// Bytes of a list: a million long paths.
const LIMIT: u64 = 256 << 20;

/// The paths of a list, one a line, relative to the list's folder; empty lines and those that start with `#` say
/// nothing.
pub(crate) fn read(list: &Path) -> Result<Vec<PathBuf>> {
    let name = || list.display().to_string();
    let bytes = fs::metadata(list).with_context(name)?.len();
    if bytes > LIMIT {
        bail!("{}: a list of {bytes} bytes; the limit is {LIMIT}", name());
    }
    let text = fs::read_to_string(list).with_context(name)?;
    let folder = list.parent().unwrap_or(Path::new(""));
    let paths: Vec<PathBuf> = paths(&text).map(|path| folder.join(path)).collect();
    if paths.is_empty() {
        bail!("{}: the list names no input", name());
    }
    Ok(paths)
}

fn paths(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_paths_but_for_comments_and_empty_ones() {
        let text = "# north\na.tif\r\n\n  b c.tif \n#d.tif\n/e.tif";
        assert_eq!(
            paths(text).collect::<Vec<_>>(),
            ["a.tif", "b c.tif", "/e.tif"]
        );
    }
}
