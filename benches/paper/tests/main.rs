//! The study of the paper from outside. One test program of modules.

mod cli;
mod common;
mod fuzz;
#[path = "../../../tests/fuzz/mutations.rs"]
mod mutations;
mod page;
mod published;
mod readme;
mod scenarios;
#[path = "../../../tests/readme/shown.rs"]
mod shown;
