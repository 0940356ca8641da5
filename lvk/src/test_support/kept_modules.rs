//! Files of the modules that pipelines are lowered to, for `spirv-val`.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

/// Environment variable with the folder of the files.
const FOLDER: &str = "LVK_TEST_LOWERED_FOLDER";

/// Writes the words to a file of the folder that [`FOLDER`] names, if the variable is set. Equal modules share a file.
#[allow(clippy::expect_used, reason = "a test that cannot keep its modules has failed")]
pub(crate) fn write_module(words: &[u32]) {
    let Some(folder) = std::env::var_os(FOLDER).filter(|folder| !folder.is_empty()) else { return };
    let mut hasher = DefaultHasher::new();
    words.hash(&mut hasher);
    let path = Path::new(&folder).join(format!("{:016x}.spv", hasher.finish()));
    std::fs::write(path, bytemuck::cast_slice(words)).expect("the folder of lowered modules can be written");
}
