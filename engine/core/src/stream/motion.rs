//! Where the camera will be: its velocity and its turn rate, measured from view to view.

use glam::{DQuat, DVec3};

use super::View;

/// The camera's motion, smoothed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    last: Option<View>,
    /// Metres a second.
    velocity: DVec3,
    /// Axis times radians a second.
    turn: DVec3,
}

impl Motion {
    /// The longest time between two views that still measures motion, seconds; after more, the camera was elsewhere.
    const LONGEST: f64 = 0.5;
    /// Weight of the newest measurement.
    const WEIGHT: f64 = 0.3;

    /// Takes note of a view.
    pub fn observe(&mut self, view: &View) {
        let Some(last) = self.last.replace(*view) else {
            return;
        };
        let elapsed = view.time - last.time;
        if !(elapsed > 0.0 && elapsed < Self::LONGEST) {
            (self.velocity, self.turn) = (DVec3::ZERO, DVec3::ZERO);
            return;
        }
        let velocity = (DVec3::from(view.eye) - DVec3::from(last.eye)) / elapsed;
        let (from, to) = (DVec3::from(last.forward), DVec3::from(view.forward));
        let turn = from.cross(to).normalize_or_zero() * from.angle_between(to) / elapsed;
        self.velocity += Self::WEIGHT * (velocity - self.velocity);
        self.turn += Self::WEIGHT * (turn - self.turn);
    }

    /// The view in `seconds`, if the camera goes on as it does; none when it rests.
    #[must_use]
    pub fn predict(&self, seconds: f64) -> Option<View> {
        let view = self.last?;
        if self.velocity.length() * seconds < 1e-3 && self.turn.length() * seconds < 1e-3 {
            return None;
        }
        let rotation = DQuat::from_scaled_axis(self.turn * seconds);
        let turned = |axis: [f64; 3]| (rotation * DVec3::from(axis)).into();
        Some(View {
            eye: (DVec3::from(view.eye) + self.velocity * seconds).into(),
            right: turned(view.right),
            up: turned(view.up),
            forward: turned(view.forward),
            ..view
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_flight_is_predicted() {
        let mut motion = Motion::default();
        let at = |time: f64| {
            let (sin, cos) = (0.2 * time).sin_cos();
            let eye = [10.0 * time, 0.0, 50.0];
            let view = View::looking_at(eye, [eye[0] + sin, cos, 50.0], 1.0, [64, 64]);
            View { time, ..view }
        };
        assert!(motion.predict(1.0).is_none());
        (0..100).for_each(|step| motion.observe(&at(f64::from(step) / 60.0)));
        let (predicted, wanted) = (motion.predict(1.0).unwrap(), at(99.0 / 60.0 + 1.0));
        assert!((DVec3::from(predicted.eye) - DVec3::from(wanted.eye)).length() < 1e-6);
        assert!((DVec3::from(predicted.forward) - DVec3::from(wanted.forward)).length() < 1e-6);
    }
}
