//! Makes a scene's textures fit the device.

use crate::app::sample_error::SampleError;
use image::RgbaImage;
use image::imageops::{self, FilterType};
use lvk::Limits;

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
    let (width, height) = shrunk_size([texture.width, texture.height], side)?;
    let pixels = std::mem::take(&mut texture.pixels);
    let image = RgbaImage::from_raw(texture.width, texture.height, pixels)?;
    texture.pixels = imageops::resize(&image, width, height, FilterType::Triangle).into_raw();
    let warning = format!(
        "texture {} of {}x{} texels is larger than the device takes; shrunk to {width}x{height}",
        texture.name, texture.width, texture.height
    );
    (texture.width, texture.height) = (width, height);
    Some(warning)
}

/// The largest size of the same shape with no side above `side`; `None` for a size that fits.
fn shrunk_size([width, height]: [u32; 2], side: u32) -> Option<(u32, u32)> {
    let longest = width.max(height);
    let shrunk =
        |length: u32| (u64::from(length) * u64::from(side) / u64::from(longest.max(1))).max(1) as u32;
    (longest > side).then(|| (shrunk(width), shrunk(height)))
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
    fn only_sizes_beyond_the_limit_shrink_and_keep_their_shape() {
        assert_eq!(shrunk_size([64, 64], 64), None);
        assert_eq!(shrunk_size([65, 1], 64), Some((64, 1)));
        assert_eq!(shrunk_size([1000, 500], 100), Some((100, 50)));
        assert_eq!(shrunk_size([1, u32::MAX], 16_384), Some((1, 16_384)));
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
