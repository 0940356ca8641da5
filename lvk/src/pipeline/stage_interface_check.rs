//! Comparison of the outputs of each stage with the inputs of the next.

use super::render_modules::RenderModules;
use super::shader_module::ShaderModule;
use crate::error::{Error, Result};
use crate::shader::LocationValue;

/// Fails unless each stage declares outputs for all words of the inputs of the next stage (VUID 08743), with the same type for each
/// component (VUID 07754), and per vertex or per primitive as they are.
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
            Some(output) => {
                let (location, component) = (output.location, output.component);
                format!("has {} at location {location}, component {component}", output.description())
            }
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

/// Returns the first input that differs from the outputs, with an output of some of its words: the one of another type, or the first
/// where other words are of no output.
pub(crate) fn interface_difference<'a>(
    inputs: &'a [LocationValue],
    outputs: &'a [LocationValue],
) -> Option<(&'a LocationValue, Option<&'a LocationValue>)> {
    inputs.iter().find_map(|input| difference(input, outputs).map(|output| (input, output)))
}

/// Returns how an input differs from the outputs: the output of another type, or the first of its words where some are of no output.
fn difference<'a>(input: &LocationValue, outputs: &'a [LocationValue]) -> Option<Option<&'a LocationValue>> {
    let words = input.words();
    let shares = |output: &&LocationValue| {
        let other = output.words();
        output.is_patch == input.is_patch && other.start < words.end && words.start < other.end
    };
    let mut near: Vec<_> = outputs.iter().filter(shares).collect();
    near.sort_by_key(|output| output.words().start);
    if let Some(other) = near.iter().find(|output| !input.is_like(output)) {
        return Some(Some(other));
    }
    let written = near.iter().map(|output| output.words()).fold(words.start, |written, output| {
        if output.start <= written { written.max(output.end) } else { written }
    });
    (written < words.end).then(|| near.first().copied())
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
            is_per_primitive: false,
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
    fn each_component_of_an_input_has_the_type_of_its_output() {
        let inputs = [floats(2, 0, 3)];
        assert_eq!(interface_difference(&[floats(2, 0, 2)], &inputs), None);
        let integers =
            |component, count| LocationValue { numbers: NumericFormat::Sint, ..floats(2, component, count) };
        for output in [floats(2, 0, 2), integers(0, 3)] {
            let outputs = [output];
            assert_eq!(interface_difference(&inputs, &outputs), Some((&inputs[0], Some(&outputs[0]))));
        }
        // Integers behind floats, and before them.
        for outputs in [[floats(2, 0, 2), integers(2, 1)], [floats(2, 1, 2), integers(0, 1)]] {
            assert_eq!(interface_difference(&inputs, &outputs), Some((&inputs[0], Some(&outputs[1]))));
        }
        // Values of primitives are none of vertices.
        let of_primitive = [LocationValue { is_per_primitive: true, ..floats(2, 0, 4) }];
        assert_eq!(interface_difference(&inputs, &of_primitive), Some((&inputs[0], Some(&of_primitive[0]))));
        assert_eq!(interface_difference(&of_primitive, &of_primitive), None);
        // An output of whole patches is another.
        let of_patch = [LocationValue { is_patch: true, ..floats(2, 0, 4) }];
        assert_eq!(interface_difference(&inputs, &of_patch), Some((&inputs[0], None)));
    }

    #[test]
    fn outputs_share_inputs_and_inputs_share_outputs() {
        let of = |inputs: &[LocationValue], outputs: &[LocationValue]| {
            interface_difference(inputs, outputs).is_none()
        };
        let doubles =
            |location, component, count| LocationValue { bytes: 8, ..floats(location, component, count) };
        assert!(of(&[floats(1, 0, 4)], &[floats(1, 2, 2), floats(1, 0, 2)]));
        // Four 64-bit numbers take two locations.
        assert!(of(&[doubles(0, 0, 2), doubles(1, 0, 2)], &[doubles(0, 0, 4)]));
        assert!(of(&[doubles(0, 0, 4)], &[doubles(0, 0, 2), doubles(1, 0, 2)]));
        assert!(!of(&[doubles(0, 0, 4)], &[doubles(0, 0, 3)]));
        assert!(!of(&[floats(1, 0, 2)], &[doubles(0, 0, 4)]));
    }
}
