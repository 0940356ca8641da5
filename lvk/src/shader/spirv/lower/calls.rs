//! Calls of shaders: the values that a shader finds in its variables, and those that it leaves.

use ::spirv::{BuiltIn, Op};

use super::attributes::emit_barycentrics;
use super::donor::Donor;
use super::emit::Emitter;
use super::passed::Passed;
use super::stage::Shader;
use crate::shader::ShaderStage;

/// The record of a called shader: its region, its index there and the distance between records.
#[derive(Debug, Clone, Copy)]
pub(super) struct RecordPlace {
    /// Variable with the address of the region.
    pub(super) region: u32,
    /// Variable with the index; `None` for the only record of the region.
    pub(super) index: Option<u32>,
    pub(super) stride: u32,
}

/// Variables that pass values between shaders.
pub(super) struct Shared<'a> {
    pub(super) payloads: &'a mut Passed,
    pub(super) callables: &'a mut Passed,
    /// Attributes of the candidate that intersection shaders report, and of the closest hit.
    pub(super) candidate_attributes: &'a mut Passed,
    pub(super) committed_attributes: &'a mut Passed,
}

/// A call of a shader.
pub(super) struct Call<'a> {
    pub(super) shader: &'a Shader,
    /// Stage of the shader.
    pub(super) stage: ShaderStage,
    /// Holds addresses of records for the shader.
    pub(super) record_variable: Option<u32>,
    pub(super) place: RecordPlace,
    /// True for a hit of a triangle, whose attributes are barycentrics.
    pub(super) is_triangle: bool,
}

impl Call<'_> {
    /// Gives the variables of the shader their values.
    pub(super) fn emit_start(&self, emitter: &mut Emitter<'_>, donor: &Donor, shared: &mut Shared<'_>) {
        for (variable, value) in &self.shader.initial {
            emitter.store(*variable, *value);
        }
        for (builtin, variable) in &self.shader.builtins {
            self.emit_builtin(emitter, donor, *builtin, *variable);
        }
        if let Some(variable) = self.record_variable {
            let address = self.emit_record_address(emitter, donor);
            emitter.store(variable, address);
        }
        if let Some(own) = self.shader.incoming_payload {
            let passed = shared.payloads.variable(emitter.linker, own);
            emitter.copy(passed, own);
        }
        if let Some(own) = self.shader.incoming_callable {
            let passed = shared.callables.variable(emitter.linker, own);
            emitter.copy(passed, own);
        }
        if let Some(own) = self.shader.attributes {
            self.emit_attributes(emitter, donor, shared, own);
        }
    }

    /// Calls the entry function between the copies in and out.
    pub(super) fn emit_whole(&self, emitter: &mut Emitter<'_>, donor: &Donor, shared: &mut Shared<'_>) {
        self.emit_start(emitter, donor, shared);
        emitter.call(self.shader.entry);
        let results = self.shader.results(emitter.linker, shared.payloads, shared.callables);
        for (own, passed) in results {
            emitter.copy(own, passed);
        }
    }

    fn emit_attributes(&self, emitter: &mut Emitter<'_>, donor: &Donor, shared: &mut Shared<'_>, own: u32) {
        let passed = match self.stage {
            ShaderStage::Intersection => return,
            ShaderStage::AnyHit => shared.candidate_attributes.variable(emitter.linker, own),
            _ => shared.committed_attributes.variable(emitter.linker, own),
        };
        let types = [own, donor.hit_barycentrics].map(|id| emitter.linker.variable_type(id).unwrap_or(0));
        if !self.is_triangle {
            emitter.copy(passed, own);
        } else if emitter.linker.shape(types[0]) == emitter.linker.shape(types[1]) {
            emitter.copy(donor.hit_barycentrics, own);
        } else {
            emit_barycentrics(emitter, donor.hit_barycentrics, own);
        }
    }

    fn emit_record_address(&self, emitter: &mut Emitter<'_>, donor: &Donor) -> u32 {
        let base = emitter.load(self.place.region);
        let Some(index) = self.place.index else { return base };
        let pair = emitter.linker.uvec2();
        let stride = emitter.linker.constant(self.place.stride);
        let index = emitter.load(index);
        emitter.value(Op::FunctionCall, pair, &[donor.record_address, base, index, stride])
    }

    fn emit_builtin(&self, emitter: &mut Emitter<'_>, donor: &Donor, builtin: BuiltIn, variable: u32) {
        let source = self.source(donor, builtin);
        let types = [source, variable].map(|id| emitter.linker.variable_type(id).unwrap_or(0));
        let mut value = emitter.load(source);
        if builtin == BuiltIn::CullMaskKHR {
            const MASK: u32 = 0xFF;
            let mask = emitter.linker.constant(MASK);
            value = emitter.value(Op::BitwiseAnd, types[0], &[value, mask]);
        }
        let value = emitter.convert(value, types[0], types[1]);
        emitter.store(variable, value);
    }

    /// Returns the donor's variable that holds a built-in value.
    fn source(&self, donor: &Donor, builtin: BuiltIn) -> u32 {
        match builtin {
            BuiltIn::LaunchIdKHR => donor.launch_id,
            BuiltIn::LaunchSizeKHR => donor.launch_size,
            BuiltIn::CullMaskKHR => donor.ray_mask,
            BuiltIn::HitKindKHR => donor.hit_kind,
            BuiltIn::HitTriangleVertexPositionsKHR => donor.hit_positions,
            BuiltIn::IncomingRayFlagsKHR => donor.ray_flags,
            BuiltIn::InstanceCustomIndexKHR => donor.hit_custom_index,
            BuiltIn::InstanceId => donor.hit_instance,
            BuiltIn::ObjectRayDirectionKHR => donor.hit_object_direction,
            BuiltIn::ObjectRayOriginKHR => donor.hit_object_origin,
            BuiltIn::ObjectToWorldKHR => donor.hit_object_to_world,
            BuiltIn::WorldToObjectKHR => donor.hit_world_to_object,
            BuiltIn::PrimitiveId => donor.hit_primitive,
            BuiltIn::RayGeometryIndexKHR => donor.hit_geometry,
            BuiltIn::RayTminKHR => donor.ray_t_min,
            BuiltIn::WorldRayDirectionKHR => donor.ray_direction,
            BuiltIn::WorldRayOriginKHR => donor.ray_origin,
            _ => match self.stage {
                ShaderStage::AnyHit | ShaderStage::ClosestHit => donor.hit_t,
                ShaderStage::Intersection => donor.limit,
                _ => donor.ray_t_max,
            },
        }
    }
}
