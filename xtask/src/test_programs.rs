//! Test programs, side by side: cargo builds them all, then each processor core has one to run.
//!
//! Cargo runs test programs one after the other. Many of them wait: for a shader that the driver compiles on one core, for a
//! window, for a process that they interrupt. Two at a time keep the cores busy.

use crate::shell::{cargo, output};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// How many programs run at a time; each has its share of the cores for threads of its own.
const LANES: usize = 2;

/// Programs that take longest, the longest first. They start first, so that the others fill the time beside them.
const LONGEST: [&str; 6] =
    ["alhazen gpu", "gpu lib", "alhazen wavefront", "cli outputs", "cli view", "alhazen update"];

/// A test program that cargo built.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    /// Package and target, `accel oracle`; that of a library is called `lib`.
    pub name: String,
    executable: PathBuf,
    /// The folder of its package, in which it runs.
    folder: PathBuf,
}

/// What a program said and how long it took.
#[derive(Debug)]
pub struct Finished {
    /// See [`Program::name`].
    pub name: String,
    /// Whether it ended well.
    pub passed: bool,
    /// From its start to its end.
    pub elapsed: Duration,
    /// What processor cores worked for it and for programs that it ran, all together. `None` where nobody counts that.
    pub worked: Option<Duration>,
    /// Lines of its standard output.
    pub stdout: Vec<String>,
    /// Lines of its error output.
    pub stderr: Vec<String>,
    /// Names of tests and how long each took. Empty where several run at a time: then nobody knows.
    pub tests: Vec<(String, Duration)>,
}

/// Builds all test programs of the workspace, the longest-running ones first.
///
/// # Errors
/// Whatever cargo says.
pub fn build() -> anyhow::Result<Vec<Program>> {
    let mut command = cargo(&["test", "--workspace", "--no-run", "--message-format=json-render-diagnostics"]);
    command.stdout(Stdio::piped());
    let mut child = command.spawn().context("cannot run cargo test")?;
    let messages = BufReader::new(child.stdout.take().context("cargo has no output")?);
    let mut programs = Vec::new();
    for line in messages.lines() {
        let message: Value = serde_json::from_str(&line?).context("cargo's messages")?;
        programs.extend(program(&message));
    }
    ensure!(child.wait()?.success(), "the tests do not compile");
    ensure!(!programs.is_empty(), "cargo built no test program");
    programs.sort_by_key(|p| LONGEST.iter().position(|name| *name == p.name).unwrap_or(LONGEST.len()));
    Ok(programs)
}

/// The test program that a message of cargo is about.
fn program(message: &Value) -> Option<Program> {
    let is_test = message["reason"] == "compiler-artifact" && message["profile"]["test"] == true;
    let executable = message["executable"].as_str().filter(|_| is_test)?;
    let folder = Path::new(message["manifest_path"].as_str()?).parent()?;
    let (package, target) = (folder.file_name()?.to_str()?, &message["target"]);
    let name = match target["kind"][0].as_str()? {
        "lib" | "proc-macro" | "cdylib" | "rlib" => "lib",
        _ => target["name"].as_str()?,
    };
    Some(Program {
        name: format!("{package} {name}"),
        executable: executable.into(),
        folder: folder.to_owned(),
    })
}

/// Runs all programs in an environment with `variables` in addition. `after`: called with each that ended, in that order.
///
/// # Errors
/// A program that cannot be run. Tests that fail are no error: see [`Finished::passed`].
pub fn run(
    programs: Vec<Program>,
    variables: &[(String, String)],
    after: impl FnMut(&Finished) + Send,
) -> anyhow::Result<Vec<Finished>> {
    let mut variables = variables.to_vec();
    crate::test::merge(&mut variables, vec![("LD_LIBRARY_PATH".into(), libraries()?)]);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = cores.div_ceil(LANES);
    let queue = Mutex::new(VecDeque::from(programs));
    let done = Mutex::new((Vec::new(), after));
    let lane = || -> anyhow::Result<()> {
        loop {
            let next = queue.lock().map_err(|_| anyhow::anyhow!("a lane panicked"))?.pop_front();
            let Some(program) = next else { return Ok(()) };
            eprintln!("     Running {}", program.name);
            let finished = program.run(threads, &variables)?;
            let mut done = done.lock().map_err(|_| anyhow::anyhow!("a lane panicked"))?;
            (done.1)(&finished);
            done.0.push(finished);
        }
    };
    std::thread::scope(|scope| {
        let lanes: Vec<_> = (0..LANES.min(cores)).map(|_| scope.spawn(lane)).collect();
        lanes.into_iter().try_for_each(|lane| match lane.join() {
            Ok(result) => result,
            Err(_) => anyhow::bail!("a lane panicked"),
        })
    })?;
    let done = done.into_inner().map_err(|_| anyhow::anyhow!("a lane panicked"))?;
    Ok(done.0)
}

/// Where the standard library's shared objects lie: tests of procedural macros are linked to the compiler's.
fn libraries() -> anyhow::Result<String> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let own = output(Command::new(rustc).args(["--print", "target-libdir"]))?;
    let present = std::env::var("LD_LIBRARY_PATH").map(|paths| format!(":{paths}")).unwrap_or_default();
    Ok(format!("{}{present}", own.trim()))
}

impl Program {
    fn run(&self, threads: usize, variables: &[(String, String)]) -> anyhow::Result<Finished> {
        let start = Instant::now();
        let mut command = Command::new(&self.executable);
        command
            .current_dir(&self.folder)
            .env("CARGO_MANIFEST_DIR", &self.folder)
            .env("RUST_TEST_THREADS", threads.to_string())
            .envs(variables.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let cannot = || format!("cannot run {}", self.executable.display());
        let mut child = command.spawn().with_context(cannot)?;
        let stdout = child.stdout.take().context("a program has no output")?;
        let stderr = child.stderr.take().context("a program has no error output")?;
        let errors = std::thread::spawn(move || lines(stderr));
        let mut tests = Vec::new();
        let mut last = Instant::now();
        let mut said = Vec::new();
        for line in BufReader::new(stdout).split(b'\n') {
            let line = String::from_utf8_lossy(&line?).into_owned();
            if let Some(test) = ended_test(&line).filter(|_| threads == 1) {
                tests.push((test.to_owned(), last.elapsed()));
                last = Instant::now();
            }
            said.push(line);
        }
        let stderr = errors.join().map_err(|_| anyhow::anyhow!("cannot read the tests' errors"))?;
        // It has closed its output, so it has done its work; once it is waited for, nothing is known of it.
        let worked = work_of(child.id());
        let passed = child.wait()?.success();
        let name = self.name.clone();
        Ok(Finished { name, passed, elapsed: start.elapsed(), worked, stdout: said, stderr, tests })
    }
}

/// What processor cores have worked for a process and for those of its children that have ended.
fn work_of(process: u32) -> Option<Duration> {
    work_in(&std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?)
}

/// The same, from what Linux says of a process: `utime`, `stime`, `cutime` and `cstime`, the 14th to 17th field (proc(5)), in
/// hundredths of a second.
fn work_in(stat: &str) -> Option<Duration> {
    // The second field, a name in brackets, may hold spaces.
    let (_, fields) = stat.rsplit_once(')')?;
    let times = fields.split_whitespace().skip(11).take(4).map(str::parse);
    let times = times.collect::<Result<Vec<u64>, _>>().ok().filter(|times| times.len() == 4)?;
    Some(Duration::from_millis(10 * times.iter().sum::<u64>()))
}

fn lines(from: impl std::io::Read) -> Vec<String> {
    let lines = BufReader::new(from).split(b'\n').map_while(Result::ok);
    lines.map(|line| String::from_utf8_lossy(&line).into_owned()).collect()
}

/// The test that a line such as `test a::b ... ok` says has ended.
fn ended_test(line: &str) -> Option<&str> {
    let (name, _) = line.strip_prefix("test ")?.split_once(" ... ")?;
    Some(name)
}

/// A table of the programs and the tests that took longest, in seconds. Of programs also what cores worked for them: on a machine
/// that does other things, too, that says more.
pub fn slowest(finished: &[Finished], count: usize) -> String {
    let title = |f: &Finished| match f.worked {
        Some(worked) => format!("{} ({:.1} s of work)", f.name, worked.as_secs_f64()),
        None => f.name.clone(),
    };
    let mut programs: Vec<(String, Duration)> = finished.iter().map(|f| (title(f), f.elapsed)).collect();
    let of = |f: &Finished| f.tests.iter().map(|(t, d)| (format!("{} {t}", f.name), *d)).collect::<Vec<_>>();
    let mut tests: Vec<(String, Duration)> = finished.iter().flat_map(of).collect();
    let mut text = String::new();
    for (what, list) in [("programs", &mut programs), ("tests", &mut tests)] {
        list.sort_by_key(|(_, elapsed)| std::cmp::Reverse(*elapsed));
        if !list.is_empty() {
            text += &format!("{what} that took longest:\n");
        }
        for (name, elapsed) in list.iter().take(count) {
            text += &format!("{:8.1} s  {name}\n", elapsed.as_secs_f64());
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn message(kind: &str, is_test: bool, executable: Value) -> Value {
        json!({
            "reason": "compiler-artifact", "manifest_path": "/a/crates/accel/Cargo.toml",
            "target": { "kind": [kind], "name": "oracle" },
            "profile": { "test": is_test }, "executable": executable,
        })
    }

    #[test]
    fn test_programs_are_told_from_what_else_is_built() {
        let found = program(&message("test", true, json!("/t/oracle-1"))).expect("a test");
        assert_eq!(
            (found.name.as_str(), found.folder.as_path()),
            ("accel oracle", Path::new("/a/crates/accel"))
        );
        assert_eq!(program(&message("lib", true, json!("/t/accel-1"))).expect("a test").name, "accel lib");
        assert_eq!(program(&message("bin", false, json!("/t/alhazen"))), None);
        assert_eq!(program(&message("lib", true, Value::Null)), None);
        assert_eq!(program(&json!({ "reason": "build-finished" })), None);
    }

    #[test]
    fn names_of_long_programs_are_those_of_packages() {
        let root = crate::shell::root();
        for name in LONGEST {
            let (package, target) = name.split_once(' ').expect("package and target");
            let file = if target == "lib" { "src/lib.rs".into() } else { format!("tests/{target}.rs") };
            assert!(root.join("crates").join(package).join(&file).is_file(), "{name}");
        }
    }

    /// A program that prints like the harness.
    fn shell(name: &str, script: &str) -> Program {
        let folder = std::env::temp_dir();
        let file = folder.join(format!("alhazen-xtask-{}-{name}", std::process::id()));
        std::fs::write(&file, format!("#!/bin/sh\n{script}\n")).expect("written");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::Permissions::from_mode(0o755);
            std::fs::set_permissions(&file, mode).expect("executable");
        }
        Program { name: name.into(), executable: file, folder }
    }

    #[cfg(unix)]
    #[test]
    fn all_programs_run_and_say_what_they_said() {
        let good = shell("good", "echo 'test a::b ... ok'; echo 'skipped: x' >&2");
        let bad = shell("bad", "echo 'test c ... FAILED'; exit 101");
        let files = [good.executable.clone(), bad.executable.clone()];
        let mut ended = 0;
        let mut finished = run(vec![good, bad], &[], |_| ended += 1).expect("they run");
        files.into_iter().for_each(|file| std::fs::remove_file(file).expect("removed"));
        finished.sort_by_key(|f| f.name.clone());
        let [bad, good] = &finished[..] else { panic!("two: {finished:?}") };
        assert!(good.passed && !bad.passed && ended == 2);
        assert_eq!((good.stdout[0].as_str(), good.stderr[0].as_str()), ("test a::b ... ok", "skipped: x"));
    }

    #[test]
    fn work_is_read_from_what_linux_says() {
        let stat = "7 (a (b) c) S 1 2 3 4 5 6 7 8 9 10 150 25 1000 3 20 0";
        assert_eq!(work_in(stat), Some(Duration::from_millis(11_780)));
        assert_eq!(work_in("7 (a) S 1 2"), None);
        if cfg!(target_os = "linux") {
            assert!(work_of(std::process::id()).is_some());
        }
    }

    #[test]
    fn the_slowest_come_first() {
        let one = |name: &str, seconds, tests: &[(&str, u64)]| Finished {
            name: name.into(),
            passed: true,
            elapsed: Duration::from_secs(seconds),
            worked: (name == "b").then_some(Duration::from_millis(2500)),
            stdout: Vec::new(),
            stderr: Vec::new(),
            tests: tests.iter().map(|(t, s)| ((*t).into(), Duration::from_secs(*s))).collect(),
        };
        let text = slowest(&[one("a", 1, &[("x", 1)]), one("b", 3, &[("y", 2), ("z", 0)])], 1);
        assert_eq!(
            text,
            "programs that took longest:\n     3.0 s  b (2.5 s of work)\ntests that took longest:\n     2.0 s  b y\n"
        );
    }
}
