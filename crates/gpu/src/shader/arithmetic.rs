//! Formulas are Rust (`crates/optics`): which functions of the shaders compute at all, and why.
//!
//! A function computes if it multiplies, divides or takes a remainder of floating-point numbers, or calls a built-in function
//! that makes such numbers (`sqrt`, `dot`, `max`, …). To fetch, to index, to pack, to compare, to choose, to count, and to sum
//! up is no formula. Whole numbers are places.

mod list;

use super::tests::{declared, tracings};
use super::{check, modules};
use list::LISTED;
use naga::proc::TypeResolution;
use naga::{BinaryOperator, Expression, MathFunction, Module, ScalarKind, TypeInner};
use std::collections::BTreeSet;

/// A file of `shaders/` without its extension, and a function that it declares.
type Place = (String, String);

/// Whether values of a type are floating-point numbers.
fn is_float(module: &Module, ty: &TypeResolution) -> bool {
    match ty.inner_with(&module.types) {
        TypeInner::Scalar(scalar) | TypeInner::Vector { scalar, .. } | TypeInner::Matrix { scalar, .. } => {
            scalar.kind == ScalarKind::Float
        }
        _ => false,
    }
}

/// Whether an expression that makes a floating-point number is a formula.
fn computes(expression: &Expression) -> bool {
    use MathFunction::{Unpack2x16float, Unpack2x16snorm, Unpack2x16unorm, Unpack4x8snorm, Unpack4x8unorm};
    match expression {
        Expression::Binary { op, .. } => {
            matches!(op, BinaryOperator::Multiply | BinaryOperator::Divide | BinaryOperator::Modulo)
        }
        Expression::Math { fun, .. } => !matches!(
            fun,
            Unpack2x16float | Unpack2x16snorm | Unpack2x16unorm | Unpack4x8snorm | Unpack4x8unorm
        ),
        _ => false,
    }
}

/// Names of the functions of a text that compute, entry points included.
fn computing(text: &str) -> BTreeSet<String> {
    let module = check::parse(text);
    let capabilities = naga::valid::Capabilities::all();
    let info = naga::valid::Validator::new(naga::valid::ValidationFlags::empty(), capabilities)
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let does = |f: &naga::Function, info: &naga::valid::FunctionInfo| {
        f.expressions.iter().any(|(handle, e)| computes(e) && is_float(&module, &info[handle].ty))
    };
    let functions = module.functions.iter().filter(|(handle, f)| does(f, &info[*handle]));
    let entry_points = module.entry_points.iter().enumerate();
    let entry_points = entry_points.filter(|(i, e)| does(&e.function, info.get_entry_point(*i)));
    functions.filter_map(|(_, f)| f.name.clone()).chain(entry_points.map(|(_, e)| e.name.clone())).collect()
}

/// Those of all files.
fn all_computing() -> BTreeSet<Place> {
    let mut found = BTreeSet::new();
    for (name, text) in modules::files() {
        let own = declared(text);
        for linkage in tracings(name) {
            let text = linkage.text(name).unwrap_or_else(|e| panic!("{name}: {e}"));
            let functions = computing(&text).into_iter().filter(|f| own.contains(f.as_str()));
            found.extend(functions.map(|f| (name.to_owned(), f)));
        }
    }
    found
}

fn listed() -> BTreeSet<Place> {
    let mut places = BTreeSet::new();
    for (reason, files) in LISTED {
        for (file, functions) in *files {
            for function in *functions {
                let is_new = places.insert(((*file).to_owned(), (*function).to_owned()));
                assert!(is_new, "{file}: {function} is listed twice, the second time because {reason}");
            }
        }
    }
    places
}

/// No formula is WGSL text but for what is listed, and what is listed is one.
#[test]
fn shaders_compute_only_what_is_listed() {
    let (found, listed) = (all_computing(), listed());
    let lines = |places: BTreeSet<&Place>| -> String {
        places.into_iter().map(|(file, function)| format!("    {file}: {function}\n")).collect()
    };
    let new = lines(found.difference(&listed).collect());
    let gone = lines(listed.difference(&found).collect());
    assert!(
        new.is_empty() && gone.is_empty(),
        "formulas that are not listed, and belong into the optics:\n{new}listed, but no formula any more:\n{gone}"
    );
}

/// What counts and what does not.
#[test]
fn formulas_are_told_from_fetching() {
    let text = |body: &str| {
        format!(
            "@group(0) @binding(0) var<storage> a: array<vec4f>;\n\
             @group(0) @binding(1) var<storage> b: array<vec4u>;\n\
             fn f(x: f32, v: vec3f, n: u32) -> f32 {{ {body} }}\n"
        )
    };
    for formula in [
        "return x * x;",
        "return dot(v, v);",
        "return max(x, 0.0);",
        "return x / f32(n);",
        "return (v * x).x;",
    ] {
        assert_eq!(computing(&text(formula)).len(), 1, "{formula}");
    }
    for no_formula in [
        "return a[3u * n + min(n, 7u)].x;",
        "return bitcast<f32>(b[n].y);",
        "return unpack2x16float(b[n / 2u].x).y;",
        "return select(x, 1.0, x > v.y) + a[n].z - v.x;",
        "return f32(n % 8u) + 2.0 * 3.0;",
    ] {
        assert!(computing(&text(no_formula)).is_empty(), "{no_formula}");
    }
}
