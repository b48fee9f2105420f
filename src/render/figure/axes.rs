//! Axes of panels: scales and ticks, charts, and the ground seen from above.

use super::panel::{At, Panel, View, short};
use crate::geometry::SupportPolygon;
use nalgebra::{Isometry2, Point2};

/// The values at both ends of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    pub from: f64,
    pub to: f64,
}

impl Scale {
    /// Round values within the scale, three to eleven of them, or one if the scale has no extent.
    pub fn ticks(self) -> Vec<f64> {
        let span = self.to - self.from;
        if !(span.is_finite() && span > 0.0) {
            return vec![self.from];
        }
        let decade = 10f64.powf((span / 4.0).log10().floor());
        let step = [5.0, 2.0, 1.0].map(|m| m * decade).into_iter().find(|s| span / s >= 2.9).unwrap_or(decade);
        let (first, last) = ((self.from / step - 1e-9).ceil() as i64, (self.to / step + 1e-9).floor() as i64);
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

/// One axis of a chart.
pub struct Axis {
    /// Name with its unit. If it is empty on an x axis, neither name nor numbers are written.
    pub name: String,
    /// Values at the left or lower edge, and at the other one.
    pub ends: At,
    /// Values with a number, and the text of the number.
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    pub fn new(name: &str, ends: At) -> Self {
        let [from, to] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let ticks = Scale { from, to }.ticks().into_iter().map(|x| (x, short(x, 3))).collect();
        Self { name: name.into(), ends, ticks }
    }
}

impl Panel {
    /// Draws a frame (left, top, right and bottom edge, px) with a grid, numbers and names. From then on, places are in
    /// the units of the axes.
    pub fn axes(&mut self, frame: [f64; 4], x: &Axis, y: &Axis) {
        let [left, top, right, bottom] = frame;
        let view = View::chart(frame, x.ends, y.ends);
        self.in_px(|panel| {
            for (at, number) in &x.ticks {
                let [at, _] = view.at([*at, 0.0]);
                panel.line("grid", [at, top], [at, bottom]);
                if !x.name.is_empty() {
                    panel.text("tick", [at, bottom], [0.0, 17.0], number);
                }
            }
            for (at, number) in &y.ticks {
                let [_, at] = view.at([0.0, *at]);
                panel.line("grid", [left, at], [right, at]);
                panel.text("tick end", [left, at], [-6.0, 4.0], number);
            }
            panel.rect("frame", [left, top], [right, bottom]);
            if !x.name.is_empty() {
                panel.text("name", [0.5 * (left + right), bottom], [0.0, 36.0], &x.name);
            }
            panel.turned_text("name up", [left - 44.0, 0.5 * (top + bottom)], -90.0, &y.name);
        });
        self.view = view;
    }

    /// A panel `width` px wide with the ground from above, as far as `x` forward and backward and `y` to both sides
    /// (m). Places are then on the ground (m; x forward, y left).
    pub fn ground(width: f64, [x, y]: At, title: &str) -> Self {
        let [left, top, margin, below] = [56.0, 34.0, 18.0, 44.0];
        let bottom = top + (width - left - margin) * x / y;
        let mut panel = Self::new(width, bottom + below);
        let sideways = Axis::new("y, to the left [mm]", [1e3 * y, -1e3 * y]);
        let forward = Axis::new("x, forward [mm]", [-1e3 * x, 1e3 * x]);
        panel.axes([left, top, width - margin, bottom], &sideways, &forward);
        let middle = panel.view.at([0.0, 0.0]);
        panel.in_px(|panel| panel.text("title start", [left, 20.0], [0.0, 0.0], title));
        panel.view = View::from_above(middle, 0.5 * (width - left - margin) / y);
        panel
    }

    /// Draws a sole on the ground, from its corners about its centre (m).
    pub fn sole(&mut self, class: &str, corners: &[Point2<f64>], pose: Isometry2<f64>) {
        self.polygon(class, corners.iter().map(|corner| pose * corner));
    }

    /// Draws a contact region, and the part of it that the ZMP may use.
    pub fn region(&mut self, whole: &SupportPolygon, allowed: &SupportPolygon) {
        self.polygon("support", whole.vertices().iter().copied());
        self.polygon("allowed", allowed.vertices().iter().copied());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let ticks = |from, to| Scale { from, to }.ticks();
        assert_eq!(ticks(0.0, 1.0), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
        assert_eq!(ticks(-0.5, 0.5), [-0.4, -0.2, 0.0, 0.2, 0.4]);
        assert_eq!(ticks(1.0, 1.0), [1.0]);
        for half in [0.05, 0.15, 0.3, 0.35, 2.5, 7.0] {
            let n = ticks(-half, half).len();
            assert!((3..=11).contains(&n), "{half}: {n} ticks");
        }
    }

    #[test]
    fn forward_is_up_and_left_is_left_in_equal_scales() {
        let ground = Panel::ground(460.0, [0.1, 0.1], "a < b & c");
        let [middle, forward, left] = [[0.0, 0.0], [0.05, 0.0], [0.0, 0.05]].map(|p| ground.view.at(p));
        assert!(forward[1] < middle[1] && (forward[0] - middle[0]).abs() < 1e-9);
        assert!(left[0] < middle[0] && (left[1] - middle[1]).abs() < 1e-9);
        assert!((middle[1] - forward[1] - (middle[0] - left[0])).abs() < 1e-9);
        assert!(ground.height > ground.width - 60.0);
        assert!(ground.svg("").contains("a &lt; b &amp; c"), "{}", ground.svg(""));
    }
}
