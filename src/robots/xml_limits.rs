//! Parses XML of limited depth and size, because the parsers recurse.

use roxmltree::{Document, Node};
use standfast_core::error::{Error, Result};

/// Largest number of nested elements.
const MOST_LEVELS: usize = 64;

/// Largest number of bytes of a tag: the parser compares each attribute with all others.
const MOST_TAG_BYTES: usize = 10_000;

/// Parses XML whose elements are not nested too deeply, with tags that are not too long. Fails with what is wrong, in
/// words.
pub fn document(text: &str) -> std::result::Result<Document<'_>, String> {
    let [levels, longest] = extent(text);
    if levels > MOST_LEVELS {
        return Err(format!("elements are nested more than {MOST_LEVELS} deep"));
    }
    if longest > MOST_TAG_BYTES {
        return Err(format!(
            "a tag has {longest} bytes; accepted: up to {MOST_TAG_BYTES}"
        ));
    }
    Document::parse(text).map_err(|e| e.to_string())
}

/// The XML of a file, as by [`document`].
pub fn of_file<'a>(file: &str, text: &'a str) -> Result<Document<'a>> {
    document(text).map_err(|problem| Error::Syntax {
        file: file.into(),
        message: format!("the XML is malformed: {problem}"),
    })
}

/// Fails if there are more elements of a name than its largest number.
pub fn check_counts(file: &str, root: Node, most: &[(&str, usize)]) -> Result<()> {
    for &(name, most) in most {
        let elements = root.descendants();
        let count = elements.filter(|node| node.has_tag_name(name)).count();
        if count > most {
            let problem = format!("there are too many {name}s");
            let accepted = format!("up to {most} {name}s");
            return Err(Error::value(file, name, count, problem, accepted));
        }
    }
    Ok(())
}

/// The text without XML comments. A comment without an end goes to the end of the text.
pub fn without_comments(text: &str) -> String {
    let (mut kept, mut rest) = (String::with_capacity(text.len()), text);
    while let Some((before, after)) = rest.split_once("<!--") {
        kept += before;
        rest = after.split_once("-->").map_or("", |(_, after)| after);
    }
    kept + rest
}

/// The deepest nesting of elements, and the length of the longest tag (bytes), found without parsing.
fn extent(text: &str) -> [usize; 2] {
    let (mut level, mut most, mut longest, mut rest): (usize, usize, usize, &str) = (0, 0, 0, text);
    while let Some(at) = rest.find('<') {
        rest = &rest[at..];
        let end = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")]
            .iter()
            .find(|(start, _)| rest.starts_with(start));
        let length = match end {
            Some((start, end)) => rest[start.len()..]
                .find(end)
                .map(|at| start.len() + at + end.len()),
            None => tag_length(rest),
        };
        let tag = &rest[..length.unwrap_or(rest.len())];
        longest = if end.is_none() {
            longest.max(tag.len())
        } else {
            longest
        };
        if tag.starts_with("</") {
            level = level.saturating_sub(1);
        } else if end.is_none() && !tag.ends_with("/>") && !tag.starts_with("<!") {
            level += 1;
            most = most.max(level);
        }
        rest = &rest[tag.len()..];
    }
    [most, longest]
}

/// Length of a tag up to its `>`, which may also stand in an attribute.
fn tag_length(tag: &str) -> Option<usize> {
    let mut quote = None;
    for (at, c) in tag.bytes().enumerate() {
        match (c, quote) {
            (b'>', None) => return Some(at + 1),
            (b'"' | b'\'', None) => quote = Some(c),
            (c, Some(open)) if c == open => quote = None,
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_those_of_elements() {
        for (text, expected) in [
            ("<a/>", 0),
            (
                "<?xml version='1'?><!-- <b><c> --><a><b x='>' y=\"<\"/><![CDATA[<d><e>]]><b></b></a>",
                2,
            ),
            ("<a><b><c/></b><b></b></a>", 2),
            ("<a", 1),
            ("", 0),
        ] {
            assert_eq!(extent(text)[0], expected, "{text}");
        }
        let many = format!("<a {}/>", "b='c' ".repeat(MOST_TAG_BYTES));
        assert!(
            document(&many)
                .unwrap_err()
                .starts_with("a tag has 60005 bytes; accepted: up to 10000")
        );
    }
}
