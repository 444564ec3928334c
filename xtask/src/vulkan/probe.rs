//! Which Vulkan devices there are, asked in a process of its own: a driver that crashes takes nobody with it, and a
//! driver just set up is found without restarting.

use super::Variables;
use crate::shell::output;
use anyhow::{Context, bail};
use std::ffi::CStr;
use std::process::Command;

/// A Vulkan device, as far as tests are concerned.
#[derive(Clone, Debug, PartialEq)]
pub struct Device {
    /// Name that the driver gives to it.
    pub name: String,
    /// Whether there are ray queries: shaders of any kind can trace rays.
    pub queries: bool,
    /// Whether there are ray tracing pipelines.
    pub pipelines: bool,
}

/// The devices that a program sees whose environment has `variables` in addition.
pub fn devices(variables: &Variables) -> anyhow::Result<Vec<Device>> {
    let program = std::env::current_exe().context("cannot find this program")?;
    let mut command = Command::new(program);
    command.args(["vulkan", "--list"]).envs(variables.iter().map(|(name, value)| (name, value)));
    let lines = output(&mut command)?;
    if let Some(reason) = lines.lines().find_map(|l| l.strip_prefix(NONE)) {
        bail!("{reason}");
    }
    Ok(lines.lines().filter_map(parse).collect())
}

/// What the line begins with that says why there are no devices.
const NONE: &str = "no device: ";

/// Prints the devices of this process's environment, one a line, or why there are none.
pub fn print_devices() {
    match list() {
        Ok(devices) => devices.iter().for_each(|device| println!("{}", show(device))),
        Err(error) => println!("{NONE}{error}"),
    }
}

fn show(device: &Device) -> String {
    format!("device: queries={} pipelines={} {}", device.queries, device.pipelines, device.name)
}

/// The inverse of [`show`]; drivers may print lines of their own.
fn parse(line: &str) -> Option<Device> {
    let mut words = line.strip_prefix("device: ")?.splitn(3, ' ');
    let mut flag = |name: &str| words.next()?.strip_prefix(name)?.parse().ok();
    let (queries, pipelines) = (flag("queries=")?, flag("pipelines=")?);
    Some(Device { name: words.next()?.to_owned(), queries, pipelines })
}

fn list() -> anyhow::Result<Vec<Device>> {
    // SAFETY: loading the system's Vulkan library runs its initialisers; it is what every Vulkan program does.
    let entry = unsafe { ash::Entry::load() }.context("there is no Vulkan loader (libvulkan)")?;
    let info = ash::vk::InstanceCreateInfo::default();
    // SAFETY: the create info is empty, hence valid; the instance is destroyed below, before `entry` is dropped.
    let instance =
        unsafe { entry.create_instance(&info, None) }.context("cannot create a Vulkan instance")?;
    let found = instance_devices(&instance);
    // SAFETY: nothing made from the instance is alive.
    unsafe { instance.destroy_instance(None) };
    found
}

fn instance_devices(instance: &ash::Instance) -> anyhow::Result<Vec<Device>> {
    // SAFETY: the instance is alive.
    let physical = unsafe { instance.enumerate_physical_devices() }.context("cannot list Vulkan devices")?;
    let describe = |device: ash::vk::PhysicalDevice| {
        // SAFETY: the device was just listed by this instance.
        let properties = unsafe { instance.get_physical_device_properties(device) };
        // SAFETY: as above.
        let extensions = unsafe { instance.enumerate_device_extension_properties(device) }?;
        let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        let name = properties.device_name_as_c_str().unwrap_or(c"?").to_string_lossy().into_owned();
        let structures = has(ash::khr::acceleration_structure::NAME);
        Ok(Device {
            name,
            queries: structures && has(ash::khr::ray_query::NAME),
            pipelines: structures && has(ash::khr::ray_tracing_pipeline::NAME),
        })
    };
    physical.into_iter().map(describe).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_as_they_are_written() {
        let device =
            Device { name: "llvmpipe (LLVM 15.0.6, 256 bits)".into(), queries: true, pipelines: false };
        assert_eq!(parse(&show(&device)), Some(device));
        assert_eq!(parse("WARNING: some driver talks"), None);
        assert_eq!(parse("device: queries=maybe pipelines=true x"), None);
    }
}
