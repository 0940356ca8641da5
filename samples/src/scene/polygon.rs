//! Splits faces of any number of corners into triangles that cover the face, also where it is concave.

use super::large_polygon;

/// Ears are sought up to this many corners; the search takes up to the cube of their number.
const MOST_EARS: usize = 100;

/// Division of a face into triangles.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Split {
    /// A fan around the first corner: the face is convex, or a line or point, for which any division does.
    Fan,
    /// Triangles as corner numbers, wound like the face.
    Triangles(Vec<[usize; 3]>),
    /// The face crosses itself, so that it has no inside. A fan is as good as anything.
    Crossed,
}

/// Divides the face with these corners, which may be concave. Ears of small faces are cut off, which is fast for them; large
/// ones take near linear time.
pub(super) fn split(corners: &[[f64; 3]]) -> Split {
    let Some(flat) = flatten(corners) else {
        // Its parts cancel each other out, or it has none.
        return if fan_has_area(corners) { Split::Crossed } else { Split::Fan };
    };
    if is_convex(&flat) {
        return Split::Fan;
    }
    let small = if flat.len() <= MOST_EARS { clip_ears(&flat) } else { None };
    match small.or_else(|| large_polygon::triangulate(&flat)) {
        Some(triangles) => Split::Triangles(triangles),
        None => Split::Crossed,
    }
}

/// The corners in the plane of the face (its Newell normal's two minor axes), counter-clockwise.
fn flatten(corners: &[[f64; 3]]) -> Option<Vec<[f64; 2]>> {
    let first = *corners.first()?;
    let local = |corner: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|i| corner[i] - first[i]) };
    let points: Vec<[f64; 3]> = corners.iter().map(local).collect();
    let mut normal = [0.0; 3];
    for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
        for (i, component) in normal.iter_mut().enumerate() {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            *component += a[j] * b[k] - a[k] * b[j];
        }
    }
    let main = (0..3).max_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs()))?;
    if normal[main] == 0.0 || !normal[main].is_finite() {
        return None;
    }
    let (u, v) = match normal[main] > 0.0 {
        true => ((main + 1) % 3, (main + 2) % 3),
        false => ((main + 2) % 3, (main + 1) % 3),
    };
    Some(points.iter().map(|point| [point[u], point[v]]).collect())
}

fn fan_has_area(corners: &[[f64; 3]]) -> bool {
    let corners: Vec<glam::DVec3> = corners.iter().map(|corner| glam::DVec3::from(*corner)).collect();
    let edge = |corner: usize| corners[corner] - corners[0];
    (2..corners.len()).any(|corner| edge(corner - 1).cross(edge(corner)) != glam::DVec3::ZERO)
}

fn is_convex(points: &[[f64; 2]]) -> bool {
    let count = points.len();
    let turn = |i: usize| turn(points[i], points[(i + 1) % count], points[(i + 2) % count]);
    (0..count).all(|i| turn(i) >= 0.0) && is_one_round(points)
}

/// True if the edges, which all turn to the left, turn by one full circle: a star turns by several.
fn is_one_round(points: &[[f64; 2]]) -> bool {
    let edges = points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| [b[0] - a[0], b[1] - a[1]]);
    let is_upward = |[x, y]: [f64; 2]| y > 0.0 || y == 0.0 && x > 0.0;
    let halves: Vec<bool> = edges.filter(|edge| *edge != [0.0; 2]).map(is_upward).collect();
    let changes = halves.iter().zip(halves.iter().cycle().skip(1)).filter(|(a, b)| a != b).count();
    changes <= 2
}

/// Twice the signed area of the triangle; positive when counter-clockwise. 0 within rounding.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let (left, right) = ((b[0] - a[0]) * (c[1] - a[1]), (b[1] - a[1]) * (c[0] - a[0]));
    let twice_area = left - right;
    if twice_area.abs() <= 1e-6 * (left.abs() + right.abs()) { 0.0 } else { twice_area }
}

fn clip_ears(points: &[[f64; 2]]) -> Option<Vec<[usize; 3]>> {
    let mut left: Vec<usize> = (0..points.len()).collect();
    let mut triangles = Vec::with_capacity(points.len().saturating_sub(2));
    let mut start = 0;
    while left.len() > 3 {
        let count = left.len();
        let candidates = || (0..count).map(|step| (start + step) % count);
        // A corner on a straight edge is cut off only when nothing else is left: it has no area.
        let ear = candidates().find(|&i| is_ear(points, &left, i)).or_else(|| {
            candidates().find(|&i| {
                let [a, b, c] = triangle(&left, i).map(|corner| points[corner]);
                turn(a, b, c) == 0.0
            })
        })?;
        triangles.push(triangle(&left, ear));
        left.remove(ear);
        start = ear;
    }
    // The signed areas sum up to that of the face: what is too much is taken away here.
    let is_simple = turn(points[left[0]], points[left[1]], points[left[2]]) >= 0.0;
    triangles.push([left[0], left[1], left[2]]);
    is_simple.then_some(triangles)
}

fn triangle(left: &[usize], i: usize) -> [usize; 3] {
    let count = left.len();
    [left[(i + count - 1) % count], left[i], left[(i + 1) % count]]
}

fn is_ear(points: &[[f64; 2]], left: &[usize], i: usize) -> bool {
    let [a, b, c] = triangle(left, i).map(|corner| points[corner]);
    turn(a, b, c) > 0.0
        && left.iter().map(|&corner| points[corner]).all(|p| {
            let outside = turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0;
            outside || p == a || p == b || p == c
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    const C: [[f64; 2]; 8] =
        [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [2.0, 1.0], [2.0, 2.0], [4.0, 2.0], [4.0, 3.0], [0.0, 3.0]];

    fn area(corners: &[[f64; 3]], triangles: &[[usize; 3]]) -> f64 {
        let area = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| glam::DVec3::from(corners[i]));
            0.5 * (b - a).cross(c - a).length()
        };
        triangles.iter().map(area).sum()
    }

    #[test]
    fn a_star_crosses_itself() {
        let point = |i: usize| {
            let angle = (i * 2 % 5) as f64 * std::f64::consts::TAU / 5.0;
            [angle.cos(), angle.sin(), 1.0]
        };
        assert_eq!(split(&std::array::from_fn::<_, 5, _>(point)), Split::Crossed);
        let regular = |count: usize| {
            let angles = (0..count).map(move |i| i as f64 * std::f64::consts::TAU / count as f64);
            angles.map(|angle| [angle.cos(), angle.sin(), 1.0]).collect::<Vec<_>>()
        };
        assert!((3..40).all(|count| split(&regular(count)) == Split::Fan));
    }

    #[test]
    fn a_c_shape_is_covered_once_whatever_its_first_corner_winding_and_plane() {
        for start in 0..8 {
            for turn in 0..6 {
                let mut corners: Vec<[f64; 3]> = C.iter().map(|&[x, y]| [x, y, 5.0]).collect();
                corners.rotate_left(start);
                corners.iter_mut().for_each(|corner| corner.rotate_left(turn % 3));
                if turn >= 3 {
                    corners.reverse();
                }
                let Split::Triangles(triangles) = split(&corners) else { panic!("not divided") };
                assert_eq!(triangles.len(), 6);
                assert!((area(&corners, &triangles) - 10.0).abs() < 1e-5, "start {start}, turn {turn}");
                let normal = |[a, b, c]: [usize; 3]| {
                    let [a, b, c] = [a, b, c].map(|i| glam::DVec3::from(corners[i]));
                    (b - a).cross(c - a)
                };
                assert!(triangles.iter().all(|&t| normal(t).dot(normal(triangles[0])) >= 0.0));
            }
        }
    }

    #[test]
    fn convex_and_flat_faces_are_fans_and_crossed_ones_are_known() {
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(split(&square), Split::Fan);
        assert_eq!(split(&[[1.0; 3]; 5]), Split::Fan);
        assert_eq!(split(&[]), Split::Fan);
        let crossed = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [1.0, -1.0, 0.0]];
        assert_eq!(split(&crossed), Split::Crossed);
        let bow_tie = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        assert_eq!(split(&bow_tie), Split::Crossed);
    }

    #[test]
    fn stars_of_any_size_are_covered_once() {
        for count in [8, MOST_EARS, MOST_EARS + 2, 1_000, 1_002, 50_000] {
            let corner = |i: usize| {
                let angle = i as f64 * std::f64::consts::TAU / count as f64;
                let radius = if i.is_multiple_of(2) { 1.0 } else { 0.5 };
                [3.0, radius * angle.cos(), radius * angle.sin()]
            };
            let corners: Vec<_> = (0..count).map(corner).collect();
            let Split::Triangles(triangles) = split(&corners) else { panic!("{count} corners") };
            assert_eq!(triangles.len(), count - 2);
            // As many kites with sides of 1 and 0.5 as half of the corners.
            let expected = 0.5 * count as f64 * 0.5 * (std::f64::consts::TAU / count as f64).sin();
            assert!((area(&corners, &triangles) / expected - 1.0).abs() < 1e-9, "{count} corners");
        }
    }
}
