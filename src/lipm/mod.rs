//! The COG-ZMP inverted pendulum (paper, Sect. II), its feedback gains and their maximal CPI sets (Sect. III, IV).
//!
//! [`cpi_set`] searches a set by linear programs, for one polygon, and keeps its matrix: for tables, plots, inclusion
//! tests and export. [`online`] answers membership at every tick, on any polygon, without a search: this is what the
//! controller uses. Both are the same set. [`variant`] opens a gain set with one value of it changed.

pub mod cpi_set;
pub mod gains;
pub mod online;
pub mod pendulum;
pub mod variant;

pub use cpi_set::CpiSet;
pub use gains::{Gain, GainFamily, GainSet, Standing};
pub use online::OnlineSets;
pub use pendulum::{Pendulum, State};
