//! Fig. 9 and 14: COM ("COG"), ZMP and feet over time.

use super::super::html::svg::short;
use super::super::plot::motion::{self, MotionPlot};
use super::super::text::story;
use super::figure::Said::{Quote, Remark};
use super::figure::{Claim, Figure};
use super::panel::Panel;
use super::study::{ImposedRun, Pushed, Study};
use crate::episode::imposed::ImposedRecord;
use crate::error::Result;
use serde_json::json;

/// Shown after the COM is home (s).
const AFTER_S: f64 = 0.4;
/// A ZMP that is off by less is where it is wanted (m).
const OFF_M: f64 = 0.005;

fn panel(motion: &MotionPlot, title: &str, end_s: f64) -> Result<Panel> {
    let mut motion = motion.clone();
    motion.end_at(end_s);
    let (width, height) = motion::SIZE;
    let body = motion.svg(title)?;
    Ok(Panel {
        width: width.into(),
        height: height.into(),
        units_per_px: motion::PX.into(),
        class: "fig plot",
        // Its own tag gives way to that of a panel.
        body: body
            .split_once(">\n")
            .and_then(|(_, rest)| rest.rsplit_once("</svg>"))
            .map_or(String::new(), |(inside, _)| with_minus(inside)),
    })
}

/// Labels of axes with the sign of the other figures: in the text of a plot a number has a line of its own.
fn with_minus(body: &str) -> String {
    let signed = |line: &str| match line.strip_prefix('-') {
        Some(digits) if digits.parse::<f64>().is_ok() => format!("\u{2212}{digits}\n"),
        _ => format!("{line}\n"),
    };
    body.lines().map(signed).collect()
}

/// Fig. 9.
pub fn imposed(study: &Study) -> Result<Figure> {
    let mut panels = Vec::new();
    let (mut inside, mut told) = (true, Vec::new());
    for (run, name) in study.errors.iter().zip(["(a)", "(b)"]) {
        let record = &run.record;
        let [x, y] = record.zmp_error_m.map(|m| short(1e3 * m, 1));
        let end_s = record.home_at_s.unwrap_or(1.0) + AFTER_S;
        panels.push(panel(&run.motion, &format!("{name}  ZMP error ({x}, {y}) mm imposed at t = 0"), end_s)?);
        let footstep = record.footsteps.first();
        inside &= footstep.is_some_and(|f| f.in_set_at_landing) && record.home_at_s.is_some();
        let gains = gains_after_landing(study, run);
        told.push(format!(
            "{name}: landed at {} s {} the new sets, then {gains}, COM home from {}",
            footstep.map_or("?".into(), |f| short(f.land_s, 3)),
            if footstep.is_some_and(|f| f.in_set_at_landing) { "inside" } else { "outside" },
            record.home_at_s.map_or("never".into(), |at| format!("{at:.2} s")),
        ));
    }
    let told = format!("{}.", told.join("; "));
    Ok(Figure {
        number: "9",
        file: "fig09-responses-imposed.svg",
        title: "Responses to the imposed errors",
        reading: "COM (the paper's COG), ZMP and feet of Fig. 8: fore and aft above, sideways below; (a) error \
        that drives backward, (b) error from diagonally forward left, both imposed on a COM at rest. COM purple, ZMP red (wanted: orange, \
         dashed), DCM green, dashed, right foot pink, left foot dashed. On the ideal pendulum the ZMP is the one \
         wanted."
            .into(),
        panels,
        columns: 1,
        table: None,
        claims: vec![
            Claim::judged(
                Quote(
                    "It is apparent that the state is controlled by the switching control after foot landing.",
                    "Sect. V.C",
                ),
                inside,
                format!("With the COM at rest at first, {told}"),
                format!("With the COM at rest at first, {told}"),
            ),
            moving(&study.moving[0], "Sect. V.C, of (a), with a COM that moves"),
            moving(&study.moving[1], "Sect. V.C, of (b), with a COM that moves"),
            curves_are_pictures(),
        ],
        numbers: json!({
            "moving": study.moving,
            "a": { "home_at_s": study.errors[0].record.home_at_s, "footsteps": study.errors[0].record.footsteps },
            "b": { "home_at_s": study.errors[1].record.home_at_s, "footsteps": study.errors[1].record.footsteps },
        }),
    })
}

/// The same statement with a COM whose velocity makes the error.
fn moving(record: &ImposedRecord, place: &'static str) -> Claim {
    let start = format!(
        "With the velocity of the COM that makes the error ({} m/s, a push of {} N s)",
        short(record.com_vel_m_s[0].hypot(record.com_vel_m_s[1]), 2),
        short(record.impulse_n_s, 2)
    );
    let lost = record.lost_at_s.map_or("does not come home".into(), |at| format!("is lost at {at:.2} s"));
    let home = record.home_at_s.map_or(String::new(), |at| format!("is home from {at:.2} s"));
    Claim::judged(
        Quote("It is apparent that the state is controlled by the switching control after foot landing.", place),
        record.home_at_s.is_some() && record.lost_at_s.is_none(),
        format!("{start} the COM {home}."),
        format!("{start} the COM {lost}: that is more than one footstep makes good."),
    )
}

/// The gains that act after the landing, in their order, in words.
fn gains_after_landing(study: &Study, run: &ImposedRun) -> String {
    let land_s = run.record.footsteps.first().map_or(0.0, |f| f.land_s);
    let gains = &study.design.family.gains;
    let mut names: Vec<&str> = Vec::new();
    let mut since_s = None;
    for (time_s, _, gain) in run.ticks.iter().filter(|(time_s, ..)| *time_s >= land_s) {
        let Some(gain) = gain else { continue };
        if names.last() != Some(&gains[*gain].name.as_str()) {
            names.push(&gains[*gain].name);
            since_s = (*gain == gains.len() - 1).then_some(*time_s);
        }
    }
    match (&names[..], since_s) {
        ([only], Some(_)) => format!("gain {only}, the fastest, at once (no switch was needed)"),
        (_, since) => {
            let fastest = since.map_or(String::new(), |at| format!(", the fastest from {} s", short(at, 3)));
            format!("gains {}{fastest}", names.join(" \u{2192} "))
        }
    }
}

/// Fig. 14.
pub fn pushed(study: &Study) -> Result<Figure> {
    let mut panels = Vec::new();
    for (pushed, name) in study.pushes.iter().zip(["(a)", "(b)"]) {
        let record = &pushed.film.record;
        let title = story::headline(&[pushed.push], &study.design.family.name, record).replace(" -", " \u{2212}");
        let end_s = record.settled_at_s.map_or(record.end_s, |at| at.max(record.home_at_s.unwrap_or(at)) + AFTER_S);
        panels.push(panel(&pushed.motion, &format!("{name}  {title}"), end_s)?);
    }
    let errors = study.pushes.each_ref().map(zmp_errors);
    let mm = |[x, y]: [f64; 2]| format!("{} mm in x and {} mm in y", short(1e3 * x, 0), short(1e3 * y, 0));
    let [_, [x, y]] = errors;
    let worse_in_y = y > x && y >= OFF_M;
    let figures = format!(
        "While the swing sole carries no load the measured ZMP is off the wanted one by {} (root of the mean square) in \
         (b), {} in (a). (Judged by (b): more in y than in x, and {} mm or more in y.)",
        mm(errors[1]),
        mm(errors[0]),
        short(1e3 * OFF_M, 0)
    );
    let homes: Vec<String> = study
        .pushes
        .iter()
        .map(|pushed| {
            pushed
                .film
                .record
                .home_at_s
                .map_or("not".into(), |at| format!("{:.2} s after the push began", at - pushed.push.start_s))
        })
        .collect();
    let all_home = study.pushes.iter().all(|pushed| pushed.film.record.home_at_s.is_some());
    let home = format!("The COM is home (a) {}, (b) {}.", homes[0], homes[1]);
    let off = study.pushes.each_ref().map(Pushed::unloaded);
    let told = off.each_ref().map(|off| {
        let told: Vec<String> = off
            .iter()
            .map(|(foot, [from, to], _)| format!("the {} from {from:.3} to {to:.3} s", foot.name()))
            .collect();
        if off.is_empty() { "none".into() } else { told.join(" and ") }
    });
    let at_limit = study.pushes.each_ref().map(|pushed| at_limit(study, pushed));
    Ok(Figure {
        number: "14",
        file: "fig14-responses-pushed.svg",
        title: "Responses to the pushes",
        reading: "As Fig. 9, measured: the pushes of Fig. 12 (a) and 13 (b) in simulated physics, the ZMP from \
        the contacts. Grey: how far the soles that carry load reach. The direction of (b) is a choice made here (Fig. 13)."
            .into(),
        panels,
        columns: 1,
        table: None,
        claims: vec![
            Claim::judged(
                Quote("ZMP was not manipulated as planned, especially in y-axis.", "Sect. VI.B, of Fig. 13"),
                worse_in_y,
                figures.clone(),
                figures,
            ),
            Claim::open(
                Quote("This was because ZMP was not manipulated as planned", "Sect. VI.B, of the turn about the yaw axis"),
                "Not examined here: it would take a run whose ZMP is as planned.".into(),
            ),
            Claim::judged(
                Quote("the main focus of the control is set as the regulation of the COG to the origin", "Sect. III.A"),
                all_home,
                home.clone(),
                home,
            ),
            Claim::open(
                Remark("The paper does not say whether the soles stay on the ground after the landing."),
                format!(
                    "Soles that carry no load for a while before the robot stands still: (a) {}; (b) {}.",
                    told[0], told[1]
                ),
            ),
            Claim::open(
                Quote(
                    "In this paper, compensation or stabilizing control were not discussed during the stepping motion. In \
                     particular, modeling errors became a problem in the experiments.",
                    "Sect. VII",
                ),
                format!(
                    "Nothing is stabilised here while a foot is in the air, too. Modelling errors there are none: the controller \
                     knows the robot that is simulated, and its sensors are ideal. At the limit that is assumed for its torque: \
                     (a) {}; (b) {}.",
                    at_limit[0], at_limit[1]
                ),
            ),
            curves_are_pictures(),
        ],
        numbers: json!({
            "zmp_error_rms_m": { "push_behind": errors[0], "push_diagonal": errors[1] },
            "home_at_s": study.pushes.each_ref().map(|pushed| pushed.film.record.home_at_s),
            "soles_without_load_s": off.map(|off| off.into_iter().map(|(foot, span, _)| (foot, span)).collect::<Vec<_>>()),
            "joints_at_torque_limit_s": study.pushes.each_ref().map(|pushed| pushed.watch.at_limit_s.clone()),
        }),
    })
}

/// The joints whose torque was at its limit, and for how long, in words.
fn at_limit(study: &Study, pushed: &Pushed) -> String {
    let joints = study.robot.joints.iter().zip(&pushed.watch.at_limit_s).filter(|(_, time_s)| **time_s > 0.0);
    let told: Vec<String> =
        joints.map(|(joint, s)| format!("{} for {} ms", joint.name.replace('_', " "), short(1e3 * s, 0))).collect();
    if told.is_empty() { "no joint".into() } else { told.join(", ") }
}

/// Root of the mean square of the ZMP's error in the first swing, while the sole in the air carries no load (m; x, y).
fn zmp_errors(pushed: &Pushed) -> [f64; 2] {
    let Some(footstep) = pushed.film.record.footsteps.first() else { return [0.0; 2] };
    let samples = pushed.motion.samples.iter().zip(&pushed.watch.loaded);
    let in_air = samples.filter(|(s, loaded)| s.swing && s.time_s < footstep.land_s && !loaded[footstep.foot]);
    let errors: Vec<[f64; 2]> =
        in_air.filter_map(|(s, _)| s.zmp.map(|zmp| [0, 1].map(|axis| zmp[axis] - s.zmp_ref[axis]))).collect();
    [0, 1].map(|axis| (errors.iter().map(|e| e[axis] * e[axis]).sum::<f64>() / errors.len().max(1) as f64).sqrt())
}

fn curves_are_pictures() -> Claim {
    let remark = Remark("The values of the curves are in the paper's picture only.");
    Claim::open(remark, "So their shapes are not compared here.".into())
}
