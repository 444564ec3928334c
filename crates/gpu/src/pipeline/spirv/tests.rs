use super::*;
use crate::kernel::KernelKind;
use crate::pipeline::{hits_text, kernel_text, linkage};
use crate::shader::{Linkage, Variant};

const KERNEL: &str = "
#import tracer
@group(2) @binding(0) var<storage, read_write> seen: array<f32>;
@ray_generation fn generate(@builtin(ray_invocation_id) id: vec3u) {
    let hit = trace_closest(vec3f(0.0), vec3f(1.0), 0.0, 1.0, 0u);
    seen[id.x] = select(hit.t, 1.0, trace_any(vec3f(0.0), vec3f(1.0), 0.0, 1.0, 0u));
}
";

fn hits() -> RayShaders {
    RayShaders::new("hits", &hits_text(Variant { alpha: true, ..Variant::default() }).expect("linked"))
        .expect("valid")
}

fn storage_classes(module: &Module) -> HashSet<StorageClass> {
    let variables = module.types_global_values.iter().filter(|i| i.class.opcode == Op::Variable);
    let class = |i: &Instruction| match i.operands.first() {
        Some(Operand::StorageClass(class)) => Some(*class),
        _ => None,
    };
    variables.filter_map(class).collect()
}

fn opcodes(module: &Module) -> Vec<Op> {
    let blocks = module.functions.iter().flat_map(|f| &f.blocks);
    blocks.flat_map(|b| &b.instructions).map(|i| i.class.opcode).collect()
}

fn execution_model(module: &Module) -> ExecutionModel {
    match module.entry_points[0].operands[0] {
        Operand::ExecutionModel(model) => model,
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn hit_shaders_read_attributes_and_records() {
    let hits = hits();
    let triangle = hits.patched("hit_triangle_reflecting", true).expect("SPIR-V");
    let classes = storage_classes(&triangle);
    assert!(classes.contains(&StorageClass::HitAttributeKHR), "{classes:?}");
    assert!(classes.contains(&StorageClass::ShaderRecordBufferKHR), "{classes:?}");
    let sphere = storage_classes(&hits.patched("hit_sphere_reflecting", true).expect("SPIR-V"));
    assert!(sphere.contains(&StorageClass::ShaderRecordBufferKHR), "{sphere:?}");
    assert!(!sphere.contains(&StorageClass::HitAttributeKHR), "spheres report none: {sphere:?}");
}

#[test]
fn moved_variables_have_no_decorations() {
    let module = hits().patched("hit_triangle_reflecting", true).expect("SPIR-V");
    for name in ["hit_attribute", "hit_record"] {
        let variable = Operand::IdRef(named(&module, name).expect("is there"));
        assert!(module.annotations.iter().all(|i| i.operands.first() != Some(&variable)), "{name}");
    }
}

/// Every pointer made from a variable is in the variable's storage class.
#[test]
fn pointers_are_in_their_variables_class() {
    for name in ["hit_triangle_emissive", "look_for_holes", INTERSECTION] {
        let module = hits().patched(name, true).expect("SPIR-V");
        let class_of_type = |id: Word| {
            let declared =
                module.types_global_values.iter().find(|i| i.result_id == Some(id)).expect("declared");
            declared.operands[0].clone()
        };
        let mut class_of_pointer: std::collections::HashMap<Word, Operand> = module
            .types_global_values
            .iter()
            .filter(|i| i.class.opcode == Op::Variable)
            .map(|i| (i.result_id.expect("id"), i.operands[0].clone()))
            .collect();
        let mut seen = 0;
        for instruction in module.functions.iter().flat_map(|f| &f.blocks).flat_map(|b| &b.instructions) {
            let Some(&Operand::IdRef(base)) = instruction.operands.first() else { continue };
            if instruction.class.opcode == Op::AccessChain
                && let Some(class) = class_of_pointer.get(&base).cloned()
            {
                assert_eq!(class_of_type(instruction.result_type.expect("type")), class, "{name}");
                class_of_pointer.insert(instruction.result_id.expect("id"), class);
                seen += 1;
            }
        }
        assert!(seen > 0, "{name} has no pointers");
    }
}

#[test]
fn candidates_can_be_ignored() {
    let module = hits().patched("look_for_holes", true).expect("SPIR-V");
    assert_eq!(execution_model(&module), ExecutionModel::AnyHitKHR);
    assert!(opcodes(&module).contains(&Op::IgnoreIntersectionKHR));
}

#[test]
fn spheres_are_met_by_an_intersection_shader() {
    let module = hits().patched(INTERSECTION, true).expect("SPIR-V");
    assert_eq!(execution_model(&module), ExecutionModel::IntersectionKHR);
    assert!(opcodes(&module).contains(&Op::ReportIntersectionKHR));
    assert!(!storage_classes(&module).contains(&StorageClass::IncomingRayPayloadKHR));
}

/// Offset, stride and miss index of every trace come from the ray type.
#[test]
fn traces_choose_their_records() {
    let text = Linkage::of(Variant::default())
        .with(&linkage())
        .generate("test", KERNEL)
        .text("test")
        .expect("linked");
    let module =
        RayShaders::new("generation", &text).expect("valid").patched("generate", true).expect("SPIR-V");
    let constant = |id: Word| {
        let declared = module.types_global_values.iter().find(|i| i.result_id == Some(id));
        declared.filter(|i| i.class.opcode == Op::Constant).map(|i| i.operands[0].clone())
    };
    let blocks: Vec<_> = module.functions.iter().flat_map(|f| &f.blocks).collect();
    let mut traces = 0;
    for block in blocks {
        for (at, instruction) in block.instructions.iter().enumerate() {
            if instruction.class.opcode != Op::TraceRayKHR {
                continue;
            }
            traces += 1;
            let (shift, and) = (&block.instructions[at - 2], &block.instructions[at - 1]);
            assert_eq!((shift.class.opcode, and.class.opcode), (Op::ShiftRightLogical, Op::BitwiseAnd));
            let ray_type = Operand::IdRef(and.result_id.expect("id"));
            assert_eq!(instruction.operands[3], ray_type, "offset");
            assert_eq!(instruction.operands[5], ray_type, "miss index");
            let Operand::IdRef(stride) = instruction.operands[4] else { panic!("no stride") };
            assert_eq!(constant(stride), Some(Operand::LiteralBit32(RAY_TYPES)));
            let mask = &block.instructions[at - 3];
            assert_eq!(Operand::IdRef(mask.result_id.expect("id")), instruction.operands[2], "cull mask");
            assert_eq!(shift.operands[0], mask.operands[0], "both come from what the WGSL says");
        }
    }
    assert!(traces > 0);
}

/// All shaders of all pipelines are valid, and what the driver is given can be written. Only Vulkan has them.
#[test]
fn every_shader_can_be_written() {
    for variant in Variant::all() {
        for kind in KernelKind::ALL {
            let shaders =
                RayShaders::new(kind.name(), &kernel_text(kind, variant).expect("linked")).expect("valid");
            let entry_points: Vec<_> = shaders.entry_points().collect();
            assert_eq!(entry_points, [("main", naga::ShaderStage::RayGeneration)]);
            assert!(shaders.spirv("main", true).expect("SPIR-V").len() > 1000);
        }
    }
    for alpha in [false, true] {
        let hits =
            RayShaders::new("hits", &hits_text(Variant { alpha, ..Variant::default() }).expect("linked"))
                .expect("valid");
        let names: Vec<_> = hits.entry_points().map(|(name, _)| name.to_owned()).collect();
        assert_eq!(names.len(), 2 + 6 + 1 + 1);
        for name in names {
            assert!(hits.spirv(&name, true).expect("SPIR-V").len() > 100, "{name}");
        }
    }
}

#[test]
fn broken_text_is_an_error_that_names_the_shader() {
    let error = RayShaders::new("broken", "fn f() -> f32 { return nothing; }").err().expect("an error");
    assert!(error.to_string().contains("broken"), "{error}");
    let error = hits().spirv("no_such_shader", true).expect_err("an error");
    assert!(error.to_string().contains("no_such_shader"), "{error}");
}
