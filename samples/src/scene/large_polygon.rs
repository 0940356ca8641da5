//! Splits polygons of any number of corners into triangles, in near linear time.

use std::collections::HashMap;

use spade::handles::{DirectedEdgeHandle, FaceHandle, InnerTag};
use spade::{CdtEdge, ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A place of the polygon and the first of its corners there.
struct Place {
    position: Point2<f64>,
    corner: usize,
}

impl HasPosition for Place {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.position
    }
}

type Cdt = ConstrainedDelaunayTriangulation<Place>;

type InnerFace<'a> = FaceHandle<'a, InnerTag, Place, (), CdtEdge<()>, ()>;

/// Edges of the polygon between places, the lower place first, and how often the polygon runs along each.
type EdgeCounts = HashMap<[usize; 2], u32>;

/// Triangles, as corner numbers and counter-clockwise, of the polygon: those of its constrained Delaunay triangulation with an
/// odd number of edges around them. Edges that the polygon runs along twice, as around a hole, do not count. `None` if edges
/// cross or overlap in part.
pub(super) fn triangulate(points: &[[f64; 2]]) -> Option<Vec<[usize; 3]>> {
    let (places, edges) = places_and_edges(points);
    let constraints: Vec<[usize; 2]> = edges.keys().copied().collect();
    let mut is_crossed = false;
    let mut sorted = constraints;
    sorted.sort_unstable();
    let cdt = Cdt::try_bulk_load_cdt(places, sorted, |_| is_crossed = true).ok()?;
    if is_crossed { None } else { inside(&cdt, &edges) }
}

fn places_and_edges(points: &[[f64; 2]]) -> (Vec<Place>, EdgeCounts) {
    let mut places = Vec::with_capacity(points.len());
    let mut numbers: HashMap<[u64; 2], usize> = HashMap::with_capacity(points.len());
    let mut number_of = |corner: usize| {
        // Adding zero turns -0 into 0, which is the same place.
        let [x, y] = points[corner].map(|value| value + 0.0);
        *numbers.entry([x.to_bits(), y.to_bits()]).or_insert_with(|| {
            places.push(Place { position: Point2::new(x, y), corner });
            places.len() - 1
        })
    };
    let corners: Vec<usize> = (0..points.len()).map(&mut number_of).collect();
    let mut edges = EdgeCounts::with_capacity(points.len());
    for (&a, &b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        if a != b {
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    (places, edges)
}

/// The triangles inside of the polygon, found by crossing edges from outside. `None` if an edge of the triangulation is part of
/// a longer one of the polygon.
fn inside(cdt: &Cdt, edges: &EdgeCounts) -> Option<Vec<[usize; 3]>> {
    let mut is_inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let mut waiting: Vec<(InnerFace<'_>, bool)> = Vec::new();
    for edge in cdt.convex_hull().map(|edge| edge.rev()) {
        let crosses = crosses(edge, edges)?;
        waiting.extend(edge.face().as_inner().map(|face| (face, crosses)));
    }
    let mut triangles = Vec::new();
    while let Some((face, side)) = waiting.pop() {
        if is_inside[face.fix().index()].replace(side).is_some() {
            continue;
        }
        if side {
            triangles.push(face.vertices().map(|vertex| vertex.data().corner));
        }
        for edge in face.adjacent_edges() {
            let crosses = crosses(edge, edges)?;
            waiting.extend(edge.rev().face().as_inner().map(|next| (next, side != crosses)));
        }
    }
    Some(triangles)
}

/// True if the polygon runs an odd number of times along the edge.
fn crosses(edge: DirectedEdgeHandle<'_, Place, (), CdtEdge<()>, ()>, edges: &EdgeCounts) -> Option<bool> {
    if !edge.is_constraint_edge() {
        return Some(false);
    }
    let [a, b] = [edge.from().fix().index(), edge.to().fix().index()];
    edges.get(&[a.min(b), a.max(b)]).map(|count| count % 2 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn area(points: &[[f64; 2]], triangles: &[[usize; 3]]) -> f64 {
        let twice = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| glam::DVec2::from(points[i]));
            (b - a).perp_dot(c - a)
        };
        assert!(triangles.iter().all(|triangle| twice(triangle) > 0.0), "counter-clockwise");
        triangles.iter().map(twice).sum::<f64>() / 2.0
    }

    /// Twice the area by the shoelace formula.
    fn shoelace(points: &[[f64; 2]]) -> f64 {
        points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
    }

    /// A star whose even corners stick out.
    fn star(count: usize) -> Vec<[f64; 2]> {
        let corner = |i: usize| {
            let angle = i as f64 * TAU / count as f64;
            let radius = if i.is_multiple_of(2) { 1.0 } else { 0.5 };
            [radius * angle.cos(), radius * angle.sin()]
        };
        (0..count).map(corner).collect()
    }

    /// A comb whose teeth reach almost to its back.
    fn comb(teeth: usize) -> Vec<[f64; 2]> {
        let tooth = |i: usize| {
            let x = 2.0 * i as f64;
            [[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 99.0], [x + 2.0, 99.0]]
        };
        let mut points: Vec<[f64; 2]> = (0..teeth).flat_map(tooth).collect();
        points.extend([[2.0 * teeth as f64, 100.0], [0.0, 100.0]]);
        points
    }

    /// A band that winds inwards.
    fn spiral(count: usize) -> Vec<[f64; 2]> {
        let turns = 30.0;
        let corner = |i: usize, width: f64| {
            let share = i as f64 / count as f64;
            let (sin, cos) = (turns * TAU * share).sin_cos();
            let radius = 1.0 + 30.0 * share + width;
            [radius * cos, radius * sin]
        };
        let outer = (0..count).map(|i| corner(i, 0.5));
        let inner = (0..count).rev().map(|i| corner(i, 0.0));
        outer.chain(inner).collect()
    }

    #[test]
    fn polygons_of_100_000_corners_are_covered_once() {
        for (name, points) in [("star", star(100_000)), ("comb", comb(25_000)), ("spiral", spiral(50_000))] {
            let triangles = triangulate(&points).unwrap();
            assert_eq!(triangles.len(), points.len() - 2, "{name}");
            let expected = 0.5 * shoelace(&points);
            assert!((area(&points, &triangles) / expected - 1.0).abs() < 1e-9, "{name}");
        }
    }

    /// A square with a hole, joined by an edge that the polygon runs along in both directions.
    #[test]
    fn holes_stay_open() {
        let points = [
            [0.0, 0.0],
            [6.0, 0.0],
            [6.0, 6.0],
            [0.0, 6.0],
            [0.0, 0.0],
            [2.0, 2.0],
            [2.0, 4.0],
            [4.0, 4.0],
            [4.0, 2.0],
            [2.0, 2.0],
        ];
        let triangles = triangulate(&points).unwrap();
        assert_eq!((triangles.len(), area(&points, &triangles)), (8, 32.0));
    }

    #[test]
    fn corners_on_straight_edges_are_kept() {
        let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 3.0], [1.5, 1.0], [0.0, 3.0]];
        let triangles = triangulate(&points).unwrap();
        assert_eq!(triangles.len(), 5);
        assert!(
            (0..7).all(|corner| triangles.iter().flatten().any(|found| *found == corner)),
            "{triangles:?}"
        );
    }

    #[test]
    fn crossing_and_overlapping_edges_are_refused() {
        assert_eq!(triangulate(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]), None);
        let overlapping = [[0.0, 0.0], [4.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0]];
        assert_eq!(triangulate(&overlapping), None);
        assert_eq!(triangulate(&[[0.0; 2]; 200]).unwrap_or_default(), Vec::<[usize; 3]>::new());
        assert_eq!(triangulate(&[]).unwrap_or_default(), Vec::<[usize; 3]>::new());
        assert_eq!(triangulate(&[[f64::NAN; 2], [0.0; 2], [1.0; 2]]), None);
    }
}
