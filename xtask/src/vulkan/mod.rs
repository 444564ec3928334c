//! A Vulkan driver that traces rays, for tests of the GPU back ends.
//!
//! Whatever driver the machine has is used if it has ray tracing pipelines. Else Mesa's software driver (lavapipe) is set
//! up: as a system package by root, and otherwise unpacked beside the build, where nobody else sees it.

pub mod apt;
mod lanes;
mod plain_shaders;
mod probe;
mod unpacked;

pub use probe::print_devices;

use crate::shell::target_dir;
use anyhow::ensure;
use probe::{Device, devices};
use std::path::PathBuf;

/// Environment variables that make programs find a driver.
pub type Variables = Vec<(String, String)>;

/// Show the Vulkan devices that tests would use, and set up a software driver if there is none that traces rays.
#[derive(Debug, clap::Args)]
pub struct VulkanArgs {
    /// Unpack a software driver into this folder, whatever the machine has.
    #[arg(long, value_name = "FOLDER")]
    unpack: Option<PathBuf>,
    /// Print the devices of the present environment, one a line, and change nothing.
    #[arg(long, conflicts_with = "unpack")]
    list: bool,
}

/// What tests will find.
#[derive(Debug)]
pub struct Vulkan {
    /// To be set for the tests.
    pub variables: Variables,
    /// One line for the user: on what the GPU tests run, or why they cannot.
    pub message: String,
}

/// Runs the command.
pub fn run(args: &VulkanArgs) -> anyhow::Result<()> {
    if args.list {
        print_devices();
        return Ok(());
    }
    let vulkan = match &args.unpack {
        Some(folder) => {
            let variables = unpacked::unpack(folder)?;
            let device = tracing_device(&variables)?;
            Vulkan::ready(&device, variables)
        }
        None => prepare(),
    };
    eprintln!("{}", vulkan.message);
    for (name, value) in &vulkan.variables {
        println!("export {name}='{value}'");
    }
    Ok(())
}

/// Finds a driver that traces rays or sets one up. That there is none is no error: tests then say that they are skipped.
pub fn prepare() -> Vulkan {
    match find_or_set_up() {
        Ok(vulkan) => vulkan,
        Err(error) => Vulkan {
            variables: Variables::new(),
            message: format!(
                "no Vulkan driver that traces rays; tests that need one will be skipped: {error:#}"
            ),
        },
    }
}

/// The variables for the driver that is there; none where none traces rays. Sets up nothing.
pub fn present() -> Variables {
    find().map_or_else(|_| Variables::new(), |vulkan| vulkan.variables)
}

/// The driver of the machine, or else one that was unpacked beside the build.
fn find() -> anyhow::Result<Vulkan> {
    let present = Variables::new();
    let absence = match tracing_device(&present) {
        Ok(device) => return Ok(Vulkan::ready(&device, present)),
        Err(absence) => absence,
    };
    let variables = unpacked::variables(&target_dir()?.join("software-vulkan"));
    match variables.map(|variables| (tracing_device(&variables), variables)) {
        Some((Ok(device), variables)) => Ok(Vulkan::ready(&device, variables)),
        _ => Err(absence),
    }
}

fn find_or_set_up() -> anyhow::Result<Vulkan> {
    let absence = match find() {
        Ok(vulkan) => return Ok(vulkan),
        Err(absence) => absence,
    };
    let (present, folder) = (Variables::new(), target_dir()?.join("software-vulkan"));
    eprintln!("{absence}: setting up Mesa's software driver");
    if apt::may_install() {
        match apt::install().and_then(|()| tracing_device(&present)) {
            Ok(device) => return Ok(Vulkan::ready(&device, present)),
            Err(error) => {
                eprintln!("the system package did not help ({error:#}): unpacking one beside the build")
            }
        }
    }
    let variables = unpacked::unpack(&folder)?;
    let device = tracing_device(&variables)?;
    Ok(Vulkan::ready(&device, variables))
}

/// The device on which most tests can run.
fn tracing_device(variables: &Variables) -> anyhow::Result<Device> {
    let devices = devices(variables)?;
    let names: Vec<_> = devices.iter().map(|d| d.name.clone()).collect();
    let usable = devices.into_iter().filter(|d| d.pipelines).max_by_key(|d| d.queries);
    usable.ok_or_else(|| match &names[..] {
        [] => anyhow::anyhow!("there is no Vulkan device"),
        names => {
            anyhow::anyhow!("no Vulkan device has ray tracing pipelines (present: {})", names.join(", "))
        }
    })
}

/// The variables of [`plain_shaders::variables`], if the device is found with them as it is without.
fn plain_shaders(device: &Device, variables: &Variables) -> anyhow::Result<Variables> {
    let more = plain_shaders::variables(device, variables)?;
    if !more.is_empty() {
        let mut all = variables.clone();
        crate::test::merge(&mut all, more.clone());
        let found = tracing_device(&all)?;
        ensure!(found == *device, "{} is not {}", found.name, device.name);
    }
    Ok(more)
}

impl Vulkan {
    /// A device that is found with these variables.
    fn ready(device: &Device, mut variables: Variables) -> Self {
        match plain_shaders(device, &variables) {
            Ok(more) => crate::test::merge(&mut variables, more),
            Err(error) => eprintln!("shaders compile slowly: {error:#}"),
        }
        match lanes::four_lanes() {
            Ok(more) => variables.extend(more),
            Err(error) => eprintln!("shaders are compiled for as many lanes as there are: {error:#}"),
        }
        let without =
            if device.queries { "" } else { "; it has no ray queries: tests of those will be skipped" };
        Self { variables, message: format!("GPU tests: {}{without}", device.name) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_without_queries_is_used_and_named() {
        let device = Device { name: "Some GPU".into(), queries: false, pipelines: true };
        let ready = |device: &Device| Vulkan::ready(device, Variables::new());
        assert!(ready(&device).message.contains("Some GPU; it has no ray queries"));
        let vulkan = ready(&Device { queries: true, ..device });
        assert_eq!(vulkan.message, "GPU tests: Some GPU");
        assert_eq!(vulkan.variables, lanes::four_lanes().expect("the folder of builds can be written"));
    }

    #[test]
    fn a_driver_that_does_not_exist_is_an_error_and_no_panic() {
        let nothing = vec![("VK_DRIVER_FILES".to_owned(), "/nowhere/icd.json".to_owned())];
        let error = tracing_device(&nothing).expect_err("no driver there").to_string();
        assert!(error.contains("Vulkan"), "{error}");
    }
}
