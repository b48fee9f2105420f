//! What the figures are drawn with: a panel of SVG elements whose colours are classes of `figure.css`, and axes in it.

use super::super::html::svg::{Scale, escape, px, short};
use crate::geometry::SupportPolygon;
use base64::prelude::{BASE64_STANDARD, Engine};
use nalgebra::{Isometry2, Point2};
use std::fmt::Write;

/// A point in the units of whoever draws: px in a panel, (m), (s) ... in axes.
pub type At = [f64; 2];

/// Of an arrow (px).
const HEAD_PX: f64 = 10.0;

/// A picture: elements in a frame (px).
#[derive(Debug, Clone)]
pub struct Panel {
    pub width: f64,
    pub height: f64,
    /// Of the elements to one px.
    pub units_per_px: f64,
    /// Of `figure.css`.
    pub class: &'static str,
    /// SVG elements.
    pub body: String,
}

impl Panel {
    pub fn new(width: f64, height: f64) -> Self {
        Self { width, height, units_per_px: 1.0, class: "fig", body: String::new() }
    }

    pub fn line(&mut self, class: &str, [x1, y1]: At, [x2, y2]: At) {
        let [x1, y1, x2, y2] = [x1, y1, x2, y2].map(px);
        self.add(format_args!("<line class=\"{class}\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>"));
    }

    pub fn polyline(&mut self, class: &str, points: &[At]) {
        self.add(format_args!("<polyline class=\"{class}\" points=\"{}\"/>", listed(points)));
    }

    pub fn polygon(&mut self, class: &str, points: &[At]) {
        if !points.is_empty() {
            self.add(format_args!("<polygon class=\"{class}\" points=\"{}\"/>", listed(points)));
        }
    }

    /// A rectangle by two corners.
    pub fn rect(&mut self, class: &str, [x1, y1]: At, [x2, y2]: At) {
        let [x, y] = [x1.min(x2), y1.min(y2)].map(px);
        let [width, height] = [(x2 - x1).abs(), (y2 - y1).abs()].map(px);
        self.add(format_args!("<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>"));
    }

    pub fn circle(&mut self, class: &str, [x, y]: At, r: f64) {
        let [x, y, r] = [x, y, r].map(px);
        self.add(format_args!("<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>"));
    }

    /// `class` may hold `start` or `end` for where the text is anchored; else its middle is at the point.
    pub fn text(&mut self, class: &str, [x, y]: At, text: &str) {
        let ([x, y], text) = ([x, y].map(px), escape(text));
        self.add(format_args!("<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{text}</text>"));
    }

    /// Text that reads upwards.
    pub fn text_up(&mut self, class: &str, [x, y]: At, text: &str) {
        let ([x, y], text) = ([x, y].map(px), escape(text));
        self.add(format_args!("<text class=\"{class}\" transform=\"translate({x} {y}) rotate(-90)\">{text}</text>"));
    }

    /// A line with a head at its end.
    pub fn arrow(&mut self, class: &str, from: At, to: At) {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.hypot(dy);
        if length < 1e-9 {
            return;
        }
        let (ux, uy) = (dx / length, dy / length);
        let head = HEAD_PX.min(0.6 * length);
        let neck = [to[0] - head * ux, to[1] - head * uy];
        let wing = |side: f64| [neck[0] - side * 0.45 * head * uy, neck[1] + side * 0.45 * head * ux];
        self.line(class, from, neck);
        self.polygon(&format!("{class} head"), &[to, wing(1.0), wing(-1.0)]);
    }

    /// A PNG in the upper left corner, of the given size (px).
    pub fn image(&mut self, [width, height]: At, png: &[u8], words: &str) {
        let ([width, height], words) = ([width, height].map(px), escape(words));
        let data = BASE64_STANDARD.encode(png);
        self.add(format_args!(
            "<image x=\"0\" y=\"0\" width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{words}\" \
             href=\"data:image/png;base64,{data}\"/>"
        ));
    }

    /// The panel as an SVG element of its own; `attributes` go into its tag.
    pub fn svg(&self, attributes: &str) -> String {
        let ([width, height], class) = ([self.width, self.height].map(|side| px(side * self.units_per_px)), self.class);
        format!("<svg class=\"{class}\" viewBox=\"0 0 {width} {height}\" {attributes}>\n{}</svg>", self.body)
    }

    fn add(&mut self, element: std::fmt::Arguments) {
        // Writing to a String cannot fail.
        _ = writeln!(self.body, "{element}");
    }
}

fn listed(points: &[At]) -> String {
    let pairs: Vec<String> = points.iter().map(|p| format!("{},{}", px(p[0]), px(p[1]))).collect();
    pairs.join(" ")
}

/// Axes: values to px.
#[derive(Debug, Clone, Copy)]
pub struct Axes {
    /// Value at the left and at the right edge, in this order.
    pub x: At,
    /// Value at the bottom and at the top edge.
    pub y: At,
    /// Left, top, right and bottom edge (px).
    pub frame: [f64; 4],
}

impl Axes {
    pub fn at(&self, [x, y]: At) -> At {
        let [left, top, right, bottom] = self.frame;
        let share = |v: f64, [from, to]: At| (v - from) / (to - from);
        [left + share(x, self.x) * (right - left), bottom + share(y, self.y) * (top - bottom)]
    }

    pub fn all(&self, points: impl IntoIterator<Item = At>) -> Vec<At> {
        points.into_iter().map(|p| self.at(p)).collect()
    }

    /// A frame with a grid, numbers and names.
    pub fn draw(&self, panel: &mut Panel, x_name: &str, y_name: &str) {
        let [left, top, right, bottom] = self.frame;
        let ticks = |[a, b]: At| Scale { from: a.min(b), to: a.max(b) }.ticks();
        for x in ticks(self.x) {
            let [at, _] = self.at([x, self.y[0]]);
            panel.line("grid", [at, top], [at, bottom]);
            panel.text("tick", [at, bottom + 16.0], &short(x, 3));
        }
        for y in ticks(self.y) {
            let [_, at] = self.at([self.x[0], y]);
            panel.line("grid", [left, at], [right, at]);
            panel.text("tick end", [left - 6.0, at + 4.0], &short(y, 3));
        }
        panel.rect("frame", [left, top], [right, bottom]);
        panel.text("name", [0.5 * (left + right), bottom + 35.0], x_name);
        panel.text_up("name", [left - 43.0, 0.5 * (top + bottom)], y_name);
    }
}

/// The ground seen from above: forward is up, left is to the left, in equal scales. Points are in metres (x forward, y left).
pub struct GroundPlan {
    pub panel: Panel,
    axes: Axes,
}

impl GroundPlan {
    /// A panel `width` px wide that shows as far forward and backward as `x`, and to both sides as `y` (m).
    pub fn new(width: f64, x: f64, y: f64, title: &str) -> Self {
        let [left, top, margin, below] = [56.0, 34.0, 18.0, 44.0];
        let bottom = top + (width - left - margin) * x / y;
        let (x_mm, y_mm) = (1e3 * x, 1e3 * y);
        let axes = Axes { x: [y_mm, -y_mm], y: [-x_mm, x_mm], frame: [left, top, width - margin, bottom] };
        let mut panel = Panel::new(width, bottom + below);
        axes.draw(&mut panel, "y, to the left [mm]", "x, forward [mm]");
        panel.text("title start", [left, 20.0], title);
        Self { panel, axes }
    }

    /// Where a point is seen (px).
    pub fn at(&self, point: impl Into<At>) -> At {
        let [x, y] = point.into();
        self.axes.at([1e3 * y, 1e3 * x])
    }

    pub fn all<P: Into<At>>(&self, points: impl IntoIterator<Item = P>) -> Vec<At> {
        points.into_iter().map(|p| self.at(p)).collect()
    }

    pub fn polygon<P: Into<At>>(&mut self, class: &str, points: impl IntoIterator<Item = P>) {
        let points = self.all(points);
        self.panel.polygon(class, &points);
    }

    pub fn arrow(&mut self, class: &str, from: impl Into<At>, to: impl Into<At>) {
        let (from, to) = (self.at(from), self.at(to));
        self.panel.arrow(class, from, to);
    }

    /// A text `below_px` below a point.
    pub fn text(&mut self, class: &str, at: impl Into<At>, below_px: f64, text: &str) {
        let [x, y] = self.at(at);
        self.panel.text(class, [x, y + below_px], text);
    }

    /// A sole with the given corners about its centre.
    pub fn sole(&mut self, class: &str, corners: &[Point2<f64>], pose: Isometry2<f64>) {
        self.polygon(class, corners.iter().map(|corner| pose * corner));
    }

    /// A contact region, and what of it the ZMP may use.
    pub fn region(&mut self, whole: &SupportPolygon, allowed: &SupportPolygon) {
        self.polygon("support", whole.vertices().iter().copied());
        self.polygon("allowed", allowed.vertices().iter().copied());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forward_is_up_and_left_is_left_in_equal_scales() {
        let ground = GroundPlan::new(460.0, 0.1, 0.1, "a < b & c");
        let [middle, forward, left] = [[0.0, 0.0], [0.05, 0.0], [0.0, 0.05]].map(|p| ground.at(p));
        assert!(forward[1] < middle[1] && forward[0] == middle[0]);
        assert!(left[0] < middle[0] && left[1] == middle[1]);
        assert!((middle[1] - forward[1] - (middle[0] - left[0])).abs() < 1e-9);
        assert!(ground.panel.height > ground.panel.width - 60.0);
        assert!(ground.panel.svg("").contains("a &lt; b &amp; c"), "{}", ground.panel.body);
    }
}
