//! The one door between Python and the core: frees the interpreter lock, hears Ctrl-C, reports progress, maps errors.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;
use truefield::{Cancel, Error, Progress, Run};

mod python {
    pyo3::import_exception!(truefield.errors, TruefieldError);
}

/// How often Ctrl-C is looked for and progress is reported.
const TICK: Duration = Duration::from_millis(50);

/// The Python exception of a core error.
pub fn raise(error: Error) -> PyErr {
    match error {
        Error::Cancelled => PyKeyboardInterrupt::new_err("cancelled"),
        Error::Memory { .. } => PyMemoryError::new_err(error.to_string()),
        Error::Invalid(_) | Error::Format(_) => {
            let sentence = error.to_string();
            // What a function of the user raised is the cause of what is raised now.
            Python::attach(|py| {
                let cause = crate::implicit::cause(py, &sentence);
                let raised = python::TruefieldError::new_err(sentence);
                raised.set_cause(py, cause);
                raised
            })
        }
    }
}

/// How many threads a job may use.
#[derive(Clone, Copy, Debug)]
pub struct Threads(usize);

impl Threads {
    pub const ONE: Self = Self(1);
}

impl<'py> FromPyObject<'_, 'py> for Threads {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        match given.extract() {
            Ok(count) if count > 0 => Ok(Self(count)),
            _ => {
                let said = given.repr()?;
                Err(python::TruefieldError::new_err(format!("threads is {said}; give a whole number of at least 1, or None for all cores")))
            }
        }
    }
}

/// The latest report of a job.
struct Latest(Mutex<Option<(&'static str, usize, usize)>>);

impl Progress for Latest {
    fn report(&self, phase: &'static str, done: usize, total: usize) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some((phase, done, total));
    }
}

/// Runs `work` off the interpreter's lock, on `threads` threads (all cores when `None`).
///
/// `progress` is called as `progress(phase, fraction)`; an exception it raises, like Ctrl-C, ends the job.
pub fn job<T: Send>(
    py: Python<'_>,
    threads: Option<Threads>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Run<'_>) -> truefield::Result<T> + Send,
) -> PyResult<T> {
    let progress = progress.filter(|p| !p.is_none()).map(|p| p.clone().unbind());
    let (cancel, latest) = (Cancel::new(), Latest(Mutex::new(None)));
    let run = Run { threads: threads.map_or(Run::default().threads, |Threads(count)| count), cancel: &cancel, progress: &latest };
    let mut interrupted: PyResult<()> = Ok(());
    let result = py.detach(|| {
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            let worker = scope.spawn(move || {
                let result = work(&run);
                // The receiver only goes once it has heard.
                let _heard = sender.send(());
                result
            });
            loop {
                match receiver.recv_timeout(TICK) {
                    Ok(()) | Err(RecvTimeoutError::Disconnected) => break,
                    Err(RecvTimeoutError::Timeout) if interrupted.is_err() => {}
                    Err(RecvTimeoutError::Timeout) => {
                        interrupted = Python::attach(|py| tick(py, progress.as_ref(), &latest));
                        if interrupted.is_err() {
                            cancel.cancel();
                        }
                    }
                }
            }
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    });
    interrupted?;
    result.map_err(raise)
}

/// Looks for signals and hands on the latest report.
fn tick(py: Python<'_>, progress: Option<&Py<PyAny>>, latest: &Latest) -> PyResult<()> {
    py.check_signals()?;
    let report = latest.0.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let (Some(progress), Some((phase, done, total))) = (progress, report) {
        progress.call1(py, (phase, done as f64 / total.max(1) as f64))?;
    }
    Ok(())
}
