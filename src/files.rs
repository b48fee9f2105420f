//! Writing files so that a reader, or a crash, never meets half of one; and how a shell wants to hear of them.

use crate::error::{Error, Result};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::hash::{DefaultHasher, Hasher};
use std::{fs, io::Write, path::Path, sync::OnceLock};

/// Writes `bytes` to `path`, making its folder if needed: a unique temporary file in the same folder, fsync, rename,
/// fsync of the folder. Two writers may race; either result is whole.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let fail = |source| Error::Write { path: path.into(), source };
    fs::create_dir_all(folder).map_err(fail)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".tmp-");
    // A temporary file is private to its owner; a result is as readable as any other file of the caller.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut temporary = builder.tempfile_in(folder).map_err(fail)?;
    temporary.write_all(bytes).map_err(fail)?;
    temporary.as_file().sync_all().map_err(fail)?;
    temporary.persist(path).map_err(|e| fail(e.error))?;
    #[cfg(unix)]
    fs::File::open(folder).and_then(|f| f.sync_all()).map_err(fail)?;
    Ok(())
}

/// One line of JSON.
pub fn json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string(value).map_err(json_error)
}

/// JSON to read, with an end of line.
pub fn json_pretty(value: &impl Serialize) -> Result<String> {
    Ok(serde_json::to_string_pretty(value).map_err(json_error)? + "\n")
}

fn json_error(e: serde_json::Error) -> Error {
    Error::Syntax { file: "JSON".into(), message: e.to_string() }
}

/// As a shell wants it: in quotes if there is anything in it that a shell would read.
pub fn shell_word(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) { text.into() } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

/// What tells this build of the program from another, on the same machine; empty if its file cannot be read.
pub fn build_id() -> &'static str {
    static ID: OnceLock<String> = OnceLock::new();
    ID.get_or_init(|| {
        let Ok(program) = std::env::current_exe().and_then(fs::read) else { return String::new() };
        let mut hasher = DefaultHasher::new();
        hasher.write(&program);
        format!("{:016x}", hasher.finish())
    })
}

/// SHA-256 in lower-case hexadecimal.
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a/b.txt");
        write_atomic(&path, b"one").unwrap();
        write_atomic(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_shell_reads_a_name_as_one_word() {
        assert_eq!(shell_word("out/campaign.toml"), "out/campaign.toml");
        assert_eq!(shell_word("mine zmp_margin_m=0.1"), "'mine zmp_margin_m=0.1'");
        assert_eq!(shell_word("x=[1,2]"), "'x=[1,2]'");
        assert_eq!(shell_word("it's"), r"'it'\''s'");
        assert_eq!(shell_word(""), "''");
    }

    #[test]
    fn sha256_of_the_empty_string_is_the_published_one() {
        assert!(sha256_hex(b"").starts_with("e3b0c44298fc1c14"));
    }
}
