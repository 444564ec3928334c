//! A limit of memory that the system itself enforces, where it can.

/// A limit of the memory of this process, until it is dropped.
///
/// Loaders count what scenes will take before they take it; the limit is for what they count too low. Where it is reached,
/// allocations fail. Linux only: elsewhere there is no limit.
#[derive(Debug)]
pub struct MemoryLimit {
    /// Bytes that can be written to and are the process's own.
    #[cfg(target_os = "linux")]
    bytes: u64,
    /// What was allowed before; `None` while the limit does not count.
    #[cfg(target_os = "linux")]
    before: Option<rustix::process::Rlimit>,
}

#[cfg(not(target_os = "linux"))]
impl MemoryLimit {
    /// No limit.
    pub fn new(_bytes: u64) -> Self {
        Self {}
    }

    /// Nothing changes.
    pub fn pause(&mut self) {}

    /// Nothing changes.
    pub fn resume(&mut self, _more: u64) {}
}

/// Above the limit: what allocators keep, and stacks of threads.
#[cfg(target_os = "linux")]
const SLACK: u64 = 96 << 20;
#[cfg(target_os = "linux")]
const STACK: u64 = 2 << 20;

#[cfg(target_os = "linux")]
impl MemoryLimit {
    /// From now on the process may take `bytes` more than it has, give or take 5 % and 96 MiB, and a stack for each processor.
    pub fn new(bytes: u64) -> Self {
        let stacks = STACK * crate::system::default_threads() as u64;
        let held = crate::memory::private_bytes().unwrap_or(0);
        let bytes = held.saturating_add(bytes).saturating_add(bytes / 20).saturating_add(SLACK + stacks);
        let mut limit = Self { bytes, before: None };
        limit.resume(0);
        limit
    }

    /// The limit does not count until it is resumed: drivers of GPUs take what they want.
    pub fn pause(&mut self) {
        if let Some(before) = self.before.take() {
            // A limit may always be raised to what it may be at most.
            let _ = rustix::process::setrlimit(rustix::process::Resource::Data, before);
        }
    }

    /// The limit counts again, and is `more` bytes higher.
    pub fn resume(&mut self, more: u64) {
        use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
        self.pause();
        self.bytes = self.bytes.saturating_add(more);
        let before = getrlimit(Resource::Data);
        let allowed = before.current.into_iter().chain(before.maximum).min();
        let current = Some(allowed.map_or(self.bytes, |allowed| allowed.min(self.bytes)));
        // Where the system refuses, the loaders' count is all there is.
        let is_set = setrlimit(Resource::Data, Rlimit { current, maximum: before.maximum }).is_ok();
        self.before = is_set.then_some(before);
    }
}

#[cfg(target_os = "linux")]
impl Drop for MemoryLimit {
    fn drop(&mut self) {
        self.pause();
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    fn limit_now() -> Option<u64> {
        rustix::process::getrlimit(rustix::process::Resource::Data).current
    }

    /// So high that no other test notices it.
    #[test]
    fn limits_end() {
        let before = limit_now();
        let mut limit = MemoryLimit::new(1 << 40);
        let during = limit_now();
        assert!(during.is_some_and(|bytes| bytes > 1 << 40), "{during:?}");
        limit.pause();
        assert_eq!(limit_now(), before);
        limit.resume(1 << 30);
        assert_eq!(limit_now(), during.map(|bytes| bytes + (1 << 30)));
        drop(limit);
        assert_eq!(limit_now(), before);
    }
}
