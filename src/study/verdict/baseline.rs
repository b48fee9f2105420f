//! Reads the earlier result with which gates compare, and checks whether two results can be compared at all.
//!
//! Two results can be compared only if their trials are the same. So their seeds, distributions and judges must be
//! equal. Every push is then equal to the bit, since each part is checked against what its campaign draws.

use crate::ask::entrant::Entrant;
use crate::ask::spec::Campaign;
use crate::store::folder::Folder;
use crate::store::manifest::{Manifest, differences};
use crate::verdict::trial_columns::{EpisodeEnd, TrialColumns};
use serde::Serialize;
use serde_json::Value;
use standfast_core::error::{Error, Result};
use standfast_sim::Engine;
use std::path::Path;

/// Largest number of differences between two campaigns that an error names.
const SHOWN: usize = 4;

/// An earlier result with the same pushes.
pub struct Baseline {
    pub manifest: Manifest,
    rows: TrialColumns,
}

/// What a report states about the baseline.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaselineId {
    pub name: String,
    /// Version of the program.
    pub standfast: String,
    pub config_hash: String,
    pub trials: u64,
}

impl Baseline {
    /// Opens a baseline for the campaign `ours`. It fails if the baseline is not complete, or if it has other trials
    /// than `ours`.
    pub fn open(path: &Path, ours: &Manifest) -> Result<Baseline> {
        let mut folder = Folder::existing(path)?;
        let campaign = &ours.campaign;
        refuse_other_trials(&folder, campaign)?;
        refuse_other_engines(&folder, ours)?;
        let mut rows = TrialColumns::new(&folder.manifest.controllers, &campaign.episode);
        for part in folder.parts()? {
            rows.push(&part?);
        }
        // The entrants of a packed result state their engines, and ours need not.
        if let (true, [engine]) = (folder.is_packed(), &campaign.different_engines()[..]) {
            for name in rows
                .names
                .iter_mut()
                .chain(&mut folder.manifest.controllers)
            {
                let entrant = Entrant::split(name);
                if entrant.engine == Some(*engine)
                    && ours.controllers.iter().any(|own| own == entrant.controller)
                {
                    *name = entrant.controller.into();
                }
            }
        }
        Ok(Baseline {
            manifest: folder.manifest,
            rows,
        })
    }

    /// Number of trials. A controller that was stopped earlier has fewer.
    pub fn trials(&self) -> u64 {
        self.rows.trials()
    }

    /// What a report states about the baseline.
    pub fn id(&self) -> BaselineId {
        let Manifest {
            standfast,
            config_hash,
            campaign,
            ..
        } = &self.manifest;
        let (name, trials) = (campaign.name.clone(), self.trials());
        BaselineId {
            name,
            standfast: standfast.clone(),
            config_hash: config_hash.clone(),
            trials,
        }
    }

    /// Whether the baseline ended when it was decided. Then its number of trials depends on its outcomes.
    pub fn is_sequential(&self) -> bool {
        self.manifest.campaign.stopping.until_resolved
    }

    /// How the trials of a controller ended, from trial 0. It is empty if the baseline does not have the controller.
    pub fn rows_of(&self, controller: &str) -> &[EpisodeEnd] {
        self.rows
            .names
            .iter()
            .position(|name| name == controller)
            .map_or(&[], |controller| self.rows.of(controller))
    }
}

/// Says why two results are hard to compare although their trials are the same: they differ in more than their
/// controllers, or in nothing.
pub fn unlike(a: &Manifest, b: &Manifest) -> Vec<String> {
    let robots = [a, b].map(|m| format!("{} ({:.8})", m.campaign.robot, m.robot_sha256));
    let versions = [a, b].map(|m| m.standfast.clone());
    let engines = [a, b].map(Manifest::engine);
    let steps = [a, b].map(|m| format!("{} s", m.campaign.episode.physics_step_s));
    let mut reasons = Vec::new();
    for (what, [of_a, of_b]) in [
        ("robots", robots),
        ("versions of standfast", versions),
        ("physics engines", engines),
        ("steps of the physics", steps),
    ] {
        if of_a != of_b {
            reasons.push(format!("the {what} differ: {of_a} and {of_b}"));
        }
    }
    if a.config_hash == b.config_hash {
        reasons.push(
            "both results have the same inputs: a difference can only come from another build of standfast"
                .into(),
        );
    }
    reasons
}

/// Fails if the trials of `folder` are not drawn and judged as the trials of `campaign`.
pub(super) fn refuse_other_trials(folder: &Folder, campaign: &Campaign) -> Result<()> {
    let mut differing = Vec::new();
    differences(
        "",
        &drawn(campaign),
        &drawn(&folder.manifest.campaign),
        &mut differing,
    );
    if differing.is_empty() {
        return Ok(());
    }
    let more = match differing.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!("; and {more} more differ"),
    };
    differing.truncate(SHOWN);
    let problem = format!(
        "its trials are not the same, so they cannot be compared in pairs: {}{more}",
        differing.join("; ")
    );
    Err(Error::Parts {
        path: folder.name().into(),
        problem,
    })
}

/// Fails if an entrant of `ours` ran in another engine in `folder`, which its name need not state.
fn refuse_other_engines(folder: &Folder, ours: &Manifest) -> Result<()> {
    let theirs = &folder.manifest;
    for (name, here) in ours.controllers.iter().zip(ours.campaign.engines()) {
        let place = theirs
            .controllers
            .iter()
            .position(|controller| controller == name);
        let there = place.map(|place| theirs.campaign.engines()[place]);
        if let Some(there) = there.filter(|there| *there != here) {
            let [there, here] = [there, here].map(Engine::title);
            let problem = format!(
                "{name} was simulated by {there} there and by {here} here; name it with its engine"
            );
            return Err(Error::Parts {
                path: folder.path.clone(),
                problem,
            });
        }
    }
    Ok(())
}

/// The settings of a campaign on which its trials and their judgement depend.
fn drawn(campaign: &Campaign) -> Value {
    let mut drawn = serde_json::json!({
        "seed": campaign.seed,
        "push": campaign.push,
        "second_push": campaign.second_push,
        "variations": campaign.variations,
        "sensors": campaign.sensors,
        "episode": campaign.episode,
    });
    // Whoever compares engines or their steps compares the same trials.
    for key in ["engine", "physics_step_s"] {
        drawn["episode"][key].take();
    }
    drawn
}
