//! Over time: Fig. 5, the phases of the two pushed runs; Fig. 9 and 14, COM ("COG"), ZMP and feet.

use super::super::html::svg::short;
use super::panel::{Axes, Panel};
use super::study::{ImposedRun, Pushed, Study};
use crate::control::Phase;
use crate::episode::Snapshot;
use crate::error::Result;
use crate::render::plot::motion::{self as motion_plot, MotionPlot};
use crate::render::text::story;
use serde_json::Value;

/// Of Fig. 5 (px).
const WIDTH: f64 = 460.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = WIDTH - 10.0;
/// Seen before the push and after the robot stands still (s).
const BEFORE_S: f64 = 0.08;
const STILL_S: f64 = 0.06;
/// Shown in Fig. 9 and 14 after the COM is home (s).
const AFTER_S: f64 = 0.4;

/// The events of a run by their names among the numbers of Fig. 5.
const EVENTS: [(&str, &str); 7] = [
    ("push_s", "push"),
    ("left_sets_s", "no set holds the state"),
    ("lift_s", "foot lifted"),
    ("landing_s", "foot landed, sets updated"),
    ("held_after_landing_s", "a set holds the state"),
    ("fastest_gain_from_s", "fastest gain, to the end"),
    ("still_from_s", "stands still"),
];

/// Fig. 5, from its numbers, too.
pub fn sequence(study: &Study, numbers: &Value) -> Vec<Panel> {
    let [a, b] = &study.pushes;
    vec![
        phases(a, &numbers["push_behind"], "(a) from behind"),
        phases(b, &numbers["push_diagonal"], "(b) from diagonally forward left"),
    ]
}

fn phases(pushed: &Pushed, told: &Value, title: &str) -> Panel {
    // A state that is held from the landing on is no event of its own.
    let happens = |name: &str| name != "held_after_landing_s" || told["landed_inside"] == false;
    let events: Vec<(f64, &str)> = EVENTS
        .iter()
        .filter(|(name, _)| happens(name))
        .filter_map(|(name, what)| Some((told[name].as_f64()?, *what)))
        .collect();
    let (from, to) = (pushed.push.start_s - BEFORE_S, pushed.end_s() + STILL_S);
    let seen: Vec<&Snapshot> = pushed.film.snapshots.iter().filter(|s| (from..=to).contains(&s.time_s)).collect();
    let mut panel = Panel::new(WIDTH, 414.0 + 17.0 * events.len() as f64);
    panel.text("title start", [LEFT, 20.0], title);
    let keys = [("switching", "switching"), ("out", "no set holds"), ("swing", "foot in the air"), ("pushed", "push")];
    for ((class, words), x) in keys.into_iter().zip([LEFT, 154.0, 264.0, 384.0]) {
        panel.rect(class, [x, 30.0], [x + 14.0, 42.0]);
        panel.text("start small", [x + 19.0, 41.0], words);
    }
    let lane = |top: f64, bottom: f64, y: [f64; 2]| Axes { x: [from, to], y, frame: [LEFT, top, RIGHT, bottom] };
    let phases = lane(64.0, 92.0, [0.0, 1.0]);
    panel.text("name end", [LEFT - 6.0, 82.0], "phase");
    for run in seen.chunk_by(|a, b| a.phase == b.phase) {
        let (start, end) = (run[0].time_s, run[run.len() - 1].time_s + pushed.film.control_period_s);
        let class = match run[0].phase {
            Phase::Posture => "band",
            Phase::Switching => "switching",
            Phase::OutOfSets => "out",
            Phase::Swing(_) => "swing",
        };
        panel.rect(class, phases.at([start, 0.0]), phases.at([end.min(to), 1.0]));
    }
    let gains = lane(104.0, 226.0, [-0.6, pushed.film.gains.len() as f64 - 0.4]);
    for (i, name) in pushed.film.gains.iter().enumerate() {
        let [x, y] = gains.at([from, i as f64]);
        panel.line("grid", [x, y], gains.at([to, i as f64]));
        panel.text("tick end", [x - 6.0, y + 4.0], name);
    }
    panel.text_up("name", [16.0, 165.0], "gain");
    curve(&mut panel, &gains, "slice", &seen, |s| s.gain.map(|gain| gain as f64));
    let margins = lane(238.0, 350.0, [-1.0, 1.1]);
    margins.draw(&mut panel, "time [s]", "margin of the set");
    panel.line("axis", margins.at([from, 0.0]), margins.at([to, 0.0]));
    curve(&mut panel, &margins, "zmp", &seen, |s| s.margin.map(|margin| margin.max(-1.0)));
    for Axes { frame: [_, top, _, bottom], .. } in [phases, gains, margins] {
        let [start, end] = [pushed.push.start_s, pushed.push.end_s()].map(|t| phases.at([t, 0.0])[0]);
        panel.rect("pushed", [start, top], [end, bottom]);
    }
    let mut label = f64::NEG_INFINITY;
    for (i, (at, what)) in events.iter().enumerate() {
        let [x, _] = phases.at([*at, 0.0]);
        panel.line("axis thin", [x, 60.0], [x, 350.0]);
        // Numbers of events that are close stand side by side.
        label = x.max(label + 11.0);
        panel.text("small", [label, 57.0], &(i + 1).to_string());
        let row = 410.0 + 17.0 * i as f64;
        panel.text("small start", [LEFT, row], &format!("{}:  t = {at:.3} s  {what}", i + 1));
    }
    panel
}

/// A curve in pieces, with gaps where there is no value.
fn curve(panel: &mut Panel, axes: &Axes, class: &str, seen: &[&Snapshot], of: impl Fn(&Snapshot) -> Option<f64>) {
    for run in seen.chunk_by(|a, b| of(a).is_some() == of(b).is_some()) {
        let points = run.iter().filter_map(|s| Some([s.time_s, of(s)?]));
        panel.polyline(class, &axes.all(points));
    }
}

/// Fig. 9.
pub fn imposed(study: &Study) -> Result<Vec<Panel>> {
    let panel = |(run, name): (&ImposedRun, &str)| {
        let [x, y] = run.record.zmp_error_m.map(|m| short(1e3 * m, 1));
        let title = format!("{name}  ZMP error ({x}, {y}) mm imposed at t = 0");
        motion(&run.motion, &title, run.record.home_at_s.unwrap_or(1.0) + AFTER_S)
    };
    study.errors.iter().zip(["(a)", "(b)"]).map(panel).collect()
}

/// Fig. 14.
pub fn pushed(study: &Study) -> Result<Vec<Panel>> {
    let panel = |(pushed, name): (&Pushed, &str)| {
        let record = &pushed.film.record;
        let title = story::headline(&[pushed.push], &study.design.family.name, record).replace(" -", " \u{2212}");
        let end_s = record.settled_at_s.map_or(record.end_s, |at| at.max(record.home_at_s.unwrap_or(at)) + AFTER_S);
        motion(&pushed.motion, &format!("{name}  {title}"), end_s)
    };
    study.pushes.iter().zip(["(a)", "(b)"]).map(panel).collect()
}

/// A motion until `end_s`.
fn motion(motion: &MotionPlot, title: &str, end_s: f64) -> Result<Panel> {
    let mut motion = motion.clone();
    motion.end_at(end_s);
    let (svg, (width, height)) = (motion.svg(title)?, motion_plot::SIZE);
    // Its own tag gives way to that of a panel.
    let inside =
        svg.split_once(">\n").and_then(|(_, rest)| rest.rsplit_once("</svg>")).map_or("", |(inside, _)| inside);
    // Labels of axes have the sign of the other figures: in the text of a plot a number has a line of its own.
    let signed = |line: &str| match line.strip_prefix('-') {
        Some(digits) if digits.parse::<f64>().is_ok() => format!("\u{2212}{digits}\n"),
        _ => format!("{line}\n"),
    };
    Ok(Panel {
        units_per_px: motion_plot::PX.into(),
        class: "fig plot",
        body: inside.lines().map(signed).collect(),
        ..Panel::new(width.into(), height.into())
    })
}
