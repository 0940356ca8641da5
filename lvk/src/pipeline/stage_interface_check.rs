//! Comparison of the outputs of each stage with the inputs of the next.

use super::render_modules::RenderModules;
use super::shader_module::ShaderModule;
use crate::error::{Error, Result};
use crate::shader::LocationValue;

/// Fails unless each stage declares outputs for all words of the inputs of the next stage (VUID 08743), and an output at the place of an
/// input has at least as many components of the same type (Vulkan's interface matching).
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

/// Returns the first input that no output matches, with the output of another type or size at its place.
pub(crate) fn interface_difference<'a>(
    inputs: &'a [LocationValue],
    outputs: &'a [LocationValue],
) -> Option<(&'a LocationValue, Option<&'a LocationValue>)> {
    inputs.iter().find_map(|input| difference(input, outputs))
}

/// Returns an input that no output matches, with the output of another type or size at its place.
fn difference<'a>(
    input: &'a LocationValue,
    outputs: &'a [LocationValue],
) -> Option<(&'a LocationValue, Option<&'a LocationValue>)> {
    let mut near: Vec<_> = outputs.iter().filter(|output| output.overlaps(input)).collect();
    near.sort_by_key(|output| output.component);
    let Some(&first) = near.first() else { return Some((input, None)) };
    let mut same_place = near.iter().filter(|output| output.component == input.component);
    if let Some(other) = same_place.find(|output| !input.accepts(output)) {
        return Some((input, Some(other)));
    }
    let written = near.iter().fold(u64::from(input.component), |written, output| {
        if u64::from(output.component) <= written { written.max(output.end()) } else { written }
    });
    (written < input.end()).then_some((input, Some(first)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::NumericFormat;

    /// A value of 32-bit floats.
    fn floats(location: u32, component: u32, count: u32) -> LocationValue {
        LocationValue {
            location,
            component,
            count,
            bytes: 4,
            numbers: NumericFormat::Float,
            is_patch: false,
            name: "value".into(),
        }
    }

    #[test]
    fn each_word_of_an_input_is_an_output_before_it() {
        let differs = |input: LocationValue, outputs: &[LocationValue]| {
            interface_difference(&[input], outputs).map(|(_, output)| output.cloned())
        };
        // Parts of an output, and an input whose words are outputs of their own.
        assert_eq!(differs(floats(0, 1, 1), &[floats(0, 0, 2)]), None);
        assert_eq!(differs(floats(0, 1, 3), &[floats(0, 0, 4)]), None);
        assert_eq!(differs(floats(0, 1, 3), &[floats(0, 2, 2), floats(0, 0, 2)]), None);
        // Words that nothing writes: behind an output, before it, between two, and all.
        assert_eq!(differs(floats(0, 1, 2), &[floats(0, 0, 2)]), Some(Some(floats(0, 0, 2))));
        assert_eq!(differs(floats(0, 2, 2), &[floats(0, 3, 1)]), Some(Some(floats(0, 3, 1))));
        let around = [floats(0, 3, 1), floats(0, 0, 2)];
        assert_eq!(differs(floats(0, 1, 3), &around), Some(Some(floats(0, 0, 2))));
        assert_eq!(differs(floats(0, 2, 2), &[floats(0, 0, 2), floats(1, 2, 2)]), Some(None));
    }

    #[test]
    fn an_output_at_the_place_of_an_input_has_its_type_and_size() {
        let inputs = [floats(2, 0, 3)];
        assert_eq!(interface_difference(&[floats(2, 0, 2)], &inputs), None);
        let integers = LocationValue { numbers: NumericFormat::Sint, ..floats(2, 0, 3) };
        for output in [floats(2, 0, 2), integers] {
            let outputs = [output];
            assert_eq!(interface_difference(&inputs, &outputs), Some((&inputs[0], Some(&outputs[0]))));
        }
    }
}
