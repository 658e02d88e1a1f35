//! `drumlin-view view`: a window on a pyramid.
//!
//! Handles winit's events; the picture is made by [`Viewer`].

use std::sync::Arc;

use anyhow::{Context, Error, Result, anyhow};
use drumlin_terminal::outcome::Outcome;
use winit::{
    application::ApplicationHandler,
    dpi::PhysicalSize,
    event::{DeviceEvent, DeviceId, ElementState, MouseButton, MouseScrollDelta, WindowEvent},
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop},
    keyboard::{KeyCode, PhysicalKey},
    window::{Window, WindowId},
};

use crate::{
    arguments::{Size, ViewArguments},
    screen::Screen,
    viewer::Viewer,
};

/// Pixels of touchpad scrolling that count as one notch of a wheel.
const NOTCH_PX: f64 = 50.0;

pub(crate) fn run(arguments: ViewArguments) -> Result<Outcome> {
    let event_loop = EventLoop::new().map_err(|_| {
        anyhow!("no display to open a window on; `drumlin fly` makes pictures without one")
    })?;
    event_loop.set_control_flow(ControlFlow::Poll);
    let mut application = Application {
        arguments,
        viewer: None,
        error: None,
    };
    event_loop.run_app(&mut application)?;
    application.error.map_or(Ok(Outcome::Done), Err)
}

/// What winit calls.
struct Application {
    arguments: ViewArguments,
    viewer: Option<Viewer>,
    error: Option<Error>,
}

impl Application {
    fn open(&self, event_loop: &ActiveEventLoop) -> Result<Viewer> {
        let Size([width, height]) = self.arguments.terrain.size;
        let attributes = Window::default_attributes()
            .with_title("Drumlin")
            .with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop
            .create_window(attributes)
            .context("the window cannot be opened")?;
        let screen = Screen::new(Arc::new(window), event_loop.owned_display_handle())?;
        Viewer::new(screen, self.arguments.clone())
    }

    /// Does something with the viewer; an error ends the program.
    fn with(&mut self, event_loop: &ActiveEventLoop, act: impl FnOnce(&mut Viewer) -> Result<()>) {
        let Some(viewer) = &mut self.viewer else {
            return;
        };
        if let Err(error) = act(viewer) {
            self.error = Some(error);
        }
        if self.error.is_some() || viewer.is_done() {
            event_loop.exit();
        }
    }
}

impl ApplicationHandler for Application {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.viewer.is_some() {
            return;
        }
        match self.open(event_loop) {
            Ok(viewer) => self.viewer = Some(viewer),
            Err(error) => {
                self.error = Some(error);
                event_loop.exit();
            }
        }
    }

    fn window_event(
        &mut self,
        event_loop: &ActiveEventLoop,
        _window: WindowId,
        event: WindowEvent,
    ) {
        self.with(event_loop, |viewer| handle(viewer, event));
    }

    fn device_event(
        &mut self,
        event_loop: &ActiveEventLoop,
        _device: DeviceId,
        event: DeviceEvent,
    ) {
        if let DeviceEvent::MouseMotion { delta: (x, y) } = event {
            self.with(event_loop, |viewer| {
                viewer.mouse_moved([x, y]);
                Ok(())
            });
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        self.with(event_loop, |viewer| {
            viewer.window().request_redraw();
            Ok(())
        });
    }
}

fn handle(viewer: &mut Viewer, event: WindowEvent) -> Result<()> {
    match event {
        WindowEvent::CloseRequested => viewer.leave(),
        WindowEvent::Resized(size) => viewer.resize(size.width, size.height),
        WindowEvent::Focused(false) => viewer.release(),
        WindowEvent::MouseInput {
            state,
            button: MouseButton::Left | MouseButton::Right,
            ..
        } => {
            viewer.drag(state == ElementState::Pressed);
        }
        WindowEvent::MouseWheel { delta, .. } => viewer.wheel(match delta {
            MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
            MouseScrollDelta::PixelDelta(pixels) => pixels.y / NOTCH_PX,
        }),
        WindowEvent::KeyboardInput { event, .. } => {
            if let PhysicalKey::Code(key) = event.physical_key {
                let pressed = event.state == ElementState::Pressed;
                viewer.key(key, pressed, event.repeat);
            }
        }
        WindowEvent::RedrawRequested => return viewer.frame(),
        _ => {}
    }
    Ok(())
}

/// What a key that is no fly control does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Command {
    Leave,
    Play,
    Screenshot,
    Wireframe,
    DepthColors,
}

impl Command {
    pub(crate) const fn of(key: KeyCode) -> Option<Self> {
        Some(match key {
            KeyCode::Escape => Self::Leave,
            KeyCode::KeyP => Self::Play,
            KeyCode::F2 => Self::Screenshot,
            KeyCode::F3 => Self::Wireframe,
            KeyCode::F4 => Self::DepthColors,
            _ => return None,
        })
    }
}
