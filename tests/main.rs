//! End-to-end tests, one binary.

mod commands;
mod embed;
mod features;
mod flight;
mod golden;
mod gpu_parity;
mod imagery;
mod layers;
mod picture;
mod shared_structs;
mod support;
mod terrain;
