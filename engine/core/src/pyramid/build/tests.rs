//! Whole builds of small rasters, decoded again.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::area::Area;
use super::measure::{Drawn, Finest};
use super::samples::Samples;
use super::testing::{Field, hills, shared};
use super::*;
use crate::dem::{self, OpenOptions, Window};
use crate::geo::{PATCH_COUNT, TILE_SAMPLES, TileId};
use crate::pyramid::surface::decode_heights;
use crate::pyramid::{Pyramid, Summary, Tile, patch_error};

/// A built pyramid, opened and read tile by tile.
struct Built {
    _folder: tempfile::TempDir,
    metadata: Metadata,
    tiles: BTreeMap<TileId, Tile>,
}

impl Built {
    fn new(raster: &dyn Raster, eps: Option<f64>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let options = BuildOptions {
            output: folder.path().join("out"),
            eps,
            ..BuildOptions::default()
        };
        run(raster, &options).unwrap();
        let pyramid = Pyramid::open(&options.output).unwrap();
        let metadata = pyramid.metadata().clone();
        let grid = &metadata.grid;
        let tiles = (0..grid.level_count()).flat_map(|level| {
            let [rows, columns] = grid.tiles(level);
            (0..rows).flat_map(move |row| (0..columns).map(move |c| TileId::new(level, row, c)))
        });
        let tiles = tiles.map(|tile| (tile, pyramid.read_tile_chain(tile).unwrap()));
        Self {
            tiles: tiles.collect(),
            metadata,
            _folder: folder,
        }
    }

    fn heights(&self, tile: TileId) -> Vec<i32> {
        let tile = &self.tiles[&tile];
        decode_heights(&tile.controls, &tile.detail, tile.step)
    }

    /// A level's samples where they are data.
    fn samples(&self, level: u8, size: [usize; 2]) -> Samples {
        let mut samples = Samples::new(Area::whole(size), vec![0; size[0] * size[1]]);
        for tile in self.tiles.keys().filter(|tile| tile.level == level) {
            for (index, height) in self.heights(*tile).iter().enumerate() {
                let row = tile.row as usize * 128 + index / 129;
                let column = tile.column as usize * 128 + index % 129;
                if row < size[0] && column < size[1] {
                    samples.values[row * size[1] + column] = *height;
                    if self.is_void(*tile, index) {
                        samples.set_void(row, column);
                    }
                }
            }
        }
        samples
    }

    fn is_void(&self, tile: TileId, index: usize) -> bool {
        self.tiles[&tile].is_void(index / TILE_SAMPLES, index % TILE_SAMPLES)
    }

    /// The finest samples, decoded: none where void.
    fn finest(&self) -> Vec<Vec<Option<i32>>> {
        let [rows, columns] =
            [self.metadata.grid.rows, self.metadata.grid.columns].map(|count| count as usize);
        let mut field = vec![vec![None; columns]; rows];
        let finest = self.metadata.grid.level_count() - 1;
        for tile in self.tiles.keys().filter(|tile| tile.level == finest) {
            let heights = self.heights(*tile);
            for (index, height) in heights.iter().enumerate() {
                let [row, column] = [
                    tile.row as usize * 128 + index / 129,
                    tile.column as usize * 128 + index % 129,
                ];
                if row < rows && column < columns && !self.is_void(*tile, index) {
                    field[row][column] = Some(*height);
                }
            }
        }
        field
    }

    /// Checks every finest sample against its source.
    fn check_bound(&self, raster: &dyn Raster) {
        let grid = raster.header().grid;
        let mut source = vec![0.0; grid.rows as usize * grid.columns as usize];
        raster.read(Window::whole(&grid), &mut source).unwrap();
        let (unit, eps) = (self.metadata.unit(), self.metadata.eps);
        for (row, line) in self.finest().iter().enumerate() {
            for (column, height) in line.iter().enumerate() {
                let want = source[row * grid.columns as usize + column];
                match height {
                    None => assert!(want.is_nan(), "row {row}, column {column} is void"),
                    Some(height) => {
                        let error = (f64::from(*height) * unit - want).abs();
                        assert!(error <= eps, "row {row}, column {column}: {error}");
                    }
                }
            }
        }
    }

    /// Checks that neighbours of every level hold equal heights and void bits on their common border.
    fn check_borders(&self) {
        for tile in self.tiles.keys() {
            let east = TileId::new(tile.level, tile.row, tile.column + 1);
            let south = TileId::new(tile.level, tile.row + 1, tile.column);
            let pairs: [(TileId, [usize; 2], usize); 2] =
                [(east, [128, 0], 129), (south, [128 * 129, 0], 1)];
            for (other, [mine, theirs], stride) in pairs {
                if !self.tiles.contains_key(&other) {
                    continue;
                }
                let (a, b) = (self.heights(*tile), self.heights(other));
                for step in 0..TILE_SAMPLES {
                    let [mine, theirs] = [mine + step * stride, theirs + step * stride];
                    assert_eq!(a[mine], b[theirs], "{tile} and {other}");
                    assert_eq!(
                        self.is_void(*tile, mine),
                        self.is_void(other, theirs),
                        "{tile} and {other}"
                    );
                }
            }
        }
    }

    /// Checks a tile's error by going over all finest samples under it, one by one.
    fn check_error(&self, tile: TileId) {
        let (heights, finest, grid) = (self.heights(tile), self.finest(), &self.metadata.grid);
        let stride = f64::from(grid.stride(tile.level));
        let [first_row, first_column] = grid.first_sample(tile).map(|first| first as f64);
        let mut worst = 0.0_f64;
        for (row, line) in finest.iter().enumerate() {
            for (column, height) in line.iter().enumerate() {
                let [y, x] = [
                    (row as f64 - first_row) / stride,
                    (column as f64 - first_column) / stride,
                ];
                let Some(height) =
                    height.filter(|_| (0.0..=128.0).contains(&y) && (0.0..=128.0).contains(&x))
                else {
                    continue;
                };
                let [i, j] = [y, x].map(|place| place.floor().min(127.0));
                let at = |i: f64, j: f64| f64::from(heights[(i * 129.0 + j) as usize]);
                let (v, w) = (y - i, x - j);
                let [nw, ne, sw, se] = [
                    at(i, j),
                    at(i, j + 1.0),
                    at(i + 1.0, j),
                    at(i + 1.0, j + 1.0),
                ];
                let drawn = if w >= v {
                    nw + (ne - nw) * w + (se - ne) * v
                } else {
                    nw + (sw - nw) * v + (se - sw) * w
                };
                worst = worst.max((drawn - f64::from(height)).abs());
            }
        }
        let record = &self.tiles[&tile];
        let children = record
            .children
            .iter()
            .map(|child| f64::from(child.error))
            .fold(0.0, f64::max);
        let stated = f64::from(record.summary.error);
        let truth = (worst * self.metadata.unit()).max(children);
        assert!(
            stated >= truth && stated <= truth * 1.000_001,
            "{tile}: {stated} {truth}"
        );
    }
}

fn built(raster: &dyn Raster, eps: Option<f64>) -> Built {
    Built::new(raster, eps)
}

fn options(folder: &Path, name: &str, threads: usize) -> BuildOptions {
    BuildOptions {
        output: folder.join(name),
        threads: Some(threads),
        eps: Some(2.0),
        ..BuildOptions::default()
    }
}

fn run(raster: &dyn Raster, options: &BuildOptions) -> Result<BuildReport, PyramidError> {
    build(raster, None, options, &|_| (), &AtomicBool::new(false))
}

/// Every file of a pyramid and what is in it.
fn files_of(pyramid: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    tree(pyramid, "", &mut files);
    files
}

fn tree(folder: &Path, below: &str, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = format!("{below}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            tree(&entry.path(), &name, files);
        } else {
            files.insert(name, fs::read(entry.path()).unwrap());
        }
    }
}

#[test]
fn every_sample_is_within_the_bound_and_borders_are_shared() {
    let field = Field::new(300, 421, hills);
    for eps in [None, Some(0.3), Some(3.0), Some(40.0)] {
        let built = built(&field, eps);
        built.check_bound(&field);
        built.check_borders();
    }
}

#[test]
fn whole_metres_come_back_exactly_by_default() {
    let field = Field::new(140, 150, hills);
    let built = built(&field, None);
    for (row, line) in built.finest().iter().enumerate() {
        for (column, height) in line.iter().enumerate() {
            let metres = f64::from(height.unwrap()) * built.metadata.unit();
            assert_eq!(metres.round(), field.at(row, column));
        }
    }
}

#[test]
fn rasters_of_one_row_or_column_or_sample_or_of_whole_tiles_build() {
    for (rows, columns) in [
        (1, 1),
        (1, 200),
        (300, 1),
        (2, 2),
        (129, 129),
        (130, 3),
        (513, 257),
    ] {
        let field = Field::new(rows, columns, hills);
        let built = built(&field, Some(1.0));
        built.check_bound(&field);
        built.check_borders();
        assert_eq!(
            built.metadata.levels.len(),
            usize::from(field.header().grid.level_count())
        );
    }
}

#[test]
fn tile_errors_are_true() {
    let field = Field::new(290, 400, |row, column| {
        if row.abs_diff(120) < 9 {
            f64::NAN
        } else {
            hills(row, column)
        }
    });
    let built = built(&field, Some(2.0));
    for tile in [
        TileId::ROOT,
        TileId::new(1, 0, 0),
        TileId::new(1, 0, 1),
        TileId::new(1, 1, 0),
        TileId::new(2, 1, 1),
    ] {
        built.check_error(tile);
    }
}

#[test]
fn summaries_enclose_all_below() {
    let built = built(&Field::new(300, 421, hills), Some(2.0));
    for (tile, record) in &built.tiles {
        let heights = built.heights(*tile);
        assert!(
            heights
                .iter()
                .all(|height| (record.summary.min..=record.summary.max).contains(height))
        );
        for (child, summary) in tile.children().iter().zip(record.children) {
            assert_eq!(
                summary,
                built
                    .tiles
                    .get(child)
                    .map_or(Summary::default(), |child| child.summary)
            );
            let inside = summary.min >= record.summary.min && summary.max <= record.summary.max;
            assert!(!summary.is_present() || inside && summary.error <= record.summary.error);
        }
    }
}

#[test]
fn patch_codes_are_no_less_than_the_patches_errors() {
    let built = built(&Field::new(300, 421, hills), Some(2.0));
    let (grid, unit) = (&built.metadata.grid, built.metadata.unit());
    let finest = built.samples(grid.level_count() - 1, [300, 421]);
    let levels: Vec<Samples> = (0..grid.level_count())
        .map(|level| {
            let size = grid.tiles(level).map(|count| count as usize * 128 + 1);
            built.samples(level, size)
        })
        .collect();
    for (tile, record) in &built.tiles {
        let drawn = Drawn {
            samples: &levels[usize::from(tile.level)],
            stride: grid.stride(tile.level) as usize,
        };
        let base = record.summary.error.max(unit as f32);
        if tile.level + 1 == grid.level_count() {
            // Stride errors of the tile's own heights say it all there.
            assert!(record.patch_codes.iter().all(|code| *code == 0xff));
            continue;
        }
        for patch in 0..PATCH_COUNT {
            let code = record.patch_codes[patch];
            let [row, column] = [tile.row, tile.column].map(|index| index as usize * 32);
            let place = [row + patch / 32, column + patch % 32];
            let errors = drawn.patch(place, &Finest::new(&finest));
            for (nibble, error) in [(code & 15, errors.coarse), (code >> 4, errors.middle)] {
                assert!(f64::from(patch_error(nibble, base)) >= error * unit);
                assert!(nibble == 0 || f64::from(patch_error(nibble - 1, base)) < error * unit);
            }
        }
    }
}

#[test]
fn voids_are_masked_and_filled_smoothly() {
    let hole = |row: u32, column: u32| row.abs_diff(130) < 30 && column.abs_diff(140) < 40;
    let field = Field::new(300, 300, |row, column| {
        if hole(row, column) {
            f64::NAN
        } else {
            hills(row, column)
        }
    });
    let built = built(&field, Some(1.0));
    built.check_bound(&field);
    built.check_borders();
    let root = &built.tiles[&TileId::ROOT];
    assert_eq!(root.summary.flags, Summary::PRESENT | Summary::VOID);
    let range = f64::from(root.summary.max - root.summary.min) * built.metadata.unit();
    assert!(range < 900.0, "{range}");
}

#[test]
fn a_tile_in_the_middle_of_a_void_is_all_void() {
    let field = Field::new(600, 600, |row, column| {
        if row < 500 && column < 500 {
            f64::NAN
        } else {
            10.0
        }
    });
    let built = built(&field, Some(1.0));
    let flags = built.tiles[&TileId::new(3, 1, 1)].summary.flags;
    assert_eq!(flags, Summary::PRESENT | Summary::VOID | Summary::ALL_VOID);
}

#[test]
fn all_void_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let field = Field::new(40, 50, |_, _| f64::NAN);
    let error = run(&field, &options(folder.path(), "out", 1)).unwrap_err();
    assert!(error.to_string().contains("void"), "{error}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_memory_budget_too_small_is_refused_beforehand() {
    let folder = tempfile::tempdir().unwrap();
    let options = BuildOptions {
        memory_budget: Some(1 << 20),
        ..options(folder.path(), "out", 1)
    };
    let error = run(&Field::new(400, 500, hills), &options)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("400 x 500") && error.contains("the budget is 1 MiB"),
        "{error}"
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn any_number_of_threads_and_any_memory_writes_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let field = Field::new(700, 421, |row, column| {
        if row.abs_diff(200) < 9 {
            f64::NAN
        } else {
            hills(row, column)
        }
    });
    // A block of every size that there is, on one thread and on several.
    let shapes = [(4, 88, 1), (1, 58, 2), (4, 130, 4), (1, 1000, 8)];
    let trees = shapes.map(|(threads, budget_mib, block_tiles)| {
        let options = BuildOptions {
            memory_budget: Some(budget_mib << 20),
            ..options(folder.path(), &format!("out{block_tiles}"), threads)
        };
        let shape = Shape::new(&field, None, &options).unwrap();
        assert_eq!((shape.threads, shape.block_tiles), (threads, block_tiles));
        let report = run(&field, &options).unwrap();
        assert!(report.memory_bytes <= budget_mib << 20);
        assert_eq!(
            (report.samples, report.levels, report.void_samples),
            ([700, 421], 4, 17 * 421)
        );
        files_of(&options.output)
    });
    assert!(trees.iter().all(|tree| *tree == trees[0]));
    assert!(trees[0].len() > 6);
}

/// Options with a named source: of builds that can be gone on with.
fn resumable(folder: &Path, name: &str) -> BuildOptions {
    BuildOptions {
        sources: vec![crate::pyramid::SourceMetadata {
            name: "hills".into(),
            bytes: 1,
            blake3: "00".into(),
        }],
        ..options(folder, name, 2)
    }
}

/// Builds until the first shard is written.
fn stop_at_first_shard(raster: &dyn Raster, options: &BuildOptions) {
    let cancel = AtomicBool::new(false);
    let stop = |progress: Progress| {
        if progress.stage == Stage::Write && progress.done == 1 {
            cancel.store(true, Ordering::Relaxed);
        }
    };
    let stopped = build(raster, None, options, &stop, &cancel);
    assert!(matches!(stopped, Err(PyramidError::Interrupted)));
    assert!(!options.output.exists());
}

#[test]
fn an_interrupted_build_is_gone_on_with_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let field = Field::new(300, 421, hills);
    let options = |name: &str| resumable(folder.path(), name);
    run(&field, &options("whole")).unwrap();
    stop_at_first_shard(&field, &options("resumed"));
    let building = folder.path().join("resumed.building");
    // The one shard that is there is dated back: written again, it would be of today.
    let journal = fs::read_to_string(building.join("manifest/journal.jsonl")).unwrap();
    let written: ShardInfo = serde_json::from_str(journal.lines().next().unwrap()).unwrap();
    let long_ago = std::time::SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(1_000_000);
    let shard = fs::File::options()
        .write(true)
        .open(building.join(&written.key));
    shard.unwrap().set_modified(long_ago).unwrap();
    let report = run(&field, &options("resumed")).unwrap();
    // All but some of the writing.
    let passes = graph::passes(&field, None, false);
    let before = passes.iter().filter(|pass| !pass.name.starts_with("write"));
    let before: usize = before.map(|pass| pass.tasks).sum();
    assert!(report.kept_tasks > before, "{report:?}");
    let about = fs::metadata(options("resumed").output.join(&written.key)).unwrap();
    assert_eq!(about.modified().unwrap(), long_ago);
    assert!(files_of(&options("whole").output) == files_of(&options("resumed").output));
}

/// A raster that is two tasks in most of its passes, with a hole.
fn tall() -> Field {
    Field::new(4300, 90, |row, column| {
        if row.abs_diff(1500) < 200 && column > 30 {
            f64::NAN
        } else {
            hills(row, column)
        }
    })
}

#[test]
fn a_build_that_is_stopped_again_and_again_ends_with_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let field = tall();
    let options = |name: &str| resumable(folder.path(), name);
    run(&field, &options("whole")).unwrap();
    let mut stops = 0;
    let report = loop {
        let cancel = AtomicBool::new(false);
        let heard = AtomicUsize::new(0);
        // Later each time: as soon as there is something new.
        let stop = |progress: Progress| {
            assert!(progress.stage != Stage::StartOver);
            if heard.fetch_add(1, Ordering::Relaxed) == 4 + 4 * stops {
                cancel.store(true, Ordering::Relaxed);
            }
        };
        let options = BuildOptions {
            // As many samples a block and threads as it likes.
            threads: Some(1 + stops % 3),
            memory_budget: (stops % 2 == 0).then_some(120 << 20),
            ..options("stopped")
        };
        let ended = build(&field, None, &options, &stop, &cancel);
        match ended {
            Ok(report) => break report,
            Err(error) => assert!(matches!(error, PyramidError::Interrupted), "{error}"),
        }
        assert!(!options.output.exists());
        damage(folder.path(), stops);
        stops += 1;
    };
    assert!(stops > 4 && report.kept_tasks > 4, "{stops} {report:?}");
    assert!(files_of(&options("whole").output) == files_of(&options("stopped").output));
    // And once more: there is nothing to do.
    let again = run(&field, &options("stopped")).unwrap();
    let report = run(&field, &options("whole")).unwrap();
    assert!(again.unchanged && again == report);
    let other = BuildOptions {
        eps: Some(3.0),
        ..options("stopped")
    };
    assert!(matches!(run(&field, &other), Err(PyramidError::Refused(_))));
}

/// What a crash of the machine may do: a file of a plane lost, another cut short, a journal's entry empty.
fn damage(folder: &Path, turn: usize) {
    let building = folder.join("stopped.building");
    let mut found = BTreeMap::new();
    tree(&building, "", &mut found);
    let names: Vec<&String> = found
        .keys()
        .filter(|name| name.starts_with("scratch/") || name.starts_with("journal/"))
        .collect();
    if names.is_empty() {
        return;
    }
    let pick = |number: usize| building.join(names[number * 7919 % names.len()]);
    match turn % 4 {
        0 => fs::remove_file(pick(turn)).unwrap(),
        1 => fs::write(pick(turn), [0; 40]).unwrap(),
        2 => fs::write(pick(turn), []).unwrap(),
        _ => {}
    }
}

#[test]
fn tasks_in_any_order_that_passes_allow_write_what_a_build_writes() {
    let folder = tempfile::tempdir().unwrap();
    let field = tall();
    let options = |name: &str| resumable(folder.path(), name);
    run(&field, &options("whole")).unwrap();
    let options = options("tasks");
    let planned = plan_tasks(&field, None, &options).unwrap();
    let quiet = AtomicBool::new(false);
    let task = |number, threads| {
        let options = BuildOptions {
            threads: Some(threads),
            ..options.clone()
        };
        run_task(&field, None, &options, number, (&|_| (), &quiet))
    };
    let refused = |result: Result<(), PyramidError>, what: &str| match result {
        Err(PyramidError::Refused(told)) => assert!(told.contains(what), "{told}"),
        other => panic!("{other:?}"),
    };
    refused(task(planned.len(), 1), "no task");
    refused(task(planned.len() - 1, 1), "task 0 (read 0) has to be done");
    refused(finish(&field, None, &options).map(|_| ()), "task 0");
    let mut done: Vec<&PlannedTask> = Vec::new();
    for pass in planned.chunk_by(|a, b| a.pass == b.pass) {
        assert!(pass[0].needs.as_deref() == done.last().map(|task| task.pass.as_str()));
        // The last first, and one of them twice.
        for planned in pass.iter().rev().chain(pass.first()) {
            task(planned.task, 1 + planned.task % 2).unwrap();
        }
        done.extend(pass);
    }
    assert!(
        done.len()
            > planned
                .iter()
                .filter(|task| task.pass == "settle-3")
                .count()
    );
    let report = finish(&field, None, &options).unwrap();
    assert_eq!(report.void_samples, 399 * 59);
    assert!(files_of(&folder.path().join("whole")) == files_of(&options.output));
    // Late ones find nothing to do.
    task(3, 1).unwrap();
    assert!(finish(&field, None, &options).unwrap().unchanged);
}

#[test]
fn an_input_that_changes_is_noticed_and_nothing_is_published() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("input");
    fs::write(&file, "a").unwrap();
    let options = BuildOptions {
        inputs: vec![InputStamp::of(&file).unwrap()],
        ..resumable(folder.path(), "out")
    };
    fs::write(&file, "longer").unwrap();
    let changed = run(&Field::new(60, 70, hills), &options);
    assert!(matches!(changed, Err(PyramidError::Changed(path)) if path == file));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_build_of_the_same_file_read_otherwise_starts_over() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("hills.asc");
    let mut text = "ncols 150\nnrows 140\nxllcorner 0\nyllcorner 0\ncellsize 10\n".to_owned();
    for row in 0..140 {
        let line: Vec<_> = (0..150)
            .map(|column| hills(row, column).to_string())
            .collect();
        text += &format!("{}\n", line.join(" "));
    }
    fs::write(&file, text).unwrap();
    let read = |scale, nodata| {
        let options = OpenOptions {
            scale: Some(scale),
            nodata,
            ..OpenOptions::default()
        };
        dem::open(&file, &options).unwrap()
    };
    let others = [read(3.0, None), read(2.0, Some(hills(70, 70)))];
    for (index, other) in others.iter().enumerate() {
        let [fresh, resumed] =
            ["fresh", "resumed"].map(|name| resumable(folder.path(), &format!("{name}{index}")));
        run(other.as_ref(), &fresh).unwrap();
        stop_at_first_shard(read(2.0, None).as_ref(), &resumed);
        run(other.as_ref(), &resumed).unwrap();
        assert!(files_of(&fresh.output) == files_of(&resumed.output));
    }
}

#[test]
fn a_build_stops_at_the_next_block_of_a_level() {
    let folder = tempfile::tempdir().unwrap();
    let options = BuildOptions {
        memory_budget: Some(54 << 20),
        ..options(folder.path(), "out", 1)
    };
    let cancel = AtomicBool::new(false);
    let heard = std::sync::Mutex::new(Vec::new());
    let stop = |progress: Progress| {
        heard.lock().unwrap().push(progress);
        if progress.stage == Stage::Fit && progress.done == 1 {
            cancel.store(true, Ordering::Relaxed);
        }
    };
    let stopped = build(&Field::new(700, 421, hills), None, &options, &stop, &cancel);
    assert!(matches!(stopped, Err(PyramidError::Interrupted)));
    let last = heard.lock().unwrap().pop().unwrap();
    assert_eq!((last.stage, last.done), (Stage::Fit, 1));
    // Blocks of half a tile a side, and 4 × 2 tiles in the first plane that is fitted.
    assert!(last.total > 8 * 4, "{last:?}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn real_ground_is_within_the_bound() {
    for (path, eps) in [
        ("data/dem/mt_rainier_90m.tif", Some(2.0)),
        ("data/dem/dem_SouthGlacier.tif", None),
    ] {
        let Some(path) = shared(path) else { return };
        let raster = dem::open(&path, &OpenOptions::default()).unwrap();
        let built = built(raster.as_ref(), eps);
        built.check_bound(raster.as_ref());
        built.check_borders();
    }
}
