//! End-to-end tests, one binary.

mod gpu_parity;
mod layers;
mod shared_structs;
mod terrain;
