//! The part of LLVM's C interface that is needed to look at functions and to take instructions out.

use std::ffi::{CStr, c_char, c_uint, c_void};
use std::mem::transmute;

/// `LLVMModuleRef`.
#[repr(transparent)]
#[derive(Clone, Copy, PartialEq)]
pub struct Module(pub *mut c_void);

/// `LLVMValueRef`: a function, an instruction, a constant.
#[repr(transparent)]
#[derive(Clone, Copy, PartialEq)]
pub struct Value(pub *mut c_void);

/// `LLVMBasicBlockRef`.
#[repr(transparent)]
#[derive(Clone, Copy, PartialEq)]
pub struct Block(pub *mut c_void);

/// `LLVMTypeRef`.
#[repr(transparent)]
#[derive(Clone, Copy, PartialEq)]
pub struct Type(pub *mut c_void);

/// `LLVMIntegerTypeKind`: the kind of all types of integers.
pub const INTEGER: c_uint = 8;

/// `LLVMTargetMachineRef`.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub struct TargetMachine(pub *mut c_void);

/// `LLVMPassBuilderOptionsRef`.
#[repr(transparent)]
#[derive(Clone, Copy)]
pub struct Options(pub *mut c_void);

/// `LLVMRunPasses`; what it returns is an error, or null.
pub type Passes = unsafe extern "C" fn(Module, *const c_char, TargetMachine, Options) -> *mut c_void;

/// Declares the functions and finds them by their names.
macro_rules! functions {
    ($($field:ident: $name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Functions of LLVM.
        pub struct Llvm {
            $(
                #[doc = concat!("`", stringify!($name), "`")]
                pub $field: unsafe extern "C" fn($($argument),*) $(-> $result)?,
            )*
        }

        impl Llvm {
            /// Finds the functions by `symbol`; `None` if any is missing.
            pub fn find(symbol: impl Fn(&CStr) -> Option<*mut c_void>) -> Option<Self> {
                Some(Self {
                    $(
                        $field: {
                            let name = CStr::from_bytes_with_nul(concat!(stringify!($name), "\0").as_bytes());
                            let address = symbol(name.ok()?)?;
                            // SAFETY: llvm-c/Core.h gives the function of this name this type.
                            unsafe {
                                transmute::<*mut c_void, unsafe extern "C" fn($($argument),*) $(-> $result)?>(
                                    address,
                                )
                            }
                        },
                    )*
                })
            }
        }
    };
}

functions! {
    first_function: LLVMGetFirstFunction(Module) -> Value;
    next_function: LLVMGetNextFunction(Value) -> Value;
    first_block: LLVMGetFirstBasicBlock(Value) -> Block;
    next_block: LLVMGetNextBasicBlock(Block) -> Block;
    first_instruction: LLVMGetFirstInstruction(Block) -> Value;
    next_instruction: LLVMGetNextInstruction(Value) -> Value;
    as_call: LLVMIsACallInst(Value) -> Value;
    called: LLVMGetCalledValue(Value) -> Value;
    name: LLVMGetValueName2(Value, *mut usize) -> *const c_char;
    operand: LLVMGetOperand(Value, c_uint) -> Value;
    as_integer: LLVMIsAConstantInt(Value) -> Value;
    integer: LLVMConstIntGetZExtValue(Value) -> u64;
    constant: LLVMConstInt(Type, u64, i32) -> Value;
    type_of: LLVMTypeOf(Value) -> Type;
    type_kind: LLVMGetTypeKind(Type) -> c_uint;
    replace: LLVMReplaceAllUsesWith(Value, Value);
    erase: LLVMInstructionEraseFromParent(Value);
    attribute_kind: LLVMGetEnumAttributeKindForName(*const c_char, usize) -> c_uint;
    remove_attribute: LLVMRemoveEnumAttributeAtIndex(Value, c_uint, c_uint);
}
