//! Occlusion culling: what is hidden is not rasterised, and every picture is the same to the bit as without culling.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::{Mat4, Vec3};
use lvk::Context;
use lvk_gltf::{AlphaMode, Material, Model, Node, Transform};
use lvk_samples::app::headless;
use lvk_samples::app::sample::Sample as _;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::device;
use lvk_viewer::light::Environment;
use lvk_viewer::{CullingMode, DrawnInstances, Method, PrimaryVisibility, Viewer, ViewerConfig};

use crate::moving_model::{DURATION, moving_model};
use crate::scenes::{Builder, View, colored, viewer};

/// Boxes behind the wall: columns and rows.
const BOXES: [u16; 2] = [24, 16];

/// The radiance of a frame by the rasteriser, bit by bit, and what was rasterised.
pub fn frame(viewer: &mut Viewer, culling: CullingMode) -> (Vec<[u32; 3]>, Option<DrawnInstances>) {
    let primary = PrimaryVisibility::Raster;
    viewer.configure(&ViewerConfig { primary, culling, ..*viewer.config() }).unwrap();
    headless::picture(viewer).unwrap();
    let bits = viewer.radiance().unwrap().iter().map(|pixel| pixel.map(f32::to_bits)).collect();
    (bits, viewer.drawn_instances().unwrap())
}

/// Frames that follow each other, by two viewers: one culls by occlusion, the other draws all.
struct Pair {
    culled: Viewer,
    whole: Viewer,
}

impl Pair {
    fn new(ctx: &Context, model: &Model, size: [u32; 2]) -> Self {
        let view = View { camera: ahead(0.0), size, samples: 1 };
        let [culled, whole] = [0; 2].map(|_| {
            let by = (Method::Hybrid, RayPath::Query);
            let mut viewer = viewer(ctx, by, model, &Environment::uniform([1.0; 3]), &view);
            let config = ViewerConfig { is_progressive: true, bounces: 2, ..*viewer.config() };
            viewer.configure(&config).unwrap();
            viewer
        });
        Self { culled, whole }
    }

    /// Both play the first animation from a time on.
    fn play(&mut self, seconds: f32) {
        [&mut self.culled, &mut self.whole].into_iter().for_each(|viewer| viewer.play(Some(0), seconds));
    }

    /// Asserts that both frames are the same. Returns what was rasterised, and the picture.
    fn frame(&mut self, camera: &Camera, what: &str) -> (DrawnInstances, Vec<[u32; 3]>) {
        self.culled.set_view(camera);
        self.whole.set_view(camera);
        let (picture, drawn) = frame(&mut self.culled, CullingMode::Occlusion);
        let (expected, _) = frame(&mut self.whole, CullingMode::None);
        let differing = picture.iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 0, "{what}: {differing} of {} pixels differ", expected.len());
        (drawn.unwrap(), picture)
    }
}

/// A camera before the wall, moved to the right.
fn ahead(right: f32) -> Camera {
    Camera::looking_at([right, 0.3, 6.0], [right, 0.3, 0.0], 60.0)
}

/// A wall in the plane z = 2, before which cameras stand.
fn wall(builder: Builder, material: Material) -> Builder {
    builder.quad(Vec3::new(-5.0, -4.0, 2.0), Vec3::X * 10.0, Vec3::Y * 8.0, material)
}

/// Hundreds of squares behind the wall, which reach to the right of it by `beyond`.
fn squares(mut model: Model, beyond: f32) -> Model {
    let corner = Vec3::new(-0.08, -0.08, 0.0);
    let square =
        Builder::default().quad(corner, Vec3::X * 0.16, Vec3::Y * 0.16, colored([0.2, 0.6, 0.9], 0.0, 0.5));
    let mut square = square.model();
    square.meshes[0].primitives[0].material = Some(model.materials.len());
    model.materials.append(&mut square.materials);
    model.meshes.append(&mut square.meshes);
    let mesh = Some(model.meshes.len() - 1);
    for (column, row) in (0..BOXES[0]).flat_map(|column| (0..BOXES[1]).map(move |row| (column, row))) {
        let along = f32::from(column) / f32::from(BOXES[0] - 1);
        let place =
            Vec3::new(-2.0 + (7.0 + beyond) * along, -1.5 + 0.2 * f32::from(row), -0.1 * f32::from(row));
        model.scenes[0].roots.push(model.nodes.len());
        let transform = Transform::Matrix(Mat4::from_translation(place));
        model.nodes.push(Node { mesh, transform, ..Node::default() });
    }
    model
}

fn square_count() -> u32 {
    u32::from(BOXES[0] * BOXES[1])
}

#[test]
fn a_wall_hides_hundreds_and_they_are_drawn_in_the_frame_that_shows_them() {
    let Some(ctx) = device() else { return };
    let model = squares(wall(Builder::default(), colored([0.8; 3], 0.0, 1.0)).model(), 0.0);
    let mut pair = Pair::new(&ctx, &model, [64, 40]);
    // The first frame has no frame before: it draws all of the frustum, and finds out what is hidden.
    let first = pair.frame(&ahead(0.0), "the first frame").0;
    assert_eq!((first.count, first.in_frustum), (square_count() + 1, square_count() + 1));
    for number in 0..3 {
        let (drawn, _) = pair.frame(&ahead(0.01 * number as f32), "behind the wall");
        assert_eq!((drawn.count, drawn.triangle_count), (1, 2), "the wall alone is drawn");
        assert_eq!(drawn.in_frustum, square_count() + 1);
    }
    // At once so far to the right that many squares show beside the wall.
    let beside = Camera::looking_at([7.0, 0.3, 6.0], [5.0, 0.3, 0.0], 60.0);
    let (drawn, shown) = pair.frame(&beside, "beside the wall");
    let (_, without) =
        Pair::new(&ctx, &wall(Builder::default(), colored([0.8; 3], 0.0, 1.0)).model(), [64, 40])
            .frame(&beside, "beside the wall alone");
    assert_ne!(shown, without, "squares show");
    let again = pair.frame(&beside, "still beside the wall").0;
    for drawn in [drawn, again] {
        assert!((10..square_count() / 2).contains(&drawn.count), "{drawn:?}");
    }
    assert_eq!(pair.frame(&ahead(0.0), "behind the wall again").0.in_frustum, square_count() + 1);
    assert_eq!(pair.frame(&ahead(0.0), "still behind the wall").0.count, 1);
}

#[test]
fn cameras_of_odd_pictures_move_along_across_and_through_the_wall() {
    let Some(ctx) = device() else { return };
    let model = squares(wall(Builder::default(), colored([0.8; 3], 0.0, 1.0)).model(), 3.0);
    for size in [[61, 37], [1, 1], [130, 3]] {
        let mut pair = Pair::new(&ctx, &model, size);
        let mut fewest = u32::MAX;
        for step in 0..8_u8 {
            let along = f32::from(step) / 7.0;
            let camera = Camera { eye: [6.5 * along, 0.3, 6.0 - 7.0 * along], ..ahead(2.0 * along) };
            let (drawn, _) = pair.frame(&camera, &format!("{size:?} at step {step}"));
            fewest = fewest.min(drawn.count);
        }
        assert!(fewest < square_count() / 2, "{size:?}: {fewest}");
    }
}

#[test]
fn holes_and_coverage_hide_only_where_they_are_solid() {
    let Some(ctx) = device() else { return };
    for alpha_mode in [AlphaMode::Mask { cutoff: 0.5 }, AlphaMode::Blend] {
        let material = Material { alpha_mode, ..colored([0.8; 3], 0.0, 1.0) };
        let mut model = wall(Builder::default(), material).model();
        // Solid on the left, nothing on the right.
        model.meshes[0].primitives[0].colors =
            [1.0, 0.0, 0.0, 1.0].map(|alpha| [1.0, 1.0, 1.0, alpha]).to_vec();
        let model = squares(model, 0.0);
        let mut pair = Pair::new(&ctx, &model, [61, 37]);
        let counts = [-4.0, -4.0, 0.0, 0.5, 1.5, -2.0]
            .map(|right| pair.frame(&ahead(right), &format!("{alpha_mode:?} at {right}")).0);
        let seen = counts.map(|drawn| drawn.count);
        assert!(seen[4] > 20, "{alpha_mode:?}: {seen:?} show through the holes");
        assert!(seen[1] < counts[1].in_frustum || alpha_mode == AlphaMode::Blend, "{alpha_mode:?}: {seen:?}");
    }
}

#[test]
fn meshes_that_deform_and_nodes_that_move_show_behind_and_beside_a_wall() {
    let Some(ctx) = device() else { return };
    let mut model = moving_model();
    let screen = Builder::default()
        .quad(Vec3::new(-0.4, 0.0, 1.2), Vec3::X * 1.2, Vec3::Y * 1.2, colored([0.4; 3], 0.0, 0.8))
        .model();
    let [mesh, material] = [model.meshes.len(), model.materials.len()];
    model.meshes.extend(screen.meshes);
    model.materials.extend(screen.materials);
    model.meshes[mesh].primitives[0].material = Some(material);
    model.scenes[0].roots.push(model.nodes.len());
    model.nodes.push(Node { mesh: Some(mesh), ..Node::default() });
    let mut pair = Pair::new(&ctx, &model, [61, 37]);
    let mut counts = Vec::new();
    for step in 0..10_u8 {
        let along = f32::from(step) / 9.0;
        pair.play(DURATION * along);
        let camera = Camera::looking_at([0.9 - along, 0.6, 3.0], [0.5 - along, 0.5, 0.0], 35.0);
        counts.push(pair.frame(&camera, &format!("step {step}")).0.count);
    }
    let (fewest, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
    assert!(fewest < most, "{counts:?}: something is hidden for a while");
}

/// A square of the plane z = 0 from x = `left` to `right`.
fn strip(builder: Builder, [left, right]: [f32; 2], material: Material) -> Builder {
    builder.quad(Vec3::new(left, -0.5, 0.0), Vec3::X * (right - left), Vec3::Y, material)
}

/// A screen in the plane z = 2, which hides what is left of x = 1.5 from a camera at z = 3.
fn screen(builder: Builder) -> Builder {
    builder.quad(Vec3::new(-4.0, -3.0, 2.0), Vec3::X * 4.5, Vec3::Y * 6.0, colored([0.4; 3], 0.0, 1.0))
}

fn red_and_blue() -> [Material; 2] {
    [[0.9, 0.1, 0.1], [0.1, 0.1, 0.9]].map(|color| colored(color, 0.0, 1.0))
}

/// A red square that the screen hides, and then a blue one in its plane that is never hidden.
fn two_meshes_in_a_plane() -> Model {
    let [red, blue] = red_and_blue();
    screen(strip(strip(Builder::default(), [-1.2, -0.4], red), [-1.2, 2.8], blue)).model()
}

/// Two instances of a mesh with a blue geometry and then a red one. The red square of the first is in the plane of the blue square of
/// the second; the screen hides the first.
fn two_geometries_in_a_plane() -> Model {
    let [red, blue] = red_and_blue();
    let mut model = screen(strip(strip(Builder::default(), [0.0, 1.0], blue), [2.0, 2.8], red)).model();
    let second = model.meshes[1].primitives.clone();
    model.meshes[0].primitives.extend(second);
    let first = Mat4::from_translation(Vec3::new(-3.2, 0.0, 0.0));
    let wide = Mat4::from_translation(Vec3::new(-1.2, 0.0, 0.0)) * Mat4::from_scale(Vec3::new(4.0, 1.0, 1.0));
    for (node, transform) in model.nodes.iter_mut().zip([first, wide]) {
        (node.mesh, node.transform) = (Some(0), Transform::Matrix(transform));
    }
    model
}

#[test]
fn surfaces_in_one_plane_stay_in_the_order_of_a_single_pass() {
    let Some(ctx) = device() else { return };
    for (model, is_red) in [(two_meshes_in_a_plane(), true), (two_geometries_in_a_plane(), false)] {
        let mut pair = Pair::new(&ctx, &model, [61, 37]);
        for (height, is_hidden) in
            [(3.0, true), (3.0, true), (1.5, false), (3.0, true), (3.0, true), (1.4, false)]
        {
            let camera = Camera::looking_at([0.0, 0.0, height], [0.0; 3], 60.0);
            let (drawn, picture) = pair.frame(&camera, &format!("from {height}"));
            if is_hidden {
                continue;
            }
            // The screen is behind the camera now, and both squares are drawn.
            assert_eq!(drawn.count, 2, "{drawn:?}");
            let [red, _, blue] = picture[18 * 61 + 13].map(f32::from_bits);
            assert_eq!(red > blue, is_red, "{red} and {blue}");
        }
        let camera = Camera::looking_at([0.0, 0.0, 3.0], [0.0; 3], 60.0);
        // The screen comes back in the second pass of a frame, and hides in the next.
        (0..2).for_each(|_| drop(pair.frame(&camera, "behind the screen again")));
        assert_eq!(pair.frame(&camera, "hidden").0.count, 2, "the screen and what is beside it are drawn");
    }
}
