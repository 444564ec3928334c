//! The thirty tasks of `docs/viewer.md`, each done by keyboard and pointer alone, and checked.

mod files;
mod look;
mod scene;

use super::{open, until};
use egui::{Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, Pos2, TouchPhase, Vec2};
use egui_kittest::Harness;
use viewer::viewer::Viewer;

/// A window with a scene.
type Window = Harness<'static, Viewer>;

/// A task as the page lists it, and how it is done.
struct Task {
    name: &'static str,
    run: fn(&mut Window),
}

/// All of them, in the order of the page.
fn all() -> impl Iterator<Item = &'static Task> {
    look::TASKS.iter().chain(scene::TASKS).chain(files::TASKS)
}

/// Does tasks, each in a window of its own.
fn run(tasks: &[Task]) {
    for task in tasks {
        let mut window = open("three-spheres");
        until(&mut window, "a full picture", |v| v.shot().is_some_and(|shot| !shot.preview));
        (task.run)(&mut window);
        let errors = window.state().notices.iter().filter(|notice| notice.is_error);
        assert_eq!(errors.count(), 0, "{}: {:?}", task.name, window.state().notices);
    }
}

#[test]
fn looking_and_measuring() {
    run(look::TASKS);
}

#[test]
fn changing_the_scene() {
    run(scene::TASKS);
}

#[test]
fn files() {
    run(files::TASKS);
}

#[test]
fn the_page_lists_the_tasks_that_are_tested() {
    let page = include_str!("../../../../../docs/viewer.md");
    let rows = page.lines().filter_map(|line| {
        let (number, rest) = line.strip_prefix("| ")?.split_once(" | ")?;
        let number: usize = number.trim().parse().ok()?;
        Some((number, rest.split(" | ").next()?.trim()))
    });
    let listed: Vec<_> = rows.collect();
    let tested: Vec<_> = all().enumerate().map(|(i, task)| (i + 1, task.name)).collect();
    assert_eq!(listed, tested);
    assert_eq!(tested.len(), 30);
}

fn key(window: &mut Window, key: Key) {
    window.key_press(key);
    window.run_steps(3);
}

fn ctrl(window: &mut Window, key: Key) {
    window.key_press_modifiers(Modifiers::COMMAND, key);
    window.run_steps(3);
}

/// Presses a button where it is, moves the pointer and lets it go.
fn drag(window: &mut Window, from: Pos2, way: Vec2) {
    window.hover_at(from);
    window.run_steps(2);
    window.drag_at(from);
    window.run_steps(2);
    for share in [0.4, 1.0] {
        window.hover_at(from + way * share);
        window.run_steps(2);
    }
    window.drop_at(from + way);
    window.run_steps(3);
}

fn click_at(window: &mut Window, at: Pos2) {
    window.hover_at(at);
    window.run_steps(2);
    window.drag_at(at);
    window.run_steps(1);
    window.drop_at(at);
    window.run_steps(3);
}

/// Turns the wheel over the middle of the picture.
fn wheel(window: &mut Window, lines: f32, modifiers: Modifiers) {
    let at = window.state().place.center();
    window.hover_at(at);
    window.run_steps(2);
    let delta = egui::vec2(0.0, lines);
    let (unit, phase, source) = (MouseWheelUnit::Line, TouchPhase::Move, MouseWheelSource::Wheel);
    let turn = Event::MouseWheel { unit, delta, phase, source, modifiers };
    window.event_modifiers(turn, modifiers);
    // What the wheel does is spread over frames.
    window.run_steps(20);
}

/// Types into the field that has the focus.
fn type_text(window: &mut Window, text: &str) {
    window.event(Event::Text(text.into()));
    window.run_steps(3);
}

/// Waits for the newest picture of everything that is wanted.
fn settle(window: &mut Window) {
    until(window, "the picture", |v| v.is_current() && v.shot().is_some_and(|shot| !shot.preview));
}
