//! Shader stages of a pipeline, with their specialization constants.

use std::ffi::CStr;

use ash::vk;

use super::shader_module::ShaderModule;
use crate::error::{Error, Result};

const ENTRY_POINT: &CStr = c"main";
/// Value of a specialization constant (`layout(constant_id = N) const ...`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecializationConstant {
    /// The shader's `constant_id`.
    pub id: u32,
    /// The value.
    pub value: SpecializationValue,
}

/// A specialization value of 32 or 64 bits.
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
    /// `uint64_t`.
    U64(u64),
    /// `int64_t`.
    I64(i64),
    /// `double`.
    F64(f64),
}

impl SpecializationValue {
    /// Returns the bits of the value; 32-bit values are in the low half.
    pub(super) fn bits(self) -> u64 {
        match self {
            Self::U32(value) => value.into(),
            Self::I32(value) => value.cast_unsigned().into(),
            Self::F32(value) => value.to_bits().into(),
            Self::Bool(value) => value.into(),
            Self::U64(value) => value,
            Self::I64(value) => value.cast_unsigned(),
            Self::F64(value) => value.to_bits(),
        }
    }

    fn size_bytes(self) -> usize {
        match self {
            Self::U32(_) | Self::I32(_) | Self::F32(_) | Self::Bool(_) => 4,
            Self::U64(_) | Self::I64(_) | Self::F64(_) => 8,
        }
    }
}

/// Specialization constants in Vulkan's form.
pub(crate) struct Specialization {
    entries: Vec<vk::SpecializationMapEntry>,
    data: Vec<u8>,
}

impl Specialization {
    /// Fails unless a module of the pipeline declares each constant with the same number of bits.
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
            let given = constant.value.size_bytes();
            if let Some(bytes) = sizes.iter().find(|bytes| **bytes as usize != given) {
                let message = format!(
                    "specialization constant {} has {} bits in a shader, and {} were given",
                    constant.id,
                    bytes * 8,
                    given * 8
                );
                return Err(Error::usage(pipeline, message));
            }
        }
        Ok(Self::from_constants(constants))
    }

    fn from_constants(constants: &[SpecializationConstant]) -> Self {
        let mut made = Self { entries: Vec::new(), data: Vec::new() };
        for constant in constants {
            let (offset, size) = (made.data.len() as u32, constant.value.size_bytes());
            made.entries.push(vk::SpecializationMapEntry { constant_id: constant.id, offset, size });
            match size {
                8 => made.data.extend(constant.value.bits().to_ne_bytes()),
                _ => made.data.extend((constant.value.bits() as u32).to_ne_bytes()),
            }
        }
        made
    }

    pub(crate) fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.entries).data(&self.data)
    }
}

/// Returns Vulkan's description of a module's stage.
pub(crate) fn stage_info<'a>(
    module: &ShaderModule,
    specialization: &'a vk::SpecializationInfo<'a>,
) -> vk::PipelineShaderStageCreateInfo<'a> {
    vk::PipelineShaderStageCreateInfo::default()
        .stage(module.stage.raw())
        .module(module.raw)
        .name(ENTRY_POINT)
        .specialization_info(specialization)
}
