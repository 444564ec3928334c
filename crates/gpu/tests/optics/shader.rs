//! Compute shaders that call one function of the optics on a buffer of inputs.

use naga::{Handle, Module, ScalarKind, Type, TypeInner};
use std::collections::BTreeSet;
use std::fmt::Write;

/// What a word of a result is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A floating-point number.
    Float,
    /// An integer or a truth value.
    Exact,
}

/// The optics as text and as naga understands it.
pub struct Text {
    text: String,
    module: Module,
}

impl Text {
    pub fn new(text: String) -> Self {
        let module =
            naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        Self { text, module }
    }

    fn function(&self, name: &str) -> &naga::Function {
        let found = self.module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(name));
        found.unwrap_or_else(|| panic!("the optics have no function {name}")).1
    }

    pub fn function_names(&self) -> BTreeSet<String> {
        self.module.functions.iter().filter_map(|(_, f)| f.name.clone()).collect()
    }

    pub fn argument_names(&self, function: &str) -> Vec<String> {
        self.function(function).arguments.iter().filter_map(|a| a.name.clone()).collect()
    }

    pub fn structure_names(&self) -> BTreeSet<String> {
        let is_structure = |t: &&Type| matches!(t.inner, TypeInner::Struct { .. });
        self.module.types.iter().map(|(_, t)| t).filter(is_structure).filter_map(|t| t.name.clone()).collect()
    }

    pub fn fields(&self, structure: &str) -> Vec<String> {
        let found = self.module.types.iter().find(|(_, t)| t.name.as_deref() == Some(structure));
        match found.map(|(_, t)| &t.inner) {
            Some(TypeInner::Struct { members, .. }) => {
                members.iter().filter_map(|m| m.name.clone()).collect()
            }
            _ => panic!("the optics have no structure {structure}"),
        }
    }

    /// Number of words that the arguments of a function take.
    pub fn argument_words(&self, function: &str) -> usize {
        self.function(function).arguments.iter().map(|a| self.kinds(a.ty).len()).sum()
    }

    /// What the words of a function's result are.
    pub fn result_kinds(&self, function: &str) -> Vec<Kind> {
        let result = self.function(function).result.as_ref();
        self.kinds(result.unwrap_or_else(|| panic!("{function} returns nothing")).ty)
    }

    fn kinds(&self, ty: Handle<Type>) -> Vec<Kind> {
        let scalar = |s: naga::Scalar| if s.kind == ScalarKind::Float { Kind::Float } else { Kind::Exact };
        match &self.module.types[ty].inner {
            TypeInner::Scalar(s) => vec![scalar(*s)],
            TypeInner::Vector { size, scalar: s } => vec![scalar(*s); *size as usize],
            TypeInner::Struct { members, .. } => members.iter().flat_map(|m| self.kinds(m.ty)).collect(),
            TypeInner::Array { base, size, .. } => self.kinds(*base).repeat(length(*size)),
            other => panic!("values of type {other:?} cannot go through a buffer of words"),
        }
    }

    /// A shader with entry point `main` that calls `function` on the inputs of binding 0 and writes to binding 1.
    pub fn caller(&self, function: &str) -> String {
        let f = self.function(function);
        let mut next = 0;
        let arguments: Vec<_> = f.arguments.iter().map(|a| self.read(a.ty, &mut next)).collect();
        let result = f.result.as_ref().unwrap_or_else(|| panic!("{function} returns nothing")).ty;
        let mut parts = Vec::new();
        self.write("result", result, &mut parts);
        let mut writes = String::new();
        for (i, part) in parts.iter().enumerate() {
            let _ = writeln!(writes, "    outputs[{} * id.x + {i}] = {part};", parts.len());
        }
        format!(
            "{}\n\
             @group(0) @binding(0) var<storage, read> inputs: array<u32>;\n\
             @group(0) @binding(1) var<storage, read_write> outputs: array<u32>;\n\
             @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {{\n    \
             let at = {next} * id.x;\n    \
             let result = {function}({});\n{writes}}}\n",
            self.text,
            arguments.join(", ")
        )
    }

    /// An expression that reads a value.
    fn read(&self, ty: Handle<Type>, next: &mut usize) -> String {
        let word = |s: naga::Scalar, next: &mut usize| {
            let word = format!("inputs[at + {next}]");
            *next += 1;
            match s.kind {
                ScalarKind::Float => format!("bitcast<f32>({word})"),
                ScalarKind::Bool => format!("({word} != 0u)"),
                ScalarKind::Uint => word,
                ScalarKind::Sint => format!("bitcast<i32>({word})"),
                other => panic!("{other:?} cannot be read from words"),
            }
        };
        match &self.module.types[ty].inner {
            TypeInner::Scalar(s) => word(*s, next),
            TypeInner::Vector { size, scalar: s } => {
                let parts: Vec<_> = (0..*size as usize).map(|_| word(*s, next)).collect();
                format!("vec{}({})", *size as usize, parts.join(", "))
            }
            TypeInner::Struct { members, .. } => {
                let parts: Vec<_> = members.iter().map(|m| self.read(m.ty, next)).collect();
                let name = self.module.types[ty].name.as_deref().expect("structures have names");
                format!("{name}({})", parts.join(", "))
            }
            TypeInner::Array { base, size, .. } => {
                let parts: Vec<_> = (0..length(*size)).map(|_| self.read(*base, next)).collect();
                format!("array({})", parts.join(", "))
            }
            other => panic!("{other:?} cannot be read from words"),
        }
    }

    /// Expressions for the words of a value.
    fn write(&self, value: &str, ty: Handle<Type>, words: &mut Vec<String>) {
        let word = |value: &str, s: naga::Scalar| match s.kind {
            ScalarKind::Float | ScalarKind::Sint => format!("bitcast<u32>({value})"),
            _ => format!("u32({value})"),
        };
        match &self.module.types[ty].inner {
            TypeInner::Scalar(s) => words.push(word(value, *s)),
            TypeInner::Vector { size, scalar: s } => {
                words.extend("xyzw".chars().take(*size as usize).map(|c| word(&format!("{value}.{c}"), *s)));
            }
            TypeInner::Struct { members, .. } => {
                for m in members {
                    let name = m.name.as_deref().expect("fields have names");
                    self.write(&format!("{value}.{name}"), m.ty, words);
                }
            }
            TypeInner::Array { base, size, .. } => {
                (0..length(*size)).for_each(|i| self.write(&format!("{value}[{i}]"), *base, words));
            }
            other => panic!("{other:?} cannot be written as words"),
        }
    }
}

/// Elements of an array.
fn length(size: naga::ArraySize) -> usize {
    match size {
        naga::ArraySize::Constant(count) => count.get() as usize,
        other => panic!("arrays of size {other:?} cannot go through a buffer of words"),
    }
}
