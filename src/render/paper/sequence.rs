//! Fig. 5: the sequence of control, as the phases of the two pushed runs on a time line.

use super::super::html::svg::short;
use super::figure::Said::{Quote, Remark};
use super::figure::{Claim, Figure};
use super::panel::{Axes, Panel};
use super::study::{Pushed, Study};
use crate::control::Phase;
use crate::episode::Snapshot;
use serde_json::{Value, json};

const WIDTH: f64 = 460.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = WIDTH - 10.0;
/// Seen before the push and after the robot stands still (s).
const BEFORE_S: f64 = 0.08;
const AFTER_S: f64 = 0.06;

/// Fig. 5.
pub fn figure(study: &Study) -> Figure {
    let told = study.pushes.each_ref().map(Told::of);
    let waits_ms = |told: &Told| told.lift_s.zip(told.out_s).map(|(lift, out)| 1e3 * (lift - out));
    let mut waits: Vec<String> = told.iter().filter_map(waits_ms).map(|ms| short(ms, 0)).collect();
    waits.dedup();
    let order = told.each_ref().map(|told| told.phases.join(" \u{2192} "));
    let order = format!("(a) {}; (b) {}.", order[0], order[1]);
    let at_landing = told.each_ref().map(|told| match (told.landing_s, told.held_after_s) {
        (Some(_), _) if told.lands_inside => "a new set holds the state at once".to_string(),
        (Some(landing), Some(held)) => {
            format!("no new set holds it at first, one does {} ms later", short(1e3 * (held - landing), 0))
        }
        _ => "no new set holds it any more".into(),
    });
    let mut claims = vec![
        Claim::judged(
            Quote(
                "As the stepping necessity is detected, a stepping motion is generated \u{2026} After the foot landing, \
                 we recalculate the maximal CPI set \u{2026} and the switching control is applied again.",
                "Sect. V.A",
            ),
            told.iter().all(|told| told.is_in_order),
            format!("In this order: {order}"),
            format!("Not in this order: {order}"),
        ),
        Claim::open(
            Remark("The paper does not say whether the state at the landing lies in the new sets."),
            format!("Here: (a) {}; (b) {}.{}", at_landing[0], at_landing[1], without_load(study)),
        ),
        Claim::open(
            Quote("a stepping motion is generated with the Boundary Condition Relaxation method [12]", "Sect. V.A"),
            "The original could not be had. Ours is made after its name and what the paper says of it: one footstep, planned at \
             once, with an exponential ZMP; the state wanted at the landing is met in the least squares, with the ZMP \
             kept inside of the sole that stands."
                .into(),
        ),
    ];
    claims.push(Claim::judged(
        Quote("As the stepping necessity is detected, a stepping motion is generated", "Sect. V.A"),
        study.rules.patience_s == 0.0,
        "The foot is lifted at once.".into(),
        format!(
            "The foot is lifted {} ms later: pushes here last {} ms and the error still grows, so the gain set \
             waits for {} ms.",
            waits.join(" and "),
            short(1e3 * study.pushes[0].push.duration_s, 0),
            short(1e3 * study.rules.patience_s, 0)
        ),
    ));
    let fastest = study.design.family.gains.len() - 1;
    let to_fastest = |told: &Told| match told.fastest_s {
        None => "never".into(),
        Some(_) if told.fastest_s == told.landing_s => "from the landing on: no switch was needed".to_string(),
        Some(at) => format!("from t = {} s", short(at, 3)),
    };
    claims.push(Claim::judged(
        Quote("the switching control is applied again", "Sect. V.A"),
        told.iter().all(|told| told.fastest_s.is_some()),
        format!("It ends with the fastest gain: (a) {}, (b) {}.", to_fastest(&told[0]), to_fastest(&told[1])),
        format!(
            "It does not end with the fastest gain in both: (a) {}, (b) {}.",
            to_fastest(&told[0]),
            to_fastest(&told[1])
        ),
    ));
    Figure {
        number: "5",
        file: "fig05-sequence.svg",
        title: "Sequence of control",
        reading: format!(
            "What the controller does when the robot is pushed (a) from behind and (b) from diagonally forward \
             left, {} N s each. Above: its phase. Middle: which of the {} gains acts, slow at the bottom. \
             Below: the margin of the slowest gain's set, 1 at rest, negative when no set holds the state (eq. \
             26). With a foot in the air neither is in use. The direction of (b) is a choice made here (Fig. 13); the two time \
             axes differ in scale.",
            short(study.pushes[0].push.impulse_n_s, 2),
            fastest + 1
        ),
        panels: study
            .pushes
            .iter()
            .zip(&told)
            .zip(["(a) from behind", "(b) from diagonally forward left"])
            .map(|((pushed, told), title)| panel(pushed, told, title))
            .collect(),
        columns: 2,
        table: None,
        claims,
        numbers: json!({ "push_behind": told[0].numbers(), "push_diagonal": told[1].numbers() }),
    }
}

/// What the sets stand on where a sole has lost its load after the landing.
fn without_load(study: &Study) -> String {
    let on_both = study.pushes.each_ref().map(|pushed| {
        let unloaded = pushed.unloaded();
        let both = unloaded.iter().filter(|(.., on_both)| *on_both).count();
        format!("{both} of {}", unloaded.len())
    });
    if study.pushes.iter().all(|pushed| pushed.unloaded().is_empty()) {
        return String::new();
    }
    let [a, b] = on_both;
    format!(
        " While a sole carries no load after the landing (Fig. 14) the sets still take both soles for support: all through in \
         {a} spans in (a), {b} in (b)."
    )
}

/// The events of a run (s).
struct Told {
    push_s: f64,
    /// First tick at which no set holds the state.
    out_s: Option<f64>,
    lift_s: Option<f64>,
    landing_s: Option<f64>,
    /// First tick after the landing at which a set holds the state.
    held_after_s: Option<f64>,
    /// After the landing, from when on the fastest gain acts to the end.
    fastest_s: Option<f64>,
    lands_inside: bool,
    /// Phases in their order, from the push on.
    phases: Vec<&'static str>,
    is_in_order: bool,
    end_s: f64,
}

impl Told {
    fn of(pushed: &Pushed) -> Self {
        let (film, record) = (&pushed.film, &pushed.film.record);
        let footstep = record.footsteps.first();
        let landing_s = footstep.map(|f| f.land_s);
        let after = || film.snapshots.iter().filter(|s| landing_s.is_some_and(|at| s.time_s >= at));
        let fastest = film.gains.len() - 1;
        let last_other = after().rfind(|s| s.gain != Some(fastest));
        let fastest_s = after().find(|s| last_other.is_none_or(|other| s.time_s > other.time_s)).map(|s| s.time_s);
        let mut phases: Vec<&'static str> = Vec::new();
        for snapshot in film.snapshots.iter().filter(|s| s.time_s >= pushed.push.start_s) {
            if phases.last() != Some(&snapshot.phase.name()) {
                phases.push(snapshot.phase.name());
            }
        }
        let is_swing = |name: &str| name.starts_with("swing");
        let is_in_order = matches!(phases[..], ["switching", "out-of-sets", swing, ..] if is_swing(swing))
            && phases.iter().filter(|name| is_swing(name)).count() == 1
            && phases.last() == Some(&"switching");
        Self {
            push_s: pushed.push.start_s,
            out_s: record.left_sets_at_s,
            lift_s: footstep.map(|f| f.lift_s),
            landing_s,
            held_after_s: after().find(|s| s.phase == Phase::Switching).map(|s| s.time_s),
            fastest_s,
            lands_inside: footstep.is_some_and(|f| f.in_set_at_landing),
            phases,
            is_in_order,
            end_s: record.settled_at_s.unwrap_or(record.end_s),
        }
    }

    fn events(&self) -> Vec<(f64, String)> {
        let events = [
            (Some(self.push_s), "push"),
            (self.out_s, "no set holds the state"),
            (self.lift_s, "foot lifted"),
            (self.landing_s, "foot landed, sets updated"),
            (self.held_after_s.filter(|_| !self.lands_inside), "a set holds the state"),
            (self.fastest_s, "fastest gain, to the end"),
            (Some(self.end_s), "stands still"),
        ];
        let told = |(at, what): (Option<f64>, &str)| at.map(|at| (at, format!("t = {at:.3} s  {what}")));
        events.into_iter().filter_map(told).collect()
    }

    fn numbers(&self) -> Value {
        json!({
            "push_s": self.push_s,
            "left_sets_s": self.out_s,
            "lift_s": self.lift_s,
            "landing_s": self.landing_s,
            "held_after_landing_s": self.held_after_s,
            "fastest_gain_from_s": self.fastest_s,
            "still_from_s": self.end_s,
            "landed_inside": self.lands_inside,
            "phases": self.phases,
        })
    }
}

fn panel(pushed: &Pushed, told: &Told, title: &str) -> Panel {
    let snapshots = &pushed.film.snapshots;
    let (from, to) = (told.push_s - BEFORE_S, told.end_s + AFTER_S);
    let seen: Vec<&Snapshot> = snapshots.iter().filter(|s| (from..=to).contains(&s.time_s)).collect();
    let events = told.events();
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
    let count = pushed.film.gains.len();
    let gains = lane(104.0, 226.0, [-0.6, count as f64 - 0.4]);
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
    for whole in [&phases, &gains, &margins] {
        let [_, top, _, bottom] = whole.frame;
        let span = [told.push_s, pushed.push.end_s()].map(|t| whole.at([t, 0.0])[0]);
        panel.rect("pushed", [span[0], top], [span[1], bottom]);
    }
    let mut last = f64::NEG_INFINITY;
    for (i, (at, words)) in events.iter().enumerate() {
        let [x, _] = phases.at([*at, 0.0]);
        panel.line("axis thin", [x, 60.0], [x, 350.0]);
        // Numbers of events that are close stand side by side.
        let label = x.max(last + 11.0);
        last = label;
        panel.text("small", [label, 57.0], &(i + 1).to_string());
        let row = 410.0 + 17.0 * i as f64;
        panel.text("small start", [LEFT, row], &format!("{}:  {words}", i + 1));
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
