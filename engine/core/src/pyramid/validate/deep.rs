//! The walk through all tiles.
//!
//! Reads everything once, depth first, so that a parent's cage is at hand for its children; borders are compared by
//! their hashes as soon as both sides have been seen, so that few are kept.

use std::{collections::HashMap, fmt};

use super::{Finding, Report};
use crate::{
    geo::{CAGE_CONTROLS, Grid, TILE_SAMPLES, TileId},
    pyramid::{Pyramid, PyramidError, Record, Summary, Tile, surface},
};

/// The walk through all tiles.
pub(super) struct Deep<'a> {
    pyramid: &'a Pyramid,
    report: &'a mut Report,
    /// Borders of which one side has been seen: its hash, and whose it is.
    borders: HashMap<Border, (blake3::Hash, TileId)>,
    /// Home and cut of every feature seen.
    features: HashMap<u32, (TileId, [u32; 4])>,
    progress: &'a mut dyn FnMut(u64),
}

/// A border between two tiles of a level: what lies south of or east of a tile.
#[derive(PartialEq, Eq, Hash)]
struct Border {
    level: u8,
    row: u32,
    column: u32,
    south: bool,
}

impl<'a> Deep<'a> {
    pub(super) fn new(
        pyramid: &'a Pyramid,
        report: &'a mut Report,
        progress: &'a mut dyn FnMut(u64),
    ) -> Self {
        Self {
            pyramid,
            report,
            borders: HashMap::new(),
            features: HashMap::new(),
            progress,
        }
    }

    pub(super) fn check(&mut self) {
        self.visit(TileId::ROOT, None, None);
    }

    /// Checks a tile, then its children. Without a parent's controls, damaged further up, only the record is checked.
    fn visit(&mut self, id: TileId, parent: Option<&Tile>, said: Option<&Summary>) {
        (self.progress)(self.report.tile_count);
        self.report.tile_count += 1;
        self.check_color(id);
        let features = self.check_features(id);
        let tile = if parent.is_some() || self.pyramid.is_key(id) {
            self.pyramid
                .read_tile(id, parent.map(|parent| &*parent.controls))
                .map(Found::Whole)
        } else {
            self.pyramid.read_record(id).map(Found::Record)
        };
        let tile = match tile {
            Ok(tile) => tile,
            Err(error) => {
                self.find_error(id, &error);
                return self.visit_children(id, None, None);
            }
        };
        let (summary, children) = tile.summaries();
        self.check_summaries(id, summary, children, said);
        if (summary.flags & Summary::FEATURE != 0) != features {
            self.find(id, "and the features' records say different things of it");
        }
        if let Found::Whole(tile) = &tile {
            self.check_heights(tile);
        }
        self.visit_children(id, tile.whole(), Some(children));
    }

    fn visit_children(&mut self, id: TileId, tile: Option<&Tile>, said: Option<&[Summary; 4]>) {
        if id.level == self.pyramid.metadata().finest() {
            return;
        }
        for (quadrant, child) in id.children().into_iter().enumerate() {
            if self.pyramid.has(child) {
                self.visit(child, tile, said.map(|said| &said[quadrant]));
            }
        }
    }

    /// A tile without a picture of its own is no fault: its parent's shows all there is.
    fn check_color(&mut self, id: TileId) {
        if let Err(error) = self.pyramid.read_color(id) {
            self.find_error(id, &error);
        }
    }

    /// Checks the features of a tile; true where there are any.
    fn check_features(&mut self, id: TileId) -> bool {
        let groups = match self.pyramid.read_features(id) {
            Ok(groups) => groups,
            Err(error) => {
                self.find_error(id, &error);
                return true;
            }
        };
        let count = self
            .pyramid
            .metadata()
            .features
            .map_or(0, |features| features.groups);
        for group in &groups {
            if group.id >= count {
                self.find(id, format!("has feature {} of {count}", group.id));
            }
            let homes = self
                .features
                .entry(group.id)
                .or_insert((group.home, group.cut));
            if *homes != (group.home, group.cut) {
                self.find(
                    id,
                    format!("and others place feature {} differently", group.id),
                );
            }
            if let Some(tile) = group.tiles.iter().find(|tile| !self.pyramid.has(**tile)) {
                self.find(
                    id,
                    format!("has feature {}, which reaches to {tile}", group.id),
                );
            }
        }
        !groups.is_empty()
    }

    fn check_summaries(
        &mut self,
        id: TileId,
        own: &Summary,
        children: &[Summary; 4],
        said: Option<&Summary>,
    ) {
        if !own.is_present() {
            self.find(id, "says of itself that it is absent");
        }
        if said.is_some_and(|said| said != own) {
            self.find(id, "and its parent say different things of it");
        }
        let finest = id.level == self.pyramid.metadata().finest();
        for (quadrant, child) in children.iter().enumerate() {
            let has = !finest && self.pyramid.has(id.children()[quadrant]);
            if child.is_present() != has {
                self.find(
                    id,
                    format!(
                        "says that child {quadrant} is {}",
                        if has { "absent" } else { "there" }
                    ),
                );
            } else if has && child.error > own.error {
                let (own, child) = (own.error, child.error);
                self.find(
                    id,
                    format!("has an error of {own} m, under {child} m of child {quadrant}"),
                );
            }
        }
    }

    /// Checks heights against the summary and borders against neighbours.
    fn check_heights(&mut self, tile: &Tile) {
        let heights = surface::decode_heights(&tile.controls, &tile.detail, tile.step);
        let samples = Samples {
            tile,
            heights: &heights,
        };
        let Summary {
            min, max, flags, ..
        } = tile.summary;
        let grid = self.pyramid.metadata().grid.at_level(tile.id.level);
        let outside = samples
            .inside(&grid)
            .filter(|&(_, height)| height < min || height > max)
            .count();
        if outside > 0 {
            self.find(
                tile.id,
                format!("has {outside} heights outside its own range of {min} to {max} units"),
            );
        }
        if flags & Summary::VOID == 0
            && tile
                .voids
                .as_ref()
                .is_some_and(|bits| bits.iter().any(|&bits| bits != 0))
        {
            self.find(tile.id, "has void samples and does not say so");
        }
        self.check_borders(&samples);
    }

    fn check_borders(&mut self, samples: &Samples<'_>) {
        let TileId { level, row, column } = samples.tile.id;
        let border = |row, column, south| Border {
            level,
            row,
            column,
            south,
        };
        self.check_border(border(row, column, true), samples, true);
        self.check_border(border(row, column, false), samples, true);
        if let Some(above) = row.checked_sub(1) {
            self.check_border(border(above, column, true), samples, false);
        }
        if let Some(left) = column.checked_sub(1) {
            self.check_border(border(row, left, false), samples, false);
        }
    }

    /// Compares a border with its other side where that has been seen, else keeps its hash.
    fn check_border(&mut self, border: Border, samples: &Samples<'_>, far: bool) {
        let id = samples.tile.id;
        let beyond = if border.south {
            TileId::new(id.level, id.row + 1, id.column)
        } else {
            TileId::new(id.level, id.row, id.column + 1)
        };
        if far && !self.pyramid.has(beyond) {
            return;
        }
        let hash = samples.border_hash(border.south, far);
        match self.borders.remove(&border) {
            None => {
                self.borders.insert(border, (hash, id));
            }
            Some((other, whose)) if other != hash => {
                self.find(id, format!("and {whose} differ on their common border"));
            }
            Some(_) => {}
        }
    }

    fn find(&mut self, id: TileId, what: impl fmt::Display) {
        self.find_text(id, format!("{id}: {what}"));
    }

    fn find_error(&mut self, id: TileId, error: &PyramidError) {
        self.find_text(id, error.to_string());
    }

    fn find_text(&mut self, id: TileId, what: String) {
        let place = self.pyramid.metadata().grid.tile_extent(id).center();
        let tile = Some([u32::from(id.level), id.row, id.column]);
        self.report.push(Finding {
            what,
            tile,
            place: Some(place),
        });
    }
}

/// A tile, or its record where the cage cannot be decoded.
enum Found {
    Whole(Tile),
    Record(Record),
}

impl Found {
    const fn summaries(&self) -> (&Summary, &[Summary; 4]) {
        match self {
            Self::Whole(tile) => (&tile.summary, &tile.children),
            Self::Record(record) => (&record.summary, &record.children),
        }
    }

    const fn whole(&self) -> Option<&Tile> {
        match self {
            Self::Whole(tile) => Some(tile),
            Self::Record(_) => None,
        }
    }
}

/// A tile's samples.
struct Samples<'a> {
    tile: &'a Tile,
    heights: &'a [i32],
}

impl Samples<'_> {
    /// Index and height of the samples that lie in a level's grid and are not void.
    fn inside(&self, grid: &Grid) -> impl Iterator<Item = (usize, i32)> {
        let first =
            [self.tile.id.row, self.tile.id.column].map(|tile| tile as usize * (TILE_SAMPLES - 1));
        let [rows, columns] = [grid.rows as usize, grid.columns as usize];
        self.heights
            .iter()
            .copied()
            .enumerate()
            .filter(move |(at, _)| {
                let [row, column] = [at / TILE_SAMPLES, at % TILE_SAMPLES];
                first[0] + row < rows
                    && first[1] + column < columns
                    && !self.tile.is_void(row, column)
            })
    }

    /// A hash of what both tiles of a border hold of it: heights, void bits, and three rows of controls.
    fn border_hash(&self, south: bool, far: bool) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        let line = if far { TILE_SAMPLES - 1 } else { 0 };
        for along in 0..TILE_SAMPLES {
            let [row, column] = if south { [line, along] } else { [along, line] };
            hasher.update(&self.heights[row * TILE_SAMPLES + column].to_le_bytes());
            hasher.update(&[u8::from(self.tile.is_void(row, column))]);
        }
        let first = if far { CAGE_CONTROLS - 3 } else { 0 };
        for across in first..first + 3 {
            for along in 0..CAGE_CONTROLS {
                let [row, column] = if south {
                    [across, along]
                } else {
                    [along, across]
                };
                hasher.update(&self.tile.controls[row * CAGE_CONTROLS + column].to_le_bytes());
            }
        }
        hasher.finalize()
    }
}
