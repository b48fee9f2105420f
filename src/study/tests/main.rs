//! What campaigns ask and conclude.

mod catching;
#[path = "../../sim/tests/common/mod.rs"]
mod common;
mod gates;
mod similarity;
