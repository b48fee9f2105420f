//! The trials that the page names: the rows of its table of telling trials, and the links to these rows from other
//! parts of the page.

use crate::{
    replay_parts,
    trial_page::{picture_found, replay_found},
};
use serde_json::{Value, json};
use standfast_stats::decision::PairVerdict;
use standfast_study::verdict::controller_summary::ControllerSummary;
use standfast_study::verdict::pairs::PairSummary;
use std::path::Path;

/// The rows of the table: each controller's telling trials with the command that replays them and, if it exists, the
/// path of their replay relative to `folder`, and its small picture.
pub(super) fn table(controllers: &[ControllerSummary], folder: &Path) -> Vec<Value> {
    let mut rows = Vec::new();
    for (i, controller) in controllers.iter().enumerate() {
        for trial in &controller.telling {
            let (id, command) = (
                row_id(controllers, i, trial.trial),
                command(controller, trial.trial),
            );
            let replay = replay_found(folder, &controller.origin, trial.trial);
            let picture = replay.as_ref().and_then(|page| picture_found(folder, page));
            rows.push(json!({
                "set": controller.name, "trial": trial, "id": id, "command": command, "replay": replay, "picture": picture,
            }));
        }
    }
    rows
}

/// A trial: its number, the link to its row in the table for the first of the `tried` controllers that has a row, and
/// the command that replays it with the first of the `tried` controllers.
pub(super) fn point(controllers: &[ControllerSummary], trial: u64, tried: &[usize]) -> Value {
    let link = tried
        .iter()
        .find_map(|controller| row_id(controllers, *controller, trial))
        .map(|id| format!("#{id}"));
    json!({ "trial": trial, "link": link, "command": command(&controllers[tried[0]], trial) })
}

/// The trials from which only one of a pair of controllers recovered, first the trials of the first controller, each
/// with the command that replays it with the controller that lost it. If one controller is better, one of its trials is
/// the example.
pub(super) fn of_pair(
    controllers: &[ControllerSummary],
    pair: &PairSummary,
    (a, b): (usize, usize),
) -> Value {
    let points = |trials: &[u64], tried: [usize; 2]| -> Vec<Value> {
        trials
            .iter()
            .map(|trial| point(controllers, *trial, &tried))
            .collect()
    };
    let only = [
        points(&pair.first_only_a, [b, a]),
        points(&pair.first_only_b, [a, b]),
    ];
    let example = match pair.verdict {
        PairVerdict::Better => only[0].first(),
        _ => None,
    };
    json!({ "example": example, "only": only })
}

fn command(controller: &ControllerSummary, trial: u64) -> String {
    replay_parts(&controller.origin, Path::new("")).join(&trial.to_string())
}

/// Id of the row of a controller and a trial. None if the table has no such row.
fn row_id(controllers: &[ControllerSummary], controller: usize, trial: u64) -> Option<String> {
    let ControllerSummary { name, telling, .. } = &controllers[controller];
    let is_told = telling.iter().any(|told| told.trial == trial);
    is_told.then(|| format!("trial-{trial}-{}", slug(name, controller)))
}

/// The name of a controller as part of an id and of links to it. A name with special characters is replaced by its
/// number.
fn slug(name: &str, controller: usize) -> String {
    let is_plain = name
        .chars()
        .all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c));
    if !name.is_empty() && is_plain {
        name.into()
    } else {
        format!("~{controller}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::summary;
    use standfast_sim::episode::Outcome::{Fell, Recovered};
    use standfast_study::verdict::controller_summary::ControllerOrigin;
    use standfast_study::verdict::telling_trials::TellingTrial;

    #[test]
    fn a_trial_links_to_its_row_and_has_a_command_everywhere() {
        let mut summary = summary(&[[Fell, Recovered]; 8], &[], &[]);
        let of_trial = |trial| TellingTrial {
            trial,
            ..summary.controllers[0].telling[0].clone()
        };
        let telling = [vec![of_trial(5), of_trial(7)], vec![of_trial(9)]];
        for (controller, (name, telling)) in summary
            .controllers
            .iter_mut()
            .zip(["hold", "a b"].into_iter().zip(telling))
        {
            (controller.name, controller.origin, controller.telling) =
                (name.into(), ControllerOrigin::own(name), telling);
        }
        let ids: Vec<Value> = table(&summary.controllers, Path::new(""))
            .iter()
            .map(|row| row["id"].clone())
            .collect();
        assert_eq!(ids, ["trial-5-hold", "trial-7-hold", "trial-9-~1"]);
        let pair = &mut summary.pairs[0];
        (pair.verdict, pair.first_only_a, pair.first_only_b) =
            (PairVerdict::Better, vec![9], vec![5, 6]);
        let found = of_pair(&summary.controllers, &summary.pairs[0], (0, 1));
        let command = |trial: u64, controller: &str| {
            format!(
                "standfast push --campaign campaign.toml --trial {trial} --controller {controller}"
            )
        };
        let expected = json!({ "trial": 9, "link": "#trial-9-~1", "command": command(9, "'a b'") });
        assert_eq!(found["only"][0][0], expected);
        assert_eq!(
            found["only"][1][1],
            json!({ "trial": 6, "link": null, "command": command(6, "hold") })
        );
        assert_eq!(found["example"]["link"], "#trial-9-~1");
    }
}
