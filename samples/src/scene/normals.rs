//! Normals for corners that the file leaves without.

use std::collections::HashMap;

use glam::Vec3;

use super::mesh::Mesh;

/// Faces that meet at more than this angle, in degrees, keep a sharp edge between them.
const CREASE_DEGREES: f32 = 50.0;

/// Faces around one position that share a normal.
struct Cluster {
    leader: Vec3,
    sum: Vec3,
}

/// Gives every corner whose normal is zero the mean of the faces around its position, weighted by their angle
/// there, and gives all normals unit length. Faces that meet at a sharp angle are kept apart, for which vertices
/// are doubled. Vertices that share a position count as one, however the file splits them. Returns how many
/// corners were without.
pub(super) fn complete(mesh: &mut Mesh) -> usize {
    for normal in &mut mesh.normals {
        *normal = Vec3::from(*normal).normalize_or_zero().to_array();
    }
    let missing: Vec<(usize, usize)> = (0..mesh.triangles.len())
        .flat_map(|triangle| (0..3).map(move |corner| (triangle, corner)))
        .filter(|&(triangle, corner)| mesh.normals[mesh.triangles[triangle][corner] as usize] == [0.0; 3])
        .collect();
    let mut clusters = Vec::new();
    let chosen = cluster_corners(mesh, &missing, &mut clusters);
    split_vertices(mesh, &missing, &chosen, &clusters);
    missing.len()
}

/// The cluster of each of the `corners`, in order.
fn cluster_corners(mesh: &Mesh, corners: &[(usize, usize)], clusters: &mut Vec<Cluster>) -> Vec<usize> {
    let crease = CREASE_DEGREES.to_radians().cos();
    let mut at_position: HashMap<[u32; 3], Vec<usize>> = HashMap::new();
    corners
        .iter()
        .map(|&(triangle, corner)| {
            let (face, angle) = mesh.face_normal_and_angle(triangle, corner);
            let position = mesh.positions[mesh.triangles[triangle][corner] as usize];
            // Adding zero turns -0 into 0, which is the same place.
            let near = at_position.entry(position.map(|x| (x + 0.0).to_bits())).or_default();
            let found = near.iter().copied().find(|&i| clusters[i].leader.dot(face) >= crease);
            let cluster = found.unwrap_or_else(|| {
                near.push(clusters.len());
                clusters.push(Cluster { leader: face, sum: Vec3::ZERO });
                clusters.len() - 1
            });
            clusters[cluster].sum += face * angle;
            cluster
        })
        .collect()
}

/// Writes the normals of the clusters, doubling vertices that two clusters share.
fn split_vertices(mesh: &mut Mesh, corners: &[(usize, usize)], chosen: &[usize], clusters: &[Cluster]) {
    let mut vertex_of: HashMap<(u32, usize), u32> = HashMap::new();
    for (&(triangle, corner), &cluster) in corners.iter().zip(chosen) {
        let vertex = mesh.triangles[triangle][corner];
        let normal = clusters[cluster].sum.try_normalize().unwrap_or(clusters[cluster].leader);
        let split = *vertex_of.entry((vertex, cluster)).or_insert_with(|| {
            if mesh.normals[vertex as usize] == [0.0; 3] {
                mesh.normals[vertex as usize] = normal.to_array();
                return vertex;
            }
            mesh.double_vertex(vertex, normal.to_array())
        });
        mesh.triangles[triangle][corner] = split;
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
