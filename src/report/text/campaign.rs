//! The result of a campaign as text for the terminal.

use super::comparison;
use crate::replay_command;
use crate::tables::{self, Detail};
use crate::text::layout::{sole_impulse, wrapped};
use standfast_sim::episode::{Counts, Judge};
use standfast_sim::push::three_digits;
use standfast_study::Summary;
use standfast_study::ask::bounds::digits;
use standfast_study::ask::variations;
use std::fmt::Write;
use std::path::Path;

/// The conditions of a recovery and of a fall, in words (three lines of 80 columns).
pub fn thresholds(judge: &Judge) -> String {
    let [recovered, fell] = endings(judge);
    wrapped("recovered: ", &recovered)
        + &wrapped("fell:      ", &fell)
        + &broke(judge).map_or(String::new(), |broke| wrapped("broke:     ", &broke))
}

/// The condition under which a robot counts as broken; None without a limit.
fn broke(judge: &Judge) -> Option<String> {
    let most = judge.max_sole_force_weights?;
    Some(format!("a sole bore more than {most} weights"))
}

/// The conditions of a recovery and of a fall.
pub fn endings(judge: &Judge) -> [String; 2] {
    let Judge {
        standing_tilt_deg,
        standing_com_speed_m_s,
        standing_time_s,
        ..
    } = judge;
    let Judge {
        fallen_tilt_deg,
        fallen_com_height_ratio,
        ..
    } = judge;
    let [standing_com_speed_m_s, standing_time_s] =
        [standing_com_speed_m_s, standing_time_s].map(|v| digits(*v));
    let recovered = format!(
        "tilt under {standing_tilt_deg} deg, COM under {standing_com_speed_m_s} m/s, DCM in the support, for \
         {standing_time_s} s"
    );
    let fell = format!(
        "a link at the ground other than the soles, tilt over {fallen_tilt_deg} deg, or COM under \
         {fallen_com_height_ratio} of its height at home"
    );
    [recovered, fell]
}

/// The result of a campaign: its settings, how often each controller recovered, which is better, and the gates. `full`
/// adds the tables behind these. `folder` is the result folder, for the command that replays a trial.
pub fn campaign(summary: &Summary, folder: &Path, full: bool) -> String {
    let mut text: String = settings(summary, full)
        .iter()
        .map(|(mark, words)| wrapped(mark, words))
        .collect();
    text += "\n";
    for warning in &summary.warnings {
        text += &wrapped("warning: ", warning);
    }
    text += if summary.warnings.is_empty() {
        ""
    } else {
        "\n"
    };
    let most = if full { Detail::Full } else { Detail::Short };
    let mut tables = tables::of(summary)
        .into_iter()
        .filter(|table| table.detail <= most)
        .map(|table| table.table.text());
    text += &tables.next().unwrap_or_default();
    text += &summary
        .stopped
        .as_ref()
        .map_or(String::new(), |stopped| wrapped(" ", stopped));
    text += "\n";
    text += &wrapped("", &summary.headline);
    text += &comparison::verdicts(summary);
    text += &tables.map(|table| format!("\n{table}")).collect::<String>();
    text += &replay(summary, folder);
    if full {
        let _ = write!(
            text,
            "\n{}",
            wrapped("", &format!("Intervals: {}", summary.interval))
        );
    }
    text
}

/// The settings of the campaign, each with its name; all of them if `full`.
pub fn settings(summary: &Summary, full: bool) -> Vec<(&'static str, String)> {
    let push = &summary.push;
    let most = match summary.most_trials > summary.trials {
        true => format!(" (of {} at most)", summary.most_trials),
        false => String::new(),
    };
    let Summary {
        name, trials, seed, ..
    } = summary;
    let trials = match summary.stopped {
        None => format!("{trials} trials{most}, the same for each controller"),
        Some(_) => format!("up to {trials} trials{most} for each controller"),
    };
    let mut asked = format!("{name}: {trials}; robot {}, seed {seed}", summary.robot);
    let unit = sole_impulse(summary.units.impulse_n_s());
    let how = match &push.pendulum {
        Some(pendulum) => format!("{pendulum}: momentum"),
        None => "impulse".into(),
    };
    let mut pushed = format!(
        "{how} {} N s ({unit}), heading {} deg{}",
        push.impulse_n_s,
        push.heading_deg,
        push.place()
    );
    let varied = variations::described(&summary.variations);
    let mut head = Vec::new();
    if full {
        let hash = &summary.config_hash[..summary.config_hash.len().min(12)];
        asked += &format!(", configuration {hash}");
        pushed += &format!(
            ", height {} m above {}, duration {} s, start {} s, {}",
            push.height_m,
            push.from_what(),
            push.duration_s,
            push.start_s,
            push.profile.name()
        );
    }
    head.extend([
        ("campaign ", asked),
        ("engine: ", summary.engine.clone()),
        ("push:   ", pushed),
    ]);
    if summary.second_push.is_any() {
        head.push(("then:   ", summary.second_push.to_string()));
    }
    if !varied.is_empty() {
        // The short text has only the names of the varied quantities.
        let names = varied.iter().map(|varied| {
            if full {
                varied
            } else {
                varied.split(' ').next().unwrap_or(varied)
            }
        });
        head.push(("varied: ", names.collect::<Vec<_>>().join(", ")));
    }
    if summary.episode.judge.counts == Counts::Survived {
        let horizon_s = three_digits(summary.episode.horizon_s);
        let survival = format!(
            "survival: a robot that stands still, or has not fallen after {horizon_s} s, counts as recovered"
        );
        head.push(("judge:  ", survival));
    }
    if let Some(broke) = broke(&summary.episode.judge) {
        head.push(("broke:  ", broke));
    }
    if full {
        let (sensors, horizon_s) = (&summary.sensors, three_digits(summary.episode.horizon_s));
        let noise = format!(
            "noise x {}, bias x {}; horizon {horizon_s} s",
            sensors.noise_scale, sensors.bias_scale
        );
        let [recovered, fell] = endings(&summary.episode.judge);
        head.extend([
            ("sensors: ", noise),
            ("recovered: ", recovered),
            ("fell:      ", fell),
        ]);
    }
    head
}

/// The command that replays a trial in which two controllers end differently, or else one that was lost. It is of a
/// controller whose files are there.
fn replay(summary: &Summary, folder: &Path) -> String {
    let can_be_replayed = |name: &String| {
        let mut controllers = summary.controllers.iter();
        controllers.any(|controller| controller.name == *name && !controller.origin.is_packed)
    };
    let mut differ = summary
        .pairs
        .iter()
        .flat_map(|pair| [(&pair.first_only_a, &pair.b), (&pair.first_only_b, &pair.a)])
        .filter(|(_, lost_by)| can_be_replayed(lost_by))
        .filter_map(|(trials, lost_by)| Some((*trials.first()?, lost_by)));
    // The telling trials of a controller begin with those that it lost.
    let mut lost = summary
        .controllers
        .iter()
        .filter(|controller| controller.count.recovered < controller.count.trials)
        .filter(|controller| !controller.origin.is_packed)
        .filter_map(|controller| Some((controller.telling.first()?.trial, &controller.name)));
    let (which, (trial, controller)) = if let Some(trial_and_controller) = differ.next() {
        (
            "in which two controllers end differently",
            trial_and_controller,
        )
    } else if let Some(trial_and_controller) = lost.next() {
        ("that was lost", trial_and_controller)
    } else {
        return String::new();
    };
    let what = format!("to replay a trial {which} (report.html has more):");
    // The command has a line of its own, however long, so that it can be copied.
    format!(
        "\n{} {}\n",
        wrapped("", &what),
        replay_command(summary, controller, trial, folder)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::summary;
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    #[test]
    fn the_trial_to_replay_is_described() {
        let text = |outcomes| replay(&summary(&[outcomes; 3], &[], &[]), Path::new("out"));
        assert!(
            text([Recovered, Fell])
                .contains("to replay a trial in which two controllers end differently (report")
        );
        assert!(
            text([Recovered, Fell])
                .ends_with("--campaign out/campaign.toml --trial 0 --controller b\n")
        );
        assert!(text([Fell, Fell]).contains("to replay a trial that was lost (report"));
        assert_eq!(text([Recovered, Recovered]), "");
    }
}
