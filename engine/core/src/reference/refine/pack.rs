//! A feature's tables as the stage `refine` is handed them.
//!
//! [`RefineTables`] packs [`Tables`] and the places where vertices are wanted: words, tasks in the order in which they run,
//! and the cage's points. Runs once a mesh, where the mesh is made; knows no device.

use super::super::shared::{
    FeatureVertex, NONE,
    refine::{
        REFINE_MEANS, REFINE_RINGS, REFINE_STENCIL, REFINE_TASK_STRIDE, REFINE_WEIGHTED,
        REFINE_WEIGHTED_WORDS, RefineHeader, RefineTask,
    },
};
use crate::fas::{LevelRows, PieceIndex, RenderTable, Tables};

/// Bytes of a point.
const POINT_BYTES: u64 = 12;

/// The ground that a feature lies in: its cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineGround {
    /// Metres a sample: east, north (negative).
    pub step: [f64; 2],
    /// Samples: columns, rows.
    pub size: [u32; 2],
    /// Column and row of its corner in its first tile.
    pub first: [u32; 2],
    /// Tiles under it: columns, rows.
    pub tiles: [u32; 2],
}

/// Where a vertex is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineSite {
    /// The patch or cap.
    pub piece: PieceIndex,
    /// The place on it.
    pub uv: [f64; 2],
    /// What is added to its height, and to the height's derivatives by u and v.
    pub offset: Option<[f64; 3]>,
    /// The vertex whose position it has; itself unless it only shades differently.
    pub position_of: u32,
}

/// What a level's points move on a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LevelBytes {
    /// Points made, phantoms included.
    pub points: u64,
    /// Bytes of rows read.
    pub rows: u64,
    /// Bytes of points gathered, each as often as a row names it.
    pub gathered: u64,
    /// Bytes of points written.
    pub written: u64,
}

impl LevelBytes {
    /// All three.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.rows + self.gathered + self.written
    }
}

/// What the points of tables move on a device: the cage's phantoms first, then levels 1, 2, ….
#[must_use]
pub fn bytes_by_level(tables: &Tables) -> Vec<LevelBytes> {
    Packer::of(tables).levels
}

/// A feature's tables as a device executes them.
#[derive(Clone, Debug, PartialEq)]
pub struct RefineTables {
    /// Where parts start.
    pub header: RefineHeader,
    /// What to do, in this order.
    pub tasks: Vec<RefineTask>,
    /// The tables.
    pub words: Vec<u32>,
    /// The cage's points, the first of all.
    pub cage: Vec<[f32; 3]>,
    /// All points.
    pub point_count: u32,
}

impl RefineTables {
    /// Packs tables of a cage and the vertices wanted.
    ///
    /// # Panics
    /// When a site is of no piece of the tables, or there are fewer positions than the cage has points.
    #[must_use]
    pub fn new(
        tables: &Tables,
        cage: &[[f64; 3]],
        ground: &RefineGround,
        sites: &[RefineSite],
    ) -> Self {
        let mut packer = Packer::of(tables);
        let (patches_word, vertices_word) = packer.sites(&tables.render, sites);
        let header = RefineHeader {
            step: ground.step.map(narrow),
            size: ground.size.map(|samples| narrow(samples.into())),
            first: ground.first,
            tiles: ground.tiles,
            patches_word,
            vertices_word,
            vertex_count: short(sites.len()),
            reserved: 0,
        };
        Self {
            header,
            tasks: packer.tasks,
            words: packer.words,
            cage: cage[..tables.cage_points as usize]
                .iter()
                .map(|point| point.map(narrow))
                .collect(),
            point_count: tables.point_count(),
        }
    }

    /// Bytes of the largest buffer it takes on a device.
    #[must_use]
    pub fn largest_buffer_bytes(&self) -> u64 {
        let [words, points, vertices, _] = self.buffer_bytes();
        words.max(points).max(vertices)
    }

    /// Bytes of all buffers on a device while the tables are executed.
    #[must_use]
    pub fn device_bytes(&self) -> u64 {
        self.buffer_bytes().iter().sum()
    }

    /// Bytes in memory.
    #[must_use]
    pub fn byte_count(&self) -> u64 {
        let all = size_of_val(&*self.words) + size_of_val(&*self.cage) + size_of_val(&*self.tasks);
        all as u64
    }

    /// Words, points, vertices, header and tasks.
    fn buffer_bytes(&self) -> [u64; 4] {
        [
            size_of_val(&*self.words) as u64,
            u64::from(self.point_count) * POINT_BYTES,
            u64::from(self.header.vertex_count) * size_of::<FeatureVertex>() as u64,
            ((self.tasks.len() + 2) * REFINE_TASK_STRIDE) as u64,
        ]
    }
}

#[derive(Default)]
struct Packer {
    words: Vec<u32>,
    tasks: Vec<RefineTask>,
    levels: Vec<LevelBytes>,
}

impl Packer {
    /// All levels' rows.
    fn of(tables: &Tables) -> Self {
        let mut packer = Self::default();
        packer.level(&tables.base);
        for rows in &tables.levels {
            packer.level(rows);
        }
        packer
    }

    fn word(&self) -> u32 {
        short(self.words.len())
    }

    /// A level's rows: face points first, whom edge and vertex points need; then what replaces some of them; then what
    /// lies beyond boundaries.
    fn level(&mut self, rows: &LevelRows) {
        self.levels.push(LevelBytes::default());
        let counts = rows.counts();
        let edges = rows.first_point + counts.face;
        self.means(rows.first_point, &rows.faces);
        self.means(edges, &rows.edges);
        self.rings(edges + counts.edge, rows);
        let blends = rows
            .blends
            .iter()
            .map(|row| (row.point, row.weights.clone()));
        self.weighted(blends);
        let phantoms = rows.first_point + counts.total();
        let terms = rows.phantoms.iter().map(|row| phantom_terms(rows, row));
        self.weighted((phantoms..).zip(terms));
    }

    fn task(&mut self, kind: u32, count: usize, first_point: u32, terms: usize) {
        self.tasks.push(RefineTask {
            kind,
            count: short(count),
            rows_word: self.word(),
            first_point,
        });
        if let Some(level) = self.levels.last_mut() {
            level.points += count as u64;
            level.gathered += terms as u64 * POINT_BYTES;
            level.written += count as u64 * POINT_BYTES;
        }
    }

    /// Appends words of rows.
    fn rows(&mut self, words: impl IntoIterator<Item = u32>) {
        let before = self.words.len();
        self.words.extend(words);
        if let Some(level) = self.levels.last_mut() {
            level.rows += 4 * (self.words.len() - before) as u64;
        }
    }

    fn means(&mut self, first_point: u32, rows: &[[u32; 4]]) {
        if !rows.is_empty() {
            self.task(REFINE_MEANS, rows.len(), first_point, 4 * rows.len());
            self.rows(rows.iter().flatten().copied());
        }
    }

    fn rings(&mut self, first_point: u32, rows: &LevelRows) {
        let count = rows.counts().vertex as usize;
        if count > 0 {
            self.task(REFINE_RINGS, count, first_point, rows.vertex_points.len());
            let start = self.word() + short(count) + 1;
            self.rows(rows.vertex_offsets.iter().map(|offset| start + offset));
            self.rows(rows.vertex_points.iter().copied());
        }
    }

    fn weighted(&mut self, rows: impl Iterator<Item = (u32, Vec<(u32, f64)>)>) {
        let rows: Vec<_> = rows.collect();
        if rows.is_empty() {
            return;
        }
        let terms = rows.iter().map(|(_, terms)| terms.len()).sum();
        self.task(REFINE_WEIGHTED, rows.len(), 0, terms);
        let mut at = self.word() + short(rows.len()) * REFINE_WEIGHTED_WORDS;
        let heads = rows.iter().flat_map(|(point, terms)| {
            let start = at;
            at += 2 * short(terms.len());
            [*point, start, short(terms.len())]
        });
        let heads: Vec<u32> = heads.collect();
        self.rows(heads);
        let terms = rows.iter().flat_map(|(_, terms)| terms);
        self.rows(terms.flat_map(|&(point, weight)| [point, bits(weight)]));
    }

    /// Patches, stencils, offsets and vertices; where patches and vertices start.
    fn sites(&mut self, table: &RenderTable, sites: &[RefineSite]) -> (u32, u32) {
        let patches_word = self.word();
        let mut packed = vec![NONE; table.patches.len()];
        let mut count = 0;
        for site in sites {
            if let PieceIndex::Patch(patch) = site.piece
                && packed[patch as usize] == NONE
            {
                packed[patch as usize] = count;
                count += 1;
                self.words.extend(table.patches[patch as usize].controls);
            }
        }
        let vertices: Vec<_> = sites
            .iter()
            .map(|site| {
                let source = match site.piece {
                    PieceIndex::Patch(patch) => packed[patch as usize],
                    PieceIndex::Cap(cap) => {
                        self.stencil(&table.caps[cap as usize].stencil(site.uv)) | REFINE_STENCIL
                    }
                };
                let offset = site.offset.map_or(NONE, |offset| self.offset(offset));
                let [u, v] = site.uv.map(bits);
                [source, u, v, offset, site.position_of]
            })
            .collect();
        let vertices_word = self.word();
        self.words.extend(vertices.iter().flatten());
        (patches_word, vertices_word)
    }

    fn stencil(&mut self, terms: &[(u32, [f64; 3])]) -> u32 {
        let start = self.word();
        self.words.push(short(terms.len()));
        for (point, weights) in terms {
            self.words.push(*point);
            self.words.extend(weights.map(bits));
        }
        start
    }

    fn offset(&mut self, offset: [f64; 3]) -> u32 {
        let start = self.word();
        self.words.extend(offset.map(bits));
        start
    }
}

/// Twice the point on the border less the one within. A phantom of phantoms, beyond a corner, is said by the points that
/// they are made of, so that all phantoms of a level are independent of each other.
fn phantom_terms(rows: &LevelRows, &[border, within]: &[u32; 2]) -> Vec<(u32, f64)> {
    let first = rows.first_point + rows.counts().total();
    let mut terms = Vec::with_capacity(4);
    for (point, weight) in [(border, 2.0), (within, -1.0)] {
        if point < first {
            terms.push((point, weight));
            continue;
        }
        let inner = phantom_terms(rows, &rows.phantoms[(point - first) as usize]);
        terms.extend(
            inner
                .into_iter()
                .map(|(point, part)| (point, weight * part)),
        );
    }
    terms
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding to f32 is what a device computes with"
)]
fn narrow(value: f64) -> f32 {
    value as f32
}

fn bits(value: f64) -> u32 {
    narrow(value).to_bits()
}

/// Tables of 2^32 words are refused for their size before anybody reads them.
fn short(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}
