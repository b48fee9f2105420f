//! Axes of panels: scales and ticks, charts, and the ground seen from above.

use super::panel::{Panel, PanelPoint, PanelView, short};

/// The values at both ends of a picture.
#[derive(Debug, Clone, Copy)]
pub struct AxisScale {
    pub from: f64,
    pub to: f64,
}

impl AxisScale {
    /// Round values within the scale, three to eleven of them, or one if the scale has no extent.
    pub fn ticks(self) -> Vec<f64> {
        let span = self.to - self.from;
        if !(span.is_finite() && span > 0.0) {
            return vec![self.from];
        }
        let decade = 10f64.powf((span / 4.0).log10().floor());
        let step = [5.0, 2.0, 1.0]
            .map(|m| m * decade)
            .into_iter()
            .find(|s| span / s >= 2.9)
            .unwrap_or(decade);
        let (first, last) = (
            (self.from / step - 1e-9).ceil() as i64,
            (self.to / step + 1e-9).floor() as i64,
        );
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

/// One axis of a chart.
pub struct Axis {
    /// Name with its unit. If it is empty on an x axis, neither name nor numbers are written.
    pub name: String,
    /// Values at the left or lower edge, and at the right or upper edge.
    pub ends: PanelPoint,
    /// Values with a number, and the text of the number.
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    pub fn new(name: &str, ends: PanelPoint) -> Self {
        let [from, to] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let ticks = AxisScale { from, to }
            .ticks()
            .into_iter()
            .map(|x| (x, short(x, 3)))
            .collect();
        Self {
            name: name.into(),
            ends,
            ticks,
        }
    }
}

impl Panel {
    /// Draws a frame (left, top, right and bottom edge, px) with a grid, numbers and names. From then on, places are in
    /// the units of the axes.
    pub fn axes(&mut self, frame: [f64; 4], x: &Axis, y: &Axis) {
        let [left, top, right, bottom] = frame;
        let view = PanelView::chart(frame, x.ends, y.ends);
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
            panel.turned_text(
                "name up",
                [left - 44.0, 0.5 * (top + bottom)],
                -90.0,
                &y.name,
            );
        });
        self.view = view;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let ticks = |from, to| AxisScale { from, to }.ticks();
        assert_eq!(
            ticks(0.0, 1.0),
            [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]
        );
        assert_eq!(ticks(-0.5, 0.5), [-0.4, -0.2, 0.0, 0.2, 0.4]);
        assert_eq!(ticks(1.0, 1.0), [1.0]);
        for half in [0.05, 0.15, 0.3, 0.35, 2.5, 7.0] {
            let n = ticks(-half, half).len();
            assert!((3..=11).contains(&n), "{half}: {n} ticks");
        }
    }
}
