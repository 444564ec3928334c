//! Every optics function on the GPU against the CPU, over thousands of inputs.
//!
//! The optics are one text for two machines (`crates/optics`), but one text is not yet one result. For each function of
//! `list.rs` a compute shader is made that calls it on every input of a buffer; what comes back is compared with what the
//! same function returns in Rust. To add a function, add its line to `list.rs`: a test fails until it is there.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod compare;
mod device;
mod inputs;
mod list;
mod shader;
mod values;

use compare::{Comparison, compare};
use device::Device;
use list::{Function, functions};
use shader::Text;
use std::collections::BTreeSet;

/// Inputs of each function. One in four numbers of them is an edge case.
const INPUTS: usize = 4096;

fn run(device: &Device, text: &Text, function: &Function) -> Comparison {
    let mut inputs = inputs::Inputs::new(function.name);
    let cases: Vec<_> = (0..INPUTS).map(|_| (function.case)(&mut inputs)).collect();
    let words: Vec<u32> = cases.iter().flat_map(|(input, _)| input.iter().copied()).collect();
    let expected: Vec<u32> = cases.iter().flat_map(|(_, output)| output.iter().copied()).collect();
    let kinds = text.result_kinds(function.name);
    assert_eq!(kinds.len() * INPUTS, expected.len(), "{}: words of a result", function.name);
    assert_eq!(
        text.argument_words(function.name) * INPUTS,
        words.len(),
        "{}: words of an input",
        function.name
    );
    let actual = device.run(function.name, &text.caller(function.name), &words, expected.len());
    compare(&kinds, &expected, &actual, function.tolerance)
}

/// Runs every function and says which differ.
fn differences(device: &Device, text: &Text) -> Vec<String> {
    let mut wrong = Vec::new();
    for function in functions() {
        let comparison = run(device, text, &function);
        if std::env::var_os("ALHAZEN_VERBOSE").is_some() {
            println!("{:32} {}", function.name, comparison.summary());
        }
        if !comparison.passes(function.tolerance) {
            wrong.push(format!("{}: {}", function.name, comparison.explain(function.tolerance)));
        }
    }
    wrong
}

#[test]
fn every_function_gives_the_same_results() {
    let Some(device) = Device::open("every_function_gives_the_same_results") else { return };
    let wrong = differences(&device, &Text::new(optics::wgsl::all()));
    assert!(wrong.is_empty(), "{} functions differ:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn every_function_is_listed() {
    let listed: Vec<_> = functions().iter().map(|f| f.name.to_owned()).collect();
    let set: BTreeSet<_> = listed.iter().cloned().collect();
    assert_eq!(set.len(), listed.len(), "a function is listed twice");
    let present = Text::new(optics::wgsl::all()).function_names();
    assert!(present.len() > 100, "only {present:?}");
    assert_eq!(set, present, "functions in `list` and in the optics");
}

#[test]
fn arguments_are_called_as_in_the_text() {
    let text = Text::new(optics::wgsl::all());
    for function in functions() {
        assert_eq!(text.argument_names(function.name), function.arguments, "arguments of {}", function.name);
    }
}

/// The harness sees a GPU that computes something else: the optics with one changed number.
#[test]
fn a_changed_text_is_noticed() {
    let Some(device) = Device::open("a_changed_text_is_noticed") else { return };
    let text = optics::wgsl::all();
    let changed = text.replacen("fn sqr(x: f32) -> f32 {", "fn sqr(y: f32) -> f32 { let x = y * 1.001;", 1);
    assert_ne!(text, changed, "the text has no such function");
    let text = Text::new(changed);
    let sqr = functions().into_iter().find(|f| f.name == "sqr").expect("listed");
    let comparison = run(&device, &text, &sqr);
    assert!(!comparison.passes(sqr.tolerance), "{}", comparison.summary());
}
