//! True if a scene keeps the promises that the shaders rely on.

use crate::app::sample_error::SampleError;
use crate::scene::Scene;

/// Custom indices, which carry the first triangle of an instance, have 24 bits.
const CUSTOM_INDEX_LIMIT: u32 = 1 << 24;

/// Fails where drawing `scene` would read outside of its arrays. Scenes that were loaded always pass, but for
/// their size.
pub(super) fn check(scene: &Scene) -> Result<(), SampleError> {
    check_promises(scene)?;
    let count = scene.opaque_triangle_count;
    if count >= CUSTOM_INDEX_LIMIT {
        return Err(SampleError::TooManyTriangles { count, limit: CUSTOM_INDEX_LIMIT });
    }
    Ok(())
}

/// As [`check`], for any number of triangles that 32 bits count.
pub(crate) fn check_promises(scene: &Scene) -> Result<(), SampleError> {
    let vertices = scene.positions.len();
    let triangles = scene.triangles.len();
    let is_vertex = |&vertex: &u32| (vertex as usize) < vertices;
    let is_material = |&material: &u32| (material as usize) < scene.materials.len();
    let is_texture = |texture: u32| (texture as usize) < scene.textures.len();
    let is_normal_map = |map: u32| (map as usize) < scene.normal_maps.len();
    let promises = [
        (triangles > 0, "it has no triangles"),
        (u32::try_from(triangles).is_ok_and(|count| count <= u32::MAX / 3), "it has too many triangles"),
        (scene.opaque_triangle_count as usize <= triangles, "more triangles are opaque than it has"),
        (scene.normals.len() == vertices, "it needs a normal for each position"),
        (scene.texcoords.len() == vertices, "it needs a texture coordinate for each position"),
        (
            scene.colors.is_empty() || scene.colors.len() == vertices,
            "it needs a colour for each position, or none",
        ),
        (scene.triangle_materials.len() == triangles, "it needs a material for each triangle"),
        (scene.source_triangles.len() == triangles, "it needs a source number for each triangle"),
        (scene.triangles.iter().flatten().all(is_vertex), "a triangle names a vertex that is not there"),
        (scene.triangle_materials.iter().all(is_material), "a triangle names a material that is not there"),
        (
            scene.materials.iter().filter_map(|material| material.albedo_texture).all(is_texture),
            "a material names a texture that is not there",
        ),
        (
            scene.materials.iter().filter_map(|material| material.normal_map).all(is_normal_map),
            "a material names a normal map that is not there",
        ),
    ];
    match promises.into_iter().find(|(is_kept, _)| !is_kept) {
        Some((_, what)) => Err(SampleError::BrokenScene(what)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_scene_is_refused_and_a_whole_one_is_not() {
        let whole = Scene::procedural();
        assert!(check(&whole).is_ok());
        let breakers: [fn(&mut Scene); 10] = [
            |scene| scene.triangles.clear(),
            |scene| scene.opaque_triangle_count = u32::MAX,
            |scene| scene.normals.clear(),
            |scene| scene.texcoords.truncate(1),
            |scene| scene.colors = vec![[0.5; 3]],
            |scene| scene.source_triangles.truncate(1),
            |scene| scene.triangles[5][2] = scene.positions.len() as u32,
            |scene| scene.triangle_materials[7] = 1000,
            |scene| scene.materials[0].albedo_texture = Some(1000),
            |scene| scene.materials[0].normal_map = Some(0),
        ];
        for breaker in breakers {
            let mut scene = whole.clone();
            breaker(&mut scene);
            assert!(matches!(check(&scene), Err(SampleError::BrokenScene(_))));
        }
    }
}
