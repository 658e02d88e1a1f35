//! Where a cage stands in the terrain: comment lines of its OBJ text, before its first vertex.
//!
//! ```text
//! # drumlin position X Y Z      CRS coordinates and metres; Z may be `ground`: the ground's height at X, Y
//! # drumlin scale S             metres a unit of the vertices, 1 where it is not said
//! # drumlin rotation DEGREES    counter-clockwise seen from above, 0 where it is not said
//! ```
//!
//! Vertices are metres east, north and up from the position, after scale and rotation. Knows no terrain: what the ground
//! is at a place, and where its coordinates are, is for whoever lays the cage.

use std::fmt;

use super::error::CageError;

/// The longest way of a placed vertex from its position, and the greatest height, in metres: beyond it is a slip.
const LARGEST_LENGTH: f64 = 1e9;

/// Where a cage stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// CRS coordinates of the cage's origin.
    pub position: [f64; 2],
    /// Height of the cage's origin in metres; none for the ground's.
    pub height: Option<f64>,
    /// Metres a unit of the cage.
    pub scale: f64,
    /// Degrees, counter-clockwise seen from above.
    pub rotation: f64,
}

impl Placement {
    /// On the ground at a place, in metres, not turned.
    #[must_use]
    pub const fn on_ground(position: [f64; 2]) -> Self {
        Self {
            position,
            height: None,
            scale: 1.0,
            rotation: 0.0,
        }
    }

    /// Metres east, north and up of the position, of one of the cage's points.
    #[must_use]
    pub fn offset(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = self.rotation.to_radians().sin_cos();
        [x * cos - y * sin, x * sin + y * cos, z].map(|length| length * self.scale)
    }

    /// Reads the placement of an OBJ text.
    ///
    /// # Errors
    /// [`CageError::NoPosition`] where the text says nothing of where it stands, [`CageError::Line`] where a line of it
    /// is not understood or a number is out of range.
    pub fn read(text: &[u8]) -> Result<Self, CageError> {
        let mut found = Self::on_ground([0.0; 2]);
        let mut placed = false;
        for (line, bytes) in (1..).zip(text.split(|&byte| byte == b'\n')) {
            let bytes = bytes.trim_ascii();
            if matches!(bytes, [b'v', b' ' | b'\t', ..]) {
                break;
            }
            let Some(text) = bytes
                .strip_prefix(b"#")
                .and_then(|comment| std::str::from_utf8(comment).ok())
            else {
                continue;
            };
            let mut words = text.split_ascii_whitespace();
            if words.next() == Some("drumlin") {
                let words: Vec<&str> = words.collect();
                placed |= found.take(&words).map_err(|error| error.at_line(line))?;
            }
        }
        if placed {
            Ok(found)
        } else {
            Err(CageError::NoPosition)
        }
    }

    /// Takes in one line; true where it is the position.
    fn take(&mut self, words: &[&str]) -> Result<bool, CageError> {
        match *words {
            ["position", x, y, z] => {
                self.position = [finite(x)?, finite(y)?];
                self.height = if z == "ground" {
                    None
                } else {
                    Some(length(z)?)
                };
                return Ok(true);
            }
            ["scale", scale] => {
                self.scale = length(scale)?;
                if self.scale <= 0.0 {
                    return Err(syntax("a scale is greater than 0", scale));
                }
            }
            ["rotation", degrees] => self.rotation = length(degrees)?,
            _ => {
                return Err(syntax(
                    "expected \"position X Y Z\", \"scale S\" or \"rotation DEGREES\" after \"# drumlin\"",
                    &words.join(" "),
                ));
            }
        }
        Ok(false)
    }
}

impl fmt::Display for Placement {
    /// The comment lines that read back as this placement.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.position;
        match self.height {
            Some(z) => writeln!(f, "# drumlin position {x} {y} {z}")?,
            None => writeln!(f, "# drumlin position {x} {y} ground")?,
        }
        writeln!(f, "# drumlin scale {}", self.scale)?;
        writeln!(f, "# drumlin rotation {}", self.rotation)
    }
}

fn syntax(message: &'static str, text: &str) -> CageError {
    CageError::Syntax {
        message,
        text: text.chars().take(60).collect(),
    }
}

fn finite(word: &str) -> Result<f64, CageError> {
    word.parse()
        .ok()
        .filter(|number: &f64| number.is_finite())
        .ok_or_else(|| syntax("expected a finite number", word))
}

fn length(word: &str) -> Result<f64, CageError> {
    let number = finite(word)?;
    if number.abs() > LARGEST_LENGTH {
        return Err(syntax("expected a number of at most 1e9 in size", word));
    }
    Ok(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back_equal() {
        let placement = Placement {
            position: [-121.7, 46.93],
            height: Some(1234.5),
            scale: 0.25,
            rotation: 30.0,
        };
        assert_eq!(
            Placement::read(placement.to_string().as_bytes()),
            Ok(placement)
        );
        let ground = Placement::on_ground([5.0, -7.0]);
        let text = format!("# an arch\n{ground}v 0 0 0\n# drumlin nonsense\n");
        assert_eq!(Placement::read(text.as_bytes()), Ok(ground));
    }

    #[test]
    fn a_quarter_turn_takes_east_to_north() {
        let mut placement = Placement::on_ground([0.0; 2]);
        (placement.rotation, placement.scale) = (90.0, 2.0);
        let [x, y, z] = placement.offset([1.0, 0.0, 3.0]);
        assert!(x.abs() < 1e-12 && (y - 2.0).abs() < 1e-12 && z == 6.0);
    }

    #[test]
    fn a_text_that_does_not_say_where_is_told_the_line_to_add() {
        let error = Placement::read(b"# drumlin scale 2\nv 0 0 0\n").unwrap_err();
        assert!(
            error.to_string().contains("# drumlin position X Y Z"),
            "{error}"
        );
    }

    #[test]
    fn errors_name_their_line() {
        let cases = [
            ("\n# drumlin position 1 2\n", "line 2: expected \"position"),
            (
                "# drumlin position 1 nan ground\n",
                "line 1: expected a finite number: \"nan\"",
            ),
            (
                "# drumlin position 1 2 1e12\n",
                "line 1: expected a number of at most 1e9",
            ),
            (
                "# drumlin scale 0\n",
                "line 1: a scale is greater than 0: \"0\"",
            ),
        ];
        for (text, message) in cases {
            let error = Placement::read(text.as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
    }
}
