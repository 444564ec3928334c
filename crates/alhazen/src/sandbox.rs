//! A thread that can read some folders and nothing else, for scenes that nobody trusts.
//!
//! Loaders refuse files outside a scene's folder themselves, and are written without `unsafe`. The sandbox is for what they
//! may get wrong: the kernel lets the loading threads read the allowed folders only (Landlock), and neither write, nor open
//! connections, nor start programs (seccomp). Threads that render and write pictures are not restricted. All share one address
//! space, so this is no wall against code that has taken over the process.

use std::io::Write;
use std::path::PathBuf;

/// Runs `load` on threads of their own that can read `folders` only, and says on stderr which protections are active.
pub(crate) fn run<T: Send>(folders: &[PathBuf], load: impl FnOnce() -> T + Send) -> T {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let result = std::thread::scope(|scope| {
        let restricted = scope.spawn(|| {
            // Threads inherit what the one that starts them may do: the pool's are started from here.
            let active = protect(folders);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            // A closed stderr is no reason to fail.
            let _ = writeln!(std::io::stderr(), "sandbox: {active}");
            match pool {
                Ok(pool) => pool.install(load),
                Err(_) => load(),
            }
        });
        restricted.join()
    });
    result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

#[cfg(not(target_os = "linux"))]
fn protect(_: &[PathBuf]) -> String {
    "none on this system; loaders confine themselves".into()
}

#[cfg(target_os = "linux")]
fn protect(folders: &[PathBuf]) -> String {
    let files = match linux::restrict_files(folders) {
        Ok(landlock::RulesetStatus::FullyEnforced) => "files are confined by Landlock",
        Ok(landlock::RulesetStatus::PartiallyEnforced) => {
            "files are confined by Landlock as far as the kernel can"
        }
        Ok(landlock::RulesetStatus::NotEnforced) | Err(_) => "no Landlock",
    };
    let calls = match linux::restrict_calls() {
        Ok(()) => "network, programs and tracing are blocked by seccomp",
        Err(_) => "no seccomp",
    };
    format!("{files}; {calls}")
}

#[cfg(target_os = "linux")]
mod linux {
    use landlock::{
        ABI, Access, AccessFs, PathBeneath, PathFd, Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetError,
        RulesetStatus,
    };
    use seccompiler::{BpfProgram, SeccompAction, SeccompFilter};
    use std::path::PathBuf;

    /// Lets this thread and those that it starts read `folders`, and nothing else of the file system.
    pub fn restrict_files(folders: &[PathBuf]) -> Result<RulesetStatus, RulesetError> {
        // What older kernels do not know is left out by the crate.
        let abi = ABI::V5;
        let reading = AccessFs::ReadFile | AccessFs::ReadDir;
        let mut rules = Ruleset::default().handle_access(AccessFs::from_all(abi))?.create()?;
        for folder in folders.iter().filter_map(|folder| PathFd::new(folder).ok()) {
            rules = rules.add_rule(PathBeneath::new(folder, reading))?;
        }
        Ok(rules.restrict_self()?.ruleset)
    }

    /// Blocks system calls that loading has no use for, in this thread and those that it starts: they fail as not permitted.
    pub fn restrict_calls() -> Result<(), Box<dyn std::error::Error>> {
        let blocked = [
            libc::SYS_socket,
            libc::SYS_socketpair,
            libc::SYS_connect,
            libc::SYS_bind,
            libc::SYS_listen,
            libc::SYS_accept4,
            libc::SYS_sendto,
            libc::SYS_execve,
            libc::SYS_execveat,
            libc::SYS_ptrace,
            libc::SYS_process_vm_readv,
            libc::SYS_process_vm_writev,
            libc::SYS_kill,
            libc::SYS_mount,
            libc::SYS_bpf,
            libc::SYS_perf_event_open,
            libc::SYS_io_uring_setup,
        ];
        let refused = SeccompAction::Errno(libc::EPERM as u32);
        let rules = blocked.into_iter().map(|call| (call, Vec::new())).collect();
        let filter =
            SeccompFilter::new(rules, SeccompAction::Allow, refused, std::env::consts::ARCH.try_into()?)?;
        let program: BpfProgram = filter.try_into()?;
        seccompiler::apply_filter(&program)?;
        Ok(())
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn only_the_folders_are_read_where_the_kernel_confines() {
        let folder = tempfile::tempdir().expect("a folder");
        let other = tempfile::tempdir().expect("a folder");
        for place in [&folder, &other] {
            std::fs::write(place.path().join("x"), b"x").expect("a file");
        }
        let (status, inside, outside, pool) = run(&[folder.path().to_owned()], || {
            let status = std::fs::read_to_string("/proc/self/status").is_ok();
            let read = |place: &tempfile::TempDir| std::fs::read(place.path().join("x")).is_ok();
            let pool = rayon::join(|| read(&other), || std::net::UdpSocket::bind("127.0.0.1:0").is_ok());
            (status, read(&folder), read(&other), pool)
        });
        assert!(inside, "the allowed folder is read");
        // Old kernels and those in containers may have neither; /proc then stays readable.
        if !status {
            assert!(!outside && !pool.0);
        } else {
            eprintln!("skipped: the kernel has no Landlock");
        }
        assert!(std::fs::read(other.path().join("x")).is_ok(), "other threads are as free as before");
        assert!(std::net::UdpSocket::bind("127.0.0.1:0").is_ok());
        let _ = pool.1;
    }
}
