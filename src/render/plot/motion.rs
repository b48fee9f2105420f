//! Picture (SVG) of a motion over time, as in the paper's Fig. 9 and 14: COM ("COG"), ZMP and feet, fore and aft above,
//! sideways below.
//!
//! Behind the curves: in grey how far the soles on the ground reach along the axis, so that a DCM on its way out of the
//! grey is a robot on its way to the ground; in colour, the time of pushes and of footsteps. World frame.

use super::{Area, COLORS, Drawn, INK, axes, beside, svg};
use crate::episode::imposed::ImposedTick;
use crate::episode::snapshot::to_world;
use crate::episode::{Tick, support_on_ground};
use crate::error::Result;
use crate::files::write_atomic;
use crate::geometry::SupportPolygon;
use crate::render::scene::palette::{self, Overlay};
use crate::robot::{PerFoot, Robot};
use crate::sim::Push;
use plotters::prelude::*;
use std::ops::Range;
use std::path::Path;

/// Width and height (px).
pub const SIZE: (u32, u32) = (900, 640);
/// Units to the pixel, see [`svg`].
pub const PX: i32 = 10;
/// To the right of the panels (px).
const LEGEND_WIDTH: i32 = 190;
/// Below the lower panel, for the labels of the time (px).
const AXIS_HEIGHT: i32 = 44;
/// A curve that goes farther than this from feet and support leaves the picture (m).
const MOST_OUTSIDE_M: f64 = 0.15;

const SUPPORT: RGBAColor = faint(INK, 0.1);
const PUSH: RGBAColor = of(Overlay::Push, 0.3);
const SWING: RGBAColor = of(Overlay::Footstep, 0.2);

/// A curve: what it shows, and how.
struct Line {
    name: &'static str,
    of: fn(&MotionSample) -> Option<[f64; 2]>,
    color: RGBAColor,
    /// In tenths of a pixel.
    width: u32,
    /// Length of dashes and of what is between them (px).
    dash: Option<(i32, i32)>,
}

/// From back to front. Both feet are seen where one curve lies on the other; the DCM is dashed, because its green and the
/// red of the ZMP look alike to many.
const LINES: [Line; 6] = [
    Line { name: "right foot", of: |s| Some(s.feet.right), color: faint(COLORS[3], 1.0), width: 20, dash: None },
    Line { name: "left foot", of: |s| Some(s.feet.left), color: faint(INK, 1.0), width: 20, dash: Some((7, 7)) },
    Line { name: "DCM", of: |s| Some(s.dcm), color: of(Overlay::Dcm, 1.0), width: 14, dash: Some((10, 3)) },
    Line { name: "ZMP", of: |s| s.zmp, color: of(Overlay::Zmp, 1.0), width: 14, dash: None },
    Line {
        name: "ZMP wanted",
        of: |s| Some(s.zmp_ref),
        color: of(Overlay::ZmpRef, 1.0),
        width: 13,
        dash: Some((4, 3)),
    },
    Line { name: "COM", of: |s| Some(s.com), color: of(Overlay::Com, 1.0), width: 22, dash: None },
];

impl Line {
    fn style(&self) -> ShapeStyle {
        self.color.stroke_width(self.width * PX as u32 / 10)
    }
}

const fn faint(RGBColor(r, g, b): RGBColor, opacity: f64) -> RGBAColor {
    RGBAColor(r, g, b, opacity)
}

/// The colour that views and replays have, too.
const fn of(overlay: Overlay, opacity: f64) -> RGBAColor {
    let palette::Color(r, g, b) = overlay.color();
    RGBAColor(r, g, b, opacity)
}

/// Pixels in the units of the drawing.
const fn px(pixels: i32) -> i32 {
    pixels * PX
}

/// One moment of a motion, from an episode or from a calculation. World frame (m).
#[derive(Debug, Clone)]
pub struct MotionSample {
    pub time_s: f64,
    /// COM over the ground.
    pub com: [f64; 2],
    /// None in flight.
    pub zmp: Option<[f64; 2]>,
    /// The ZMP that the controller wants.
    pub zmp_ref: [f64; 2],
    pub dcm: [f64; 2],
    /// Centre of each sole, on the ground or not.
    pub feet: PerFoot<[f64; 2]>,
    /// Hull of the soles on the ground; None in flight.
    pub support: Option<SupportPolygon>,
    /// A footstep is in the air.
    pub swing: bool,
}

impl MotionSample {
    /// The truth of a tick, and the ZMP that the controller wants, moved to where the robot is.
    pub fn of(robot: &Robot, tick: &Tick) -> Self {
        let truth = tick.truth;
        Self {
            time_s: truth.time_s,
            com: truth.com.xy().into(),
            zmp: truth.zmp,
            zmp_ref: (to_world(tick) * tick.account.zmp_ref).into(),
            dcm: tick.dcm.into(),
            feet: PerFoot::from_fn(|foot| truth.soles[foot].translation.vector.xy().into()),
            support: support_on_ground(robot, truth),
            swing: !tick.account.stands(),
        }
    }

    /// The ideal pendulum of an imposed error; its ZMP is the one wanted.
    pub fn of_imposed(tick: &ImposedTick) -> Self {
        let zmp = tick.zmp.into();
        Self {
            time_s: tick.time_s,
            com: tick.com.into(),
            zmp: Some(zmp),
            zmp_ref: zmp,
            dcm: tick.dcm.into(),
            feet: PerFoot::from_fn(|foot| tick.soles[foot].translation.vector.xy().into()),
            support: tick.support,
            swing: !tick.account.stands(),
        }
    }
}

/// A motion to draw.
#[derive(Debug, Clone, Default)]
pub struct MotionPlot {
    /// At rising times.
    pub samples: Vec<MotionSample>,
    /// Start and end of each push (s).
    pub pushes: Vec<[f64; 2]>,
}

impl MotionPlot {
    /// Nothing yet but the pushes.
    pub fn of_pushes(pushes: &[Push]) -> Self {
        Self { samples: Vec::new(), pushes: pushes.iter().map(|push| [push.start_s, push.end_s()]).collect() }
    }

    /// Adds a tick of an episode.
    pub fn push(&mut self, robot: &Robot, tick: &Tick) {
        self.samples.push(MotionSample::of(robot, tick));
    }

    /// Forgets what comes after `time_s`.
    pub fn end_at(&mut self, time_s: f64) {
        // A little more for the rounding of times.
        self.samples.retain(|sample| sample.time_s <= time_s + 1e-6);
    }

    /// Writes the picture. Errors: the file cannot be written.
    pub fn write(&self, path: &Path, title: &str) -> Result<()> {
        write_atomic(path, self.svg(title)?.as_bytes())
    }

    /// The picture as text: `SIZE` in px, `PX` units to each. Errors: it cannot be drawn.
    pub fn svg(&self, title: &str) -> Result<String> {
        svg(SIZE, PX as u32, |area| self.draw(area, title))
    }

    fn draw(&self, area: &Area, title: &str) -> Drawn {
        area.fill(&WHITE)?;
        area.draw(&Text::new(title.to_string(), (px(20), px(22)), beside(px(17), 1.0)))?;
        let (_, panels) = area.split_vertically(px(40));
        let (above, below) = panels.split_vertically(px((SIZE.1 as i32 - 40 - AXIS_HEIGHT) / 2));
        self.panel(&above, 0, "x, forward [mm]")?;
        self.panel(&below, 1, "y, to the left [mm]")?;
        self.legend(area)
    }

    /// One axis over time; the time's labels are below the last.
    fn panel(&self, area: &Area, axis: usize, name: &str) -> Drawn {
        let last = axis == 1;
        let (times, values) = (self.times(), self.values(axis));
        let mut chart = ChartBuilder::on(area)
            .margin(px(8))
            .margin_right(px(LEGEND_WIDTH))
            .x_label_area_size(px(if last { AXIS_HEIGHT } else { 0 }))
            .y_label_area_size(px(64))
            .build_cartesian_2d(times.clone(), values.clone())?;
        let band = |[from, to]: [f64; 2], color: RGBAColor| {
            let (from, to) = (from.max(times.start), to.min(times.end));
            Rectangle::new([(from, values.start), (to, values.end)], color.filled())
        };
        for outline in self.supports(axis, &values) {
            chart.draw_series([Polygon::new(outline, SUPPORT)])?;
        }
        let in_sight = |[from, to]: &[f64; 2]| *from < times.end && *to > times.start;
        chart.draw_series(self.swings().into_iter().filter(in_sight).map(|time| band(time, SWING)))?;
        chart.draw_series(self.pushes.iter().copied().filter(in_sight).map(|time| band(time, PUSH)))?;
        let mut mesh = chart.configure_mesh();
        axes(&mut mesh, PX);
        mesh.bold_line_style(INK.mix(0.13).stroke_width(PX as u32)) // Over the bands: they show through.
            .x_labels(12)
            .y_labels(9)
            .set_all_tick_mark_size(px(5))
            .x_desc(if last { "time [s]" } else { "" })
            .y_desc(name)
            .x_label_formatter(&|s| format!("{}", (s * 1e3).round() / 1e3))
            .y_label_formatter(&|mm| format!("{mm:.0}"))
            .draw()?;
        for line in &LINES {
            for run in self.runs(line, axis, &values) {
                match line.dash {
                    Some((on, off)) => {
                        chart.draw_series(DashedLineSeries::new(run, px(on), px(off), line.style()))?;
                    }
                    None => _ = chart.draw_series(LineSeries::new(run, line.style()))?,
                }
            }
        }
        Ok(())
    }

    /// Of the time axis (s).
    fn times(&self) -> Range<f64> {
        let from = self.samples.first().map_or(0.0, |s| s.time_s);
        from..self.samples.last().map_or(0.0, |s| s.time_s).max(from + 0.01)
    }

    /// Of an axis (mm): all that is drawn, but no farther than `MOST_OUTSIDE_M` from feet and support.
    fn values(&self, axis: usize) -> Range<f64> {
        let around = |values: &mut dyn Iterator<Item = f64>| {
            let finite = values.filter(|v| v.is_finite());
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        };
        let (low, high) = around(&mut self.samples.iter().flat_map(|s| {
            let support = s.support.iter().flat_map(|polygon| polygon.vertices()).map(|v| v[axis]);
            support.chain([s.feet.left[axis], s.feet.right[axis]]).collect::<Vec<_>>()
        }));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        let curves = LINES.iter().flat_map(|line| self.samples.iter().filter_map(|s| (line.of)(s)));
        let (least, most) = around(&mut curves.map(|v| v[axis]));
        let (low, high) = (low.min(least.max(low - MOST_OUTSIDE_M)), high.max(most.min(high + MOST_OUTSIDE_M)));
        let room = 0.04 * (high - low) + 0.002;
        1e3 * (low - room)..1e3 * (high + room)
    }

    /// A curve in pieces (s, mm): it has a gap where there is no value, or where it leaves the picture.
    fn runs(&self, line: &Line, axis: usize, values: &Range<f64>) -> Vec<Vec<(f64, f64)>> {
        pieces(self.samples.iter().map(|sample| {
            let mm = 1e3 * (line.of)(sample)?[axis];
            values.contains(&mm).then_some((sample.time_s, mm))
        }))
    }

    /// Outlines of the support along an axis (s, mm), one for each time on the ground.
    fn supports(&self, axis: usize, values: &Range<f64>) -> Vec<Vec<(f64, f64)>> {
        let extents = pieces(self.samples.iter().map(|sample| {
            let along = sample.support.as_ref()?.vertices().iter().map(|v| 1e3 * v[axis]);
            let low = along.clone().fold(f64::INFINITY, f64::min).max(values.start);
            Some((sample.time_s, low, along.fold(f64::NEG_INFINITY, f64::max).min(values.end)))
        }));
        let outline = |run: Vec<(f64, f64, f64)>| {
            let low = run.iter().map(|&(time, low, _)| (time, low));
            low.chain(run.iter().rev().map(|&(time, _, high)| (time, high))).collect()
        };
        extents.into_iter().map(outline).collect()
    }

    /// Start and end of each footstep (s).
    fn swings(&self) -> Vec<[f64; 2]> {
        let runs = pieces(self.samples.iter().map(|sample| sample.swing.then_some(sample.time_s)));
        runs.iter().filter_map(|run| Some([*run.first()?, *run.last()?])).collect()
    }

    /// To the right of the panels.
    fn legend(&self, area: &Area) -> Drawn {
        let left = px(SIZE.0 as i32 - LEGEND_WIDTH + 18);
        // Half a pixel: thin lines are sharp there.
        let row = |i: usize| px(64 + 27 * i as i32) + PX / 2;
        let (swatch, words) = (px(26), left + px(34));
        let style = beside(px(14), 1.0);
        // What is in front comes first, but for the feet.
        let mut next = 0;
        for line in LINES.iter().rev() {
            let ends = [(left, row(next)), (left + swatch, row(next))];
            match line.dash {
                Some((on, off)) => {
                    area.draw(&plotters::element::DashedPathElement::new(ends, px(on), px(off), line.style()))?
                }
                None => area.draw(&PathElement::new(ends, line.style()))?,
            }
            area.draw(&Text::new(line.name, (words, row(next)), style.clone()))?;
            next += 1;
        }
        let bands = [
            ("soles on the ground", SUPPORT, true),
            ("push", PUSH, !self.pushes.is_empty()),
            ("footstep in the air", SWING, self.samples.iter().any(|s| s.swing)),
        ];
        for (name, color, _) in bands.into_iter().filter(|(_, _, shown)| *shown) {
            let y = row(next);
            area.draw(&Rectangle::new([(left, y - px(7)), (left + swatch, y + px(7))], color.filled()))?;
            area.draw(&Text::new(name, (words, y), style.clone()))?;
            next += 1;
        }
        Ok(())
    }
}

/// The stretches of values between those that are absent.
fn pieces<T>(values: impl Iterator<Item = Option<T>>) -> Vec<Vec<T>> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A footstep of the right foot to the front over one second, in flight at its middle; the COM runs away.
    fn footstep() -> MotionPlot {
        let sample = |i: u32| {
            let time_s = 0.01 * f64::from(i);
            let swing = (30..70).contains(&i);
            let right = 0.001 * f64::from(i.clamp(30, 70) - 30);
            let flies = (45..55).contains(&i);
            MotionSample {
                time_s,
                com: [0.02 * time_s, 0.01 * (4.0 * time_s).exp()],
                zmp: (!flies).then_some([0.04 * time_s, 0.01 * time_s]),
                zmp_ref: [0.03 * time_s, 0.02 * time_s],
                dcm: [0.05 * time_s, 0.03 * time_s],
                feet: PerFoot { left: [0.0, 0.05], right: [right, -0.05] },
                support: SupportPolygon::rectangle(-0.05, 0.05 + right, if swing { 0.02 } else { -0.08 }, 0.08)
                    .filter(|_| !flies),
                swing,
            }
        };
        MotionPlot { samples: (0..=100).map(sample).collect(), pushes: vec![[0.1, 0.15]] }
    }

    /// The picture, with each element on a line of its own.
    fn drawn(plot: &MotionPlot) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.svg");
        plot.write(&path, "a footstep").unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left");
        std::fs::read_to_string(path).unwrap()
    }

    /// Count of elements of a kind in a colour.
    fn count(svg: &str, element: &str, RGBAColor(r, g, b, _): RGBAColor) -> usize {
        let color = format!("\"#{r:02X}{g:02X}{b:02X}\"");
        svg.lines().filter(|line| line.starts_with(&format!("<{element} ")) && line.contains(&color)).count()
    }

    fn color_of(name: &str) -> RGBAColor {
        LINES.iter().find(|line| line.name == name).unwrap().color
    }

    #[test]
    fn every_curve_and_band_is_drawn_and_named() {
        let svg = drawn(&footstep());
        assert!(svg.starts_with("<svg width=\"900\" height=\"640\" viewBox=\"0 0 9000 6400\""), "{svg:.100}");
        assert!(svg.ends_with("</svg>\n"));
        let names = LINES.iter().map(|line| line.name);
        let bands = ["soles on the ground", "push", "footstep in the air", "a footstep"];
        for name in names.chain(bands).chain(["time [s]", "x, forward [mm]", "y, to the left [mm]"]) {
            assert!(svg.lines().any(|line| line == name), "{name} is missing");
        }
        // A whole curve in each panel and one in the legend; the ZMP and the support have a gap in each panel.
        for (name, curves) in [("COM", 3), ("right foot", 3), ("ZMP", 5)] {
            assert_eq!(count(&svg, "polyline", color_of(name)), curves, "{name}");
        }
        for name in ["left foot", "ZMP wanted", "DCM"] {
            assert!(count(&svg, "polyline", color_of(name)) > 20, "{name} is dashed");
        }
        assert_eq!(count(&svg, "polygon", SUPPORT), 4);
        for band in [PUSH, SWING] {
            assert_eq!(count(&svg, "rect", band), 3);
        }
    }

    #[test]
    fn without_pushes_and_footsteps_the_legend_has_none() {
        let mut plot = footstep();
        plot.end_at(0.2);
        assert_eq!(plot.samples.len(), 21);
        plot.pushes = vec![[0.5, 0.6]];
        let svg = drawn(&plot);
        assert!(!svg.contains("footstep in the air") && count(&svg, "rect", SWING) == 0);
        assert_eq!(count(&svg, "rect", PUSH), 1, "a push after the end is in the legend only");
        plot.pushes.clear();
        assert_eq!(count(&drawn(&plot), "rect", PUSH), 0);
    }

    #[test]
    fn a_com_that_runs_away_leaves_the_picture_readable() {
        let plot = footstep();
        let values = plot.values(1);
        assert!((230.0..250.0).contains(&values.end) && (-100.0..-80.0).contains(&values.start), "{values:?}");
        let com = &plot.runs(&LINES[5], 1, &values)[..];
        assert!(com.len() == 1 && com[0].len() < 85 && com[0].iter().all(|(_, mm)| values.contains(mm)));
    }

    #[test]
    fn nothing_to_draw_and_numbers_that_are_none_are_drawn_too() {
        drawn(&MotionPlot::default());
        let mut plot = footstep();
        plot.samples.truncate(1);
        drawn(&plot);
        plot = footstep();
        for sample in &mut plot.samples[50..] {
            sample.com = [f64::NAN, 1e300];
            sample.feet.left = [f64::INFINITY, f64::NAN];
        }
        assert_eq!(count(&drawn(&plot), "polyline", color_of("right foot")), 3);
    }

    #[test]
    fn a_file_that_cannot_be_written_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let error = footstep().write(folder.path(), "a folder").unwrap_err();
        assert!(matches!(error, crate::Error::Write { .. }), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
