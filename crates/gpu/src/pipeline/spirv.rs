//! Ray tracing shaders from WGSL, and what WGSL has no words for.
//!
//! naga 30 writes SPIR-V of ray generation, miss, closest-hit and any-hit shaders. It has no words for hit attributes,
//! shader records, the operands with which `OpTraceRayKHR` chooses records, for ignoring a candidate and for intersection
//! shaders. Those are written in WGSL as something else of the same shape and changed here, in the SPIR-V:
//!
//! | WGSL | becomes |
//! |---|---|
//! | `var<private> hit_attribute` | a variable in storage class `HitAttributeKHR` |
//! | `var<storage> hit_record` | a variable in storage class `ShaderRecordBufferKHR` |
//! | `traceRay` with ray type `r` in bits 8 to 11 of the cull mask, which has 8 bits | SBT offset `r`, SBT stride [`RAY_TYPES`], miss index `r` |
//! | calls of `fn ignore_intersection()` | end in `OpIgnoreIntersectionKHR` |
//! | calls of `fn report_intersection(t: f32) -> bool` | `OpReportIntersectionKHR` |
//! | the any-hit entry point `intersect_sphere_shader` | execution model `IntersectionKHR` |
//!
//! What a shader does not have is left alone, so the same steps serve all of them; tests check that each step found what
//! it was made for.

use super::table::RAY_TYPES;
use crate::GpuError;
use naga::valid::Capabilities;
use rspirv::binary::Assemble;
use rspirv::dr::{Block, Instruction, Module, Operand};
use rspirv::spirv::{ExecutionModel, Op, StorageClass, Word};
use std::collections::HashSet;

/// Bit of the cull mask where the ray type begins, as the WGSL writes it.
pub const RAY_TYPE_SHIFT: u32 = 8;

/// A parsed and validated WGSL text with ray tracing entry points.
pub struct RayShaders {
    name: String,
    module: naga::Module,
    info: naga::valid::ModuleInfo,
}

impl RayShaders {
    /// Parses and validates `text`; `name` is for messages.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with naga's message.
    pub fn new(name: &str, text: &str) -> Result<Self, GpuError> {
        let refused = |reason| GpuError::Shader { shader: name.to_owned(), reason };
        let module = naga::front::wgsl::parse_str(text).map_err(|e| refused(e.emit_to_string(text)))?;
        // Scenes have binding arrays only where the device has them.
        let capabilities = Capabilities::RAY_TRACING_PIPELINE
            | Capabilities::PRIMITIVE_INDEX
            | Capabilities::SHADER_FLOAT16_IN_FLOAT32
            | Capabilities::TEXTURE_AND_SAMPLER_BINDING_ARRAY
            | Capabilities::TEXTURE_AND_SAMPLER_BINDING_ARRAY_NON_UNIFORM_INDEXING;
        let info = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities)
            .validate(&module)
            .map_err(|e| refused(e.emit_to_string(text)))?;
        Ok(Self { name: name.to_owned(), module, info })
    }

    /// The naga module, for reflection.
    pub fn module(&self) -> &naga::Module {
        &self.module
    }

    /// Names and stages of the entry points.
    pub fn entry_points(&self) -> impl Iterator<Item = (&str, naga::ShaderStage)> {
        self.module.entry_points.iter().map(|e| (e.name.as_str(), e.stage))
    }

    /// SPIR-V of one entry point, patched. `checks`: whether accesses out of bounds are caught, which costs time.
    ///
    /// # Errors
    /// [`GpuError::Shader`] if there is no such entry point, or its SPIR-V is not what the patches expect.
    pub fn spirv(&self, entry_point: &str, checks: bool) -> Result<Vec<u32>, GpuError> {
        Ok(self.patched(entry_point, checks)?.assemble())
    }

    fn patched(&self, entry_point: &str, checks: bool) -> Result<Module, GpuError> {
        let refused = |reason| GpuError::Shader { shader: format!("{}, {entry_point}", self.name), reason };
        let stage = self.module.entry_points.iter().find(|e| e.name == entry_point).map(|e| e.stage);
        let shader_stage = stage.ok_or_else(|| refused("there is no such entry point".into()))?;
        let pipeline = naga::back::spv::PipelineOptions { shader_stage, entry_point: entry_point.to_owned() };
        let words = naga::back::spv::write_vec(&self.module, &self.info, &options(checks), Some(&pipeline))
            .map_err(|e| refused(e.to_string()))?;
        let mut module = rspirv::dr::load_words(words).map_err(|e| refused(e.to_string()))?;
        patch(&mut module).map_err(refused)?;
        Ok(module)
    }
}

fn options(checks: bool) -> naga::back::spv::Options<'static> {
    use naga::back::spv::{Options, WriterFlags};
    use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
    let policy = if checks { BoundsCheckPolicy::Restrict } else { BoundsCheckPolicy::Unchecked };
    Options {
        lang_version: (1, 4),
        // The patches find variables and functions by their names.
        flags: WriterFlags::DEBUG,
        bounds_check_policies: BoundsCheckPolicies { index: policy, buffer: policy, ..Default::default() },
        // All loops are our own, and end.
        force_loop_bounding: false,
        trace_ray_argument_validation: false,
        ..Default::default()
    }
}

/// All patches. The error says what was not as expected.
fn patch(module: &mut Module) -> Result<(), String> {
    move_variable(module, "hit_attribute", StorageClass::HitAttributeKHR)?;
    move_variable(module, "hit_record", StorageClass::ShaderRecordBufferKHR)?;
    choose_records(module)?;
    end_ignored(module)?;
    report(module)?;
    make_intersection(module)
}

/// The id that has a name, if there is one.
fn named(module: &Module, name: &str) -> Option<Word> {
    let is_it = |i: &&Instruction| {
        i.class.opcode == Op::Name
            && matches!(i.operands.get(1), Some(Operand::LiteralString(n)) if n == name)
    };
    match module.debug_names.iter().find(is_it)?.operands.first() {
        Some(Operand::IdRef(id)) => Some(*id),
        _ => None,
    }
}

fn new_id(module: &mut Module) -> Result<Word, String> {
    let header = module.header.as_mut().ok_or("it has no header")?;
    header.bound += 1;
    Ok(header.bound - 1)
}

/// Moves a module-scope variable, and all pointers made from it, into another storage class.
fn move_variable(module: &mut Module, name: &str, class: StorageClass) -> Result<(), String> {
    let Some(variable) = named(module, name) else { return Ok(()) };
    let is_variable = |i: &Instruction| i.result_id == Some(variable);
    let Some(at) = module.types_global_values.iter().position(is_variable) else {
        return Err(format!("{name} is no variable of the module"));
    };
    let old = module.types_global_values[at].result_type.ok_or_else(|| format!("{name} has no type"))?;
    let pointer = pointer_type(module, old, class, at)?;
    let variable_now = module.types_global_values.iter_mut().find(|i| is_variable(i)).ok_or("it is lost")?;
    variable_now.result_type = Some(pointer);
    // Without an initial value: it is somebody else's.
    variable_now.operands = vec![Operand::StorageClass(class)];
    // Nothing that WGSL said of it (where it is bound, that it is only read) can be said of what it is now.
    module.annotations.retain(|i| i.operands.first() != Some(&Operand::IdRef(variable)));
    retype_chains(module, variable, class)
}

/// The type of pointers in `class` to what the pointer type `old` points to; made at `at` among the types.
fn pointer_type(module: &mut Module, old: Word, class: StorageClass, at: usize) -> Result<Word, String> {
    let types = &module.types_global_values;
    let declared = types.iter().find(|i| i.result_id == Some(old)).ok_or("a type is not declared")?;
    let Some(&Operand::IdRef(pointee)) = declared.operands.get(1) else {
        return Err(format!("type {old} is no pointer"));
    };
    let operands = vec![Operand::StorageClass(class), Operand::IdRef(pointee)];
    let same = |i: &&Instruction| i.class.opcode == Op::TypePointer && i.operands == operands;
    if let Some(id) = types[..at].iter().find(same).and_then(|i| i.result_id) {
        return Ok(id);
    }
    let id = new_id(module)?;
    module.types_global_values.insert(at, Instruction::new(Op::TypePointer, None, Some(id), operands));
    Ok(id)
}

/// Gives pointers into `variable` the types that its new storage class demands.
fn retype_chains(module: &mut Module, variable: Word, class: StorageClass) -> Result<(), String> {
    let mut pointers = HashSet::from([variable]);
    let mut wanted = Vec::new();
    for (f, function) in module.functions.iter().enumerate() {
        for (b, block) in function.blocks.iter().enumerate() {
            for (i, instruction) in block.instructions.iter().enumerate() {
                let Some(&Operand::IdRef(base)) = instruction.operands.first() else { continue };
                let is_pointer =
                    matches!(instruction.class.opcode, Op::AccessChain | Op::InBoundsAccessChain);
                if is_pointer && pointers.contains(&base) {
                    pointers.extend(instruction.result_id);
                    wanted.push((f, b, i, instruction.result_type.ok_or("a pointer has no type")?));
                }
            }
        }
    }
    for (f, b, i, old) in wanted {
        let end = module.types_global_values.len();
        let new = pointer_type(module, old, class, end)?;
        module.functions[f].blocks[b].instructions[i].result_type = Some(new);
    }
    Ok(())
}

/// Gives every `OpTraceRayKHR` the offset, stride and miss index of the ray type in its cull mask.
fn choose_records(module: &mut Module) -> Result<(), String> {
    let traces = |module: &Module| {
        let instructions = module.functions.iter().flat_map(|f| &f.blocks).flat_map(|b| &b.instructions);
        instructions.filter(|i| i.class.opcode == Op::TraceRayKHR).count()
    };
    if traces(module) == 0 {
        return Ok(());
    }
    let uint = uint_type(module)?;
    let mut number = |value| constant(module, uint, value);
    let (shift, masks) = (number(RAY_TYPE_SHIFT)?, number((1 << RAY_TYPE_SHIFT) - 1)?);
    let (types, stride) = (number(0xf)?, number(RAY_TYPES)?);
    let mut functions = std::mem::take(&mut module.functions);
    for block in functions.iter_mut().flat_map(|f| &mut f.blocks) {
        let mut at = 0;
        while at < block.instructions.len() {
            if block.instructions[at].class.opcode == Op::TraceRayKHR {
                let (shifted, ray_type, cull_mask) = (new_id(module)?, new_id(module)?, new_id(module)?);
                // Structure, flags, cull mask, offset, stride, miss index, origin, t_min, direction, t_max, payload.
                let operands = &mut block.instructions[at].operands;
                let mask = operands.get(2).cloned().ok_or("a trace has no cull mask")?;
                operands[2] = Operand::IdRef(cull_mask);
                operands[3] = Operand::IdRef(ray_type);
                operands[4] = Operand::IdRef(stride);
                operands[5] = Operand::IdRef(ray_type);
                let two =
                    |op, id, a, b| Instruction::new(op, Some(uint), Some(id), vec![a, Operand::IdRef(b)]);
                let computed = [
                    two(Op::BitwiseAnd, cull_mask, mask.clone(), masks),
                    two(Op::ShiftRightLogical, shifted, mask, shift),
                    two(Op::BitwiseAnd, ray_type, Operand::IdRef(shifted), types),
                ];
                at += computed.len();
                let before = at - computed.len();
                block.instructions.splice(before..before, computed);
            }
            at += 1;
        }
    }
    module.functions = functions;
    Ok(())
}

fn uint_type(module: &mut Module) -> Result<Word, String> {
    let operands = [Operand::LiteralBit32(32), Operand::LiteralBit32(0)];
    let is_uint = |i: &&Instruction| i.class.opcode == Op::TypeInt && i.operands == operands;
    let found = module.types_global_values.iter().find(is_uint).and_then(|i| i.result_id);
    found.ok_or_else(|| "it has no 32-bit integers".into())
}

fn constant(module: &mut Module, uint: Word, value: u32) -> Result<Word, String> {
    let id = new_id(module)?;
    let operands = vec![Operand::LiteralBit32(value)];
    module.types_global_values.push(Instruction::new(Op::Constant, Some(uint), Some(id), operands));
    Ok(id)
}

/// Replaces the body of a function by one block.
fn replace_body(module: &mut Module, function: Word, instructions: Vec<Instruction>) -> Result<(), String> {
    let label = new_id(module)?;
    let body = module.functions.iter_mut().find(|f| f.def_id() == Some(function));
    let label = Instruction::new(Op::Label, None, Some(label), Vec::new());
    body.ok_or("a function has no body")?.blocks = vec![Block { label: Some(label), instructions }];
    Ok(())
}

/// Makes `ignore_intersection` end the shader.
fn end_ignored(module: &mut Module) -> Result<(), String> {
    let Some(function) = named(module, "ignore_intersection") else { return Ok(()) };
    let end = Instruction::new(Op::IgnoreIntersectionKHR, None, None, Vec::new());
    replace_body(module, function, vec![end])
}

/// Makes `report_intersection` report.
fn report(module: &mut Module) -> Result<(), String> {
    let Some(function) = named(module, "report_intersection") else { return Ok(()) };
    let body = module.functions.iter().find(|f| f.def_id() == Some(function)).ok_or("it has no body")?;
    let result_type = body.def.as_ref().and_then(|d| d.result_type);
    let t =
        body.parameters.first().and_then(|p| p.result_id).ok_or("report_intersection has no parameter")?;
    let uint = uint_type(module)?;
    let hit_kind = constant(module, uint, 0)?;
    let accepted = new_id(module)?;
    let operands = vec![Operand::IdRef(t), Operand::IdRef(hit_kind)];
    let report = Instruction::new(Op::ReportIntersectionKHR, result_type, Some(accepted), operands);
    let end = Instruction::new(Op::ReturnValue, None, None, vec![Operand::IdRef(accepted)]);
    replace_body(module, function, vec![report, end])
}

/// Name of the any-hit entry point that becomes an intersection shader.
pub const INTERSECTION: &str = "intersect_sphere_shader";

/// Makes the entry point of that name an intersection shader, which has no payload.
fn make_intersection(module: &mut Module) -> Result<(), String> {
    let is_it = |i: &&mut Instruction| matches!(i.operands.get(2), Some(Operand::LiteralString(n)) if n == INTERSECTION);
    let Some(entry) = module.entry_points.iter_mut().find(is_it) else { return Ok(()) };
    entry.operands[0] = Operand::ExecutionModel(ExecutionModel::IntersectionKHR);
    let incoming: Vec<Word> = module
        .types_global_values
        .iter()
        .filter(|i| i.class.opcode == Op::Variable)
        .filter(|i| i.operands.first() == Some(&Operand::StorageClass(StorageClass::IncomingRayPayloadKHR)))
        .filter_map(|i| i.result_id)
        .collect();
    entry.operands.retain(|o| !matches!(o, Operand::IdRef(id) if incoming.contains(id)));
    let is_payload = |i: &Instruction| i.result_id.is_some_and(|id| incoming.contains(&id));
    module.types_global_values.retain(|i| !is_payload(i));
    let names_payload =
        |i: &Instruction| matches!(i.operands.first(), Some(Operand::IdRef(id)) if incoming.contains(id));
    module.debug_names.retain(|i| !names_payload(i));
    module.annotations.retain(|i| !names_payload(i));
    Ok(())
}

#[cfg(test)]
mod tests;
