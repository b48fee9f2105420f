//! How many of the pushes that a controller loses could have been caught: a clairvoyant tries each of them again and
//! again on the same robot and ground.
//!
//! The clairvoyant is the controller itself with other numbers for its first footsteps: when which foot is lifted,
//! where and when it lands, where the ZMP is meanwhile, and how trunk and COM move ([`Departure`]). CMA-ES
//! ([`CmaEs`](crate::cma_es)) changes these numbers until the robot recovers or the tries are used up. The clairvoyant
//! knows the push, the robot and the ground, since it has tried them before. But it moves only after the push has
//! begun, and it has the same rules and readings as the controller.
//!
//! A recovery counts if it is no luck: if it also holds for most of the [`NEIGHBOURS`], pushes that are a little weaker or
//! harder, earlier or later, with other noise of the sensors. The search maximises the number of neighbours that are survived.
//! A push that the clairvoyant so catches can be caught. A push that the clairvoyant loses proves nothing.

use crate::ask::bounds::in_range;
use crate::ask::spec::Campaign;
use crate::ask::trial;
use crate::batch::{Batch, Jobs, SearchTask};
use crate::cma_es::CmaEs;
use crate::limit::PendulumBounds;
use crate::plan::{PreparedCampaign, each_caught, pool};
use nalgebra::DVector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::json;
use standfast_controllers::{depart, gain_set};
use standfast_core::error::{Error, Result};
use standfast_core::lipm::GainSet;
use standfast_core::lipm::catching::{DEPARTURES, Departure, Departures};
use standfast_core::socket::PreparedController;
use standfast_robots::urdf::Files;
use standfast_sim::Push;
use standfast_sim::episode::{ClosedLoop, Disturbance, Footstep, Outcome, Record};
use standfast_stats::rate::SuccessCount;

/// Number of search variables: all numbers of all departures.
const NUMBERS: usize = DEPARTURES * Departure::NUMBERS;
/// First spread of each number of a departure, in the order of [`Departure::numbers`].
const SPREAD: [f64; Departure::NUMBERS] = [
    0.02, 0.03, 0.03, 0.06, 0.06, 0.03, 0.03, 0.15, 0.1, 0.1, 0.03,
];
/// Number of tries in one generation of CMA-ES.
const GENERATION: usize = 24;
/// Number of neighbours of a push, and how many of them a recovery has to survive.
pub const NEIGHBOURS: usize = 8;
pub const HELD: usize = 6;
/// First step size of CMA-ES, in spreads. A search that has converged starts again with this step size.
const STEP: f64 = 1.0;

/// Settings of the search.
#[derive(Debug, Clone, Copy)]
pub struct CeilingOptions {
    /// Most tries for one push.
    pub tries: u64,
    /// Number of threads; 0 means one per core.
    pub threads: usize,
    /// Whether the controller runs that has not been tried without a push.
    pub untried: bool,
}

/// Most tries for one push.
pub const MOST_TRIES: u64 = 1_000_000;

/// The trials of a campaign with a controller that catches, to be tried by the clairvoyant if they are lost.
pub struct CeilingSearch<'a> {
    campaign: &'a Campaign,
    options: CeilingOptions,
    plan: PreparedCampaign,
    gains: GainSet,
    pendulum_bounds: PendulumBounds,
    /// One for each trial.
    pub jobs: Jobs,
}

/// The result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ceiling {
    pub campaign: String,
    pub robot: String,
    /// Name and version of the physics engine.
    pub engine: String,
    pub seed: u64,
    pub controller: String,
    pub trials: u64,
    /// Numbers of trials from which the controller recovers alone, and from which the controller or the clairvoyant
    /// recovers.
    pub alone: SuccessCount,
    pub with_search: SuccessCount,
    /// COM height (m), the unit of the departures' lengths.
    pub com_height_m: f64,
    /// Most tries for one push.
    pub tries: u64,
    /// The trials that the controller loses.
    pub lost: Vec<LostTrial>,
}

/// A trial that the controller loses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LostTrial {
    pub trial: u64,
    pub impulse_n_s: f64,
    pub heading_deg: f64,
    /// Ratio of the impulse to the pendulum's bounds with one footstep and with any number.
    pub of_one_step_bound: Option<f64>,
    pub of_n_step_bound: Option<f64>,
    pub fell_at_s: Option<f64>,
    pub footsteps: Vec<Footstep>,
    /// Number of neighbours that the controller survives alone.
    pub alone_held: usize,
    /// Number of tries of the clairvoyant.
    pub tries: u64,
    /// The largest number of neighbours that a recovery from the push survived; None if none was found.
    pub most_held: Option<usize>,
    /// How it recovers from the push and from [`HELD`] neighbours or more; None if it does not.
    pub found: Option<Recovery>,
}

/// How the clairvoyant recovers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recovery {
    /// Number of neighbours that are survived.
    pub held: usize,
    /// The departures that the recovery needs: any number whose removal the robot survives is set to zero.
    pub departures: Vec<Departure>,
    pub footsteps: Vec<Footstep>,
}

impl<'a> CeilingSearch<'a> {
    /// Reads the controller, which must be a gain set with footsteps by the rule `[catching]`, and runs nothing.
    pub fn new(campaign: &'a Campaign, files: Files, options: CeilingOptions) -> Result<Self> {
        in_range(
            "command line",
            "--tries",
            options.tries as f64,
            [1.0, MOST_TRIES as f64],
        )?;
        let [entry] = &campaign.controllers[..] else {
            unreachable!("a search has one controller")
        };
        let gains = gain_set(entry)?;
        if gains.catching.is_none() {
            let accepted = "a gain set with the table [catching], such as catch";
            return Err(Error::value(
                "command line",
                "--controller",
                entry,
                "has no table [catching]",
                accepted,
            ));
        }
        let plan = PreparedCampaign::with(campaign, files)?;
        let pendulum_bounds = PendulumBounds::new(&plan.robot, campaign);
        let jobs = Jobs::kept_one_by_one("trial", campaign.trials as usize);
        Ok(Self {
            campaign,
            options,
            plan,
            gains,
            pendulum_bounds,
            jobs,
        })
    }

    /// The gain set with the clairvoyant's departures, which recovers from the push of this trial.
    pub fn gains(&self, trial: u64, recovery: &Recovery) -> GainSet {
        let mut gains = self.gains.clone();
        gains.name = format!("trial-{trial}");
        gains.description = format!(
            "Trial {trial} of campaign {}, caught with knowledge of the push",
            self.campaign.name
        );
        if let Some(catching) = &mut gains.catching {
            catching.departures = recovery.departures.clone();
        }
        gains
    }

    /// The task, on which the folder of a result depends.
    pub fn task(&self) -> SearchTask {
        SearchTask {
            command: "ceiling".into(),
            options: json!({ "trials": self.campaign.trials, "tries": self.options.tries }),
            manifest: self.plan.manifest.clone(),
        }
    }

    /// Prepares the controller and tries it without a push, unless that is done. Fails if the robot falls.
    pub fn controller(&self) -> Result<&PreparedController> {
        Ok(&self.plan.tried_factories(self.options.untried)?[0])
    }

    /// Runs the trials of this shard that the folder lacks, and searches for those that are lost. Returns the result as
    /// soon as the trials of all shards are there.
    pub fn run(&self, batch: &Batch) -> Result<Option<Ceiling>> {
        let Self {
            campaign,
            options,
            plan,
            ..
        } = self;
        if !batch.lacks(&self.jobs).is_empty() {
            let factory = self.controller()?;
            pool(options.threads, plan.open_episodes())?.install(|| {
                batch.run(&self.jobs, |trial| self.lost(factory, trial as u64, batch))
            })?;
        }
        let Some(lost) = batch.results::<Option<LostTrial>>(&self.jobs)? else {
            return Ok(None);
        };
        let lost: Vec<LostTrial> = lost.into_iter().flatten().collect();
        let recovered = campaign.trials - lost.len() as u64;
        let caught = lost.iter().filter(|lost| lost.found.is_some()).count() as u64;
        Ok(Some(Ceiling {
            campaign: campaign.name.clone(),
            robot: campaign.robot.clone(),
            engine: plan.manifest.engine(),
            seed: campaign.seed,
            controller: plan.manifest.controllers[0].clone(),
            trials: campaign.trials,
            alone: SuccessCount::new(recovered, campaign.trials),
            with_search: SuccessCount::new(recovered + caught, campaign.trials),
            com_height_m: self.pendulum_bounds.com_height_m,
            tries: options.tries,
            lost,
        }))
    }

    /// Runs a trial, and searches a recovery if the controller loses it. Returns None if the controller recovers.
    fn lost(
        &self,
        factory: &PreparedController,
        number: u64,
        batch: &Batch,
    ) -> Result<Option<LostTrial>> {
        let Self {
            campaign,
            plan,
            pendulum_bounds,
            ..
        } = self;
        let begin = |disturbance: Disturbance| {
            let pushes = disturbance.pushes.clone();
            let begun = ClosedLoop::new(&plan.robot, [factory], &campaign.episode, disturbance);
            (begun.before(pushes[0].start_s), pushes)
        };
        let mut again = RepeatedTrial {
            begun: vec![begin(trial::disturbance(campaign, number))],
            batch,
        };
        let record = again.record(0, &Departures::default());
        if record.outcome.is_success() {
            return Ok(None);
        }
        for neighbour in 0..NEIGHBOURS {
            again.begun.push(begin(trial::neighbour(
                campaign, number, neighbour, NEIGHBOURS,
            )));
        }
        let held = |lost: &[Record]| NEIGHBOURS - lost.len();
        let alone_held = held(&again.lost_neighbours(&Departures::default()));
        let Found {
            tries,
            most_held,
            recovery,
        } = self.search(number, &again)?;
        let Push {
            impulse_n_s,
            heading_deg,
            ..
        } = again.begun[0].1[0];
        let bounds = pendulum_bounds.heading(heading_deg);
        Ok(Some(LostTrial {
            trial: number,
            impulse_n_s,
            heading_deg,
            of_one_step_bound: bounds
                .bound_one_step_n_s
                .map(|bound_n_s| impulse_n_s / bound_n_s),
            of_n_step_bound: bounds
                .bound_n_step_n_s
                .map(|bound_n_s| impulse_n_s / bound_n_s),
            fell_at_s: record.fell_at_s,
            footsteps: record.footsteps.taken,
            alone_held,
            tries,
            most_held,
            found: recovery,
        }))
    }

    /// Searches departures with which the robot recovers from the push and from most of its neighbours.
    fn search(&self, number: u64, again: &RepeatedTrial) -> Result<Found> {
        let begin = |round: u64| {
            let seed = self.campaign.seed ^ number.rotate_left(20) ^ round.rotate_left(50);
            CmaEs::new(vec![0.0; NUMBERS], STEP, GENERATION, seed)
        };
        let (mut tries, mut round, mut most_held) = (0, 0, None);
        let mut search = begin(round);
        while tries < self.options.tries {
            again.batch.go_on()?;
            let points = search.ask();
            let tried = |point: &DVector<f64>| self.tried(again, &departures(point.as_slice()));
            let (costs, held): (Vec<f64>, Vec<Option<usize>>) =
                points.par_iter().map(tried).unzip();
            tries += GENERATION as u64;
            let best = (0..held.len()).max_by_key(|i| (held[*i], std::cmp::Reverse(*i)));
            let best = best.filter(|best| held[*best].is_some());
            most_held = most_held.max(best.and_then(|best| held[best]));
            if let Some(best) = best.filter(|best| held[*best] >= Some(HELD)) {
                return Ok(Found {
                    tries,
                    most_held,
                    recovery: Some(self.simplest(again, points[best].as_slice())),
                });
            }
            search.tell(&points, &costs);
            // A search that has converged starts again with other random numbers.
            if search.has_converged() {
                round += 1;
                search = begin(round);
            }
        }
        Ok(Found {
            tries,
            most_held,
            recovery: None,
        })
    }

    /// The cost of departures, and how many neighbours are survived; None if the push itself is not. The cost is that of the
    /// push, and if the push is survived, the share of the neighbours that are lost; the later they fall, the less.
    fn tried(&self, again: &RepeatedTrial, departures: &Departures) -> (f64, Option<usize>) {
        let record = again.record(0, departures);
        if !record.outcome.is_success() {
            return (self.cost(&record), None);
        }
        let lost = again.lost_neighbours(departures);
        let most = 2.0 + self.campaign.episode.horizon_s;
        let cost: f64 = lost
            .iter()
            .map(|record| 0.5 + 0.5 * self.cost(record) / most)
            .sum();
        (cost / NEIGHBOURS as f64, Some(NEIGHBOURS - lost.len()))
    }

    /// Sets the numbers of a recovery to zero one after the other, and keeps each zero with which enough neighbours are
    /// survived.
    fn simplest(&self, again: &RepeatedTrial, numbers: &[f64]) -> Recovery {
        let mut numbers = numbers.to_vec();
        let held_with = |numbers: &[f64]| self.tried(again, &departures(numbers)).1;
        for i in 0..numbers.len() {
            let kept = std::mem::take(&mut numbers[i]);
            if held_with(&numbers) < Some(HELD) {
                numbers[i] = kept;
            }
        }
        let held = held_with(&numbers).unwrap_or_default();
        let footsteps = again.record(0, &departures(&numbers)).footsteps.taken;
        let mut departures = departures(&numbers).to_vec();
        while departures
            .pop_if(|last| *last == Departure::default())
            .is_some()
        {}
        Recovery {
            held,
            departures,
            footsteps,
        }
    }

    /// How far an episode is from recovery: 0 if the robot recovers, and the larger the sooner it falls.
    fn cost(&self, record: &Record) -> f64 {
        match record.outcome {
            outcome if outcome.is_success() => 0.0,
            outcome if outcome.is_lost() => {
                1.0 + self.campaign.episode.horizon_s - record.fell_at_s.unwrap_or(record.end_s)
            }
            Outcome::Diverged | Outcome::Failed => 2.0 + self.campaign.episode.horizon_s,
            _ => 1.0,
        }
    }
}

/// The end of a search.
struct Found {
    tries: u64,
    most_held: Option<usize>,
    recovery: Option<Recovery>,
}

/// A trial and its neighbours, each up to its push, to be run on again and again.
struct RepeatedTrial<'a> {
    /// The trial first.
    begun: Vec<(ClosedLoop<'a>, Vec<Push>)>,
    batch: &'a Batch<'a>,
}

impl RepeatedTrial<'_> {
    /// The record of number `which` of `begun`.
    fn record(&self, which: usize, departures: &Departures) -> Record {
        let (begun, pushes) = &self.begun[which];
        let run = |controllers: &[usize]| {
            let again = begun.with(controllers, pushes.clone());
            let mut again = again.expect("a gain set's controller can be copied");
            for controller in again.controllers() {
                depart(controller, departures);
            }
            again.finish()
        };
        let record = each_caught(&[0], run)
            .expect("a gain set has no process")
            .remove(0);
        (self.batch.on_episode)();
        record
    }

    /// The records of the neighbours that are lost.
    fn lost_neighbours(&self, departures: &Departures) -> Vec<Record> {
        let records = (1..self.begun.len()).map(|which| self.record(which, departures));
        records
            .filter(|record| !record.outcome.is_success())
            .collect()
    }
}

/// The departures that the numbers of the search stand for.
fn departures(numbers: &[f64]) -> Departures {
    std::array::from_fn(|footstep| {
        let numbers = &numbers[footstep * Departure::NUMBERS..];
        Departure::of_numbers(std::array::from_fn(|i| SPREAD[i] * numbers[i]))
    })
}
