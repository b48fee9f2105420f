//! From a controller to a better one: its numbers are searched on the trials of a campaign, and what is found is judged by
//! trials that the search has never seen.
//!
//! The seeds of both follow from one seed before anything runs, and are written down ([`Task`]). The [search] sees
//! only trials of the first; the second is used once, by an ordinary campaign of the incumbent and what the search
//! proposes. That campaign's exact test is the result, and "no better one was found" is one, too. Several robots, or both
//! engines, can be cases of one search: then the worst case of a candidate counts.

pub mod draw;
pub mod race;
pub mod response;
pub mod search;
pub mod team;

use crate::campaign::ask::spec::Campaign;
use crate::campaign::ask::trial;
use crate::campaign::plan::{Plan, each_caught, pool};
use crate::campaign::store::shard::Shard;
use crate::campaign::verdict::summary::Summary;
use crate::contest::tunable::Tunable;
use crate::contest::values::{number_to_vary, with_values};
use crate::contest::{self, Settings};
use crate::episode::ClosedLoop;
use crate::error::{Error, Result};
use crate::files::{json_pretty, write_atomic};
use crate::robot::Factory;
use crate::robot::urdf::Files;
use draw::Sample;
use race::{Drawn, Tally};
use response::Effect;
use search::{Arena, Generation, Search, least_episodes};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use team::{Team, read};

/// The file of the task.
const TASK: &str = "task.json";
/// Trials of the incumbent alone, by which later trials are chosen.
const SAMPLE: u64 = 200;
/// Halvings of a range that a controller names itself, until both ends can be used.
const HALVINGS: usize = 8;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct TuneOptions {
    /// `KEY=FROM..TO` or `KEY`; without any, all that the controller names.
    pub vary: Vec<String>,
    pub budget: Budget,
    /// Trials of the final campaign.
    pub trials: u64,
    /// Number of threads; 0 means one for each core.
    pub threads: usize,
    /// Whether a controller is tuned that falls without a push.
    pub untried: bool,
    /// The share of this program, if several run the search together.
    pub shard: Option<Shard>,
}

/// Functions that are called during a search, and a flag that stops it.
pub struct Watch<'a> {
    /// Somebody sets this to stop the search early.
    pub stop: &'a AtomicBool,
    /// Called after every episode that is run here, from any thread.
    pub on_episode: &'a (dyn Fn() + Sync),
    /// Called after each generation, first of those that are there, with the spread of the samples and the episodes so far.
    pub on_generation: &'a (dyn Fn(&Generation, f64, u64) + Sync),
    /// Called where others are waited for, with the first shard that is missing.
    pub on_wait: &'a (dyn Fn(Shard) + Sync),
}

/// How much a search may cost, with its final campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    Episodes(u64),
    /// So many seconds on this machine, of which episodes are made before the search begins.
    Time(f64),
}

/// All that a search depends on, as it is written down before the search begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Task {
    pub standfast: String,
    pub controller: String,
    pub campaign: String,
    pub cases: Vec<CaseId>,
    pub tunables: Vec<Tunable>,
    pub seed: u64,
    /// The seed of the search, and that of the final campaign, which is used once.
    pub search_seed: u64,
    pub final_seed: u64,
    pub final_trials: u64,
    /// The budget as it was asked for: a time (s), or nothing if it was a number of episodes.
    pub budget_s: Option<f64>,
    /// Most episodes, those of the final campaign among them.
    pub episodes: u64,
}

/// A robot in an engine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaseId {
    pub robot: String,
    pub engine: String,
    /// Of the search's campaign, so of the robot's and the controller's files, too.
    pub config_hash: String,
}

/// The result.
#[derive(Debug, Clone, Serialize)]
pub struct Tuned {
    #[serde(flatten)]
    pub task: Task,
    /// Share of the sample from which the incumbent recovers, for each case.
    pub sampled: Vec<f64>,
    pub generations: Vec<Generation>,
    /// Episodes of the search.
    pub searched: u64,
    /// The proposed values, in the order of the tunable numbers.
    pub proposed: Vec<f64>,
    /// What each number does, fitted to all candidates that were tried.
    pub effects: Vec<Effect>,
    /// Name of the proposed controller.
    pub name: String,
    /// The verdict for each case; none if the proposed values are the present ones.
    pub verdicts: Vec<Verdict>,
    /// Whether the proposed controller is better in all cases.
    pub is_better: bool,
}

/// What the final campaign says of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    pub robot: String,
    pub engine: String,
    /// Its result folder, in that of the search.
    pub folder: String,
    pub trials: u64,
    /// From how many the incumbent and the proposed controller recover.
    pub recovered: [u64; 2],
    /// The rate of the proposed one less that of the incumbent, with its 95 % interval, and p of the exact McNemar test.
    pub difference: f64,
    pub ci95: [f64; 2],
    pub p: f64,
}

/// The level of the final test.
const LEVEL: f64 = 0.05;

impl Verdict {
    /// From the result of a final campaign with the incumbent and the proposed controller.
    pub fn of(case: &CaseId, folder: &str, summary: &Summary, proposed: &str) -> Option<Self> {
        let pair = summary.pairs.first()?;
        let counts = if pair.a == proposed { pair.counts } else { pair.counts.swapped() };
        Some(Self {
            robot: case.robot.clone(),
            engine: case.engine.clone(),
            folder: folder.into(),
            trials: counts.trials(),
            recovered: [counts.both + counts.only_b, counts.both + counts.only_a],
            difference: counts.difference(),
            ci95: counts.difference_interval(1.0 - LEVEL),
            p: counts.mcnemar_p(),
        })
    }

    pub fn is_better(&self) -> bool {
        self.difference > 0.0 && self.p < LEVEL
    }
}

/// A search on its robots, checked and ready.
pub struct Tuning {
    pub task: Task,
    /// Whether its folder holds its beginning.
    pub goes_on: bool,
    folder: PathBuf,
    base: Box<dyn Settings>,
    /// Of each case, the campaign with the seed of the search.
    plans: Vec<Plan>,
    options: TuneOptions,
}

impl Tuning {
    /// Reads and checks everything. `campaigns` are the cases, all with the same single controller, each with the files of
    /// its robot. Errors: a controller without numbers to tune, a range that cannot be used, a budget that is too small, a
    /// folder that holds another search.
    pub fn new(campaigns: &[(Campaign, Files)], options: TuneOptions, folder: &Path) -> Result<Self> {
        let (first, _) = campaigns.first().expect("a search has a case");
        let [entry] = &first.gains[..] else { unreachable!("a search has one controller") };
        let base = contest::load(entry)?;
        let (search_seed, final_seed) = (trial::derived_seed(first.seed, 0), trial::derived_seed(first.seed, 1));
        let plan = |(campaign, files): &(Campaign, Files)| {
            Plan::with(&Campaign { seed: search_seed, ..campaign.clone() }, files.clone())
        };
        let plans = campaigns.iter().map(plan).collect::<Result<Vec<_>>>()?;
        let case = |plan: &Plan, (campaign, _): &(Campaign, Files)| CaseId {
            robot: campaign.robot.clone(),
            engine: plan.manifest.engine.clone(),
            config_hash: plan.manifest.config_hash.clone(),
        };
        let task = Task {
            standfast: env!("CARGO_PKG_VERSION").into(),
            controller: base.name().into(),
            campaign: first.name.clone(),
            cases: plans.iter().zip(campaigns).map(|(plan, campaign)| case(plan, campaign)).collect(),
            tunables: Vec::new(),
            seed: first.seed,
            search_seed,
            final_seed,
            final_trials: options.trials,
            budget_s: None,
            episodes: 0,
        };
        let there = read::<Task>(&folder.join(TASK))?;
        let mut tuning = Self { task, goes_on: there.is_some(), folder: folder.into(), base, plans, options };
        tuning.task.tunables = tuning.tunables()?;
        tuning.set_budget(there.as_ref())?;
        if there.is_some_and(|there| there != tuning.task) {
            let problem = "holds another search (its task differs); give a new folder, or remove this one";
            return Err(Error::Parts { path: folder.into(), problem: problem.into() });
        }
        Ok(tuning)
    }

    /// The numbers to tune, each with a range both ends of which can be used.
    fn tunables(&self) -> Result<Vec<Tunable>> {
        let (base, vary) = (&*self.base, &self.options.vary);
        let mut named = match vary.is_empty() {
            true => base.tunables(),
            false => vary.iter().map(|text| number_to_vary(text, base)).collect::<Result<_>>()?,
        };
        if named.is_empty() {
            let accepted = "--vary KEY=FROM..TO with a number of its file, or another controller";
            return Err(Error::option("CONTROLLER", base.name(), "names no number to tune", accepted));
        }
        if let Some(twice) = (1..named.len()).find(|&i| named[..i].iter().any(|other| other.key == named[i].key)) {
            return Err(Error::option("--vary", &named[twice].key, "is given twice", "each key once"));
        }
        for tunable in &mut named {
            for end in 0..2 {
                let mut refused = self.refuses(tunable, tunable.range[end])?;
                let mut left = HALVINGS;
                // A range that was not asked for is only a proposal.
                while vary.is_empty() && refused.is_some() && left > 0 {
                    tunable.range[end] = 0.5 * (tunable.range[end] + tunable.now);
                    refused = self.refuses(tunable, tunable.range[end])?;
                    left -= 1;
                }
                if let Some(error) = refused {
                    let Tunable { key, range: [from, to], .. } = &*tunable;
                    let problem = format!("its end {} cannot be used: {error}", tunable.range[end]);
                    return Err(Error::option("--vary", format!("{key}={from}..{to}"), problem, "a narrower range"));
                }
            }
        }
        Ok(named)
    }

    /// Why a number cannot have a value, if so.
    fn refuses(&self, tunable: &Tunable, value: f64) -> Result<Option<Error>> {
        self.prepared(&[(&tunable.key, value)]).err().map(Error::refusal).transpose()
    }

    /// The controller with these values, for each case.
    fn prepared(&self, values: &[(&str, f64)]) -> Result<Vec<Factory>> {
        let settings = with_values(&*self.base, self.base.name(), values)?;
        let prepare = |plan: &Plan| settings.prepare(&plan.robot, plan.manifest.campaign.episode.control_period_s);
        self.plans.iter().map(prepare).collect()
    }

    /// Makes episodes of the budget, and fails if they are too few. A search that was begun keeps to its number: a time
    /// would make another one on another day.
    fn set_budget(&mut self, there: Option<&Task>) -> Result<()> {
        let (cases, Task { tunables, final_trials, .. }) = (self.plans.len() as u64, &self.task);
        let search = least_episodes(tunables.len(), self.plans.len());
        let least = SAMPLE * cases + 2 * final_trials * cases + search;
        let (budget_s, episodes) = match self.options.budget {
            Budget::Episodes(episodes) => (None, episodes),
            Budget::Time(time_s) if self.options.shard.is_some() => {
                let (problem, accepted) = ("each shard would measure another pace", "a number of episodes");
                return Err(Error::option("--budget", format!("{time_s} s"), problem, accepted));
            }
            Budget::Time(time_s) if there.is_some_and(|there| there.budget_s == Some(time_s)) => {
                (Some(time_s), there.map_or(0, |there| there.episodes))
            }
            Budget::Time(time_s) => {
                let of_each = self.plans.iter().map(Plan::seconds_a_trial).collect::<Result<Vec<_>>>()?;
                let episode_s = of_each.iter().sum::<f64>() / cases as f64 / self.threads()? as f64;
                (Some(time_s), (time_s / episode_s) as u64)
            }
        };
        if episodes < least {
            let stated = budget_s.map_or(String::new(), |time_s| format!(", which {time_s} s allow"));
            let problem = format!("is too small for {} numbers and {final_trials} final trials", tunables.len());
            let accepted = format!("{least} episodes or more; fewer with --vary or --trials");
            return Err(Error::option("--budget", format!("{episodes} episodes{stated}"), problem, accepted));
        }
        (self.task.budget_s, self.task.episodes) = (budget_s, episodes);
        Ok(())
    }

    /// Episodes of the search that are in the folder already.
    pub fn episodes_there(&self) -> Result<u64> {
        let sample =
            read::<Vec<Vec<bool>>>(&self.folder.join("sample.json"))?.iter().flatten().map(Vec::len).sum::<usize>();
        let mut episodes = sample as u64;
        for number in 1.. {
            let Some(there) = read::<Generation>(&self.generation_file(number))? else { break };
            episodes += there.episodes;
        }
        Ok(episodes)
    }

    fn threads(&self) -> Result<usize> {
        Ok(pool(self.options.threads)?.current_num_threads())
    }

    /// Episodes of the final campaign, of all cases.
    pub fn final_episodes(&self) -> u64 {
        2 * self.task.final_trials * self.plans.len() as u64
    }

    /// Name of the controller that is proposed.
    pub fn name(&self) -> String {
        format!("{}-tuned", self.base.name())
    }

    /// Searches, from where the folder stopped if anything is there. What is finished is written to the folder, so that the
    /// same command goes on. Fails if it is stopped from outside, or if the robot falls without a push.
    pub fn search(&self, watch: &Watch) -> Result<Tuned> {
        if !self.goes_on {
            write_atomic(&self.folder.join(TASK), json_pretty(&self.task)?.as_bytes())?;
        }
        pool(self.options.threads)?.install(|| self.searched(watch))
    }

    fn searched(&self, watch: &Watch) -> Result<Tuned> {
        let Self { options, folder, .. } = self;
        let team = Team { shard: options.shard, folder, stop: watch.stop, on_wait: watch.on_wait };
        let sampled = self.sample(team, watch)?;
        let samples = self.plans.iter().zip(&sampled).map(|(plan, won)| Sample::new(&plan.manifest.campaign, won));
        let arena = Robots { tuning: self, samples: samples.collect(), on_episode: watch.on_episode };
        let Task { tunables, episodes, search_seed, .. } = &self.task;
        let mut spent = SAMPLE * self.plans.len() as u64;
        let most = episodes - self.final_episodes();
        let mut search = Search::new(&arena, tunables, *search_seed, self.plans.len(), most - spent);
        let mut generations: Vec<Generation> = Vec::new();
        while spent + search.next_episodes() <= most {
            let path = self.generation_file(generations.len() + 1);
            let generation = match read(&path)? {
                Some(there) => {
                    search.follow(&there);
                    there
                }
                None => {
                    let new = search.generation(team)?;
                    write_atomic(&path, json_pretty(&new)?.as_bytes())?;
                    new
                }
            };
            spent += generation.episodes;
            (watch.on_generation)(&generation, search.spread(), spent);
            generations.push(generation);
        }
        let proposed = search.proposed()?;
        let rate = |won: &Vec<bool>| won.iter().filter(|won| **won).count() as f64 / won.len() as f64;
        Ok(Tuned {
            task: self.task.clone(),
            sampled: sampled.iter().map(rate).collect(),
            generations,
            searched: spent,
            effects: search.effects(&proposed),
            proposed,
            name: self.name(),
            verdicts: Vec::new(),
            is_better: false,
        })
    }

    /// The outcomes of the incumbent in the first trials, for each case.
    fn sample(&self, team: Team, watch: &Watch) -> Result<Vec<Vec<bool>>> {
        let path = team.folder.join("sample.json");
        if let Some(there) = read(&path)? {
            return Ok(there);
        }
        let of_plan = |(case, plan): (usize, &Plan)| {
            let factory = &plan.tried_factories(self.options.untried)?[0];
            let won = |number: usize| {
                let tally = tallies(plan, &[factory], number as u64)?[0];
                (watch.on_episode)();
                Ok(tally.won)
            };
            team.gather(&format!("sample-{}", case + 1), SAMPLE as usize, won)
        };
        let sampled = self.plans.iter().enumerate().map(of_plan).collect::<Result<Vec<_>>>()?;
        write_atomic(&path, json_pretty(&sampled)?.as_bytes())?;
        Ok(sampled)
    }

    fn generation_file(&self, number: usize) -> PathBuf {
        self.folder.join(format!("generation-{number:03}.json"))
    }

    /// Writes the proposed controller to a file of the folder, beside the files that it needs, with lines of comment before
    /// it. Returns its path.
    pub fn write_controller(&self, tuned: &Tuned, file: &str, comment: &[String]) -> Result<PathBuf> {
        let keys = self.task.tunables.iter().map(|tunable| tunable.key.as_str());
        let values: Vec<(&str, f64)> = keys.zip(tuned.proposed.iter().copied()).collect();
        let settings = with_values(&*self.base, &tuned.name, &values)?;
        let text = settings.text();
        let head: String = comment.iter().map(|line| format!("# {line}\n")).collect();
        for (name, bytes) in self.base.files()? {
            write_atomic(&self.folder.join(name), &bytes)?;
        }
        let path = self.folder.join(file);
        write_atomic(&path, (head + &text).as_bytes())?;
        Ok(path)
    }
}

/// What happens in a trial of a plan's campaign to each of these controllers.
fn tallies(plan: &Plan, factories: &[&Factory], number: u64) -> Result<Vec<Tally>> {
    let campaign = &plan.manifest.campaign;
    let run = |factories: &[&Factory]| {
        let disturbance = trial::disturbance(campaign, number);
        ClosedLoop::new(&plan.robot, factories.iter().copied(), &campaign.episode, disturbance).finish()
    };
    let tally = |record: crate::episode::Record| Tally {
        won: record.outcome.is_success(),
        footsteps: record.footsteps.taken.len() as u64,
        torque: record.peak_torque_ratio,
    };
    Ok(each_caught(factories, run)?.into_iter().map(tally).collect())
}

/// The robots of a search as an arena.
struct Robots<'a> {
    tuning: &'a Tuning,
    samples: Vec<Sample<'a>>,
    on_episode: &'a (dyn Fn() + Sync),
}

impl Arena for Robots<'_> {
    type Entrant = Vec<Factory>;

    fn enter(&self, values: &[f64]) -> Result<Vec<Factory>> {
        let keys = self.tuning.task.tunables.iter().map(|tunable| tunable.key.as_str());
        self.tuning.prepared(&keys.zip(values.iter().copied()).collect::<Vec<_>>())
    }

    fn draw(&self, generation: u64, count: usize) -> Vec<Vec<Drawn>> {
        self.samples.iter().map(|sample| sample.draw(generation, count)).collect()
    }

    fn judge(&self, case: usize, trial: u64, entrants: &[&Vec<Factory>]) -> Result<Vec<Tally>> {
        let factories: Vec<&Factory> = entrants.iter().map(|of_cases| &of_cases[case]).collect();
        let found = tallies(&self.tuning.plans[case], &factories, trial)?;
        found.iter().for_each(|_| (self.on_episode)());
        Ok(found)
    }
}
