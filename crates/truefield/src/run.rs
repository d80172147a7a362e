//! Threads, cancellation and progress in one handle that every long job is given.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use crate::error::{Error, Result};

/// A flag that asks a running job to stop; jobs look at it between blocks of a few milliseconds.
#[derive(Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// A flag that is not set.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the job to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// [`Error::Cancelled`] once [`Cancel::cancel`] was called.
    pub fn check(&self) -> Result<()> {
        if self.0.load(Ordering::Relaxed) { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Hears how far a job is. Called from worker threads; must be quick.
pub trait Progress: Sync {
    /// `phase` is at `done` of `total` steps.
    fn report(&self, phase: &'static str, done: usize, total: usize);
}

/// Progress that nobody listens to.
#[derive(Debug)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _: &'static str, _: usize, _: usize) {}
}

static NEVER: LazyLock<Cancel> = LazyLock::new(Cancel::new);

thread_local! {
    /// The flag of the job that this thread works for.
    static HEARD: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// Whether the job that this thread works for was asked to stop: for work that takes long and is handed no [`Run`].
pub(crate) fn is_cancelled() -> bool {
    HEARD.with_borrow(|flag| flag.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)))
}

/// Hears a job's flag on this thread for as long as it lives; a job that nobody can cancel leaves the flag of the one around it.
struct Hearing(Option<Arc<AtomicBool>>);

impl Hearing {
    fn of(cancel: &Cancel) -> Self {
        let inner = if Arc::ptr_eq(&cancel.0, &NEVER.0) { HEARD.with_borrow(Clone::clone) } else { Some(Arc::clone(&cancel.0)) };
        Self(HEARD.replace(inner))
    }
}

impl Drop for Hearing {
    fn drop(&mut self) {
        HEARD.set(self.0.take());
    }
}

/// How a long job runs. The results never depend on `threads`.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// Number of worker threads, at least 1.
    pub threads: usize,
    /// Looked at between blocks.
    pub cancel: &'a Cancel,
    /// Told after every block.
    pub progress: &'a dyn Progress,
}

impl Default for Run<'_> {
    fn default() -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Self { threads, cancel: &NEVER, progress: &Silent }
    }
}

impl Run<'_> {
    /// A silent run on `threads` threads that nobody can cancel.
    pub fn with_threads(threads: usize) -> Self {
        Self { threads: threads.max(1), ..Self::default() }
    }

    /// Runs `work(0) .. work(count - 1)` on all threads and returns the results in index order.
    ///
    /// Blocks are handed out one by one, so uneven blocks balance; the first error, or a
    /// cancellation, ends the job.
    pub fn blocks<T: Send>(&self, phase: &'static str, count: usize, work: impl Fn(usize) -> Result<T> + Sync) -> Result<Vec<T>> {
        let next = AtomicUsize::new(0);
        let done = AtomicUsize::new(0);
        let failure: Mutex<Option<Error>> = Mutex::new(None);
        let failed = AtomicBool::new(false);
        let worker = || {
            let _hearing = Hearing::of(self.cancel);
            let mut mine: Vec<(usize, T)> = Vec::new();
            while !failed.load(Ordering::Relaxed) {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= count {
                    break;
                }
                match self.cancel.check().and_then(|()| work(index)) {
                    Ok(value) => mine.push((index, value)),
                    Err(error) => {
                        // What was cut short may fail in any way.
                        let error = self.cancel.check().err().unwrap_or(error);
                        failed.store(true, Ordering::Relaxed);
                        failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                        break;
                    }
                }
                self.progress.report(phase, done.fetch_add(1, Ordering::Relaxed) + 1, count);
            }
            mine
        };
        let threads = self.threads.clamp(1, count.max(1));
        let mut slots: Vec<Option<T>> = Vec::new();
        slots.resize_with(count, || None);
        if threads == 1 {
            for (index, value) in worker() {
                slots[index] = Some(value);
            }
        } else {
            std::thread::scope(|scope| {
                let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
                for handle in workers {
                    match handle.join() {
                        Ok(mine) => {
                            for (index, value) in mine {
                                slots[index] = Some(value);
                            }
                        }
                        Err(panic) => std::panic::resume_unwind(panic),
                    }
                }
            });
        }
        if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error);
        }
        Ok(slots.into_iter().flatten().collect())
    }

    /// Runs two jobs side by side where there are threads for it; an error of the first comes before one of the second.
    pub fn both<A: Send, B: Send>(&self, first: impl FnOnce() -> Result<A>, second: impl FnOnce() -> Result<B> + Send) -> Result<(A, B)> {
        if self.threads <= 1 {
            return Ok((first()?, second()?));
        }
        std::thread::scope(|scope| {
            let second = scope.spawn(second);
            let first = first();
            let second = second.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            Ok((first?, second?))
        })
    }

    /// Runs `work(index, chunk)` over disjoint chunks of `length` items of `data`, in parallel.
    pub fn chunks<T: Send>(
        &self,
        phase: &'static str,
        data: &mut [T],
        length: usize,
        work: impl Fn(usize, &mut [T]) -> Result<()> + Sync,
    ) -> Result<()> {
        let parts: Vec<Mutex<&mut [T]>> = data.chunks_mut(length.max(1)).map(Mutex::new).collect();
        self.blocks(phase, parts.len(), |index| {
            let mut part = parts[index].lock().unwrap_or_else(PoisonError::into_inner);
            work(index, &mut part)
        })?;
        Ok(())
    }
}
