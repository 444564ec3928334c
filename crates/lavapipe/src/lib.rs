//! Mesa's software Vulkan driver (lavapipe) for tests: the same driver, with shaders that compile
//! in seconds.
//!
//! Mesa makes a coroutine of every compute shader, so that invocations can wait at barriers. To
//! lower one, LLVM 15 computes the dominator tree of the whole shader again and again: 203 s of the
//! 216 s of a test that compiles a path tracer with texture graphs (44 725 blocks, 6 447 variables;
//! Mesa 25.0.7 with `GALLIVM_PERF=nopt`, EPYC, 2026-11-29). Most shaders have no barrier. This
//! library stands between the driver and LLVM and makes plain functions of those (`straight.rs`);
//! the whole test then takes 15 s.
//!
//! It is a Vulkan driver that passes on to the real one (`driver.rs`); a manifest that `cargo xtask
//! test` writes names it in lavapipe's place. The driver calls LLVM by its C interface, of which
//! this library has one function of its own, [`LLVMRunPasses`]. A driver that does not call it is
//! not changed.

#![cfg(target_os = "linux")]

mod driver;
mod llvm;
mod straight;
#[cfg(test)]
mod tests;

use llvm::{Module, Options, TargetMachine};
use std::cell::Cell;
use std::ffi::{CStr, c_char, c_void};
use std::ptr::null_mut;

pub use driver::{
    vk_icdGetInstanceProcAddr, vk_icdGetPhysicalDeviceProcAddr, vk_icdNegotiateLoaderICDInterfaceVersion,
};

/// What Mesa runs first, to lower coroutines.
const LOWERING: &CStr = c"default<O0>";

/// What Mesa runs then where it is not to optimise: variables on the stack become values.
const PROMOTION: &CStr = c"mem2reg";

thread_local! {
    /// The module on which the passes of [`LOWERING`] ran last in this thread, if its functions are
    /// plain ones now.
    static STRAIGHT: Cell<Module> = const { Cell::new(Module(null_mut())) };
}

/// LLVM's function of this name, which the driver calls. Modules whose shaders need not stop are
/// made plain functions before they are lowered.
///
/// Of plain functions, variables stay on the stack if they would only be promoted: the quick code
/// generator that follows puts nearly all values there again, and promotion takes longer than it
/// (31 s and 8 s of the shader above).
///
/// # Safety
/// That of LLVM's function: `module`, `target` and `options` are LLVM's, `passes` ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn LLVMRunPasses(
    module: Module,
    passes: *const c_char,
    target: TargetMachine,
    options: Options,
) -> *mut c_void {
    // Who calls this was loaded by `driver`, so that its LLVM is known.
    let Some((real, run)) = driver::real().and_then(|real| Some((real, real.run_passes?))) else {
        return null_mut();
    };
    // SAFETY: the caller's text ends with a zero.
    let wanted = unsafe { CStr::from_ptr(passes) };
    if wanted == LOWERING {
        // SAFETY: the module is the caller's, whole, and used by this thread only.
        let straighten = |llvm| unsafe { straight::straighten(llvm, module) };
        let is_straight = real.llvm.as_ref().is_some_and(straighten);
        STRAIGHT.set(if is_straight { module } else { Module(null_mut()) });
    } else if STRAIGHT.replace(Module(null_mut())) == module && wanted == PROMOTION {
        return null_mut();
    }
    // SAFETY: the arguments are the caller's.
    unsafe { run(module, passes, target, options) }
}
