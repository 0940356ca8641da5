//! What a graphics pipeline reads and writes of the targets of its passes.

use ash::vk;

use super::graphics::RenderModules;
use super::graphics_desc::{ColorTarget, RenderPipelineDesc};
use crate::bindless::input_attachments::{Input, InputMask};
use crate::error::{Error, Result};
use crate::format::{Format, Numbers};
use crate::shader::InputRead;

/// Fails unless the pipeline has the targets that its fragment shader reads, as it reads them.
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
        targets.check(read).map_err(|why| {
            let message = format!("its fragment shader '{}' reads {}, {why}", fragment.name, read.input);
            Error::usage(desc.debug_name, message)
        })
    })
}

/// What a pipeline says of the targets of its passes.
struct InputTargets<'a> {
    colors: &'a [Format],
    depth: Option<Format>,
    samples: u32,
    writes_depth: bool,
    writes_stencil: bool,
}

impl InputTargets<'_> {
    fn check(&self, read: &InputRead) -> Result<(), String> {
        let numbers = self.numbers(read.input)?;
        if numbers != read.numbers {
            let (has, is) = (subpass_input(numbers), subpass_input(read.numbers));
            return Err(format!("which is a {has}, as a {is}"));
        }
        if read.multisampled != (self.samples > 1) {
            let ending = if read.multisampled { "without MS" } else { "with MS" };
            return Err(format!("which has {} samples a pixel: take a type {ending}", self.samples));
        }
        let written = match read.input {
            Input::Color(_) => false,
            Input::Depth => self.writes_depth,
            Input::Stencil => self.writes_stencil,
        };
        if written { Err(READS_WRITTEN.to_owned()) } else { Ok(()) }
    }

    /// How shaders read the target.
    fn numbers(&self, input: Input) -> Result<Numbers, String> {
        let lacking = |what: &str| format!("but it draws to {what}");
        let depth = self.depth.ok_or_else(|| lacking("no depth target"));
        match input {
            Input::Color(target) => {
                let format = self.colors.get(target as usize);
                let format =
                    format.ok_or_else(|| lacking(&format!("{} colour targets", self.colors.len())))?;
                Ok(format.numbers())
            }
            Input::Depth => depth.map(|_| Numbers::Float),
            Input::Stencil if depth?.has_stencil() => Ok(Numbers::Uint),
            Input::Stencil => Err(lacking("a depth target without stencil")),
        }
    }
}

/// Depth tests run before or beside fragments, so that nobody could say what they read.
pub(crate) const READS_WRITTEN: &str = "which the pipeline also writes; turn the writes off";

fn subpass_input(numbers: Numbers) -> &'static str {
    match numbers {
        Numbers::Float => "subpassInput",
        Numbers::Uint => "usubpassInput",
        Numbers::Sint => "isubpassInput",
    }
}

/// The targets that the fragment shader reads.
pub(super) fn reads(modules: &RenderModules) -> InputMask {
    let fragment = modules.fragment.iter();
    fragment.flat_map(|module| module.reflection.input_reads.iter().map(|read| read.input)).collect()
}

/// The targets that draws may change.
pub(super) fn writes(desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> InputMask {
    let colors = (0..).zip(desc.color).filter(|(place, target)| writes_color(modules, *place, target));
    let depth = desc.depth.filter(|depth| depth.write).map(|_| Input::Depth);
    let stencil = desc.stencil.filter(|stencil| stencil.writes()).map(|_| Input::Stencil);
    colors.map(|(place, _)| Input::Color(place)).chain(depth).chain(stencil).collect()
}

/// Whether draws may change the colour target: where the shader puts nothing out, Vulkan leaves open what would be written.
pub(super) fn writes_color(modules: &RenderModules, place: u32, target: &ColorTarget) -> bool {
    let puts_out = |outputs: u32| outputs & 1_u32.checked_shl(place).unwrap_or(0) != 0;
    !target.write.is_empty()
        && modules.fragment.as_ref().is_some_and(|module| puts_out(module.reflection.outputs))
}

/// Where shaders find the targets that they read: at the library's places, or at Vulkan's own.
#[derive(Debug)]
pub(crate) struct InputIndices {
    colors: Vec<u32>,
    depth: u32,
    stencil: u32,
}

impl InputIndices {
    /// For pipelines that read targets, and passes with so many colour targets, on devices with `limit` places.
    pub(crate) fn new(colors: u32, limit: u32) -> Self {
        let within = |input: Input| {
            let place = input.place();
            if place < limit { place } else { vk::ATTACHMENT_UNUSED }
        };
        Self {
            colors: (0..colors).map(|target| within(Input::Color(target))).collect(),
            depth: within(Input::Depth),
            stencil: within(Input::Stencil),
        }
    }

    /// The same for Vulkan.
    pub(crate) fn raw(&self) -> vk::RenderingInputAttachmentIndexInfoKHR<'_> {
        vk::RenderingInputAttachmentIndexInfoKHR::default()
            .color_attachment_input_indices(&self.colors)
            .depth_input_attachment_index(&self.depth)
            .stencil_input_attachment_index(&self.stencil)
    }
}

/// What Vulkan takes for pipelines that say nothing: colours at their numbers, depth and stencil nowhere.
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

    fn read(input: Input, numbers: Numbers) -> InputRead {
        InputRead { input, numbers, multisampled: false }
    }

    #[test]
    fn targets_are_read_as_what_they_are() {
        for (input, numbers) in [
            (Input::Color(0), Numbers::Float),
            (Input::Color(1), Numbers::Uint),
            (Input::Depth, Numbers::Float),
        ] {
            assert_eq!(PLAIN.check(&read(input, numbers)), Ok(()));
            let why = PLAIN.check(&read(input, Numbers::Sint)).unwrap_err();
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
    fn what_a_pipeline_lacks_is_said() {
        let lacks =
            |targets: &InputTargets<'_>, input| targets.check(&read(input, Numbers::Float)).unwrap_err();
        assert_eq!(lacks(&PLAIN, Input::Color(2)), "but it draws to 2 colour targets");
        assert_eq!(lacks(&PLAIN, Input::Stencil), "but it draws to a depth target without stencil");
        let none = InputTargets { depth: None, ..PLAIN };
        assert_eq!(lacks(&none, Input::Depth), "but it draws to no depth target");
        assert_eq!(lacks(&none, Input::Stencil), "but it draws to no depth target");
        let several = InputTargets { samples: 4, ..PLAIN };
        assert!(lacks(&several, Input::Color(0)).ends_with("take a type with MS"));
        let one = InputRead { multisampled: true, ..read(Input::Color(0), Numbers::Float) };
        assert!(PLAIN.check(&one).unwrap_err().ends_with("take a type without MS"));
        let written = InputTargets { writes_depth: true, ..PLAIN };
        assert_eq!(lacks(&written, Input::Depth), READS_WRITTEN);
        let stencil = InputTargets { depth: Some(Format::D32FloatS8), writes_stencil: true, ..PLAIN };
        assert_eq!(stencil.check(&read(Input::Stencil, Numbers::Uint)).unwrap_err(), READS_WRITTEN);
        assert_eq!(stencil.check(&read(Input::Depth, Numbers::Float)), Ok(()));
    }
}
