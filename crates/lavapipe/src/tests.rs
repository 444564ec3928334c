//! Modules like those that Mesa makes, read and written by the LLVM of the driver.

use crate::driver::{PATH, open};
use crate::llvm::{Llvm, Module};
use crate::straight::straighten;
use std::ffi::{CStr, CString, c_char, c_void};
use std::mem::transmute;
use std::ptr::null_mut;

/// A shader with a point to suspend at, final or not, and who runs it; as `generate_compute` of
/// lp_state_cs.c makes them.
fn shader(is_final: bool) -> String {
    format!(
        "
        declare token @llvm.coro.id(i32, ptr, ptr, ptr)
        declare ptr @llvm.coro.begin(token, ptr)
        declare i32 @llvm.coro.size.i32()
        declare i8 @llvm.coro.suspend(token, i1)
        declare i1 @llvm.coro.end(ptr, i1)
        declare i1 @llvm.coro.done(ptr)
        declare void @llvm.coro.resume(ptr)
        declare void @llvm.coro.destroy(ptr)
        declare ptr @coro_malloc(i32)
        define ptr @cs_co_variant(i32 %x) presplitcoroutine {{
          %id = call token @llvm.coro.id(i32 0, ptr null, ptr null, ptr null)
          %size = call i32 @llvm.coro.size.i32()
          %memory = call ptr @coro_malloc(i32 %size)
          %handle = call ptr @llvm.coro.begin(token %id, ptr %memory)
          %answer = call i8 @llvm.coro.suspend(token none, i1 {is_final})
          switch i8 %answer, label %suspend [ i8 1, label %cleanup ]
        cleanup:
          br label %suspend
        suspend:
          %end = call i1 @llvm.coro.end(ptr %handle, i1 false)
          ret ptr %handle
        }}
        define i1 @cs_variant(ptr %handle) {{
          %done = call i1 @llvm.coro.done(ptr %handle)
          call void @llvm.coro.destroy(ptr %handle)
          call void @llvm.coro.resume(ptr %handle)
          ret i1 %done
        }}
        "
    )
}

type NewContext = unsafe extern "C" fn() -> *mut c_void;
type NewBuffer = unsafe extern "C" fn(*const c_char, usize, *const c_char) -> *mut c_void;
type Parse = unsafe extern "C" fn(*mut c_void, *mut c_void, *mut Module, *mut *mut c_char) -> i32;
type Print = unsafe extern "C" fn(Module) -> *mut c_char;

/// The driver's LLVM: its functions, how it reads a module, and how it writes one.
struct Tools {
    llvm: Llvm,
    context: NewContext,
    buffer: NewBuffer,
    parse: Parse,
    print: Print,
}

impl Tools {
    /// `None` and a visible skip without the driver: the one that `cargo xtask test` names, or, on
    /// machines with a GPU, the system's.
    fn new(test: &str) -> Option<Self> {
        let path = std::env::var_os(PATH).unwrap_or_else(|| "libvulkan_lvp.so".into());
        let Some(symbol) = open(&path) else {
            testkit::skip_without_tool(test, &format!("there is no {}", path.to_string_lossy()));
            return None;
        };
        let symbol = |name: &CStr| Some(symbol(name).unwrap_or_else(|| panic!("{name:?} is missing")));
        // SAFETY: llvm-c/Core.h and llvm-c/IRReader.h give the functions of these names these
        // types.
        unsafe {
            Some(Self {
                llvm: Llvm::find(symbol).expect("all were found"),
                context: transmute::<*mut c_void, NewContext>(symbol(c"LLVMContextCreate")?),
                buffer: transmute::<*mut c_void, NewBuffer>(symbol(
                    c"LLVMCreateMemoryBufferWithMemoryRangeCopy",
                )?),
                parse: transmute::<*mut c_void, Parse>(symbol(c"LLVMParseIRInContext")?),
                print: transmute::<*mut c_void, Print>(symbol(c"LLVMPrintModuleToString")?),
            })
        }
    }

    /// Straightens a module; whether that could be, and its text before and afterwards.
    fn straighten(&self, text: &str) -> (bool, [String; 2]) {
        let text = CString::new(text).expect("no zeros");
        let (mut module, mut error) = (Module(null_mut()), null_mut());
        // SAFETY: the text lives until it is copied; what LLVM makes of it is used by this thread
        // only, and not freed.
        unsafe {
            let buffer = (self.buffer)(text.as_ptr(), text.count_bytes(), c"shader".as_ptr());
            let failed = (self.parse)((self.context)(), buffer, &mut module, &mut error);
            assert!(failed == 0, "{:?}", (!error.is_null()).then(|| CStr::from_ptr(error)));
            let show = || CStr::from_ptr((self.print)(module)).to_string_lossy().into_owned();
            let before = show();
            (straighten(&self.llvm, module), [before, show()])
        }
    }
}

#[test]
fn what_never_waits_becomes_a_plain_function() {
    let Some(tools) = Tools::new("what_never_waits_becomes_a_plain_function") else { return };
    let (is_straight, [_, after]) = tools.straighten(&shader(true));
    assert!(is_straight);
    assert!(!after.contains("call token") && !after.contains("@llvm.coro.begin(token %"), "{after}");
    for line in [
        "%memory = call ptr @coro_malloc(i32 16)",
        "switch i8 -1, label %suspend",
        "ret ptr %memory",
        "ret i1 true",
    ] {
        assert!(after.contains(line), "{line} is not in {after}");
    }
    let calls = after.lines().filter(|line| line.contains("call") && line.contains("@llvm.coro."));
    assert_eq!(calls.count(), 0, "{after}");
    assert!(!after.contains(" presplitcoroutine"), "{after}");
}

#[test]
fn what_waits_stays_as_it_is() {
    let Some(tools) = Tools::new("what_waits_stays_as_it_is") else { return };
    let unknown = shader(true).replace("llvm.coro.end", "llvm.coro.other");
    for text in [shader(false), "define void @sample() { ret void }".into(), unknown] {
        let (is_straight, [before, after]) = tools.straighten(&text);
        assert!(!is_straight, "{after}");
        assert_eq!(before, after);
    }
}

#[test]
fn a_driver_that_is_not_there_is_none() {
    assert!(open(std::ffi::OsStr::new("/nowhere/libvulkan_lvp.so")).is_none());
}
