//! Tables of the strikes of a pendulum.

use super::controllers::{name, shown_level};
use crate::table::{Table, cell, number, texts, words};
use standfast_study::Summary;
use standfast_study::verdict::strikes::{OF_THREE, Stability, Strikes};
use std::iter::once;

/// The drawbacks that each controller takes, by heading.
pub(super) fn by_heading(summary: &Summary) -> Table {
    let has_conditions = summary
        .strikes
        .iter()
        .any(|strikes| !strikes.conditions.is_empty());
    let of_three = format!("D {:.1} % [m]", 100.0 * OF_THREE);
    let columns = ["recovered", "D 50 % [m]"].map(number);
    let last = match has_conditions {
        true => vec!["stable to [J]", "unstable from [J]"],
        false => vec![of_three.as_str()],
    };
    let corner = [words("controller"), number("towards")];
    let mut table = Table::new(
        "Strikes by the pendulum",
        corner
            .into_iter()
            .chain(columns)
            .chain(last.into_iter().map(number)),
    );
    for (i, strikes) in summary.strikes.iter().enumerate() {
        for towards in &strikes.towards {
            let heading = towards
                .heading_deg
                .map_or("all".into(), |deg| deg.to_string());
            let count = &towards.count;
            let recovered = format!("{}/{}", count.recovered, count.trials);
            let [draw50, of_three] = [&towards.draw50_m, &towards.draw_of_three_m]
                .map(|at| shown_level(at.level, at.none_because));
            let energies = [towards.stable_to_j, towards.unstable_from_j]
                .map(|energy_j| energy_j.map_or("none".into(), |j| format!("{j:.2}")));
            let last = match has_conditions {
                true => energies.to_vec(),
                false => vec![of_three],
            };
            table.row(
                once(name(i, &summary.controllers[i]))
                    .chain(texts([heading, recovered, draw50]))
                    .chain(last.into_iter().map(cell)),
            );
        }
    }
    table.with_note(
        "D is the drawback, by a logistic curve over the strikes towards one heading (degrees), with 95 % intervals.",
    )
}

/// The drawback that a team can declare for three strikes.
pub(super) fn declared(summary: &Summary) -> Table {
    let numbers = ["D [m]", "momentum [N s]", "M", "recovered up to D"].map(number);
    let mut table = Table::new("What to declare", once(words("controller")).chain(numbers));
    let counted = summary.strikes.iter().enumerate();
    for (i, strikes) in counted.filter(|(_, strikes)| strikes.conditions.is_empty()) {
        let cells = match &strikes.declared {
            None => ["none", "-", "-", "-"].map(String::from),
            Some(declared) => {
                let [least, most] = declared
                    .ci95_m
                    .map(|end| end.map_or("?".into(), |m| format!("{m:.2}")));
                let farthest = match declared.is_farthest {
                    true => " (farthest)".into(),
                    false => format!(" ({least}-{most})"),
                };
                let count = &declared.up_to_it;
                [
                    format!("{:.2}{farthest}", declared.draw_m),
                    format!("{:.2}", declared.momentum_n_s),
                    declared.robocup_m.map_or("-".into(), |m| format!("{m:.3}")),
                    format!("{}/{}", count.recovered, count.trials),
                ]
            }
        };
        table.row(once(name(i, &summary.controllers[i])).chain(texts(cells)));
    }
    table.with_note(format!(
        "From the drawback D each strike is withstood in {:.1} % of cases, so that three are in 95 %: the smallest such D of all \
         headings. `farthest`: the curve does not fall so low; without a loss, it takes 175 strikes of a side to show that. M is \
         the metric of RoboCup's push recovery.",
        100.0 * OF_THREE
    ))
}

/// Losses in each condition, and the energy that the robot absorbed.
pub(super) fn conditions(summary: &Summary) -> Table {
    let corner = ["towards", "D [m]", "energy [J]"].map(number);
    let columns = corner.into_iter().chain(super::controllers::columns(
        summary.controllers.iter().enumerate(),
    ));
    let mut table = Table::new("Strikes lost, and energy absorbed, by condition", columns);
    let rows = summary.strikes.iter().take(1);
    for (i, condition) in rows.flat_map(|strikes| &strikes.conditions).enumerate() {
        let head = [
            condition.heading_deg.to_string(),
            format!("{:.2}", condition.draw_m),
            format!("{:.2}", condition.energy_j),
        ];
        let of = |strikes: &Strikes| {
            let condition = &strikes.conditions[i];
            let count = &condition.count;
            let mark = match condition.stability {
                Some(Stability::Unstable) => "*",
                _ => "",
            };
            let absorbed = condition.absorbed;
            let absorbed = absorbed.map_or("-".into(), |share| format!("{:.0} %", 100.0 * share));
            format!(
                "{}/{}{mark} {absorbed}",
                count.trials - count.recovered,
                count.trials
            )
        };
        table.row(texts(head).chain(summary.strikes.iter().map(of).map(cell)));
    }
    table.with_note(
        "Strikes that were lost, and the energy that the bob lost along its way, to the robot and its own padding, as a share of what it had. \
         `*`: unstable, since 30 % or more were lost. DysTurbance asks for ten strikes or more in each condition.",
    )
}
