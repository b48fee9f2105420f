//! What people and other programs read: tables, JSON, pictures.

pub mod cpi;
mod cpi_plot;
