//! Disk cache of trees that the CPU built. The numbers of its files are little-endian, as those of the BLAS in memory.

use std::path::{Path, PathBuf};

use super::bvh::encode_blas::BlasBlob;
use super::bvh::primitives::{Mesh, MeshPrimitives};
use super::bvh::settings::BvhSettings;
use super::expected_mesh::ExpectedMesh;
use super::validate_blob;
use crate::cache_file::fingerprint;
use crate::error::readable::readable_name;
use crate::regular_file;
use crate::temporary_file::{remove_replacements, replace_file};

const MAGIC: [u8; 8] = *b"\x89lvktree";
const EXTENSION: &str = ".tree";
/// Version of the builders and of the BLAS format.
const VERSION: u32 = 6;
/// Bytes of the header: magic, version, a reserved word, and length and checksum of the BLAS.
const HEADER_BYTES: usize = 32;

/// A folder of built trees. Each file is named after the fingerprint of its build's inputs.
pub(crate) struct BvhCache {
    folder: PathBuf,
}

/// Fingerprint of the inputs of a build: the primitives and the settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BvhKey([u64; 2]);

impl BvhKey {
    pub(crate) fn from_mesh(mesh: &Mesh, quality: BvhSettings) -> Self {
        let bytes: &[u8] = match &mesh.primitives {
            MeshPrimitives::Triangles(all) => bytemuck::cast_slice(all),
            MeshPrimitives::Boxes(all) => bytemuck::cast_slice(all),
        };
        let boxes = matches!(mesh.primitives, MeshPrimitives::Boxes(_));
        let bits = [boxes, quality.low_memory, quality.keeps_given_vertices()];
        let settings = bits.iter().fold(u64::from(VERSION), |all, bit| all << 1 | u64::from(*bit));
        let flags: Vec<u32> = mesh.flags.iter().map(|flags| flags.bits()).collect();
        let vertices = bytemuck::cast_slice(&mesh.vertices);
        Self([1, 2].map(|seed| {
            let seed = fingerprint(&settings.to_le_bytes(), seed);
            let seed = fingerprint(bytemuck::cast_slice(&flags), seed);
            fingerprint(vertices, fingerprint(bytes, seed))
        }))
    }
}

impl BvhCache {
    /// Creates a cache in `folder`, which need not exist.
    pub(crate) fn new(folder: &Path) -> Self {
        remove_replacements(folder, |cache| cache.ends_with(EXTENSION));
        Self { folder: folder.to_owned() }
    }

    /// Returns the tree of an earlier run if it matches `expected`. Otherwise builds and stores it. A file error is
    /// logged, not returned.
    pub(crate) fn get_or_build(
        &self,
        key: BvhKey,
        expected: &ExpectedMesh,
        build: impl FnOnce() -> BlasBlob,
    ) -> BlasBlob {
        let path = self.folder.join(format!("{:016x}{:016x}{EXTENSION}", key.0[0], key.0[1]));
        match regular_file::read(&path, HEADER_BYTES as u64 + expected.max_blob_bytes()) {
            Ok(file) => match decode_file(&file, expected) {
                Ok(blob) => return blob,
                Err(reason) => log::warn!("the tree '{}' is dropped: {reason}", readable_name(&path)),
            },
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => log::warn!("the tree '{}' cannot be read: {error}", readable_name(&path)),
        }
        let blob = build();
        let kept = std::fs::create_dir_all(&self.folder)
            .and_then(|()| replace_file(&path, &encode_file(&blob.bytes)));
        if let Err(error) = kept {
            log::warn!("the tree '{}' cannot be kept: {error}", readable_name(&path));
        }
        blob
    }
}

/// Returns the file of a tree with these bytes.
pub(crate) fn encode_file(blob: &[u8]) -> Vec<u8> {
    let mut file = Vec::with_capacity(HEADER_BYTES + blob.len());
    file.extend(MAGIC);
    file.extend(VERSION.to_le_bytes());
    file.extend([0; 4]);
    file.extend((blob.len() as u64).to_le_bytes());
    file.extend(fingerprint(blob, 0).to_le_bytes());
    file.extend(blob);
    file
}

/// Returns the tree of a file, if it can be a tree of `expected`.
pub(crate) fn decode_file(file: &[u8], expected: &ExpectedMesh) -> Result<BlasBlob, &'static str> {
    let (header, bytes) = file.split_at_checked(HEADER_BYTES).ok_or("it is cut off")?;
    if header[..8] != MAGIC || header[8..12] != VERSION.to_le_bytes() {
        return Err("another version of the library wrote it");
    }
    let whole = header[16..24] == (bytes.len() as u64).to_le_bytes();
    if !whole || header[24..] != fingerprint(bytes, 0).to_le_bytes() {
        return Err("it is damaged or cut off");
    }
    let validated = validate_blob::validate_blob(bytes, expected)?;
    Ok(BlasBlob { bytes: bytes.to_vec(), bounds: validated.bounds })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::accel::geometry::GeometryFlags;
    use crate::software_ray_query::bvh::encode_blas;
    use crate::software_ray_query::layout::LeafBox;

    const QUALITY: BvhSettings = BvhSettings { low_memory: false, refit: false };

    fn mesh(count: u32) -> Mesh {
        let place = |primitive: u32| {
            let low = Vec3::splat(primitive as f32);
            LeafBox { low, primitive, high: low + Vec3::ONE, geometry: 0 }
        };
        Mesh {
            primitives: MeshPrimitives::Boxes((0..count).map(place).collect()),
            vertices: Vec::new(),
            flags: vec![GeometryFlags::empty()],
        }
    }

    #[test]
    fn a_file_is_read_from_bytes_of_any_alignment() {
        let mesh = mesh(50);
        let built = encode_blas::encode_blas(&mesh, QUALITY);
        let file = encode_file(&built.bytes);
        for offset in 0..16 {
            let shifted = [&vec![0; offset][..], &file].concat();
            assert_eq!(decode_file(&shifted[offset..], &ExpectedMesh::from_mesh(&mesh)), Ok(built.clone()));
        }
    }

    #[test]
    fn a_tree_is_built_once_and_again_where_its_file_is_damaged() {
        let folder = std::env::temp_dir().join(format!("lvk-trees-{}", std::process::id()));
        let cache = BvhCache::new(&folder);
        let (mesh, key) = (mesh(50), BvhKey::from_mesh(&mesh(50), QUALITY));
        let built = encode_blas::encode_blas(&mesh, QUALITY);
        let mut builds = 0;
        let expected = ExpectedMesh::from_mesh(&mesh);
        let mut get = || {
            cache.get_or_build(key, &expected, || {
                builds += 1;
                built.clone()
            })
        };
        assert_eq!((get(), get()), (built.clone(), built.clone()));
        let path = std::fs::read_dir(&folder).unwrap().next().unwrap().unwrap().path();
        let mut file = std::fs::read(&path).unwrap();
        let last = file.len() - 1;
        file[last] ^= 1;
        std::fs::write(&path, file).unwrap();
        assert_eq!(get(), built);
        assert_eq!(get(), built);
        // Sealed as if the library had written them: nothing, and a node that is its own child.
        let mut circle = built.clone();
        let node = circle.header().nodes as usize * 16;
        circle.bytes[node + 15] = 1;
        circle.bytes[node + 16..node + 20].copy_from_slice(&[0; 4]);
        for nonsense in [&[][..], &circle.bytes] {
            std::fs::write(&path, encode_file(nonsense)).unwrap();
            assert_eq!(get(), built);
            assert_eq!(get(), built);
        }
        assert_eq!(builds, 4, "once, and once more after each damage");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn other_contents_and_settings_have_other_keys() {
        let small = BvhSettings { low_memory: true, ..QUALITY };
        let moving = BvhSettings { refit: true, ..small };
        let naming = |vertices| Mesh { vertices, ..mesh(5) };
        let keys = [
            BvhKey::from_mesh(&mesh(5), QUALITY),
            BvhKey::from_mesh(&mesh(6), QUALITY),
            BvhKey::from_mesh(&mesh(5), small),
            BvhKey::from_mesh(&mesh(5), moving),
            BvhKey::from_mesh(&naming(vec![[0, 1, 2]; 5]), moving),
            BvhKey::from_mesh(&naming(vec![[0, 2, 1]; 5]), moving),
        ];
        for (number, key) in keys.iter().enumerate() {
            assert!(!keys[..number].contains(key), "key {number}");
        }
    }
}
