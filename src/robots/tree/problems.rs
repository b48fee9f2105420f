//! The problems of a URDF, collected with their lines, so that all are reported at once.

use standfast_core::error::{Error, Result};

/// The problems of a file, and the changes and omissions.
pub struct Problems<'a> {
    file: &'a str,
    found: Vec<(usize, Error)>,
    /// Changes and omissions, in sentences.
    pub notes: Vec<String>,
    /// Links whose inertia was corrected, each with the correction.
    pub mended: Vec<String>,
}

impl<'a> Problems<'a> {
    pub fn new(file: &'a str) -> Self {
        Self {
            file,
            found: Vec::new(),
            notes: Vec::new(),
            mended: Vec::new(),
        }
    }

    /// Adds an [`Error::Value`] at a line (from 1; 0 for the file as a whole).
    pub fn add(
        &mut self,
        line: usize,
        field: impl Into<String>,
        value: impl ToString,
        problem: impl Into<String>,
        accepted: impl Into<String>,
    ) {
        let file = if line == 0 {
            self.file.to_string()
        } else {
            format!("{}:{line}", self.file)
        };
        self.found
            .push((line, Error::value(&file, field, value, problem, accepted)));
    }

    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Fails with all problems in the order of their lines, if there are any.
    pub fn check(&mut self) -> Result<()> {
        self.found.sort_by_key(|(line, _)| *line);
        Error::all(self.found.drain(..).map(|(_, error)| error).collect())
    }
}
