//! Whole episodes of the standard campaign, and a small campaign on one thread and on two.

use criterion::{Criterion, SamplingMode};
use standfast::controllers;
use standfast::sim::episode::{self, Outcome};
use standfast::study::ask::trial;
use standfast::study::run::{CampaignRun, RunEvents, RunOptions};
use standfast::study::{Campaign, Overrides, PreparedCampaign};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

fn campaign(name: &str, trials: u64, set: &[&str]) -> Campaign {
    let set = set
        .iter()
        .map(|assignment| assignment.to_string())
        .collect();
    let overrides = Overrides {
        set,
        trials: Some(trials),
        controllers: vec!["hold".into()],
        ..Overrides::default()
    };
    Campaign::load(name, &overrides).expect("built in")
}

pub fn episode(c: &mut Criterion) {
    let robot = standfast::robots::load("ut-mu2").expect("built in");
    let mut group = c.benchmark_group("episode");
    group
        .sample_size(10)
        .sampling_mode(SamplingMode::Flat)
        .measurement_time(Duration::from_secs(4));
    for (name, gains, impulse_n_s, outcome) in [
        ("hold recovers", "hold", 1.5, Outcome::Recovered),
        ("hold falls", "hold", 4.0, Outcome::Fell),
        (
            "catch recovers with footsteps",
            "catch",
            4.0,
            Outcome::Recovered,
        ),
    ] {
        let impulse = format!("push.impulse_n_s={impulse_n_s}");
        let campaign = campaign(
            "standard",
            1,
            &[&impulse, "push.heading_deg=0", "push.height_m=0"],
        );
        let config = &campaign.episode;
        let factory = controllers::load(gains)
            .and_then(|set| set.prepare(&robot, config.control_period_s))
            .expect("built in");
        let run = || {
            let disturbance = trial::disturbance(&campaign, 0);
            episode::run(
                &robot,
                &factory,
                config,
                disturbance,
                config.until(),
                &mut |_| {},
            )
            .unwrap()
        };
        assert_eq!(run().outcome, outcome, "{name}");
        group.bench_function(name, |b| b.iter(run));
    }
}

/// The trials of a campaign, which are written to a folder. Work that is done once, such as the search of the CPI sets,
/// is not timed. There are many short episodes, so that one thread does not wait long for the other thread at the end.
pub fn threads(c: &mut Criterion) {
    let short = [
        "push.start_s=0.05",
        "episode.horizon_s=0.4",
        "episode.judge.standing_time_s=0.1",
    ];
    let plan = PreparedCampaign::new(&campaign("nominal", 40, &short)).expect("valid");
    let seconds = [1, 2].map(|threads| {
        let mut seconds = Vec::new();
        let mut group = c.benchmark_group("campaign/40 short trials of hold");
        group
            .sample_size(10)
            .sampling_mode(SamplingMode::Flat)
            .measurement_time(Duration::from_secs(10));
        group.bench_function(
            if threads == 1 {
                "1 thread"
            } else {
                "2 threads"
            },
            |b| {
                b.iter_custom(|count| {
                    let spent = (0..count).map(|_| run(&plan, threads)).sum::<Duration>();
                    seconds.push(spent.as_secs_f64() / count as f64);
                    spent
                })
            },
        );
        group.finish();
        seconds.sort_by(f64::total_cmp);
        seconds.get(seconds.len() / 2).copied()
    });
    if let [Some(one), Some(two)] = seconds {
        println!(
            "campaign: 2 threads simulate {:.2} times as many trials per second as 1\n",
            one / two
        );
    }
}

fn run(plan: &PreparedCampaign, threads: usize) -> Duration {
    let scratch = tempfile::tempdir().expect("a temporary folder");
    let folder = plan.folder(Some(scratch.path())).expect("an empty folder");
    let mut work = CampaignRun::new(
        plan,
        &folder,
        RunOptions {
            threads,
            ..RunOptions::default()
        },
        None,
    )
    .expect("a design");
    let stop = AtomicBool::new(false);
    let start = Instant::now();
    work.run(&RunEvents {
        stop: &stop,
        on_episode: &|| {},
        on_part: &|_| {},
        on_look: &|_, _| {},
    })
    .expect("to finish");
    start.elapsed()
}
