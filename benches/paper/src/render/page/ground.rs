//! Panels that show the ground from above, with soles and contact regions on it.

use nalgebra::{Isometry2, Point2};
use standfast::core::geometry::SupportPolygon;
use standfast::report::figure::axes::Axis;
use standfast::report::figure::panel::{Panel, PanelPoint, PanelView};

/// A panel with the ground, and what is drawn on it.
pub trait Ground {
    /// A panel `width` px wide with the ground from above. `reach` says how far it goes forward and backward, and to
    /// both sides (m). Places are then on the ground (m; x forward, y left).
    fn ground(width: f64, reach: PanelPoint, title: &str) -> Self;
    /// Draws a sole on the ground, from its corners about its centre (m).
    fn sole(&mut self, class: &str, corners: &[Point2<f64>], pose: Isometry2<f64>);
    /// Draws a contact region, and the part of it that the ZMP may use.
    fn region(&mut self, whole: &SupportPolygon, allowed: &SupportPolygon);
}

impl Ground for Panel {
    fn ground(width: f64, [x, y]: PanelPoint, title: &str) -> Self {
        let [left, top, margin, below] = [56.0, 34.0, 18.0, 44.0];
        let bottom = top + (width - left - margin) * x / y;
        let mut panel = Self::new(width, bottom + below);
        let sideways = Axis::new("y, to the left [mm]", [1e3 * y, -1e3 * y]);
        let forward = Axis::new("x, forward [mm]", [-1e3 * x, 1e3 * x]);
        panel.axes([left, top, width - margin, bottom], &sideways, &forward);
        let middle = panel.view.at([0.0, 0.0]);
        panel.in_px(|panel| panel.text("title start", [left, 20.0], [0.0, 0.0], title));
        panel.view = PanelView::from_above(middle, 0.5 * (width - left - margin) / y);
        panel
    }

    fn sole(&mut self, class: &str, corners: &[Point2<f64>], pose: Isometry2<f64>) {
        self.polygon(class, corners.iter().map(|corner| pose * corner));
    }

    fn region(&mut self, whole: &SupportPolygon, allowed: &SupportPolygon) {
        self.polygon("support", whole.vertices().iter().copied());
        self.polygon("allowed", allowed.vertices().iter().copied());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forward_is_up_and_left_is_left_in_equal_scales() {
        let ground = Panel::ground(460.0, [0.1, 0.1], "a < b & c");
        let [middle, forward, left] =
            [[0.0, 0.0], [0.05, 0.0], [0.0, 0.05]].map(|p| ground.view.at(p));
        assert!(forward[1] < middle[1] && (forward[0] - middle[0]).abs() < 1e-9);
        assert!(left[0] < middle[0] && (left[1] - middle[1]).abs() < 1e-9);
        assert!((middle[1] - forward[1] - (middle[0] - left[0])).abs() < 1e-9);
        assert!(ground.height > ground.width - 60.0);
        assert!(
            ground.svg("").contains("a &lt; b &amp; c"),
            "{}",
            ground.svg("")
        );
    }
}
