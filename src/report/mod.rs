//! What a person or another program is told: reports of runs and descriptions of robots.

pub mod model;
