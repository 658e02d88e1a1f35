//! End-to-end tests, one binary.

mod commands;
mod embed;
mod features;
mod flight;
mod gpu_parity;
mod imagery;
mod layers;
mod shared_structs;
mod support;
mod terrain;
