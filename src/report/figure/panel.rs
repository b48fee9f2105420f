//! A panel of SVG elements. Places are in the units of the caller, and the panel's view converts them to px. Sizes of
//! marks and text are in px.

use crate::foreign::harmless;
use minijinja::HtmlEscape;
use std::fmt::{Display, Write};

/// A place in the units of a panel's view.
pub type PanelPoint = [f64; 2];

/// Length of the head of an arrow, and half the width of the caps of an error bar (px).
const HEAD: f64 = 10.0;
const CAP: f64 = 3.5;
/// Largest distance between a simplified curve and its points (px), which is too small to be visible.
const NEAR: f64 = 0.15;
/// Height of a row of a legend, and approximate width of its letters (px).
const ROW: f64 = 24.0;
const LETTER: f64 = 7.6;

/// A linear map from places to px.
#[derive(Debug, Clone, Copy)]
pub struct PanelView {
    /// Position of the place [0, 0] (px).
    origin: PanelPoint,
    /// Offset in px for one unit of x, and of y.
    x: PanelPoint,
    y: PanelPoint,
}

impl PanelView {
    /// The view in which places are px.
    pub const PX: Self = Self {
        origin: [0.0, 0.0],
        x: [1.0, 0.0],
        y: [0.0, 1.0],
    };

    /// The view of a chart in a frame (left, top, right and bottom edge, px). `x` holds the values at the left and
    /// right edge, `y` the values at the bottom and top edge.
    pub fn chart([left, top, right, bottom]: [f64; 4], x: PanelPoint, y: PanelPoint) -> Self {
        let ([x0, dx], [y0, dy]) = (
            [x[0], (right - left) / (x[1] - x[0])],
            [y[0], (top - bottom) / (y[1] - y[0])],
        );
        Self {
            origin: [left - x0 * dx, bottom - y0 * dy],
            x: [dx, 0.0],
            y: [0.0, dy],
        }
    }

    /// The view from above: forward (x) is up, left (y) is to the left. `middle` is the position of [0, 0] (px).
    pub fn from_above(middle: PanelPoint, px_per_unit: f64) -> Self {
        Self {
            origin: middle,
            x: [0.0, -px_per_unit],
            y: [-px_per_unit, 0.0],
        }
    }

    /// Position of a place (px).
    pub fn at(&self, place: impl Into<PanelPoint>) -> PanelPoint {
        let [x, y] = place.into();
        [0, 1].map(|i| self.origin[i] + x * self.x[i] + y * self.y[i])
    }
}

/// A panel: its size (px) and its elements.
#[derive(Debug, Clone)]
pub struct Panel {
    pub width: f64,
    pub height: f64,
    /// Coordinates of the upper left corner (px).
    pub corner: PanelPoint,
    /// How the places of the next elements are converted to px.
    pub view: PanelView,
    pub class: &'static str,
    body: String,
}

/// The sample before the text of a row of a legend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LegendSample {
    Line,
    /// A line with a dot of this class on it.
    DottedLine(&'static str),
    Area,
    Nothing,
}

/// A row of a legend: classes and shape of the sample, and text.
pub type LegendRow = (String, LegendSample, String);

impl Panel {
    /// An empty panel of a size (px). Places are px until axes are drawn.
    pub fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            corner: [0.0, 0.0],
            view: PanelView::PX,
            class: "fig",
            body: String::new(),
        }
    }

    /// A panel with nothing but a legend, in the size of the legend.
    pub fn of_legend(rows: &[LegendRow]) -> Self {
        let letters = rows
            .iter()
            .map(|(_, _, words)| words.chars().count())
            .max()
            .unwrap_or(0);
        let mut panel = Self::new(
            40.0 + LETTER * letters as f64,
            ROW * (rows.len() as f64 + 0.5),
        );
        panel.legend([0.0, ROW], rows);
        panel
    }

    pub fn line(&mut self, class: &str, from: impl Into<PanelPoint>, to: impl Into<PanelPoint>) {
        let ([x1, y1], [x2, y2]) = (self.seen(from), self.seen(to));
        self.add(format_args!(
            "<line class=\"{class}\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>"
        ));
    }

    pub fn polyline(&mut self, class: &str, points: impl IntoIterator<Item: Into<PanelPoint>>) {
        let points = self.listed(points);
        self.add(format_args!(
            "<polyline class=\"{class}\" points=\"{points}\"/>"
        ));
    }

    /// A curve with gaps where there is no point.
    pub fn curve(&mut self, class: &str, points: impl Iterator<Item = Option<PanelPoint>>) {
        for piece in pieces(points) {
            self.polyline(class, piece);
        }
    }

    pub fn polygon(&mut self, class: &str, points: impl IntoIterator<Item: Into<PanelPoint>>) {
        let points = self.listed(points);
        if !points.is_empty() {
            self.add(format_args!(
                "<polygon class=\"{class}\" points=\"{points}\"/>"
            ));
        }
    }

    /// A rectangle from two opposite corners.
    pub fn rect(&mut self, class: &str, a: impl Into<PanelPoint>, b: impl Into<PanelPoint>) {
        let ([x1, y1], [x2, y2]) = (self.view.at(a), self.view.at(b));
        let [x, y, width, height] =
            [x1.min(x2), y1.min(y2), (x2 - x1).abs(), (y2 - y1).abs()].map(px);
        self.add(format_args!(
            "<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>"
        ));
    }

    /// A circle with a radius in px.
    pub fn circle(&mut self, class: &str, at: impl Into<PanelPoint>, r: f64) {
        let ([x, y], r) = (self.seen(at), px(r));
        self.add(format_args!(
            "<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>"
        ));
    }

    /// A diamond whose corners are `r` px from its middle.
    pub fn diamond(&mut self, class: &str, at: impl Into<PanelPoint>, r: f64) {
        let [x, y] = self.view.at(at);
        let corners = [[x, y - r], [x + r, y], [x, y + r], [x - r, y]];
        self.in_px(|panel| panel.polygon(class, corners));
    }

    /// An error bar with caps, between two values of y.
    pub fn error_bar(&mut self, class: &str, x: f64, ends: PanelPoint) {
        let [[x, low], [_, high]] = ends.map(|y| self.view.at([x, y]));
        let points = [
            [x - CAP, low],
            [x + CAP, low],
            [x, low],
            [x, high],
            [x - CAP, high],
            [x + CAP, high],
        ];
        self.in_px(|panel| panel.polyline(class, points));
    }

    /// A line of text. Its middle is at the place plus an offset (px, to the right and down). With `start` or `end` in
    /// `class`, its start or end is there.
    pub fn text(
        &mut self,
        class: &str,
        at: impl Into<PanelPoint>,
        [dx, dy]: PanelPoint,
        text: &str,
    ) {
        let ([x, y], text) = (self.view.at(at), escape(text));
        let [x, y] = [x + dx, y + dy].map(px);
        self.add(format_args!(
            "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{text}</text>"
        ));
    }

    /// Text turned clockwise about its place (degrees).
    pub fn turned_text(
        &mut self,
        class: &str,
        at: impl Into<PanelPoint>,
        turn_deg: f64,
        text: &str,
    ) {
        let ([x, y], text) = (self.seen(at), escape(text));
        let place = format!("translate({x} {y}) rotate({turn_deg})");
        self.add(format_args!(
            "<text class=\"{class}\" transform=\"{place}\">{text}</text>"
        ));
    }

    /// A line with a head at its end.
    pub fn arrow(&mut self, class: &str, from: impl Into<PanelPoint>, to: impl Into<PanelPoint>) {
        let (from, to) = (self.view.at(from), self.view.at(to));
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.hypot(dy);
        if length < 1e-9 {
            return;
        }
        let (ux, uy) = (dx / length, dy / length);
        let head = HEAD.min(0.6 * length);
        let neck = [to[0] - head * ux, to[1] - head * uy];
        let wing = |side: f64| {
            [
                neck[0] - side * 0.45 * head * uy,
                neck[1] + side * 0.45 * head * ux,
            ]
        };
        self.in_px(|panel| {
            panel.line(class, from, neck);
            panel.polygon(&format!("{class} head"), [to, wing(1.0), wing(-1.0)]);
        });
    }

    /// A legend with its first row at a place (px). Returns the place of the next row.
    pub fn legend(&mut self, [x, top]: PanelPoint, rows: &[LegendRow]) -> PanelPoint {
        self.in_px(|panel| {
            for (i, (class, sample, words)) in rows.iter().enumerate() {
                let y = top + ROW * i as f64;
                panel.group(&format!("class=\"{class}\""), |panel| {
                    if let LegendSample::Line | LegendSample::DottedLine(_) = sample {
                        panel.line(class, [x, y], [x + 26.0, y]);
                    }
                    match sample {
                        LegendSample::DottedLine(dot) => panel.circle(dot, [x + 13.0, y], 4.0),
                        LegendSample::Area => panel.rect(class, [x, y - 7.0], [x + 26.0, y + 7.0]),
                        LegendSample::Line | LegendSample::Nothing => {}
                    }
                });
                let class = if *sample == LegendSample::Nothing {
                    "start soft"
                } else {
                    "start"
                };
                panel.text(class, [x + 34.0, y], [0.0, 4.5], words);
            }
        });
        [x, top + ROW * rows.len() as f64]
    }

    /// A group of elements with common attributes.
    pub fn group(&mut self, attributes: &str, draw: impl FnOnce(&mut Self)) {
        self.add(format_args!("<g {attributes}>"));
        draw(self);
        self.add(format_args!("</g>"));
    }

    /// A group of elements with a tooltip.
    pub fn told(&mut self, words: &str, draw: impl FnOnce(&mut Self)) {
        self.group("", |panel| {
            panel.add(format_args!("<title>{}</title>", escape(words)));
            draw(panel);
        });
    }

    /// Draws elements whose places are in px.
    pub fn in_px(&mut self, draw: impl FnOnce(&mut Self)) {
        let view = std::mem::replace(&mut self.view, PanelView::PX);
        draw(self);
        self.view = view;
    }

    /// The panel as an `svg` element, with `attributes` in its tag.
    pub fn svg(&self, attributes: &str) -> String {
        let ([left, top], [width, height]) =
            (self.corner.map(px), [self.width, self.height].map(px));
        let (class, body) = (self.class, &self.body);
        format!(
            "<svg class=\"{class}\" viewBox=\"{left} {top} {width} {height}\" {attributes}>\n{body}</svg>"
        )
    }

    pub fn add(&mut self, element: impl Display) {
        // Writing to a String cannot fail.
        _ = writeln!(self.body, "{element}");
    }

    fn seen(&self, place: impl Into<PanelPoint>) -> [String; 2] {
        self.view.at(place).map(px)
    }

    fn listed(&self, points: impl IntoIterator<Item: Into<PanelPoint>>) -> String {
        let points = thinned(
            points
                .into_iter()
                .map(|point| self.view.at(point))
                .collect(),
        );
        let pairs: Vec<String> = points
            .into_iter()
            .map(|point| point.map(px).join(","))
            .collect();
        pairs.join(" ")
    }
}

/// The uninterrupted runs of values that are present.
pub fn pieces<T>(values: impl Iterator<Item = Option<T>>) -> Vec<Vec<T>> {
    let mut pieces = vec![Vec::new()];
    for value in values {
        match (value, pieces.last_mut()) {
            (Some(value), Some(piece)) => piece.push(value),
            (None, Some(piece)) if !piece.is_empty() => pieces.push(Vec::new()),
            _ => {}
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

/// The points (px) of a line that has all other points within `NEAR` (Ramer, Douglas and Peucker).
fn thinned(mut points: Vec<PanelPoint>) -> Vec<PanelPoint> {
    let mut needed = vec![false; points.len()];
    let mut stretches = vec![(0, points.len().saturating_sub(1))];
    while let Some((first, last)) = stretches.pop() {
        for end in [first, last] {
            // There may be no point at all.
            if let Some(needed) = needed.get_mut(end) {
                *needed = true;
            }
        }
        let farthest = (first + 1..last)
            .map(|i| (i, distance(points[i], [points[first], points[last]])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, _)) = farthest.filter(|(_, away)| *away > NEAR) {
            stretches.extend([(first, i), (i, last)]);
        }
    }
    let mut needed = needed.into_iter();
    points.retain(|_| needed.next() == Some(true));
    points
}

/// Distance of a point from the line segment between two others.
fn distance([x, y]: PanelPoint, [[x1, y1], [x2, y2]]: [PanelPoint; 2]) -> f64 {
    let (dx, dy) = (x2 - x1, y2 - y1);
    let share = ((x - x1) * dx + (y - y1) * dy) / (dx * dx + dy * dy).max(f64::MIN_POSITIVE);
    let share = share.clamp(0.0, 1.0);
    (x - x1 - share * dx).hypot(y - y1 - share * dy)
}

/// The text, escaped for the inside of an element or of a quoted attribute, and without characters that XML does not
/// allow.
pub fn escape(text: &str) -> String {
    HtmlEscape(&harmless(text)).to_string()
}

/// A number with at most `digits` decimals, without trailing zeros, and with a typographic minus.
pub fn short(x: f64, digits: usize) -> String {
    let text = format!("{x:.digits$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    if text == "-0" {
        "0".into()
    } else {
        text.replace('-', "\u{2212}")
    }
}

/// A coordinate in a picture, with at most one decimal.
pub fn px(x: f64) -> String {
    let text = format!("{x:.1}");
    text.strip_suffix(".0").unwrap_or(&text).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            (short(-2.50, 2), short(-0.001, 2), short(100.0, 1)),
            ("\u{2212}2.5".into(), "0".into(), "100".into())
        );
        assert_eq!((px(12.04), px(-3.0)), ("12".into(), "-3".into()));
    }

    #[test]
    fn a_curve_keeps_the_points_that_are_seen() {
        let flat = (0..1000).map(|i| [0.1 * f64::from(i), 0.1 * f64::from(i % 2)]);
        assert_eq!(thinned(flat.clone().collect()), [[0.0, 0.0], [99.9, 0.1]]);
        let spike = |[x, y]: PanelPoint| [x, if x == 50.0 { 9.0 } else { y }];
        let with_spike = thinned(flat.map(spike).collect());
        assert!(
            with_spike.contains(&[50.0, 9.0]) && with_spike.len() < 8,
            "{with_spike:?}"
        );
        // A curve that turns back keeps its turning point.
        assert_eq!(thinned(vec![[0.0, 0.0], [9.0, 0.0], [0.0, 0.0]]).len(), 3);
        assert_eq!(thinned(Vec::new()), [[0.0; 2]; 0]);
    }
}
