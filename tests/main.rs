//! End-to-end tests, one binary.

mod cages;
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
