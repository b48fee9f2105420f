//! Runs a campaign: what its folder lacks is spread over the cores, and written part by part.

use crate::batch::run_parts;
use crate::plan::{Pool, PreparedCampaign, pool};
use crate::store::claim::{Access, Claim};
use crate::store::folder::Folder;
use crate::store::manifest::Manifest;
use crate::store::row::TrialRow;
use crate::store::shard::Shard;
use crate::until_resolved::{Look, UntilResolved};
use crate::verdict::gates::Gates;
use crate::verdict::summary::Summary;
use standfast_core::error::Result;
use standfast_core::socket::PreparedController;
use standfast_sim::episode::ClosedLoop;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// How much of a campaign to run, and on how many threads.
#[derive(Debug, Clone, Copy, Default)]
pub struct RunOptions {
    /// Number of threads; 0 means one for each core.
    pub threads: usize,
    pub shard: Option<Shard>,
    /// Whether controllers run that have not been tried without a push.
    pub untried: bool,
}

/// Functions that are called while a campaign runs, and a flag that stops it.
pub struct RunEvents<'a> {
    /// Somebody sets this to stop the run early.
    pub stop: &'a AtomicBool,
    /// Called after every episode, from any thread.
    pub on_episode: &'a (dyn Fn() + Sync),
    /// Called with the rows of every finished part, from any thread; first of those that were there already.
    pub on_part: &'a (dyn Fn(&[TrialRow]) + Sync),
    /// Called at every look at a campaign that ends when decided, with the episodes of the campaign in all, at most.
    pub on_look: &'a (dyn Fn(&Look, u64) + Sync),
}

/// The part of a campaign that its folder still lacks, with everything that is needed to run it.
pub struct CampaignRun<'a> {
    pub plan: &'a PreparedCampaign,
    pub folder: &'a Folder,
    pool: Pool,
    untried: bool,
    pub shard: Option<Shard>,
    /// Blocks to run. If the campaign ends when decided, these are the blocks up to the next look.
    missing: Vec<u64>,
    /// Number of trials of each controller, if the campaign does not end earlier.
    all_trials: Vec<u64>,
    /// None for a campaign with a fixed number of trials.
    looks: Option<UntilResolved<'a>>,
    claim: Option<Claim>,
}

impl<'a> CampaignRun<'a> {
    /// The work that `folder` lacks, of one shard or of all. If anything is lacking, all controllers are prepared here,
    /// so that a controller that cannot be prepared fails before anything is written or removed. `gates` state what a
    /// campaign that ends when decided has to decide. Errors: a controller cannot be prepared, or a robot falls without
    /// a push.
    pub fn new(
        plan: &'a PreparedCampaign,
        folder: &'a Folder,
        options: RunOptions,
        gates: Option<&'a Gates>,
    ) -> Result<CampaignRun<'a>> {
        let Manifest {
            campaign,
            controllers,
            ..
        } = &folder.manifest;
        let mut work = CampaignRun {
            plan,
            folder,
            pool: pool(options.threads, plan.open_episodes())?,
            untried: options.untried,
            shard: options.shard,
            missing: Vec::new(),
            all_trials: vec![campaign.trials; controllers.len()],
            looks: gates.and_then(|gates| UntilResolved::new(folder, gates)),
            claim: None,
        };
        work.missing = match work.looks {
            Some(_) => work.look_on(&|_, _| {})?,
            None => work.blocks().filter(|&block| work.lacks(block)).collect(),
        };
        if !work.is_done() {
            work.factories()?;
        }
        Ok(work)
    }

    /// The controllers, tried without a push.
    fn factories(&self) -> Result<&'a [PreparedController]> {
        let (plan, untried) = (self.plan, self.untried);
        self.pool.install(|| plan.tried_factories(untried))
    }

    /// Whether the folder lacks nothing.
    pub fn is_done(&self) -> bool {
        self.missing.is_empty()
    }

    /// Calls `f`, which uses no more threads than the run.
    pub fn within_threads<T: Send>(&self, f: impl FnOnce() -> T + Send) -> T {
        self.pool.install(f)
    }

    pub fn threads(&self) -> usize {
        self.pool.threads
    }

    /// Number of episodes still to run, as the folder is now. It is an upper bound if the campaign ends when decided.
    pub fn episodes(&self) -> u64 {
        if self.is_done() {
            0
        } else {
            self.episodes_of(|block| self.folder.lacks(block, self.controller_trials()))
        }
    }

    /// Number of episodes of the campaign, including finished ones. It is an upper bound if the campaign ends when
    /// decided.
    pub fn all_episodes(&self) -> u64 {
        self.all_episodes_with(self.controller_trials())
    }

    fn all_episodes_with(&self, controller_trials: &[u64]) -> u64 {
        self.episodes_of(|block| {
            let (first, _) = self.folder.range(block);
            controller_trials
                .iter()
                .map(|&trials| first < trials)
                .collect()
        })
    }

    /// Number of episodes in all blocks, with the controllers of each block for which `of` is true.
    fn episodes_of(&self, of: impl Fn(u64) -> Vec<bool>) -> u64 {
        let mut episodes = 0;
        for block in self.blocks() {
            let (first, end) = self.folder.range(block);
            let controllers = of(block).into_iter().filter(|is_one| *is_one).count() as u64;
            episodes += (end - first) * controllers;
        }
        episodes
    }

    /// The blocks of the campaign, or of the shard.
    fn blocks(&self) -> impl Iterator<Item = u64> + use<> {
        let Manifest {
            campaign,
            part_trials,
            ..
        } = &self.folder.manifest;
        let shard = self.shard;
        (0..campaign.trials.div_ceil(part_trials.get())).filter(move |&block| takes(shard, block))
    }

    /// Number of trials of each controller: the final one if it is decided, else the largest possible one.
    fn controller_trials(&self) -> &[u64] {
        self.looks
            .as_ref()
            .map_or(&self.all_trials, |looks| &looks.controller_trials)
    }

    fn lacks(&self, block: u64) -> bool {
        self.folder
            .lacks(block, self.controller_trials())
            .contains(&true)
    }

    /// Whether the campaign has been decided, perhaps by another shard.
    fn is_decided(&self) -> bool {
        self.looks.is_some() && self.shard.is_some() && self.folder.has_stopped()
    }

    /// Takes the next looks at a campaign that ends when decided, as far as there are trials. Returns the blocks to run
    /// next. It returns none if all is decided, or if there are no more trials.
    fn look_on(&mut self, on_look: &dyn Fn(&Look, u64)) -> Result<Vec<u64>> {
        let Some(mut looks) = self.looks.take() else {
            return Ok(Vec::new());
        };
        looks.go_on(&|look| on_look(look, self.all_episodes_with(look.controller_trials)))?;
        let missing = looks.lacking(|block| takes(self.shard, block));
        self.looks = Some(looks);
        Ok(missing)
    }

    /// Runs what is missing and writes it part by part. Parts that are complete are left as they are.
    ///
    /// From then on nobody else may change the folder, as long as this lives.
    pub fn run(&mut self, watch: &RunEvents) -> Result<()> {
        let access = if self.shard.is_some() {
            Access::SharedByShards
        } else {
            Access::Exclusive
        };
        // No report may stand beside another decision; where there are no shards, it is written again in any case.
        let asks_anew = self.shard.is_some() && self.folder.asks_anew();
        self.claim = Some(Claim::of(self.folder, access, || {
            self.plan.identify(self.folder)
        })?);
        if asks_anew || !self.is_done() {
            self.folder.remove_result()?;
        }
        if !self.is_done() {
            for block in 0..self.folder.blocks() {
                if self.lacks(block) {
                    continue;
                }
                if let Ok(rows) = self
                    .folder
                    .rows_of(block..block + 1, self.controller_trials())
                {
                    (watch.on_part)(&rows);
                }
            }
        }
        let factories = match self.is_done() {
            true => &[],
            false => self.factories()?,
        };
        let opening = self.plan.opening(factories);
        // Another shard may have decided the campaign, perhaps by parts that are not seen here.
        while !self.is_done() && !self.is_decided() {
            self.pool
                .install(|| self.run_blocks(factories, opening.as_ref(), watch))?;
            self.missing = self.look_on(watch.on_look)?;
        }
        match &self.looks {
            Some(looks) if looks.is_over => self.folder.stop_at(&looks.controller_trials),
            _ => Ok(()),
        }
    }

    /// Runs the missing blocks, and writes each as a part.
    fn run_blocks(
        &self,
        factories: &[PreparedController],
        opening: Option<&ClosedLoop>,
        watch: &RunEvents,
    ) -> Result<()> {
        let due = self.missing.iter().take_while(|_| !self.is_decided());
        let blocks = due.map(|&index| {
            let block = Block::new(self.folder, index, self.controller_trials());
            let (first, end) = self.folder.range(index);
            // A range of `usize` has a known length.
            let trials = (first as usize..end as usize).map(|trial| trial as u64);
            (block, trials)
        });
        let run = |block: &Block, trial| {
            let rows = self
                .plan
                .rows(factories, opening, trial, &block.controllers)?;
            for _ in &rows {
                (watch.on_episode)();
            }
            Ok(rows)
        };
        run_parts(blocks, watch.stop, run, |block, rows| {
            let rows = block.joined(rows.concat(), &self.folder.manifest.controllers);
            self.folder.check_owner()?;
            self.folder.part(block.index).write(&rows)?;
            (watch.on_part)(&rows);
            Ok(())
        })
    }
}

/// Runs what the folder `out` lacks of a campaign, on all cores, and concludes it.
pub fn run_all(plan: &PreparedCampaign, out: &Path) -> Result<Summary> {
    let folder = plan.folder(Some(out))?;
    let gates = Gates::new(&folder.manifest, None)?;
    let watch = RunEvents {
        stop: &AtomicBool::new(false),
        on_episode: &|| {},
        on_part: &|_| {},
        on_look: &|_, _| {},
    };
    CampaignRun::new(plan, &folder, RunOptions::default(), Some(&gates))?.run(&watch)?;
    Ok(Summary::of_folder(&folder, &gates)?.0)
}

/// Whether a block is for this shard, or for a run without shards.
fn takes(shard: Option<Shard>, block: u64) -> bool {
    shard.is_none_or(|shard| shard.takes(block))
}

/// A block in work.
struct Block {
    index: u64,
    /// The controllers that run.
    controllers: Vec<usize>,
    /// The rows that the stored part has.
    stored: Vec<TrialRow>,
}

impl Block {
    /// The block of a folder whose controllers have `set_trials` trials. It runs the controllers that the stored part
    /// lacks, and keeps the rows that the part has.
    fn new(folder: &Folder, index: u64, controller_trials: &[u64]) -> Self {
        let (first, _) = folder.range(index);
        // A part that cannot be read is run again.
        let stored = folder.part(index).rows().unwrap_or_default();
        let is_stored = |name: &str| stored.iter().any(|row| row.controller == name);
        let controllers = folder
            .manifest
            .controllers
            .iter()
            .zip(controller_trials)
            .enumerate();
        let controllers = controllers
            .filter(|(_, (name, trials))| first < **trials && !is_stored(name))
            .map(|(controller, _)| controller)
            .collect();
        Self {
            index,
            controllers,
            stored,
        }
    }

    /// The stored rows and these new ones, by trial and then in the order of the controllers `names`.
    fn joined(&self, new: Vec<TrialRow>, names: &[String]) -> Vec<TrialRow> {
        let mut rows = [self.stored.clone(), new].concat();
        rows.sort_by_key(|row| {
            (
                row.trial,
                names.iter().position(|name| *name == row.controller),
            )
        });
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::tests::planned;
    use crate::{Campaign, Overrides};
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Runs on one thread and stops after `most` episodes.
    fn run(plan: &PreparedCampaign, folder: &Folder, most: usize) -> Result<usize> {
        let (stop, count) = (AtomicBool::new(false), AtomicUsize::new(0));
        let on_episode = || {
            if count.fetch_add(1, Ordering::Relaxed) + 1 == most {
                stop.store(true, Ordering::Relaxed);
            }
        };
        let mut work = CampaignRun::new(
            plan,
            folder,
            RunOptions {
                threads: 1,
                ..RunOptions::default()
            },
            None,
        )?;
        work.run(&RunEvents {
            stop: &stop,
            on_episode: &on_episode,
            on_part: &|_| {},
            on_look: &|_, _| {},
        })?;
        Ok(count.into_inner())
    }

    /// The number of trials in a part need not divide the number of trials, and a folder keeps the number with which it
    /// began.
    #[test]
    fn a_result_is_the_same_for_any_count_of_trials_in_a_part() {
        let dir = tempfile::tempdir().unwrap();
        let result = |part_trials: u64| {
            let mut plan = planned(&[]);
            plan.manifest.part_trials = part_trials.try_into().unwrap();
            let folder = plan
                .folder(Some(&dir.path().join(part_trials.to_string())))
                .unwrap();
            assert_eq!(run(&plan, &folder, usize::MAX).unwrap(), 30);
            let again = planned(&[]).folder(Some(&folder.path)).unwrap();
            assert_eq!(
                (again.manifest.part_trials.get(), again.missing()),
                (part_trials, vec![])
            );
            let gates = Gates::new(&plan.manifest, None).unwrap();
            Summary::of_folder(&folder, &gates).unwrap();
            ["trials.parquet", "summary.json", "campaign.toml"]
                .map(|name| std::fs::read(folder.path.join(name)).unwrap())
        };
        let usual = result(5);
        assert!(
            [1, 7, 25, 100]
                .into_iter()
                .all(|part_trials| result(part_trials) == usual)
        );
    }

    /// Even if the parts by which it was decided are not seen here.
    #[test]
    fn a_shard_ends_when_another_one_has_decided() {
        let dir = tempfile::tempdir().unwrap();
        let gains = vec!["hold".into(), "fixed".into()];
        let trials = Some(100);
        let overrides = Overrides {
            controllers: gains,
            trials,
            until_resolved: true,
            synthetic: true,
            ..Default::default()
        };
        let plan = PreparedCampaign::new(&Campaign::load("smoke", &overrides).unwrap()).unwrap();
        let folder = plan.folder(Some(&dir.path().join("a"))).unwrap();
        let gates = Gates::new(&plan.manifest, None).unwrap();
        let options = RunOptions {
            threads: 1,
            shard: "1/2".parse().ok(),
            ..RunOptions::default()
        };
        let mut work = CampaignRun::new(&plan, &folder, options, Some(&gates)).unwrap();
        let (stop, parts) = (AtomicBool::new(false), AtomicUsize::new(0));
        let on_part = |_: &[TrialRow]| {
            parts.fetch_add(1, Ordering::Relaxed);
            folder.stop_at(&[25, 25]).unwrap();
        };
        work.run(&RunEvents {
            stop: &stop,
            on_episode: &|| {},
            on_part: &on_part,
            on_look: &|_, _| {},
        })
        .unwrap();
        assert!((1..=2).contains(&parts.into_inner()) && folder.has_stopped() && !work.is_done());
    }

    /// Everyone who watches hears of each part once, and first of those that are there.
    #[test]
    fn parts_are_shown_as_soon_as_they_are_finished() {
        let dir = tempfile::tempdir().unwrap();
        let plan = planned(&[]);
        let folder = plan.folder(Some(&dir.path().join("a"))).unwrap();
        assert!(run(&plan, &folder, 12).is_err());
        let seen = Mutex::new(Vec::new());
        let on_part = |rows: &[TrialRow]| {
            seen.lock()
                .unwrap()
                .push(rows.iter().map(|row| row.trial).collect::<Vec<_>>())
        };
        let mut work = CampaignRun::new(
            &plan,
            &folder,
            RunOptions {
                threads: 1,
                ..RunOptions::default()
            },
            None,
        )
        .unwrap();
        assert_eq!((work.episodes(), work.all_episodes()), (20, 30));
        let stop = AtomicBool::new(false);
        work.run(&RunEvents {
            stop: &stop,
            on_episode: &|| {},
            on_part: &on_part,
            on_look: &|_, _| {},
        })
        .unwrap();
        assert_eq!((work.episodes(), work.all_episodes()), (0, 30));
        let seen = seen.into_inner().unwrap();
        assert_eq!(seen[..2].concat(), (0..10).collect::<Vec<_>>());
        assert_eq!(seen.concat(), (0..30).collect::<Vec<_>>());
        assert_eq!(seen.len(), 6);
    }
}
