//! Coroutines that never wait become plain functions.
//!
//! Mesa's shader (`cs_co_variant`, lp_state_cs.c) is a coroutine with a point to suspend at for
//! each barrier, and one at the end, the final one. `cs_variant` starts one for each subgroup of a
//! workgroup, and resumes all of them, again and again, until they are done. Without barriers the
//! first call is all there is to it, so what asks about coroutines has fixed answers:
//!
//! | call | answer |
//! |---|---|
//! | `coro.begin(id, memory)` | the memory |
//! | `coro.size` | some bytes, so that each has memory of its own |
//! | `coro.suspend(none, final)` | suspended: return to who called |
//! | `coro.end` | no |
//! | `coro.done(handle)` | yes |
//! | `coro.id`, `coro.resume`, `coro.destroy` | none |

use crate::llvm::{INTEGER, Llvm, Module, Value};
use std::ffi::CStr;

/// What the names of LLVM's functions about coroutines begin with.
const PREFIX: &[u8] = b"llvm.coro.";

/// What marks functions as coroutines.
const MARK: &CStr = c"presplitcoroutine";

/// `LLVMAttributeFunctionIndex`: attributes of functions, not of arguments or results.
const OF_FUNCTION: u32 = u32::MAX;

/// Bytes for a coroutine of which nothing is kept.
const BYTES: u64 = 16;

/// `coro.suspend`'s answer to who has suspended just now: -1 in eight bits.
const SUSPENDED: u64 = 0xff;

/// Which function about coroutines is called.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Id,
    Begin,
    Size,
    Suspend,
    End,
    Done,
    Resume,
    Destroy,
}

impl Kind {
    /// By what follows [`PREFIX`]; `None` for what Mesa does not call.
    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"id" => Self::Id,
            b"begin" => Self::Begin,
            b"size.i32" => Self::Size,
            b"suspend" => Self::Suspend,
            b"end" => Self::End,
            b"done" => Self::Done,
            b"resume" => Self::Resume,
            b"destroy" => Self::Destroy,
            _ => return None,
        })
    }
}

/// A call of such a function.
struct Call {
    instruction: Value,
    /// `None`: one whose answer is not known.
    kind: Option<Kind>,
    /// The function that calls.
    caller: Value,
}

/// Makes plain functions of the coroutines of a module if none of them waits but at its end.
/// Returns whether it did; else nothing is changed.
///
/// # Safety
/// The module is LLVM's, valid, and nobody else uses it meanwhile.
pub unsafe fn straighten(llvm: &Llvm, module: Module) -> bool {
    // SAFETY: the module is valid.
    let calls = unsafe { calls(llvm, module) };
    let begins = calls.iter().any(|call| call.kind == Some(Kind::Begin));
    // SAFETY: the instructions are the module's.
    if !begins || !calls.iter().all(|call| unsafe { has_answer(llvm, call) }) {
        return false;
    }
    for call in &calls {
        // SAFETY: the instructions are the module's; answers have the types of what they stand for.
        unsafe { answer(llvm, call) };
    }
    // Who uses a result stands behind who makes it.
    for call in calls.iter().rev() {
        // SAFETY: nothing uses the result any more.
        unsafe { (llvm.erase)(call.instruction) };
    }
    true
}

/// All calls about coroutines, in their order.
///
/// # Safety
/// The module is valid.
unsafe fn calls(llvm: &Llvm, module: Module) -> Vec<Call> {
    let mut found = Vec::new();
    // SAFETY: each list is that of a part of the module, and ends with null.
    unsafe {
        let mut function = (llvm.first_function)(module);
        while !function.0.is_null() {
            let mut block = (llvm.first_block)(function);
            while !block.0.is_null() {
                let mut instruction = (llvm.first_instruction)(block);
                while !instruction.0.is_null() {
                    let name = called_name(llvm, instruction);
                    if let Some(name) = name.and_then(|name| name.strip_prefix(PREFIX)) {
                        found.push(Call { instruction, kind: Kind::named(name), caller: function });
                    }
                    instruction = (llvm.next_instruction)(instruction);
                }
                block = (llvm.next_block)(block);
            }
            function = (llvm.next_function)(function);
        }
    }
    found
}

/// The name of the function that an instruction calls, if it is a call.
///
/// # Safety
/// The instruction is valid; the name is LLVM's and lives as long as the function.
unsafe fn called_name<'a>(llvm: &Llvm, instruction: Value) -> Option<&'a [u8]> {
    // SAFETY: the instruction is valid, and a call where LLVM says so.
    unsafe {
        if (llvm.as_call)(instruction).0.is_null() {
            return None;
        }
        let mut length = 0;
        let name = (llvm.name)((llvm.called)(instruction), &mut length);
        (!name.is_null()).then(|| std::slice::from_raw_parts(name.cast(), length))
    }
}

/// Whether the answer to a call is known: to all, but to suspending before the end.
///
/// # Safety
/// The instruction is valid.
unsafe fn has_answer(llvm: &Llvm, call: &Call) -> bool {
    // SAFETY: the instruction is valid.
    let is_integer = || unsafe { (llvm.type_kind)((llvm.type_of)(call.instruction)) == INTEGER };
    match call.kind {
        None => false,
        // SAFETY: `coro.suspend` has two arguments; the number is asked of constants only.
        Some(Kind::Suspend) => unsafe {
            let is_final = (llvm.operand)(call.instruction, 1);
            is_integer() && !(llvm.as_integer)(is_final).0.is_null() && (llvm.integer)(is_final) != 0
        },
        // Later versions of LLVM may want something else to be returned.
        Some(Kind::Size | Kind::End | Kind::Done) => is_integer(),
        Some(_) => true,
    }
}

/// Puts the answer in the place of what a call returns.
///
/// # Safety
/// The instruction is valid.
unsafe fn answer(llvm: &Llvm, call: &Call) {
    let Some(kind) = call.kind else { return };
    // SAFETY: the instruction is valid, and constants are made of its own type.
    unsafe {
        let constant = |number| (llvm.constant)((llvm.type_of)(call.instruction), number, 0);
        let value = match kind {
            Kind::Begin => (llvm.operand)(call.instruction, 1),
            Kind::Size => constant(BYTES),
            Kind::Suspend => constant(SUSPENDED),
            Kind::End => constant(0),
            Kind::Done => constant(1),
            Kind::Id => {
                let mark = (llvm.attribute_kind)(MARK.as_ptr(), MARK.count_bytes());
                (llvm.remove_attribute)(call.caller, OF_FUNCTION, mark);
                return;
            }
            Kind::Resume | Kind::Destroy => return,
        };
        (llvm.replace)(call.instruction, value);
    }
}
