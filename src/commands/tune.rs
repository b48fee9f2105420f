//! `standfast tune`: searches better numbers for a controller, and judges what it finds by trials that the search has not
//! seen.

use super::arguments::{ControllerArgs, DryRunArgs, ReplaysArgs, SettingArgs, count, fine};
use super::batch::BatchArgs;
use super::interrupt::{STOP, say_what_is_kept, stop_on_ctrl_c};
use super::progress::Progress;
use super::result::conclude;
use super::run::simulate;
use super::terminal::{note, print};
use standfast_core::error::{Error, Result};
use standfast_files::{is_same_file, write_atomic};
use standfast_report::{text::tune as text, tune_page};
use standfast_robots::urdf::Files;
use standfast_study::batch::{self, Batch};
use standfast_study::run::{CampaignRun, RunOptions};
use standfast_study::tune::search::Generation;
use standfast_study::tune::{Budget, MOST_EPISODES, TuneOptions, Tuned, Tuning};
use standfast_study::verdict::gates::Gates;
use standfast_study::{Campaign, Folder, Overrides, PreparedCampaign, Summary};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::thread::sleep;
use std::time::Duration;

#[derive(Debug, clap::Args)]
#[command(mut_arg("first_controller", |arg| arg.default_value("catch")))]
#[command(after_help = "Examples:
  standfast tune catch --campaign harsh --robot g1.urdf
  standfast tune catch --robot g1.urdf --engine both --budget 2h
  standfast tune catch --robot ut-mu2 --robot g1.urdf --vary catching.pause
  standfast tune mine.toml --vary zmp_margin --vary gains.0.x.0=0.1..0.3
  standfast tune catch --budget 100000 --shard 1/4 --out /shared/tuned

A search changes the numbers of the controller: those that it names itself, or
those of --vary. The key of a list, such as a policy's stiffness, stands for a
factor on all its numbers. Each generation of candidates goes through the same
fresh pushes, and one that has certainly lost stops early. With several robots,
or both engines, the worst case of a candidate counts.

What is found is then compared with the controller as it was, by a campaign of
--trials pushes. Their seed follows from the whole task, so no other task has
them; it is written down before the search and used once. That verdict is the
result. Only a controller that is better is written, to
NAME-tuned.toml in the folder of --out; tune.html shows the search.

A search that was interrupted goes on where it stopped when the same command is
given again. The guide's chapter tuning.md has more.")]
#[command(mut_arg("shard", |arg| arg.help("Run only part K of N of each generation; all N run at the same time")))]
#[command(mut_arg("out", |arg| arg.help("Folder [default: standfast-results/tune-NAME]")))]
pub struct TuneArgs {
    #[command(flatten)]
    pub controller: ControllerArgs,
    /// A campaign: smoke, nominal, standard, harsh, robocup, dysturbance, or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "standard")]
    pub campaign: String,
    /// Robot by name, or URDF or MJCF file; may be repeated
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Vec<String>,
    /// A number to change, with or without its range; may be repeated
    #[arg(long, value_name = "KEY[=FROM..TO]")]
    pub vary: Vec<String>,
    /// Most episodes, or a time such as 2h
    #[arg(long, value_name = "N|TIME", default_value = "12000", value_parser = budget)]
    pub budget: Budget,
    /// Pushes of the final campaign
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = count::<u64>(1..=1_000_000))]
    pub trials: u64,
    #[command(flatten)]
    pub settings: SettingArgs,
    /// Do not try first whether the robot stands without a push
    #[arg(long)]
    pub untried: bool,
    #[command(flatten)]
    pub dry_run: DryRunArgs,
    #[command(flatten)]
    pub batch: BatchArgs,
}

/// Longest time of a budget, a year (h).
const MOST_HOURS: f64 = 8760.0;

/// Reads a number of episodes, or a time with its unit.
fn budget(text: &str) -> Result<Budget, String> {
    let units = [("min", 60.0), ("h", 3600.0), ("s", 1.0)];
    let time = units
        .iter()
        .find_map(|(unit, s)| Some((text.strip_suffix(unit)?.trim(), s)));
    let refused = || {
        format!(
            "{text} is no budget; accepted: a number of episodes up to {MOST_EPISODES}, or a time such as 10min or 2h, up to \
             {MOST_HOURS}h"
        )
    };
    match time {
        Some((number, s)) => match number.parse::<f64>().map(|number| number * s) {
            Ok(time_s) if time_s > 0.0 && time_s <= 3600.0 * MOST_HOURS => Ok(Budget::Time(time_s)),
            _ => Err(refused()),
        },
        None => {
            let episodes = text
                .parse()
                .ok()
                .filter(|episodes| *episodes <= MOST_EPISODES);
            episodes.map(Budget::Episodes).ok_or_else(refused)
        }
    }
}

/// Searches, judges, and writes what was found.
pub fn run(args: &TuneArgs) -> Result<ExitCode> {
    let cases = args.cases()?;
    let options = TuneOptions {
        vary: args.vary.clone(),
        budget: args.budget,
        trials: args.trials,
        threads: args.batch.threads,
        untried: args.untried,
        shard: args.batch.shard,
    };
    stop_on_ctrl_c();
    let name = Path::new(args.controller.name())
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy();
    let of_name = || Path::new("standfast-results").join(format!("tune-{name}"));
    let folder = args.batch.out.clone().unwrap_or_else(of_name);
    batch::check_out(&folder)?;
    let tuning = Tuning::new(&cases, options, &folder)?;
    let numbers = tuning.task.tunables.len();
    let told = format!(
        "{numbers} {} of {} on {}, up to {} episodes, then {} to judge, by pushes of seed {}",
        if numbers == 1 { "number" } else { "numbers" },
        tuning.task.controller,
        text::cases(&tuning.task.cases),
        tuning.task.episodes - tuning.final_episodes(),
        tuning.final_episodes(),
        tuning.task.final_seed,
    );
    if args.dry_run.dry_run {
        print(&text::ranges(&tuning.task))?;
        return fine(&told);
    }
    note(&told);
    if tuning.goes_on {
        let there = tuning.episodes_there()?;
        note(&format!(
            "{}: goes on, {there} episodes are there",
            folder.display()
        ));
    }
    let mut tuned = search(&tuning)?;
    judge(args, &tuning, &cases, &mut tuned, &folder)?;
    finish(args, &tuning, &tuned, &folder)
}

/// Searches, with a line for each generation.
fn search(tuning: &Tuning) -> Result<Tuned> {
    let most = tuning.task.episodes - tuning.final_episodes();
    let progress = Progress::of_episodes(most, tuning.episodes_there()?, true);
    let on_generation = |generation: &Generation, spread: f64, spent: u64| {
        note(&text::generation(generation, spread, spent))
    };
    let batch = Batch {
        folder: &tuning.folder,
        task: &tuning.hash,
        shard: tuning.options.shard,
        stop: &STOP,
        on_episode: &|| progress.episode(),
        on_job: &|| {},
        on_wait: &|missing| log::info!("waits for shard {missing}"),
    };
    let tuned = tuning.search(batch, &on_generation);
    progress.finish();
    say_what_is_kept(tuned, "generations")
}

/// Compares what is proposed with the incumbent by the final campaigns, unless it is the incumbent.
fn judge(
    args: &TuneArgs,
    tuning: &Tuning,
    cases: &[(Campaign, Files)],
    tuned: &mut Tuned,
    folder: &Path,
) -> Result<()> {
    if tuned.is_incumbent() {
        return Ok(());
    }
    let proposed = tuning.write_controller(tuned, "proposed.toml", &[])?;
    for (case, (campaign, files)) in cases.iter().enumerate() {
        let name = if cases.len() == 1 {
            "final".into()
        } else {
            format!("final-{}", case + 1)
        };
        let campaign = tuned.final_campaign(campaign, &proposed);
        let plan = PreparedCampaign::with(&campaign, files.clone())?;
        let result = plan.folder(Some(&folder.join(&name)))?;
        let gates = Gates::new(&result.manifest, None)?;
        note(&format!(
            "judges {} on {} by {} pushes that the search has not seen:",
            tuned.name,
            text::case(&tuned.task.cases[case]),
            campaign.trials
        ));
        let options = RunOptions {
            threads: args.batch.threads,
            shard: args.batch.shard,
            untried: true,
        };
        let mut work = CampaignRun::new(&plan, &result, options, Some(&gates))?;
        simulate(&mut work, Some(&gates), false)?;
        wait_for_others(&result)?;
        let summary = match args.writes() {
            true => {
                work.within_threads(|| {
                    conclude(&result, &gates, &ReplaysArgs::default(), None, false)
                })?
                .0
            }
            false => Summary::read(&result, &gates)?.0,
        };
        tuned.add_verdict(case, &name, &summary);
    }
    Ok(())
}

/// Waits until other shards have run what is missing in a final campaign.
fn wait_for_others(result: &Folder) -> Result<()> {
    while !result.missing().is_empty() {
        if STOP.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        sleep(Duration::from_millis(500));
    }
    Ok(())
}

/// Writes and prints the result.
fn finish(args: &TuneArgs, tuning: &Tuning, tuned: &Tuned, folder: &Path) -> Result<ExitCode> {
    if !args.writes() {
        note("this shard is done; shard 1 writes the result");
        return Ok(ExitCode::SUCCESS);
    }
    let as_json = standfast_report::json(tuned);
    print(&if args.batch.json {
        as_json.clone()
    } else {
        text::text(tuned)
    })?;
    write_atomic(&folder.join("tune.json"), as_json.as_bytes())?;
    write_atomic(
        &folder.join("tune.html"),
        tune_page::page(tuned)?.as_bytes(),
    )?;
    if tuned.is_better {
        let file = format!("{}.toml", tuned.name);
        let path = tuning.write_controller(tuned, &file, &text::provenance(tuned))?;
        note(&format!("written: {}", path.display()));
    }
    note(&format!(
        "written: {}, tune.json",
        folder.join("tune.html").display()
    ));
    Ok(ExitCode::SUCCESS)
}

impl TuneArgs {
    /// Whether the result is written here, and not by another shard.
    fn writes(&self) -> bool {
        self.batch.shard.is_none_or(|shard| shard.index == 1)
    }

    /// The campaign of each robot in each engine, with the files of the robot.
    fn cases(&self) -> Result<Vec<(Campaign, Files)>> {
        let robots: Vec<Option<String>> = match &self.robot[..] {
            [] => vec![None],
            some => some.iter().cloned().map(Some).collect(),
        };
        if let Some(twice) = (1..robots.len()).find(|&i| {
            robots[..i].iter().flatten().any(|other| {
                robots[i]
                    .as_ref()
                    .is_some_and(|robot| is_same(robot, other))
            })
        }) {
            let robot = robots[twice].clone().unwrap_or_default();
            return Err(Error::option(
                "--robot",
                robot,
                "is given twice",
                "each robot once",
            ));
        }
        let mut cases = Vec::new();
        for robot in robots {
            let overrides = Overrides {
                controllers: vec![self.controller.name().to_string()],
                robot,
                ..self.settings.overrides()
            };
            let files = Campaign::robot_files(&self.campaign, &overrides)?;
            let entrants = Campaign::load_for(&files.robot()?, &self.campaign, &overrides)?;
            for campaign in entrants.of_each_entrant() {
                if campaign.stopping.until_resolved {
                    let (problem, accepted) = (
                        "ends when decided",
                        "a campaign with a fixed number of trials",
                    );
                    return Err(Error::option(
                        "--campaign",
                        &self.campaign,
                        problem,
                        accepted,
                    ));
                }
                cases.push((campaign, files.clone()));
            }
        }
        Ok(cases)
    }
}

/// Whether two names are of the same robot.
fn is_same(a: &str, b: &str) -> bool {
    a == b || is_same_file(Path::new(a), Path::new(b))
}
