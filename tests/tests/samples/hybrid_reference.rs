//! Visibility and shadows of the `hybrid` sample, pixel by pixel, against the f64 reference.

use image::RgbaImage;
use lvk::glam::{DAffine3, DVec3, Vec3};
use lvk_samples::hybrid::Method;
use lvk_samples::scene::{Ambient, Camera, DirectionalLight, Scene, Sky};
use lvk_tests::device;
use lvk_tests::hybrid::{HybridHarness, paths};
use lvk_tests::image_comparison::write_test_image;
use lvk_tests::rays::Ray;
use lvk_tests::reference::{Geometry, Instance, Reference};
use lvk_tests::scene_obj::obj_scene;

const SIZE: [u32; 2] = [163, 91];
const OPAQUE: u8 = 1;
const REFRACTIVE: u8 = 2;

/// Cosines closer to zero than this may round to either side.
const GRAZE: f64 = 2e-3;
/// Shadow rays of the reference start this far from the surface; so near there is no other one in the scene.
const NEAR: f32 = 1e-3;

/// The triangles of a scene for the reference: opaque ones are instance 0, refractive ones instance 1.
fn reference(scene: &Scene) -> Reference {
    let (opaque, refractive) = scene.triangles.split_at(scene.opaque_triangle_count as usize);
    let geometry = |triangles: &[[u32; 3]]| Geometry {
        positions: scene.positions.iter().map(|position| Vec3::from(*position).as_dvec3()).collect(),
        triangles: triangles.to_vec(),
        transform: DAffine3::IDENTITY,
        is_opaque: true,
    };
    let geometries = [[geometry(opaque)], [geometry(refractive)]];
    let instance = |number: usize, mask| Instance {
        geometries: &geometries[number],
        transform: DAffine3::IDENTITY,
        custom_index: if number == 0 { 0 } else { opaque.len() as u32 },
        mask,
        flip_facing: false,
        no_cull: false,
        force_opaque: None,
    };
    Reference::new(&[instance(0, OPAQUE), instance(1, REFRACTIVE)])
}

/// The ray through the middle of a pixel.
fn ray_through(camera: &Camera, [x, y]: [u32; 2]) -> Ray {
    let [right, up, forward] = camera.frame().map(|axis| Vec3::from(axis).as_dvec3());
    let half_height = (0.5 * f64::from(camera.vertical_fov_degrees).to_radians()).tan();
    let half_width = half_height * f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let place = |pixel: u32, size: u32| (f64::from(pixel) + 0.5) / f64::from(size) * 2.0 - 1.0;
    let (across, down) = (place(x, SIZE[0]) * half_width, place(y, SIZE[1]) * half_height);
    let direction = (forward + right * across - up * down).normalize();
    Ray::new(camera.eye.into(), direction.as_vec3())
}

/// True if a ray hits anything; `None` where that is in doubt.
fn is_hit(reference: &Reference, ray: &Ray) -> Option<bool> {
    let answer = reference.closest(ray, OPAQUE | REFRACTIVE);
    answer.is_certain.then_some(answer.hit.is_some())
}

/// True if a ray hits nothing, or something that is lit by the scene's sun, or else by its lamp; `None` where that is in doubt.
fn is_lit(scene: &Scene, reference: &Reference, ray: &Ray) -> Option<bool> {
    let answer = reference.closest(ray, OPAQUE | REFRACTIVE);
    let Some(hit) = answer.hit.filter(|_| answer.is_certain) else {
        return answer.is_certain.then_some(true);
    };
    let corners = scene.triangles[(hit.ids.custom_index + hit.ids.primitive) as usize];
    let [a, b, c] = corners.map(|vertex| Vec3::from(scene.positions[vertex as usize]).as_dvec3());
    let normals = corners.map(|vertex| Vec3::from(scene.normals[vertex as usize]).as_dvec3());
    let [u, v] = hit.barycentrics;
    let direction = Vec3::from(ray.direction).as_dvec3();
    let geometric = facing((b - a).cross(c - a).normalize(), direction);
    let shading = (normals[0] * (1.0 - u - v) + normals[1] * u + normals[2] * v).normalize();
    let shading = if shading.dot(geometric) < 0.0 { -shading } else { shading };
    let point = a * (1.0 - u - v) + b * u + c * v;
    let (way, end) = match &scene.sun {
        Some(sun) => (Vec3::from(sun.direction).as_dvec3(), f64::INFINITY),
        None => {
            let way = Vec3::from(scene.light.position).as_dvec3() - point;
            (way, way.length())
        }
    };
    let cosines = [geometric, shading].map(|normal| normal.dot(way.normalize()));
    // Near a silhouette the sample bends the shading normal.
    if shading.dot(direction) > -0.05 || cosines.iter().any(|cosine| cosine.abs() < GRAZE) {
        return None;
    }
    if cosines.iter().any(|cosine| *cosine < 0.0) {
        return Some(false);
    }
    let shadow =
        Ray { t_min: NEAR, t_max: end as f32, ..Ray::new(point.as_vec3(), way.normalize().as_vec3()) };
    reference.occluded(&shadow, OPAQUE).map(|occluded| !occluded)
}

fn facing(normal: DVec3, direction: DVec3) -> DVec3 {
    if normal.dot(direction) > 0.0 { -normal } else { normal }
}

/// Compares the pixels that are not black with the ones that must not be, in the first three cameras and all ways.
fn assert_mask(what: &str, scene: &Scene, expected: impl Fn(&Ray) -> Option<bool>) {
    let Some(ctx) = device() else { return };
    let methods = [Method::Standalone, Method::Hybrid];
    let ways: Vec<_> = methods
        .into_iter()
        .flat_map(|method| paths(&ctx).into_iter().map(move |path| (method, path)))
        .collect();
    let mut harnesses: Vec<_> =
        ways.iter().map(|way| HybridHarness::new(&ctx, scene, *way, SIZE, 0)).collect();
    for (number, camera) in scene.cameras.iter().enumerate().take(3) {
        let mask: Vec<_> = (0..SIZE[0] * SIZE[1])
            .map(|index| expected(&ray_through(camera, [index % SIZE[0], index / SIZE[0]])))
            .collect();
        for (harness, (method, path)) in harnesses.iter_mut().zip(ways.iter().copied()) {
            let what = format!("{what} camera {} {method:?} {path:?}", number + 1);
            // The rasteriser places vertices on a grid, and so moves edges a little.
            let allowed = if method == Method::Hybrid { SIZE[0] * SIZE[1] / 1000 } else { 0 };
            compare_mask(&what, &harness.render(camera), &mask, allowed as usize);
        }
    }
}

fn compare_mask(what: &str, image: &RgbaImage, mask: &[Option<bool>], allowed: usize) {
    let found = image.pixels().map(|pixel| pixel.0[..3] != [0; 3]);
    let judged = || found.clone().zip(mask).filter_map(|(found, expected)| Some((found, (*expected)?)));
    let (count, bright) = (judged().count(), judged().filter(|(_, expected)| *expected).count());
    let wrong: Vec<String> = found
        .clone()
        .zip(mask)
        .enumerate()
        .filter(|(_, (found, expected))| expected.is_some_and(|expected| expected != *found))
        .map(|(index, (found, _))| {
            format!("({}, {}) is {found}", index as u32 % SIZE[0], index as u32 / SIZE[0])
        })
        .collect();
    eprintln!("{what}: {count} of {} pixels certain, {bright} bright, {} wrong", mask.len(), wrong.len());
    assert!(count * 20 > mask.len() * 19, "{what}: too few pixels are certain");
    assert!(
        bright * 200 > count && (count - bright) * 200 > count,
        "{what}: an even image would test nothing"
    );
    let kept = (wrong.len() > allowed).then(|| write_test_image(what, image));
    assert_eq!(kept, None, "{what}: {} pixels are wrong, {:?}", wrong.len(), &wrong[..wrong.len().min(5)]);
}

fn bright_sky() -> Sky {
    let white = [1.0; 3];
    Sky { zenith: white, horizon: white, ground: white, sun_color: [0.0; 3], clouds: 0.0, ..Sky::day() }
}

/// A bright sky behind black things.
#[test]
fn the_sky_is_where_no_ray_hits() {
    let mut scene = obj_scene();
    scene.sky = bright_sky();
    scene.ambient = Ambient { above: [0.0; 3], below: [0.0; 3] };
    scene.light.color = [0.0; 3];
    scene.sun = None;
    let reference = reference(&scene);
    assert_mask("sky", &scene, |ray| is_hit(&reference, ray).map(|hit| !hit));
}

/// White things without highlights before a bright sky, lit by a strong lamp or a strong sun alone.
fn lit_by(light: [f32; 3], sun: Option<DirectionalLight>) -> Scene {
    let mut scene = obj_scene();
    scene.sky = bright_sky();
    scene.ambient = Ambient { above: [0.0; 3], below: [0.0; 3] };
    (scene.light.color, scene.sun) = (light, sun);
    for material in &mut scene.materials {
        (material.albedo, material.albedo_texture, material.specular) = ([1.0; 3], None, [0.0; 3]);
    }
    scene
}

#[test]
fn the_lamp_lights_what_no_opaque_thing_hides() {
    let scene = lit_by([500.0; 3], None);
    let reference = reference(&scene);
    assert_mask("lamp", &scene, |ray| is_lit(&scene, &reference, ray));
}

/// The sun's direction is that of the line `sun` in the camera file.
#[test]
fn the_sun_lights_what_no_opaque_thing_hides() {
    let sun = obj_scene().sun.map(|sun| DirectionalLight { color: [500.0; 3], ..sun });
    let expected = Vec3::new(-0.6, 0.7, 0.5).normalize();
    assert!(sun.is_some_and(|sun| Vec3::from(sun.direction).distance(expected) < 1e-6), "{sun:?}");
    let scene = lit_by([0.0; 3], sun);
    let reference = reference(&scene);
    assert_mask("sun", &scene, |ray| is_lit(&scene, &reference, ray));
}
