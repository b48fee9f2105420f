//! XML of limited depth, for parsers that go down by recursion.

use roxmltree::Document;

/// Most nested elements.
const MOST_LEVELS: usize = 64;

/// Parses XML whose elements are not nested too deeply. Fails with what is wrong, in words.
pub fn document(text: &str) -> Result<Document<'_>, String> {
    if levels(text) > MOST_LEVELS {
        return Err(format!("elements are nested more than {MOST_LEVELS} deep"));
    }
    Document::parse(text).map_err(|e| e.to_string())
}

/// How deep elements are nested, seen without parsing.
fn levels(text: &str) -> usize {
    let (mut level, mut most, mut rest): (usize, usize, &str) = (0, 0, text);
    while let Some(at) = rest.find('<') {
        rest = &rest[at..];
        let end =
            [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")].iter().find(|(start, _)| rest.starts_with(start));
        let length = match end {
            Some((start, end)) => rest[start.len()..].find(end).map(|at| start.len() + at + end.len()),
            None => tag_length(rest),
        };
        let tag = &rest[..length.unwrap_or(rest.len())];
        if tag.starts_with("</") {
            level = level.saturating_sub(1);
        } else if end.is_none() && !tag.ends_with("/>") && !tag.starts_with("<!") {
            level += 1;
            most = most.max(level);
        }
        rest = &rest[tag.len()..];
    }
    most
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
            ("<?xml version='1'?><!-- <b><c> --><a><b x='>' y=\"<\"/><![CDATA[<d><e>]]><b></b></a>", 2),
            ("<a><b><c/></b><b></b></a>", 2),
            ("<a", 1),
            ("", 0),
        ] {
            assert_eq!(levels(text), expected, "{text}");
        }
    }
}
