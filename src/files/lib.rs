//! Files: inputs that are compiled in or named by a path ([`assets`]), outputs of which neither a reader nor a crash ever
//! finds half ([`AtomicFile`]), and tables in columns ([`columns`]).

#![forbid(unsafe_code)]

pub mod assets;
pub mod columns;

pub use assets::shell_word;
use serde::Serialize;
use sha2::{Digest, Sha256};
use standfast_core::error::{Error, Result};
use std::ffi::OsStr;
use std::hash::{DefaultHasher, Hasher};
use std::{fs, io, io::Write, path::Path, path::PathBuf, sync::OnceLock};

/// Beginning of the name of a file while it is being written.
const TEMPORARY: &str = ".tmp-";

/// Writes `bytes` to `path` as an [`AtomicFile`].
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(bytes).map_err(|source| Error::Write {
        path: path.into(),
        source,
    })?;
    file.commit()
}

/// A file that appears at its path as a whole when it is committed. Until then it is a unique temporary file in the
/// same folder, which is removed when this is dropped. If two writers race, the result is one of both files.
pub struct AtomicFile {
    path: PathBuf,
    temporary: tempfile::NamedTempFile,
}

impl AtomicFile {
    /// Creates the temporary file, and its folder if needed.
    pub fn create(path: &Path) -> Result<Self> {
        let folder = folder_of(path);
        let fail = |source| Error::Write {
            path: path.into(),
            source,
        };
        if is_no_file(path) {
            return Err(fail(io::Error::other(
                "it is no file, but a folder, pipe or device",
            )));
        }
        fs::create_dir_all(folder).map_err(fail)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(TEMPORARY);
        // Temporary files are private to their owner, but a result must be as readable as any other file of the caller.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        Ok(Self {
            path: path.into(),
            temporary: builder.tempfile_in(folder).map_err(fail)?,
        })
    }

    /// Syncs the file, renames it, and syncs the folder.
    pub fn commit(self) -> Result<()> {
        let Self { path, temporary } = self;
        let fail = |source| Error::Write {
            path: path.clone(),
            source,
        };
        temporary.as_file().sync_all().map_err(fail)?;
        temporary.persist(&path).map_err(|e| fail(e.error))?;
        #[cfg(unix)]
        fs::File::open(folder_of(&path))
            .and_then(|f| f.sync_all())
            .map_err(fail)?;
        Ok(())
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.temporary.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.temporary.flush()
    }
}

/// Writes to `to`, and hashes the written bytes.
pub struct Hashing<W> {
    to: W,
    sha256: Sha256,
}

impl<W: Write> Hashing<W> {
    pub fn new(to: W) -> Self {
        Self {
            to,
            sha256: Sha256::new(),
        }
    }

    /// Returns the writer, and the SHA-256 of the written bytes in lower-case hexadecimal.
    pub fn finish(self) -> (W, String) {
        (self.to, hex(&self.sha256.finalize()))
    }
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.to.write(bytes)?;
        self.sha256.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Whether a file has the name of a temporary file, whose writer ended before it was committed.
pub fn is_temporary(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(TEMPORARY.as_bytes())
}

/// Whether the path leads to something other than a file: a folder, pipe or device. It is not opened, because a pipe
/// may never answer.
pub fn is_no_file(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| !metadata.is_file())
}

/// The folder that a file is in.
pub fn folder_of(file: &Path) -> &Path {
    file.parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
}

/// Whether both paths lead to the same folder. It is false if one of them does not exist.
pub fn is_same_folder(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Whether two paths name the same file, which need not exist.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    a.file_name() == b.file_name() && is_same_folder(folder_of(a), folder_of(b))
}

/// Names of the files in a folder whose files may be replaced, or none if the folder does not exist. Fails if the path
/// is a file, or if the folder holds a file whose name is not `own`. Errors name `option`, the command-line option that
/// gave the folder.
pub fn own_folder(
    option: &str,
    folder: &Path,
    own: impl Fn(&str) -> bool,
    accepted: &str,
) -> Result<Vec<String>> {
    let refuse = |problem: String| Err(Error::option(option, folder.display(), problem, accepted));
    let fail = |source| Error::Read {
        path: folder.into(),
        source,
    };
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) if e.kind() == io::ErrorKind::NotADirectory => return refuse("it is a file".into()),
        Err(source) => return Err(fail(source)),
    };
    let mut names = Vec::new();
    for entry in entries {
        let name = entry
            .map_err(fail)?
            .file_name()
            .to_string_lossy()
            .into_owned();
        if !own(&name) {
            return refuse(format!("it holds {name:?}"));
        }
        names.push(name);
    }
    Ok(names)
}

/// JSON on one line.
pub fn json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string(value).map_err(json_error)
}

/// Indented JSON with a line break at the end.
pub fn json_pretty(value: &impl Serialize) -> Result<String> {
    Ok(serde_json::to_string_pretty(value).map_err(json_error)? + "\n")
}

fn json_error(e: serde_json::Error) -> Error {
    Error::Syntax {
        file: "JSON".into(),
        message: e.to_string(),
    }
}

/// Identifies this build of the program among others on the same machine. It is empty if the program's file cannot be
/// read.
pub fn build_id() -> &'static str {
    static ID: OnceLock<String> = OnceLock::new();
    ID.get_or_init(|| {
        let Ok(program) = std::env::current_exe().and_then(fs::read) else {
            return String::new();
        };
        let mut hasher = DefaultHasher::new();
        hasher.write(&program);
        format!("{:016x}", hasher.finish())
    })
}

/// SHA-256 in lower-case hexadecimal.
pub fn sha256_hex(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
