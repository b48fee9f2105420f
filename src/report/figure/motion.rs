//! A plot of a motion over time, as in the paper's Fig. 9 and 14: COM ("COG"), ZMP and feet, along x in the upper chart
//! and along y in the lower one (world frame).
//!
//! Behind the curves, a grey band shows how far the soles on the ground reach along the axis: when the DCM leaves the
//! band, the robot falls unless it takes a footstep. Coloured bands show the times of pushes and footsteps.

use super::axes::Axis;
use super::panel::{LegendRow, LegendSample, Panel, PanelPoint, pieces};
use nalgebra::Point2;
use standfast_core::error::Result;
use standfast_core::robot::Robot;
use standfast_sim::Push;
use standfast_sim::episode::{Snapshot, Tick};
use std::path::Path;

/// Left and right edge of the charts, and width of the picture with the legend (px).
const LEFT: f64 = 64.0;
const RIGHT: f64 = 706.0;
const WIDTH: f64 = 890.0;
/// Height of a chart, and space between the two (px).
const HEIGHT: f64 = 264.0;
const BETWEEN: f64 = 20.0;
/// Distance from feet and support beyond which a curve leaves the picture (m).
const MOST_OUTSIDE_M: f64 = 0.15;

/// A curve: name, classes, and the point of a moment that it shows (m, world frame).
type Line = (
    &'static str,
    &'static str,
    fn(&Snapshot) -> Option<Point2<f64>>,
);

/// The curves from back to front. The left foot is dashed, so that both feet are seen where their curves coincide. The
/// DCM is dashed, since many people cannot distinguish its green from the red of the ZMP.
const LINES: [Line; 6] = [
    ("right foot", "right", |s| Some(s.soles.right.xy())),
    ("left foot", "left dashed", |s| Some(s.soles.left.xy())),
    ("DCM", "dcm dashed", |s| Some(s.dcm)),
    ("ZMP", "zmp", |s| s.zmp),
    ("ZMP wanted", "wanted", |s| s.zmp_ref),
    ("COM", "com", |s| Some(s.com.xy())),
];

#[derive(Debug, Clone, Default)]
pub struct MotionPlot {
    /// The moments, in order of time.
    pub moments: Vec<Snapshot>,
    /// Start and end of each push (s).
    pub pushes: Vec<[f64; 2]>,
}

impl MotionPlot {
    /// A plot with the pushes and no moment yet.
    pub fn of_pushes(pushes: &[Push]) -> Self {
        Self {
            moments: Vec::new(),
            pushes: pushes
                .iter()
                .map(|push| [push.start_s, push.end_s()])
                .collect(),
        }
    }

    /// Adds a tick of an episode.
    pub fn push(&mut self, robot: &Robot, tick: &Tick) {
        self.moments.push(Snapshot::of(robot, tick));
    }

    /// Removes the moments after `time_s`.
    pub fn end_at(&mut self, time_s: f64) {
        // Times are rounded, so the last moment may be a little late.
        self.moments.retain(|moment| moment.time_s <= time_s + 1e-6);
    }

    /// Writes the picture to an SVG file. Fails if it cannot be written.
    pub fn write(&self, path: &Path, title: &str) -> Result<()> {
        let signed = title.replace(" -", " \u{2212}").replace("(-", "(\u{2212}");
        super::write(path, &signed, &[self.panel("")], 1)
    }

    /// The picture as a panel. Without a title it is lower.
    pub fn panel(&self, title: &str) -> Panel {
        let top = if title.is_empty() { 8.0 } else { 34.0 };
        let mut panel = Panel::new(WIDTH, top + 2.0 * HEIGHT + BETWEEN + 44.0);
        panel.text("title start", [LEFT, 20.0], [0.0, 0.0], title);
        let times = self.times();
        for (axis, (name, time)) in [("x, forward [mm]", ""), ("y, to the left [mm]", "time [s]")]
            .into_iter()
            .enumerate()
        {
            let (top, values) = (top + axis as f64 * (HEIGHT + BETWEEN), self.values(axis));
            panel.in_px(|panel| {
                panel.axes(
                    [LEFT, top, RIGHT, top + HEIGHT],
                    &Axis::new(time, times),
                    &Axis::new(name, values),
                );
                self.draw(panel, axis, times, values);
            });
        }
        panel.legend([RIGHT + 18.0, top + 14.0], &self.legend());
        panel
    }

    /// Draws bands and curves of an axis. `times` (s) and `values` (mm) are the ends of the chart.
    fn draw(&self, panel: &mut Panel, axis: usize, times: PanelPoint, values: PanelPoint) {
        for outline in self.supports(axis, values) {
            panel.polygon("band", outline);
        }
        let bands = self.swings().into_iter().map(|time| ("swing", time));
        for (class, [from, to]) in bands.chain(self.pushes.iter().map(|time| ("pushed", *time))) {
            let (from, to) = (from.max(times[0]), to.min(times[1]));
            if from < to {
                panel.rect(class, [from, values[0]], [to, values[1]]);
            }
        }
        for line in &LINES {
            panel.curve(line.1, self.points(line, axis, values));
        }
    }

    /// Ends of the time axis (s).
    fn times(&self) -> PanelPoint {
        let from = self.moments.first().map_or(0.0, |s| s.time_s);
        [
            from,
            self.moments
                .last()
                .map_or(0.0, |s| s.time_s)
                .max(from + 0.01),
        ]
    }

    /// Ends of the value axis (mm). They contain everything that is drawn within `MOST_OUTSIDE_M` of feet and support.
    fn values(&self, axis: usize) -> PanelPoint {
        let around = |values: &mut dyn Iterator<Item = f64>| {
            let finite = values.filter(|v| v.is_finite());
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            })
        };
        let (low, high) = around(&mut self.moments.iter().flat_map(|s| {
            s.support
                .iter()
                .map(|v| v[axis])
                .chain([s.soles.left[axis], s.soles.right[axis]])
                .collect::<Vec<_>>()
        }));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        let curves = LINES
            .iter()
            .flat_map(|(.., line)| self.moments.iter().filter_map(line));
        let (least, most) = around(&mut curves.map(|v| v[axis]));
        let (low, high) = (
            low.min(least.max(low - MOST_OUTSIDE_M)),
            high.max(most.min(high + MOST_OUTSIDE_M)),
        );
        let room = 0.04 * (high - low) + 0.002;
        [1e3 * (low - room), 1e3 * (high + room)]
    }

    /// Points of a curve (s, mm). The curve has a gap where there is no value, or where it leaves the picture.
    fn points(
        &self,
        (.., of): &Line,
        axis: usize,
        [low, high]: PanelPoint,
    ) -> impl Iterator<Item = Option<PanelPoint>> {
        self.moments.iter().map(move |moment| {
            let mm = 1e3 * of(moment)?[axis];
            (low..=high).contains(&mm).then_some([moment.time_s, mm])
        })
    }

    /// Outlines of the support along an axis (s, mm), one for each uninterrupted time on the ground.
    fn supports(&self, axis: usize, [least, most]: PanelPoint) -> Vec<Vec<PanelPoint>> {
        let extents = pieces(self.moments.iter().map(|moment| {
            let along = moment.support.iter().map(|v| 1e3 * v[axis]);
            let low = along.clone().reduce(f64::min)?.max(least);
            Some((moment.time_s, low, along.reduce(f64::max)?.min(most)))
        }));
        let mut outlines = Vec::new();
        for run in extents {
            let mut outline: Vec<_> = run.iter().map(|&(time, low, _)| [time, low]).collect();
            outline.extend(run.iter().rev().map(|&(time, _, high)| [time, high]));
            outlines.push(outline);
        }
        outlines
    }

    /// Start and end of each footstep (s).
    fn swings(&self) -> Vec<[f64; 2]> {
        let runs = pieces(
            self.moments
                .iter()
                .map(|moment| is_swing(moment).then_some(moment.time_s)),
        );
        runs.iter()
            .filter_map(|run| Some([*run.first()?, *run.last()?]))
            .collect()
    }

    /// The rows of the legend: the curves from front to back, then the bands.
    fn legend(&self) -> Vec<LegendRow> {
        let bands = [
            ("band", "soles on the ground", true),
            ("pushed", "push", !self.pushes.is_empty()),
            (
                "swing",
                "foot in the air",
                self.moments.iter().any(is_swing),
            ),
        ];
        let mut rows: Vec<LegendRow> = Vec::new();
        for (name, class, _) in LINES.into_iter().rev() {
            rows.push((class.into(), LegendSample::Line, name.into()));
        }
        for (class, name, is_drawn) in bands {
            if is_drawn {
                rows.push((class.into(), LegendSample::Area, name.into()));
            }
        }
        rows
    }
}

fn is_swing(moment: &Snapshot) -> bool {
    moment.in_air.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, UnitQuaternion};
    use standfast_core::geometry::SupportPolygon;
    use standfast_core::robot::{Foot, PerFoot};

    /// A footstep of the right foot to the front over one second, in flight at its middle; the COM runs away.
    fn footstep() -> MotionPlot {
        let posture = standfast_robots::load("ut-mu2").unwrap().home_posture();
        let moment = |i: u32| {
            let time_s = 0.01 * f64::from(i);
            let swing = (30..70).contains(&i);
            let right = 0.001 * f64::from(i.clamp(30, 70) - 30);
            let flies = (45..55).contains(&i);
            let support = SupportPolygon::rectangle(
                -0.05,
                0.05 + right,
                if swing { 0.02 } else { -0.08 },
                0.08,
            );
            Snapshot {
                time_s,
                posture: posture.clone(),
                com: Point3::new(0.02 * time_s, 0.01 * (4.0 * time_s).exp(), 0.3),
                dcm: Point2::new(0.05 * time_s, 0.03 * time_s),
                dcm_outside_m: 0.0,
                zmp: (!flies).then_some(Point2::new(0.04 * time_s, 0.01 * time_s)),
                zmp_ref: Some(Point2::new(0.03 * time_s, 0.02 * time_s)),
                soles: PerFoot {
                    left: Point3::new(0.0, 0.05, 0.0),
                    right: Point3::new(right, -0.05, 0.0),
                },
                support: support
                    .filter(|_| !flies)
                    .map_or(Vec::new(), |polygon| polygon.vertices().to_vec()),
                regions: Vec::new(),
                gain: None,
                margin: None,
                phase: if swing { "swing-right" } else { "posture" }.into(),
                in_air: swing.then_some(Foot::Right),
                footstep: None,
                contacts: PerFoot::default(),
                push: None,
                rope: None,
                slope: UnitQuaternion::identity(),
            }
        };
        MotionPlot {
            moments: (0..=100).map(moment).collect(),
            pushes: vec![[0.1, 0.15]],
        }
    }

    /// Writes the picture and reads it back.
    fn drawn(plot: &MotionPlot) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.svg");
        plot.write(&path, "a footstep").unwrap();
        assert_eq!(
            std::fs::read_dir(folder.path()).unwrap().count(),
            1,
            "nothing else is left"
        );
        std::fs::read_to_string(path).unwrap()
    }

    /// Number of elements of a kind and class.
    fn count(svg: &str, element: &str, class: &str) -> usize {
        svg.matches(&format!("<{element} class=\"{class}\" "))
            .count()
    }

    #[test]
    fn every_curve_and_band_is_drawn_and_named() {
        let svg = drawn(&footstep());
        assert!(
            svg.starts_with("<svg ") && svg.ends_with("</svg>\n"),
            "{svg:.100}"
        );
        let names = LINES.iter().map(|line| line.0);
        let bands = [
            "soles on the ground",
            "push",
            "foot in the air",
            "a footstep",
        ];
        for name in names
            .chain(bands)
            .chain(["time [s]", "x, forward [mm]", "y, to the left [mm]"])
        {
            assert!(
                svg.contains(&format!(">{name}</text>")),
                "{name} is missing"
            );
        }
        // Each curve is drawn once in each chart, ZMP and support in two pieces; the legend adds a line or a field.
        for (name, class, _) in LINES {
            assert_eq!(
                count(&svg, "polyline", class),
                if name == "ZMP" { 4 } else { 2 },
                "{name}"
            );
            assert_eq!(count(&svg, "line", class), 1, "{name}");
        }
        assert_eq!(
            (count(&svg, "polygon", "band"), count(&svg, "rect", "band")),
            (4, 1)
        );
        for band in ["pushed", "swing"] {
            assert_eq!(count(&svg, "rect", band), 3);
        }
    }

    #[test]
    fn a_com_that_runs_away_leaves_the_picture_readable() {
        let plot = footstep();
        let values = plot.values(1);
        assert!(
            (230.0..250.0).contains(&values[1]) && (-100.0..-80.0).contains(&values[0]),
            "{values:?}"
        );
        let com = &pieces(plot.points(&LINES[5], 1, values))[..];
        assert!(
            com.len() == 1 && com[0].len() < 85 && com[0].iter().all(|[_, mm]| *mm <= values[1])
        );
    }

    #[test]
    fn empty_plots_and_infinite_values_are_drawn_without_panic() {
        assert_eq!(count(&drawn(&MotionPlot::default()), "rect", "pushed"), 0);
        let mut plot = footstep();
        plot.moments.truncate(1);
        drawn(&plot);
        plot = footstep();
        for moment in &mut plot.moments[50..] {
            moment.com = Point3::new(f64::NAN, 1e300, 0.0);
            moment.soles.left = Point3::new(f64::INFINITY, f64::NAN, 0.0);
        }
        assert_eq!(count(&drawn(&plot), "polyline", "right"), 2);
    }
}
