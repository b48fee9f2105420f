//! Sums up the trials of a campaign, as `summary.json` states it.

use crate::ask::push::{PushSpec, SecondPushSpec};
use crate::ask::spec::{SensorSpec, Stopping};
use crate::ask::variations::VariationSpec;
use crate::store::folder::Folder;
use crate::store::manifest::Manifest;
use crate::store::row::TrialsFile;
use crate::verdict::baseline::BaselineId;
use crate::verdict::controller_summary::{ControllerSummary, bin_edges};
use crate::verdict::gates::{GateResult, Gates};
use crate::verdict::headline;
use crate::verdict::listed::listed;
use crate::verdict::pairs::{DecisionRule, PairSummary, every_pair};
use crate::verdict::strata::strata;
use crate::verdict::strikes::{self, Strikes};
use crate::verdict::trial_columns::TrialColumns;
use crate::verdict::warnings;
use serde::Serialize;
use standfast_core::error::Result;
use standfast_core::robot::Units;
use standfast_files::{AtomicFile, json_pretty, write_atomic};
use standfast_sim::episode::EpisodeConfig;
use std::collections::BTreeMap;
use std::io::{Write, sink};
use std::path::Path;

/// `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    pub name: String,
    /// Version of the program.
    pub standfast: String,
    /// Name and version of the physics engine, or of each one that an entrant has.
    pub engine: String,
    /// SHA-256 over campaign, robot, controllers and version. With the same build, equal hashes mean equal trials.
    pub config_hash: String,
    pub trials_sha256: String,
    /// The first sentences of a report: which controller recovers most often, and than which others it is better.
    pub headline: String,
    pub robot: String,
    /// Number of trials. In a campaign that ends when decided, a controller that was stopped earlier has fewer. Its own
    /// number is in `controllers`.
    pub trials: u64,
    /// The largest number of trials that was asked for. It is larger than `trials` if the campaign ended earlier
    /// because it was decided.
    pub most_trials: u64,
    /// Sentences that say which controllers stopped before the others, and why. It is None if all have the same number
    /// of trials.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stopped: Option<String>,
    pub stopping: Stopping,
    pub seed: u64,
    /// Horizon, steps and the judge's thresholds.
    pub episode: EpisodeConfig,
    pub push: PushSpec,
    pub sensors: SensorSpec,
    pub second_push: SecondPushSpec,
    pub variations: VariationSpec,
    pub units: Units,
    /// How `ci95` and `adjusted_ci95` are computed.
    pub interval: &'static str,
    pub controllers: Vec<ControllerSummary>,
    /// What the strikes of a pendulum came to, by controller; empty without one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub strikes: Vec<Strikes>,
    /// The controller of which all others are variants, if there is one. Its pairs come first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// Every pair of controllers, compared trial by trial, ordered by verdict. In a comparison of two results each pair
    /// has one controller of each result.
    pub pairs: Vec<PairSummary>,
    pub gates: Vec<GateResult>,
    /// The earlier result with which gates compare.
    pub baseline: Option<BaselineId>,
    /// Warnings of what this result cannot support.
    pub warnings: Vec<String>,
}

impl Summary {
    /// Sums up the trials of a campaign. `trials_sha256` is the hash of the file that holds them. `pairs` are the
    /// controllers to compare, by their numbers in the campaign.
    pub fn new(
        manifest: &Manifest,
        rows: &TrialColumns,
        trials_sha256: String,
        pairs: &[(usize, usize)],
        gates: &Gates,
    ) -> Self {
        let campaign = &manifest.campaign;
        let deciding = DecisionRule::of(manifest);
        let bins = bin_edges(rows.drawn.impulse_n_s.iter().flatten());
        let (trials, strata) = (rows.trials(), strata(&rows.drawn));
        let controllers: Vec<ControllerSummary> = (0..manifest.controllers.len())
            .map(|i| ControllerSummary::new(i, rows, &bins, &strata, deciding.until_resolved))
            .collect();
        let mut pairs = PairSummary::all(rows, pairs, &strata, deciding);
        let reference = manifest.reference().map(String::from);
        pairs.sort_by_key(|pair| {
            reference
                .as_ref()
                .is_some_and(|name| pair.a != *name && pair.b != *name)
        });
        let warnings = [
            manifest.warnings(),
            warnings::of(campaign, trials, &controllers, &pairs),
            gates.warnings(manifest, rows),
        ]
        .concat();
        Self {
            name: campaign.name.clone(),
            standfast: manifest.standfast.clone(),
            engine: manifest.engine(),
            config_hash: manifest.config_hash.clone(),
            trials_sha256,
            headline: headline::of(&controllers, &pairs, deciding.margin),
            robot: campaign.robot.clone(),
            trials,
            most_trials: campaign.trials,
            stopped: stopped(&controllers, trials),
            stopping: campaign.stopping,
            seed: campaign.seed,
            episode: campaign.episode,
            push: campaign.push.clone(),
            sensors: campaign.sensors,
            second_push: campaign.second_push,
            variations: campaign.variations,
            units: campaign.units,
            interval: match deciding.until_resolved {
                true => SEQUENTIAL_INTERVAL,
                false => INTERVAL,
            },
            controllers,
            strikes: strikes::of(campaign, rows, deciding.until_resolved),
            reference,
            pairs,
            gates: gates.judged(rows),
            baseline: gates.baseline(),
            warnings,
        }
    }

    /// Joins the parts of a campaign. It writes `trials.parquet`, `summary.json` and `campaign.toml`, and returns the
    /// summary and the trials. It fails if a part is missing or damaged, or if the folder is not writable.
    pub fn of_folder(folder: &Folder, gates: &Gates) -> Result<(Summary, TrialColumns)> {
        let (summary, rows, trials) = Self::read_into(folder, gates, || {
            AtomicFile::create(&folder.path.join("trials.parquet"))
        })?;
        trials.commit()?;
        summary.write(&folder.path)?;
        folder.write_campaign()?;
        Ok((summary, rows))
    }

    /// Reads the summary and the trials without writing anything. It fails if a part is missing or damaged.
    pub fn read(folder: &Folder, gates: &Gates) -> Result<(Summary, TrialColumns)> {
        Self::read_into(folder, gates, || Ok(sink())).map(|(summary, rows, _)| (summary, rows))
    }

    /// Reads the parts one after the other, and writes `trials.parquet` on the way.
    fn read_into<W: Write + Send>(
        folder: &Folder,
        gates: &Gates,
        to: impl FnOnce() -> Result<W>,
    ) -> Result<(Summary, TrialColumns, W)> {
        let Manifest {
            campaign,
            controllers,
            ..
        } = &folder.manifest;
        let (parts, mut rows) = (
            folder.parts()?,
            TrialColumns::new(controllers, &campaign.episode),
        );
        let mut trials = TrialsFile::new(to()?, &folder.manifest.totals)?;
        for part in parts {
            let part = part?;
            rows.push(&part);
            trials.push(part)?;
        }
        let (written, sha256) = trials.finish()?;
        let mut summary = Summary::new(
            &folder.manifest,
            &rows,
            sha256,
            &every_pair(controllers.len()),
            gates,
        );
        if folder.is_packed() {
            for controller in &mut summary.controllers {
                controller.origin.campaign = folder.name();
                controller.origin.is_packed = true;
            }
        }
        Ok((summary, rows, written))
    }

    /// Writes `summary.json` to a folder.
    pub fn write(&self, folder: &Path) -> Result<()> {
        write_atomic(&folder.join("summary.json"), json_pretty(self)?.as_bytes())
    }
}

/// Says which controllers have fewer than `trials` trials.
fn stopped(controllers: &[ControllerSummary], trials: u64) -> Option<String> {
    let mut by_trials: BTreeMap<u64, Vec<&str>> = BTreeMap::new();
    for controller in controllers
        .iter()
        .filter(|controller| controller.count.trials < trials)
    {
        by_trials
            .entry(controller.count.trials)
            .or_default()
            .push(&controller.name);
    }
    if by_trials.is_empty() {
        return None;
    }
    let mut after = Vec::new();
    for (trials, names) in &by_trials {
        after.push(format!("{} after {trials} trials", listed(names, "and")));
    }
    let after = listed(&after.iter().map(String::as_str).collect::<Vec<_>>(), "and");
    let (subject, about) = if by_trials.values().flatten().count() > 1 {
        ("Some controllers", "them")
    } else {
        ("One controller", "it")
    };
    Some(format!(
        "{subject} stopped before the others, because all that was to be decided about {about} was decided by then: {after}. \
         Each rate is over the controller's own trials, and each pair is compared over the trials that both have."
    ))
}

/// Explains the intervals of a campaign with a fixed number of trials.
const INTERVAL: &str = "All intervals are at 95 %. Those of the differences of pairs are Tango's; they hold for all pairs \
                        together (Bonferroni), and are widened to touch 0 where the exact McNemar test finds no \
                        difference. The others hold each for itself: rates have Wilson's, or Clopper and Pearson's where \
                        fewer than 5 trials recovered or fewer than 5 did not; differences by kind of trial have \
                        Tango's; gates have Clopper and Pearson's on rates and Tango's on differences.";
/// Explains the intervals of a campaign that could end when decided.
const SEQUENTIAL_INTERVAL: &str = "All intervals are at 95 %. Those of rates, of the differences of pairs, and of gates \
                                   are betting confidence sequences: they hold however often one looks, those of \
                                   pairs for all pairs together and those of gates for all gates together. Curves and \
                                   kinds of trial have intervals as for a fixed count of trials.";

#[cfg(test)]
pub(crate) mod tests {

    use crate::fixtures::ragged;

    #[test]
    fn a_controller_counts_its_own_trials_and_a_pair_those_that_both_controllers_have() {
        let (summary, _) = ragged(&["a >= b + 0.1", "c >= 0.5"]);
        let counts: Vec<_> = summary
            .controllers
            .iter()
            .map(|controller| (controller.count.trials, controller.count.recovered))
            .collect();
        assert_eq!(
            (summary.trials, counts),
            (100, vec![(100, 90), (25, 5), (100, 90)])
        );
        for pair in &summary.pairs {
            let is_common = pair.a == "b" || pair.b == "b";
            assert_eq!(
                pair.counts.trials(),
                if is_common { 25 } else { 100 },
                "{pair:?}"
            );
            assert!(
                pair.strata
                    .iter()
                    .all(|stratum| stratum.counts.trials() == stratum.trials)
            );
        }
        assert_eq!(
            summary
                .gates
                .iter()
                .map(|gate| gate.judged.trials)
                .collect::<Vec<_>>(),
            [25, 100]
        );
        // All controllers have the same bins, although the later pushes are harder and "b" has no trial with them.
        assert!(summary.controllers.iter().all(
            |controller| controller.by_impulse.len() == summary.controllers[0].by_impulse.len()
        ));
        assert_eq!(
            summary.controllers[1]
                .by_impulse
                .last()
                .unwrap()
                .count
                .trials,
            0
        );
        assert!(
            summary.controllers[1]
                .telling
                .iter()
                .all(|telling| telling.trial < 25)
        );
        let stopped = summary.stopped.clone().unwrap();
        assert!(
            stopped.starts_with("One controller stopped before the others, because "),
            "{stopped}"
        );
        assert!(
            stopped.contains("was decided by then: b after 25 trials. Each rate is over "),
            "{stopped}"
        );
    }
}
