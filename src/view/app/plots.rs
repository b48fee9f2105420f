//! COM, ZMP and DCM over time, one plot for each axis.

use super::colors::{self, Named};
use crate::episode::Snapshot;
use egui_plot::{Line, Plot, PlotPoint, PlotPoints, VLine, uniform_grid_spacer};
use kiss3d::egui::{Color32, Rangef, Ui};
use nalgebra::Point2;
use std::collections::VecDeque;

/// What the plots show of a live run (s).
pub const SPAN_S: f64 = 4.0;
/// As many points of a curve are enough for the width of a plot.
const POINTS: usize = 300;

/// What is plotted of one tick, world (m).
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    pub time_s: f64,
    pub com: Point2<f64>,
    pub dcm: Point2<f64>,
    /// None in flight.
    pub zmp: Option<Point2<f64>>,
    pub zmp_ref: Point2<f64>,
}

impl Sample {
    pub fn of(snapshot: &Snapshot) -> Self {
        let Snapshot { time_s, com, dcm, zmp, zmp_ref, .. } = snapshot;
        Self { time_s: *time_s, com: com.xy(), dcm: *dcm, zmp: *zmp, zmp_ref: *zmp_ref }
    }
}

/// Samples in order of time.
#[derive(Debug, Default)]
pub struct Trail(VecDeque<Sample>);

impl Trail {
    /// Adds the newest; those that are older than the plots show go.
    pub fn push(&mut self, sample: Sample) {
        while self.0.front().is_some_and(|first| first.time_s < sample.time_s - SPAN_S) {
            self.0.pop_front();
        }
        self.0.push_back(sample);
    }
}

impl<const N: usize> From<[Sample; N]> for Trail {
    fn from(samples: [Sample; N]) -> Self {
        Self(samples.into())
    }
}

impl FromIterator<Sample> for Trail {
    fn from_iter<T: IntoIterator<Item = Sample>>(samples: T) -> Self {
        Self(samples.into_iter().collect())
    }
}

/// One curve: its name and colour, and where it is.
type Curve = (&'static str, Named, fn(&Sample) -> Option<Point2<f64>>);

const CURVES: [Curve; 4] = [
    ("ZMP wanted", colors::ZMP_REF, |s| Some(s.zmp_ref)),
    ("ZMP", colors::ZMP, |s| s.zmp),
    ("DCM", colors::DCM, |s| Some(s.dcm)),
    ("COM", colors::COM, |s| Some(s.com)),
];

/// How far the plots reach at least, to either side (mm): the noise of standing is not to fill them.
const LEAST_MM: f64 = 40.0;
/// And at most: after a fall the DCM is nowhere.
const MOST_MM: f64 = 300.0;

/// Draws both plots over `span_s` (from, to), each `height` points high; `now_s` is marked if it is given.
pub fn draw(ui: &mut Ui, trail: &Trail, span_s: [f64; 2], now_s: Option<f64>, height: f32) {
    for (axis, name) in ["x (mm), forward", "y (mm), left"].into_iter().enumerate() {
        ui.label(name);
        let stride = trail.0.len().div_ceil(POINTS).max(1);
        // By the clock and not by the place in the trail: a curve that scrolls must not dance.
        let kept = |sample: &&Sample| ((sample.time_s * 1000.0).round() as usize / 2).is_multiple_of(stride);
        let mm = |sample: &Sample, at: Point2<f64>| PlotPoint::new(sample.time_s, 1000.0 * at[axis]);
        let (mut low, mut high) = (-LEAST_MM, LEAST_MM);
        let mut lines = Vec::new();
        for (name, color, of) in CURVES {
            // A curve ends where there is no ZMP, and another begins.
            let mut stretch = Vec::new();
            for sample in trail.0.iter().filter(kept) {
                match of(sample) {
                    Some(at) => {
                        stretch.push(mm(sample, at));
                        let value = 1000.0 * at[axis];
                        (low, high) = (low.min(value), high.max(value));
                    }
                    None if !stretch.is_empty() => lines.push((name, color, std::mem::take(&mut stretch))),
                    None => {}
                }
            }
            lines.push((name, color, stretch));
        }
        // Lines that leave room for their numbers.
        let line_mm = [20.0, 50.0, 100.0].into_iter().find(|mm| high.min(MOST_MM) - low.max(-MOST_MM) <= 5.0 * mm);
        let line_mm = line_mm.unwrap_or(200.0);
        let nice = |mm: f64| ((mm.abs() / 20.0).ceil() * 20.0).min(MOST_MM) * mm.signum();
        Plot::new(name)
            .height(height)
            .default_x_bounds(span_s[0], span_s[1])
            .default_y_bounds(nice(low), nice(high))
            .reset()
            .auto_bounds(false)
            .allow_drag(false)
            .allow_zoom(false)
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_double_click_reset(false)
            .show_crosshair(false)
            .y_axis_min_width(30.0)
            .grid_spacing(Rangef::new(4.0, 40.0))
            .y_grid_spacer(uniform_grid_spacer(move |_| [line_mm / 2.0, line_mm, 10.0 * line_mm]))
            .show(ui, |plot| {
                for (name, color, points) in lines {
                    plot.line(Line::new(name, PlotPoints::Owned(points)).color(color.egui()).width(1.6));
                }
                if let Some(now_s) = now_s {
                    plot.vline(VLine::new("now", now_s).color(Color32::DARK_GRAY).width(1.0));
                }
            });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trail_forgets_what_the_plots_no_longer_show() {
        let sample = |k: u32| {
            let time_s = f64::from(k) * 0.002;
            Sample { time_s, com: Point2::origin(), dcm: Point2::origin(), zmp: None, zmp_ref: Point2::origin() }
        };
        let mut trail = Trail::from([sample(0)]);
        (1..5000).for_each(|k| trail.push(sample(k)));
        assert_eq!(trail.0.len(), (SPAN_S / 0.002) as usize + 1);
        assert!(trail.0[0].time_s >= 4999.0 * 0.002 - SPAN_S - 1e-9);
    }
}
