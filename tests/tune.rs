//! `standfast tune`: a search is the same however it is run, goes on where it stopped, and its verdict is that of an
//! ordinary campaign with a seed of its own.

mod common;

use common::program::{PROGRAM, Run, files, folder, standfast, stderr, stdout};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// A search with little to simulate.
const SEARCH: [&str; 10] = [
    "tune",
    "fixed",
    "--campaign=smoke",
    "--set=episode.horizon_s=0.25",
    "--set=episode.judge.standing_time_s=0.05",
    "--set=push.start_s=0.02",
    "--set=push.impulse_n_s={uniform=[0, 4]}",
    "--vary=zmp_margin=0.02..0.4",
    "--vary=gains.0.x.0",
    "--trials=20",
];
const BUDGET: &str = "--budget=2300";

fn search<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SEARCH[..], &[BUDGET], more].concat()
}

/// What a search leaves, but for the parts of shards and of the final campaign, and its replays.
fn left(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut left = files(folder);
    left.retain(|name, _| !name.contains("parts/") && !name.contains("replays/") && !name.contains("report.html"));
    left
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_search_is_the_same_for_any_number_of_threads_and_shards_and_goes_on_where_it_stopped() {
    let dir = folder();
    let told = stdout(&standfast(dir.path(), &search(&["--out=one"])).success());
    let one = left(&dir.path().join("one"));
    // Two programs at the same time, each with a half of the trials.
    let member = |shard: &str| {
        let args = search(&["--threads=1", "--out=team"]);
        let mut command = Command::new(PROGRAM);
        command.current_dir(dir.path()).args(args).arg(format!("--shard={shard}"));
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let members = ["1/2", "2/2"].map(member);
    let ends = members.map(|member| member.wait_with_output().unwrap());
    assert!(ends.iter().all(|end| end.status.success()), "{ends:?}");
    assert!(ends[1].stdout.is_empty() && String::from_utf8_lossy(&ends[0].stdout) == told);
    assert!(one == left(&dir.path().join("team")), "shards change something");

    // As if it had been stopped in its sixth generation, and was continued on one core.
    let two = dir.path().join("two");
    fs::create_dir(&two).unwrap();
    for name in one.keys().filter(|name| name.ends_with(".json") && !name.contains('/') && *name != "tune.json") {
        if !name.starts_with("generation") || name.as_str() < "generation-006.json" {
            fs::write(two.join(name), &one[name]).unwrap();
        }
    }
    let again = standfast(dir.path(), &search(&["--threads=1", "--out=two"])).success();
    assert!(stderr(&again).contains("two: goes on, ") && stdout(&again) == told);
    assert!(one == left(&two), "an interruption, or threads, change something");

    // The folder keeps to its search, and its verdict is that of a campaign whose seed was written down before.
    let other = stderr(&standfast(dir.path(), &search(&["--out=two", "--seed=5"])).code(3));
    assert!(other.contains("two: holds another search"), "{other}");
    let (task, tuned, summary) =
        (json(&two.join("task.json")), json(&two.join("tune.json")), json(&two.join("final/summary.json")));
    assert_eq!(task["final_seed"], summary["seed"]);
    assert_ne!(task["search_seed"], task["final_seed"]);
    let verdict = &tuned["verdicts"][0];
    let rates: Vec<&Value> = summary["sets"].as_array().unwrap().iter().map(|set| &set["recovered"]).collect();
    assert_eq!(rates, [&verdict["recovered"][0], &verdict["recovered"][1]], "{summary}");
    assert_eq!((&verdict["trials"], &summary["trials"]), (&20.into(), &20.into()));
    let is_better = tuned["is_better"].as_bool().unwrap();
    assert_eq!(is_better, verdict["difference"].as_f64() > Some(0.0) && verdict["p"].as_f64() < Some(0.05));
    assert_eq!(is_better, two.join("fixed-tuned.toml").exists(), "only what is better is given away");
    assert!(told.contains("points that") || told.contains("pushes that the search has not seen"), "{told}");
    let page = String::from_utf8(one["tune.html"].clone()).unwrap();
    assert!(page.matches("<svg").count() == 3 && page.contains("gains.0.x.0") && !page.contains("http://"), "{page}");
    // What is written can be used.
    standfast(dir.path(), &["push", "--check", "--gains=two/proposed.toml"]).success();
}

#[test]
fn bad_input_is_told_before_anything_runs() {
    let dir = folder();
    fs::write(dir.path().join("a-file"), "").unwrap();
    let policy = "kind = 'process'\nname = 'mine'\ncommand = ['cat']\n[parameters]\ngain = 1\n[tunable]\n";
    fs::write(dir.path().join("unknown.toml"), format!("{policy}gian = [0, 2]\n")).unwrap();
    fs::write(dir.path().join("empty.toml"), format!("{policy}gain = [2, 2]\n")).unwrap();
    for (args, words) in [
        (vec!["tune", "hold"], "hold: names no number to tune; accepted: --vary KEY=FROM..TO"),
        (vec!["tune", "catch", "--vary=zmp_margn=0..1"], "zmp_margn: catch has no such number; accepted: zmp_margin"),
        (vec!["tune", "catch", "--vary=name=0..1"], "name=0..1: is neither a number nor a list of numbers"),
        (vec!["tune", "catch", "--vary=zmp_margin=1..0"], "zmp_margin=1..0: its range has no extent"),
        (vec!["tune", "catch", "--vary=zmp_margin=0..wide"], "has no range of two numbers"),
        (vec!["tune", "catch", "--vary=catching.late"], "has no range, and the controller names none for it"),
        (
            vec!["tune", "catch", "--vary=zmp_margin=0..9"],
            "its end 9 cannot be used: catch: zmp_margin = 9.0000: leaves no",
        ),
        (vec!["tune", "robust", "--vary=gains.0.x.0=0.01..2"], "its end 0.01 cannot be used: robust: zmp_disturbance"),
        (vec!["tune", "catch", "--vary=zmp_margin", "--vary=zmp_margin"], "zmp_margin: is given twice"),
        (
            vec!["tune", "catch", "--budget=500"],
            "500 episodes: is too small for 12 numbers and 1000 final trials; accepted: ",
        ),
        (vec!["tune", "catch", "--budget=soon"], "soon is no budget; accepted: a number of episodes, or a time"),
        (vec!["tune", "catch", "--budget=1h", "--shard=1/2"], "each shard would measure another pace"),
        (vec!["tune", "catch", "--robot=ut-mu2", "--robot=ut-mu2"], "ut-mu2: is given twice"),
        (vec!["tune", "catch", "--out=a-file"], "a-file: it is a file"),
        (vec!["tune", "best"], "controller \"best\" not found"),
        (
            vec!["tune", "unknown.toml"],
            "tunable.gian = [0, 2]: is no number among the parameters; accepted: one of: gain",
        ),
        (vec!["tune", "empty.toml"], "tunable.gain = [2, 2]: its range has no extent"),
    ] {
        let run: Run = standfast(dir.path(), &args).code(2);
        let message = stderr(&run);
        assert!(message.contains(words), "{args:?}: {message}");
    }
    assert_eq!(files(dir.path()).len(), 3, "something was written");
    let ranges = stdout(&standfast(dir.path(), &["tune", "catch", "--check"]).success());
    assert!(ranges.contains("catching.pause") && ranges.contains("0.03 to 0.8"), "{ranges}");
}
