//! The laws: generic checks that every source and every field must pass (feature `laws`).

mod random;

pub use random::Random;
