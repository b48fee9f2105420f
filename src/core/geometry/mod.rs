//! Geometry: support polygons ([`polygon`]), distances between convex hulls ([`gap`]), and convex sets in state space
//! with linear programs on them ([`polytope`]).

pub mod gap;
pub mod polygon;
pub mod polytope;

pub use polygon::SupportPolygon;
