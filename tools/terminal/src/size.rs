//! Amounts of memory as people type them.

/// Reads bytes with an optional suffix: `1000`, `64MiB`, `2GB`, `1.5 GiB`, `512k`.
///
/// `KB`, `MB`, `GB`, `TB` are powers of 1000, `KiB`, `MiB`, `GiB`, `TiB` and the bare letters powers of 1024.
///
/// # Errors
///
/// What is wrong with it.
pub fn parse(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let end = text
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(text.len());
    let (number, suffix) = text.split_at(end);
    let unit = unit(suffix.trim()).ok_or_else(|| {
        format!(
            "`{suffix}` is no unit of memory; there are B, KB, MB, GB, TB and KiB, MiB, GiB, TiB"
        )
    })?;
    let number: f64 = number
        .parse()
        .map_err(|_| format!("`{text}` does not start with a number"))?;
    let bytes = number * unit;
    if !(1.0..=9.0e15).contains(&bytes) {
        return Err(format!("`{text}` is not from 1 byte to 9000 TB"));
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked just above"
    )]
    Ok(bytes as u64)
}

/// Bytes for people.
#[must_use]
pub fn display(bytes: u64) -> String {
    #[expect(clippy::cast_precision_loss, reason = "three digits are shown")]
    let mut number = bytes as f64;
    for unit in ["B", "kB", "MB", "GB"] {
        if number < 999.5 {
            let digits = if unit == "B" || number >= 99.95 { 0 } else { 1 };
            return format!("{number:.digits$} {unit}");
        }
        number /= 1000.0;
    }
    format!("{number:.1} TB")
}

fn unit(suffix: &str) -> Option<f64> {
    let suffix = suffix.to_ascii_lowercase();
    let (power, rest) = match suffix.chars().next() {
        Some('k') => (1, &suffix[1..]),
        Some('m') => (2, &suffix[1..]),
        Some('g') => (3, &suffix[1..]),
        Some('t') => (4, &suffix[1..]),
        _ => (0, suffix.as_str()),
    };
    match rest {
        "" | "ib" => Some(1024_f64.powi(power)),
        "b" => Some(1000_f64.powi(power)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_as_documented() {
        for (text, bytes) in [
            ("7", 7),
            ("64MiB", 64 << 20),
            ("2GB", 2_000_000_000),
            ("1.5 GiB", 3 << 29),
            ("512k", 512 << 10),
            ("9B", 9),
        ] {
            assert_eq!(parse(text), Ok(bytes), "{text}");
        }
        for text in [
            "",
            "MiB",
            "-1",
            "1 furlong",
            "0",
            "1e9",
            "99999999TB",
            "1.2.3",
        ] {
            assert!(parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn bytes_are_shown_with_three_digits() {
        for (bytes, text) in [
            (999, "999 B"),
            (1500, "1.5 kB"),
            (9_012_345, "9.0 MB"),
            (123_456_789, "123 MB"),
        ] {
            assert_eq!(display(bytes), text);
        }
    }
}
