//! End-to-end tests, one binary.

mod layers;
mod shared_structs;
