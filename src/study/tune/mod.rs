//! From a controller to a better one: its numbers are searched on the trials of a campaign, and what is found is judged
//! by trials that the search has never seen.
//!
//! Two seeds are written down before anything runs ([`Task`]). The [search] sees only trials of the first seed, which
//! follows from the seed of the campaign. The second seed follows from the whole task, so no other task has its pushes.
//! It is used once, by an ordinary campaign of the incumbent and the proposed controller. The exact test of that
//! campaign is the result, and "no better one was found" is a result, too. Several robots, or several engines, can be
//! cases of one search: then the worst case of a candidate counts.

pub mod draw;
pub mod race;
pub mod response;
pub mod search;
pub mod verdict;

use crate::ask::spec::Campaign;
use crate::ask::trial;
use crate::batch::{Batch, TASK, damaged, read, read_of};
use crate::plan::{PreparedCampaign, each_caught, pool};
use crate::store::shard::Shard;
use draw::IncumbentSample;
use race::{EpisodeScore, WeightedTrial};
use response::Effect;
use search::{Arena, Generation, TuneSearch, least_episodes, trials_of};
use serde::{Deserialize, Serialize};
use standfast_controllers::ControllerSpec;
use standfast_controllers::tunable::Tunable;
use standfast_controllers::values::{number_to_vary, with_values};
use standfast_controllers::variant::ControllerName;
use standfast_core::error::{Error, Result};
use standfast_core::socket::PreparedController;
use standfast_files::assets::{self, InputKind, Source};
use standfast_files::{json, json_pretty, sha256_hex, write_atomic};
use standfast_robots::urdf::Files;
use standfast_sim::episode::ClosedLoop;
use std::path::{Component, Path, PathBuf};
use verdict::CaseVerdict;

/// The file of the sample.
const SAMPLE_FILE: &str = "sample.json";
/// Largest number of episodes of a budget: some years of simulation on a core.
pub const MOST_EPISODES: u64 = 1_000_000_000;
/// Number of trials of the incumbent in the sample, by which the trials of the search are drawn.
const SAMPLE: u64 = 200;
/// Largest number of times that a range proposed by the controller is halved, until both ends can be used.
const HALVINGS: usize = 8;

/// Options of a search.
#[derive(Debug, Clone)]
pub struct TuneOptions {
    /// The numbers to tune, as `KEY=FROM..TO` or `KEY`. If empty, these are all numbers that the controller names.
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

/// How much a search may cost, with its final campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    Episodes(u64),
    /// A time on this machine (s), which is converted to a number of episodes before the search begins.
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
    pub search_seed: u64,
    /// Seeds of the final campaigns that judged the controller from which this search starts, as its file says.
    pub judged_before: Vec<u64>,
    /// The seed of the final campaign, which is used once. It follows from all other fields of the task.
    pub final_seed: u64,
    pub final_trials: u64,
    /// The time budget (s) that was asked for. It is None if a number of episodes was asked for.
    pub budget_s: Option<f64>,
    /// Largest number of episodes, including those of the final campaign.
    pub episodes: u64,
}

impl Task {
    /// SHA-256 of all but the seed of the final campaign. Every file of the search carries it.
    pub fn hash(&self) -> Result<String> {
        Ok(sha256_hex(
            json(&Self {
                final_seed: 0,
                ..self.clone()
            })?
            .as_bytes(),
        ))
    }

    /// The seed of the final campaign for a task with this [hash](Self::hash). It has judged nothing before, and it is
    /// not the seed of the search.
    fn final_seed_of(&self, hash: &str) -> u64 {
        let seed =
            u64::from_str_radix(&hash[..16], 16).expect("a hash begins with 16 hexadecimal digits");
        (0..)
            .map(|number| trial::derived_seed(seed, number))
            .find(|derived| *derived != self.search_seed && !self.judged_before.contains(derived))
            .expect("one of so many is new")
    }
}

/// Beginning of the line in a controller's file that names the seeds of the campaigns which judged the controller.
const JUDGED_BY: &str = "# judged_by_seeds = ";

/// The seeds of the campaigns that judged a controller, as its file names them.
fn judged_by(source: &Source) -> Result<Vec<u64>> {
    let mut seeds = Vec::new();
    for (number, line) in source.text.lines().enumerate() {
        let Some(list) = line.strip_prefix(JUDGED_BY) else {
            continue;
        };
        let listed: Vec<u64> = serde_json::from_str(list).map_err(|_| {
            let message = format!(
                "line {}: `{list}` is no list of seeds; accepted: such as [17, 4]",
                number + 1
            );
            Error::Syntax {
                file: source.file.clone(),
                message,
            }
        })?;
        seeds.extend(listed);
    }
    Ok(seeds)
}

/// A robot in an engine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaseId {
    pub robot: String,
    pub engine: String,
    /// The configuration hash of the search's campaign, which covers the files of the robot and the controller.
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
    /// The effect of each number on the rate, fitted to all candidates of all generations.
    pub effects: Vec<Effect>,
    /// Name of the proposed controller.
    pub name: String,
    /// The verdict for each case; none if the proposed values are the present ones.
    pub verdicts: Vec<CaseVerdict>,
    /// Whether the proposed controller is better in all cases.
    pub is_better: bool,
}

/// A search whose inputs are read and checked.
pub struct Tuning {
    pub task: Task,
    /// Whether the folder holds the beginning of this search.
    pub goes_on: bool,
    /// The [hash](Task::hash) of the task.
    pub hash: String,
    pub folder: PathBuf,
    base: Box<dyn ControllerSpec>,
    /// The campaign of each case, with the seed of the search.
    plans: Vec<PreparedCampaign>,
    pub options: TuneOptions,
}

impl Tuning {
    /// Reads and checks everything. `campaigns` are the cases, all with the same single controller, each with the files
    /// of its robot. Errors: a controller without numbers to tune, a range that cannot be used, a budget that is too
    /// small, a folder that holds another search.
    pub fn new(
        campaigns: &[(Campaign, Files)],
        options: TuneOptions,
        folder: &Path,
    ) -> Result<Self> {
        let (first, _) = campaigns.first().expect("a search has a case");
        let [entry] = &first.controllers[..] else {
            unreachable!("a search has one controller")
        };
        let base = standfast_controllers::load(entry)?;
        check_files(&*base, entry)?;
        let judged_before = judged_by(&assets::open(
            InputKind::Controller,
            ControllerName::split(entry).base,
        )?)?;
        let search_seed = trial::derived_seed(first.seed, 0);
        let (mut plans, mut cases) = (Vec::new(), Vec::new());
        for (campaign, files) in campaigns {
            let searched = Campaign {
                seed: search_seed,
                ..campaign.clone()
            };
            let plan = PreparedCampaign::with(&searched, files.clone())?;
            cases.push(CaseId {
                robot: campaign.robot.clone(),
                engine: plan.manifest.engine(),
                config_hash: plan.manifest.config_hash.clone(),
            });
            plans.push(plan);
        }
        let task = Task {
            standfast: env!("CARGO_PKG_VERSION").into(),
            controller: base.name().into(),
            campaign: first.name.clone(),
            cases,
            tunables: Vec::new(),
            seed: first.seed,
            search_seed,
            judged_before,
            final_seed: 0,
            final_trials: options.trials,
            budget_s: None,
            episodes: 0,
        };
        let stored = read::<Task>(&folder.join(TASK))?;
        if stored.is_none() {
            check_new(folder)?;
        }
        let (goes_on, hash) = (stored.is_some(), String::new());
        let mut tuning = Self {
            task,
            goes_on,
            hash,
            folder: folder.into(),
            base,
            plans,
            options,
        };
        tuning.task.tunables = tuning.tunables()?;
        tuning.set_budget(stored.as_ref())?;
        tuning.hash = tuning.task.hash()?;
        tuning.task.final_seed = tuning.task.final_seed_of(&tuning.hash);
        if stored.is_some_and(|stored| stored != tuning.task) {
            let problem =
                "holds another search (its task differs); give a new folder, or remove this one";
            return Err(Error::Parts {
                path: folder.into(),
                problem: problem.into(),
            });
        }
        Ok(tuning)
    }

    /// The numbers to tune, each with a range both ends of which can be used.
    fn tunables(&self) -> Result<Vec<Tunable>> {
        let (base, vary) = (&*self.base, &self.options.vary);
        let mut named = match vary.is_empty() {
            true => base.tunables(),
            false => vary
                .iter()
                .map(|text| number_to_vary(text, base))
                .collect::<Result<_>>()?,
        };
        if named.is_empty() {
            let accepted = "--vary KEY=FROM..TO with a number of its file, or another controller";
            return Err(Error::option(
                "CONTROLLER",
                base.name(),
                "names no number to tune",
                accepted,
            ));
        }
        if let Some(twice) =
            (1..named.len()).find(|&i| named[..i].iter().any(|other| other.key == named[i].key))
        {
            return Err(Error::option(
                "--vary",
                &named[twice].key,
                "is given twice",
                "each key once",
            ));
        }
        for tunable in &mut named {
            let problem = Tunable::problem(tunable.range);
            if let Some(problem) =
                problem.or((!tunable.now.is_finite()).then_some("its present value is not finite"))
            {
                let Tunable {
                    key,
                    now,
                    range: [from, to],
                } = &*tunable;
                let value = format!("{key}={from}..{to}, now {now}");
                return Err(Error::option(
                    "--vary",
                    value,
                    problem,
                    "finite numbers, the smaller end first",
                ));
            }
            for end in 0..2 {
                let mut refused = self.refuses(tunable, tunable.range[end])?;
                let mut left = HALVINGS;
                // A range that the controller proposes may be narrowed. A range that the user asked for may not.
                while vary.is_empty() && refused.is_some() && left > 0 {
                    tunable.range[end] = 0.5 * (tunable.range[end] + tunable.now);
                    refused = self.refuses(tunable, tunable.range[end])?;
                    left -= 1;
                }
                if let Some(error) = refused {
                    let Tunable {
                        key,
                        range: [from, to],
                        ..
                    } = &*tunable;
                    let problem = format!("its end {} cannot be used: {error}", tunable.range[end]);
                    return Err(Error::option(
                        "--vary",
                        format!("{key}={from}..{to}"),
                        problem,
                        "a narrower range",
                    ));
                }
            }
        }
        Ok(named)
    }

    /// The reason why a number cannot have a value. It is None if the number can.
    fn refuses(&self, tunable: &Tunable, value: f64) -> Result<Option<Error>> {
        self.prepared(&[(&tunable.key, value)])
            .err()
            .map(Error::refusal)
            .transpose()
    }

    /// The controller with these values, for each case.
    fn prepared(&self, values: &[(&str, f64)]) -> Result<Vec<PreparedController>> {
        let settings = with_values(&*self.base, self.base.name(), values)?;
        let mut prepared = Vec::new();
        for plan in &self.plans {
            let period_s = plan.manifest.campaign.episode.control_period_s;
            prepared.push(settings.prepare(&plan.robot, period_s)?);
        }
        Ok(prepared)
    }

    /// Converts the budget to a number of episodes, and fails if it is too small. A search that was begun keeps its
    /// number of episodes, because a time would give another number on another day.
    fn set_budget(&mut self, stored: Option<&Task>) -> Result<()> {
        let (
            cases,
            Task {
                tunables,
                final_trials,
                ..
            },
        ) = (self.plans.len() as u64, &self.task);
        let search = least_episodes(tunables.len(), self.plans.len());
        let least = SAMPLE * cases + 2 * final_trials * cases + search;
        let (budget_s, episodes, episode_s) = match self.options.budget {
            Budget::Episodes(episodes) => (None, episodes, 0.0),
            Budget::Time(time_s) if self.options.shard.is_some() => {
                let problem = "each shard would measure another pace";
                let accepted = "a number of episodes";
                return Err(Error::option(
                    "--budget",
                    format!("{time_s} s"),
                    problem,
                    accepted,
                ));
            }
            Budget::Time(time_s)
                if stored.is_some_and(|stored| stored.budget_s == Some(time_s)) =>
            {
                (
                    Some(time_s),
                    stored.map_or(0, |stored| stored.episodes),
                    0.0,
                )
            }
            Budget::Time(time_s) => {
                let of_each = self
                    .plans
                    .iter()
                    .map(PreparedCampaign::seconds_a_trial)
                    .collect::<Result<Vec<_>>>()?;
                let episode_s = of_each.iter().sum::<f64>() / cases as f64 / self.threads()? as f64;
                (
                    Some(time_s),
                    ((time_s / episode_s) as u64).min(MOST_EPISODES),
                    episode_s,
                )
            }
        };
        if episodes < least {
            let problem = format!(
                "is too small for {} numbers and {final_trials} final trials",
                tunables.len()
            );
            let (stated, accepted) = match budget_s {
                None => (
                    format!("{episodes} episodes"),
                    format!("{least} episodes or more"),
                ),
                Some(time_s) => {
                    let [stated, least_time] = [time_s, least as f64 * episode_s].map(in_minutes);
                    let accepted = format!(
                        "{least_time} or more on this machine as it is now ({least} episodes)"
                    );
                    (
                        format!("{stated}, which are {episodes} episodes here"),
                        accepted,
                    )
                }
            };
            let accepted = format!("{accepted}; less with --vary or --trials");
            return Err(Error::option("--budget", stated, problem, accepted));
        }
        (self.task.budget_s, self.task.episodes) = (budget_s, episodes);
        Ok(())
    }

    /// Episodes of the search that are in the folder already. Fails if a file there is not as a search writes it.
    pub fn episodes_there(&self) -> Result<u64> {
        let mut episodes = self
            .sample_there()?
            .iter()
            .flatten()
            .map(Vec::len)
            .sum::<usize>() as u64;
        for number in 1.. {
            let Some(generation) = self.generation_there(number)? else {
                break;
            };
            episodes += generation.episodes;
        }
        Ok(episodes)
    }

    /// The sample that is in the folder.
    fn sample_there(&self) -> Result<Option<Vec<Vec<bool>>>> {
        let path = self.folder.join(SAMPLE_FILE);
        let sample: Option<Vec<Vec<bool>>> = read_of(&path, &self.hash)?;
        if let Some(cases) = &sample
            && (cases.len() != self.plans.len()
                || cases.iter().any(|won| won.len() as u64 != SAMPLE))
        {
            return Err(damaged(
                &path,
                &format!("it has not {SAMPLE} outcomes for each case"),
            ));
        }
        Ok(sample)
    }

    /// A generation that is in the folder.
    fn generation_there(&self, number: usize) -> Result<Option<Generation>> {
        let path = self.generation_file(number);
        let (tunables, cases) = (self.task.tunables.len(), self.plans.len());
        let generation: Option<Generation> = read_of(&path, &self.hash)?;
        let trials = trials_of(tunables, cases, self.search_episodes());
        match generation
            .as_ref()
            .and_then(|generation| generation.problem(number as u64, trials, tunables, cases))
        {
            None => Ok(generation),
            Some(problem) => Err(damaged(&path, problem)),
        }
    }

    /// Largest number of episodes of all generations together.
    fn search_episodes(&self) -> u64 {
        self.task.episodes - self.final_episodes() - SAMPLE * self.plans.len() as u64
    }

    fn threads(&self) -> Result<usize> {
        Ok(pool(self.options.threads, 0)?.threads)
    }

    /// Number of episodes of the final campaigns of all cases.
    pub fn final_episodes(&self) -> u64 {
        2 * self.task.final_trials * self.plans.len() as u64
    }

    /// Name of the controller that is proposed.
    pub fn name(&self) -> String {
        format!("{}-tuned", self.base.name())
    }

    /// Runs the search, from where the folder stopped if it holds a beginning. Finished work is written to the folder,
    /// so that the same command continues it. Fails if it is stopped from outside, or if the robot falls without a
    /// push.
    ///
    /// `batch` is of this [folder](Self::folder) and this [task](Self::hash). `on_generation` is called after each
    /// generation, also for those in the folder, with the spread of the samples and the episodes so far.
    pub fn search(
        &self,
        batch: Batch,
        on_generation: &(dyn Fn(&Generation, f64, u64) + Sync),
    ) -> Result<Tuned> {
        if !self.goes_on {
            write_atomic(&self.folder.join(TASK), json_pretty(&self.task)?.as_bytes())?;
        }
        pool(self.options.threads, 0)?.install(|| self.searched(batch, on_generation))
    }

    fn searched(
        &self,
        batch: Batch,
        on_generation: &(dyn Fn(&Generation, f64, u64) + Sync),
    ) -> Result<Tuned> {
        let sampled = self.sample(batch)?;
        let samples = self
            .plans
            .iter()
            .zip(&sampled)
            .map(|(plan, won)| IncumbentSample::new(&plan.manifest.campaign, won));
        let arena = Robots {
            tuning: self,
            samples: samples.collect(),
            on_episode: batch.on_episode,
        };
        let Task {
            tunables,
            search_seed,
            ..
        } = &self.task;
        let mut spent = SAMPLE * self.plans.len() as u64;
        let most = spent + self.search_episodes();
        let mut search = TuneSearch::new(
            &arena,
            tunables,
            *search_seed,
            self.plans.len(),
            self.search_episodes(),
        );
        let mut generations: Vec<Generation> = Vec::new();
        while spent + search.next_episodes() <= most {
            let number = generations.len() + 1;
            let generation = match self.generation_there(number)? {
                Some(stored) => {
                    search.follow(&stored);
                    stored
                }
                None => {
                    let new = search.generation(batch)?;
                    batch.write(&self.generation_file(number), &new)?;
                    new
                }
            };
            spent += generation.episodes;
            on_generation(&generation, search.spread(), spent);
            generations.push(generation);
        }
        let proposed = search.proposed()?;
        Ok(Tuned {
            task: self.task.clone(),
            sampled: sampled
                .iter()
                .map(|won| won.iter().filter(|won| **won).count() as f64 / won.len() as f64)
                .collect(),
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
    fn sample(&self, batch: Batch) -> Result<Vec<Vec<bool>>> {
        if let Some(sample) = self.sample_there()? {
            return Ok(sample);
        }
        let mut sampled = Vec::new();
        for (case, plan) in self.plans.iter().enumerate() {
            let factory = &plan.tried_factories(self.options.untried)?[0];
            let name = format!("sample-{}", case + 1);
            sampled.push(batch.gather(&name, SAMPLE as usize, |number| {
                let tally = tallies(plan, &[factory], number as u64)?[0];
                (batch.on_episode)();
                Ok(tally.won)
            })?);
        }
        batch.write(&self.folder.join(SAMPLE_FILE), &sampled)?;
        Ok(sampled)
    }

    fn generation_file(&self, number: usize) -> PathBuf {
        self.folder.join(format!("generation-{number:03}.json"))
    }

    /// Writes the proposed controller to a file of the folder, beside the files that it needs. The file begins with the
    /// lines of `comment`. A last line of comment names the seeds of the campaigns that have judged this controller and
    /// those before it. Returns the path.
    pub fn write_controller(
        &self,
        tuned: &Tuned,
        file: &str,
        comment: &[String],
    ) -> Result<PathBuf> {
        let keys = self
            .task
            .tunables
            .iter()
            .map(|tunable| tunable.key.as_str());
        let values: Vec<(&str, f64)> = keys.zip(tuned.proposed.iter().copied()).collect();
        let settings = with_values(&*self.base, &tuned.name, &values)?;
        let text = settings.text();
        let mut head: String = comment.iter().map(|line| format!("# {line}\n")).collect();
        let seeds: Vec<u64> = self
            .task
            .judged_before
            .iter()
            .copied()
            .chain([self.task.final_seed])
            .collect();
        head += &format!("{JUDGED_BY}{}\n", json(&seeds)?);
        for (name, bytes) in self.base.files()? {
            write_atomic(&self.folder.join(name), &bytes)?;
        }
        let path = self.folder.join(file);
        write_atomic(&path, (head + &text).as_bytes())?;
        Ok(path)
    }
}

/// A time (s) as `--budget` takes it, in whole minutes, rounded up.
fn in_minutes(time_s: f64) -> String {
    if time_s < 60.0 {
        format!("{time_s:.0}s")
    } else {
        format!("{:.0}min", (time_s / 60.0).ceil())
    }
}

/// The tallies of these controllers in one trial of a plan's campaign.
fn tallies(
    plan: &PreparedCampaign,
    factories: &[&PreparedController],
    number: u64,
) -> Result<Vec<EpisodeScore>> {
    let campaign = &plan.manifest.campaign;
    let records = each_caught(factories, |factories| {
        ClosedLoop::new(
            &plan.robot,
            factories.iter().copied(),
            &campaign.episode,
            trial::disturbance(campaign, number),
        )
        .finish()
    })?;
    let mut scores = Vec::new();
    for record in records {
        let torque = record.peak_torque_ratio;
        scores.push(EpisodeScore {
            won: record.outcome.is_success(),
            footsteps: record.footsteps.taken.len() as u64,
            // The torque of a robot whose simulation broke may be any number.
            torque: if torque.is_finite() { torque } else { 1.0 },
        });
    }
    Ok(scores)
}

/// Names of the files and folders that a search writes, and the beginnings of such names.
const WRITTEN: [&str; 7] = [
    TASK,
    SAMPLE_FILE,
    "parts",
    "final",
    "proposed.toml",
    "tune.html",
    "tune.json",
];
const WRITTEN_FROM: [&str; 3] = ["generation-", "final-", ".tmp-"];

/// Fails if a file that the controller needs has a name that the search writes itself, because both lie in one folder.
fn check_files(base: &dyn ControllerSpec, entry: &str) -> Result<()> {
    let own = format!("{}-tuned.toml", base.name());
    for (name, _) in base.files()? {
        let mut parts = Path::new(&name)
            .components()
            .filter(|part| *part != Component::CurDir);
        // Some file systems do not distinguish capitals.
        let first = parts
            .next()
            .map(|part| part.as_os_str().to_string_lossy().to_lowercase())
            .unwrap_or_default();
        let is_written = first == own.to_lowercase() || WRITTEN.contains(&first.as_str());
        if is_written || WRITTEN_FROM.iter().any(|start| first.starts_with(start)) {
            let [names, starts] = [WRITTEN.join(", "), WRITTEN_FROM.join(", ")];
            let accepted = format!(
                "a name other than {own}, {names}, and one that does not begin with {starts}"
            );
            return Err(Error::value(
                entry,
                "file",
                name,
                "the search writes what has this name",
                accepted,
            ));
        }
    }
    Ok(())
}

/// Fails if a folder without a task has files of a search, because their task is not known.
fn check_new(folder: &Path) -> Result<()> {
    let names = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = names
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let Some(name) = names
        .iter()
        .find(|name| *name == SAMPLE_FILE || name.starts_with("generation-"))
    else {
        return Ok(());
    };
    let problem = format!(
        "holds {name} of a search, but no {TASK} that says of which; restore {TASK}, give a new folder, or remove this one"
    );
    Err(Error::Parts {
        path: folder.into(),
        problem,
    })
}

/// The robots of a search as an arena.
struct Robots<'a> {
    tuning: &'a Tuning,
    samples: Vec<IncumbentSample<'a>>,
    on_episode: &'a (dyn Fn() + Sync),
}

impl Arena for Robots<'_> {
    type Entrant = Vec<PreparedController>;

    fn enter(&self, values: &[f64]) -> Result<Vec<PreparedController>> {
        let keys = self
            .tuning
            .task
            .tunables
            .iter()
            .map(|tunable| tunable.key.as_str());
        self.tuning
            .prepared(&keys.zip(values.iter().copied()).collect::<Vec<_>>())
    }

    fn draw(&self, generation: u64, count: usize) -> Vec<Vec<WeightedTrial>> {
        self.samples
            .iter()
            .map(|sample| sample.draw(generation, count))
            .collect()
    }

    fn judge(
        &self,
        case: usize,
        trial: u64,
        entrants: &[&Vec<PreparedController>],
    ) -> Result<Vec<EpisodeScore>> {
        let factories: Vec<&PreparedController> =
            entrants.iter().map(|of_cases| &of_cases[case]).collect();
        let scores = tallies(&self.tuning.plans[case], &factories, trial)?;
        for _ in &scores {
            (self.on_episode)();
        }
        Ok(scores)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derived seed may by chance be one that has judged before, or the seed of the search. Then another one is
    /// taken.
    #[test]
    fn no_seed_judges_twice() {
        let task = Task {
            standfast: String::new(),
            controller: String::new(),
            campaign: String::new(),
            cases: Vec::new(),
            tunables: vec![Tunable::new("k", 0.5, [0.0, 1.0])],
            seed: 1,
            search_seed: 2,
            judged_before: Vec::new(),
            final_seed: 0,
            final_trials: 20,
            budget_s: None,
            episodes: 3000,
        };
        let hash = task.hash().unwrap();
        let first = task.final_seed_of(&hash);
        assert_eq!(
            Task {
                final_seed: first,
                ..task.clone()
            }
            .hash()
            .unwrap(),
            hash
        );
        let others = [
            Task {
                judged_before: vec![first],
                ..task.clone()
            },
            Task {
                search_seed: first,
                ..task.clone()
            },
        ];
        assert!(
            others
                .iter()
                .all(|other| other.final_seed_of(&hash) != first && other.hash().unwrap() != hash)
        );
        assert_ne!(
            Task {
                episodes: 3001,
                ..task
            }
            .hash()
            .unwrap(),
            hash
        );
    }
}
