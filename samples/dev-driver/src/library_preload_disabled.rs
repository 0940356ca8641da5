//! Takes the place of `library_preload` on platforms without `dlopen`, for which no libraries are downloaded.

use std::path::Path;

use crate::error::DriverError;

/// Opens nothing, because every list of downloaded libraries is empty.
pub(super) fn preload(_folder: &Path, _libraries: &[String]) -> Result<(), DriverError> {
    Ok(())
}
