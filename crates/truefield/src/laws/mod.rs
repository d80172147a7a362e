//! The laws: generic checks that every source and every field must pass (feature `laws`).
//!
//! A check asks many hard points ([`places`]), compares with a judge ([`BruteForce`], or any closure
//! that knows the truth) and returns the first [`Broken`] law, with the point that breaks it.

mod broken;
mod brute;
mod closest;
mod distance;
mod places;
mod random;
mod threads;

pub use broken::{Broken, Law};
pub use brute::BruteForce;
pub use closest::{Elements, check_closest, check_normal};
pub use distance::{check_distance, check_extent, check_lipschitz, check_many, check_range, check_truth};
pub use places::places;
pub use random::Random;
pub use threads::check_threads;
