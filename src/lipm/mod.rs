//! The COG-ZMP inverted pendulum (paper, Sect. II), its feedback gains and their maximal CPI sets (Sect. III, IV).

pub mod cpi_set;
pub mod gains;
pub mod pendulum;
