//! Splits faces of any number of corners into triangles that cover the face, also where it is concave.

/// Ears are sought up to this many corners; the search takes up to the cube of their number.
const MOST_CORNERS: usize = 1_000;

/// Triangles, as corner numbers and wound like the face, of the face with these corners; always two fewer than
/// corners. `None` when a fan around the first corner is right (the face is convex) or as good as anything (it
/// has no plane, cuts itself or has more than 1,000 corners).
pub(super) fn split(corners: &[[f64; 3]]) -> Option<Vec<[usize; 3]>> {
    let flat = flatten(corners)?;
    if is_convex(&flat) || corners.len() > MOST_CORNERS {
        return None;
    }
    clip_ears(&flat)
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

fn is_convex(points: &[[f64; 2]]) -> bool {
    let count = points.len();
    let turn = |i: usize| turn(points[i], points[(i + 1) % count], points[(i + 2) % count]);
    (0..count).all(|i| turn(i) >= 0.0)
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
    triangles.push([left[0], left[1], left[2]]);
    Some(triangles)
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
    fn a_c_shape_is_covered_once_whatever_its_first_corner_winding_and_plane() {
        for start in 0..8 {
            for turn in 0..6 {
                let mut corners: Vec<[f64; 3]> = C.iter().map(|&[x, y]| [x, y, 5.0]).collect();
                corners.rotate_left(start);
                corners.iter_mut().for_each(|corner| corner.rotate_left(turn % 3));
                if turn >= 3 {
                    corners.reverse();
                }
                let triangles = split(&corners).unwrap();
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
    fn convex_flat_tangled_and_huge_faces_stay_fans() {
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(split(&square), None);
        assert_eq!(split(&[[1.0; 3]; 5]), None);
        assert_eq!(split(&[]), None);
        let star = |i: usize| {
            let angle = i as f64 * std::f64::consts::TAU / 50_000.0;
            let radius = if i.is_multiple_of(2) { 1.0 } else { 0.5 };
            [radius * angle.cos(), radius * angle.sin(), 0.0]
        };
        assert_eq!(split(&(0..50_000).map(star).collect::<Vec<_>>()), None);
        assert_eq!(split(&(0..1_000).map(|i| star(50 * i + i % 2)).collect::<Vec<_>>()).unwrap().len(), 998);
    }
}
