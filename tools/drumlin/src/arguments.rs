//! Arguments as typed become arguments as clap reads them: coordinates may be negative, and several may follow `--at`.

use std::ffi::OsString;

/// Writes every `X,Y` of the verb `height` as `--at=X,Y`, so that `-121.7,46.8` is not taken for an option.
pub(crate) fn prepared(typed: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let typed: Vec<OsString> = typed.collect();
    if typed.get(1).is_none_or(|verb| verb != "height") {
        return typed;
    }
    let mut prepared: Vec<OsString> = Vec::new();
    for argument in typed {
        let Some(place) = argument.to_str().filter(|text| coordinates(text).is_some()) else {
            prepared.push(argument);
            continue;
        };
        prepared.pop_if(|before| before == "--at");
        prepared.push(format!("--at={place}").into());
    }
    prepared
}

/// Reads `X,Y`.
pub(crate) fn coordinates(text: &str) -> Option<[f64; 2]> {
    let (x, y) = text.split_once(',')?;
    let number = |text: &str| {
        text.trim()
            .parse()
            .ok()
            .filter(|number: &f64| number.is_finite())
    };
    Some([number(x)?, number(y)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prepare(line: &str) -> String {
        let words = prepared(line.split(' ').map(OsString::from));
        words
            .iter()
            .map(|word| word.to_str().unwrap())
            .collect::<Vec<_>>()
            .join(" ")
    }

    #[test]
    fn coordinates_may_be_negative_and_many_and_anywhere() {
        assert_eq!(
            prepare("drumlin height --at -1,2 out.zarr"),
            "drumlin height --at=-1,2 out.zarr"
        );
        assert_eq!(
            prepare("drumlin height a --at 1,2 -3,4 --json"),
            "drumlin height a --at=1,2 --at=-3,4 --json"
        );
        assert_eq!(
            prepare("drumlin height a --at=-1,2 --at -.5,4"),
            "drumlin height a --at=-1,2 --at=-.5,4"
        );
    }

    #[test]
    fn other_words_stay() {
        for line in [
            "drumlin build 1,2 -o x",
            "drumlin height --at a,b",
            "drumlin",
            "drumlin height --at 1,nan",
        ] {
            assert_eq!(prepare(line), line);
        }
    }
}
