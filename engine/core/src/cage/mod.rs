//! See the module's plan in ARCHITECTURE.md.
