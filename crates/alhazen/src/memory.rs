//! How much memory the process has used, and how much it can still have.

use sysinfo::{MemoryRefreshKind, ProcessRefreshKind, ProcessesToUpdate, RefreshKind, System};

/// The largest resident set of this process so far, in bytes; `None` where the system does not tell.
pub fn peak_memory_bytes() -> Option<u64> {
    status_bytes("VmHWM:")
}

/// The resident set of this process in bytes; `None` where the system does not tell.
pub fn memory_bytes() -> Option<u64> {
    // One line of text, where there is one, instead of all that a process has.
    status_bytes("VmRSS:").or_else(|| {
        let process = sysinfo::get_current_pid().ok()?;
        let mut system = System::new().ok()?;
        let only_memory = ProcessRefreshKind::nothing().with_memory();
        system.refresh_processes_specifics(ProcessesToUpdate::Some(&[process]), true, only_memory);
        Some(system.process(process)?.memory())
    })
}

/// Memory of the machine, or of the container that the process runs in, in bytes; `None` where the system does not tell.
pub fn total_memory_bytes() -> Option<u64> {
    let system = memory_of_system()?;
    let container = system.cgroup_limits().map(|limits| limits.total_memory);
    [Some(system.total_memory()), container].into_iter().flatten().filter(|bytes| *bytes > 0).min()
}

/// Memory that the process can still have without swapping, in bytes; `None` where the system does not tell. The least of what
/// the machine has free, what is left of the container's share, and what is left of the process's address space
/// (`ulimit -v`).
pub fn available_memory_bytes() -> Option<u64> {
    let system = memory_of_system();
    let machine = system.as_ref().filter(|s| s.total_memory() > 0).map(System::available_memory);
    let container = system.as_ref().and_then(System::cgroup_limits).map(|limits| limits.free_memory);
    [machine, container, address_space_left()].into_iter().flatten().min()
}

/// Files, sockets and devices that this process has open; `None` where the system does not tell.
pub fn open_files() -> Option<usize> {
    // The folder itself is open while it is listed.
    Some(std::fs::read_dir("/proc/self/fd").ok()?.count().saturating_sub(1))
}

fn memory_of_system() -> Option<System> {
    let only_memory = RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram());
    System::new_with_specifics(only_memory).ok()
}

/// `None` where there is no limit.
fn address_space_left() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|l| l.strip_prefix("Max address space"))?;
    let limit: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(limit.saturating_sub(status_bytes("VmSize:")?))
}

/// What of the address space is the process's own and can be written: what a limit of its data counts.
pub(crate) fn private_bytes() -> Option<u64> {
    status_bytes("VmData:")
}

fn status_bytes(key: &str) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix(key))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_in_order() {
        let (total, available) = (total_memory_bytes(), available_memory_bytes());
        let (now, peak) = (memory_bytes(), peak_memory_bytes());
        // Every system that tests run on tells.
        assert!(
            total > Some(1 << 28) && available > Some(1 << 20) && available <= total,
            "{available:?} of {total:?}"
        );
        assert!(now > Some(1 << 20) && now < total, "{now:?} of {total:?}");
        assert!(peak.is_none() || peak >= now, "{peak:?} {now:?}");
    }

    /// What a limit of the address space leaves is what a scene may take.
    #[test]
    #[cfg(target_os = "linux")]
    fn limits_of_the_process_count() {
        if std::env::var_os("ALHAZEN_LIMITED").is_some() {
            println!("available: {}", available_memory_bytes().expect("Linux tells"));
            return;
        }
        let program = std::env::current_exe().expect("this program");
        let output = std::process::Command::new("sh")
            .args(["-c", "ulimit -v 1000000; exec \"$0\" \"$@\""])
            .arg(program)
            .args([
                "--exact",
                "memory::tests::limits_of_the_process_count",
                "--nocapture",
                "--test-threads=1",
            ])
            .env("ALHAZEN_LIMITED", "1")
            .output()
            .expect("a shell");
        let text = String::from_utf8_lossy(&output.stdout);
        let bytes = text.split_once("available: ").and_then(|(_, rest)| rest.split_whitespace().next());
        let bytes: u64 = bytes.and_then(|b| b.parse().ok()).expect("a number of bytes");
        assert!(bytes > 100 << 20 && bytes < 1_024_000_000, "{bytes} of a limit of 1,024,000,000");
    }
}
