//! Cages as Wavefront OBJ text, with tags.
//!
//! ```text
//! v X Y Z                                vertices
//! f A B C …                              faces, 1-based or negative (from the end), A/T/N allowed
//! t crease 2/1/0 V0 V1 SHARPNESS         tags, 0-based; more vertices make a chain of edges
//! t corner 1/1/0 V SHARPNESS
//! t hole 1/0/0 F
//! ```
//!
//! The three numbers after a tag's name count its integers, its floats and its strings. Everything else in the file
//! (texture coordinates, normals, groups, materials, other tags) is passed over.

#![expect(
    clippy::cast_possible_truncation,
    reason = "the count of vertices was checked to fit 32 bits"
)]

use std::fmt::{self, Write};

use super::error::CageError;
use super::faces::{Corner, Crease, Faces, Tags};
use super::topology::Cage;

/// The most a reader takes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CageBudget {
    /// Vertices.
    pub vertices: u64,
    /// Corners of all faces together.
    pub corners: u64,
}

impl Default for CageBudget {
    /// 2²⁵ vertices and 2²⁷ corners: forty times the largest terrain cage we measure with, about 5 GB once linked.
    fn default() -> Self {
        Self {
            vertices: 1 << 25,
            corners: 1 << 27,
        }
    }
}

/// Reads and checks a cage.
///
/// # Errors
/// [`CageError::Line`] with the line to blame where there is one, else the error itself; see [`Cage::new`].
pub fn read_obj(text: &[u8], budget: CageBudget) -> Result<Cage, CageError> {
    let mut reader = Reader {
        budget,
        ..Reader::default()
    };
    for (line, bytes) in (1..).zip(text.split(|&byte| byte == b'\n')) {
        reader
            .line(bytes, line)
            .map_err(|error| error.at_line(line))?;
    }
    let Reader {
        positions,
        faces,
        tags,
        face_lines,
        ..
    } = reader;
    Cage::new(positions, faces, &tags).map_err(|error| match error.face() {
        Some(face) => error.at_line(face_lines[face as usize] as usize),
        None => error,
    })
}

/// What has been read so far.
#[derive(Default)]
struct Reader {
    budget: CageBudget,
    positions: Vec<[f64; 3]>,
    faces: Faces,
    tags: Tags,
    /// Line of each face, for messages about it.
    face_lines: Vec<u32>,
    face: Vec<u32>,
}

impl Reader {
    fn line(&mut self, bytes: &[u8], line: usize) -> Result<(), CageError> {
        // Other lines may be in any encoding: names of groups and materials often are.
        if !matches!(
            bytes.trim_ascii_start(),
            [b'v' | b'f' | b't', b' ' | b'\t', ..]
        ) {
            return Ok(());
        }
        let text = std::str::from_utf8(bytes).map_err(|_| syntax("a line that is not text", ""))?;
        let mut words = text.split_ascii_whitespace();
        match words.next() {
            Some("v") => self.vertex(&mut words),
            Some("f") => self.face(&mut words, line),
            Some("t") => self.tag(&mut words),
            _ => Ok(()),
        }
    }

    fn vertex<'a>(&mut self, words: &mut impl Iterator<Item = &'a str>) -> Result<(), CageError> {
        if self.positions.len() as u64 >= self.budget.vertices {
            return Err(CageError::Budget {
                what: "vertices",
                limit: self.budget.vertices,
            });
        }
        let mut position = [0.0; 3];
        for x in &mut position {
            *x = number(words.next(), "a vertex needs three coordinates")?;
        }
        super::build::check_positions(&[position]).map_err(|_| {
            let vertex = self.positions.len() as u32;
            CageError::NotFinite { vertex, position }
        })?;
        self.positions.push(position);
        Ok(())
    }

    fn face<'a>(
        &mut self,
        words: &mut impl Iterator<Item = &'a str>,
        line: usize,
    ) -> Result<(), CageError> {
        self.face.clear();
        for word in words {
            let vertex = self.face_vertex(word)?;
            self.face.push(vertex);
            if (self.faces.list().len() + self.face.len()) as u64 > self.budget.corners {
                return Err(CageError::Budget {
                    what: "face corners",
                    limit: self.budget.corners,
                });
            }
        }
        self.faces.push(&self.face);
        self.face_lines
            .push(u32::try_from(line).unwrap_or(u32::MAX));
        Ok(())
    }

    fn face_vertex(&self, word: &str) -> Result<u32, CageError> {
        let index = word.split('/').next().unwrap_or_default();
        let index: i64 = index
            .parse()
            .map_err(|_| syntax("a face needs vertex numbers", word))?;
        let vertex_count = self.positions.len() as i64;
        let vertex = match index {
            0 => return Err(syntax("vertices of faces are counted from 1", word)),
            1.. => index - 1,
            _ => vertex_count + index,
        };
        if vertex < 0 {
            return Err(syntax("a face counts back past the first vertex", word));
        }
        u32::try_from(vertex).map_err(|_| CageError::MissingVertex {
            face: self.faces.count(),
            vertex: vertex.unsigned_abs(),
            vertex_count: vertex_count as u32,
        })
    }

    fn tag<'a>(&mut self, words: &mut impl Iterator<Item = &'a str>) -> Result<(), CageError> {
        let name = words.next();
        if !matches!(name, Some("crease" | "corner" | "hole")) {
            return Ok(());
        }
        let (integers, floats) = tag_values(words)?;
        match name {
            Some("crease") => self.crease(&integers, &floats),
            Some("corner") => self.corner(&integers, &floats),
            _ => {
                self.tags.holes.extend(integers);
                Ok(())
            }
        }
    }

    fn crease(&mut self, integers: &[u32], floats: &[f64]) -> Result<(), CageError> {
        if integers.len() < 2 {
            return Err(syntax("a crease needs two vertices", "crease"));
        }
        for (i, pair) in integers.windows(2).enumerate() {
            let sharpness = tag_sharpness(floats, i)?;
            self.tags.creases.push(Crease {
                vertices: [pair[0], pair[1]],
                sharpness,
            });
        }
        Ok(())
    }

    fn corner(&mut self, integers: &[u32], floats: &[f64]) -> Result<(), CageError> {
        for (i, &vertex) in integers.iter().enumerate() {
            let sharpness = tag_sharpness(floats, i)?;
            self.tags.corners.push(Corner { vertex, sharpness });
        }
        Ok(())
    }
}

fn syntax(message: &'static str, text: &str) -> CageError {
    CageError::Syntax {
        message,
        text: text.chars().take(60).collect(),
    }
}

fn number(word: Option<&str>, message: &'static str) -> Result<f64, CageError> {
    let word = word.ok_or_else(|| syntax(message, "end of line"))?;
    word.parse().map_err(|_| syntax(message, word))
}

/// The integers and floats of a tag, as many as its `i/f/s` says.
fn tag_values<'a>(
    words: &mut impl Iterator<Item = &'a str>,
) -> Result<(Vec<u32>, Vec<f64>), CageError> {
    const COUNTS: &str = "a tag needs its counts as integers/floats/strings";
    let counts = words.next().ok_or_else(|| syntax(COUNTS, "end of line"))?;
    let mut parts = counts.split('/').map(str::parse::<usize>);
    let (Some(Ok(integer_count)), Some(Ok(float_count))) = (parts.next(), parts.next()) else {
        return Err(syntax(COUNTS, counts));
    };
    let integer = |word: Option<&str>| {
        let word = word.ok_or_else(|| syntax("a tag has fewer numbers than it says", counts))?;
        word.parse()
            .map_err(|_| syntax("a tag's vertices and faces are counted from 0", word))
    };
    // A count announced is no reason to reserve: only words that are there are kept.
    let mut integers = Vec::new();
    for _ in 0..integer_count {
        integers.push(integer(words.next())?);
    }
    let mut floats = Vec::new();
    for _ in 0..float_count {
        floats.push(number(words.next(), "a tag's sharpness is a number")?);
    }
    Ok((integers, floats))
}

/// The sharpness of a tag's `i`-th thing: its own, or the one for all. Judged here, where the line is known.
fn tag_sharpness(floats: &[f64], i: usize) -> Result<f64, CageError> {
    let Some(&sharpness) = floats.get(i).or(floats.first()) else {
        return Err(syntax(
            "a crease or corner needs a sharpness",
            "end of line",
        ));
    };
    if sharpness >= 0.0 {
        Ok(sharpness)
    } else {
        Err(CageError::Sharpness {
            what: "a tag".into(),
            sharpness,
        })
    }
}

/// A cage as OBJ text that reads back as the same cage, every bit of its positions included.
#[must_use]
pub fn write_obj(cage: &Cage) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_parts(cage, &mut text);
    text
}

fn write_parts(cage: &Cage, text: &mut String) -> fmt::Result {
    let topology = cage.topology();
    for [x, y, z] in cage.positions() {
        writeln!(text, "v {x} {y} {z}")?;
    }
    for face in topology.faces().iter() {
        text.push('f');
        for vertex in face {
            write!(text, " {}", vertex + 1)?;
        }
        text.push('\n');
    }
    for edge in 0..topology.edge_count() {
        let (sharpness, [a, b]) = (topology.edge_sharpness(edge), topology.edge_vertices(edge));
        if sharpness > 0.0 && !topology.is_boundary_edge(edge) {
            writeln!(text, "t crease 2/1/0 {a} {b} {}", written(sharpness))?;
        }
    }
    for vertex in 0..topology.vertex_count() {
        let sharpness = topology.vertex_sharpness(vertex);
        if sharpness > 0.0 && topology.vertex_corners(vertex).len() != 1 {
            writeln!(text, "t corner 1/1/0 {vertex} {}", written(sharpness))?;
        }
    }
    for face in (0..topology.face_count()).filter(|&face| topology.is_hole(face)) {
        writeln!(text, "t hole 1/0/0 {face}")?;
    }
    Ok(())
}

fn written(sharpness: f64) -> f64 {
    sharpness.min(crate::subdiv::INFINITE_SHARPNESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Cage, CageError> {
        read_obj(text.as_bytes(), CageBudget::default())
    }

    const QUADS: &str = "# two quads\nv 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\r\nv 1 1 0.1\nv 2 1 1e-3 1.0\nvt 0 0\n\
        f 1/1/1 2//2 5/1 4\nf -5 -4 -1 -2\nt crease 2/1/0 1 4 2.5\nt corner 1/1/0 2 11\nt hole 1/0/0 1\n\
        t interpolateboundary 1/0/0 1\n";

    #[test]
    fn slashes_negative_numbers_and_tags_are_understood() {
        let cage = read(QUADS).unwrap();
        let topology = cage.topology();
        assert_eq!(topology.face_vertices(1), [1, 2, 5, 4]);
        assert_eq!(
            topology.edge_sharpness(topology.edge_between(1, 4).unwrap()),
            2.5
        );
        assert_eq!(topology.vertex_sharpness(2), f64::INFINITY);
        assert!(topology.is_hole(1) && !topology.is_hole(0));
    }

    #[test]
    fn what_is_written_reads_back_equal() {
        let cage = read(QUADS).unwrap();
        let again = read(&write_obj(&cage)).unwrap();
        assert_eq!(again.positions(), cage.positions());
        assert_eq!(again.topology(), cage.topology());
    }

    #[test]
    fn errors_name_their_line() {
        let cases = [
            (
                "v 0 0 0\nv 1 0\n",
                "line 2: a vertex needs three coordinates: \"end of line\"",
            ),
            (
                "v 0 0 x\n",
                "line 1: a vertex needs three coordinates: \"x\"",
            ),
            (
                "v 0 nan 0\n",
                "line 1: vertex 0 is at [0.0, NaN, 0.0]; coordinates must be finite and at most 1e150 in size",
            ),
            (
                "v 0 0 0\nf 0 1 2\n",
                "line 2: vertices of faces are counted from 1: \"0\"",
            ),
            (
                "v 0 0 0\n\nf 1 2 3\n",
                "line 3: face 0 names vertex 1, but there are only 1 vertices",
            ),
            (
                "v 0 0 0\nf 1 2 1000000000000\n",
                "line 2: face 0 names vertex 999999999999, but there are only 1 vertices",
            ),
            (
                "v 0 0 0\nf -1 -2 1\n",
                "line 2: a face counts back past the first vertex: \"-2\"",
            ),
            (
                "v 0 0 0\nt crease 2/1/0 0 1 -1\n",
                "line 2: sharpness -1 of a tag; sharpness is a number from 0 to 10, 10 and more being infinite",
            ),
            (
                "t crease 1000000000/1/0 0\n",
                "line 1: a tag has fewer numbers than it says: \"1000000000/1/0\"",
            ),
            (
                "t hole 1/0/0 -1\n",
                "line 1: a tag's vertices and faces are counted from 0: \"-1\"",
            ),
            ("", "the cage has no faces"),
        ];
        for (text, message) in cases {
            assert_eq!(read(text).unwrap_err().to_string(), message, "{text:?}");
        }
    }

    #[test]
    fn a_budget_is_kept() {
        let budget = CageBudget {
            vertices: 5,
            corners: 8,
        };
        let error = read_obj(QUADS.as_bytes(), budget).unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 7: the cage has more than 5 vertices, which is the budget"
        );
        let budget = CageBudget {
            vertices: 6,
            corners: 7,
        };
        assert!(
            read_obj(QUADS.as_bytes(), budget)
                .unwrap_err()
                .to_string()
                .starts_with("line 10:")
        );
    }

    #[test]
    fn no_cut_of_a_file_panics() {
        for end in 0..QUADS.len() {
            let _ = read(&QUADS[..end]);
        }
        assert!(read_obj(b"\xff\xfe v f\nv \xff 0 0\n", CageBudget::default()).is_err());
    }
}
