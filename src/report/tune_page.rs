//! `tune.html`: a search for better numbers as one page.

use super::figure::axes::Axis;
use super::figure::page_style;
use super::figure::panel::Panel;
use super::html_page;
use super::text::tune as text;
use minijinja::UndefinedBehavior;
use serde_json::json;

use standfast_core::error::Result;
use standfast_study::tune::Tuned;
use standfast_study::tune::search::Generation;

const TEMPLATE: &str = include_str!("tune_page.html.jinja");
/// Shades of the dots, from the first generations to the last.
const SHADES: [&str; 4] = [".25", ".45", ".7", "1"];
/// Pieces of the fitted curve.
const CURVE: usize = 60;
/// Least height of an axis above zero, and below zero (points).
const LEAST_POINTS: f64 = 5.0;

/// The page. Fails only if the template is wrong.
pub fn page(tuned: &Tuned) -> Result<String> {
    let task = &tuned.task;
    let (mut rows, mut pictures) = (Vec::new(), Vec::new());
    for (i, tunable) in task.tunables.iter().enumerate() {
        let [from, to] = tunable.range;
        let [now, proposed, from, to] = [tunable.now, tuned.proposed[i], from, to]
            .map(|x| x.to_string().replace('-', "\u{2212}"));
        let alone = text::alone(tuned, i)
            .replace("+-", "\u{b1}")
            .replace('-', "\u{2212}");
        rows.push(json!({ "key": tunable.key, "now": now, "proposed": proposed, "alone": alone, "from": from, "to": to }));
        pictures.push(values(tuned, i).svg("role=\"img\""));
    }
    let context = json!({
        "task": task,
        "heading": text::conclusion(tuned),
        "about": format!(
            "{}, on {}: {} generations, {} episodes, seed {}.",
            task.controller, text::cases(&task.cases), tuned.generations.len(), tuned.searched, task.seed
        ),
        "judges": text::judges(task),
        "figure_style": page_style(),
        "sentences": tuned.verdicts.iter().map(|verdict| text::sentence(tuned, verdict)).collect::<Vec<_>>(),
        "folders": tuned.verdicts.iter().map(|verdict| &verdict.folder).collect::<Vec<_>>(),
        "progress": progress(tuned).svg("role=\"img\""),
        "rows": rows,
        "pictures": pictures,
    });
    html_page::render(
        "tune.html",
        TEMPLATE,
        UndefinedBehavior::SemiStrict,
        |_| {},
        &context,
    )
}

/// The ends of an axis that holds zero and all these points.
fn ends(points: impl Iterator<Item = f64>) -> [f64; 2] {
    points.fold([-LEAST_POINTS, LEAST_POINTS], |[from, to], x| {
        [from.min(x), to.max(x)]
    })
}

/// The advantage of the middle and of the best candidate, by generation.
fn progress(tuned: &Tuned) -> Panel {
    let mut panel = Panel::new(760.0, 320.0);
    let middle = |i: usize| &tuned.generations[i].candidates[1].standing;
    let best = |i: usize| {
        let generation = &tuned.generations[i];
        100.0
            * generation.candidates[generation.order[0]]
                .standing
                .advantage
    };
    let count = tuned.generations.len();
    let bar = |i: usize| {
        [-1.0, 1.0].map(|side| 100.0 * (middle(i).advantage + side * 2.0 * middle(i).error))
    };
    let points = ends((0..count).flat_map(bar).chain((0..count).map(best)));
    let across = [0.5, count.max(1) as f64 + 0.5];
    panel.axes(
        [64.0, 14.0, 736.0, 266.0],
        &Axis::new("generation", across),
        &Axis::new("points", points),
    );
    panel.line("level", [across[0], 0.0], [across[1], 0.0]);
    panel.group("class=\"s1\"", |panel| {
        for i in 0..count {
            panel.circle("hollow", [i as f64 + 1.0, best(i)], 3.5);
        }
    });
    panel.group("class=\"s0\"", |panel| {
        panel.polyline(
            "",
            (0..count).map(|i| [i as f64 + 1.0, 100.0 * middle(i).advantage]),
        );
        for i in 0..count {
            let words = format!(
                "generation {}: {:+.1} points",
                i + 1,
                100.0 * middle(i).advantage
            );
            panel.error_bar("interval", i as f64 + 1.0, bar(i));
            panel.told(&words, |panel| {
                panel.circle("dot", [i as f64 + 1.0, 100.0 * middle(i).advantage], 4.0)
            });
        }
    });
    panel
}

/// The candidates by the value of one number.
fn values(tuned: &Tuned, number: usize) -> Panel {
    let mut panel = Panel::new(330.0, 240.0);
    let tunable = &tuned.task.tunables[number];
    let shown = |generation: &Generation| {
        generation
            .candidates
            .iter()
            .skip(1)
            .filter(|candidate| candidate.standing.trials == generation.trials)
            .map(|candidate| {
                [
                    candidate.values[number],
                    100.0 * candidate.standing.advantage,
                ]
            })
            .collect::<Vec<_>>()
    };
    let points = ends(tuned.generations.iter().flat_map(shown).map(|[_, y]| y));
    panel.axes(
        [58.0, 10.0, 320.0, 186.0],
        &Axis::new(&tunable.key, tunable.range),
        &Axis::new("points", points),
    );
    for (i, generation) in tuned.generations.iter().enumerate() {
        let shade = SHADES[i * SHADES.len() / tuned.generations.len()];
        panel.group(&format!("class=\"s0\" opacity=\"{shade}\""), |panel| {
            for point in shown(generation) {
                panel.circle("dot", point, 3.0);
            }
        });
    }
    let (effect, start) = (&tuned.effects[number], tunable.share_of(tunable.now));
    let (mut least, mut most) = (tunable.now, tunable.now);
    for generation in &tuned.generations {
        for candidate in &generation.candidates {
            least = least.min(candidate.values[number]);
            most = most.max(candidate.values[number]);
        }
    }
    let fitted = (0..=CURVE).map(|i| {
        let share = i as f64 / CURVE as f64;
        let (value, y) = (tunable.at(share), 100.0 * effect.gain(share - start));
        let is_known = (least..=most).contains(&value) && (points[0]..=points[1]).contains(&y);
        is_known.then_some([value, y])
    });
    panel.group("class=\"s0\"", |panel| panel.curve("", fitted));
    let upright = |panel: &mut Panel, class: &str, value: f64| {
        panel.line(class, [value, points[0]], [value, points[1]])
    };
    if (tunable.range[0]..=tunable.range[1]).contains(&tunable.now) {
        panel.group("stroke-dasharray=\"5 4\"", |panel| {
            upright(panel, "s1", tunable.now)
        });
    }
    upright(&mut panel, "s1", tuned.proposed[number]);
    panel
}
