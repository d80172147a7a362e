//! The law of threads.

use super::broken::{Broken, Law};
use crate::error::Result;
use crate::geom::DVec3;
use crate::run::Run;

/// `job` gives the same result on 1, 2, 3 and 7 threads; its result must compare bits, not values.
pub fn check_threads<T: PartialEq>(name: &str, job: impl Fn(&Run<'_>) -> Result<T>) -> std::result::Result<(), Broken> {
    let broken = |found: String| Broken { law: Law::Threads, at: DVec3::NAN, found };
    let run =
        |threads: usize| job(&Run::with_threads(threads)).map_err(|error| broken(format!("{name} failed on {threads} threads: {error}")));
    let alone = run(1)?;
    for threads in [2, 3, 7] {
        if run(threads)? != alone {
            return Err(broken(format!("{name} gives another result on {threads} threads than on one")));
        }
    }
    Ok(())
}
