//! What the pages share (the report, a replay, the paper's figures): colours, and how a template becomes a file that asks
//! for nothing else.

use crate::error::{Error, Result};
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;

/// Of all pages, and of those that are read from top to bottom.
const STYLES: [(&str, &str); 2] =
    [("page_style", include_str!("html_page.css")), ("document_style", include_str!("html_document.css"))];

/// The page `name` (ends in .html: what the template prints is escaped) from `template`, which reads `context` and the
/// shared styles as `page_style` and `document_style`, and calls what `add` gives it. Errors: none but a template that is
/// wrong.
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
    // Lines of the template that only decide leave nothing behind.
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build().map_err(fail)?);
    for (name, style) in STYLES {
        environment.add_global(name, style);
    }
    environment.add_global("version", env!("CARGO_PKG_VERSION"));
    add(&mut environment);
    environment.render_named_str(name, template, Serde(context)).map_err(fail)
}
