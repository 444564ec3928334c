use super::*;

/// A linkage of a few modules that Rust makes.
fn of(modules: &[(&'static str, &'static str)]) -> Linkage {
    modules.iter().fold(Linkage::default(), |linkage, (name, text)| linkage.generate(name, *text))
}

#[test]
fn modules_stand_once_and_behind_what_they_import() {
    let linkage = of(&[
        ("root", "// Comment.\n#import left, right\nroot"),
        ("left", "#import base\nleft"),
        ("right", "#import base\n#import left\nright"),
        ("base", "base"),
    ]);
    assert_eq!(linkage.text("root").expect("linked"), "base\nleft\nright\n// Comment.\nroot\n");
}

#[test]
fn abstract_names_stand_for_what_is_bound_to_them() {
    let linkage = of(&[("root", "#import which\nroot"), ("one", "one"), ("other", "other")]);
    let text = |module| linkage.clone().bind("which", module).text("root").expect("linked");
    assert_eq!((text("one"), text("other")), ("one\nroot\n".into(), "other\nroot\n".into()));
}

#[test]
fn lines_are_there_if_names_are_defined() {
    let linkage = of(&[
        ("root", "#ifdef FAST\n#import fast\nyes\n#else\nno\n#endif\n#ifndef FAST\nslow\n#endif\nend"),
        ("fast", "fast"),
    ]);
    assert_eq!(linkage.text("root").expect("linked"), "no\nslow\nend\n");
    assert_eq!(linkage.define("FAST").text("root").expect("linked"), "fast\nyes\nend\n");
}

#[test]
fn directives_for_the_compiler_come_first_and_once() {
    let linkage = of(&[("root", "enable b;\n#import base\nroot"), ("base", "enable a;\nenable b;\nbase")]);
    assert_eq!(linkage.text("root").expect("linked"), "enable a;\nenable b;\nbase\nroot\n");
}

#[test]
fn optics_bring_what_they_need() {
    let text = of(&[("root", "#import optics::glossy")]).text("root").expect("linked");
    for name in ["fn glossy_sample(", "fn ggx_d(", "const PI"] {
        assert_eq!(text.matches(name).count(), 1, "{name}");
    }
    assert!(!text.contains("fn sheen_albedo"), "nobody asked for sheen");
}

#[test]
fn the_other_linkage_counts_where_both_say_something() {
    let linkage = of(&[("root", "#import which"), ("one", "one"), ("other", "other")]).bind("which", "one");
    let other = of(&[("other", "another")]).bind("which", "other");
    assert_eq!(linkage.with(&other).text("root").expect("linked"), "another\n");
}

#[test]
fn errors_name_the_module() {
    let linkage = of(&[
        ("lost", "#import planes, nowhere"),
        ("lost_optics", "#import optics::nothing"),
        ("unbound", "#import tracer"),
        ("circle", "#import half"),
        ("half", "#import circle"),
        ("strange", "fine\n#include file"),
        ("unopened", "#endif"),
        ("nested", "#ifdef A\n#ifdef B"),
    ]);
    let errors = [
        ("lost", "module `lost` imports `nowhere`"),
        ("lost_optics", "module `lost_optics` imports `optics::nothing`"),
        ("unbound", "module `unbound` imports `tracer`, which stands for nothing"),
        ("circle", "in a circle: circle, half, circle"),
        ("strange", "module `strange`, line 2: `#include file`"),
        ("unopened", "module `unopened`, line 1: `#endif`"),
        ("nested", "module `nested`, line 2: `#ifdef B`"),
    ];
    for (root, expected) in errors {
        let error = linkage.text(root).expect_err(root).to_string();
        assert!(error.contains(expected), "{error}");
    }
}
