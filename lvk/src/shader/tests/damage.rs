//! Tests that damaged texts and words are refused.

use ::spirv::Op;
use proptest::prelude::*;

use super::*;
use crate::shader::spirv::passes::strip_unused_bindings;

#[test]
fn damaged_text_is_an_error() {
    assert!(error(ShaderStage::Compute, "void main() {\n\0}").starts_with("line 2: a NUL"));
    assert!(error(ShaderStage::Compute, "void main() {\n int é; }").starts_with("line 2: the character"));
    assert!(
        error(ShaderStage::Compute, "#version 310 es\nvoid main() {}").starts_with("line 1: #version 310 es")
    );
    assert!(!error(ShaderStage::Compute, "").is_empty());
    let includes = [("a", "int a;\n\0")];
    let module = ShaderModuleDesc {
        includes: &includes,
        ..desc(ShaderStage::Compute, "#include \"a\"\nvoid main() {}")
    };
    assert!(log(build(&module)).contains("a:2: a NUL"));
    for define in [("A B", ""), ("1A", ""), ("", ""), ("A", "1\nint x;"), ("A", "\\"), ("A\0", "")] {
        let defines = [define];
        let module = ShaderModuleDesc { defines: &defines, ..desc(ShaderStage::Compute, "void main() {}") };
        assert!(log(build(&module)).starts_with("define '"), "{define:?}");
    }
}

/// Returns a module with blocks, arrays, matrices, images and a query, as input for damage.
fn rich() -> &'static [u32] {
    static WORDS: std::sync::LazyLock<Vec<u32>> = std::sync::LazyLock::new(|| {
        let globals = "#include <lvk/ray_query.glsl>\nstruct S { vec3 a; mat3 m[2]; };\n\
                       layout(push_constant, std430) uniform Push { S s[2]; float last; } push;\n\
                       layout(constant_id = 4) const uint n = 4;";
        let body =
            format!("{QUERY} imageStore(kImages2D[n], ivec2(1), textureBindless2D(1, 2, vec2(push.last)));");
        words(ShaderStage::Compute, &shader(ShaderStage::Compute, globals, &body))
    });
    &WORDS
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn random_words_never_panic(mut words in prop::collection::vec(any::<u32>(), 0..64), small in any::<bool>()) {
        if let (Some(first), true) = (words.first_mut(), small) {
            *first = ::spirv::MAGIC_NUMBER;
        }
        for stage in ShaderStage::ALL {
            prop_assert!(reflect("test", stage, &words).is_err());
        }
        _ = strip_unused_bindings::strip_unused_bindings(words);
    }

    #[test]
    fn random_instructions_never_panic(code in prop::collection::vec((0u32..400, prop::collection::vec(0u32..24, 0..6)), 0..80)) {
        let mut words = rich()[..5].to_vec();
        // Entry point 'main' of a compute shader, so that parsing continues.
        words.extend([6 << 16 | Op::EntryPoint as u32, 5, 1, u32::from_le_bytes(*b"main"), 0, 2]);
        for (op, operands) in code {
            words.push((operands.len() as u32 + 1) << 16 | op);
            words.extend(operands);
        }
        _ = reflect("test", ShaderStage::Compute, &words);
        let sound = words::validate(&words).is_ok();
        let kept = strip_unused_bindings::strip_unused_bindings(words);
        prop_assert_eq!(words::validate(&kept).is_ok(), sound);
    }

    #[test]
    fn damaged_modules_never_panic(cut in any::<prop::sample::Index>(), flips in prop::collection::vec((any::<prop::sample::Index>(), 0u32..32), 0..8)) {
        let whole = rich();
        let mut words = whole.to_vec();
        for (word, bit) in flips {
            let at = word.index(words.len());
            words[at] ^= 1 << bit;
        }
        _ = reflect("test", ShaderStage::Compute, &words);
        _ = strip_unused_bindings::strip_unused_bindings(words.clone());
        words.truncate(cut.index(whole.len()));
        _ = reflect("test", ShaderStage::Compute, &words);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn random_text_is_compiled_or_refused(
        text in "([ -~é\n\\x00]{0,40}|(void main\\(\\) \\{|\\}|#include <lvk/ray_query.glsl>|#version 460|#line 9 \"a\"|#define A\\(x\\) x|A\\(1\\)|;|//|/\\*|\\*/|\"|\n| ){0,20})"
    ) {
        for stage in [ShaderStage::Compute, ShaderStage::AnyHit] {
            match build(&desc(stage, &text)) {
                Ok(words) => _ = reflect("test", stage, &words),
                Err(Error::Shader { log, .. }) => prop_assert!(!log.is_empty()),
                Err(other) => prop_assert!(false, "{other:?}"),
            }
        }
    }
}
