//! Fly controls: which keys are down and how the mouse moved become a new camera.
//!
//! W A S D along the view and across it, Q and E down and up, Shift four times as fast; dragging looks around; the
//! wheel changes the speed. Knows keys by winit's names, and no window.

use glam::DVec3;
use winit::keyboard::KeyCode;

use crate::camera::Camera;

/// Radians a pixel of dragging.
const LOOK: f64 = 0.003;
/// Almost straight up or down; beyond it, left and right would swap.
const STEEPEST: f64 = 1.55;
/// Speed a notch of the wheel.
const NOTCH: f64 = 1.25;
const HURRY: f64 = 4.0;

/// Keys held down, and the speed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Controls {
    speed: f64,
    range: [f64; 2],
    forward: [bool; 2],
    right: [bool; 2],
    up: [bool; 2],
    hurry: bool,
}

impl Controls {
    /// Controls for a data set of this size in metres.
    pub(crate) fn new(size: f64) -> Self {
        let size = size.max(1.0);
        let (forward, right, up) = ([false; 2], [false; 2], [false; 2]);
        Self {
            speed: 0.03 * size,
            range: [1e-5 * size, size],
            forward,
            right,
            up,
            hurry: false,
        }
    }

    /// A key goes down or up. False when it is none of ours.
    pub(crate) fn key(&mut self, key: KeyCode, down: bool) -> bool {
        match key {
            KeyCode::KeyW | KeyCode::ArrowUp => self.forward[0] = down,
            KeyCode::KeyS | KeyCode::ArrowDown => self.forward[1] = down,
            KeyCode::KeyD | KeyCode::ArrowRight => self.right[0] = down,
            KeyCode::KeyA | KeyCode::ArrowLeft => self.right[1] = down,
            KeyCode::KeyE => self.up[0] = down,
            KeyCode::KeyQ => self.up[1] = down,
            KeyCode::ShiftLeft | KeyCode::ShiftRight => self.hurry = down,
            _ => return false,
        }
        true
    }

    /// All keys up, as when the window loses the keyboard.
    pub(crate) fn release(&mut self) {
        (self.forward, self.right, self.up, self.hurry) =
            ([false; 2], [false; 2], [false; 2], false);
    }

    /// The wheel turned by notches, away from the user positive.
    pub(crate) fn wheel(&mut self, notches: f64) {
        self.speed = (self.speed * NOTCH.powf(notches)).clamp(self.range[0], self.range[1]);
    }

    /// The mouse was dragged by pixels, right and down positive.
    pub(crate) fn look(camera: &Camera, [x, y]: [f64; 2]) -> Camera {
        let [heading, pitch] = camera.angles();
        // A narrow view turns slower, so that what is dragged stays under the mouse.
        let scale = LOOK * camera.fov_y_degrees / 60.0;
        let pitch = (pitch - y * scale).clamp(-STEEPEST, STEEPEST);
        Camera::from_angles(
            camera.eye,
            [heading + x * scale, pitch],
            camera.fov_y_degrees,
        )
    }

    /// Some seconds later.
    pub(crate) fn step(&self, camera: &Camera, seconds: f64) -> Camera {
        let axis = |[plus, minus]: [bool; 2]| f64::from(i8::from(plus) - i8::from(minus));
        let way = camera.forward * axis(self.forward)
            + camera.right * axis(self.right)
            + DVec3::Z * axis(self.up);
        let hurry = if self.hurry { HURRY } else { 1.0 };
        Camera {
            eye: camera.eye + way * self.speed * hurry * seconds,
            ..*camera
        }
    }

    /// Metres a second.
    pub(crate) fn speed(&self) -> f64 {
        self.speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn north() -> Camera {
        Camera::look_at(DVec3::ZERO, DVec3::Y, 60.0)
    }

    #[test]
    fn keys_move_along_their_axes_and_opposite_keys_cancel() {
        let mut controls = Controls::new(1000.0);
        controls.key(KeyCode::KeyW, true);
        controls.key(KeyCode::KeyD, true);
        assert_eq!(
            controls.step(&north(), 2.0).eye,
            DVec3::new(60.0, 60.0, 0.0)
        );
        controls.key(KeyCode::KeyS, true);
        controls.key(KeyCode::KeyD, false);
        controls.key(KeyCode::KeyQ, true);
        assert_eq!(
            controls.step(&north(), 1.0).eye,
            DVec3::new(0.0, 0.0, -30.0)
        );
        controls.release();
        assert_eq!(controls.step(&north(), 1.0), north());
        assert!(!controls.key(KeyCode::KeyP, true));
    }

    #[test]
    fn dragging_right_looks_right_and_never_over_the_top() {
        let camera = Controls::look(&north(), [100.0, 0.0]);
        assert!(camera.forward.x > 0.0 && camera.forward.z.abs() < 1e-12);
        let camera = Controls::look(&north(), [0.0, -1e6]);
        assert!(camera.forward.z > 0.99 && camera.up.z > 0.0);
    }

    #[test]
    fn the_wheel_keeps_to_its_range() {
        let mut controls = Controls::new(1000.0);
        controls.wheel(1e4);
        assert_eq!(controls.speed(), 1000.0);
        controls.wheel(-1e4);
        assert_eq!(controls.speed(), 0.01);
    }
}
