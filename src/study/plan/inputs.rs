//! Keeps the inputs of a campaign, and writes them to its folder.

use super::PreparedCampaign;
use crate::store::folder::Folder;
use crate::store::manifest::Input;
use standfast_core::error::{Error, Result};
use standfast_files::assets::Source;
use standfast_files::{sha256_hex, write_atomic};
use std::path::Path;

impl PreparedCampaign {
    /// Writes the manifest and all that is needed to run the campaign again: `campaign.toml` and the inputs.
    pub(crate) fn identify(&self, folder: &Folder) -> Result<()> {
        folder.create()?;
        for (name, bytes) in &self.inputs {
            let path = folder.path.join(name);
            write_atomic(&path, bytes)?;
            if bytes.starts_with(b"#!") || bytes.starts_with(b"\x7fELF") {
                make_executable(&path)?;
            }
        }
        if self
            .entrants
            .iter()
            .any(|(controller, _)| controller.is_program())
        {
            standfast_controllers::permission::note(&folder.path, &self.inputs);
        }
        folder.write_campaign()
    }
}

/// Lets a copy of a program be started.
fn make_executable(path: &Path) -> Result<()> {
    #[cfg(unix)]
    {
        let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
        std::fs::set_permissions(path, mode).map_err(|source| Error::Write {
            path: path.into(),
            source,
        })?;
    }
    Ok(())
}

/// The files that a campaign reads. They are kept, so that it can be run again from its folder.
#[derive(Default)]
pub(super) struct Inputs {
    /// All files, in the order in which they are hashed.
    pub(super) listed: Vec<Input>,
    /// The files that are not compiled in, each by its name in the result folder.
    pub(super) kept: Vec<(String, Vec<u8>)>,
}

impl Inputs {
    /// Takes the files of one input, each given with its extension. Returns the name that the campaign in the
    /// folder has for it: the original one if the input is compiled in, else that of its last file.
    pub(super) fn take(
        &mut self,
        original: &str,
        stem: &str,
        files: Vec<(Source, &str)>,
    ) -> Result<String> {
        let mut name = original.to_string();
        for (source, extension) in files {
            let sha256 = sha256_hex(source.text.as_bytes());
            if source.is_builtin() {
                self.listed.push(Input {
                    file: source.file,
                    sha256,
                });
                continue;
            }
            name = format!("inputs/{stem}.{extension}");
            self.listed.push(Input {
                file: name.clone(),
                sha256,
            });
            if !self.keep(&name, source.text.into_bytes()) {
                return Err(Error::value(
                    original,
                    "name",
                    stem.trim_start_matches("controllers/"),
                    "another file has a controller of this name",
                    "a name or a folder of its own for each",
                ));
            }
        }
        Ok(name)
    }

    /// Takes the files that the controller `original` needs, so that they lie beside its own.
    pub(super) fn take_beside(
        &mut self,
        original: &str,
        files: Vec<(String, Vec<u8>)>,
    ) -> Result<()> {
        for (file, bytes) in files {
            let name = format!("inputs/controllers/{file}");
            self.listed.push(Input {
                file: name.clone(),
                sha256: sha256_hex(&bytes),
            });
            if !self.keep(&name, bytes) {
                return Err(Error::value(
                    original,
                    "file",
                    file,
                    "another controller needs another file of this name",
                    "a name of its own for each",
                ));
            }
        }
        Ok(())
    }

    /// Keeps a file. Variants of one controller share one file. Returns false if another file has this name.
    fn keep(&mut self, name: &str, bytes: Vec<u8>) -> bool {
        match self.kept.iter().find(|(kept, _)| kept == name) {
            Some((_, kept)) => *kept == bytes,
            None => {
                self.kept.push((name.into(), bytes));
                true
            }
        }
    }
}
