//! Figures over time: the traces of the gauge (Fig. 10), the phases of the pushed runs (Fig. 5), and COM ("COG"), ZMP and feet (Fig. 9 and 14).

use super::study::{Pushed, Study};
use serde_json::Value;
use standfast::report::figure::axes::Axis;
use standfast::report::figure::motion::MotionPlot;
use standfast::report::figure::panel::{LegendSample, Panel, PanelPoint, PanelView, short};
use standfast::report::text::story;
use standfast::sim::episode::Snapshot;

/// Width of a panel of Fig. 5, and left and right edge of its charts (px).
const WIDTH: f64 = 460.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = WIDTH - 10.0;
/// Time before the push, and after the robot stands still, that Fig. 5 shows (s).
const BEFORE_S: f64 = 0.08;
const STILL_S: f64 = 0.06;
/// Time that Fig. 9 and 14 show after the COM is home (s).
const AFTER_S: f64 = 0.4;

/// The events of a run: name among the numbers of Fig. 5, and words.
const EVENTS: [(&str, &str); 7] = [
    ("push_s", "push"),
    ("left_sets_s", "no set holds the state"),
    ("lift_s", "foot lifted"),
    ("landing_s", "foot landed, sets updated"),
    ("held_after_landing_s", "a set holds the state"),
    ("fastest_gain_from_s", "fastest gain, to the end"),
    ("still_from_s", "stands still"),
];

/// The panels of Fig. 5; the times of its events are among its numbers.
pub fn sequence(study: &Study, numbers: &Value) -> Vec<Panel> {
    let [a, b] = &study.pushes;
    vec![
        phases(a, &numbers["push_behind"], "(a) from behind"),
        phases(
            b,
            &numbers["push_diagonal"],
            "(b) from diagonally forward left",
        ),
    ]
}

/// The phases, gains and margins of one run over time, with its numbered events.
fn phases(pushed: &Pushed, told: &Value, title: &str) -> Panel {
    let mut events = Vec::new();
    for (name, what) in EVENTS {
        // If the new CPI sets hold the state at the landing, `held_after_landing_s` needs no event of its own.
        let happens = name != "held_after_landing_s" || told["landed_inside"] == false;
        if let Some(time_s) = told[name].as_f64().filter(|_| happens) {
            events.push((time_s, what));
        }
    }
    let (from, to) = (pushed.push.start_s - BEFORE_S, pushed.end_s() + STILL_S);
    let seen: Vec<&Snapshot> = pushed
        .film
        .snapshots
        .iter()
        .filter(|s| (from..=to).contains(&s.time_s))
        .collect();
    let mut panel = Panel::new(WIDTH, 414.0 + 17.0 * events.len() as f64);
    panel.text("title start", [LEFT, 20.0], [0.0, 0.0], title);
    let keys = [
        ("switching", "switching"),
        ("out", "no set holds"),
        ("swing", "foot in the air"),
        ("pushed", "push"),
    ];
    for ((class, words), x) in keys.into_iter().zip([LEFT, 154.0, 264.0, 384.0]) {
        panel.rect(class, [x, 30.0], [x + 14.0, 42.0]);
        panel.text("start small", [x, 41.0], [19.0, 0.0], words);
    }
    let lane = |[top, bottom]: PanelPoint, y: PanelPoint| {
        PanelView::chart([LEFT, top, RIGHT, bottom], [from, to], y)
    };
    const LANES: [PanelPoint; 3] = [[64.0, 92.0], [104.0, 226.0], [238.0, 350.0]];
    panel.view = lane(LANES[0], [0.0, 1.0]);
    panel.text("name end", [from, 0.0], [-6.0, -10.0], "phase");
    for run in seen.chunk_by(|a, b| a.phase == b.phase) {
        let (start, end) = (
            run[0].time_s,
            run[run.len() - 1].time_s + pushed.film.control_period_s,
        );
        let class = match &*run[0].phase {
            "posture" => "band",
            "switching" => "switching",
            "out-of-sets" => "out",
            _ => "swing",
        };
        panel.rect(class, [start, 0.0], [end.min(to), 1.0]);
    }
    panel.view = lane(LANES[1], [-0.6, pushed.film.regions.len() as f64 - 0.4]);
    for (i, name) in pushed.film.regions.iter().enumerate() {
        panel.line("grid", [from, i as f64], [to, i as f64]);
        panel.text("tick end", [from, i as f64], [-6.0, 4.0], name);
    }
    let regions = &pushed.film.regions;
    let gains = seen.iter().map(|s| {
        let gain = regions
            .iter()
            .position(|name| Some(name) == s.gain.as_ref())?;
        Some([s.time_s, gain as f64])
    });
    panel.curve("slice", gains);
    panel.in_px(|panel| panel.turned_text("name", [16.0, 165.0], -90.0, "gain"));
    let [top, bottom] = LANES[2];
    let margin = Axis::new("margin of the set", [-1.0, 1.1]);
    panel.axes(
        [LEFT, top, RIGHT, bottom],
        &Axis::new("time [s]", [from, to]),
        &margin,
    );
    panel.line("axis", [from, 0.0], [to, 0.0]);
    panel.curve(
        "zmp",
        seen.iter().map(|s| Some([s.time_s, s.margin?.max(-1.0)])),
    );
    for edges in LANES {
        panel.view = lane(edges, [0.0, 1.0]);
        panel.rect(
            "pushed",
            [pushed.push.start_s, 0.0],
            [pushed.push.end_s(), 1.0],
        );
    }
    panel.view = lane([60.0, bottom], [0.0, 1.0]);
    let mut label = f64::NEG_INFINITY;
    for (i, (at, what)) in events.iter().enumerate() {
        panel.line("axis thin", [*at, 1.0], [*at, 0.0]);
        // The numbers of events that are close to each other are moved apart.
        label = panel.view.at([*at, 0.0])[0].max(label + 11.0);
        let row = 410.0 + 17.0 * i as f64;
        panel.in_px(|panel| {
            panel.text("small", [label, 57.0], [0.0, 0.0], &(i + 1).to_string());
            panel.text(
                "small start",
                [LEFT, row],
                [0.0, 0.0],
                &format!("{}:  t = {at:.3} s  {what}", i + 1),
            );
        });
    }
    panel
}

/// The panels of Fig. 10: the traces of the two hardest strikes from each side.
pub fn strikes(numbers: &Value) -> Vec<Panel> {
    let number = |value: &Value| value.as_f64().unwrap_or_default();
    let range_n = number(&numbers["range_n"]);
    let strikes = numbers["strikes"].as_array().map_or(&[][..], Vec::as_slice);
    let points = |strike: &Value| -> Vec<PanelPoint> {
        let pairs = strike["trace_ms_n"].as_array().into_iter().flatten();
        pairs
            .map(|pair| [number(&pair[0]), number(&pair[1])])
            .collect()
    };
    let [last_ms, most_n] = [0, 1].map(|axis| {
        let all = strikes.iter().flat_map(points).map(|point| point[axis]);
        1.06 * all.fold([0.0, range_n][axis], f64::max)
    });
    let mut panels = Vec::new();
    let sides = strikes.chunk_by(|a, b| a["from"] == b["from"]);
    for (strikes, title) in sides.zip(["(a) from behind", "(b) from diagonally forward left"]) {
        let mut panel = Panel::new(WIDTH, 348.0);
        panel.text("title start", [LEFT, 20.0], [0.0, 0.0], title);
        panel.axes(
            [LEFT, 34.0, RIGHT, 250.0],
            &Axis::new(
                "time since the gauge touches the robot [ms]",
                [0.0, last_ms],
            ),
            &Axis::new("force [N]", [0.0, most_n]),
        );
        panel.line("limit", [0.0, range_n], [last_ms, range_n]);
        panel.text(
            "small end",
            [last_ms, range_n],
            [-6.0, 14.0],
            "range of the gauge",
        );
        let mut rows = Vec::new();
        for (strike, class) in strikes[strikes.len() - 2..].iter().zip(["com", "dcm"]) {
            panel.polyline(class, points(strike));
            let [draw_m, impulse_n_s, peak_n] =
                ["draw_m", "impulse_n_s", "peak_n"].map(|name| number(&strike[name]));
            let told = format!(
                "drawn back by {} m: {} N s, up to {} N",
                short(draw_m, 2),
                short(impulse_n_s, 2),
                short(peak_n, 0)
            );
            rows.push((class.into(), LegendSample::Line, told));
        }
        panel.legend([LEFT, 310.0], &rows);
        panels.push(panel);
    }
    panels
}

/// The panels of Fig. 9.
pub fn imposed(study: &Study) -> Vec<Panel> {
    let mut panels = Vec::new();
    for (run, name) in study.errors.iter().zip(["(a)", "(b)"]) {
        let [x, y] = run.record.zmp_error_m.map(|m| short(1e3 * m, 1));
        let title = format!("{name}  ZMP error ({x}, {y}) mm imposed at t = 0");
        let end_s = run.record.home_at_s.unwrap_or(1.0) + AFTER_S;
        panels.push(motion(&run.motion, &title, end_s));
    }
    panels
}

/// The panels of Fig. 14.
pub fn pushed(study: &Study) -> Vec<Panel> {
    let mut panels = Vec::new();
    for (pushed, name) in study.pushes.iter().zip(["(a)", "(b)"]) {
        let record = &pushed.film.record;
        let title = story::headline(&[pushed.push], &study.design.family.name, record)
            .replace(" -", " \u{2212}");
        let end_s = record.settled_at_s.map_or(record.end_s, |at| {
            at.max(record.home_at_s.unwrap_or(at)) + AFTER_S
        });
        panels.push(motion(&pushed.motion, &format!("{name}  {title}"), end_s));
    }
    panels
}

/// The plot of a motion up to `end_s`.
fn motion(motion: &MotionPlot, title: &str, end_s: f64) -> Panel {
    let mut motion = motion.clone();
    motion.end_at(end_s);
    motion.panel(title)
}
