//! The real driver, and the entry points through which the Vulkan loader talks to it.

use crate::llvm::{Llvm, Passes};
use std::ffi::{CStr, CString, OsStr, c_char, c_void};
use std::mem::{MaybeUninit, transmute};
use std::os::unix::ffi::OsStrExt;
use std::sync::OnceLock;

/// The environment variable that names the real driver: a path, or a name that the dynamic linker
/// finds.
pub const PATH: &str = "ALHAZEN_LAVAPIPE";

/// What Vulkan says when a driver cannot be used: `VK_ERROR_INITIALIZATION_FAILED`.
const FAILED: i32 = -3;

type Negotiate = unsafe extern "C" fn(*mut u32) -> i32;
type Lookup = unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void;

/// The real driver. It stays loaded.
pub struct Real {
    negotiate: Negotiate,
    instance_function: Lookup,
    device_function: Lookup,
    /// What shaders are looked at with, if the driver has an LLVM with all of it.
    pub llvm: Option<Llvm>,
    /// The function of LLVM that [`crate::LLVMRunPasses`] stands for.
    pub run_passes: Option<Passes>,
}

/// The driver that the environment names, if it can be loaded.
pub fn real() -> Option<&'static Real> {
    static REAL: OnceLock<Option<Real>> = OnceLock::new();
    REAL.get_or_init(load).as_ref()
}

fn load() -> Option<Real> {
    offer_symbols()?;
    let symbol = open(&std::env::var_os(PATH)?)?;
    // SAFETY: the loader's interface for drivers (LoaderDriverInterface.md) gives these functions
    // these types.
    let (negotiate, instance_function, device_function) = unsafe {
        (
            transmute::<*mut c_void, Negotiate>(symbol(c"vk_icdNegotiateLoaderICDInterfaceVersion")?),
            transmute::<*mut c_void, Lookup>(symbol(c"vk_icdGetInstanceProcAddr")?),
            transmute::<*mut c_void, Lookup>(symbol(c"vk_icdGetPhysicalDeviceProcAddr")?),
        )
    };
    let run_passes = symbol(c"LLVMRunPasses");
    // SAFETY: llvm-c/Transforms/PassBuilder.h gives it this type.
    let run_passes = run_passes.map(|address| unsafe { transmute::<*mut c_void, Passes>(address) });
    Some(Real { negotiate, instance_function, device_function, llvm: Llvm::find(&symbol), run_passes })
}

/// Loads a driver; what finds its symbols and those of what it is linked to.
pub fn open(path: &OsStr) -> Option<impl Fn(&CStr) -> Option<*mut c_void> + use<>> {
    let path = CString::new(path.as_bytes()).ok()?;
    // SAFETY: the text ends with a zero. Loading a library runs its initialisers, as the Vulkan
    // loader does with drivers.
    let library = unsafe { libc::dlopen(path.as_ptr(), libc::RTLD_NOW | libc::RTLD_LOCAL) };
    if library.is_null() {
        eprintln!("{PATH}={}: cannot be loaded", path.to_string_lossy());
        return None;
    }
    Some(move |name: &CStr| {
        // SAFETY: the library stays open; the text ends with a zero.
        let address = unsafe { libc::dlsym(library, name.as_ptr()) };
        (!address.is_null()).then_some(address)
    })
}

/// Lets libraries that are loaded from now on find the symbols of this one before those of what
/// they are linked to.
fn offer_symbols() -> Option<()> {
    let mut own = MaybeUninit::<libc::Dl_info>::zeroed();
    // SAFETY: the address is one of this library, and there is room for what is known of it.
    let found = unsafe { libc::dladdr(real as *const c_void, own.as_mut_ptr()) };
    if found == 0 {
        return None;
    }
    // SAFETY: all zeros are valid, and what was written is.
    let path = unsafe { own.assume_init() }.dli_fname;
    let flags = libc::RTLD_NOW | libc::RTLD_NOLOAD | libc::RTLD_GLOBAL;
    // SAFETY: the path is this library's, ends with a zero, and is loaded already.
    let library = unsafe { libc::dlopen(path, flags) };
    (!library.is_null()).then_some(())
}

/// The first function that the loader calls: agrees on a version of the interface.
///
/// # Safety
/// As the loader's interface for drivers says: `version` can be read and written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vk_icdNegotiateLoaderICDInterfaceVersion(version: *mut u32) -> i32 {
    // SAFETY: the argument is the caller's.
    real().map_or(FAILED, |real| unsafe { (real.negotiate)(version) })
}

/// A function of Vulkan by its name.
///
/// # Safety
/// As the loader's interface for drivers says: `instance` is the driver's or null, `name` ends with
/// a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vk_icdGetInstanceProcAddr(
    instance: *mut c_void,
    name: *const c_char,
) -> *mut c_void {
    // SAFETY: the arguments are the caller's.
    real().map_or(std::ptr::null_mut(), |real| unsafe { (real.instance_function)(instance, name) })
}

/// A function of Vulkan about a physical device, by its name.
///
/// # Safety
/// As [`vk_icdGetInstanceProcAddr`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vk_icdGetPhysicalDeviceProcAddr(
    instance: *mut c_void,
    name: *const c_char,
) -> *mut c_void {
    // SAFETY: the arguments are the caller's.
    real().map_or(std::ptr::null_mut(), |real| unsafe { (real.device_function)(instance, name) })
}
