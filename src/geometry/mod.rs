//! Plane geometry of support: convex polygons ([`polygon`]) and convex sets in state space ([`polytope`]).

pub mod polygon;
pub mod polytope;

pub use polygon::SupportPolygon;
