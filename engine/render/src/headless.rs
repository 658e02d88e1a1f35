//! A device without a window, for tests, pictures and flights on servers.
//!
//! Applications bring a device of their own; nothing in [`Terrain`](crate::Terrain) needs this file.

use std::sync::{Arc, Mutex, PoisonError};

use crate::RenderError;

/// A device without a window, with WebGPU's default limits and timestamps where there are any.
#[derive(Debug)]
pub struct Headless {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// What drives it.
    pub adapter: wgpu::AdapterInfo,
    errors: Arc<Mutex<Vec<String>>>,
}

impl Headless {
    /// The first adapter that can carry a terrain.
    ///
    /// `WGPU_BACKEND` chooses the interface (`vulkan`, `gl`, `metal`, `dx12`); `STRICT_WEBGPU_COMPLIANCE` other than
    /// `0` hides all that the WebGPU specification does not have.
    ///
    /// # Errors
    ///
    /// [`RenderError::NoAdapter`] says what to install; [`RenderError::NoDevice`] what the driver said.
    pub fn new() -> Result<Self, RenderError> {
        pollster::block_on(Self::request())
    }

    async fn request() -> Result<Self, RenderError> {
        let adapter = wgpu::Instance::new(instance_descriptor())
            .request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                ..Default::default()
            })
            .await
            .map_err(|error| RenderError::NoAdapter(error.to_string()))?;
        let info = adapter.get_info();
        let (device, queue) = adapter
            .request_device(&device_descriptor(&adapter))
            .await
            .map_err(|error| RenderError::NoDevice {
                adapter: info.name.clone(),
                what: error.to_string(),
            })?;
        let errors = Arc::new(Mutex::new(Vec::new()));
        let sink = Arc::clone(&errors);
        device.on_uncaptured_error(Arc::new(move |error| {
            sink.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(error.to_string());
        }));
        Ok(Self {
            device,
            queue,
            adapter: info,
            errors,
        })
    }

    /// Takes what the device complained of and nobody caught; empty when all is well.
    ///
    /// Without this, wgpu would end the process at the first complaint, or stay silent in a browser.
    #[must_use]
    pub fn take_errors(&self) -> Vec<String> {
        std::mem::take(&mut self.errors.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Waits until the device has done all that was submitted, and fails if it complained.
    ///
    /// # Errors
    ///
    /// [`RenderError::Device`] with every complaint, one a line.
    pub fn finish(&self) -> Result<(), RenderError> {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| RenderError::Device(error.to_string()))?;
        match self.take_errors() {
            errors if errors.is_empty() => Ok(()),
            errors => Err(RenderError::Device(errors.join("\n"))),
        }
    }
}

/// What an instance is made from: the environment's wishes; compliance by either name of its variable.
#[must_use]
pub fn instance_descriptor() -> wgpu::InstanceDescriptor {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    if std::env::var("STRICT_WEBGPU_COMPLIANCE").is_ok_and(|value| value != "0") {
        descriptor.flags |= wgpu::InstanceFlags::STRICT_WEBGPU_COMPLIANCE;
    }
    descriptor
}

/// What a device for terrain asks of an adapter: WebGPU's default limits, and timestamps where there are any.
#[must_use]
pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    wgpu::DeviceDescriptor {
        label: Some("drumlin"),
        required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
        required_limits: wgpu::Limits::default(),
        ..Default::default()
    }
}

/// A device for a unit test; none, said aloud, where there is no adapter and the caller does not insist.
///
/// # Panics
///
/// Where `REQUIRE_GPU=1` and there is no adapter.
#[cfg(test)]
pub(crate) fn for_tests() -> Option<Headless> {
    match Headless::new() {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var("REQUIRE_GPU").is_ok_and(|value| value == "1") => {
            panic!("{error}")
        }
        Err(error) => {
            println!("skipped: {error}");
            None
        }
    }
}
