//! End-to-end tests, one binary.

mod commands;
mod flight;
mod layers;
mod support;
