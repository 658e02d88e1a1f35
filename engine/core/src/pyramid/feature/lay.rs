//! Laying: an authored cage becomes a cut in the finest level's patches and the cage that fills it.
//!
//! 1. place the cage's vertices in samples and units;
//! 2. find the cut around them;
//! 3. put the rim on the ground, which must not be void there;
//! 4. lattice quads, zipper and authored faces become one cage;
//! 5. measure how far it is from the ground.

use super::plan::{self, PLAN_STEPS, Point};
use super::region::Region;
use super::zipper::zip;
use super::{CUT_PATCH_LIMIT, FEATURE_FACE_LIMIT, FeatureInput, LaidFeature, Site};
use crate::cage::{Cage, Faces, Tags, boundary_loops};
use crate::geo::{QUAD_SAMPLES, TILE_QUADS, WorldFrame};
use crate::pyramid::PyramidError;
use crate::pyramid::surface::CONTROL_LIMIT;

/// Samples a side of a patch.
const SIDE: f64 = QUAD_SAMPLES as f64;
/// Patches around what is authored: ring 1, ring 2 and the zipper.
const MARGIN: i64 = 3;

/// Lays a cage into the ground.
///
/// # Errors
/// [`PyramidError::Refused`], with the feature's name, where the cage has no rim or several, its rim crosses itself or
/// faces down, it reaches past the data, its rim is over void samples, or it is too large or too high.
pub fn lay(input: &FeatureInput, site: &Site<'_>) -> Result<LaidFeature, PyramidError> {
    let refuse = |what: String| PyramidError::Refused(format!("feature {}: {what}", input.name));
    let rim = rim(&input.cage).map_err(refuse)?;
    let placed = place(input, site).map_err(refuse)?;
    let cut = cut(&placed, site).map_err(refuse)?;
    laid(input, site, placed, cut, &rim).map_err(refuse)
}

/// The one boundary loop of a cage.
fn rim(cage: &Cage) -> Result<Vec<u32>, String> {
    let faces = cage.topology().face_count();
    if faces > FEATURE_FACE_LIMIT {
        return Err(format!("{faces} faces; the limit is {FEATURE_FACE_LIMIT}"));
    }
    let mut loops = boundary_loops(cage.topology());
    match loops.len() {
        1 => Ok(loops.remove(0)),
        0 => Err("its cage is closed; it must have an open rim that meets the ground".into()),
        count => Err(format!(
            "its cage has {count} open rims; it must have one, which meets the ground"
        )),
    }
}

/// Where the vertices are: column and row in finest samples of the whole grid, and height in units.
fn place(input: &FeatureInput, site: &Site<'_>) -> Result<Vec<[f64; 3]>, String> {
    let frame = WorldFrame::new(site.grid, site.crs);
    let position = input.placement.position;
    let [row, column] = site.grid.row_column(position);
    let last = [site.grid.rows, site.grid.columns].map(|count| f64::from(count) - 1.0);
    if !((0.0..=last[0]).contains(&row) && (0.0..=last[1]).contains(&column)) {
        let extent = site.grid.extent();
        return Err(format!(
            "its position {position:?} is outside the terrain, which reaches from {:?} to {:?}",
            extent.min, extent.max
        ));
    }
    let base = match input.placement.height {
        Some(height) => height / site.unit,
        None => site.height(row, column),
    };
    let [east, north] = frame.to_world(position);
    let place = |&point: &[f64; 3]| {
        let [x, y, z] = input.placement.offset(point);
        let [row, column] = site.grid.row_column(frame.to_crs([east + x, north + y]));
        [column, row, base + z / site.unit]
    };
    Ok(input.cage.positions().iter().map(place).collect())
}

/// The cut around placed vertices.
fn cut(placed: &[[f64; 3]], site: &Site<'_>) -> Result<[u32; 4], String> {
    let mut cut = [0; 4];
    for (axis, count) in [site.grid.rows, site.grid.columns].into_iter().enumerate() {
        // Snapped as the rim will be, so that a rim on a lattice line counts as in both patches here and there.
        let along = placed
            .iter()
            .map(|place| (place[1 - axis] * PLAN_STEPS).round() / PLAN_STEPS / SIDE);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let last = i64::from(count.saturating_sub(1)) / QUAD_SAMPLES as i64;
        let outside = || {
            let (first, end) = (low * SIDE, high * SIDE);
            let what = if axis == 0 { "rows" } else { "columns" };
            format!(
                "it reaches over {what} {first:.1} to {end:.1} of the samples and, with the ground around it, past the \
                 data, which have {what} 0 to {}",
                count.saturating_sub(1)
            )
        };
        if !(low > -1e6 && high < 1e9) {
            return Err(outside());
        }
        let (mut first, mut end) = (
            whole(low.floor()) - MARGIN,
            whole(high.floor()) + 1 + MARGIN,
        );
        // A cut that ended on a tile's border would change a border vertex of a tile that has nothing of it.
        let quads = TILE_QUADS as i64;
        first -= i64::from(first.rem_euclid(quads) == 0);
        end += i64::from(end.rem_euclid(quads) == 0);
        if first < 1 || end > last {
            return Err(outside());
        }
        let fits = |x: i64| u32::try_from(x).map_err(|_| outside());
        (cut[axis], cut[axis + 2]) = (fits(first)?, fits(end)?);
    }
    let [rows, columns] = [0, 1].map(|axis| u64::from(cut[axis + 2] - cut[axis]));
    if rows * columns > CUT_PATCH_LIMIT {
        return Err(format!(
            "with the ground around it, it covers {rows} x {columns} patches of 4 x 4 samples; the limit is \
             {CUT_PATCH_LIMIT}"
        ));
    }
    Ok(cut)
}

#[expect(clippy::cast_possible_truncation, reason = "checked to be small")]
fn whole(x: f64) -> i64 {
    x as i64
}

/// Refuses rims with vertices over void samples: there is nothing to put them on.
fn check_ground(plan: &[Point], cut: [u32; 4], site: &Site<'_>) -> Result<(), String> {
    let [first_row, first_column] = [cut[0], cut[1]].map(|first| f64::from(first) * SIDE);
    let place = |&[x, y]: &Point| {
        [
            first_row - y as f64 / PLAN_STEPS,
            first_column + x as f64 / PLAN_STEPS,
        ]
    };
    let mut voids = plan
        .iter()
        .map(place)
        .filter(|&[row, column]| site.is_void(row, column));
    let Some([row, column]) = voids.next() else {
        return Ok(());
    };
    let [x, y] = site.grid.position(row, column);
    Err(format!(
        "there is no ground under {} of the {} vertices of its rim, first at coordinates {x}, {y}: samples are void there",
        1 + voids.count(),
        plan.len()
    ))
}

/// Puts the cage together.
fn laid(
    input: &FeatureInput,
    site: &Site<'_>,
    placed: Vec<[f64; 3]>,
    cut: [u32; 4],
    rim: &[u32],
) -> Result<LaidFeature, String> {
    let [row, column] = [cut[0], cut[1]].map(|first| f64::from(first) * SIDE);
    let relative: Vec<[f64; 3]> = placed
        .into_iter()
        .map(|[x, y, z]| [x - column, y - row, z])
        .collect();
    let plan: Vec<Point> = rim
        .iter()
        .map(|&vertex| snapped(relative[vertex as usize]))
        .collect();
    check_rim(&plan, rim)?;
    check_ground(&plan, cut, site)?;
    let mut layer = Layer::new(*site, cut);
    let region = Region::new(layer.size, &plan);
    layer.add_lattice(&region);
    let first = layer.add_authored(relative, rim, &plan);
    let rim: Vec<u32> = rim.iter().map(|vertex| first + vertex).collect();
    layer.add_zipper(&region.outline(), &plan, &rim)?;
    layer.add_authored_faces(&input.cage, first);
    layer.finish()
}

/// A cage while it is laid: vertices relative to the cut's north-west lattice point.
struct Layer<'a> {
    site: Site<'a>,
    cut: [u32; 4],
    /// Rows and columns of patches.
    size: [i64; 2],
    positions: Vec<[f64; 3]>,
    /// Ground under or over each vertex, in units; not of the ghost ring, which is outside the cut.
    ground: Vec<Option<f64>>,
    faces: Faces,
    tags: Tags,
    /// Vertex of each lattice point −1 … size + 1, row by row.
    lattice: Vec<Option<u32>>,
}

impl<'a> Layer<'a> {
    fn new(site: Site<'a>, cut: [u32; 4]) -> Self {
        let size = [0, 1].map(|axis| i64::from(cut[axis + 2] - cut[axis]));
        let points = usize::try_from((size[0] + 3) * (size[1] + 3)).unwrap_or(0);
        Self {
            site,
            cut,
            size,
            positions: Vec::new(),
            ground: Vec::new(),
            faces: Faces::default(),
            tags: Tags::default(),
            lattice: vec![None; points],
        }
    }

    /// The quads that stay lattice, and the ghost ring around the cut as holes.
    fn add_lattice(&mut self, region: &Region) {
        let [rows, columns] = self.size;
        for row in -1..=rows {
            for column in -1..=columns {
                if region.gives_way(row, column) {
                    continue;
                }
                // Counter-clockwise seen from above: north-west, south-west, south-east, north-east.
                let corners = [[0, 0], [1, 0], [1, 1], [0, 1]]
                    .map(|[down, right]| self.lattice_vertex([row + down, column + right]));
                let ghost = !(0..rows).contains(&row) || !(0..columns).contains(&column);
                if ghost {
                    self.tags.holes.push(self.faces.count());
                }
                self.faces.push(&corners);
            }
        }
    }

    fn slot(&self, [row, column]: [i64; 2]) -> usize {
        usize::try_from((row + 1) * (self.size[1] + 3) + column + 1).unwrap_or(usize::MAX)
    }

    /// The vertex of a lattice point, made where it is first asked for.
    fn lattice_vertex(&mut self, point: [i64; 2]) -> u32 {
        let slot = self.slot(point);
        if let Some(vertex) = self.lattice[slot] {
            return vertex;
        }
        let [row, column] = point;
        let [first_row, first_column] = [self.cut[0], self.cut[1]].map(i64::from);
        let control = self
            .site
            .ground
            .control(first_row + row, first_column + column);
        let [x, y] = [column, row].map(|at| at as f64 * SIDE);
        let inside = (0..=self.size[0]).contains(&row) && (0..=self.size[1]).contains(&column);
        let ground = inside.then(|| self.height([x, y]));
        let vertex = self.add([x, y, f64::from(control)], ground);
        self.lattice[slot] = Some(vertex);
        vertex
    }

    /// The ground at a place, in samples from the cut's north-west lattice point.
    fn height(&self, [x, y]: [f64; 2]) -> f64 {
        let [row, column] = [self.cut[0], self.cut[1]].map(|first| f64::from(first) * SIDE);
        self.site.height(row + y, column + x)
    }

    fn add(&mut self, position: [f64; 3], ground: Option<f64>) -> u32 {
        let vertex = u32::try_from(self.positions.len()).unwrap_or(u32::MAX);
        self.positions.push(position);
        self.ground.push(ground);
        vertex
    }

    /// The authored vertices, the rim's on the ground; the number of the first.
    fn add_authored(&mut self, mut relative: Vec<[f64; 3]>, rim: &[u32], plan: &[Point]) -> u32 {
        let first = u32::try_from(self.positions.len()).unwrap_or(u32::MAX);
        for (&vertex, &[x, y]) in rim.iter().zip(plan) {
            let place = [x as f64 / PLAN_STEPS, -(y as f64) / PLAN_STEPS];
            relative[vertex as usize] = [place[0], place[1], self.height(place)];
        }
        for place in relative {
            let ground = self.height([place[0], place[1]]);
            self.add(place, Some(ground));
        }
        first
    }

    /// The faces between the lattice's outline and the rim.
    fn add_zipper(
        &mut self,
        outline: &[[i64; 2]],
        plan: &[Point],
        rim: &[u32],
    ) -> Result<(), String> {
        let mut vertices = Vec::with_capacity(outline.len() + rim.len());
        let mut outer = Vec::with_capacity(outline.len());
        for &point in outline {
            let vertex = self.lattice_vertex(point);
            vertices.push(vertex);
            outer.push(snapped(self.positions[vertex as usize]));
        }
        vertices.extend(rim);
        for corners in zip(&outer, plan)? {
            let face: Vec<u32> = corners
                .iter()
                .map(|&corner| vertices[corner as usize])
                .collect();
            self.faces.push(&face);
        }
        Ok(())
    }

    /// The authored faces and tags.
    fn add_authored_faces(&mut self, cage: &Cage, first_vertex: u32) {
        let first_face = self.faces.count();
        let mut moved = Vec::new();
        for face in cage.topology().faces().iter() {
            moved.clear();
            moved.extend(face.iter().map(|vertex| first_vertex + vertex));
            self.faces.push(&moved);
        }
        let mut tags = cage.topology().tags();
        for crease in &mut tags.creases {
            crease.vertices = crease.vertices.map(|vertex| first_vertex + vertex);
        }
        for corner in &mut tags.corners {
            corner.vertex += first_vertex;
        }
        self.tags.creases = tags.creases;
        self.tags.corners = tags.corners;
        self.tags
            .holes
            .extend(tags.holes.iter().map(|face| first_face + face));
    }

    /// Measures, links and checks.
    fn finish(self) -> Result<LaidFeature, String> {
        let (mut error, mut range) = (0.0_f64, [f64::INFINITY, f64::NEG_INFINITY]);
        for (position, ground) in self.positions.iter().zip(&self.ground) {
            if let Some(ground) = ground {
                error = error.max((position[2] - ground).abs() * self.site.unit);
                range = [range[0].min(position[2]), range[1].max(position[2])];
            }
        }
        let limit = f64::from(CONTROL_LIMIT);
        if !range.iter().all(|z| z.abs() < limit) {
            let [low, high, limit] = [range[0], range[1], limit].map(|z| z * self.site.unit);
            return Err(format!(
                "it reaches from {low} to {high} m of height; with units of {} m heights are smaller than {limit} m",
                self.site.unit
            ));
        }
        let cage = Cage::new(self.positions, self.faces, &self.tags)
            .map_err(|error| format!("with the ground around it: {error}"))?;
        Ok(LaidFeature {
            cut: self.cut,
            cage,
            error,
            range,
        })
    }
}

/// A place, in samples east and south, as a point in plan.
#[expect(
    clippy::cast_possible_truncation,
    reason = "at most 2^18 samples, checked by the size of the cut"
)]
fn snapped([x, y, _]: [f64; 3]) -> Point {
    [x * PLAN_STEPS, -y * PLAN_STEPS].map(|x| x.round() as i64)
}

/// Refuses rims that cross themselves in plan or run clockwise.
fn check_rim(plan: &[Point], rim: &[u32]) -> Result<(), String> {
    if let Some([a, b]) = plan::crossing(plan) {
        return Err(format!(
            "seen from above its rim crosses or touches itself, where it leaves vertices {} and {} (counted from 0)",
            rim[a], rim[b]
        ));
    }
    if plan::area(plan) <= 0 {
        return Err(
            "its rim runs clockwise seen from above: its faces are turned downward; turn them over"
                .into(),
        );
    }
    Ok(())
}
