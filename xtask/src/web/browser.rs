//! The page in a headless browser.

use super::serve::Server;
use crate::shell::{cargo, output, run, target_dir};
use anyhow::{Context, bail, ensure};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// How long a browser may take for a picture, or for a part of the test.
const LIMIT: Duration = Duration::from_secs(300);

/// A browser that ends with this value.
struct Browser(Child);

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A browser without a window, which keeps what it keeps in `profile`.
fn headless(browser: &Path, profile: &Path) -> Command {
    let mut command = Command::new(browser);
    command
        .args(["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-sync"])
        .args(["--disable-background-networking", "--disable-component-update", "--window-size=1280,800"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

/// Pictures of the same samples may differ by so much, relMSE: rounding sends some paths elsewhere, and there are two samples
/// a pixel.
const TIPPED: f64 = 0.01;

/// Whether a picture of the page is that of this machine but for rounding.
///
/// The page's rays are traced without fused products (`accel`'s scalar kernel), those of most machines with them.
fn compare(own: &Path, bytes: &[u8], of_page: &Path) -> anyhow::Result<()> {
    let expected = std::fs::read(own).with_context(|| format!("no {} of this machine", own.display()))?;
    if bytes == expected {
        eprintln!("{}: the same bits", own.display());
        return Ok(());
    }
    std::fs::write(of_page, bytes).with_context(|| format!("cannot write {}", of_page.display()))?;
    let program = target_dir()?.join(format!("debug/alhazen{}", std::env::consts::EXE_SUFFIX));
    let text = output(Command::new(program).arg("compare").arg(own).arg(of_page))?;
    let error = text.lines().find_map(|line| line.strip_prefix("relMSE")?.trim().parse::<f64>().ok());
    let error = error.with_context(|| format!("`alhazen compare` says no relMSE: {text}"))?;
    eprintln!("{}: relMSE {error:.1e}", own.display());
    ensure!(error <= TIPPED, "{} is another picture: relMSE {error:.1e}", of_page.display());
    Ok(())
}

/// Takes the documentation's picture of the page.
pub fn picture(page: &Path, browser: &Path, file: &Path) -> anyhow::Result<()> {
    let profile = target_dir()?.join("web-test/profile");
    let server = Server::start(page, 0)?;
    let mut command = headless(browser, &profile);
    command.arg(format!("--screenshot={}", file.display())).arg(format!("{}shot.html", server.address()));
    run(&mut command)?;
    ensure!(file.is_file(), "{} was not made", file.display());
    Ok(())
}

/// Opens the page's test, and compares its pictures with those that the crate makes on this machine.
pub fn test(page: &Path, browser: &Path) -> anyhow::Result<()> {
    let pictures = target_dir()?.join("web-test");
    let _ = std::fs::remove_dir_all(&pictures);
    std::fs::create_dir_all(&pictures).with_context(|| format!("cannot make {}", pictures.display()))?;
    // Of the whole workspace, so that what tests have compiled is taken.
    run(&mut cargo(&["build", "--workspace", "--example", "pictures", "--bin", "alhazen"]))?;
    let example = format!("debug/examples/pictures{}", std::env::consts::EXE_SUFFIX);
    run(Command::new(target_dir()?.join(example)).arg(&pictures))?;
    let server = Server::start(page, 0)?;
    let profile = pictures.join("profile");
    let mut command = headless(browser, &profile);
    let spawned = command.arg(format!("{}test.html", server.address())).spawn();
    let _browser = Browser(spawned.with_context(|| format!("cannot start {}", browser.display()))?);
    let list = server.receive("list", LIMIT)?;
    let names: Vec<String> = serde_json::from_slice(&list).context("the page's list of pictures")?;
    for name in &names {
        let of_page = server.receive(name, LIMIT)?;
        compare(&pictures.join(name), &of_page, &pictures.join(format!("page-{name}")))?;
    }
    ensure!(names.len() > 8, "the page made only {} pictures", names.len());
    let report = String::from_utf8(server.receive("report", LIMIT)?).context("the page's report")?;
    let report: serde_json::Value = serde_json::from_str(&report).context("the page's report")?;
    for line in report["passed"].as_array().into_iter().flatten() {
        eprintln!("passed: {}", line.as_str().unwrap_or_default());
    }
    let failed: Vec<_> =
        report["failed"].as_array().into_iter().flatten().filter_map(|f| f.as_str()).collect();
    if !failed.is_empty() {
        bail!("{}", failed.join("; "));
    }
    ensure!(
        report["passed"].as_array().is_some_and(|p| p.len() >= 8),
        "the page tested next to nothing: {report}"
    );
    Ok(())
}
