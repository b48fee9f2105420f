//! What all HTML pages share (the report, replays, the paper's figures): the styles, and the way from a template to one
//! file that loads nothing else.

use crate::error::{Error, Result};
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;

/// Names and texts of the styles: that of all pages, and that of pages that are read from top to bottom.
const STYLES: [(&str, &str); 2] =
    [("page_style", include_str!("html_page.css")), ("document_style", include_str!("html_document.css"))];

/// Makes a page from `template`, which reads `context` and the shared styles (`page_style`, `document_style`), and
/// calls the functions and filters that `add` gives it. `name` must end in `.html`, so that values are escaped. Fails
/// only if the template is wrong.
pub fn render(
    name: &str,
    template: &str,
    undefined: UndefinedBehavior,
    add: impl FnOnce(&mut Environment),
    context: &impl Serialize,
) -> Result<String> {
    let fail = |e: minijinja::Error| Error::Numeric { what: name.into(), problem: format!("{e:#}") };
    let mut environment = Environment::new();
    environment.set_undefined_behavior(undefined);
    // A line of the template that holds only a statement leaves no empty line in the page.
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build().map_err(fail)?);
    for (name, style) in STYLES {
        environment.add_global(name, style);
    }
    environment.add_global("version", env!("CARGO_PKG_VERSION"));
    environment.add_filter("together", |text: String| together(&text));
    add(&mut environment);
    environment.render_named_str(name, template, Serde(context)).map_err(fail)
}

/// The text with non-breaking spaces between a number and its unit, and around `=` and `<`.
pub fn together(text: &str) -> String {
    let ends_in_digit = |word: &str| word.ends_with(|c: char| c.is_ascii_digit());
    let is_unit = |word: &str| {
        ["N", "s", "ms", "mm", "m", "m/s", "%", "cm\u{b2}"].contains(&word.trim_end_matches(['.', ',', ';', ':', ')']))
    };
    let mut told = String::new();
    let mut before = "";
    for word in text.split(' ') {
        let stays = (ends_in_digit(before) && is_unit(word))
            || before == "N"
            || ["=", "<"].contains(&word)
            || ["=", "<"].contains(&before);
        if !told.is_empty() {
            told.push(if stays { '\u{a0}' } else { ' ' });
        }
        told += word;
        before = word;
    }
    told
}

#[cfg(test)]
mod tests {
    use super::together;

    #[test]
    fn a_number_stays_with_its_unit() {
        let told = together("home after 2.77 s. 3.74 to 4.38 N s (1 to 2, p = 0.06) of 5 sets");
        assert_eq!(told.replace('\u{a0}', "~"), "home after 2.77~s. 3.74 to 4.38~N~s (1 to 2, p~=~0.06) of 5 sets");
    }
}
