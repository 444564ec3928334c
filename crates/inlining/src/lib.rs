//! `#[inline_all]`: makes every function of a module inlinable into other crates.
//!
//! The optics are small functions that kernels in other crates call millions of times a second, and kernels are compiled
//! once for each instruction set: only what is inlined into them profits. `#[wgsl]` does not know the attribute
//! `#[inline]`, because WGSL has no such thing; this one, written below it, is applied to what it leaves for rustc.

use proc_macro::{Delimiter, Group, TokenStream, TokenTree};

/// An import by name has precedence over that of a whole module. The lint is off because most modules use only some of them.
const BUILTINS: &str = "#[allow(unused_imports)] use crate::builtins::{
    abs, acos, asin, atan, atan2, clamp, cos, exp, exp2, length, log, log2, max, min, normalize, pow, saturate,
    sin, smoothstep, tan,
};";

/// Puts `#[inline(always)]` on every `pub fn` directly in the module, and imports the crate's `builtins`, which rustc inlines
/// and whose bits are the same on every platform, in the place of those that `wgsl_rs::std` brings.
#[proc_macro_attribute]
pub fn inline_all(_: TokenStream, module: TokenStream) -> TokenStream {
    let body = |tree: TokenTree| match tree {
        TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => {
            let imports = BUILTINS.parse::<TokenStream>().into_iter();
            let items = imports.chain([with_inline(group.stream())]).collect();
            let mut inlined = Group::new(Delimiter::Brace, items);
            inlined.set_span(group.span());
            TokenTree::Group(inlined)
        }
        other => other,
    };
    module.into_iter().map(body).collect()
}

fn with_inline(items: TokenStream) -> TokenStream {
    let trees: Vec<TokenTree> = items.into_iter().collect();
    let is = |i: usize, name: &str| matches!(trees.get(i), Some(TokenTree::Ident(ident)) if ident.to_string() == name);
    let mut out = TokenStream::new();
    for (i, tree) in trees.iter().enumerate() {
        if is(i, "pub") && is(i + 1, "fn") {
            out.extend("#[inline(always)]".parse::<TokenStream>().into_iter().flatten());
        }
        out.extend([tree.clone()]);
    }
    out
}
