//! Finds uses of Vulkan's own ids of a hit in hit shaders. After a split or a reordering, they differ from the
//! caller's ids.

use crate::shader::{ShaderModuleDesc, ShaderSource, ShaderStage};

/// The built-ins, each with the helper that replaces it.
const NUMBERS: [(&str, &str); 2] =
    [("gl_InstanceID", "lvkInstanceId(tlas)"), ("gl_PrimitiveID", "lvkPrimitiveIndex(tlas)")];

/// Returns the first such built-in in the caller's text, with the helper that replaces it.
pub(crate) fn find_raw_hit_builtin(desc: &ShaderModuleDesc<'_>) -> Option<(&'static str, &'static str)> {
    use ShaderStage::{AnyHit, ClosestHit, Intersection};
    let ShaderSource::Glsl(text) = desc.source else { return None };
    if !matches!(desc.stage, ClosestHit | AnyHit | Intersection) {
        return None;
    }
    let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    let mut found = words.filter_map(|word| NUMBERS.iter().find(|(name, _)| *name == word));
    found.next().copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(stage: ShaderStage, text: &str) -> Option<&'static str> {
        let source = ShaderSource::Glsl(text);
        find_raw_hit_builtin(&ShaderModuleDesc { stage, source, ..Default::default() }).map(|(name, _)| name)
    }

    #[test]
    fn whole_words_of_hit_shaders_count() {
        assert_eq!(found(ShaderStage::ClosestHit, "x = gl_PrimitiveID+1;"), Some("gl_PrimitiveID"));
        assert_eq!(found(ShaderStage::AnyHit, "gl_InstanceID"), Some("gl_InstanceID"));
        assert_eq!(found(ShaderStage::Intersection, "my_gl_PrimitiveID gl_PrimitiveIDIn"), None);
        assert_eq!(found(ShaderStage::Fragment, "gl_PrimitiveID"), None);
        assert_eq!(found(ShaderStage::ClosestHit, "gl_InstanceCustomIndexEXT"), None);
    }
}
