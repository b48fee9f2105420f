//! The common part of all HTML pages (the report, replays, the paper's figures): the styles, and the rendering of a
//! template to one file that loads nothing else.

use crate::foreign::harmless;
use crate::text::layout::together;
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;
use standfast_core::error::{Error, Result};
use std::borrow::Cow;

/// Names and texts of the styles: the style of all pages, and the style of pages that are read from top to bottom.
const STYLES: [(&str, &str); 2] = [
    ("page_style", include_str!("html_page.css")),
    ("document_style", include_str!("html_document.css")),
];

/// Makes a page from `template`, which reads `context` and the shared styles (`page_style`, `document_style`), and
/// calls the functions and filters that `add` gives it. All texts in it are [`harmless`]. `name` must end in
/// `.html` or `.xml`, so that values are escaped. Fails only if the template is wrong.
pub fn render(
    name: &str,
    template: &str,
    undefined: UndefinedBehavior,
    add: impl FnOnce(&mut Environment),
    context: &impl Serialize,
) -> Result<String> {
    let fail = |e: minijinja::Error| Error::Numeric {
        what: name.into(),
        problem: format!("{e:#}"),
    };
    let mut environment = Environment::new();
    environment.set_undefined_behavior(undefined);
    // A template line that holds only a statement leaves no empty line in the page.
    environment.set_syntax(
        SyntaxConfig::builder()
            .trim_blocks(true)
            .lstrip_blocks(true)
            .build()
            .map_err(fail)?,
    );
    for (name, style) in STYLES {
        environment.add_global(name, style);
    }
    environment.add_global("version", env!("CARGO_PKG_VERSION"));
    environment.add_filter("together", |text: String| together(&text));
    add(&mut environment);
    let page = environment
        .render_named_str(name, template, Serde(context))
        .map_err(fail)?;
    Ok(match harmless(&page) {
        Cow::Borrowed(_) => page,
        Cow::Owned(harmless) => harmless,
    })
}
