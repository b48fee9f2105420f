//! Puts the files that an MJCF includes into its text, so that one text says all.

use crate::xml_limits;
use standfast_core::error::{Error, Result};
use standfast_files::assets::{self, Source};
use std::path::{Path, PathBuf};

/// Beginning of the last line of a text into which files were put, whose lines are not those of the file.
const WITH_INCLUDED: &str = "<!-- With the files that it includes: ";

/// Largest number of files that one includes.
const MOST_FILES: usize = 64;

/// The same MJCF with the text of each file in place of the `<include>` that names it; another text as it is. A file
/// is searched from the folder of the main file, then from that of the file that includes it.
///
/// # Errors
/// A file cannot be read, is malformed, or is included twice, or there are too many.
pub fn with_included(source: Source) -> Result<Source> {
    if source.is_builtin() || !source.is_mjcf() {
        return Ok(source);
    }
    let main = Path::new(&source.file);
    let mut included = vec![main.to_path_buf()];
    let Some(text) = expanded(&source, main, &mut included)? else {
        return Ok(source);
    };
    let names = included.iter().skip(1).filter_map(|path| path.file_name());
    let names: Vec<_> = names.map(|name| name.to_string_lossy()).collect();
    // The comment is one line, and two hyphens would end it.
    let names = names
        .join(", ")
        .replace(|c: char| c == '-' || c.is_control(), "_");
    Ok(Source {
        text: format!("{text}\n{WITH_INCLUDED}{names}. -->\n"),
        ..source
    })
}

/// Whether the lines of a text are those of its file.
pub fn has_own_lines(text: &str) -> bool {
    let last = text.lines().next_back();
    !last.is_some_and(|line| line.starts_with(WITH_INCLUDED))
}

/// The text with all that it includes. None if it includes nothing.
fn expanded(source: &Source, main: &Path, included: &mut Vec<PathBuf>) -> Result<Option<String>> {
    let document = xml_limits::of_file(&source.file, &source.text)?;
    let (mut text, mut end) = (String::new(), 0);
    let elements = document.descendants();
    for node in elements.filter(|node| node.has_tag_name("include")) {
        // What is within another include is replaced with it.
        if node.range().start < end {
            continue;
        }
        let name = node.attribute("file").unwrap_or_default();
        let fail = |problem: &str, accepted: &str| {
            Error::value(&source.file, "include file", name, problem, accepted)
        };
        let folders = [main, Path::new(&source.file)].map(|file| file.with_file_name(name));
        let found = folders.into_iter().find(|path| path.is_file());
        let path = found.ok_or_else(|| {
            fail(
                "no such file",
                "an MJCF file, from the folder of the main file",
            )
        })?;
        let is_same = |other: &PathBuf| other.canonicalize().ok() == path.canonicalize().ok();
        if included.iter().any(is_same) {
            return Err(fail("is included twice", "each file once"));
        }
        if included.len() > MOST_FILES {
            let accepted = format!("up to {MOST_FILES} files");
            return Err(fail("is one of too many files", &accepted));
        }
        included.push(path.clone());
        let inner = Source {
            file: path.to_string_lossy().into_owned(),
            ..assets::text(&path)?
        };
        let whole = expanded(&inner, main, included)?.unwrap_or(inner.text);
        let range = node.range();
        text += &source.text[end..range.start];
        text += content(&whole, &inner.file)?;
        end = range.end;
    }
    Ok((end > 0).then(|| text + &source.text[end..]))
}

/// What the root element of a text contains.
fn content<'a>(text: &'a str, file: &str) -> Result<&'a str> {
    let document = xml_limits::of_file(file, text)?;
    let root = document.root_element();
    let ends = (root.first_child(), root.last_child());
    Ok(match ends {
        (Some(first), Some(last)) => &text[first.range().start..last.range().end],
        _ => "",
    })
}
