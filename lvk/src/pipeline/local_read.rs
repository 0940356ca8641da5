//! Targets of a pass that a graphics pipeline reads and writes.

use ash::vk;

use super::graphics_desc::{ColorTarget, RenderPipelineDesc};
use super::render_modules::RenderModules;
use crate::bindless::input_attachments::{InputAttachment, InputAttachmentMask};
use crate::error::{Error, Result};
use crate::format::{Format, NumericFormat};
use crate::shader::InputRead;

/// Fails unless the pipeline has each target that its fragment shader reads, with the type that the shader declares.
pub(super) fn check_inputs(desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Result<()> {
    let Some(fragment) = &modules.fragment else { return Ok(()) };
    let colors: Vec<Format> = desc.color.iter().map(|target| target.format).collect();
    let targets = InputTargets {
        colors: &colors,
        depth: desc.depth.map(|depth| depth.format),
        samples: desc.samples,
        writes_depth: desc.depth.is_some_and(|depth| depth.write),
        writes_stencil: desc.stencil.is_some_and(|stencil| stencil.writes()),
    };
    fragment.reflection.input_reads.iter().try_for_each(|read| {
        targets.check_read(read).map_err(|why| {
            let message = format!("its fragment shader '{}' reads {}, {why}", fragment.name, read.input);
            Error::usage(desc.debug_name, message)
        })
    })
}

/// Targets of a pipeline, as far as reads of input attachments depend on them.
struct InputTargets<'a> {
    colors: &'a [Format],
    depth: Option<Format>,
    samples: u32,
    writes_depth: bool,
    writes_stencil: bool,
}

impl InputTargets<'_> {
    fn check_read(&self, read: &InputRead) -> Result<(), String> {
        let numbers = self.numeric_format(read.input)?;
        if numbers != read.numbers {
            let (has, is) = (subpass_input(numbers), subpass_input(read.numbers));
            return Err(format!("which is a {has}, as a {is}"));
        }
        if read.multisampled != (self.samples > 1) {
            let ending = if read.multisampled { "without MS" } else { "with MS" };
            return Err(format!("which has {} samples a pixel: take a type {ending}", self.samples));
        }
        let written = match read.input {
            InputAttachment::Color(_) => false,
            InputAttachment::Depth => self.writes_depth,
            InputAttachment::Stencil => self.writes_stencil,
        };
        if written { Err(READS_WRITTEN.to_owned()) } else { Ok(()) }
    }

    /// Returns the numeric format that shaders must use to read the target.
    fn numeric_format(&self, input: InputAttachment) -> Result<NumericFormat, String> {
        let lacking = |what: &str| format!("but it draws to {what}");
        let depth = self.depth.ok_or_else(|| lacking("no depth target"));
        match input {
            InputAttachment::Color(target) => {
                let format = self.colors.get(target as usize);
                let format =
                    format.ok_or_else(|| lacking(&format!("{} colour targets", self.colors.len())))?;
                Ok(format.numeric_format())
            }
            InputAttachment::Depth => depth.map(|_| NumericFormat::Float),
            InputAttachment::Stencil if depth?.has_stencil() => Ok(NumericFormat::Uint),
            InputAttachment::Stencil => Err(lacking("a depth target without stencil")),
        }
    }
}

/// End of the error message for a target that is read and written. Depth tests run before or while fragments are
/// shaded, so the value of such a read is undefined.
pub(crate) const READS_WRITTEN: &str = "which the pipeline also writes; turn the writes off";

fn subpass_input(numbers: NumericFormat) -> &'static str {
    match numbers {
        NumericFormat::Float => "subpassInput",
        NumericFormat::Uint => "usubpassInput",
        NumericFormat::Sint => "isubpassInput",
    }
}

/// Returns the targets that the fragment shader reads.
pub(super) fn inputs_read(modules: &RenderModules) -> InputAttachmentMask {
    let fragment = modules.fragment.iter();
    fragment.flat_map(|module| module.reflection.input_reads.iter().map(|read| read.input)).collect()
}

/// Returns the targets that draws may change.
pub(super) fn inputs_written(desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> InputAttachmentMask {
    let colors = (0..).zip(desc.color).filter(|(place, target)| writes_color(modules, *place, target));
    let depth = desc.depth.filter(|depth| depth.write).map(|_| InputAttachment::Depth);
    let stencil = desc.stencil.filter(|stencil| stencil.writes()).map(|_| InputAttachment::Stencil);
    colors.map(|(place, _)| InputAttachment::Color(place)).chain(depth).chain(stencil).collect()
}

/// True if draws may change the colour target. Vulkan leaves undefined what is written to a target without an output.
pub(super) fn writes_color(modules: &RenderModules, place: u32, target: &ColorTarget) -> bool {
    let puts_out = |outputs: u32| outputs & 1_u32.checked_shl(place).unwrap_or(0) != 0;
    !target.write.is_empty()
        && modules.fragment.as_ref().is_some_and(|module| puts_out(module.reflection.outputs))
}

/// Input attachment indices of the targets, by which shaders read them.
#[derive(Debug)]
pub(crate) struct InputIndices {
    colors: Vec<u32>,
    depth: u32,
    stencil: u32,
}

impl InputIndices {
    /// Returns the library's indices, for pipelines that read targets and passes with `colors` colour targets. `limit`
    /// is the number of input attachments of the device.
    pub(crate) fn new(colors: u32, limit: u32) -> Self {
        let within = |input: InputAttachment| {
            let place = input.index();
            if place < limit { place } else { vk::ATTACHMENT_UNUSED }
        };
        Self {
            colors: (0..colors).map(|target| within(InputAttachment::Color(target))).collect(),
            depth: within(InputAttachment::Depth),
            stencil: within(InputAttachment::Stencil),
        }
    }

    /// Returns the indices in Vulkan's form.
    pub(crate) fn raw(&self) -> vk::RenderingInputAttachmentIndexInfoKHR<'_> {
        vk::RenderingInputAttachmentIndexInfoKHR::default()
            .color_attachment_input_indices(&self.colors)
            .depth_input_attachment_index(&self.depth)
            .stencil_input_attachment_index(&self.stencil)
    }
}

/// Returns Vulkan's default for pipelines without explicit indices: colour targets by number, depth and stencil without
/// index.
pub(crate) fn default_indices(colors: u32) -> vk::RenderingInputAttachmentIndexInfoKHR<'static> {
    vk::RenderingInputAttachmentIndexInfoKHR { color_attachment_count: colors, ..Default::default() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use super::*;

    const PLAIN: InputTargets<'static> = InputTargets {
        colors: &[Format::Rgba8Unorm, Format::R32Uint],
        depth: Some(Format::D32Float),
        samples: 1,
        writes_depth: false,
        writes_stencil: false,
    };

    fn read(input: InputAttachment, numbers: NumericFormat) -> InputRead {
        InputRead { input, numbers, multisampled: false }
    }

    #[test]
    fn targets_are_read_as_what_they_are() {
        for (input, numbers) in [
            (InputAttachment::Color(0), NumericFormat::Float),
            (InputAttachment::Color(1), NumericFormat::Uint),
            (InputAttachment::Depth, NumericFormat::Float),
        ] {
            assert_eq!(PLAIN.check_read(&read(input, numbers)), Ok(()));
            let why = PLAIN.check_read(&read(input, NumericFormat::Sint)).unwrap_err();
            assert!(why.ends_with("as a isubpassInput"), "{why}");
        }
    }

    #[test]
    fn places_beyond_the_limit_of_a_device_are_not_used() {
        let found = InputIndices::new(4, 4);
        assert_eq!(found.colors, [1, 2, 3, vk::ATTACHMENT_UNUSED]);
        assert_eq!((found.depth, found.stencil), (0, vk::ATTACHMENT_UNUSED));
        let all = InputIndices::new(8, 10);
        assert_eq!((all.colors, all.stencil), ((1..=8).collect(), 9));
    }

    #[test]
    fn the_error_names_missing_inputs_of_a_pipeline() {
        let lacks = |targets: &InputTargets<'_>, input| {
            targets.check_read(&read(input, NumericFormat::Float)).unwrap_err()
        };
        assert_eq!(lacks(&PLAIN, InputAttachment::Color(2)), "but it draws to 2 colour targets");
        assert_eq!(lacks(&PLAIN, InputAttachment::Stencil), "but it draws to a depth target without stencil");
        let none = InputTargets { depth: None, ..PLAIN };
        assert_eq!(lacks(&none, InputAttachment::Depth), "but it draws to no depth target");
        assert_eq!(lacks(&none, InputAttachment::Stencil), "but it draws to no depth target");
        let several = InputTargets { samples: 4, ..PLAIN };
        assert!(lacks(&several, InputAttachment::Color(0)).ends_with("take a type with MS"));
        let one = InputRead { multisampled: true, ..read(InputAttachment::Color(0), NumericFormat::Float) };
        assert!(PLAIN.check_read(&one).unwrap_err().ends_with("take a type without MS"));
        let written = InputTargets { writes_depth: true, ..PLAIN };
        assert_eq!(lacks(&written, InputAttachment::Depth), READS_WRITTEN);
        let stencil = InputTargets { depth: Some(Format::D32FloatS8), writes_stencil: true, ..PLAIN };
        assert_eq!(
            stencil.check_read(&read(InputAttachment::Stencil, NumericFormat::Uint)).unwrap_err(),
            READS_WRITTEN
        );
        assert_eq!(stencil.check_read(&read(InputAttachment::Depth, NumericFormat::Float)), Ok(()));
    }
}
