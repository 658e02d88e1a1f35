//! Which bytes of a file a request asks for.
//!
//! Based on: RFC 9110, section 14.

use std::ops::Range;

/// What a `Range` header comes to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
    /// The file as it is.
    Whole,
    /// A part of it, not empty.
    Part(Range<u64>),
    /// A part that no byte of the file is in.
    Outside,
}

/// Reads a `Range` header for a file of so many bytes. One range is given; several at once, other units and what makes
/// no sense are answered with the whole file, as the standard allows.
pub(crate) fn asked(header: Option<&str>, bytes: u64) -> Asked {
    let parsed = header
        .and_then(|header| header.trim().strip_prefix("bytes="))
        .and_then(|ranges| ranges.trim().split_once('-'));
    let Some((first, last)) = parsed else {
        return Asked::Whole;
    };
    let number = |text: &str| -> Option<u64> {
        let digits = text.bytes().all(|byte| byte.is_ascii_digit());
        // A number too large to read is past every end.
        digits.then(|| text.parse().unwrap_or(u64::MAX))
    };
    let range = match (first.trim(), last.trim()) {
        ("", "") => return Asked::Whole,
        ("", count) => match number(count) {
            None => return Asked::Whole,
            Some(count) => bytes.saturating_sub(count)..bytes,
        },
        (first, "") => match number(first) {
            None => return Asked::Whole,
            Some(first) => first..bytes,
        },
        (first, last) => match (number(first), number(last)) {
            (Some(first), Some(last)) if first <= last => first..bytes.min(last.saturating_add(1)),
            _ => return Asked::Whole,
        },
    };
    if range.start < range.end {
        Asked::Part(range)
    } else {
        Asked::Outside
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_ranges_are_read() {
        for (header, range) in [
            ("bytes=0-9", 0..10),
            ("bytes=90-", 90..100),
            ("bytes=90-1000", 90..100),
            ("bytes=-10", 90..100),
            ("bytes=-1000", 0..100),
            ("bytes=99-99", 99..100),
            ("bytes=5-99999999999999999999999", 5..100),
        ] {
            assert_eq!(asked(Some(header), 100), Asked::Part(range), "{header}");
        }
    }

    #[test]
    fn ranges_past_the_end_are_outside() {
        for header in [
            "bytes=100-",
            "bytes=100-200",
            "bytes=-0",
            "bytes=99999999999999999999-",
        ] {
            assert_eq!(asked(Some(header), 100), Asked::Outside, "{header}");
        }
        assert_eq!(asked(Some("bytes=0-0"), 0), Asked::Outside);
    }

    #[test]
    fn everything_else_is_the_whole_file() {
        assert_eq!(asked(None, 100), Asked::Whole);
        for header in [
            "",
            "bytes=",
            "bytes=-",
            "bytes=9-5",
            "bytes=1-2,4-5",
            "lines=1-2",
            "bytes=a-b",
            "bytes=--5",
            "bytes=+1-2",
        ] {
            assert_eq!(asked(Some(header), 100), Asked::Whole, "{header}");
        }
    }
}
