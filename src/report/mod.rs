//! What a person or another program is told: reports of runs, descriptions of robots and sets, pictures, progress.

pub mod cpi;
mod cpi_plot;
pub mod model;
pub mod plot;
pub mod progress;
pub mod push;
pub mod response;
mod response_plot;
mod story;
pub mod table;
pub mod trace;

use crate::error::{Error, Result};
use std::io::{ErrorKind, Write};

/// Prints to the standard output; a reader that has gone (`| head`) is no error.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Write { path: "standard output".into(), source: e }),
        _ => Ok(()),
    }
}

/// One JSON object, as it is printed.
pub fn json(value: &impl serde::Serialize) -> String {
    // Only a map with keys that are not text could fail; there is none.
    let mut text = serde_json::to_string_pretty(value).unwrap_or_default();
    text.push('\n');
    text
}
