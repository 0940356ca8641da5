//! Built bottom-level structures, kept in a folder from one start to the next.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::io;
use std::path::{Path, PathBuf};

use lvk::temporary_file::{remove_replacements, replace_file};
use lvk::{BuildFlags, Capabilities, readable_name};

use super::world::{Piece, World};
use crate::app::input_file::{self, FileKind};

/// Extension of the files.
const EXTENSION: &str = ".blas";

/// A folder of built structures, each in a file named after what it was built from.
pub(super) struct StructureCache {
    folder: PathBuf,
}

/// The key of a cached acceleration structure: the triangles of a piece, the device and its limits, and the flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct StructureKey(u64);

impl StructureKey {
    pub(super) fn from_piece(
        world: &World,
        piece: &Piece,
        capabilities: &Capabilities,
        flags: BuildFlags,
    ) -> Self {
        let mut hasher = DefaultHasher::new();
        let Capabilities { device_name, driver_name, driver_info, profile, limits, .. } = capabilities;
        (device_name, driver_name, driver_info, profile).hash(&mut hasher);
        (capabilities.ray_tracing_pipeline, format!("{:?}", capabilities.ray_query_path)).hash(&mut hasher);
        let bounds =
            [limits.max_accel_scratch_bytes, limits.max_accel_structure_bytes, limits.max_blas_primitives];
        (bounds, flags.bits(), piece.vertices.end).hash(&mut hasher);
        let range = |range: &std::ops::Range<u32>| range.start as usize..range.end as usize;
        hasher.write(bytemuck::cast_slice(&world.scene.positions[range(&piece.vertices)]));
        hasher.write(bytemuck::cast_slice(&world.scene.triangles[range(&piece.triangles)]));
        Self(hasher.finish())
    }
}

impl StructureCache {
    /// Creates a cache in a folder, which need not exist. Temporary files that killed processes left there more than an hour ago
    /// are removed.
    pub(super) fn new(folder: &Path) -> Self {
        remove_replacements(folder, |name| name.ends_with(EXTENSION));
        Self { folder: folder.to_owned() }
    }

    /// Path of the cached structure.
    pub(super) fn path(&self, StructureKey(key): StructureKey) -> PathBuf {
        self.folder.join(format!("{key:016x}{EXTENSION}"))
    }

    /// The bytes of an earlier start, if there are any. A file that cannot be read is warned of.
    pub(super) fn read(&self, key: StructureKey) -> Option<Vec<u8>> {
        let path = self.path(key);
        match input_file::read(&path, FileKind::Structure) {
            Ok(bytes) => Some(bytes),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => {
                log::warn!("the structure '{}' cannot be read: {error}", readable_name(&path));
                None
            }
        }
    }

    /// Keeps the bytes for the next start, or warns.
    pub(super) fn store(&self, key: StructureKey, bytes: &[u8]) {
        let path = self.path(key);
        if let Err(error) = std::fs::create_dir_all(&self.folder).and_then(|()| replace_file(&path, bytes)) {
            log::warn!("the structure '{}' cannot be kept: {error}", readable_name(&path));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::*;
    use crate::app::progress::Progress;

    #[test]
    fn other_triangles_devices_and_flags_have_other_keys() {
        let world = World::valley(2_000, 3, &mut Progress::hidden()).unwrap();
        let (first, second) = (&world.pieces[0], &world.pieces[1]);
        let caps = Capabilities::default();
        let phone = Capabilities { profile: Some("mali-g715".to_owned()), ..Capabilities::default() };
        let flags = BuildFlags::FAST_TRACE;
        let key = |piece, caps: &Capabilities, flags| StructureKey::from_piece(&world, piece, caps, flags);
        let all = [
            key(first, &caps, flags),
            key(second, &caps, flags),
            key(first, &phone, flags),
            key(first, &caps, flags | BuildFlags::ALLOW_COMPACTION),
        ];
        for (index, key) in all.iter().enumerate() {
            assert!(!all[..index].contains(key), "{index}");
        }
        assert_eq!(
            all[0],
            StructureKey::from_piece(
                &World::valley(2_000, 9, &mut Progress::hidden()).unwrap(),
                first,
                &caps,
                flags
            ),
            "the same ground"
        );
    }

    #[test]
    fn stored_files_are_read_and_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let cache = StructureCache::new(&folder.path().join("made"));
        let key = StructureKey(7);
        assert_eq!(cache.read(key), None);
        for bytes in [&b"first"[..], b"second"] {
            cache.store(key, bytes);
            assert_eq!(cache.read(key).as_deref(), Some(bytes));
        }
        assert_eq!(std::fs::read_dir(folder.path().join("made")).unwrap().count(), 1);
    }

    #[test]
    fn only_old_leftovers_of_killed_processes_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let create = |name: &str, seconds: u64| {
            let file = std::fs::File::create(folder.path().join(name)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(seconds)).unwrap();
        };
        create("0000000000000007.blas.12-3.tmp", 9000);
        create("0000000000000007.blas.12-4.tmp", 60);
        create("mine.tmp", 9000);
        let _cache = StructureCache::new(folder.path());
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["0000000000000007.blas.12-4.tmp", "mine.tmp"]);
    }
}
