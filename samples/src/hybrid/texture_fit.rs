//! Makes a scene's textures fit the device.

use crate::app::sample_error::SampleError;
use lvk::{Limits, readable_name};

use crate::picture::shrink::shrink_in_place;
use crate::picture::shrunk_size;
use crate::scene::{Scene, Texture};

/// Textures that the sample has beside those of the scene: sky, picture, G-buffer, and what `lvk` keeps for itself.
const OWN_TEXTURES: u32 = 16;

/// Shrinks the textures and normal maps of `scene` that are larger than `limits` allow, and returns a warning for each.
///
/// # Errors
/// [`SampleError::TooManyTextures`].
pub fn fit_textures(scene: &mut Scene, limits: &Limits) -> Result<Vec<String>, SampleError> {
    let limit = limits.max_bindless_textures.saturating_sub(OWN_TEXTURES);
    let count = scene.textures.len() + scene.normal_maps.len();
    if count > limit as usize {
        return Err(SampleError::TooManyTextures { count, limit });
    }
    let side = limits.max_texture_2d.max(1);
    let all = scene.textures.iter_mut().chain(&mut scene.normal_maps);
    Ok(all.filter_map(|texture| fit(texture, side)).collect())
}

/// Number of descriptor slots for textures that `scene` needs.
pub fn textures_needed(scene: &Scene) -> u32 {
    u32::try_from(scene.textures.len() + scene.normal_maps.len())
        .unwrap_or(u32::MAX)
        .saturating_add(OWN_TEXTURES)
}

fn fit(texture: &mut Texture, side: u32) -> Option<String> {
    let from = [texture.width, texture.height];
    let [width, height] = shrunk_size(from, side)?;
    shrink_in_place(&mut texture.pixels, from, [width, height]);
    let warning = format!(
        "texture {} of {}x{} texels is larger than the device takes; shrunk to {width}x{height}",
        readable_name(&texture.name),
        texture.width,
        texture.height
    );
    (texture.width, texture.height) = (width, height);
    Some(warning)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width: u32, height: u32) -> Texture {
        let pixels = [10, 20, 30, 255].repeat((width * height) as usize);
        Texture { name: "wall.png".to_owned(), width, height, pixels }
    }

    fn scene(textures: Vec<Texture>) -> Scene {
        Scene { textures, ..Scene::procedural() }
    }

    fn limits(max_texture_2d: u32, max_bindless_textures: u32) -> Limits {
        Limits { max_texture_2d, max_bindless_textures, ..Limits::default() }
    }

    #[test]
    fn a_texture_that_is_too_large_is_shrunk_with_a_warning_that_names_it() {
        let mut scene = scene(vec![texture(40, 10), texture(16, 16)]);
        let warnings = fit_textures(&mut scene, &limits(16, 100)).unwrap();
        assert_eq!(scene.textures, [texture(16, 4), texture(16, 16)]);
        assert_eq!(warnings.len(), 1);
        for part in ["wall.png", "40x10", "16x4"] {
            assert!(warnings[0].contains(part), "{warnings:?}");
        }
    }

    #[test]
    fn more_textures_than_slots_are_refused() {
        let mut scene = scene(vec![texture(1, 1); 5]);
        assert_eq!(textures_needed(&scene), OWN_TEXTURES + 5);
        assert!(fit_textures(&mut scene, &limits(16, OWN_TEXTURES + 5)).unwrap().is_empty());
        let error = fit_textures(&mut scene, &limits(16, OWN_TEXTURES + 4)).unwrap_err();
        assert!(matches!(error, SampleError::TooManyTextures { count: 5, limit: 4 }));
    }
}
