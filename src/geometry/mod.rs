//! Geometry: support polygons ([`polygon`]), and convex sets in state space with linear programs on them ([`polytope`]).

pub mod polygon;
pub mod polytope;

pub use polygon::SupportPolygon;
