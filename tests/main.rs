//! End-to-end tests, one binary.

mod browser;
mod builds;
mod cages;
mod commands;
mod embed;
mod export;
mod faults;
mod features;
mod flight;
mod golden;
mod gpu_parity;
mod imagery;
mod layers;
mod pack;
mod picture;
mod refine;
mod serve;
mod shared_structs;
mod support;
mod synth;
mod terrain;
