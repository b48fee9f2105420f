//! The robot in a window, live in the closed loop.
//!
//! The options are part of every build, so that `standfast view --help` works. The window itself needs the feature
//! `view`.

#[cfg(feature = "view")]
mod app;
mod options;

#[cfg(feature = "view")]
pub use app::run;
pub use options::Options;

#[cfg(not(feature = "view"))]
use crate::error::{Error, Result};

/// This build has no window. Always fails, with an error that names the alternatives and the command that builds a
/// window.
#[cfg(not(feature = "view"))]
pub fn run(_: &Options) -> Result<String> {
    Err(Error::NoWindow {
        missing: "this build of standfast has no window".into(),
        remedy:
            "to watch in a browser instead: `standfast push --replay push.html`, or `standfast replay DIR --trial I` \
                 for a trial of a result; to build standfast with a window: `cargo build --release --features view`, \
                 which takes some twenty minutes on two cores"
                .into(),
    })
}
