//! Files beside the file of a controller that the controller needs, such as a script or a network. They are inputs of a
//! result.

use standfast_core::error::{Error, Result};
use standfast_files::assets::{Source, parse_toml};
use std::path::{Component, Path, PathBuf};

/// Largest size of a file that a controller needs (bytes).
pub const MOST_FILE_BYTES: u64 = 200_000_000;

/// Fails if a controller's file states the key `file`, in which its own path is kept; `accepted` names other keys.
pub fn refuse_file(source: &Source, accepted: &str) -> Result<()> {
    let stated: toml::Table = parse_toml(source)?;
    match stated.get("file") {
        Some(value) => Err(Error::value(
            &source.file,
            "file",
            value,
            "is no key of such a file",
            accepted,
        )),
        None => Ok(()),
    }
}

/// The folder of the controller's `file`.
pub fn folder(file: &str) -> PathBuf {
    let folder = Path::new(file)
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new(".")).into()
}

/// Whether a path leads to somewhere within the folder.
pub fn is_inside(name: &str) -> bool {
    Path::new(name)
        .components()
        .all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

/// Reads a file of the same folder, which `field` names.
pub fn read(file: &str, field: &str, name: &str) -> Result<(String, Vec<u8>)> {
    if !is_inside(name) {
        return Err(Error::value(
            file,
            field,
            name,
            "is not in the folder of this file",
            "a path within this folder",
        ));
    }
    Ok((
        name.into(),
        standfast_files::assets::read(&folder(file).join(name), MOST_FILE_BYTES)?,
    ))
}
