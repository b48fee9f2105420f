//! The packed results that are compiled in: what public policies survived.

use standfast_core::error::{Error, Result};
use standfast_files::assets::BASELINES;
use std::fs::{create_dir_all, write};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Names of the results.
pub fn names() -> impl Iterator<Item = &'static str> {
    BASELINES.iter().map(|baseline| baseline.name)
}

/// Writes the result of this name to a temporary folder. Returns that folder and, in it, the path of the result. None if
/// no result has this name.
pub(super) fn unpacked(name: &Path) -> Result<Option<(TempDir, PathBuf)>> {
    let Some(baseline) = BASELINES
        .iter()
        .find(|baseline| name.as_os_str() == baseline.name)
    else {
        return Ok(None);
    };
    let written = || {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join(baseline.name);
        create_dir_all(path.join("parts"))?;
        for (file, bytes) in baseline.files {
            write(path.join(file), bytes)?;
        }
        Ok((folder, path))
    };
    written().map(Some).map_err(|source| Error::Write {
        path: std::env::temp_dir(),
        source,
    })
}
