//! The map of `standfast limit --dense`: every push by heading and impulse, from which the robot recovers or is lost. A
//! hole is a loss among pushes that are survived; it links to its replay.

use super::axes::Axis;
use super::panel::{LegendRow, LegendSample, Panel, escape};
use standfast_core::error::Result;
use standfast_study::limit::Limits;
use std::path::Path;

/// Size of a map (px) and its frame (left, top, right and bottom edge).
const SIZE: [f64; 2] = [760.0, 380.0];
const FRAME: [f64; 4] = [64.0, 34.0, 744.0, 326.0];
/// Angle between the numbers below a map (degrees).
const TICK_DEG: usize = 45;

/// Draws a map for each controller. `replay_of` gives the file that shows the nth hole. Fails if the file cannot be written.
pub fn write(
    path: &Path,
    limits: &Limits,
    replay_of: impl Fn(usize) -> Option<String>,
) -> Result<()> {
    let Limits {
        robot, campaign, ..
    } = limits;
    let mut holes = (0..).map(replay_of);
    let mut panels = Vec::new();
    let controllers = limits
        .headings
        .first()
        .map_or(0, |first| first.controllers.len());
    panels.extend((0..controllers).map(|controller| map(limits, controller, &mut holes)));
    let rows = [
        ("cell", LegendSample::Area, "the robot recovers"),
        ("cell lost", LegendSample::Area, "it does not"),
        (
            "cell hole",
            LegendSample::Area,
            "a hole: it recovers from harder pushes; click for the replay, if there is one",
        ),
        ("s0", LegendSample::DottedLine(""), "50 % recover"),
        (
            "limit",
            LegendSample::Line,
            "pendulum bound with one footstep",
        ),
    ];
    panels.push(Panel::of_legend(&rows.map(
        |(class, sample, words)| -> LegendRow { (class.into(), sample, words.into()) },
    )));
    super::write(
        path,
        &format!("Pushes by heading and impulse: {robot}, campaign {campaign}"),
        &panels,
        1,
    )
}

/// The map of one controller. It takes one file from `holes` for each of its holes.
fn map(
    limits: &Limits,
    controller: usize,
    holes: &mut impl Iterator<Item = Option<String>>,
) -> Panel {
    let Limits {
        headings,
        precision_n_s: step_n_s,
        ..
    } = limits;
    let half_deg = 180.0 / headings.len() as f64;
    let mut most_n_s = 0.0_f64;
    for heading in headings {
        let tried_n_s = heading.controllers[controller]
            .map
            .last()
            .map_or(0.0, |tried| tried.impulse_n_s);
        most_n_s = most_n_s.max(tried_n_s.max(heading.bound_one_step_n_s.unwrap_or(0.0)));
    }
    let mut panel = Panel::new(SIZE[0], SIZE[1]);
    let name = headings
        .first()
        .map_or("", |heading| &heading.controllers[controller].name);
    panel.text("title start", [FRAME[0], 20.0], [0.0, 0.0], name);
    let ticks = (0..360)
        .step_by(TICK_DEG)
        .map(|deg| (deg as f64, deg.to_string()))
        .collect();
    let x = Axis {
        name: "heading [degrees]: 0 forward, 90 left".into(),
        ends: [-half_deg, 360.0 - half_deg],
        ticks,
    };
    panel.axes(
        FRAME,
        &x,
        &Axis::new("impulse [N s]", [0.0, most_n_s + step_n_s]),
    );
    for heading in headings {
        let limit = &heading.controllers[controller];
        let [left, right] = [-half_deg, half_deg].map(|turn| heading.heading_deg + turn);
        for run in limit
            .map
            .chunk_by(|a, b| a.outcome.is_success() == b.outcome.is_success())
        {
            let [low, high] = [
                run[0].impulse_n_s - 0.5 * step_n_s,
                run[run.len() - 1].impulse_n_s + 0.5 * step_n_s,
            ];
            let hole = !run[0].outcome.is_success() && limit.holes().any(|hole| hole == &run[0]);
            let class = if hole {
                "cell hole"
            } else if run[0].outcome.is_success() {
                "cell"
            } else {
                "cell lost"
            };
            let draw = |panel: &mut Panel| panel.rect(class, [left, low], [right, high]);
            let words = format!(
                "{}\u{b0}, {:.2} N s: {}",
                heading.heading_deg,
                run[0].impulse_n_s,
                run[0].outcome.name()
            );
            match hole.then(|| holes.next().flatten()).flatten() {
                Some(file) => {
                    panel.add(format_args!("<a href=\"{}\">", escape(&file)));
                    panel.told(&words, draw);
                    panel.add("</a>");
                }
                None if hole => panel.told(&words, draw),
                None => draw(&mut panel),
            }
        }
    }
    let bound = headings
        .iter()
        .filter_map(|heading| Some([heading.heading_deg, heading.bound_one_step_n_s?]));
    panel.polyline("limit", bound);
    panel.group("class=\"s0\"", |panel| {
        for heading in headings {
            let middle = [
                heading.heading_deg,
                heading.controllers[controller].impulse50_n_s,
            ];
            panel.circle("dot", middle, 3.0);
        }
    });
    panel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::limit::tests::with_hole;

    #[test]
    fn a_hole_links_to_its_replay_and_a_loss_at_the_limit_is_none() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("map.svg");
        write(&path, &with_hole(), |number| {
            (number == 0).then(|| "hole-1.html".into())
        })
        .unwrap();
        let svg = std::fs::read_to_string(path).unwrap();
        let count = |what: &str| svg.matches(what).count();
        assert_eq!(
            [
                count("<rect class=\"cell hole\""),
                count("<a href=\"hole-1.html\">")
            ],
            [2, 1],
            "with the legend's"
        );
        assert!(
            svg.contains("0\u{b0}, 1.60 N s: fell") && count("<rect class=\"cell lost\"") == 2,
            "{svg}"
        );
    }
}
