//! Many scenes as one.

use glam::{Affine3A, Vec3};

use super::world::{Instance, Piece, World};
use crate::scene::{Material, Scene};

/// Puts `scenes` into one, with lights and cameras of the first. Answers its pieces, each with the number of the scene that it
/// comes from: those of opaque triangles first, then the others.
pub(super) fn merge(mut scenes: Vec<Scene>) -> (Scene, Vec<(usize, Piece)>) {
    let mut all = empty_like(&scenes[0]);
    all.opaque_triangle_count = scenes.iter().map(|scene| scene.opaque_triangle_count).sum();
    let mut firsts = Vec::with_capacity(scenes.len());
    for scene in &mut scenes {
        firsts.push([all.positions.len() as u32, all.materials.len() as u32]);
        append_surfaces(&mut all, scene);
    }
    let mut pieces = Vec::new();
    for is_refractive in [false, true] {
        for (number, (scene, first)) in scenes.iter().zip(&firsts).enumerate() {
            let piece = append_triangles(&mut all, scene, *first, is_refractive);
            pieces.extend(piece.map(|piece| (number, piece)));
        }
    }
    (all, pieces)
}

/// A scene without triangles.
fn empty_like(scene: &Scene) -> Scene {
    Scene {
        name: scene.name.clone(),
        positions: Vec::new(),
        normals: Vec::new(),
        texcoords: Vec::new(),
        colors: Vec::new(),
        triangles: Vec::new(),
        triangle_materials: Vec::new(),
        source_triangles: Vec::new(),
        materials: Vec::new(),
        textures: Vec::new(),
        normal_maps: Vec::new(),
        warnings: Vec::new(),
        opaque_triangle_count: 0,
        degenerate_triangle_count: 0,
        ..*scene
    }
}

/// Moves vertices, materials and textures; triangles stay.
fn append_surfaces(all: &mut Scene, scene: &mut Scene) {
    let (first_texture, first_map) = (all.textures.len() as u32, all.normal_maps.len() as u32);
    let renumbered = |material: Material| Material {
        albedo_texture: material.albedo_texture.map(|texture| first_texture + texture),
        normal_map: material.normal_map.map(|map| first_map + map),
        ..material
    };
    all.materials.extend(std::mem::take(&mut scene.materials).into_iter().map(renumbered));
    append_colors(all, scene.positions.len(), &std::mem::take(&mut scene.colors));
    all.positions.append(&mut scene.positions);
    all.normals.append(&mut scene.normals);
    all.texcoords.append(&mut scene.texcoords);
    all.textures.append(&mut scene.textures);
    all.normal_maps.append(&mut scene.normal_maps);
    all.warnings.append(&mut scene.warnings);
    all.degenerate_triangle_count += scene.degenerate_triangle_count;
}

/// Appends colours, white where there are none, for as many vertices as follow those of `all`.
fn append_colors(all: &mut Scene, count: usize, colors: &[[f32; 3]]) {
    if all.colors.is_empty() && colors.is_empty() {
        return;
    }
    all.colors.resize(all.positions.len(), [1.0; 3]);
    all.colors.extend(colors);
    all.colors.resize(all.positions.len() + count, [1.0; 3]);
}

/// Appends the opaque triangles of `scene`, or the others, if there are any.
fn append_triangles(
    all: &mut Scene,
    scene: &Scene,
    [first_vertex, first_material]: [u32; 2],
    is_refractive: bool,
) -> Option<Piece> {
    let (opaque, total) = (scene.opaque_triangle_count as usize, scene.triangles.len());
    let range = if is_refractive { opaque..total } else { 0..opaque };
    let start = all.triangles.len() as u32;
    let triangles = scene.triangles[range.clone()].iter();
    all.triangles.extend(triangles.map(|triangle| triangle.map(|vertex| first_vertex + vertex)));
    let materials = scene.triangle_materials[range.clone()].iter();
    all.triangle_materials.extend(materials.map(|material| first_material + material));
    all.source_triangles.extend(&scene.source_triangles[range.clone()]);
    let kind = if is_refractive { " (glass)" } else { "" };
    (!range.is_empty()).then(|| piece_of(all, format!("{}{kind}", scene.name), start, is_refractive))
}

/// The piece of the triangles from `start` on.
fn piece_of(scene: &Scene, name: String, start: u32, is_refractive: bool) -> Piece {
    let corners = scene.triangles[start as usize..].iter().flatten();
    let (low, high) =
        corners.fold((u32::MAX, 0), |(low, high), vertex| (low.min(*vertex), high.max(*vertex)));
    Piece { name, triangles: start..scene.triangles.len() as u32, vertices: low..high + 1, is_refractive }
}

/// The world with every instance's triangles where they are seen.
pub(super) fn bake(world: &World) -> World {
    let mut scene = empty_like(&world.scene);
    scene.materials.clone_from(&world.scene.materials);
    scene.textures.clone_from(&world.scene.textures);
    scene.warnings.clone_from(&world.scene.warnings);
    let mut pieces = Vec::new();
    for is_refractive in [false, true] {
        let start = scene.triangles.len() as u32;
        for instance in
            world.instances.iter().filter(|it| world.pieces[it.piece].is_refractive == is_refractive)
        {
            bake_instance(&mut scene, world, instance);
        }
        if scene.triangles.len() as u32 > start {
            let kind = if is_refractive { " (glass)" } else { "" };
            let name = format!("{}{kind}", scene.name);
            pieces.push(piece_of(&scene, name, start, is_refractive));
        }
        if !is_refractive {
            scene.opaque_triangle_count = scene.triangles.len() as u32;
        }
    }
    let place = Affine3A::IDENTITY;
    let instances = (0..pieces.len()).map(|piece| Instance { piece, place }).collect();
    World { scene, pieces, instances }
}

fn bake_instance(to: &mut Scene, world: &World, instance: &Instance) {
    let (piece, from) = (&world.pieces[instance.piece], &world.scene);
    let vertices = piece.vertices.start as usize..piece.vertices.end as usize;
    let first = to.positions.len() as u32;
    let position = |p: &[f32; 3]| instance.place.transform_point3(Vec3::from(*p)).to_array();
    let normal = |n: &[f32; 3]| {
        instance.place.transform_vector3(Vec3::from(*n)).normalize_or(Vec3::from(*n)).to_array()
    };
    append_colors(to, vertices.len(), from.colors.get(vertices.clone()).unwrap_or_default());
    to.positions.extend(from.positions[vertices.clone()].iter().map(position));
    to.normals.extend(from.normals[vertices.clone()].iter().map(normal));
    to.texcoords.extend(&from.texcoords[vertices]);
    let triangles = piece.triangles.start as usize..piece.triangles.end as usize;
    let moved = |vertex: u32| first + (vertex - piece.vertices.start);
    to.triangles.extend(from.triangles[triangles.clone()].iter().map(|corners| corners.map(moved)));
    to.triangle_materials.extend(&from.triangle_materials[triangles.clone()]);
    to.source_triangles.extend(&from.source_triangles[triangles]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::progress::Progress;

    /// A street of two kinds of courtyards, one of them without glass.
    fn world() -> World {
        let mut plain = Scene::town();
        plain.name = "town".to_owned();
        World::street(vec![Scene::procedural(), plain], 2).unwrap()
    }

    /// Corners of all triangles that are seen, in an order of their own.
    fn seen(world: &World) -> Vec<([i64; 9], bool)> {
        let mut all = Vec::new();
        for Instance { piece, place } in &world.instances {
            let piece = &world.pieces[*piece];
            for triangle in
                &world.scene.triangles[piece.triangles.start as usize..piece.triangles.end as usize]
            {
                let corner = |vertex: u32| {
                    let at = place.transform_point3(Vec3::from(world.scene.positions[vertex as usize]));
                    at.to_array().map(|x| (f64::from(x) * 1e4).round() as i64)
                };
                let [a, b, c] = triangle.map(corner);
                let corners: Vec<i64> = [a, b, c].concat();
                all.push((std::array::from_fn(|i| corners[i]), piece.is_refractive));
            }
        }
        all.sort_unstable();
        all
    }

    #[test]
    fn combining_moves_triangles_and_changes_none() {
        let world = world();
        let combined = world.combined().unwrap();
        assert_eq!((combined.instances.len(), combined.pieces.len()), (2, 2));
        assert_eq!(combined.triangle_count(), world.instanced_triangle_count());
        assert!(combined.triangle_count() > world.triangle_count());
        assert!(seen(&combined) == seen(&world), "another world");
        assert!((combined.farthest() - world.farthest()).abs() < 0.1 * world.farthest());
    }

    #[test]
    fn merged_scenes_keep_the_promises_of_scenes() {
        for world in
            [world(), world().combined().unwrap(), World::valley(2_000, 9, &mut Progress::hidden()).unwrap()]
        {
            crate::hybrid::check_promises(&world.scene).unwrap();
            let glass = |triangle: usize| {
                world.scene.materials[world.scene.triangle_materials[triangle] as usize].is_refractive()
            };
            let opaque = world.scene.opaque_triangle_count as usize;
            assert!((0..opaque).all(|triangle| !glass(triangle)));
            assert!((opaque..world.scene.triangles.len()).all(glass));
            for piece in &world.pieces {
                let range = piece.triangles.start as usize..piece.triangles.end as usize;
                let corners = world.scene.triangles[range].iter().flatten();
                assert!(corners.into_iter().all(|vertex| piece.vertices.contains(vertex)));
            }
        }
    }

    #[test]
    fn colors_stay_with_their_vertices() {
        let mut colored = Scene::town();
        colored.colors = colored.positions.iter().map(|p| p.map(|x| 0.5 + 0.01 * x)).collect();
        let counts = [Scene::town().positions.len(), colored.positions.len()];
        let (all, _) = merge(vec![Scene::town(), colored.clone(), Scene::town()]);
        assert_eq!(all.colors.len(), all.positions.len());
        let (before, rest) = all.colors.split_at(counts[0]);
        let (own, after) = rest.split_at(counts[1]);
        assert!(own == colored.colors && before.iter().chain(after).all(|color| *color == [1.0; 3]));
        let combined = World::street(vec![colored], 2).unwrap().combined().unwrap();
        crate::hybrid::check_promises(&combined.scene).unwrap();
        assert!(combined.scene.colors.iter().any(|color| *color != [1.0; 3]));
    }

    #[test]
    fn too_many_triangles_for_one_mesh_are_refused() {
        let mut world = world();
        world.instances = vec![world.instances[1]; 2_000];
        assert!(matches!(world.combined(), Err(SampleError::MeshTooLarge { .. })));
        assert!(matches!(World::street(Vec::new(), 3), Err(SampleError::NoScenes)));
        assert!(matches!(World::street(vec![Scene::town()], 0), Err(SampleError::NoScenes)));
    }

    use crate::app::sample_error::SampleError;
}
