//! `standfast tune`: a search is the same however it is run, continues where it stopped, and has the verdict of an
//! ordinary campaign with a seed of its own.

use crate::common::program::{PROGRAM, Run, files, folder, standfast, stderr, stdout};
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

/// The files that a search leaves, without the parts of shards and of the final campaign, and without its replays.
fn left(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut left = files(folder);
    left.retain(|name, _| {
        !name.contains("parts/") && !name.contains("replays/") && !name.contains("report.html")
    });
    left
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
#[ignore = "searches several times, three quarters of a minute"]
fn a_search_is_the_same_for_any_number_of_threads_and_shards_and_goes_on_where_it_stopped() {
    let dir = folder();
    let told = stdout(&standfast(dir.path(), &search(&["--out=one"])).success());
    let one = left(&dir.path().join("one"));
    // Two programs run at the same time, each with a half of the trials.
    let member = |shard: &str| {
        let args = search(&["--threads=1", "--out=team"]);
        let mut command = Command::new(PROGRAM);
        command
            .current_dir(dir.path())
            .args(args)
            .arg(format!("--shard={shard}"));
        command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let members = ["1/2", "2/2"].map(member);
    let ends = members.map(|member| member.wait_with_output().unwrap());
    assert!(ends.iter().all(|end| end.status.success()), "{ends:?}");
    assert!(ends[1].stdout.is_empty() && String::from_utf8_lossy(&ends[0].stdout) == told);
    assert!(
        one == left(&dir.path().join("team")),
        "shards change something"
    );

    // The folder is as if the search had been stopped in its sixth generation, and is continued on one core.
    let two = dir.path().join("two");
    fs::create_dir(&two).unwrap();
    for name in one
        .keys()
        .filter(|name| name.ends_with(".json") && !name.contains('/') && *name != "tune.json")
    {
        if !name.starts_with("generation") || name.as_str() < "generation-006.json" {
            fs::write(two.join(name), &one[name]).unwrap();
        }
    }
    let again = standfast(dir.path(), &search(&["--threads=1", "--out=two"])).success();
    assert!(stderr(&again).contains("two: goes on, ") && stdout(&again) == told);
    assert!(
        one == left(&two),
        "an interruption, or threads, change something"
    );

    // The folder keeps to its search, and its verdict is the verdict of a campaign whose seed was written down before.
    let other = stderr(&standfast(dir.path(), &search(&["--out=two", "--seed=5"])).code(3));
    assert!(other.contains("two: holds another search"), "{other}");
    let (task, tuned, summary) = (
        json(&two.join("task.json")),
        json(&two.join("tune.json")),
        json(&two.join("final/summary.json")),
    );
    assert_eq!(task["final_seed"], summary["seed"]);
    assert_ne!(task["search_seed"], task["final_seed"]);
    let verdict = &tuned["verdicts"][0];
    let rates: Vec<&Value> = summary["controllers"]
        .as_array()
        .unwrap()
        .iter()
        .map(|set| &set["recovered"])
        .collect();
    assert_eq!(
        rates,
        [&verdict["recovered"][0], &verdict["recovered"][1]],
        "{summary}"
    );
    assert_eq!(
        (&verdict["trials"], &summary["trials"]),
        (&20.into(), &20.into())
    );
    let is_better = tuned["is_better"].as_bool().unwrap();
    assert_eq!(
        is_better,
        verdict["difference"].as_f64() > Some(0.0) && verdict["p"].as_f64() < Some(0.05)
    );
    assert_eq!(
        is_better,
        two.join("fixed-tuned.toml").exists(),
        "only what is better is given away"
    );
    assert!(
        told.contains("points that") || told.contains("pushes that the search has not seen"),
        "{told}"
    );
    let page = String::from_utf8(one["tune.html"].clone()).unwrap();
    assert!(
        page.matches("<svg").count() == 3
            && page.contains("gains.0.x.0")
            && !page.contains("http://"),
        "{page}"
    );
    // The page, the text and the JSON name the pushes by which the controller was judged.
    let seed = task["final_seed"].to_string();
    for told in [&told, &page] {
        let words = told.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            words.contains(&format!(
                "Seed {seed} of the pushes that judge follows from all of task.json"
            )),
            "{words}"
        );
        assert!(
            words.contains(&format!("(trials 0 to 19 of seed {seed})")),
            "{words}"
        );
    }
    assert_eq!(verdict["seed"], task["final_seed"]);
    // The written controller can be used, and names the seed for users who tune it again.
    standfast(
        dir.path(),
        &["push", "--dry-run", "--controller=two/proposed.toml"],
    )
    .success();
    let proposed = fs::read_to_string(two.join("proposed.toml")).unwrap();
    assert!(
        proposed.starts_with(&format!("# judged_by_seeds = [{seed}]\n")),
        "{proposed}"
    );
    files_that_no_search_has_written_are_refused(dir.path());
}

/// Spoils the folder `two` of a finished search in many ways.
fn files_that_no_search_has_written_are_refused(dir: &Path) {
    let two = dir.join("two");
    type Change = (&'static str, &'static str, fn(&mut Value));
    let changes: [Change; 10] = [
        ("generation-003.json", "its task is another one", |file| {
            file["task"] = "0".into()
        }),
        (
            "generation-002.json",
            "`candidates` are not as many",
            |file| file["found"]["candidates"] = Value::Array(vec![]),
        ),
        (
            "generation-002.json",
            "`candidates` are not as many",
            |file| {
                file["found"]["candidates"]
                    .as_array_mut()
                    .unwrap()
                    .truncate(1);
            },
        ),
        (
            "generation-001.json",
            "`values` are not a finite number for each key",
            |file| {
                file["found"]["candidates"][2]["values"] = Value::Array(vec![]);
            },
        ),
        (
            "generation-001.json",
            "`order` does not name each sample once",
            |file| file["found"]["order"][0] = 99.into(),
        ),
        (
            "generation-001.json",
            "a candidate cannot have done so",
            |file| {
                file["found"]["candidates"][2]["advantage"] = 1e300.into();
            },
        ),
        ("sample.json", "its task is another one", |file| {
            file["task"] = "0".into()
        }),
        (
            "sample.json",
            "it has not 200 outcomes for each case",
            |file| file["found"] = Value::Array(vec![]),
        ),
        (
            "sample.json",
            "it has not 200 outcomes for each case",
            |file| {
                file["found"][0].as_array_mut().unwrap().truncate(7);
            },
        ),
        ("sample.json", "missing field", |file| {
            *file = Value::Object(Default::default())
        }),
    ];
    let refused = |words: &str| {
        let message = stderr(&standfast(dir, &search(&["--out=two"])).code(3));
        assert!(message.contains(words), "{words}: {message}");
    };
    for (name, words, change) in changes {
        let (path, mut file) = (two.join(name), json(&two.join(name)));
        let before = fs::read(&path).unwrap();
        change(&mut file);
        fs::write(&path, file.to_string()).unwrap();
        refused(&format!("two/{name}: is damaged ({words}"));
        fs::write(&path, before).unwrap();
    }
    fs::remove_file(two.join("task.json")).unwrap();
    refused("two: holds generation-001.json of a search, but no task.json");
}

/// All that the verdict depends on changes its pushes, and so do the campaigns that have judged the controller before.
#[test]
fn no_two_tasks_are_judged_by_the_same_pushes() {
    let dir = folder();
    for (name, line) in [
        ("mine.toml", ""),
        ("judged.toml", "# judged_by_seeds = [5, 7]\n"),
        ("bad.toml", "# judged_by_seeds = x\n"),
    ] {
        let fixed = "name = 'mine'\nzmp_margin = 0.1\n[[gains]]\nname = 'a'\nx = [1, 1, 5]\ny = [1, 1, 5]\n";
        fs::write(dir.path().join(name), format!("{line}{fixed}")).unwrap();
    }
    let checked = |controller: &str, more: &[&str]| {
        let args = [&search(&[])[..], more].concat();
        let of = |arg| match arg {
            "fixed" => controller,
            // A third number needs a larger budget.
            BUDGET if !more.contains(&"--budget=2601") => "--budget=2600",
            other => other,
        };
        let args: Vec<&str> = args
            .into_iter()
            .map(of)
            .filter(|arg| *arg != BUDGET)
            .collect();
        standfast(dir.path(), &[&args[..], &["--dry-run"]].concat())
    };
    let seed = |controller: &str, more: &[&str]| -> u64 {
        let told = stderr(&checked(controller, more).success());
        let seed = told
            .split("by pushes of seed ")
            .nth(1)
            .and_then(|rest| rest.split(';').next())
            .unwrap_or_default();
        seed.parse().unwrap_or_else(|_| panic!("{told}"))
    };
    let mut seeds = vec![
        seed("fixed", &[]),
        seed("fixed", &["--seed=5"]),
        seed("fixed", &["--vary=gains.0.y.0"]),
        seed("fixed", &["--budget=2601"]),
        seed("fixed", &["--set=push.height_m=0.01"]),
        seed("fixed", &["--set=episode.judge.counts=survived"]),
        seed("mine.toml", &[]),
        seed("judged.toml", &[]),
        seed("fixed:zmp_margin=0.07", &[]),
    ];
    assert_eq!(seed("fixed", &[]), seeds[0], "the same task");
    seeds.sort_unstable();
    seeds.dedup();
    assert_eq!(seeds.len(), 9, "{seeds:?}");
    let message = stderr(&checked("bad.toml", &[]).code(2));
    assert!(
        message.contains("bad.toml: line 1: `x` is no list of seeds"),
        "{message}"
    );
}

#[test]
fn bad_input_is_told_before_anything_runs() {
    let dir = folder();
    fs::write(dir.path().join("a-file"), "").unwrap();
    let policy =
        "kind = 'process'\nname = 'mine'\ncommand = ['cat']\n[parameters]\ngain = 1\n[tunable]\n";
    fs::write(
        dir.path().join("unknown.toml"),
        format!("{policy}gian = [0, 2]\n"),
    )
    .unwrap();
    fs::write(
        dir.path().join("empty.toml"),
        format!("{policy}gain = [2, 2]\n"),
    )
    .unwrap();
    fs::write(
        dir.path().join("endless.toml"),
        format!("{policy}gain = [0, inf]\n"),
    )
    .unwrap();
    for name in ["task.json", "Generation-001.json", "mine-tuned.toml"] {
        fs::write(dir.path().join(name), "").unwrap();
        let files = format!("files = ['{name}']\n{policy}gain = [0, 2]\n");
        fs::write(dir.path().join(format!("with-{name}.toml")), files).unwrap();
    }
    for (args, words) in [
        (
            vec!["tune", "hold"],
            "hold: names no number to tune; accepted: --vary KEY=FROM..TO",
        ),
        (
            vec!["tune", "catch", "--vary=zmp_margn=0..1"],
            "zmp_margn: catch has no such number; accepted: zmp_margin",
        ),
        (
            vec!["tune", "catch", "--vary=name=0..1"],
            "name=0..1: is neither a number nor a list of numbers",
        ),
        (
            vec!["tune", "catch", "--vary=zmp_margin=1..0"],
            "zmp_margin=1..0: its range has no extent",
        ),
        (
            vec!["tune", "catch", "--vary=zmp_margin=0..wide"],
            "has no range of two numbers",
        ),
        (
            vec!["tune", "catch", "--vary=catching.late"],
            "has no range, and the controller names none for it",
        ),
        (
            vec!["tune", "catch", "--vary=zmp_margin=0..9"],
            "its end 9 cannot be used: catch: zmp_margin = 9.0000: leaves no",
        ),
        (
            vec!["tune", "robust", "--vary=gains.0.x.0=0.01..2"],
            "its end 0.01 cannot be used: robust: zmp_disturbance",
        ),
        (
            vec!["tune", "catch", "--vary=zmp_margin", "--vary=zmp_margin"],
            "zmp_margin: is given twice",
        ),
        (
            vec!["tune", "catch", "--budget=500"],
            "500 episodes: is too small for 12 numbers and 1000 final trials; accepted: ",
        ),
        (
            vec!["tune", "catch", "--budget=soon"],
            "soon is no budget; accepted: a number of episodes up to 1000000000, or a time",
        ),
        (
            vec!["tune", "catch", "--budget=1h", "--shard=1/2"],
            "each shard would measure another pace",
        ),
        (
            vec!["tune", "catch", "--robot=ut-mu2", "--robot=ut-mu2"],
            "ut-mu2: is given twice",
        ),
        (
            vec!["tune", "catch", "--out=a-file"],
            "a-file: it is a file",
        ),
        (vec!["tune", "best"], "controller \"best\" not found"),
        (
            vec!["tune", "unknown.toml"],
            "tunable.gian = [0, 2]: is no number among the parameters; accepted: one of: gain",
        ),
        (
            vec!["tune", "empty.toml"],
            "tunable.gain = [2, 2]: its range has no extent",
        ),
        (
            vec!["tune", "endless.toml"],
            "tunable.gain = [0, inf]: its ends are no finite numbers",
        ),
        (
            vec!["tune", "catch", "--vary=zmp_margin=-1e308..1e308"],
            "its range is too wide",
        ),
        (
            vec!["tune", "with-task.json.toml"],
            "file = task.json: the search writes what has this name; accepted: ",
        ),
        (
            vec!["tune", "with-Generation-001.json.toml"],
            "file = Generation-001.json: the search writes",
        ),
        (
            vec!["tune", "with-mine-tuned.toml.toml"],
            "file = mine-tuned.toml: the search writes",
        ),
        (
            vec!["tune", "catch", "--budget=1e308h"],
            "1e308h is no budget; accepted: a number of episodes up to 1000000000",
        ),
        (vec!["tune", "catch", "--budget=infs"], "infs is no budget"),
        (
            vec!["tune", "catch", "--budget=9000h"],
            "or a time such as 10min or 2h, up to 8760h",
        ),
        (
            vec!["tune", "catch", "--budget=18446744073709551615"],
            "is no budget",
        ),
    ] {
        let run: Run = standfast(dir.path(), &args).code(2);
        let message = stderr(&run);
        assert!(message.contains(words), "{args:?}: {message}");
    }
    assert_eq!(files(dir.path()).len(), 10, "something was written");
    let ranges = stdout(&standfast(dir.path(), &["tune", "catch", "--dry-run"]).success());
    assert!(
        ranges.contains("catching.pause") && ranges.contains("0.03 to 0.8"),
        "{ranges}"
    );
}
