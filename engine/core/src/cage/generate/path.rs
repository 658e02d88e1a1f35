//! A path in plan, and places beside it.

use super::super::error::CageError;

/// The most stations along a path.
const STATION_LIMIT: f64 = 20_000.0;

/// A polyline in metres east and north, with a direction that turns smoothly along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    points: Vec<[f64; 2]>,
    /// Way to each point, metres.
    ways: Vec<f64>,
    /// Unit vector to the left at each point.
    normals: Vec<[f64; 2]>,
}

impl Path {
    /// A path through two points or more.
    ///
    /// # Errors
    /// [`CageError::Shape`] for fewer than two points, for one that is not finite or is where the one before is, and
    /// where the path turns back on itself.
    pub fn new(points: Vec<[f64; 2]>) -> Result<Self, CageError> {
        if points.len() < 2 {
            return Err(CageError::Shape(format!(
                "a path of {} points; it needs two",
                points.len()
            )));
        }
        let mut ways = vec![0.0];
        let mut sides = Vec::with_capacity(points.len());
        for (i, pair) in points.windows(2).enumerate() {
            let [dx, dy] = [0, 1].map(|axis| pair[1][axis] - pair[0][axis]);
            let length = f64::hypot(dx, dy);
            if !(length.is_finite() && length > 0.0) {
                return Err(CageError::Shape(format!(
                    "points {i} and {} of the path are {length} m apart",
                    i + 1
                )));
            }
            ways.push(ways[i] + length);
            sides.push([-dy / length, dx / length]);
        }
        let normals = normals(&sides)?;
        Ok(Self {
            points,
            ways,
            normals,
        })
    }

    /// Metres from end to end.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.ways.last().copied().unwrap_or(0.0)
    }

    /// The place a way along the path and a distance to its left; it goes on straight past both ends.
    #[must_use]
    pub fn place(&self, way: f64, left: f64) -> [f64; 2] {
        let last = self.points.len() - 1;
        let end = self.ways.partition_point(|&at| at <= way).clamp(1, last);
        let start = end - 1;
        let part = (way - self.ways[start]) / (self.ways[end] - self.ways[start]);
        let turned = part.clamp(0.0, 1.0);
        let mix = |a: f64, b: f64, part: f64| a + (b - a) * part;
        let normal =
            [0, 1].map(|axis| mix(self.normals[start][axis], self.normals[end][axis], turned));
        let size = normal[0].hypot(normal[1]).max(1e-9);
        [0, 1].map(|axis| {
            mix(self.points[start][axis], self.points[end][axis], part) + left * normal[axis] / size
        })
    }

    /// Ways along the path at equal distances of about `step`, its ends among them; at least `least` of them.
    ///
    /// # Errors
    /// [`CageError::Shape`] where there would be too many.
    pub fn stations(&self, step: f64, least: u32) -> Result<Vec<f64>, CageError> {
        let count = (self.length() / step).ceil().max(f64::from(least) - 1.0);
        if count.is_nan() || count > STATION_LIMIT {
            return Err(CageError::Shape(format!(
                "a path of {} m in steps of {step} m; {STATION_LIMIT} steps are the limit",
                self.length()
            )));
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked just above"
        )]
        let steps = count as u32;
        Ok((0..=steps)
            .map(|i| self.length() * f64::from(i) / count)
            .collect())
    }
}

/// The normal at every point: the mean of its two sides'.
fn normals(sides: &[[f64; 2]]) -> Result<Vec<[f64; 2]>, CageError> {
    let mut normals = Vec::with_capacity(sides.len() + 1);
    for i in 0..=sides.len() {
        let before = sides[i.saturating_sub(1)];
        let after = sides[i.min(sides.len() - 1)];
        let sum = [before[0] + after[0], before[1] + after[1]];
        let size = sum[0].hypot(sum[1]);
        if size < 0.2 {
            return Err(CageError::Shape(format!(
                "the path turns back on itself at point {i}"
            )));
        }
        normals.push(sum.map(|x| x / size));
    }
    Ok(normals)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_of_a_way_east_is_north_and_ends_go_on_straight() {
        let path = Path::new(vec![[0.0, 0.0], [10.0, 0.0]]).unwrap();
        assert_eq!(path.place(4.0, 1.0), [4.0, 1.0]);
        assert_eq!(path.place(-3.0, 0.0), [-3.0, 0.0]);
        assert_eq!(path.place(12.0, -1.0), [12.0, -1.0]);
        assert_eq!(path.stations(4.0, 2).unwrap().len(), 4);
    }

    #[test]
    fn paths_that_are_none_are_refused() {
        assert!(Path::new(vec![[0.0; 2]]).is_err());
        assert!(Path::new(vec![[0.0; 2]; 2]).is_err());
        assert!(Path::new(vec![[0.0; 2], [1.0, 0.0], [0.0, 0.0]]).is_err());
        assert!(Path::new(vec![[0.0; 2], [f64::NAN, 0.0]]).is_err());
    }
}
