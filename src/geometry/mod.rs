//! Geometry: support polygons ([`polygon`]), convex sets in state space ([`polytope`]), and linear programs
//! ([`program`]).

pub mod polygon;
pub mod polytope;
pub mod program;

pub use polygon::SupportPolygon;
pub use program::LinearProgram;
