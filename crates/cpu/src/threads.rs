//! The threads that share the work.

use backend::BackendError;

/// Threads of a back end's own. In browsers there is only the one that calls: what is made of it is the same.
pub(crate) struct Threads(#[cfg(not(target_family = "wasm"))] rayon::ThreadPool);

#[cfg(not(target_family = "wasm"))]
impl Threads {
    /// `threads` threads; `None` is one for each core.
    pub fn new(threads: Option<usize>) -> Result<Self, BackendError> {
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
        let pool = builder.thread_name(|i| format!("alhazen-{i}")).build();
        pool.map(Self).map_err(|e| BackendError::View { reason: format!("cannot start threads: {e}") })
    }

    /// Does some work on them, and waits for it.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.0.install(work)
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.current_num_threads()
    }
}

#[cfg(target_family = "wasm")]
impl Threads {
    /// However many are asked for, there is one.
    pub fn new(_threads: Option<usize>) -> Result<Self, BackendError> {
        Ok(Self())
    }

    /// Does some work. Rayon's own pool is the calling thread where others cannot be started.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        work()
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        1
    }
}
