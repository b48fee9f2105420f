//! Published pushes as two tables in Markdown, for the chapter of the guide.

use crate::published::{Answer, Case, Published, Seen, Strength};
use std::fmt::Write;

/// Both tables: the pushes, and the robots as pendulums.
pub fn text(published: &Published) -> String {
    let mut text = "\
| robot | push | N s | seen there | none | one | any | share | the bound |
|---|---|--:|---|--:|--:|--:|--:|---|
"
    .to_string();
    for case in &published.cases {
        let Some(robot) = published.robot(case) else {
            continue;
        };
        let answer = case.answer(robot);
        let bound = |bound_n_s: Option<f64>| {
            bound_n_s.map_or("-".into(), |bound| at_height(bound, answer.height_factor))
        };
        // Writing to a String cannot fail.
        _ = writeln!(
            text,
            "| [{}]({}) | {} | {} | {} | {} | {} | {} | {} | {} |",
            case.robot,
            case.source,
            push(case),
            number(answer.impulse_n_s),
            seen(case.seen),
            bound(Some(answer.none_n_s)),
            bound(answer.one_n_s),
            bound(answer.any_n_s),
            at_height(answer.share, 1.0 / answer.height_factor),
            verdict(case, &answer)
        );
    }
    text += "
| robot | mass | COM height | sole | soles apart | a footstep |
|---|--:|--:|---|--:|---|
";
    for robot in &published.robots {
        let [length_m, width_m] = robot.sole_m;
        let footsteps: Vec<String> = robot
            .reach
            .iter()
            .map(|landing| {
                let ([x0, x1], [y0, y1]) = (landing.x_m, landing.y_m);
                format!("x {x0} to {x1}, y {y0} to {y1} m, {} s", landing.time_s)
            })
            .collect();
        let footsteps = if footsteps.is_empty() {
            "-".into()
        } else {
            footsteps.join("; ")
        };
        _ = writeln!(
            text,
            "| [{}]({}) | {} kg | {} m | {length_m} x {width_m} m | {} m | {footsteps} |",
            robot.name, robot.figures, robot.mass_kg, robot.com_height_m, robot.stance_width_m
        );
    }
    text
}

/// Three digits.
fn number(value: f64) -> String {
    match value.abs() {
        large if large >= 99.95 => format!("{value:.0}"),
        large if large >= 9.995 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

/// A value and, in brackets, its product with the factor for the height of the push, if there is one.
fn at_height(value: f64, factor: f64) -> String {
    if factor == 1.0 {
        number(value)
    } else {
        format!("{} ({})", number(value), number(value * factor))
    }
}

fn push(case: &Case) -> String {
    let strength = match case.strength {
        Strength::ForceN(force_n) => format!("{force_n} N"),
        Strength::ForceWeights(weights) => format!("{weights} weights"),
        Strength::SpeedMS(speed_m_s) => format!("{speed_m_s} m/s"),
    };
    let mut text = match case.heading_deg {
        0.0 => format!("{strength} forward"),
        90.0 => format!("{strength} to the side"),
        180.0 => format!("{strength} backward"),
        heading_deg => format!("{strength} at {heading_deg} degrees"),
    };
    if case.duration_s > 0.0 {
        text += &format!(", {} s", case.duration_s);
    }
    if case.above_com_m > 0.0 {
        text += &format!(", {} m above the COM", case.above_com_m);
    }
    if case.one_foot {
        text += ", on one foot";
    }
    if !case.what.is_empty() {
        text += &format!("; {}", case.what);
    }
    text
}

fn seen(seen: Seen) -> &'static str {
    match seen {
        Seen::Stood => "stands",
        Seen::Stepped => "holds, with footsteps",
        Seen::Fell => "falls, without footsteps",
        Seen::FellStepping => "falls, with footsteps",
    }
}

/// What the bound that counts says of what was seen.
fn verdict(case: &Case, answer: &Answer) -> &'static str {
    match (case.held(), answer.share, answer.share_at_height()) {
        (true, _, high) if high <= 1.0 => "allows it",
        (true, share, _) if share <= 1.0 => "allows it, if the trunk takes the moment up",
        (true, ..) => "**is passed**",
        (false, share, _) if share > 1.0 => "rules it out",
        (false, _, high) if high > 1.0 => "rules it out, if the ground takes the moment",
        (false, ..) => "does not rule it out",
    }
}
