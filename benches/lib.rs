//! The experiments behind every published figure.
