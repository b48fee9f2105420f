//! The page of the guide on the packed results that are compiled in: what public policies survived, by robot.

use crate::table::{Table, cell, number, words};
use crate::text::layout::percent;
use serde::Deserialize;
use standfast_core::error::{Error, Result};
use standfast_files::assets::BASELINES;
use standfast_sim::Engine;
use standfast_stats::decision::PairVerdict;
use standfast_stats::rate::SuccessCount;
use standfast_study::verdict::compare::in_engine;
use standfast_study::{Folder, Summary};
use std::path::Path;

const HEAD: &str = "\
# Public policies, to be measured against

`standfast run standard --robot g1.urdf --controller mine.toml --baseline g1-public` runs your policy on the pushes from
which public policies were tried, and compares it with each of them, trial by trial. Their files are not needed: the program
has the rows of their trials, in both engines. The robot has to be the same. This is checked by value (masses, joints, motors,
soles, sensors, reach, but not other shapes), and what differs is told. `standfast status g1-public --full` prints the whole result, `standfast compare
DIR g1-public --out page` writes the comparison as a report, and `standfast merge DIR --pack NEW` makes such a result of your
own: rows alone, without files of robot and controllers.

This page is written by `standfast docs baselines`. A *limit* is the impulse of 50 % survival without noise and variations, in
N s in Rapier and in MuJoCo, with the pushes of `nominal` (`limit nominal --headings 8 --replicas 0 --precision 3 --trials 80`); `none`, `one` and
`any` are the pendulum bounds with so many footsteps, and `early` that with any number that reach as far and land as early as those of
`catch` can. A 95 % interval is at most 6 N s wide, or wider where the search ran out of
its 80 trials (`?`).
";

/// The limits of a packed result, of which the page shows these.
#[derive(Deserialize)]
struct Limits {
    headings: Vec<Heading>,
}

#[derive(Deserialize)]
struct Heading {
    heading_deg: f64,
    bound_no_step_n_s: f64,
    bound_one_step_n_s: Option<f64>,
    bound_n_step_n_s: Option<f64>,
    bound_early_n_s: Option<f64>,
    controllers: Vec<Limit>,
}

#[derive(Deserialize)]
struct Limit {
    name: String,
    impulse50_n_s: Option<f64>,
    resolved: bool,
}

impl Limit {
    /// The impulse, with a mark if its interval is wider than the precision.
    fn text(&self) -> String {
        let mark = if self.resolved { "" } else { "?" };
        in_n_s(self.impulse50_n_s) + mark
    }
}

/// The page in Markdown.
pub fn page() -> Result<String> {
    let mut page = HEAD.to_string();
    for baseline in BASELINES {
        let folder = Folder::existing(Path::new(baseline.name))?;
        let summaries = [
            in_engine(&folder, Engine::Rapier)?,
            in_engine(&folder, Engine::Mujoco)?,
        ];
        let limits: Limits = serde_json::from_str(baseline.limits).map_err(|e| Error::Syntax {
            file: format!("limits of {}", baseline.name),
            message: e.to_string(),
        })?;
        page += &format!(
            "\n## {}\n\n{}\n{}\n{}\n",
            baseline.name,
            baseline.about,
            survival(&summaries).markdown(),
            limits.table(&order(&summaries[0])).markdown(),
        );
    }
    Ok(page.trim_end().to_string() + "\n")
}

/// Names of the controllers, first the one that recovers most often.
fn order(summary: &Summary) -> Vec<&str> {
    let mut controllers: Vec<_> = summary.controllers.iter().collect();
    controllers.sort_by_key(|controller| u64::MAX - controller.count.recovered);
    controllers
        .iter()
        .map(|controller| controller.name.as_str())
        .collect()
}

/// From how many pushes each controller recovered in both engines, and from which others it is not told apart.
fn survival([rapier, mujoco]: &[Summary; 2]) -> Table {
    let mut table = Table::new(
        "",
        [
            words("controller"),
            number("Rapier"),
            number("95 %"),
            number("MuJoCo"),
            number("95 %"),
            words("not told apart from, in Rapier"),
        ],
    );
    for name in order(rapier) {
        let mut cells = vec![cell(name)];
        for summary in [rapier, mujoco] {
            let found = summary.controllers.iter().find(|own| own.name == name);
            let Some(SuccessCount {
                success_rate,
                ci95: [low, high],
                ..
            }) = found.map(|controller| controller.count)
            else {
                cells.extend([cell("-"), cell("-")]);
                continue;
            };
            cells.push(cell(percent(success_rate)));
            cells.push(cell(format!("{:.1}-{}", 100.0 * low, percent(high))));
        }
        let open = rapier
            .pairs
            .iter()
            .filter(|pair| pair.verdict != PairVerdict::Better);
        let others: Vec<&str> = open
            .filter_map(|pair| match (pair.a == name, pair.b == name) {
                (true, _) => Some(pair.b.as_str()),
                (_, true) => Some(pair.a.as_str()),
                _ => None,
            })
            .collect();
        cells.push(cell(others.join(", ")));
        table.row(cells);
    }
    let trials = rapier.trials;
    let pairs = rapier.pairs.len();
    table.with_note(format!(
        "Of {trials} pushes, the same for all. Whoever is not named in the last column is better or worse, at 95 % for all \
         {pairs} pairs together."
    ))
}

impl Limits {
    /// The pendulum bounds, and the limits of these controllers, by heading.
    fn table(&self, names: &[&str]) -> Table {
        let headings = self.headings.iter();
        let columns = headings
            .clone()
            .map(|heading| number(format!("{:.0}", heading.heading_deg)));
        let first = [words("limit in N s, by heading in degrees")];
        let mut table = Table::new("", first.into_iter().chain(columns));
        type Bound = fn(&Heading) -> Option<f64>;
        let bounds: [(&str, Bound); 4] = [
            ("none", |heading| Some(heading.bound_no_step_n_s)),
            ("one", |heading| heading.bound_one_step_n_s),
            ("any", |heading| heading.bound_n_step_n_s),
            ("early", |heading| heading.bound_early_n_s),
        ];
        for (name, bound) in bounds {
            let cells = headings.clone().map(|heading| cell(in_n_s(bound(heading))));
            table.row([cell(name)].into_iter().chain(cells));
        }
        for name in names {
            let cells = headings.clone().map(|heading| {
                let of_engine = Engine::ALL.map(|engine| {
                    let name = format!("{name}@{}", engine.name());
                    let mut limits = heading.controllers.iter();
                    let limit = limits.find(|limit| limit.name == name);
                    limit.map_or("-".into(), Limit::text)
                });
                cell(of_engine.join(", "))
            });
            table.row([cell(*name)].into_iter().chain(cells));
        }
        table
    }
}

fn in_n_s(impulse: Option<f64>) -> String {
    impulse.map_or("-".into(), |impulse| format!("{impulse:.0}"))
}
