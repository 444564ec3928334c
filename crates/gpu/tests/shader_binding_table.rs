//! The figure of `docs/shader-binding-table.md`, made from the offsets that the code computes, and a test that it is up to
//! date. `cargo xtask docs` writes it.
#![cfg(not(target_vendor = "apple"))]

use gpu::pipeline::table::{
    HitGroup, HitTable, MaterialClass, RAY_TYPES, RayType, TableLayout, TableRules, record_index,
};
use scene::tables::{GeometryKind, SceneTables};
use scene::{AlphaMode, Instance, Material, Mesh, Model, Part, Scene, Shape, Sphere, shapes};
use std::fmt::Write;

/// The rules of the driver of an NVIDIA H200.
const RULES: TableRules =
    TableRules { handle_size: 32, handle_alignment: 32, base_alignment: 64, max_stride: 4096 };

/// Two houses that are alike, one with other materials, and a set of spheres.
fn example() -> Scene {
    let mut scene = Scene::default();
    let material = |name: &str, model| Material { name: name.into(), model, ..Material::default() };
    scene.materials = vec![
        material("plaster", Model::Lambert),
        material("glass", Model::Dielectric),
        Material { emission: glam::Vec3::ONE, ..material("lamp", Model::Lambert) },
        Material { alpha_mode: AlphaMode::Mask(0.5), ..material("leaves", Model::Lambert) },
    ];
    let triangles = || Shape::Triangles(shapes::cuboid(glam::Vec3::ONE, 0.0, 1));
    let spheres = Shape::Spheres(vec![Sphere { center: glam::Vec3::ZERO, radius: 1.0 }]);
    let part = |shape, material| Part { shape, material };
    scene.meshes = vec![
        Mesh { name: "house".into(), parts: vec![part(triangles(), 0), part(triangles(), 1)] },
        Mesh { name: "drops".into(), parts: vec![part(spheres, 1)] },
    ];
    let at = |x: f32| glam::Affine3A::from_translation(glam::vec3(x, 0.0, 0.0));
    let instance = |name: &str, mesh, x| Instance { dynamic: true, ..Instance::new(name, mesh, at(x)) };
    scene.instances = vec![
        instance("house A", 0, 0.0),
        instance("house B", 0, 3.0),
        Instance { materials: Some(vec![3, 2]), ..instance("house C", 0, 6.0) },
        instance("drops", 1, 9.0),
    ];
    scene
}

fn group_name(group: &HitGroup) -> String {
    let primitive = match group.primitive {
        GeometryKind::Triangles => "triangles",
        GeometryKind::Spheres => "spheres",
    };
    let holes = if group.holes { ", holes" } else { "" };
    let class = match (group.ray, group.class) {
        (RayType::Shadow, _) => "any material",
        (_, MaterialClass::Reflecting) => "reflecting",
        (_, MaterialClass::Dielectric) => "dielectric",
        (_, MaterialClass::Emissive) => "emissive",
    };
    format!("{primitive}{holes}, {class}")
}

/// A row of the figure.
struct Row {
    offset: u64,
    size: u64,
    fill: &'static str,
    title: String,
    data: String,
}

fn rows(scene: &Scene, table: &HitTable, layout: &TableLayout) -> Vec<Row> {
    let mut rows = vec![Row {
        offset: layout.generation.offset,
        size: layout.generation.stride,
        fill: "#d9d9e8",
        title: "ray generation".into(),
        data: "–".into(),
    }];
    for ray in [RayType::Radiance, RayType::Shadow] {
        rows.push(Row {
            offset: layout.miss.record(ray as u32),
            size: layout.miss.stride,
            fill: "#e8e3d0",
            title: format!("miss, {ray:?}").to_lowercase(),
            data: "–".into(),
        });
    }
    for (index, (group, record)) in (0..).zip(&table.records) {
        let material = &scene.materials[record.material as usize].name;
        rows.push(Row {
            offset: layout.hit.record(index),
            size: layout.hit.stride,
            fill: if group.ray == RayType::Radiance { "#cfe5d6" } else { "#d0d0d0" },
            title: format!("{index}: {:?}: {}", group.ray, group_name(group)).to_lowercase(),
            data: format!(
                "material {} ({material}), geometry {}, first {}, binding {}",
                record.material, record.geometry, record.first_in_blas, record.binding
            ),
        });
    }
    rows
}

const ROW_HEIGHT: f64 = 26.0;
const TOP: f64 = 84.0;
/// Left edges of the table and of the column of data.
const TABLE_X: f64 = 290.0;
const DATA_X: f64 = 610.0;
const WIDTH: f64 = 1010.0;

fn text(svg: &mut String, x: f64, y: f64, more: &str, words: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\" {more}>{words}</text>");
}

fn figure() -> String {
    let scene = example();
    let tables = SceneTables::build(&scene);
    let table = HitTable::new(&tables);
    let layout = TableLayout::new(&RULES, table.records.len() as u32).expect("the records fit");
    let rows = rows(&scene, &table, &layout);
    let height = TOP + ROW_HEIGHT * rows.len() as f64 + 24.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
    );
    let bold = "font-weight=\"bold\"";
    let formula = format!(
        "record = ray type (radiance {}, shadow {}) + {RAY_TYPES} × geometry + instance offset",
        RayType::Radiance as u32,
        RayType::Shadow as u32
    );
    text(&mut svg, TABLE_X, 24.0, "font-size=\"15\" font-weight=\"bold\"", &formula);
    let sizes = format!(
        "handle {} bytes, handle alignment {}, base alignment {}: hit records {} bytes apart, {} bytes in all",
        RULES.handle_size, RULES.handle_alignment, RULES.base_alignment, layout.hit.stride, layout.size
    );
    text(&mut svg, TABLE_X, 44.0, "fill=\"#444\"", &sizes);
    text(&mut svg, 16.0, TOP - 12.0, bold, "instance, its offset");
    text(&mut svg, TABLE_X - 8.0, TOP - 12.0, "text-anchor=\"end\" font-weight=\"bold\"", "byte");
    text(&mut svg, TABLE_X + 8.0, TOP - 12.0, bold, "record: shaders");
    text(&mut svg, DATA_X + 8.0, TOP - 12.0, bold, "data");
    for (i, row) in rows.iter().enumerate() {
        let y = TOP + ROW_HEIGHT * i as f64;
        let _ = writeln!(
            svg,
            "<rect x=\"{TABLE_X}\" y=\"{y}\" width=\"{}\" height=\"{ROW_HEIGHT}\" fill=\"{}\" stroke=\"#555\"/>",
            WIDTH - TABLE_X - 16.0,
            row.fill
        );
        let middle = y + 17.0;
        text(&mut svg, TABLE_X - 8.0, middle, "text-anchor=\"end\"", &format!("{}", row.offset));
        text(&mut svg, TABLE_X + 8.0, middle, "", &row.title);
        text(&mut svg, DATA_X + 8.0, middle, "", &row.data);
        assert!(row.size > 0);
    }
    arrows(&mut svg, &scene, &tables, &table);
    svg.push_str("</svg>\n");
    svg
}

/// From each instance to its first record, and brackets for its geometries.
fn arrows(svg: &mut String, scene: &Scene, tables: &SceneTables, table: &HitTable) {
    let first_hit = 1 + RAY_TYPES;
    let row_y = |record: u32| TOP + ROW_HEIGHT * f64::from(first_hit + record);
    for (i, (instance, &offset)) in tables.instances.iter().zip(&table.instance_offsets).enumerate() {
        let object = tables.bindings[instance.first_binding as usize].object;
        let name = &scene.instances[object as usize].name;
        let y = row_y(0) + 40.0 * i as f64;
        let label = format!("{name}: {offset}");
        let _ = writeln!(
            svg,
            "<rect x=\"16\" y=\"{y}\" width=\"110\" height=\"{ROW_HEIGHT}\" fill=\"#f4e1d2\" stroke=\"#555\"/>"
        );
        text(svg, 24.0, y + 17.0, "", &label);
        let first = record_index(RayType::Radiance, 0, offset);
        let to = row_y(first) + ROW_HEIGHT / 2.0 + 3.0 * i as f64 - 4.0;
        let _ = writeln!(
            svg,
            "<path d=\"M126 {}C190 {},190 {to},244 {to}m-6 -4l6 4l-6 4\" stroke=\"#a33\" fill=\"none\"/>",
            y + 13.0,
            y + 13.0
        );
    }
}

fn file() -> std::path::PathBuf {
    testkit::repository_root().join("docs/images/shader-binding-table.svg")
}

/// With `ALHAZEN_UPDATE_DOCS=1` the figure is written instead.
#[test]
fn the_figure_is_up_to_date() {
    if std::env::var_os("ALHAZEN_UPDATE_DOCS").is_some_and(|v| v == "1") {
        std::fs::write(file(), figure()).expect("the figure can be written");
    }
    let shown = std::fs::read_to_string(file()).unwrap_or_default();
    // A checkout may end lines in another way.
    assert!(shown.replace("\r\n", "\n") == figure(), "{} is old: run `cargo xtask docs`", file().display());
}

/// What the figure shows is the rule: houses that are alike share records, others have their own.
#[test]
fn the_example_shows_sharing() {
    let tables = SceneTables::build(&example());
    let table = HitTable::new(&tables);
    assert_eq!(table.instance_offsets, [0, 0, 4, 8]);
    assert_eq!(record_index(RayType::Shadow, 1, table.instance_offsets[2]), 7);
}
