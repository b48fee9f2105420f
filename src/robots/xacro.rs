//! Expands a xacro file, a URDF with macros, by the program `xacro`.

use super::xml_limits::without_comments;
use standfast_core::error::{Error, Result};
use standfast_files::assets::{Source, shell_word};
use std::io::ErrorKind;
use std::process::{Command, Stdio};

/// The namespace of macros, by which a xacro file of any name is recognised.
const NAMESPACE: &str = "xmlns:xacro";

/// The URDF itself or, if it has macros, the output of `xacro`.
///
/// # Errors The program `xacro` is missing, or it fails; the error has its message.
pub fn expanded(source: Source) -> Result<Source> {
    if source.is_builtin() || !has_macros(&source) {
        return Ok(source);
    }
    let fail = |message: String| Error::Syntax {
        file: source.file.clone(),
        message,
    };
    let by_hand = || {
        let [from, to] = [&source.file, &expanded_file(&source.file)].map(|name| shell_word(name));
        format!("to do it where that program is: `xacro {from} > {to}`, then use that file")
    };
    let ran = Command::new("xacro")
        .arg(&source.file)
        .stdin(Stdio::null())
        .output();
    let output = ran.map_err(|e| match e.kind() {
        ErrorKind::NotFound => fail(format!(
            "it has macros of xacro, and there is no program `xacro` to expand them; install it (`pip install xacro`), or, \
             {}",
            by_hand()
        )),
        _ => fail(format!("it has macros of xacro, and `xacro` cannot be run: {e}; {}", by_hand())),
    })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(fail(format!(
            "`xacro` cannot expand it:\n  {}",
            said.trim().replace('\n', "\n  ")
        )));
    }
    let text = String::from_utf8(output.stdout)
        .map_err(|_| fail("`xacro` wrote what is not UTF-8".into()))?;
    Ok(Source { text, ..source })
}

/// The name for the expanded file. It differs from `file`, since a shell empties the file that it writes to.
fn expanded_file(file: &str) -> String {
    let stem = file.trim_end_matches(".xacro").trim_end_matches(".urdf");
    let urdf = format!("{stem}.urdf");
    if urdf == file {
        format!("{stem}-expanded.urdf")
    } else {
        urdf
    }
}

/// Whether a file is to be expanded: by its name, or if it uses a macro outside of comments.
fn has_macros(source: &Source) -> bool {
    if source.file.ends_with(".xacro") {
        return true;
    }
    let text = without_comments(&source.text);
    text.contains(NAMESPACE) && text.contains("<xacro:")
}
