//! Runs the episodes of a trial, and makes its rows.

use super::PreparedCampaign;
use crate::ask::trial;
use crate::store::manifest::Manifest;
use crate::store::row::{Repeats, TrialRow};
use standfast_core::error::Result;
use standfast_core::socket::PreparedController;
use standfast_sim::episode::{ClosedLoop, Disturbance, Outcome, Record, caught};
use std::time::Instant;

/// A controller that cannot be copied runs every 50th trial twice, to see whether the trial repeats to the bit.
const TRIED_AGAIN: u64 = 50;

impl PreparedCampaign {
    /// The beginning of the episodes of all controllers, if all trials begin alike.
    pub(crate) fn opening<'a>(
        &'a self,
        factories: &'a [PreparedController],
    ) -> Option<ClosedLoop<'a>> {
        let campaign = &self.manifest.campaign;
        trial::begin_alike(campaign).then(|| {
            let disturbance = trial::disturbance(campaign, 0);
            let push_s = disturbance.pushes[0].start_s;
            let entrants = factories.iter().zip(&self.entrants);
            let entrants = entrants.map(|(factory, &(_, engine))| (factory, engine));
            ClosedLoop::of_entrants(&self.robot, entrants, &campaign.episode, disturbance)
                .before(push_s)
        })
    }

    /// Runs the episodes of a trial with some controllers, given by their numbers in ascending order. The episodes
    /// continue `opening`, if there is one. Errors and panics are as in [`each_caught`].
    pub(crate) fn records(
        &self,
        factories: &[PreparedController],
        opening: Option<&ClosedLoop>,
        disturbance: Disturbance,
        controllers: &[usize],
    ) -> Result<Vec<Record>> {
        let episode = &self.manifest.campaign.episode;
        each_caught(controllers, |controllers| {
            let shared =
                opening.and_then(|opening| opening.with(controllers, disturbance.pushes.clone()));
            let own = || {
                let entrants = controllers
                    .iter()
                    .map(|&controller| (&factories[controller], self.entrants[controller].1));
                ClosedLoop::of_entrants(&self.robot, entrants, episode, disturbance.clone())
            };
            shared.unwrap_or_else(own).finish()
        })
    }

    /// The time that a trial takes with all controllers on one core of this machine (s). It is measured on up to 8
    /// trials, and no new trial begins after half a second.
    pub fn seconds_a_trial(&self) -> Result<f64> {
        const SAMPLE: u64 = 8;
        const LONG_S: f64 = 0.5;
        let factories = self.factories()?;
        let all: Vec<usize> = (0..self.manifest.controllers.len()).collect();
        let start = Instant::now();
        let mut trials = 0;
        while trials == 0
            || trials < SAMPLE.min(self.manifest.campaign.trials)
                && start.elapsed().as_secs_f64() < LONG_S
        {
            self.rows(&factories, None, trials, &all)?;
            trials += 1;
        }
        Ok(start.elapsed().as_secs_f64() / trials as f64)
    }

    /// The rows of a trial with some controllers, given by their numbers in ascending order. Errors are those of
    /// [`records`](Self::records).
    pub(crate) fn rows(
        &self,
        factories: &[PreparedController],
        opening: Option<&ClosedLoop>,
        trial: u64,
        controllers: &[usize],
    ) -> Result<Vec<TrialRow>> {
        let Manifest {
            campaign,
            controllers: names,
            ..
        } = &self.manifest;
        let pushes = trial::pushes(campaign, trial);
        let variation = trial::variation(campaign, trial);
        let no_step_n_s = self.no_step.impulse_n_s(pushes[0].heading_deg);
        let hardness = pushes[0].impulse_n_s / no_step_n_s.unwrap_or(1.0);
        let records = match campaign.synthetic {
            true => controllers
                .iter()
                .map(|&controller| trial::synthetic(campaign, trial, controller, hardness))
                .collect(),
            false => self.records(
                factories,
                opening,
                trial::disturbance(campaign, trial),
                controllers,
            )?,
        };
        let mut rows = Vec::new();
        for (&controller, record) in controllers.iter().zip(records) {
            let repeats = self.repeats(factories, trial, controller, &record)?;
            rows.push(TrialRow {
                repeats,
                ..TrialRow::new(
                    trial,
                    &names[controller],
                    &pushes,
                    no_step_n_s,
                    variation,
                    record,
                )
            });
        }
        Ok(rows)
    }

    /// Whether a second run of a trial with a controller has the same record. It is None if there was no second run.
    /// There is one only in every [`TRIED_AGAIN`]th trial, and only for controllers that cannot be copied, because
    /// their memory is hidden.
    fn repeats(
        &self,
        factories: &[PreparedController],
        trial: u64,
        controller: usize,
        record: &Record,
    ) -> Result<Option<Repeats>> {
        let campaign = &self.manifest.campaign;
        if campaign.synthetic
            || !trial.is_multiple_of(TRIED_AGAIN)
            || factories[controller].can_be_copied()
        {
            return Ok(None);
        }
        let again = self.records(
            factories,
            None,
            trial::disturbance(campaign, trial),
            &[controller],
        )?;
        // As text, since NaN is not equal to itself.
        let is_same = format!("{:?}", again[0]) == format!("{record:?}");
        Ok(Some(if is_same { Repeats::Yes } else { Repeats::No }))
    }
}

/// The records that `run` gives of some controllers. If one of them panics, all are run again, each alone, and the
/// record of the one that panics is `Diverged`, with the panic as its cause. Errors are those of `run`.
pub(crate) fn each_caught<T: Copy>(
    controllers: &[T],
    run: impl Fn(&[T]) -> Result<Vec<Record>>,
) -> Result<Vec<Record>> {
    if let Ok(records) = caught(|| run(controllers)) {
        return records;
    }
    let mut records = Vec::new();
    for controller in controllers {
        records.push(match caught(|| run(&[*controller])) {
            Ok(record) => record?.remove(0),
            Err(panic) => Record {
                outcome: Outcome::Diverged,
                fall_cause: Some(panic),
                ..Record::default()
            },
        });
    }
    Ok(records)
}
