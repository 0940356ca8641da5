//! Shader stages of a pipeline, with their specialization constants.

use std::ffi::CStr;

use ash::vk;

use super::shader_module::ShaderModule;
use crate::error::{Error, Result};

const ENTRY_POINT: &CStr = c"main";
/// Every specialization constant is one 32-bit value.
const CONSTANT_BYTES: usize = 4;

/// Value of a specialization constant (`layout(constant_id = N) const ...`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecializationConstant {
    /// The shader's `constant_id`.
    pub id: u32,
    /// The value.
    pub value: SpecializationValue,
}

/// A 32-bit specialization value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpecializationValue {
    /// `uint`.
    U32(u32),
    /// `int`.
    I32(i32),
    /// `float`.
    F32(f32),
    /// `bool`.
    Bool(bool),
}

impl SpecializationValue {
    /// The value as the shader gets it.
    pub(super) fn bits(self) -> u32 {
        match self {
            Self::U32(value) => value,
            Self::I32(value) => value.cast_unsigned(),
            Self::F32(value) => value.to_bits(),
            Self::Bool(value) => value.into(),
        }
    }
}

/// Specialization constants in the form Vulkan takes.
pub(crate) struct Specialization {
    entries: Vec<vk::SpecializationMapEntry>,
    data: Vec<u8>,
}

impl Specialization {
    /// Checks that some module of the pipeline declares each constant, with 32 bits.
    pub(crate) fn new<'a>(
        pipeline: &str,
        constants: &[SpecializationConstant],
        modules: impl Iterator<Item = &'a ShaderModule> + Clone,
    ) -> Result<Self> {
        for (index, constant) in constants.iter().enumerate() {
            if constants[..index].iter().any(|other| other.id == constant.id) {
                let message = format!("the specialization constant {} is given twice", constant.id);
                return Err(Error::usage(pipeline, message));
            }
            let declared = modules.clone().flat_map(|module| &module.reflection.specialization);
            let sizes: Vec<u32> =
                declared.filter(|(id, _)| *id == constant.id).map(|(_, bytes)| *bytes).collect();
            if sizes.is_empty() {
                let message = format!("no shader declares the specialization constant {}", constant.id);
                return Err(Error::usage(pipeline, message));
            }
            if sizes.iter().any(|bytes| *bytes as usize != CONSTANT_BYTES) {
                let message = format!("specialization constant {} does not have 32 bits", constant.id);
                return Err(Error::usage(pipeline, message));
            }
        }
        let entry = |(index, constant): (usize, &SpecializationConstant)| vk::SpecializationMapEntry {
            constant_id: constant.id,
            offset: (index * CONSTANT_BYTES) as u32,
            size: CONSTANT_BYTES,
        };
        Ok(Self {
            entries: constants.iter().enumerate().map(entry).collect(),
            data: constants.iter().flat_map(|constant| constant.value.bits().to_ne_bytes()).collect(),
        })
    }

    pub(crate) fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.entries).data(&self.data)
    }
}

/// The stage of a module.
pub(crate) fn stage<'a>(
    module: &ShaderModule,
    specialization: &'a vk::SpecializationInfo<'a>,
) -> vk::PipelineShaderStageCreateInfo<'a> {
    vk::PipelineShaderStageCreateInfo::default()
        .stage(module.stage.raw())
        .module(module.raw)
        .name(ENTRY_POINT)
        .specialization_info(specialization)
}
