//! Records of `feature/<L>`: what a tile's chunk says of the features that touch it. `FORMAT.md` draws the bytes.

use super::{CUT_PATCH_LIMIT, FeatureGroup, tiles_of};
use crate::cage::{Cage, Corner, Crease, Faces, Tags};
use crate::geo::TileId;

/// Version of the record.
const VERSION: u32 = 1;

/// The record of a tile: its groups, with the cages of those whose home it is. Of no length but its own; the array's
/// chunks are padded with zeros.
pub(in crate::pyramid) fn encode(tile: TileId, groups: &[FeatureGroup]) -> Vec<u8> {
    let mut out = Bytes::default();
    out.words([VERSION, u32::from(tile.level), tile.row, tile.column]);
    out.words([count(groups.len())]);
    for group in groups {
        out.words([group.id]);
        out.words([
            u32::from(group.home.level),
            group.home.row,
            group.home.column,
        ]);
        out.words(group.cut);
        match group.cage.as_ref().filter(|_| group.home == tile) {
            Some(cage) => out.cage(cage),
            None => out.words([0; 6]),
        }
    }
    out.0
}

/// The groups in a record; an error says in words what is wrong.
pub(in crate::pyramid) fn decode(bytes: &[u8], tile: TileId) -> Result<Vec<FeatureGroup>, String> {
    let mut input = Input(bytes);
    let [version, level, row, column] = input.words()?;
    if version != VERSION {
        return Err(format!(
            "a feature record of version {version}; this program reads {VERSION}"
        ));
    }
    if [level, row, column] != [u32::from(tile.level), tile.row, tile.column] {
        return Err(format!(
            "the feature record of {level}/{row}/{column} in its place"
        ));
    }
    let [group_count] = input.words()?;
    (0..group_count)
        .map(|_| input.group(tile))
        .collect::<Result<Vec<_>, _>>()
}

fn count(length: usize) -> u32 {
    u32::try_from(length).unwrap_or(u32::MAX)
}

#[derive(Default)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn words(&mut self, words: impl IntoIterator<Item = u32>) {
        words
            .into_iter()
            .for_each(|word| self.0.extend(word.to_le_bytes()));
    }

    fn numbers(&mut self, numbers: impl IntoIterator<Item = f64>) {
        numbers
            .into_iter()
            .for_each(|number| self.0.extend(number.to_le_bytes()));
    }

    fn cage(&mut self, cage: &Cage) {
        let topology = cage.topology();
        let tags = topology.tags();
        self.words([
            topology.vertex_count(),
            topology.face_count(),
            topology.corner_count(),
            count(tags.creases.len()),
            count(tags.corners.len()),
            count(tags.holes.len()),
        ]);
        self.numbers(cage.positions().iter().flatten().copied());
        let sizes = topology.faces().iter().map(|face| count(face.len()));
        self.words(sizes);
        self.words(topology.faces().list().iter().copied());
        for crease in &tags.creases {
            self.words(crease.vertices);
            self.numbers([crease.sharpness]);
        }
        for corner in &tags.corners {
            self.words([corner.vertex]);
            self.numbers([corner.sharpness]);
        }
        self.words(tags.holes);
    }
}

/// What of a record is still to be read.
struct Input<'a>(&'a [u8]);

impl Input<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (bytes, rest) = self
            .0
            .split_first_chunk::<N>()
            .ok_or("the feature record is cut short")?;
        self.0 = rest;
        Ok(*bytes)
    }

    fn words<const N: usize>(&mut self) -> Result<[u32; N], String> {
        let mut words = [0; N];
        for word in &mut words {
            *word = u32::from_le_bytes(self.take()?);
        }
        Ok(words)
    }

    fn numbers<const N: usize>(&mut self) -> Result<[f64; N], String> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = f64::from_le_bytes(self.take()?);
        }
        Ok(numbers)
    }

    /// So many things of so many bytes, which must be there before room is made for them.
    fn list<T>(
        &mut self,
        length: u32,
        bytes: usize,
        mut one: impl FnMut(&mut Self) -> Result<T, String>,
    ) -> Result<Vec<T>, String> {
        if (length as usize).saturating_mul(bytes) > self.0.len() {
            return Err(format!(
                "the feature record announces {length} times {bytes} bytes and has {}",
                self.0.len()
            ));
        }
        (0..length).map(|_| one(self)).collect()
    }

    fn group(&mut self, tile: TileId) -> Result<FeatureGroup, String> {
        let [id, level, row, column, row0, column0, row1, column1] = self.words()?;
        let cut = [row0, column0, row1, column1];
        if level != u32::from(tile.level) || row0 >= row1 || column0 >= column1 {
            return Err(format!(
                "feature {id} at level {level} with the cut {cut:?}"
            ));
        }
        let [rows, columns] = [row1 - row0, column1 - column0].map(u64::from);
        if rows * columns > CUT_PATCH_LIMIT {
            return Err(format!(
                "feature {id} with a cut of {rows} x {columns} patches; the limit is {CUT_PATCH_LIMIT}"
            ));
        }
        let home = TileId::new(tile.level, row, column);
        let tiles = tiles_of(tile.level, cut);
        if tiles.first() != Some(&home) || !tiles.contains(&tile) {
            return Err(format!(
                "feature {id} of {home} with the cut {cut:?}, which is not there"
            ));
        }
        let cage = self
            .cage()
            .map_err(|what| format!("feature {id}: {what}"))?;
        if cage.is_some() != (home == tile) {
            return Err(format!(
                "feature {id}, whose cage belongs in the record of {home}"
            ));
        }
        Ok(FeatureGroup {
            id,
            home,
            tiles,
            cut,
            cage,
        })
    }

    fn cage(&mut self) -> Result<Option<Cage>, String> {
        let [vertices, faces, corners, creases, sharp, holes] = self.words()?;
        if vertices == 0 {
            return Ok(None);
        }
        let positions = self.list(vertices, 24, |input| input.numbers())?;
        let mut end = 0_u32;
        let mut offsets = vec![0];
        for size in self.list(faces, 4, |input| input.words::<1>())? {
            end = end
                .checked_add(size[0])
                .ok_or("faces of too many corners")?;
            offsets.push(end);
        }
        let list = self.list(corners, 4, |input| Ok(input.words::<1>()?[0]))?;
        let faces = Faces::new(offsets, list).ok_or("faces whose corners do not add up")?;
        let tags = Tags {
            creases: self.list(creases, 16, |input| {
                let vertices = input.words()?;
                let [sharpness] = input.numbers()?;
                Ok(Crease {
                    vertices,
                    sharpness,
                })
            })?,
            corners: self.list(sharp, 12, |input| {
                let [vertex] = input.words()?;
                let [sharpness] = input.numbers()?;
                Ok(Corner { vertex, sharpness })
            })?,
            holes: self.list(holes, 4, |input| Ok(input.words::<1>()?[0]))?,
        };
        Cage::new(positions, faces, &tags)
            .map(Some)
            .map_err(|error| error.to_string())
    }
}
