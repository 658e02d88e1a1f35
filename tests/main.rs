//! End-to-end tests, one binary.

mod commands;
mod layers;
mod support;
