//! `drumlin cage`: looks into the machine that makes surfaces of cages.

use std::{fmt::Write, fs, path::Path, path::PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, Subcommand};
use drumlin_core::{
    cage::{
        Cage, CageBudget, CageInfo, LimitSample, LimitSurface, Place, read_obj, refine,
        refine_times, write_obj,
    },
    fas::{MAX_DEPTH, Tables},
    reference::refine::bytes_by_level,
};
use drumlin_terminal::{outcome::Outcome, print, write};
use serde_json::{Value, json};

/// Uniform refinements one command makes: each has four times the faces.
const REFINE_LIMIT: u8 = 12;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Faces, valences and features of a cage; with a depth also patches and points of its tables
    Info {
        /// The cage, as OBJ with tags
        #[arg(value_name = "FILE.obj")]
        file: PathBuf,
        /// Depth of every feature: counts patches by class and points by level
        #[arg(long, value_name = "D", value_parser = clap::value_parser!(u8).range(0..=i64::from(MAX_DEPTH)))]
        depth: Option<u8>,
        /// The same for programs
        #[arg(long)]
        json: bool,
    },
    /// The exact limit surface at places: position, derivatives and normal, 17 digits each
    Limit {
        /// The cage, as OBJ with tags
        #[arg(value_name = "FILE.obj")]
        file: PathBuf,
        /// Places: rows id,face,u,v; a first row of names and columns past the fourth are passed over
        #[arg(long, value_name = "SAMPLES.csv")]
        at: PathBuf,
    },
    /// The cage refined everywhere, as OBJ
    Refine {
        /// The cage, as OBJ with tags
        #[arg(value_name = "FILE.obj")]
        file: PathBuf,
        /// How often; each time four times the faces, up to 2^27 face corners
        #[arg(long, value_name = "D", value_parser = clap::value_parser!(u8).range(0..=i64::from(REFINE_LIMIT)))]
        depth: u8,
        /// The file to write
        #[arg(short, long, value_name = "OUT.obj")]
        output: PathBuf,
    },
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome> {
    match &arguments.verb {
        Verb::Info { file, depth, json } => info(file, *depth, *json)?,
        Verb::Limit { file, at } => limit(file, at)?,
        Verb::Refine {
            file,
            depth,
            output,
        } => {
            let fine = refine_times(&read(file)?, *depth, CageBudget::default())
                .with_context(|| format!("{}, refined {depth} times", file.display()))?;
            write(output, write_obj(&fine).as_bytes())?;
        }
    }
    Ok(Outcome::Done)
}

/// Reads a cage; errors name the file, and the line where there is one.
pub(crate) fn read(file: &Path) -> Result<Cage> {
    parse(file, &bytes(file)?)
}

/// The bytes of a file.
pub(crate) fn bytes(file: &Path) -> Result<Vec<u8>> {
    fs::read(file).with_context(|| format!("{}: reading failed", file.display()))
}

/// The cage in a file's text.
pub(crate) fn parse(file: &Path, text: &[u8]) -> Result<Cage> {
    read_obj(text, CageBudget::default()).with_context(|| file.display().to_string())
}

fn info(file: &Path, depth: Option<u8>, as_json: bool) -> Result<()> {
    let cage = read(file)?;
    let mut value = serde_json::to_value(CageInfo::of(&cage))?;
    if let Some(depth) = depth {
        value["depth"] = json!(depth);
        value["tables"] = tables(&cage, depth)?;
    }
    if as_json {
        return print(&format!("{value:#}\n")).map_err(Into::into);
    }
    let mut text = format!("{}\n", file.display());
    lines(&value, 1, &mut text)?;
    print(&text).map_err(Into::into)
}

/// Counts of the classic tables of a depth. A cage with faces that are no quads is refined once before.
fn tables(cage: &Cage, depth: u8) -> Result<Value> {
    let quads = if cage.topology().all_quads() {
        None
    } else {
        Some(refine(cage)?)
    };
    let topology = quads.as_ref().unwrap_or(cage).topology();
    let tables = Tables::classic(topology, depth).map_err(|what| anyhow!(what))?;
    let (patches, caps) = (&tables.render.patches, &tables.render.caps);
    let mut templates = [0_u32; 5];
    for finer in patches
        .iter()
        .map(|patch| patch.finer)
        .chain(caps.iter().map(|cap| cap.finer))
    {
        match (finer.count_ones(), finer) {
            (0, _) => {}
            (1, _) => templates[0] += 1,
            (2, 0b0101 | 0b1010) => templates[2] += 1,
            (2, _) => templates[1] += 1,
            (3, _) => templates[3] += 1,
            _ => templates[4] += 1,
        }
    }
    let [one, adjacent, opposite, three, four] = templates;
    let moved = bytes_by_level(&tables);
    let levels: Vec<Value> = (1..)
        .zip(tables.levels.iter().zip(&moved[1..]))
        .map(|(level, (rows, moved)): (u32, _)| {
            let counts = rows.counts();
            json!({
                "level": level, "face": counts.face, "edge": counts.edge, "vertex": counts.vertex, "all": counts.total(),
                "device_bytes": moved.total(),
            })
        })
        .collect();
    let whole = patches.iter().filter(|patch| patch.finer == 0).count();
    Ok(json!({
        "refined_once_before": quads.is_some(),
        "patches": patches.len() + caps.len(),
        "regular": whole,
        "transition": patches.len() - whole,
        "irregular": caps.len(),
        "boundary": patches.iter().filter(|patch| patch.sharp != 0).count(),
        "templates": {"one": one, "two_adjacent": adjacent, "two_opposite": opposite, "three": three, "four": four},
        "refined_points": tables.refined_point_count(),
        "points_by_level": levels,
        "table_bytes": tables.byte_count(),
    }))
}

/// Counts for people: one a line, indented where they belong together.
fn lines(value: &Value, indent: usize, text: &mut String) -> std::fmt::Result {
    let Value::Object(members) = value else {
        return Ok(());
    };
    for (name, member) in members {
        let name = name.replace('_', " ");
        let margin = "  ".repeat(indent);
        match member {
            Value::Object(inner) if inner.is_empty() => {}
            Value::Object(_) => {
                writeln!(text, "{margin}{name}")?;
                lines(member, indent + 1, text)?;
            }
            Value::Array(items) if items.iter().all(Value::is_object) => {
                writeln!(text, "{margin}{name}")?;
                for item in items {
                    writeln!(text, "{margin}  {}", flat(item))?;
                }
            }
            _ => writeln!(text, "{margin}{name}: {member}")?,
        }
    }
    Ok(())
}

/// The members of an object on one line.
fn flat(item: &Value) -> String {
    let members = item.as_object().into_iter().flatten();
    let words: Vec<String> = members
        .map(|(name, member)| format!("{name} {member}"))
        .collect();
    words.join(", ")
}

fn limit(file: &Path, at: &Path) -> Result<()> {
    let cage = read(file)?;
    let surface = LimitSurface::new(&cage)?;
    let list = String::from_utf8(bytes(at)?).with_context(|| at.display().to_string())?;
    let mut text = "id,px,py,pz,dux,duy,duz,dvx,dvy,dvz,nx,ny,nz\n".to_owned();
    for (line, row) in (1..).zip(list.lines()) {
        let Some((id, place)) =
            place(row, line == 1).with_context(|| format!("{}: line {line}", at.display()))?
        else {
            continue;
        };
        let sample = surface
            .evaluate(place.face, place.u, place.v)
            .with_context(|| format!("{}: line {line}", at.display()))?;
        write_sample(&mut text, id, &sample)?;
    }
    print(&text).map_err(Into::into)
}

/// A row's id and place; none for an empty row and, where it may be one, a row of names.
fn place(row: &str, may_be_names: bool) -> Result<Option<(&str, Place)>> {
    if row.trim().is_empty() {
        return Ok(None);
    }
    let words: Vec<&str> = row.split(',').map(str::trim).collect();
    let [id, face, u, v, ..] = words[..] else {
        bail!("expected id,face,u,v");
    };
    let (Ok(face), Ok(u), Ok(v)) = (face.parse(), u.parse(), v.parse()) else {
        if may_be_names {
            return Ok(None);
        }
        bail!("expected numbers after the id: {face},{u},{v}");
    };
    Ok(Some((id, Place { face, u, v })))
}

fn write_sample(text: &mut String, id: &str, sample: &LimitSample) -> std::fmt::Result {
    text.push_str(id);
    for vector in [sample.position, sample.du, sample.dv, sample.normal] {
        for x in vector {
            write!(text, ",{x:.16e}")?;
        }
    }
    text.push('\n');
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_read_and_names_passed_over() {
        assert!(place("id,face,u,v", true).unwrap().is_none());
        assert!(place("id,face,u,v", false).is_err());
        let (id, at) = place("a7, 3, 0.5, 0.25, more", false).unwrap().unwrap();
        assert_eq!((id, at.face, at.u, at.v), ("a7", 3, 0.5, 0.25));
        assert!(place("1,2", true).is_err());
    }

    #[test]
    fn numbers_have_seventeen_digits() {
        let mut text = String::new();
        let sample = LimitSample {
            position: [1.0 / 3.0, 0.0, -2.0],
            ..LimitSample::default()
        };
        write_sample(&mut text, "x", &sample).unwrap();
        assert!(text.starts_with("x,3.3333333333333331e-1,0.0000000000000000e0,-2.0"));
        assert_eq!(text.matches(',').count(), 12);
    }
}
