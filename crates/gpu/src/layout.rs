//! For tests: what naga makes of a shader's structures and constants.

use naga::{Expression, Literal, Module, TypeInner};

/// Name and byte offset of every field of a structure, and its size.
pub(crate) fn layout_of(module: &Module, name: &str) -> (Vec<(String, usize)>, usize) {
    let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name));
    let Some((_, ty)) = found else { panic!("the shader has no structure {name}") };
    let TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is not a structure") };
    let field = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
    (members.iter().map(field).collect(), *span as usize)
}

/// Asserts that a shader puts the fields of a record one after the other, as Rust does.
pub(crate) fn assert_packed<T: optics::WgslRecord>(module: &Module) {
    let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(T::NAME));
    let Some((_, ty)) = found else { panic!("the shader has no structure `{}`", T::NAME) };
    let TypeInner::Struct { members, span } = &ty.inner else { panic!("`{}` is not a structure", T::NAME) };
    let mut end = 0;
    for member in members {
        let name = member.name.as_deref().unwrap_or_default();
        assert_eq!(member.offset, end, "`{}` has a gap before `{name}`", T::NAME);
        end += module.types[member.ty].inner.size(module.to_ctx());
    }
    assert_eq!((end, *span as usize), (*span, size_of::<T>()), "`{}` has a gap at its end", T::NAME);
}

/// The value of a `u32` constant.
pub(crate) fn constant(module: &Module, name: &str) -> u32 {
    let found = module.constants.iter().find(|(_, c)| c.name.as_deref() == Some(name));
    let Some((_, constant)) = found else { panic!("the shader has no constant {name}") };
    match module.global_expressions[constant.init] {
        Expression::Literal(Literal::U32(value)) => value,
        ref other => panic!("{name} is {other:?}"),
    }
}

/// Asserts that a structure has the same fields at the same places in Rust and in the shader.
macro_rules! assert_layout {
    ($module:expr, $name:ident { $($field:ident),* $(,)? }) => {{
        let rust = (
            vec![$((stringify!($field).to_owned(), std::mem::offset_of!($name, $field))),*],
            size_of::<$name>(),
        );
        let wgsl = $crate::layout::layout_of(&$module, stringify!($name));
        assert_eq!(wgsl, rust, "layout of {}: shader against Rust", stringify!($name));
    }};
}
pub(crate) use assert_layout;
