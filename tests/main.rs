//! End-to-end tests, one binary.

mod gpu_parity;
mod layers;
