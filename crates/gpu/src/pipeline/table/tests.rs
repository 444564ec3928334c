use super::*;
use scene::tables::{BindingRecord, BlasRecord, GeometryRecord};

/// Rules of an NVIDIA driver, of Mesa's software driver, and of one that is awkward on purpose.
const RULES: [TableRules; 3] = [
    TableRules { handle_size: 32, handle_alignment: 32, base_alignment: 64, max_stride: 4096 },
    TableRules { handle_size: 32, handle_alignment: 16, base_alignment: 32, max_stride: 4096 },
    TableRules { handle_size: 8, handle_alignment: 64, base_alignment: 256, max_stride: 256 },
];

fn materials() -> Vec<MaterialRecord> {
    let mut scene = scene::Scene::default();
    let model = |model| scene::Material { model, ..Default::default() };
    scene.materials = vec![
        model(scene::Model::Lambert),
        model(scene::Model::Dielectric),
        scene::Material { emission: glam::Vec3::ONE, ..model(scene::Model::Lambert) },
        scene::Material { alpha_mode: scene::AlphaMode::Mask(0.5), ..model(scene::Model::MetallicRoughness) },
    ];
    SceneTables::build(&scene).materials
}

/// Tables with the given structures (number of geometries, kind) and instances (structure, materials).
fn tables(structures: &[(u32, GeometryKind)], instances: &[(u32, &[u32])]) -> SceneTables {
    let mut tables = SceneTables { materials: materials(), ..Default::default() };
    for &(geometry_count, kind) in structures {
        let first_geometry = tables.geometries.len() as u32;
        tables.blas.push(BlasRecord { first_geometry, geometry_count, kind });
        for g in 0..geometry_count {
            tables.geometries.push(GeometryRecord {
                kind,
                first_primitive: 100 * (first_geometry + g),
                primitive_count: 10,
                first_in_blas: 10 * g,
                first_vertex: 0,
                vertex_count: 3,
                first_normal: u32::MAX,
                first_tangent: u32::MAX,
                first_uv0: u32::MAX,
                first_uv1: u32::MAX,
                first_color: u32::MAX,
            });
        }
    }
    for (blas, materials) in instances {
        let identity = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        tables.instances.push(InstanceRecord {
            object_to_world: identity,
            world_to_object: identity,
            blas: *blas,
            first_binding: tables.bindings.len() as u32,
            identity: true,
        });
        let binding =
            |&material| BindingRecord { material, first_light: u32::MAX, object: 0, placement: u32::MAX };
        tables.bindings.extend(materials.iter().map(binding));
    }
    tables
}

fn several() -> SceneTables {
    let structures = [(3, GeometryKind::Triangles), (1, GeometryKind::Triangles), (2, GeometryKind::Spheres)];
    let instances: [(u32, &[u32]); 6] =
        [(0, &[0, 1, 2]), (1, &[3]), (2, &[1, 1]), (0, &[0, 1, 2]), (0, &[2, 3, 0]), (2, &[0, 2])];
    tables(&structures, &instances)
}

/// Any structures with any materials.
fn random_tables(random: &mut testkit::Random) -> SceneTables {
    let mut below = |n: u64| random.bits() % n;
    let kinds = [GeometryKind::Triangles, GeometryKind::Spheres];
    let structures: Vec<_> =
        (0..1 + below(5)).map(|_| (1 + below(6) as u32, kinds[below(2) as usize])).collect();
    let instances: Vec<(u32, Vec<u32>)> = (0..below(30))
        .map(|_| {
            let blas = below(structures.len() as u64) as usize;
            (blas as u32, (0..structures[blas].0).map(|_| below(4) as u32).collect())
        })
        .collect();
    tables(&structures, &instances.iter().map(|(blas, m)| (*blas, &m[..])).collect::<Vec<_>>())
}

/// Looks up every geometry of every instance for every ray type; returns how many those were.
fn assert_records_are_where_the_formula_says(tables: &SceneTables) -> usize {
    let table = HitTable::new(tables);
    let mut seen = 0;
    for (instance, &offset) in tables.instances.iter().zip(&table.instance_offsets) {
        let blas = &tables.blas[instance.blas as usize];
        for geometry in 0..blas.geometry_count {
            let material = tables.bindings[(instance.first_binding + geometry) as usize].material;
            let record = &tables.geometries[(blas.first_geometry + geometry) as usize];
            for ray in [RayType::Radiance, RayType::Shadow] {
                let (group, data) = table.records[record_index(ray, geometry, offset) as usize];
                assert_eq!(group, HitGroup::new(ray, blas.kind, &tables.materials[material as usize]));
                assert_eq!(data.material, material);
                assert_eq!((data.geometry, data.first_in_blas), (geometry, record.first_in_blas));
                assert_eq!(tables.bindings[data.binding as usize].material, material);
                seen += 1;
            }
        }
    }
    seen
}

#[test]
fn records_are_where_the_formula_says() {
    assert_eq!(assert_records_are_where_the_formula_says(&several()), 2 * (3 + 1 + 2 + 3 + 3 + 2));
    let mut random = testkit::Random::new(3);
    let seen: usize =
        (0..200).map(|_| assert_records_are_where_the_formula_says(&random_tables(&mut random))).sum();
    assert!(seen > 10_000, "only {seen} combinations");
}

#[test]
fn instances_share_records_only_with_the_same_materials() {
    let table = HitTable::new(&several());
    let offsets = &table.instance_offsets;
    assert_eq!(offsets[0], offsets[3]);
    assert_ne!(offsets[0], offsets[4]);
    assert_ne!(offsets[2], offsets[5]);
    assert_eq!(table.records.len(), 2 * (3 + 1 + 2 + 3 + 2));
}

/// The layout keeps to the rules, nothing overlaps, and what was put there is read back by the formula.
#[test]
fn bytes_keep_to_the_rules() {
    let tables = several();
    let table = HitTable::new(&tables);
    for rules in RULES {
        let layout = TableLayout::new(&rules, table.records.len() as u32).expect("fits");
        for region in [layout.generation, layout.miss, layout.hit] {
            assert_eq!(region.offset % u64::from(rules.base_alignment), 0, "{layout:?}");
            assert_eq!(region.stride % u64::from(rules.handle_alignment), 0, "{layout:?}");
        }
        assert!(layout.miss.offset >= layout.generation.size());
        assert!(layout.hit.offset >= layout.miss.offset + layout.miss.size());
        let handles: Vec<Vec<u8>> =
            (0..ShaderGroup::all().len()).map(|i| vec![i as u8 + 1; rules.handle_size as usize]).collect();
        let bytes = layout.bytes(&table, |group| &handles[group.index()]);
        assert_eq!(bytes.len() as u64, layout.size);
        let byte = |at: u64| bytes[at as usize];
        assert_eq!(byte(layout.generation.offset), 1);
        assert_eq!([byte(layout.miss.record(0)), byte(layout.miss.record(1))], [2, 3]);
        for (instance, &offset) in tables.instances.iter().zip(&table.instance_offsets) {
            let blas = &tables.blas[instance.blas as usize];
            for geometry in 0..blas.geometry_count {
                for ray in [RayType::Radiance, RayType::Shadow] {
                    let at = layout.hit.record(record_index(ray, geometry, offset));
                    let material = tables.bindings[(instance.first_binding + geometry) as usize].material;
                    let group = HitGroup::new(ray, blas.kind, &tables.materials[material as usize]);
                    assert_eq!(usize::from(byte(at)), ShaderGroup::Hit(group).index() + 1);
                    let data =
                        &bytes[(at + u64::from(rules.handle_size)) as usize..][..size_of::<HitRecord>()];
                    let record: HitRecord = bytemuck::pod_read_unaligned(data);
                    assert_eq!((record.material, record.geometry), (material, geometry));
                }
            }
        }
    }
}

#[test]
fn a_device_without_room_for_the_data_is_refused() {
    let rules = TableRules { max_stride: 40, ..RULES[1] };
    assert_eq!(TableLayout::new(&rules, 1), None);
}

#[test]
fn an_empty_scene_has_a_table() {
    let table = HitTable::new(&SceneTables::default());
    let layout = TableLayout::new(&RULES[0], table.records.len() as u32).expect("fits");
    assert_eq!(table.records.len(), 0);
    assert_eq!(layout.hit.count, 1);
}

#[test]
fn groups_are_where_their_index_says() {
    for (index, group) in ShaderGroup::all().iter().enumerate() {
        assert_eq!(group.index(), index, "{group:?}");
    }
    assert_eq!(ShaderGroup::all().len(), 1 + 2 + 9 + 3);
}

#[test]
fn every_class_has_a_material() {
    let classes: Vec<_> = materials().iter().map(MaterialClass::of).collect();
    use MaterialClass::{Dielectric, Emissive, Reflecting};
    assert_eq!(classes, [Reflecting, Dielectric, Emissive, Reflecting]);
}

#[test]
fn record_layout_matches_the_shader() {
    let text = crate::pipeline::hits_text(crate::shader::Variant::default()).expect("linked");
    let module = crate::shader::check::parse(&text);
    crate::layout::assert_layout!(module, HitRecord { material, geometry, first_in_blas, binding });
}
