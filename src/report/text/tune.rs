//! The text of a search for better numbers.

use super::layout::{signed, wrapped};
use standfast_study::tune::search::Generation;
use standfast_study::tune::verdict::CaseVerdict;
use standfast_study::tune::{CaseId, Task, Tuned};
use standfast_study::verdict::pairs::p_value;

/// A robot in an engine.
pub fn case(case: &CaseId) -> String {
    format!("{} in {}", case.robot, case.engine)
}

/// All robots and engines of a search.
pub fn cases(cases: &[CaseId]) -> String {
    cases.iter().map(case).collect::<Vec<_>>().join(", ")
}

/// A line on a generation: the advantage of its middle over the incumbent, on trials that did not choose the middle.
pub fn generation(generation: &Generation, spread: f64, spent: u64) -> String {
    let (middle, best) = (
        &generation.candidates[1].standing,
        &generation.candidates[generation.order[0]].standing,
    );
    let points = |share: f64| signed(100.0 * share, 1);
    format!(
        "generation {:3}: {:3} trials, middle {:>5} points (+-{:.1}), best {:>5}, spread {:4.1} %, {spent} episodes",
        generation.number,
        generation.trials,
        points(middle.advantage),
        200.0 * middle.error,
        points(best.advantage),
        100.0 * spread,
    )
}

/// The numbers with their ranges.
pub fn ranges(task: &Task) -> String {
    table(task, None)
}

fn table(task: &Task, tuned: Option<&Tuned>) -> String {
    let width = task
        .tunables
        .iter()
        .map(|tunable| tunable.key.len())
        .max()
        .unwrap_or(0)
        .max(3);
    let head = tuned.map_or("", |_| "   proposed   alone, points");
    let mut text = format!("  {:width$}        now{head}   range\n", "key");
    for (i, tunable) in task.tunables.iter().enumerate() {
        let proposed = tuned.map_or(String::new(), |tuned| {
            format!(" {:10}   {:>13}", tuned.proposed[i], alone(tuned, i))
        });
        let [from, to] = tunable.range;
        text += &format!(
            "  {:width$} {:10}{proposed}   {from} to {to}\n",
            tunable.key, tunable.now
        );
    }
    text
}

/// The gain in points by the proposed value of a number alone, with two standard errors.
pub fn alone(tuned: &Tuned, number: usize) -> String {
    let effect = &tuned.effects[number];
    format!(
        "{} +-{:.1}",
        signed(100.0 * effect.alone, 1),
        200.0 * effect.error
    )
}

/// The result.
pub fn text(tuned: &Tuned) -> String {
    let Tuned {
        task,
        generations,
        searched,
        ..
    } = tuned;
    let mut text = wrapped(
        "",
        &format!(
            "{} of campaign {}, on {}: {} generations, {searched} episodes.",
            task.controller,
            task.campaign,
            cases(&task.cases),
            generations.len()
        ),
    );
    text += &format!("\n{}\n", table(task, Some(tuned)));
    for verdict in &tuned.verdicts {
        text += &wrapped(" - ", &sentence(tuned, verdict));
    }
    text += &wrapped("", &judges(task));
    text += &wrapped("", conclusion(tuned));
    text
}

/// A sentence on the result of a final campaign.
pub fn sentence(tuned: &Tuned, verdict: &CaseVerdict) -> String {
    let [before, after] = verdict.recovered.map(|count| {
        let rate = 100.0 * count as f64 / verdict.trials.max(1) as f64;
        format!("{rate:.1} %")
    });
    let [from, to] = verdict.ci95.map(|end| signed(100.0 * end, 1));
    format!(
        "{} in {}: {} recovers from {after} and {} from {before} of {} pushes that the search has not seen (trials 0 to {} \
         of seed {}): {} points (95 %: {from} to {to}), {}.",
        verdict.robot,
        verdict.engine,
        tuned.name,
        tuned.task.controller,
        verdict.trials,
        verdict.trials.saturating_sub(1),
        verdict.seed,
        signed(100.0 * verdict.difference, 1),
        p_value(verdict.p),
    )
}

/// The origin of the pushes that judge.
pub fn judges(task: &Task) -> String {
    let before = match &task.judged_before[..] {
        [] => String::new(),
        seeds => {
            let seeds: Vec<String> = seeds.iter().map(u64::to_string).collect();
            format!(
                " What the controller comes from was judged by the pushes of other seeds: {}.",
                seeds.join(", ")
            )
        }
    };
    format!(
        "Seed {} of the pushes that judge follows from all of task.json, so no other task is judged by these pushes.{before}",
        task.final_seed
    )
}

/// The conclusion from all verdicts.
pub fn conclusion(tuned: &Tuned) -> &'static str {
    let several = tuned.verdicts.len() > 1;
    match (
        tuned.is_better,
        tuned.verdicts.iter().any(CaseVerdict::is_better),
    ) {
        (true, _) if several => "A better one was found, for all of them.",
        (true, _) => "A better one was found.",
        (false, true) => "No better one was found: it is not better for all of them.",
        (false, false) => "No better one was found.",
    }
}

/// The origin of a controller, as lines of comment in its file.
pub fn provenance(tuned: &Tuned) -> Vec<String> {
    let task = &tuned.task;
    let mut lines = vec![
        format!(
            "By standfast {} tune from {}: {} generations,",
            task.standfast,
            task.controller,
            tuned.generations.len()
        ),
        format!(
            "{} episodes of campaign {}, seed {}.",
            tuned.searched, task.campaign, task.seed
        ),
    ];
    for verdict in &tuned.verdicts {
        lines.extend(
            wrapped("", &sentence(tuned, verdict))
                .lines()
                .map(String::from),
        );
    }
    lines
}
