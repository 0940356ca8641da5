//! Comparison of the outputs of each stage with the inputs of the next.

use super::render_modules::RenderModules;
use super::shader_module::ShaderModule;
use crate::error::{Error, Result};
use crate::shader::LocationValue;

/// Fails unless each stage declares outputs for the inputs of the next stage, with at least as many components of the
/// same type (Vulkan's interface matching).
pub(super) fn check_interfaces(name: &str, modules: &RenderModules) -> Result<()> {
    let before = [&modules.vertex, &modules.mesh, &modules.tess_control, &modules.tess_eval];
    let stages: Vec<_> = before
        .into_iter()
        .chain([&modules.geometry, &modules.fragment])
        .filter_map(Option::as_deref)
        .collect();
    stages.windows(2).try_for_each(|pair| check_pair(name, pair[0], pair[1]))
}

fn check_pair(name: &str, from: &ShaderModule, to: &ShaderModule) -> Result<()> {
    let (outputs, inputs) = (&from.reflection.interface.outputs, &to.reflection.interface.inputs);
    interface_difference(inputs, outputs).map_or(Ok(()), |(input, output)| {
        let variable = match &*input.name {
            "" => String::new(),
            known => format!(" ('{known}')"),
        };
        let written = match output {
            Some(output) => format!("has {}", output.description()),
            None => "writes nothing there".to_owned(),
        };
        let message = format!(
            "{} shader '{}' reads {} at location {}, component {}{variable}, but {} shader '{}' before it {written}; \
             declare the output like the input",
            to.stage.name(),
            to.name,
            input.description(),
            input.location,
            input.component,
            from.stage.name(),
            from.name
        );
        Err(Error::usage(name, message))
    })
}

/// Returns the first input that no output matches, with the output of another type at its place.
pub(crate) fn interface_difference<'a>(
    inputs: &'a [LocationValue],
    outputs: &'a [LocationValue],
) -> Option<(&'a LocationValue, Option<&'a LocationValue>)> {
    inputs.iter().find_map(|input| difference(input, outputs))
}

/// Returns an input that no output matches, with the output of another type at its place.
fn difference<'a>(
    input: &'a LocationValue,
    outputs: &'a [LocationValue],
) -> Option<(&'a LocationValue, Option<&'a LocationValue>)> {
    let mut near = outputs.iter().filter(|output| output.overlaps(input)).peekable();
    if near.peek().is_none() {
        return Some((input, None));
    }
    let mut same_place = near.filter(|output| output.component == input.component);
    same_place.find(|output| !input.accepts(output)).map(|output| (input, Some(output)))
}
