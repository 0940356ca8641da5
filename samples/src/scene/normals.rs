//! Normals for corners that the file leaves without.

use std::collections::HashMap;

use glam::Vec3;

use super::key_numbers::KeyNumbers;
use super::mesh::Mesh;

/// Faces that meet at more than this angle, in degrees, keep a sharp edge between them.
const CREASE_DEGREES: f32 = 50.0;

/// Stands for no number.
const NONE: u32 = u32::MAX;

/// Faces around one position that share a normal.
struct Cluster {
    leader: Vec3,
    sum: Vec3,
    /// The next cluster at the position, or [`NONE`].
    next: u32,
}

/// Gives every corner whose normal is zero the mean of the faces around its position, weighted by their angle
/// there, and gives all normals unit length. Faces that meet at a sharp angle are kept apart, for which vertices
/// are doubled. Vertices that share a position count as one, however the file splits them. Returns how many
/// corners were without.
pub(super) fn complete(mesh: &mut Mesh) -> usize {
    for normal in &mut mesh.normals {
        *normal = Vec3::from(*normal).normalize_or_zero().to_array();
    }
    let missing: Vec<bool> = mesh.normals.iter().map(|normal| *normal == [0.0; 3]).collect();
    let count = mesh.triangles.iter().flatten().filter(|vertex| missing[**vertex as usize]).count();
    if count > 0 {
        // Most vertices have one.
        let mut clusters = Vec::with_capacity(missing.iter().filter(|is_missing| **is_missing).count());
        let chosen = cluster_corners(mesh, &missing, count, &mut clusters);
        split_vertices(mesh, &missing, &chosen, &clusters);
    }
    count
}

/// The cluster of each of the `count` corners without a normal, in order.
fn cluster_corners(mesh: &Mesh, missing: &[bool], count: usize, clusters: &mut Vec<Cluster>) -> Vec<u32> {
    let mut places = Places::new(mesh);
    let mut chosen = Vec::with_capacity(count);
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        for (corner, &vertex) in vertices.iter().enumerate().filter(|(_, vertex)| missing[**vertex as usize])
        {
            let (face, angle) = mesh.face_normal_and_angle(triangle, corner);
            let cluster = find_or_add(clusters, places.first_cluster(vertex), face);
            clusters[cluster as usize].sum += face * angle;
            chosen.push(cluster);
        }
    }
    chosen
}

/// The first cluster of the list from `first` on that takes the face, or a new one at its end.
fn find_or_add(clusters: &mut Vec<Cluster>, first: &mut u32, face: Vec3) -> u32 {
    let crease = CREASE_DEGREES.to_radians().cos();
    let (mut last, mut cluster) = (NONE, *first);
    while cluster != NONE {
        let Cluster { leader, next, .. } = clusters[cluster as usize];
        if leader.dot(face) >= crease {
            return cluster;
        }
        (last, cluster) = (cluster, next);
    }
    let new = clusters.len() as u32;
    match clusters.get_mut(last as usize) {
        Some(last) => last.next = new,
        None => *first = new,
    }
    clusters.push(Cluster { leader: face, sum: Vec3::ZERO, next: NONE });
    new
}

/// The first cluster of each position, whichever vertices have it.
struct Places<'a> {
    mesh: &'a Mesh,
    numbers: KeyNumbers,
    /// A vertex of each place.
    vertices: Vec<u32>,
    first_clusters: Vec<u32>,
    /// The place of each vertex that was asked for, or [`NONE`].
    of_vertices: Vec<u32>,
}

impl<'a> Places<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let count = mesh.positions.len();
        Self {
            mesh,
            numbers: KeyNumbers::with_capacity(count),
            vertices: Vec::with_capacity(count),
            first_clusters: Vec::with_capacity(count),
            of_vertices: vec![NONE; count],
        }
    }

    fn first_cluster(&mut self, vertex: u32) -> &mut u32 {
        let Self { mesh, numbers, vertices, first_clusters, of_vertices } = self;
        let place = &mut of_vertices[vertex as usize];
        if *place == NONE {
            // Adding zero turns -0 into 0, which is the same place.
            let bits = |vertex: u32| mesh.positions[vertex as usize].map(|x| (x + 0.0).to_bits());
            let (number, is_new) = numbers.number_of(&bits(vertex), |place| bits(vertices[place as usize]));
            if is_new {
                vertices.push(vertex);
                first_clusters.push(NONE);
            }
            *place = number;
        }
        &mut first_clusters[*place as usize]
    }
}

/// Writes the normals of the clusters, doubling vertices that two clusters share.
fn split_vertices(mesh: &mut Mesh, missing: &[bool], chosen: &[u32], clusters: &[Cluster]) {
    // The cluster that has the vertex itself; others have doubles.
    let mut owners = vec![NONE; missing.len()];
    let mut doubles: HashMap<(u32, u32), u32> = HashMap::new();
    let mut chosen = chosen.iter();
    for triangle in 0..mesh.triangles.len() {
        for corner in 0..3 {
            let vertex = mesh.triangles[triangle][corner];
            if !missing[vertex as usize] {
                continue;
            }
            let Some(&cluster) = chosen.next() else { return };
            let Cluster { leader, sum, .. } = clusters[cluster as usize];
            let normal = sum.try_normalize().unwrap_or(leader).to_array();
            let owner = &mut owners[vertex as usize];
            if *owner == NONE {
                *owner = cluster;
                mesh.normals[vertex as usize] = normal;
            } else if *owner != cluster {
                let double = || mesh.double_vertex(vertex, normal);
                let double = *doubles.entry((vertex, cluster)).or_insert_with(double);
                mesh.triangles[triangle][corner] = double;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles over shared positions, without normals.
    fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        let mut mesh = Mesh::default();
        for &position in positions {
            mesh.add_vertex(position, [0.0; 3], [0.0; 2]);
        }
        for &triangle in triangles {
            mesh.add_triangle(triangle, 0);
        }
        mesh
    }

    const CUBE: [[f32; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];
    const CUBE_FACES: [[u32; 3]; 12] = [
        [0, 2, 1],
        [0, 3, 2],
        [4, 5, 6],
        [4, 6, 7],
        [0, 1, 5],
        [0, 5, 4],
        [3, 7, 6],
        [3, 6, 2],
        [0, 4, 7],
        [0, 7, 3],
        [1, 2, 6],
        [1, 6, 5],
    ];

    #[test]
    fn a_cube_keeps_its_edges() {
        let mut cube = mesh(&CUBE, &CUBE_FACES);
        assert_eq!(complete(&mut cube), 36);
        assert_eq!(cube.positions.len(), 24, "three normals at each of eight corners");
        for (i, triangle) in cube.triangles.iter().enumerate() {
            let (face, _) = cube.face_normal_and_angle(i, 0);
            for &vertex in triangle {
                assert_eq!(Vec3::from(cube.normals[vertex as usize]), face);
            }
        }
    }

    #[test]
    fn a_gentle_bend_is_smooth_even_between_split_vertices() {
        let positions = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [-1.0, -0.2, 0.0], [1.0, -0.2, 0.0]];
        let doubled = [positions[0], positions[1], positions[2], positions[0], positions[1], positions[3]];
        let mut fold = mesh(&doubled, &[[0, 2, 1], [3, 4, 5]]);
        complete(&mut fold);
        for vertex in [0, 1, 3, 4] {
            assert!((fold.normals[vertex][1] - 1.0).abs() < 1e-5, "{:?}", fold.normals[vertex]);
        }
    }

    #[test]
    fn doubled_vertices_keep_their_colors() {
        let mut cube = mesh(&CUBE, &CUBE_FACES);
        cube.colors = CUBE.to_vec();
        complete(&mut cube);
        assert_eq!((cube.colors.len(), &cube.colors), (24, &cube.positions));
    }

    #[test]
    fn normals_of_the_file_are_kept() {
        let mut cube = mesh(&CUBE, &CUBE_FACES);
        cube.normals.fill([0.0, 2.0, 0.0]);
        assert_eq!(complete(&mut cube), 0);
        assert!(cube.normals.iter().all(|&n| n == [0.0, 1.0, 0.0]));
    }
}
