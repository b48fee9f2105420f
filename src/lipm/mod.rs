//! The COG-ZMP inverted pendulum (paper, Sect. II), its feedback gains and their maximal CPI sets (Sect. III, IV).
//!
//! [`cpi_set`] searches a set by linear programs, for one polygon, and keeps its matrix: for tables, plots, inclusion
//! tests and export. [`online`] answers membership at every tick, on any polygon, without a search: this is what the
//! controller uses. Both are the same set. [`stepping`] and [`relaxation`] are for when no set holds the state: where the
//! foot may land, and how COM and ZMP move while it is in the air (Sect. V). [`catching`] does the same beyond the paper, at
//! every tick. [`capture`] is what any of this is measured by:
//! the largest impulse that the pendulum can take. [`variant`] opens a gain set with one value of it changed.

pub mod capture;
pub mod catching;
pub mod cpi_set;
pub mod gains;
pub mod online;
pub mod pendulum;
pub mod relaxation;
pub mod stepping;
pub mod variant;

pub use cpi_set::CpiSet;
pub use gains::{FootworkRules, Gain, GainFamily, GainSet, Standing};
pub use online::OnlineSets;
pub use pendulum::{Pendulum, State};
