//! From a request's path to a file of the pyramid.

/// The file that a path names: words of the format and whole numbers, nothing else.
///
/// ```text
/// /zarr.json   /manifest/shards.jsonl   /tile/zarr.json   /tile/5/zarr.json   /tile/5/c/0/1/0
/// ```
pub(crate) fn key(path: &str) -> Option<String> {
    // What follows a question mark changes nothing.
    let path = path.split('?').next()?.strip_prefix('/')?;
    let parts: Vec<&str> = path.split('/').collect();
    let known = match parts[..] {
        ["zarr.json"]
        | ["manifest", "shards.jsonl"]
        | ["tile" | "feature" | "color" | "alpha", "zarr.json"] => true,
        ["tile" | "feature" | "color" | "alpha", level, "zarr.json"] => is_number(level),
        ["tile" | "feature", level, "c", row, column, "0"]
        | ["color", level, "c", row, column, "0", "0", "0"]
        | ["alpha", level, "c", row, column, "0", "0"] => {
            [level, row, column].into_iter().all(is_number)
        }
        _ => false,
    };
    known.then(|| path.to_owned())
}

/// A whole number as the format writes it: digits without leading zeros, in 32 bits.
fn is_number(text: &str) -> bool {
    text.parse()
        .is_ok_and(|number: u32| number.to_string() == text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_the_format_are_found() {
        for path in [
            "/zarr.json",
            "/manifest/shards.jsonl",
            "/tile/zarr.json",
            "/color/3/zarr.json",
            "/tile/5/c/0/12/0",
            "/feature/5/c/4294967295/0/0",
            "/color/0/c/0/0/0/0/0",
            "/alpha/0/c/0/0/0/0",
        ] {
            assert_eq!(key(path).as_deref(), path.strip_prefix('/'));
        }
        assert_eq!(key("/zarr.json?fresh=1").as_deref(), Some("zarr.json"));
    }

    #[test]
    fn everything_else_is_not_there() {
        for path in [
            "",
            "/",
            "zarr.json",
            "//zarr.json",
            "/../zarr.json",
            "/tile/../zarr.json",
            "/tile/5/c/../../../../etc/passwd",
            "/tile/%2e%2e/zarr.json",
            "/tile/-1/zarr.json",
            "/tile/+1/zarr.json",
            "/tile/05/zarr.json",
            "/tile/4294967296/zarr.json",
            "/tile/99999999999999999999999/c/0/0/0",
            "/tile/5/c/0/0/1",
            "/tile/5/c/0/0",
            "/tile/5/c/0/0/0/",
            "/manifest/journal.jsonl",
            "/C:/zarr.json",
        ] {
            assert_eq!(key(path), None, "{path}");
        }
    }
}
