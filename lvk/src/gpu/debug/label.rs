//! A label for debuggers: its name and its colour.

use std::ffi::CString;

use ash::vk;

use super::messenger::c_name;

/// A label in a command buffer or on a queue, for debuggers and profilers (`VkDebugUtilsLabelEXT`).
///
/// A name alone is a label without a colour: calls that take `impl Into<Label>` take a `&str`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Label<'a> {
    /// The text. Default: empty.
    pub name: &'a str,
    /// Red, green, blue and alpha from 0 to 1. Tools ignore four zeros. Default: four zeros.
    pub color: [f32; 4],
}

impl<'a> Label<'a> {
    /// Returns a label with an opaque colour: red, green and blue from 0 to 1.
    pub fn colored(name: &'a str, [r, g, b]: [f32; 3]) -> Self {
        Self { name, color: [r, g, b, 1.0] }
    }

    /// Returns the name as Vulkan takes it, which the result of [`raw`](Self::raw) points to.
    pub(crate) fn c_name(&self) -> CString {
        c_name(self.name)
    }

    pub(crate) fn raw<'n>(&self, name: &'n CString) -> vk::DebugUtilsLabelEXT<'n> {
        vk::DebugUtilsLabelEXT::default().label_name(name).color(self.color)
    }
}

impl<'a> From<&'a str> for Label<'a> {
    fn from(name: &'a str) -> Self {
        Self { name, color: [0.0; 4] }
    }
}

impl<'a> From<&'a String> for Label<'a> {
    fn from(name: &'a String) -> Self {
        name.as_str().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_has_the_colour_and_the_name_up_to_a_zero() {
        let label = Label::colored("shadow\0map", [1.0, 0.5, 0.0]);
        let name = label.c_name();
        let raw = label.raw(&name);
        assert_eq!((raw.color, name.to_str()), ([1.0, 0.5, 0.0, 1.0], Ok("shadowmap")));
        let plain = String::from("plain");
        assert_eq!(Label::from(&plain), Label { name: "plain", color: [0.0; 4] });
    }
}
