//! Convex support polygons.

use nalgebra::{Point2, Vector2};

/// A convex polygon, counter-clockwise, of at most [`SupportPolygon::MAX`] vertices (two soles make eight); no heap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportPolygon {
    vertices: [Point2<f64>; Self::MAX],
    len: usize,
}

/// The half plane `normal . z <= distance` with a unit normal that points out of the polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfPlane {
    pub normal: Vector2<f64>,
    pub distance: f64,
}

impl SupportPolygon {
    /// Most vertices that a polygon can have.
    pub const MAX: usize = 8;
}
