//! Input attachments that a fragment stage reads, and the locations of its outputs.

use ::spirv::{Decoration, StorageClass};

use super::parsed::{ParsedModule, Type, Variable};
use crate::bindless::input_attachments::InputAttachment;
use crate::bindless::layout;
use crate::format::NumericFormat;

/// An input attachment that a module reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct InputRead {
    pub(crate) input: InputAttachment,
    pub(crate) numbers: NumericFormat,
    pub(crate) multisampled: bool,
}

/// Returns the input attachment that a variable reads; `None` if the variable is something else.
pub(crate) fn read_input_attachment(
    module: &ParsedModule,
    variable: &Variable,
) -> Result<Option<InputRead>, String> {
    if variable.storage != StorageClass::UniformConstant as u32 {
        return Ok(None);
    }
    let Some(Type::Pointer { target }) = module.types.get(&variable.ty) else { return Ok(None) };
    let what = module.names.get(&variable.id).map_or("an input".to_owned(), |name| format!("'{name}'"));
    match module.types.get(target) {
        Some(Type::SubpassInput { texel, multisampled }) => {
            let input = attachment_of(module, variable).ok_or_else(|| format!("{what} {MISPLACED}"))?;
            let Some(Type::Number { numbers, .. }) = module.types.get(texel) else {
                return Err(format!("{what} has texels of no numbers"));
            };
            Ok(Some(InputRead { input, numbers: *numbers, multisampled: *multisampled }))
        }
        Some(Type::Array { element, .. } | Type::RuntimeArray { element })
            if matches!(module.types.get(element), Some(Type::SubpassInput { .. })) =>
        {
            Err(format!("{what} is an array of targets of the pass; declare each with LVK_INPUT"))
        }
        _ => Ok(None),
    }
}

const MISPLACED: &str = "reads a target of the pass, but not at its place; declare it with LVK_INPUT, LVK_DEPTH_INPUT or \
                         LVK_STENCIL_INPUT";

/// Returns the input attachment if set, binding and index agree on it.
fn attachment_of(module: &ParsedModule, variable: &Variable) -> Option<InputAttachment> {
    let get = |decoration| module.decoration(variable.id, decoration);
    let input = InputAttachment::from_index(get(Decoration::Binding)?)?;
    let agrees = get(Decoration::DescriptorSet) == Some(layout::INPUT_SET)
        && get(Decoration::InputAttachmentIndex) == Some(input.index());
    agrees.then_some(input)
}

/// Returns the locations of an output, a bit for each. An array takes several.
pub(crate) fn output_locations(module: &ParsedModule, variable: &Variable) -> u32 {
    let Some(first) = module.decoration(variable.id, Decoration::Location) else { return 0 };
    let Some(Type::Pointer { target }) = module.types.get(&variable.ty) else { return 0 };
    let count = match module.types.get(target) {
        Some(Type::Array { length, .. }) => module.array_length(*length).unwrap_or(1),
        _ => 1,
    };
    let last = u64::from(first).saturating_add(count);
    (u64::from(first)..last.min(u32::BITS.into())).fold(0, |all, location| all | 1 << location)
}
