//! The robot in a window, live in the closed loop, or a trial of a result as it was.
//!
//! Its options are part of every build, so that the help of `standfast view` is; the window itself needs the feature
//! `view`.

#[cfg(feature = "view")]
mod app;
mod options;

#[cfg(feature = "view")]
pub use app::run;
pub use options::Options;

#[cfg(not(feature = "view"))]
use crate::error::{Error, Result};

/// There is no window in this build. Errors: says so, what shows the same without one, and how to build one.
#[cfg(not(feature = "view"))]
pub fn run(_: &Options) -> Result<String> {
    Err(Error::NoWindow {
        missing: "this build of standfast has no window".into(),
        remedy: "to watch without one, in any browser: `standfast push --replay push.html`, or `standfast replay DIR --trial \
                 I` for a trial of a result; to build one with a window: `cargo build --release --features view`, which \
                 takes some twenty minutes on two cores"
            .into(),
    })
}
