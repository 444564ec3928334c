//! Pictures that come from elsewhere and go elsewhere: layers of EXR files, and tev.

use super::{open, page, run, until};
use crate::common::click;
use alhazen::{ExrChannel, ExrCompression, ExrFile, ExrSamples, Rect};
use egui_kittest::kittest::Queryable;
use std::io::Read;
use std::net::TcpListener;
use viewer::exr_layers::LayerChoice;
use viewer::panels::Tab;
use viewer::viewer::{Command, Comparison, Viewer};

/// Files a picture of 32×24 pixels with a layer `normal`.
fn write_layers(path: &std::path::Path, red: f32) {
    let mut file = ExrFile::new(32, 24, Rect::full(32, 24));
    let channels =
        [("R", red), ("G", 0.5), ("B", 0.5), ("normal.X", 0.1), ("normal.Y", 0.2), ("normal.Z", 0.9)];
    for (name, value) in channels {
        let samples = ExrSamples::Float(vec![value; 32 * 24]);
        file.channels.push(ExrChannel { name: name.into(), samples });
    }
    file.write(path, ExrCompression::Zip).expect("written");
}

#[test]
fn layers_of_several_files_are_listed_and_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = ["one.exr", "two.exr"].map(|name| folder.path().join(name));
    write_layers(&files[0], 0.25);
    write_layers(&files[1], 0.75);
    let mut harness = open("cornell");
    until(&mut harness, "a full picture", |v| v.shot().is_some_and(|shot| !shot.preview));
    page(&mut harness, Tab::Image);
    files.iter().for_each(|file| harness.state_mut().compare_with_file(file));
    harness.run_steps(3);
    let shown = |v: &Viewer| match &v.comparison {
        Comparison::Stored { image, .. } => image.rgb(3, 3),
        other => panic!("{other:?}"),
    };
    assert_eq!((harness.state().tools.snapshots.len(), shown(harness.state())), (2, [0.75, 0.5, 0.5]));
    assert_eq!(harness.query_all_by_label("Layer of the file").count(), 2);
    // The list of the second file.
    harness.query_all_by_label("Layer of the file").nth(1).expect("a list").click();
    harness.run_steps(3);
    click(&mut harness, "normal");
    assert_eq!(shown(harness.state()), [0.1, 0.2, 0.9]);
    harness.query_all_by_label("Channel of the file").nth(1).expect("a list").click();
    harness.run_steps(3);
    click(&mut harness, "Z");
    assert_eq!(shown(harness.state()), [0.9; 3]);
    // The other file is as it was.
    harness.state_mut().compare_with_snapshot(0);
    assert_eq!(shown(harness.state()), [0.25, 0.5, 0.5]);
    harness.state_mut().choose_layer(0, LayerChoice { layer: 9, channel: None });
    assert_eq!(shown(harness.state()), [0.25, 0.5, 0.5], "there is no such layer");
}

/// Types of the packets that somebody is sent, and what they begin with, until the connection ends.
fn listen(listener: TcpListener) -> std::thread::JoinHandle<Vec<(u8, Vec<u8>)>> {
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("somebody comes");
        let (mut all, mut packets) = (Vec::new(), Vec::new());
        stream.read_to_end(&mut all).expect("all of it");
        let mut rest = &all[..];
        while let Some(length) = rest.first_chunk().map(|bytes| u32::from_le_bytes(*bytes) as usize) {
            packets.push((rest[4], rest[5..length].to_vec()));
            rest = &rest[length..];
        }
        packets
    })
}

#[test]
fn tev_is_sent_what_is_rendered_and_missed_aloud() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("bound").to_string();
    let thread = listen(listener);
    let mut harness = open("cornell");
    harness.state_mut().send_to_tev(address.parse().expect("an address"));
    until(&mut harness, "tev", |v| v.notices.iter().any(|n| n.text.contains("shows the picture")));
    harness.state_mut().open_source(alhazen::Source::parse("three-spheres"));
    until(&mut harness, "another scene", |v| v.generation() == 2);
    until(&mut harness, "its picture", |v| v.is_current() && v.is_sent_to_tev());
    run(&mut harness, Command::SendToTev);
    assert!(harness.state().notices.iter().any(|n| n.text.contains("gets no more pictures")));
    let packets = thread.join().expect("read");
    let begins = |kind: u8, text: &str| {
        packets.iter().any(|(k, rest)| *k == kind && String::from_utf8_lossy(rest).contains(text))
    };
    assert!(begins(4, "alhazen: cornell") && begins(6, "alhazen: cornell") && begins(2, "alhazen: cornell"));
    assert!(begins(4, "alhazen: three-spheres") && begins(6, "alhazen: three-spheres"));
    // Nobody listens there any more.
    harness.state_mut().notices.clear();
    harness.state_mut().send_to_tev(address.parse().expect("an address"));
    until(&mut harness, "an error", |v| {
        v.notices.iter().any(|n| n.is_error && n.text.contains(&format!("no tev listens at {address}")))
    });
}

#[test]
fn the_ground_has_a_grid_and_skies_are_ready_made() {
    let mut harness = open("cornell");
    until(&mut harness, "a full picture", |v| v.shot().is_some_and(|shot| !shot.preview));
    assert!(!harness.state().has_ground());
    run(&mut harness, Command::Ground);
    until(&mut harness, "the grid", Viewer::has_ground);
    run(&mut harness, Command::Ground);
    assert!(!harness.state().has_ground());
    page(&mut harness, Tab::Sky);
    let kind = |v: &Viewer| v.document.as_ref().and_then(|d| d.edits().environment.clone());
    for preset in alhazen::EnvironmentPreset::ALL {
        click(&mut harness, preset.name());
        assert_eq!(kind(harness.state()), Some(preset.into()));
    }
    click(&mut harness, "studio");
    until(&mut harness, "the picture", |v| v.is_current() && v.shot().is_some_and(|shot| !shot.preview));
    assert!(harness.state().notices.iter().all(|n| !n.is_error), "{:?}", harness.state().notices);
}
