//! World files: six lines of text beside an image (`.tfw`, `.pgw`, `.jgw`, `.wld`) that say where it lies.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::{DemError, placement::Placement};

/// Bytes a world file may have.
const MAX_BYTES: u64 = 4096;

/// The placement in the world file beside an image, if there is one.
pub(super) fn find(image: &Path) -> Result<Option<Placement>, DemError> {
    for path in candidates(image) {
        if let Ok(file) = File::open(&path) {
            let mut text = String::new();
            let read = file.take(MAX_BYTES).read_to_string(&mut text);
            read.map_err(|error| DemError::io(&path, error))?;
            return parse(&text)
                .map(Some)
                .map_err(|what| DemError::format(&path, what));
        }
    }
    Ok(None)
}

/// `a.tif` has `a.tfw`, `a.tifw` or `a.wld`.
fn candidates(image: &Path) -> Vec<PathBuf> {
    let extension = image
        .extension()
        .map(|e| e.to_string_lossy().into_owned())
        .unwrap_or_default();
    let letters: Vec<char> = extension.chars().collect();
    let mut endings = vec![format!("{extension}w"), "wld".to_owned()];
    if let (Some(first), Some(last)) = (letters.first(), letters.last()) {
        endings.insert(0, format!("{first}{last}w"));
    }
    endings
        .iter()
        .map(|ending| image.with_extension(ending))
        .collect()
}

fn parse(text: &str) -> Result<Placement, String> {
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map_while(|word| word.parse().ok())
        .collect();
    let &[a, d, b, e, x, y] = numbers.as_slice() else {
        return Err(format!(
            "a world file holds 6 numbers, this one {}",
            numbers.len()
        ));
    };
    if d != 0.0 || b != 0.0 {
        return Err("a rotated world file; warp the image to north up first".into());
    }
    // A world file speaks of the first pixel's centre.
    Placement {
        origin: [x, y],
        step: [a, e],
    }
    .check()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_numbers_place_the_first_pixel() {
        let placement = parse("0.5\n0\n0\n-0.25\n10\n50\n");
        assert_eq!(
            placement,
            Ok(Placement {
                origin: [10.0, 50.0],
                step: [0.5, -0.25]
            })
        );
        assert!(parse("0.5 0 0").is_err());
        assert!(parse("0.5 0.1 0.1 -0.5 0 0").is_err());
        assert!(parse("0 0 0 -0.5 0 0").is_err());
    }

    #[test]
    fn its_name_is_made_from_the_image_s() {
        assert!(candidates(Path::new("x/a.tif")).contains(&PathBuf::from("x/a.tfw")));
        assert!(candidates(Path::new("a.png")).contains(&PathBuf::from("a.pgw")));
    }
}
