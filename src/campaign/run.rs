//! Runs a campaign: reads its inputs, finds the folder for the result, and spreads the episodes over the cores.

use crate::assets::{self, Kind, Source};
use crate::campaign::ask::gate::GateSpec;
use crate::campaign::ask::no_step::NoStep;
use crate::campaign::ask::spec::Campaign;
use crate::campaign::ask::trial;
use crate::campaign::store::folder::{Folder, Manifest, PART_TRIALS};
use crate::campaign::store::row::TrialRow;
use crate::campaign::store::shard::Shard;
use crate::campaign::verdict::digest::Digest;
use crate::campaign::verdict::gates::{Gates, Open};
use crate::control::Design;
use crate::episode::{Disturbance, Episodes, Record};
use crate::error::{Error, Result};
use crate::files::{build_id, sha256_hex, write_atomic};
use crate::lipm::gains::GainSet;
use crate::lipm::variant::Entry;
use crate::robot::Robot;
use crate::robot::urdf::Files;
use crate::sim::{Engine, PhysicsStep};
use crate::stats::looks::Looks;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// A campaign whose inputs are read and checked. The controllers are designed later.
pub struct Plan {
    pub manifest: Manifest,
    pub(crate) robot: Robot,
    no_step: NoStep,
    gains: Vec<GainSet>,
    /// The inputs that are not compiled in, each by its name in the result folder and its text.
    inputs: Vec<(String, String)>,
}

/// How much of a campaign to run, and on how many threads.
#[derive(Debug, Clone, Copy, Default)]
pub struct RunOptions {
    /// Number of threads; 0 means one for each core.
    pub threads: usize,
    pub shard: Option<Shard>,
}

/// Functions that are called while a campaign runs, and a flag that stops it.
pub struct Watch<'a> {
    /// Somebody sets this to stop the run early.
    pub stop: &'a AtomicBool,
    /// Called after every episode, from any thread.
    pub on_episode: &'a (dyn Fn() + Sync),
    /// Called with the rows of every finished part, from any thread. The first call has the rows that were there
    /// already.
    pub on_part: &'a (dyn Fn(&[TrialRow]) + Sync),
    /// Called at every look at a campaign that ends when decided.
    pub on_look: &'a (dyn Fn(&Look) + Sync),
}

/// A look at a campaign that ends when decided.
pub struct Look<'a> {
    /// All trials so far.
    pub rows: &'a Digest,
    /// What is still to be decided.
    pub open: &'a [Open],
    /// Names of the gain sets that stop here while others go on: nothing that is open takes their trials.
    pub stopping: Vec<&'a str>,
    /// Episodes of the campaign in all, at most.
    pub all_episodes: u64,
}

/// The part of a campaign that its folder still lacks, with everything that is needed to run it.
pub struct Work<'a> {
    plan: &'a Plan,
    pub folder: &'a Folder,
    pool: ThreadPool,
    designs: Vec<Design>,
    shard: Option<Shard>,
    /// Blocks to run; those up to the next look if the campaign ends when decided.
    missing: Vec<u64>,
    /// Number of trials of each gain set, as far as it is known.
    set_trials: Vec<u64>,
    /// None for a campaign with a fixed number of trials.
    looks: Option<LookedAt<'a>>,
}

/// How far a campaign that ends when decided was looked at.
struct LookedAt<'a> {
    gates: &'a Gates,
    planned: Looks,
    /// Numbers of trials at the last look and at the next one.
    last: u64,
    next: u64,
    /// All trials up to the last look.
    rows: Digest,
}

impl Plan {
    /// Reads the robot and the gain sets. It fails if any of them is missing or wrong, or if two sets have the same
    /// name.
    pub fn new(campaign: &Campaign) -> Result<Plan> {
        Self::with(campaign, Files::open(&campaign.robot)?)
    }

    /// As [`new`](Self::new), with the files of the campaign's robot, which are read already.
    pub fn with(campaign: &Campaign, files: Files) -> Result<Plan> {
        let engine = campaign.episode.engine;
        let robot = Robot::of(&files)?;
        engine.check(&robot)?;
        let entries: Vec<Entry> = campaign.gains.iter().map(|gains| Entry::split(gains)).collect();
        let load = |entry: &Entry| GainSet::parse(&assets::open(Kind::Gains, entry.base)?);
        let bases = entries.iter().map(load).collect::<Result<Vec<_>>>()?;
        let gains = entries.iter().zip(&bases).map(|(entry, base)| entry.of(base)).collect::<Result<Vec<_>>>()?;
        let sets: Vec<String> = gains.iter().map(|set| set.name.clone()).collect();
        check_names(campaign, &sets, &bases)?;
        let (mut inputs, mut resolved) = (Inputs::default(), campaign.clone());
        // The robot comes first among the inputs, with settings that may have been inferred, and with its meshes.
        let robot_files = [Some((files.settings, "toml")), files.meshes.map(|meshes| (meshes, "meshes"))];
        let robot_files = robot_files.into_iter().flatten().chain([(files.urdf, "urdf")]);
        resolved.robot = inputs.take(&campaign.robot, "robot", robot_files)?;
        let robot_sha256 = sha256_hex(inputs.texts.concat().as_bytes());
        for ((gains, entry), base) in resolved.gains.iter_mut().zip(&entries).zip(&bases) {
            let stem = format!("gains/{}", base.name);
            *gains =
                entry.with_base(&inputs.take(entry.base, &stem, [(assets::open(Kind::Gains, entry.base)?, "toml")])?);
        }
        let standfast = env!("CARGO_PKG_VERSION").to_string();
        let engine = engine.with_version();
        let program = format!("{standfast} {engine}");
        let config_hash = hash(&program, &what_trials_are(&resolved).to_toml()?, &inputs.texts);
        let build = String::new();
        let manifest = Manifest {
            standfast,
            config_hash,
            build,
            robot_sha256,
            engine,
            part_trials: PART_TRIALS,
            planned_trials: resolved.trials,
            sets,
            campaign: resolved,
        };
        Ok(Plan { manifest, no_step: NoStep::new(&robot), robot, gains, inputs: inputs.kept })
    }

    /// The folder for the result: the one asked for, or one under `standfast-results` that is free or this
    /// campaign's. Writes nothing. Errors: the one asked for holds something else.
    pub fn folder(&self, out: Option<&Path>) -> Result<Folder> {
        let manifest = &self.manifest;
        let hash = &manifest.config_hash;
        let own = |path: &Path| Ok(Folder::open(path)?.is_none_or(|found| found.manifest.config_hash == *hash));
        let path = match out {
            Some(path) => path.to_path_buf(),
            None => {
                let results = Path::new("standfast-results");
                let name = match manifest.campaign.episode.engine {
                    Engine::Rapier => manifest.campaign.name.clone(),
                    other => format!("{}-{}", manifest.campaign.name, other.name()),
                };
                let (plain, hashed) = (results.join(&name), results.join(format!("{name}-{}", &hash[..8])));
                if own(&plain).unwrap_or(false) { plain } else { hashed }
            }
        };
        if !own(&path)? {
            let advice = " (its configuration differs); give a new folder, or remove this one";
            let problem = format!("holds the result of another campaign{}", out.map_or("", |_| advice));
            return Err(Error::Parts { path, problem });
        }
        let begun = Folder::open(&path)?.map_or(manifest.clone(), |found| found.manifest);
        let Manifest { part_trials, planned_trials, .. } = begun;
        // `new` does not do this, because it reads the program's own file.
        let build = build_id().into();
        Ok(Folder { path, manifest: Manifest { build, part_trials, planned_trials, ..manifest.clone() } })
    }

    /// What `folder` lacks (of one shard, or of all). Every gain set is designed for here, before the first trial and
    /// before anything is written or, of an earlier result, taken away; nothing is if the folder lacks nothing. `gates`
    /// say when a campaign that ends when decided is decided. Errors: a shard of a campaign that ends when decided,
    /// which no shard alone can know; no design.
    pub fn work<'a>(&'a self, folder: &'a Folder, options: RunOptions, gates: Option<&'a Gates>) -> Result<Work<'a>> {
        if let (true, Some(Shard { index, count })) = (self.until_resolved(), options.shard) {
            let problem = "a shard cannot know when the whole campaign is decided";
            let accepted =
                "a fixed number of trials, without --until-resolved and with stopping.until_resolved = false";
            return Err(Error::value("campaign", "--shard", format!("{index}/{count}"), problem, accepted));
        }
        let Manifest { campaign, sets, .. } = &folder.manifest;
        let look_on = |(gates, planned): (_, Looks)| {
            let rows = Digest::new(sets, &campaign.episode);
            let next = planned.after(0).min(campaign.trials);
            LookedAt { gates, planned, last: 0, next, rows }
        };
        let looks = gates.zip(folder.manifest.looks()).map(look_on);
        let set_trials = vec![campaign.trials; sets.len()];
        let (pool, shard) = (pool(options.threads)?, options.shard);
        let mut work =
            Work { plan: self, folder, pool, designs: Vec::new(), shard, missing: Vec::new(), set_trials, looks };
        work.missing = match work.looks {
            Some(_) => work.look_on(&|_| {})?,
            None => work.lacking(work.blocks()),
        };
        if !work.is_done() {
            work.designs = work.pool.install(|| self.designs())?;
        }
        Ok(work)
    }

    fn until_resolved(&self) -> bool {
        self.manifest.campaign.stopping.until_resolved
    }

    /// Designs a controller for every gain set, and warns of dubious ones.
    pub(crate) fn designs(&self) -> Result<Vec<Design>> {
        let control_period_s = self.manifest.campaign.episode.control_period_s;
        let design = |set| Design::new(&self.robot, set, control_period_s);
        let designs: Vec<Design> = self.gains.par_iter().map(design).collect::<Result<_>>()?;
        for (set, design) in self.manifest.sets.iter().zip(&designs) {
            if let Some(warning) = &design.warning {
                log::warn!("{set}: {warning}");
            }
        }
        Ok(designs)
    }

    /// The robot as it is simulated in trial 0.
    pub(crate) fn simulated_at_first(&self) -> Robot {
        trial::variation(&self.manifest.campaign, 0).robot(&self.robot)
    }

    /// The beginning of the episodes of all gain sets, if all trials begin alike, on `simulated`, the robot of trial 0.
    pub(crate) fn opening<'a>(&'a self, simulated: &'a Robot, designs: &'a [Design]) -> Option<Episodes<'a>> {
        let campaign = &self.manifest.campaign;
        trial::begin_alike(campaign).then(|| {
            let disturbance = trial::disturbance(campaign, 0);
            let push_s = disturbance.pushes[0].start_s;
            Episodes::new(&self.robot, simulated, designs, &campaign.episode, disturbance).before(push_s)
        })
    }

    /// Runs the episodes of a trial with some gain sets, given by their numbers in ascending order. They go on from
    /// `opening`, if there is one.
    pub(crate) fn records(
        &self,
        designs: &[Design],
        opening: Option<&Episodes>,
        disturbance: Disturbance,
        sets: &[usize],
    ) -> Vec<Record> {
        if let Some(opening) = opening {
            return opening.with(sets, disturbance.pushes).finish();
        }
        let simulated = disturbance.variation.robot(&self.robot);
        let designs = sets.iter().map(|&set| &designs[set]);
        Episodes::new(&self.robot, &simulated, designs, &self.manifest.campaign.episode, disturbance).finish()
    }

    /// The rows of a trial with some gain sets, given by their numbers in ascending order.
    fn rows(&self, designs: &[Design], opening: Option<&Episodes>, trial: u64, sets: &[usize]) -> Vec<TrialRow> {
        let Manifest { campaign, sets: names, .. } = &self.manifest;
        let disturbance = trial::disturbance(campaign, trial);
        let (pushes, variation) = (disturbance.pushes.clone(), disturbance.variation);
        let records = self.records(designs, opening, disturbance, sets);
        let no_step_n_s = self.no_step.impulse_n_s(pushes[0].heading_deg);
        let row =
            |(&set, record): (&usize, _)| TrialRow::new(trial, &names[set], &pushes, no_step_n_s, &variation, record);
        sets.iter().zip(records).map(row).collect()
    }

    /// Writes whose folder it is, with all that is needed to run it again: `campaign.toml` and its inputs.
    fn identify(&self, folder: &Folder) -> Result<()> {
        folder.create()?;
        for (name, text) in &self.inputs {
            write_atomic(&folder.path.join(name), text.as_bytes())?;
        }
        folder.write_campaign()
    }
}

impl Work<'_> {
    /// Whether the folder lacks nothing.
    pub fn is_done(&self) -> bool {
        self.missing.is_empty()
    }

    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Episodes to run; at most, if the campaign ends when decided. Looks at what is there now.
    pub fn episodes(&self) -> u64 {
        if self.is_done() { 0 } else { self.episodes_of(|block| self.folder.lacks(block, &self.set_trials)) }
    }

    /// Episodes in all, those that are there among them; at most, if the campaign ends when decided.
    pub fn all_episodes(&self) -> u64 {
        let has_trials = |block: u64| self.set_trials.iter().map(move |trials| self.folder.range(block).0 < *trials);
        self.episodes_of(|block| has_trials(block).collect())
    }

    /// Episodes of all blocks, each with those of the gain sets for which `of` says so.
    fn episodes_of(&self, of: impl Fn(u64) -> Vec<bool>) -> u64 {
        let episodes = |block: u64| {
            let (first, end) = self.folder.range(block);
            (end - first) * of(block).into_iter().filter(|is_one| *is_one).count() as u64
        };
        self.blocks().map(episodes).sum()
    }

    /// The blocks of the campaign, or of the shard.
    fn blocks(&self) -> impl Iterator<Item = u64> + use<> {
        let Manifest { campaign, part_trials, .. } = &self.folder.manifest;
        let shard = self.shard;
        (0..campaign.trials.div_ceil(part_trials.get()))
            .filter(move |&block| shard.is_none_or(|shard| shard.takes(block)))
    }

    /// Those of some blocks that are still to be run.
    fn lacking(&self, blocks: impl Iterator<Item = u64>) -> Vec<u64> {
        blocks.filter(|&block| self.folder.lacks(block, &self.set_trials).contains(&true)).collect()
    }

    /// Looks at what is there of a campaign that ends when decided, from the next look on: the blocks that are missing
    /// for a look, or none if all is decided, or there are no more trials. At each look, gain sets of which nothing
    /// that is still open takes trials are stopped.
    ///
    /// The looks are at fixed numbers of trials. So neither the end nor the trials of a set depend on threads or on
    /// interruptions.
    fn look_on(&mut self, on_look: &dyn Fn(&Look)) -> Result<Vec<u64>> {
        let Manifest { campaign, part_trials, sets, .. } = &self.folder.manifest;
        let Some(mut looks) = self.looks.take() else { return Ok(Vec::new()) };
        let missing = loop {
            let blocks = looks.last / part_trials.get()..looks.next.div_ceil(part_trials.get());
            let missing = self.lacking(blocks.clone());
            if !missing.is_empty() {
                break missing;
            }
            for block in blocks {
                looks.rows.push(&self.folder.rows_of(block..block + 1, &self.set_trials)?);
            }
            looks.last = looks.next;
            let open = looks.gates.open(&looks.rows);
            let is_over = open.is_empty() || looks.last == campaign.trials;
            let mut stopping = Vec::new();
            for (set, trials) in self.set_trials.iter_mut().enumerate().filter(|(_, trials)| **trials > looks.last) {
                if is_over || open.iter().all(|open| !open.sets.contains(&set)) {
                    *trials = looks.last;
                    stopping.extend((!is_over).then_some(sets[set].as_str()));
                }
            }
            on_look(&Look { rows: &looks.rows, open: &open, stopping, all_episodes: self.all_episodes() });
            if is_over {
                break Vec::new();
            }
            looks.next = looks.planned.after(looks.last).min(campaign.trials);
        };
        self.looks = Some(looks);
        Ok(missing)
    }

    /// Runs what is missing and writes it part by part. Parts that are complete are left as they are.
    pub fn run(&mut self, watch: &Watch) -> Result<()> {
        if !self.is_done() {
            self.folder.remove_result()?;
            let is_there = |block: &u64| !self.folder.lacks(*block, &self.set_trials).contains(&true);
            let there = (0..self.folder.blocks()).filter(is_there);
            let rows = there.filter_map(|block| self.folder.rows_of(block..block + 1, &self.set_trials).ok());
            (watch.on_part)(&rows.flatten().collect::<Vec<_>>());
        }
        self.plan.identify(self.folder)?;
        // Taken out, because the opening, which serves at every look, borrows them.
        let (plan, designs) = (self.plan, std::mem::take(&mut self.designs));
        let simulated = plan.simulated_at_first();
        let opening = plan.opening(&simulated, &designs);
        while !self.is_done() {
            self.pool.install(|| self.run_blocks(&designs, opening.as_ref(), watch))?;
            self.missing = self.look_on(watch.on_look)?;
        }
        if self.plan.until_resolved() { self.folder.stop_at(&self.set_trials) } else { Ok(()) }
    }

    /// Units are trials, handed out in order one by one: cores stay busy to the end, and an interruption loses only the
    /// few blocks in work.
    fn run_blocks(&self, designs: &[Design], opening: Option<&Episodes>, watch: &Watch) -> Result<()> {
        let blocks = self.missing.iter().map(|&block| Block::new(self.folder, block, &self.set_trials));
        let blocks: Vec<Block> = blocks.collect();
        let jobs = blocks.iter().flat_map(|block| block.trials.clone().map(move |trial| (block, trial)));
        jobs.par_bridge().try_for_each(|(block, trial)| {
            if watch.stop.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            let rows = self.plan.rows(designs, opening, trial, &block.sets);
            rows.iter().for_each(|_| (watch.on_episode)());
            let Some(rows) = block.put(trial, rows) else { return Ok(()) };
            self.folder.part(block.index).write(&rows)?;
            (watch.on_part)(&rows);
            Ok(())
        })
    }
}

/// A pool of so many threads; 0 means one for each core.
pub(crate) fn pool(threads: usize) -> Result<ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|e| Error::Numeric { what: "threads".into(), problem: e.to_string() })
}

/// Fails if the name of a gain set cannot be the name of a file, or if two sets have the same name.
fn check_names(campaign: &Campaign, sets: &[String], bases: &[GainSet]) -> Result<()> {
    for (i, (name, GainSet { name: base, .. })) in sets.iter().zip(bases).enumerate() {
        if base.is_empty() || base.starts_with('.') || base.contains(|c: char| "/\\:".contains(c) || c.is_control()) {
            let accepted = "a name without /, \\ and :, not first a `.`";
            return Err(Error::value(&campaign.gains[i], "name", base, "not usable as a file name", accepted));
        }
        if sets[..i].contains(name) {
            let problem = "two gain sets of this name";
            return Err(Error::value(&campaign.gains[i], "name", name, problem, "a name of its own for each"));
        }
    }
    Ok(())
}

/// The files that a campaign reads. They are kept, so that it can be run again from its folder.
#[derive(Default)]
struct Inputs {
    /// The texts of all files, in the order in which they are hashed.
    texts: Vec<String>,
    /// The files that are not compiled in, each by its name in the result folder and its text.
    kept: Vec<(String, String)>,
}

impl Inputs {
    /// Takes the files of one input, each given with its extension. Returns the name that the campaign in the
    /// folder has for it: the original one if the input is compiled in, else that of its last file.
    fn take<'a>(
        &mut self,
        original: &str,
        stem: &str,
        files: impl IntoIterator<Item = (Source, &'a str)>,
    ) -> Result<String> {
        let mut name = original.to_string();
        for (source, extension) in files {
            self.texts.push(source.text.clone());
            if source.is_builtin() {
                continue;
            }
            name = format!("inputs/{stem}.{extension}");
            // Variants of one gain set share its file.
            match self.kept.iter().find(|(kept, _)| *kept == name) {
                Some((_, text)) if *text == source.text => {}
                Some(_) => {
                    let (set, problem) =
                        (stem.trim_start_matches("gains/"), "another file has a gain set of this name");
                    return Err(Error::value(original, "name", set, problem, "a name of its own for each"));
                }
                None => self.kept.push((name.clone(), source.text)),
            }
        }
        Ok(name)
    }
}

/// The campaign without the settings on which no trial depends. A campaign that ends when decided may be taken up again
/// with more trials, because its intervals hold at every look, so the number of trials is left out, too. A campaign
/// with a fixed number may not: to add trials after having seen the result would be a second look.
fn what_trials_are(campaign: &Campaign) -> Campaign {
    let mut trials = Campaign { gates: GateSpec::default(), ..campaign.clone() };
    trials.stopping.margin = 0.0;
    // The step of the other engine does not matter.
    trials.episode.physics_step_s = PhysicsStep::all(trials.episode.clock().physics_step_s);
    if campaign.stopping.until_resolved {
        trials.trials = 0;
    }
    trials
}

/// SHA-256 of the versions of program and physics engine, the resolved campaign and the texts of its inputs, each with its length in
/// front.
fn hash(versions: &str, campaign: &str, inputs: &[String]) -> String {
    let mut bytes = Vec::new();
    for text in [versions, campaign].into_iter().chain(inputs.iter().map(String::as_str)) {
        bytes.extend((text.len() as u64).to_le_bytes());
        bytes.extend(text.as_bytes());
    }
    sha256_hex(&bytes)
}

/// A block in work. Its rows stand by trial and number of the gain set.
struct Block {
    index: u64,
    /// The trials to run, each with these gain sets.
    trials: Range<u64>,
    sets: Vec<usize>,
    /// Number of rows when it is complete.
    all: usize,
    /// The rows so far, by trial and gain set.
    rows: Mutex<BTreeMap<(u64, usize), TrialRow>>,
}

impl Block {
    /// The block as it is in the folder, with what it lacks if the gain sets have so many trials. Rows of other sets
    /// that are there are kept.
    fn new(folder: &Folder, index: u64, set_trials: &[u64]) -> Self {
        let (first, end) = folder.range(index);
        let lacks = folder.lacks(index, set_trials);
        let sets: Vec<usize> = (0..lacks.len()).filter(|&set| lacks[set]).collect();
        let number = |row: &TrialRow| folder.manifest.sets.iter().position(|set| *set == row.set);
        let there = folder.part(index).rows().unwrap_or_default().into_iter();
        let rows: BTreeMap<_, _> = there.filter_map(|row| Some(((row.trial, number(&row)?), row))).collect();
        let all = (end - first) as usize * sets.len() + rows.len();
        Self { index, trials: first..end, sets, all, rows: Mutex::new(rows) }
    }

    /// Puts the rows of a trial in their places. Returns all rows in order if these were the last ones.
    fn put(&self, trial: u64, of_trial: Vec<TrialRow>) -> Option<Vec<TrialRow>> {
        let mut rows = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        rows.extend(self.sets.iter().zip(of_trial).map(|(&set, row)| ((trial, set), row)));
        (rows.len() == self.all).then(|| std::mem::take(&mut *rows).into_values().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::Overrides;
    use crate::campaign::store::row::tests::row;
    use crate::campaign::verdict::summary::Summary;
    use crate::episode::Outcome;
    use std::sync::atomic::AtomicUsize;

    fn plan(set: &[&str]) -> Plan {
        let short = ["episode.horizon_s=0.4", "episode.judge.standing_time_s=0.1", "push.start_s=0.05"];
        let set = short.iter().chain(set).map(|s| s.to_string()).collect();
        let overrides = Overrides { set, trials: Some(30), gains: vec!["hold".into()], ..Default::default() };
        Plan::new(&Campaign::load("smoke", &overrides).unwrap()).unwrap()
    }

    /// Runs on one thread and stops after `most` episodes.
    fn run(plan: &Plan, folder: &Folder, most: usize) -> Result<usize> {
        let (stop, count) = (AtomicBool::new(false), AtomicUsize::new(0));
        let on_episode = || {
            if count.fetch_add(1, Ordering::Relaxed) + 1 == most {
                stop.store(true, Ordering::Relaxed);
            }
        };
        let mut work = plan.work(folder, RunOptions { threads: 1, shard: None }, None)?;
        work.run(&Watch { stop: &stop, on_episode: &on_episode, on_part: &|_| {}, on_look: &|_| {} })?;
        Ok(count.into_inner())
    }

    #[test]
    fn what_is_done_when_interrupted_is_kept_and_not_run_again() {
        let dir = tempfile::tempdir().unwrap();
        let plan = plan(&[]);
        let folder = plan.folder(Some(&dir.path().join("a"))).unwrap();
        assert!(matches!(run(&plan, &folder, 27), Err(Error::Interrupted)));
        assert_eq!(folder.missing(), [5]);
        let gates = Gates::new(&plan.manifest, None).unwrap();
        assert!(Summary::of_folder(&folder, &gates).is_err() && !folder.path.join("trials.parquet").exists());
        assert_eq!(run(&plan, &folder, usize::MAX).unwrap(), 5);
        assert_eq!(run(&plan, &folder, usize::MAX).unwrap(), 0);
        let whole = plan.folder(Some(&dir.path().join("b"))).unwrap();
        assert_eq!(run(&plan, &whole, usize::MAX).unwrap(), 30);
        let summary = |folder| Summary::of_folder(folder, &gates).unwrap().0;
        assert_eq!(summary(&folder), summary(&whole));
    }

    /// Also with one that does not divide the count of trials; and a folder keeps to the one it began with.
    #[test]
    fn a_result_is_the_same_for_any_count_of_trials_in_a_part() {
        let dir = tempfile::tempdir().unwrap();
        let result = |part_trials: u64| {
            let mut plan = plan(&[]);
            plan.manifest.part_trials = part_trials.try_into().unwrap();
            let folder = plan.folder(Some(&dir.path().join(part_trials.to_string()))).unwrap();
            assert_eq!(run(&plan, &folder, usize::MAX).unwrap(), 30);
            let again = self::tests::plan(&[]).folder(Some(&folder.path)).unwrap();
            assert_eq!((again.manifest.part_trials.get(), again.missing()), (part_trials, vec![]));
            let gates = Gates::new(&plan.manifest, None).unwrap();
            Summary::of_folder(&folder, &gates).unwrap();
            ["trials.parquet", "summary.json", "campaign.toml"]
                .map(|name| std::fs::read(folder.path.join(name)).unwrap())
        };
        let usual = result(super::PART_TRIALS.get());
        assert!([1, 7, 25, 100].into_iter().all(|part_trials| result(part_trials) == usual));
    }

    /// So that no boundary that was looked at is moved later.
    #[test]
    fn a_folder_that_is_given_more_trials_keeps_its_looks() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        let begin = |trials: u64| {
            let gains = ["", ":zmp_margin=0.2"].map(|variant| format!("hold{variant}")).to_vec();
            let overrides = Overrides { gains, trials: Some(trials), until_resolved: true, ..Default::default() };
            Plan::new(&Campaign::load("smoke", &overrides).unwrap()).unwrap()
        };
        let plan = begin(50);
        let folder = plan.folder(Some(&path)).unwrap();
        assert_eq!(folder.manifest.planned_trials, 50);
        plan.identify(&folder).unwrap();
        let more = begin(150);
        let folder = more.folder(Some(&path)).unwrap();
        let gates = Gates::new(&folder.manifest, None).unwrap();
        let mut work = more.work(&folder, RunOptions { threads: 1, shard: None }, Some(&gates)).unwrap();
        more.identify(&folder).unwrap();
        let mut looks = Vec::new();
        while !work.is_done() {
            looks.push(work.looks.as_ref().unwrap().next);
            // Both always recover: nothing is ever decided.
            let rows = |block: u64| {
                let (first, end) = folder.range(block);
                let of =
                    |trial: u64| folder.manifest.sets.iter().map(move |set| row(trial, set, 1.0, Outcome::Recovered));
                (first..end).flat_map(of).collect::<Vec<_>>()
            };
            work.missing.iter().for_each(|&block| folder.part(block).write(&rows(block)).unwrap());
            work.missing = work.look_on(&|_| {}).unwrap();
        }
        assert_eq!(looks, [25, 50, 75, 100, 125, 150]);
        let found = Folder::existing(&path).unwrap();
        assert_eq!((found.manifest.planned_trials, found.manifest.campaign.trials), (50, 150));
        assert_eq!(found.manifest.looks(), Some(Looks::up_to(50)));
    }

    /// Puts rows where work is missing, without a simulation: the first set recovers from nine of ten pushes, the
    /// second from one of five, and the third from nine of ten, but not the same as the first. Returns the number of
    /// rows.
    fn make_up(work: &mut Work) -> usize {
        let has_recovered = |trial: u64, set: usize| match set {
            0 => trial % 10 != 3,
            1 => trial.is_multiple_of(5),
            _ => trial % 10 != 7,
        };
        let (folder, mut made) = (work.folder, 0);
        while !work.is_done() {
            for &index in &work.missing {
                let block = Block::new(folder, index, &work.set_trials);
                let rows = block.trials.clone().filter_map(|trial| {
                    let of = |&set: &usize| {
                        let outcome = if has_recovered(trial, set) { Outcome::Recovered } else { Outcome::Fell };
                        row(trial, &folder.manifest.sets[set], 1.0, outcome)
                    };
                    made += block.sets.len();
                    block.put(trial, block.sets.iter().map(of).collect())
                });
                folder.part(index).write(&rows.last().unwrap()).unwrap();
            }
            work.missing = work.look_on(&|_| {}).unwrap();
        }
        folder.stop_at(&work.set_trials).unwrap();
        made
    }

    #[test]
    fn a_set_stops_when_all_about_it_is_decided_and_the_others_go_on() {
        let dir = tempfile::tempdir().unwrap();
        let plan = |trials: u64, more: &[&str]| {
            let gains = ["", ":zmp_margin=0.2", ":zmp_margin=0.4"].map(|variant| format!("hold{variant}")).to_vec();
            let set = more.iter().map(|s| s.to_string()).collect();
            let overrides = Overrides { gains, set, trials: Some(trials), until_resolved: true, ..Default::default() };
            Plan::new(&Campaign::load("smoke", &overrides).unwrap()).unwrap()
        };
        let run = |plan: &Plan| {
            let folder = plan.folder(Some(&dir.path().join("a"))).unwrap();
            let gates = Gates::new(&plan.manifest, None).unwrap();
            let options = RunOptions { threads: 1, shard: None };
            let mut work = plan.work(&folder, options, Some(&gates)).unwrap();
            let (before, all) = (work.episodes(), work.all_episodes());
            plan.identify(&folder).unwrap();
            let made = make_up(&mut work);
            assert_eq!(work.episodes(), 0);
            assert!(before >= made as u64 && all >= work.all_episodes());
            let summary = Summary::read(&folder, &gates).unwrap().0;
            assert_eq!(summary.sets.iter().map(|set| set.count.trials).sum::<u64>(), work.all_episodes());
            (made, folder.set_trials().unwrap(), summary)
        };
        let (made, set_trials, summary) = run(&plan(150, &[]));
        assert_eq!((made, &set_trials[..]), (325, &[150, 25, 150][..]));
        assert_eq!((summary.trials, summary.sets[1].count.trials), (150, 25));
        assert!(summary.stopped.unwrap().contains("after 25 trials"));
        // The same again, and with more trials: the same sets go on.
        assert_eq!(run(&plan(150, &[])).0, 0);
        let (made, set_trials, _) = run(&plan(200, &[]));
        assert_eq!((made, &set_trials[..]), (100, &[200, 25, 200][..]));
        // All is decided at an earlier look if less is asked: nothing is run, and later rows do not count.
        let (made, set_trials, _) = run(&plan(400, &["stopping.margin=0.7"]));
        assert_eq!((made, &set_trials[..]), (0, &[25, 25, 25][..]));
        // A gate asks for the set that had stopped: what it lacks is run, the rest is there.
        let gate = "gates.require=['hold zmp_margin=0.2 >= 0.21']";
        let (made, set_trials, _) = run(&plan(100, &[gate]));
        assert_eq!((made, &set_trials[..]), (75, &[25, 100, 25][..]));
    }

    /// Everyone who watches hears of each part once, and first of those that are there.
    #[test]
    fn parts_are_shown_as_soon_as_they_are_finished() {
        let dir = tempfile::tempdir().unwrap();
        let plan = plan(&[]);
        let folder = plan.folder(Some(&dir.path().join("a"))).unwrap();
        assert!(run(&plan, &folder, 12).is_err());
        let seen = Mutex::new(Vec::new());
        let on_part =
            |rows: &[TrialRow]| seen.lock().unwrap().push(rows.iter().map(|row| row.trial).collect::<Vec<_>>());
        let mut work = plan.work(&folder, RunOptions { threads: 1, shard: None }, None).unwrap();
        assert_eq!((work.episodes(), work.all_episodes()), (20, 30));
        let stop = AtomicBool::new(false);
        work.run(&Watch { stop: &stop, on_episode: &|| {}, on_part: &on_part, on_look: &|_| {} }).unwrap();
        assert_eq!((work.episodes(), work.all_episodes()), (0, 30));
        let seen = seen.into_inner().unwrap();
        assert_eq!(seen[0], (0..10).collect::<Vec<_>>());
        assert_eq!(seen[1..].concat(), (10..30).collect::<Vec<_>>());
        assert_eq!(seen.len(), 5);
    }

    #[test]
    fn the_hash_is_of_what_changes_a_result() {
        let hash = |plan: &Plan| plan.manifest.config_hash.clone();
        assert_eq!(hash(&plan(&[])), hash(&plan(&[])));
        for change in ["seed=5", "push.height_m=0.01", "sensors.bias_scale=0.4", "name=other", "episode.horizon_s=2"] {
            assert_ne!(hash(&plan(&[change])), hash(&plan(&[])), "{change}");
        }
        let texts = |a: &str, b: &str| super::hash("0", "c", &[a.into(), b.into()]);
        assert_ne!(texts("ab", "c"), texts("a", "bc"));
    }

    #[test]
    fn files_with_sets_of_one_name_are_not_mixed_up_by_their_variants() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name).to_string_lossy().into_owned();
        for (name, margin) in [("a.toml", 0.001), ("b.toml", 0.002)] {
            let text = format!("name = 'mine'\nstanding = 'posture'\nzmp_margin = {margin}\n");
            std::fs::write(path(name), text).unwrap();
        }
        let plan = |second: &str| {
            let gains = vec![path("a.toml") + ":zmp_margin=0.2", path(second) + ":zmp_margin=0.4"];
            Plan::new(&Campaign::load("smoke", &Overrides { gains, ..Default::default() }).unwrap())
        };
        assert_eq!(plan("a.toml").unwrap().inputs.len(), 1);
        let message = plan("b.toml").err().unwrap().to_string();
        assert!(message.contains("b.toml: name = mine: another file"), "{message}");
    }
}
