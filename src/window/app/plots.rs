//! Plots of COM, ZMP and DCM over time, one for each axis.

use super::colors;
use super::colors::OnScreen as _;
use egui_plot::{AxisHints, Line, LineStyle, Plot, PlotPoint, PlotPoints, uniform_grid_spacer};
use kiss3d::egui::{Rangef, Ui};
use nalgebra::Point2;
use standfast_scene::palette::{GHOST, Overlay};
use standfast_sim::episode::Snapshot;
use std::collections::VecDeque;

/// Length of time that the plots show (s).
const SPAN_S: f64 = 4.0;
/// Number of buckets of a curve, which suffices for the width of a plot. Each bucket keeps its smallest and its largest
/// value.
const BUCKETS: usize = 150;

/// The values of one tick that are plotted (m, world frame).
#[derive(Debug, Clone, Copy)]
pub struct Plotted {
    pub time_s: f64,
    pub com: Point2<f64>,
    pub dcm: Point2<f64>,
    /// None in flight.
    pub zmp: Option<Point2<f64>>,
    /// None if the controller does not report it.
    pub zmp_ref: Option<Point2<f64>>,
}

impl Plotted {
    pub fn of(snapshot: &Snapshot) -> Self {
        let Snapshot {
            time_s,
            com,
            dcm,
            zmp,
            zmp_ref,
            ..
        } = snapshot;
        Self {
            time_s: *time_s,
            com: com.xy(),
            dcm: *dcm,
            zmp: *zmp,
            zmp_ref: *zmp_ref,
        }
    }
}

/// The samples in order of time, one for each tick.
#[derive(Debug, Default)]
pub struct Trail {
    samples: VecDeque<Plotted>,
    /// Number of samples that were removed at the front.
    gone: usize,
}

impl Trail {
    /// The path of a point over the ground.
    pub fn path(&self, of: fn(&Plotted) -> Point2<f64>) -> impl Iterator<Item = Point2<f64>> {
        self.samples.iter().map(of)
    }

    /// Adds a sample, and removes samples that are too old for the plots.
    pub fn push(&mut self, sample: Plotted) {
        while self
            .samples
            .front()
            .is_some_and(|first| first.time_s < sample.time_s - SPAN_S)
        {
            self.samples.pop_front();
            self.gone += 1;
        }
        self.samples.push_back(sample);
    }
}

impl FromIterator<Plotted> for Trail {
    fn from_iter<T: IntoIterator<Item = Plotted>>(samples: T) -> Self {
        Self {
            samples: samples.into_iter().collect(),
            gone: 0,
        }
    }
}

/// The value of a curve at a tick.
type PlottedAt = fn(&Plotted) -> Option<Point2<f64>>;

/// The curves, from back to front.
const CURVES: [(Overlay, PlottedAt); 4] = [
    (Overlay::ZmpRef, |s| s.zmp_ref),
    (Overlay::Zmp, |s| s.zmp),
    (Overlay::Dcm, |s| Some(s.dcm)),
    (Overlay::Com, |s| Some(s.com)),
];

/// Least distance from the COM to the ends of a plot, for a robot of the size of UT-mu2 (mm), so that the noise of
/// standing does not fill the plot.
const LEAST_MM: f64 = 40.0;
/// Largest distance from the COM to the ends of a plot (mm), since the DCM runs away after a fall.
const MOST_MM: f64 = 300.0;
/// Height of the numbers below a plot, and height of a number beside it with the space to the next one (points).
const TIMES: f32 = 20.0;
const NUMBER: f32 = 18.0;
/// Length of which the ends of plots are multiples (mm).
const ROUND_MM: f64 = 20.0;

/// Draws both plots until the time `now_s`, each `height` points high, for a robot of this length (as a multiple of
/// UT-mu2's). For a ghost, only the COM is drawn.
pub fn draw(
    ui: &mut Ui,
    trail: &Trail,
    ghost: Option<&Trail>,
    length: f64,
    now_s: f64,
    height: f32,
) {
    let end_s = now_s.max(SPAN_S);
    for (axis, name) in ["x, forward (mm)", "y, to the left (mm)"]
        .into_iter()
        .enumerate()
    {
        ui.label(name);
        let [low, high] = bounds(trail, length, axis);
        let line_mm = line_mm(high - low, height);
        Plot::new(name)
            .height(height)
            .default_x_bounds(end_s - SPAN_S, end_s)
            .default_y_bounds(low, high)
            .reset()
            .auto_bounds(false)
            .allow_drag(false)
            .allow_zoom(false)
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_double_click_reset(false)
            .show_crosshair(false)
            // All lines of the grid look alike and are lighter than any curve, and all numbers look alike.
            .grid_spacing(Rangef::new(4.0, 5.0))
            .grid_color(colors::GRID.faint(0.6))
            .grid_fade(0.0)
            .custom_x_axes(vec![
                AxisHints::new_x()
                    .label_spacing(Rangef::new(30.0, 31.0))
                    .formatter(|mark, _| format!("{}", (10.0 * mark.value).round() / 10.0)),
            ])
            .custom_y_axes(vec![
                AxisHints::new_y()
                    .label_spacing(Rangef::new(NUMBER - 1.0, NUMBER))
                    .min_thickness(30.0),
            ])
            .x_grid_spacer(uniform_grid_spacer(|_| [0.5, 1.0, 5.0]))
            .y_grid_spacer(uniform_grid_spacer(move |_| {
                [line_mm / 2.0, line_mm, 10.0 * line_mm]
            }))
            .show(ui, |plot| {
                for (overlay, of) in CURVES {
                    for points in thinned(trail, axis, of) {
                        // Many people cannot distinguish the green of the DCM from the red of the ZMP.
                        let dashed = LineStyle::Dashed { length: 5.0 };
                        let style = if overlay == Overlay::Dcm {
                            dashed
                        } else {
                            LineStyle::Solid
                        };
                        let line = Line::new(overlay.look().name, PlotPoints::Owned(points));
                        plot.line(line.color(overlay.color().egui()).width(1.6).style(style));
                    }
                }
                for points in
                    ghost.map_or_else(Vec::new, |ghost| thinned(ghost, axis, |s| Some(s.com)))
                {
                    let line = Line::new("COM of the ghost", PlotPoints::Owned(points));
                    plot.line(line.color(GHOST.color.egui()).width(1.6));
                }
            });
    }
}

/// Distance between the lines of a plot (mm) at which their numbers have room, for the range and height of the plot.
fn line_mm(range_mm: f64, height: f32) -> f64 {
    let points_per_mm = f64::from(height - TIMES) / range_mm;
    let steps = [10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
    steps
        .into_iter()
        .find(|mm| mm * points_per_mm > f64::from(NUMBER))
        .unwrap_or(1000.0)
}

/// Ends of the plot of an axis (mm) for a robot of this length. They follow the COM.
fn bounds(trail: &Trail, length: f64, axis: usize) -> [f64; 2] {
    let [least_mm, most_mm] =
        [LEAST_MM, MOST_MM].map(|mm| (mm * length / ROUND_MM).round() * ROUND_MM);
    let extent = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], mm| {
            [low.min(mm), high.max(mm)]
        })
    };
    let com = extent(&mut trail.samples.iter().map(|sample| 1000.0 * sample.com[axis]));
    let points = trail
        .samples
        .iter()
        .flat_map(|sample| CURVES.iter().filter_map(move |(_, of)| of(sample)));
    let all = extent(&mut points.map(|point| 1000.0 * point[axis]));
    let [least, greatest] = com.map(|mm| (mm / ROUND_MM).round() * ROUND_MM);
    let low = (all[0] / ROUND_MM).floor() * ROUND_MM;
    let high = (all[1] / ROUND_MM).ceil() * ROUND_MM;
    [
        low.clamp(least - most_mm, least - least_mm),
        high.clamp(greatest + least_mm, greatest + most_mm),
    ]
}

/// The uninterrupted runs of a curve (s, mm). Each bucket of ticks keeps its smallest and its largest value, in order
/// of time. A tick belongs to a bucket by its number and not by its place in the trail, so that a curve keeps its shape
/// while it scrolls.
fn thinned(trail: &Trail, axis: usize, of: PlottedAt) -> Vec<Vec<PlotPoint>> {
    let size = trail.samples.len().div_ceil(BUCKETS).max(1);
    let mut numbered = Vec::with_capacity(trail.samples.len());
    for (i, sample) in trail.samples.iter().enumerate() {
        let point = of(sample).map(|at| PlotPoint::new(sample.time_s, 1000.0 * at[axis]));
        numbered.push(((trail.gone + i) / size, point));
    }
    let stretches = numbered.chunk_by(|(_, a), (_, b)| a.is_some() == b.is_some());
    let thinned = stretches.map(|stretch| {
        let buckets = stretch.chunk_by(|(a, _), (b, _)| a == b);
        buckets.flat_map(extremes).collect::<Vec<_>>()
    });
    thinned.filter(|stretch| !stretch.is_empty()).collect()
}

/// The points of a bucket with the smallest and the largest value, in order of time. The two may be the same point. An
/// empty bucket has none.
fn extremes(bucket: &[(usize, Option<PlotPoint>)]) -> Vec<PlotPoint> {
    let by_value = |a: &&PlotPoint, b: &&PlotPoint| a.y.total_cmp(&b.y);
    let points = || bucket.iter().filter_map(|(_, point)| point.as_ref());
    let mut ends: Vec<_> = points()
        .min_by(by_value)
        .into_iter()
        .chain(points().max_by(by_value))
        .copied()
        .collect();
    ends.sort_by(|a, b| a.x.total_cmp(&b.x));
    ends.dedup();
    ends
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(k: u32) -> Plotted {
        let time_s = f64::from(k) * 0.002;
        Plotted {
            time_s,
            com: Point2::origin(),
            dcm: Point2::origin(),
            zmp: None,
            zmp_ref: None,
        }
    }

    #[test]
    fn a_trail_removes_samples_that_the_plots_no_longer_show() {
        let mut trail: Trail = std::iter::once(sample(0)).collect();
        for k in 1..5000 {
            trail.push(sample(k));
        }
        assert_eq!(trail.samples.len(), (SPAN_S / 0.002) as usize + 1);
        assert_eq!(trail.samples.len() + trail.gone, 5000);
        assert!(trail.samples[0].time_s >= 4999.0 * 0.002 - SPAN_S - 1e-9);
    }

    #[test]
    fn no_peak_is_lost() {
        for peak in 2000..2040 {
            let mut samples: Vec<_> = (0..6000).map(sample).collect();
            samples[peak].dcm.x = 0.1;
            samples[peak + 1].dcm.x = -0.1;
            let trail: Trail = samples.into_iter().collect();
            let [points] = &thinned(&trail, 0, |s| Some(s.dcm))[..] else {
                panic!("one stretch")
            };
            assert!(points.len() <= 2 * BUCKETS, "{}", points.len());
            assert!(points.windows(2).all(|pair| pair[0].x < pair[1].x));
            for mm in [100.0, -100.0] {
                assert!(
                    points.iter().any(|point| (point.y - mm).abs() < 1e-9),
                    "{mm} mm at tick {peak}"
                );
            }
        }
    }

    #[test]
    fn a_curve_ends_where_there_is_no_point() {
        let samples = (0..1000).map(|k| Plotted {
            zmp: (!(300..400).contains(&k)).then(Point2::origin),
            ..sample(k)
        });
        let trail: Trail = samples.collect();
        let stretches = thinned(&trail, 1, |s| s.zmp);
        let ends = |stretch: &Vec<PlotPoint>| [stretch[0].x, stretch[stretch.len() - 1].x];
        assert_eq!(stretches.len(), 2);
        assert!(ends(&stretches[0])[1] < 0.6 && ends(&stretches[1])[0] >= 0.8);
    }

    #[test]
    fn the_plots_follow_the_com() {
        let of = |length: f64, com: f64, dcm: f64| {
            let (com, dcm) = (Point2::new(com, 0.0), Point2::new(dcm, 0.0));
            bounds(
                &std::iter::once(Plotted {
                    com,
                    dcm,
                    zmp_ref: Some(com),
                    ..sample(0)
                })
                .collect(),
                length,
                0,
            )
        };
        let at = |com: f64, dcm: f64| of(0.999, com, dcm);
        assert_eq!(at(0.0, 0.0), [-40.0, 40.0]);
        assert_eq!(at(0.5, 0.555), [460.0, 560.0]);
        assert_eq!(at(-0.5, 7.0), [-540.0, -200.0]);
        assert_eq!(of(3.0, -0.5, 7.0), [-620.0, 400.0]);
    }
}
