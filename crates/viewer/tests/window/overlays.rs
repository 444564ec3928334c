//! Windows over the picture: one at a time, and Escape closes what is on top.

use super::{open, page, press, run, until};
use crate::common::click;
use egui::Key;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use viewer::panels::{Overlay, Tab};
use viewer::viewer::{Command, Top, Viewer};

fn select_first(harness: &mut Harness<'_, Viewer>) {
    harness.state_mut().choose(viewer::outliner::Item::Object(0));
    harness.run_steps(2);
}

#[test]
fn commands_are_found_by_typing() {
    let mut harness = open("cornell");
    let before = harness.state().shown.tone.exposure;
    harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::P);
    harness.run_steps(3);
    assert_eq!(harness.state().top(), Some(Top::Overlay(Overlay::Palette)));
    harness.get_by_label("Type to find a command or a setting").type_text("stop brighter");
    harness.run_steps(2);
    press(&mut harness, Key::Enter);
    assert_eq!(harness.state().top(), None);
    assert!(harness.state().shown.tone.exposure > before);
}

#[test]
fn settings_are_found_by_typing_and_marked_on_their_page() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Objects);
    run(&mut harness, Command::Palette);
    harness.get_by_label("Type to find a command or a setting").type_text("exposure");
    harness.run_steps(2);
    // Two commands come first.
    press(&mut harness, Key::ArrowDown);
    press(&mut harness, Key::ArrowDown);
    press(&mut harness, Key::Enter);
    let sought = harness.state().open.sought.expect("shown");
    assert_eq!(
        (harness.state().open.tab, sought.label, sought.found),
        (Tab::Render, "Exposure (stops)", true)
    );
    // What is not to be had at the moment is said.
    run(&mut harness, Command::Palette);
    harness.get_by_label("Type to find a command or a setting").type_text("shadow rays");
    harness.run_steps(2);
    press(&mut harness, Key::Enter);
    until(&mut harness, "a message", |v| v.notices.iter().any(|n| n.text.contains("\"Shadow rays\"")));
}

#[test]
fn escape_closes_what_is_on_top_and_then_ends_the_selection() {
    let mut harness = open("cornell");
    select_first(&mut harness);
    let is_selected = |h: &Harness<'_, Viewer>| h.state().selection.is_some();
    press(&mut harness, Key::F1);
    assert_eq!(harness.state().top(), Some(Top::Overlay(Overlay::Help)));
    run(&mut harness, Command::Palette);
    assert_eq!(harness.state().top(), Some(Top::Overlay(Overlay::Palette)), "one at a time");
    assert!(harness.query_by_label("Mouse and keys").is_none());
    press(&mut harness, Key::Escape);
    assert!(harness.state().top().is_none() && is_selected(&harness));
    run(&mut harness, Command::Open);
    assert_eq!(harness.state().top(), Some(Top::Browser));
    press(&mut harness, Key::Escape);
    assert!(harness.state().top().is_none() && is_selected(&harness));
    harness.state_mut().notice("the disk is full", true);
    run(&mut harness, Command::Help);
    assert_eq!(harness.state().top(), Some(Top::Errors));
    assert!(harness.query_by_label("Mouse and keys").is_none(), "two windows at a time");
    press(&mut harness, Key::Escape);
    assert_eq!(harness.state().top(), Some(Top::Overlay(Overlay::Help)), "what was below is there again");
    press(&mut harness, Key::Escape);
    assert!(harness.state().top().is_none() && is_selected(&harness));
    press(&mut harness, Key::Escape);
    assert!(!is_selected(&harness));
}

#[test]
fn escape_closes_menus_and_ends_typing_but_not_the_selection() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Objects);
    select_first(&mut harness);
    click(&mut harness, "Edit");
    assert!(harness.query_by_label_contains("Duplicate the object").is_some(), "the menu is closed");
    press(&mut harness, Key::Escape);
    assert!(harness.query_by_label_contains("Duplicate the object").is_none());
    assert!(harness.state().selection.is_some());
    harness.get_by_label("Find").focus();
    harness.run_steps(2);
    press(&mut harness, Key::Escape);
    assert!(harness.state().selection.is_some(), "what ends typing ends nothing else");
    press(&mut harness, Key::Escape);
    assert!(harness.state().selection.is_none());
}
