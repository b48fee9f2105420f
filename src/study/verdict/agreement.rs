//! Tells how far two results agree that differ only in their physics engine. So a user sees what is due to the
//! controller and what to the simulator.
//!
//! Every trial has the same push, robot, ground and noise in both results. If it ends differently, the cause is the
//! engine. The same holds for a verdict that only one engine gives.

use crate::store::folder::Folder;
use crate::store::manifest::Manifest;
use crate::verdict::pairs::{DecisionRule, PairSummary, every_pair};
use crate::verdict::trial_columns::TrialColumns;
use serde::Serialize;
use standfast_controllers::variant::ControllerName;
use standfast_files::assets;
use standfast_sim::Engine;
use standfast_sim::episode::Outcome;
use standfast_sim::episode::parting::Parting;
use standfast_stats::decision::PairVerdict;
use standfast_stats::kappa::Agreed;
use standfast_stats::mcnemar::PairedCounts;

/// Two results of the same trials, a and b, in different engines.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Agreement {
    pub engines: [Engine; 2],
    /// Names and versions of the engines.
    pub versions: [String; 2],
    /// The controllers, in the order of the campaign.
    pub sets: Vec<SetAgreement>,
    /// Distance between two traces at which they have parted (m). It is None if no traces were compared.
    pub part_beyond_m: Option<f64>,
    /// The verdicts in a and in b on each pair of controllers for which the two verdicts differ.
    pub verdicts: Vec<[EngineVerdict; 2]>,
}

/// One controller in both engines, over the trials that both results have.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetAgreement {
    /// Name of the controller, as in both results.
    pub set: String,
    #[serde(flatten)]
    pub counts: PairedCounts,
    #[serde(flatten)]
    pub agreed: Agreed,
    pub strata: Vec<StratumAgreement>,
    /// The trials from which the robot recovered in one engine only.
    pub parted: Vec<PartedTrial>,
}

/// One controller over the trials of one stratum.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StratumAgreement {
    pub by: &'static str,
    pub label: String,
    #[serde(flatten)]
    pub counts: PairedCounts,
    #[serde(flatten)]
    pub agreed: Agreed,
}

/// A trial from which the robot recovered in one engine only.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartedTrial {
    pub trial: u64,
    /// Impulse of the first push.
    pub impulse_n_s: f64,
    pub impulse_over_m_omega_d: Option<f64>,
    pub heading_deg: f64,
    pub recovered_in: Engine,
    /// The outcomes in a and in b.
    pub outcomes: [Outcome; 2],
    pub footsteps: [u32; 2],
    /// Whether the trial was simulated again in both engines, to see where its traces part.
    pub traced: bool,
    /// Where the traces part. It is None if the trial was not simulated again, or if they do not part.
    pub parting: Option<Parting>,
}

/// A verdict on two controllers in one engine, as in [`PairSummary`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EngineVerdict {
    pub a: String,
    pub b: String,
    pub verdict: PairVerdict,
    pub difference: f64,
    pub words: String,
}

/// Whether two results differ only in the engine, its version and its step: robot, controllers, campaign and version of
/// the program are the same. The number of trials and the gates may differ.
pub fn differ_in_engine_alone(a: &Folder, b: &Folder) -> bool {
    // A built-in controller has no file. One version of the program always has the same one.
    let text = |folder: &Folder, gains: &String| {
        assets::text(&folder.path.join(ControllerName::split(gains).base))
            .ok()
            .map(|source| source.text)
    };
    let (ours, theirs) = (&a.manifest, &b.manifest);
    ours.campaign.episode.engine != theirs.campaign.episode.engine
        && (&ours.standfast, &ours.robot_sha256, &ours.sets)
            == (&theirs.standfast, &theirs.robot_sha256, &theirs.sets)
        && ours.campaign.gains == theirs.campaign.gains
        && ours
            .campaign
            .gains
            .iter()
            .all(|gains| text(a, gains) == text(b, gains))
}

impl Agreement {
    /// Compares two results with the same controllers, each given by its manifest and trials. `rows` has the trials of
    /// both results under the names of the comparison, and the controllers of a come first. `pairs` compares each
    /// controller of a with the same controller of b.
    pub fn new(
        of: [(&Manifest, &TrialColumns); 2],
        rows: &TrialColumns,
        pairs: &[PairSummary],
    ) -> Self {
        let engines = of.map(|(manifest, _)| manifest.campaign.episode.engine);
        let mut sets = Vec::new();
        for (i, set) in of[0].0.sets.iter().enumerate() {
            let (a, b) = (i, of[0].0.sets.len() + i);
            sets.push(SetAgreement::new(set, (a, b), engines, rows, pairs));
        }
        Self {
            engines,
            versions: of.map(|(manifest, _)| manifest.engine.clone()),
            sets,
            part_beyond_m: None,
            verdicts: differing(of.map(|(manifest, rows)| own_verdicts(manifest, rows))),
        }
    }

    /// A sentence with the share of trials that have the same outcome. It names the controllers with the smallest and
    /// with the largest share.
    pub fn headline(&self) -> String {
        let by_share =
            |a: &&SetAgreement, b: &&SetAgreement| a.agreed.agree.total_cmp(&b.agreed.agree);
        let least = self.sets.iter().min_by(by_share);
        let most = self.sets.iter().max_by(by_share);
        let mut shares: Vec<String> = least
            .into_iter()
            .chain(most)
            .map(|set| format!("{:.1} % ({})", 100.0 * set.agreed.agree, set.set))
            .collect();
        shares.dedup();
        let [in_a, in_b] = self.engines.map(Engine::title);
        format!(
            "{in_a} and {in_b} agree on {} of trials.",
            shares.join(" to ")
        )
    }

    /// A warning for each verdict that holds in one engine only. It quotes both verdicts.
    pub fn warnings(&self) -> Vec<String> {
        let [in_a, in_b] = self.engines.map(Engine::title);
        let mut warnings = Vec::new();
        for [a, b] in &self.verdicts {
            let contradict = a.verdict == PairVerdict::Better && b.verdict == PairVerdict::Better;
            let what = if contradict {
                "The two engines contradict each other"
            } else {
                "A verdict holds in one engine only"
            };
            warnings.push(format!("{what}. {in_a}: {} {in_b}: {}", a.words, b.words));
        }
        warnings
    }
}

impl SetAgreement {
    /// Compares a controller, given by its numbers among `rows`.
    fn new(
        set: &str,
        (a, b): (usize, usize),
        engines: [Engine; 2],
        rows: &TrialColumns,
        pairs: &[PairSummary],
    ) -> Self {
        let names = [&rows.names[a], &rows.names[b]];
        let pair = pairs
            .iter()
            .find(|pair| names.contains(&&pair.a) && names.contains(&&pair.b));
        // The first controller of a pair is the one that recovers more often.
        let is_swapped = pair.is_some_and(|pair| pair.a != rows.names[a]);
        let ours = |counts: PairedCounts| if is_swapped { counts.swapped() } else { counts };
        let counts = pair.map_or(PairedCounts::default(), |pair| ours(pair.counts));
        let mut strata = Vec::new();
        for stratum in pair.iter().flat_map(|pair| &pair.strata) {
            let counts = ours(stratum.counts);
            strata.push(StratumAgreement {
                by: stratum.by,
                label: stratum.label.clone(),
                counts,
                agreed: Agreed::of(&counts),
            });
        }
        let mut parted = Vec::new();
        for (trial, (a, b)) in rows.common(a, b).enumerate() {
            if a.has_recovered() == b.has_recovered() {
                continue;
            }
            parted.push(PartedTrial {
                trial: trial as u64,
                impulse_n_s: rows.impulse_n_s(trial),
                impulse_over_m_omega_d: a.impulse_over_m_omega_d(),
                heading_deg: rows.heading_deg(trial),
                recovered_in: engines[usize::from(b.has_recovered())],
                outcomes: [a.outcome, b.outcome],
                footsteps: [a.footsteps, b.footsteps],
                traced: false,
                parting: None,
            });
        }
        Self {
            set: set.into(),
            counts,
            agreed: Agreed::of(&counts),
            strata,
            parted,
        }
    }
}

/// The verdict on every pair of controllers of a result, as the result itself states it.
fn own_verdicts(manifest: &Manifest, rows: &TrialColumns) -> Vec<EngineVerdict> {
    let pairs = every_pair(manifest.sets.len());
    PairSummary::all(rows, &pairs, &[], DecisionRule::of(manifest))
        .into_iter()
        .map(|pair| EngineVerdict {
            a: pair.a,
            b: pair.b,
            verdict: pair.verdict,
            difference: pair.difference,
            words: pair.words,
        })
        .collect()
}

/// Pairs of different verdicts on the same two controllers. Either another controller is better, or only one of the two
/// results decides.
fn differing([of_a, mut of_b]: [Vec<EngineVerdict>; 2]) -> Vec<[EngineVerdict; 2]> {
    let mut differing = Vec::new();
    for in_a in of_a {
        let names = [&in_a.a, &in_a.b];
        let Some(place) = of_b
            .iter()
            .position(|in_b| names == [&in_b.a, &in_b.b] || names == [&in_b.b, &in_b.a])
        else {
            continue;
        };
        let in_b = of_b.swap_remove(place);
        let contradict = in_a.verdict == PairVerdict::Better && in_a.a != in_b.a;
        if in_a.verdict != in_b.verdict || contradict {
            differing.push([in_a, in_b]);
        }
    }
    differing
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fixtures::compared;

    use standfast_sim::episode::Outcome::{Fell, Recovered};

    /// "hold" recovers from 20 trials in both engines, from 5 in Rapier alone, from 10 in MuJoCo alone, and from 15 in
    /// neither; "catch" recovers from all trials in both engines.
    #[test]
    fn trials_are_counted_by_engine_whichever_recovers_more() {
        let hold = [
            ([true, true], 20),
            ([true, false], 5),
            ([false, true], 10),
            ([false, false], 15),
        ];
        let trials: Vec<_> = hold
            .into_iter()
            .flat_map(|([a, b], count)| vec![[a, true, b, true]; count])
            .collect();
        let agreement = compared(&trials).0.agreement.unwrap();
        let [hold, catch] = &agreement.sets[..] else {
            panic!()
        };
        assert_eq!((&hold.set[..], &catch.set[..]), ("hold", "catch"));
        assert_eq!(
            hold.counts,
            PairedCounts {
                both: 20,
                only_a: 5,
                only_b: 10,
                neither: 15
            }
        );
        assert!(
            (hold.agreed.kappa.unwrap() - 0.4).abs() < 1e-12,
            "{:?}",
            hold.agreed
        );
        assert_eq!(
            agreement.headline(),
            "Rapier and MuJoCo agree on 70.0 % (hold) to 100.0 % (catch) of trials."
        );
        assert_eq!(
            (catch.agreed.agree, catch.agreed.kappa, catch.parted.len()),
            (1.0, None, 0)
        );
        let sums: u64 = hold
            .strata
            .iter()
            .filter(|of| of.by == "heading")
            .map(|of| of.counts.only_b)
            .sum();
        assert_eq!(sums, 10, "strata are swapped like the whole");
        let parted: Vec<_> = hold
            .parted
            .iter()
            .map(|of| (of.trial, of.recovered_in, of.outcomes))
            .collect();
        assert_eq!(
            (parted.len(), parted[0]),
            (15, (20, Engine::Rapier, [Recovered, Fell]))
        );
        assert_eq!(parted[5], (25, Engine::Mujoco, [Fell, Recovered]));
    }

    #[test]
    fn verdicts_that_hold_in_one_engine_only_are_told() {
        for (of_each_trial, expected) in [
            ([false, true, false, true], None),
            (
                [false, true, true, true],
                Some([
                    "A verdict holds in one engine only. Rapier: catch is better than hold by 100.0",
                    " MuJoCo: hold and catch: not resolved.",
                ]),
            ),
            (
                [false, true, true, false],
                Some([
                    "The two engines contradict each other. Rapier: catch is",
                    " MuJoCo: hold is better than catch by",
                ]),
            ),
        ] {
            let warnings = compared(&[of_each_trial; 40])
                .0
                .agreement
                .unwrap()
                .warnings();
            assert_eq!(
                warnings.len(),
                usize::from(expected.is_some()),
                "{warnings:?}"
            );
            for (warning, [start, part]) in warnings.iter().zip(expected) {
                assert!(
                    warning.starts_with(start) && warning.contains(part),
                    "{warning}"
                );
            }
        }
    }
}
