//! Meshes and judges for tests that try to break things.
#![allow(dead_code, reason = "every test file uses its own part")]

pub mod judge;
