//! Gates, early stopping and comparisons, by the program from outside.

use crate::common::parts::{relabel, rows};
use crate::common::program::{
    FEW, PROGRAM, SEVERAL_PARTS, SHORT, files, folder, short, standfast, stderr, stdout,
};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn summary(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("summary.json")).unwrap()).unwrap()
}

/// Gates whose outcome is certain, whatever the robot does.
const PASSES: &str = "--gate=hold >= 0";
const FAILS: &str = "--gate=hold >= 1";
const OPEN: &str = "--gate=hold >= hold description=0.2";

#[test]
fn a_failed_gate_is_exit_code_100_and_says_how_to_replay_a_lost_trial() {
    let dir = folder();
    let run = standfast(dir.path(), &short(&[SEVERAL_PARTS, PASSES, FAILS])).code(100);
    let message = stderr(&run);
    assert!(message.contains("gate failed: hold >= 1"), "{message}");
    let found = summary(&dir.path().join("out"));
    let status = |i: usize| found["gates"][i]["status"].as_str().unwrap();
    assert_eq!((status(0), status(1)), ("passed", "failed"));
    // The printed command reproduces the same fall.
    let command = message
        .lines()
        .find_map(|line| line.split("standfast push ").nth(1))
        .unwrap();
    let push = [
        &["push", "--json"],
        &command.split(' ').collect::<Vec<_>>()[..],
    ]
    .concat();
    let replayed: Value =
        serde_json::from_str(&stdout(&standfast(dir.path(), &push).success())).unwrap();
    assert_ne!(replayed["outcome"], "Recovered", "{replayed}");
    let junit = fs::read_to_string(dir.path().join("out/junit.xml")).unwrap();
    assert!(
        junit.contains("tests=\"2\"")
            && junit.contains("failures=\"1\"")
            && junit.contains("--trial"),
        "{junit}"
    );
    let markdown = fs::read_to_string(dir.path().join("out/summary.md")).unwrap();
    assert!(markdown.contains("| hold &gt;= 1 | FAILED |"), "{markdown}");
}

#[test]
fn what_another_build_has_made_is_kept_but_said() {
    let dir = folder();
    standfast(dir.path(), &short(&[SEVERAL_PARTS])).success();
    let said = || {
        stderr(&standfast(dir.path(), &short(&[SEVERAL_PARTS])).success()).contains("another build")
    };
    assert!(!said());
    let merged =
        || stderr(&standfast(dir.path(), &["merge", "out"]).success()).contains("2 builds");
    assert!(!merged());
    let part = dir.path().join("out/parts/part-000000.parquet");
    relabel(&part, |label| label["build"] = "0".into());
    assert!(said() && merged());
}

/// The shards share a folder, or `merge` gets the parts of both shards from elsewhere and takes all looks.
#[test]
#[ignore = "runs a campaign in shards, seven seconds"]
fn shards_of_a_campaign_that_ends_when_decided_end_as_one_machine_does() {
    let dir = folder();
    let run = |more: &[&'static str]| {
        let args = SHORT.iter().copied().filter(|arg| *arg != "--out=out");
        let decided = [
            "--until-resolved",
            "--trials=200",
            "--gate=hold >= 0.5",
            "--replays=1",
        ];
        standfast(
            dir.path(),
            &args
                .chain(decided)
                .chain(more.iter().copied())
                .collect::<Vec<_>>(),
        )
    };
    let read = |out: &str| {
        ["trials.parquet", "summary.json", "report.html"]
            .map(|n| fs::read(dir.path().join(out).join(n)).unwrap())
    };
    let parts = |out: &str| {
        fs::read_dir(dir.path().join(out).join("parts"))
            .unwrap()
            .count()
    };
    run(&["--out=whole"]).code(100);
    assert!(
        summary(&dir.path().join("whole"))["trials"]
            .as_u64()
            .unwrap()
            < 100
    );
    // The first shard cannot know the results of the other, and runs all its trials; the other ends with the decision.
    run(&["--out=out", "--shard=2/2"]).success();
    let of_one = parts("out");
    run(&["--out=out", "--shard=1/2"]).success();
    assert!(
        parts("out") - of_one < of_one / 2,
        "{} of {of_one}",
        parts("out")
    );
    standfast(dir.path(), &["status", "out"]).success();
    standfast(dir.path(), &["merge", "out", "--replays=1"]).code(100);
    assert!(read("out") == read("whole"));
    for (out, shard) in [("a", "--shard=1/2"), ("b", "--shard=2/2")] {
        let out = format!("--out={out}").leak();
        run(&[out, shard]).success();
    }
    standfast(dir.path(), &["merge", "a"]).code(3);
    for part in fs::read_dir(dir.path().join("b/parts"))
        .unwrap()
        .map(Result::unwrap)
    {
        fs::copy(
            part.path(),
            dir.path().join("a/parts").join(part.file_name()),
        )
        .unwrap();
    }
    standfast(dir.path(), &["merge", "a", "--replays=1"]).code(100);
    assert!(read("a") == read("whole"));
}

#[test]
fn while_trials_are_run_there_is_no_result_of_an_earlier_look() {
    let dir = folder();
    let out = dir.path().join("out");
    standfast(dir.path(), &short(&[SEVERAL_PARTS])).success();
    fs::remove_file(out.join("parts/part-000001.parquet")).unwrap();
    // A shard joins nothing, so it leaves the same files as an interruption.
    standfast(dir.path(), &short(&[SEVERAL_PARTS, "--shard=2/2"])).success();
    let left: Vec<String> = files(&out)
        .into_keys()
        .filter(|name| !name.starts_with("parts/"))
        .collect();
    assert_eq!(left, ["campaign.toml"]);
}

#[test]
fn gates_change_no_trial_and_need_none_again() {
    let dir = folder();
    standfast(dir.path(), &short(&[FEW])).success();
    let before = files(&dir.path().join("out"));
    let again = standfast(dir.path(), &short(&[FEW, PASSES])).success();
    assert!(
        stderr(&again).contains("nothing is computed again"),
        "{}",
        stderr(&again)
    );
    let after = files(&dir.path().join("out"));
    assert_eq!(before["trials.parquet"], after["trials.parquet"]);
    assert_ne!(before["summary.json"], after["summary.json"]);
}

#[test]
fn an_unresolved_gate_fails_only_if_asked_to() {
    let dir = folder();
    let both = ["--controller=hold:description='0.2'", OPEN, FEW];
    let run = standfast(dir.path(), &short(&both)).success();
    assert!(stdout(&run).contains("unresolved"), "{}", stdout(&run));
    let junit = fs::read_to_string(dir.path().join("out/junit.xml")).unwrap();
    assert!(
        junit.contains("skipped=\"1\"") && junit.contains("failures=\"0\""),
        "{junit}"
    );
    let strict = short(&[&both[..], &["--set=gates.unresolved=fail"]].concat());
    let message = stderr(&standfast(dir.path(), &strict).code(100));
    assert!(
        message.contains("gate unresolved: hold >= hold description"),
        "{message}"
    );
    let junit = fs::read_to_string(dir.path().join("out/junit.xml")).unwrap();
    assert!(
        junit.contains("skipped=\"0\"")
            && junit.contains("hold &gt;= hold")
            && !junit.contains("failures=\"0\"")
    );
    // The folder keeps the setting, and may be asked with another one.
    standfast(dir.path(), &["merge", "out"]).code(100);
    standfast(dir.path(), &short(&both)).success();
    standfast(dir.path(), &["merge", "out"]).success();
    standfast(dir.path(), &short(&["--set=gates.unresolved=maybe"])).code(2);
}

#[test]
fn a_gate_that_cannot_be_asked_is_an_error_before_anything_runs() {
    for (gate, code, expected) in [
        ("hold > 0.8", 2, "accepted"),
        ("catch >= 0.8", 2, "hold"),
        ("hold >= baseline - 0.01", 2, "--baseline"),
        ("hold >= 80", 2, "0 to 1"),
    ] {
        let dir = folder();
        let run = standfast(dir.path(), &short(&[FEW, "--gate", gate])).code(code);
        assert!(stderr(&run).contains(expected), "{gate}: {}", stderr(&run));
        assert!(files(dir.path()).is_empty(), "{gate} wrote something");
    }
}

#[test]
fn a_baseline_is_paired_trial_by_trial_and_must_have_the_same_pushes() {
    let dir = folder();
    standfast(dir.path(), &short(&[SEVERAL_PARTS])).success();
    let gate = [
        "--gate=hold >= baseline - 0.2",
        "--baseline=out",
        "--out=new",
    ];
    let run = |more: &[&str]| {
        let trials = if more == ["--trials=30"] {
            &[][..]
        } else {
            &[SEVERAL_PARTS]
        };
        let args = short(&[trials, &gate[..], more].concat());
        let args: Vec<&str> = args.into_iter().filter(|arg| *arg != "--out=out").collect();
        standfast(dir.path(), &args)
    };
    // No trial differs: 0 of 26 discordant trials bound the difference by 13 points.
    run(&[]).success();
    let found = summary(&dir.path().join("new"));
    assert_eq!(
        (
            found["gates"][0]["status"].as_str(),
            found["gates"][0]["observed"].as_f64()
        ),
        (Some("passed"), Some(0.0))
    );
    assert_eq!(found["baseline"]["trials"], 26);
    let warned = found["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .any(|w| w.as_str().unwrap().contains("same inputs"));
    assert!(warned, "{}", found["warnings"]);
    // The printed commands for resuming and joining have the options that the gates need.
    let status = standfast(dir.path(), &["status", "new", "--json"]).success();
    assert!(
        stdout(&status).contains("standfast merge new --baseline DIR"),
        "{}",
        stdout(&status)
    );
    standfast(dir.path(), &["merge", "new"]).code(2);
    standfast(dir.path(), &["merge", "new", "--baseline=out"]).success();
    assert!(
        stderr(&standfast(dir.path(), &["status", "new", "--full"]).code(2)).contains("--baseline")
    );
    let status = standfast(dir.path(), &["status", "new", "--full", "--baseline=out"]).success();
    assert!(
        stdout(&status).contains("hold >= baseline - 0.2"),
        "{}",
        stdout(&status)
    );
    assert_eq!(summary(&dir.path().join("new")), found);
    fs::remove_dir_all(dir.path().join("new")).unwrap();
    // These are more trials than the baseline has.
    run(&["--trials=30"]).success();
    let more = summary(&dir.path().join("new"));
    assert_eq!(
        (more["trials"].as_u64(), more["gates"][0]["trials"].as_u64()),
        (Some(30), Some(26))
    );
    assert!(
        more["warnings"]
            .to_string()
            .contains("the baseline has 26 trials"),
        "{}",
        more["warnings"]
    );
    fs::remove_dir_all(dir.path().join("new")).unwrap();
    // A campaign that ends when decided does not continue without its baseline, and says so. (It draws the same
    // trials.)
    let gate = "--gate=hold >= baseline - 0.01";
    let until = [
        "--trials=100",
        "--until-resolved",
        gate,
        "--baseline=out",
        "--out=new",
    ];
    let args = short(&until)
        .into_iter()
        .filter(|arg| *arg != "--out=out")
        .collect::<Vec<_>>();
    let ended = standfast(dir.path(), &args).success();
    assert!(
        stderr(&ended).contains("50 trials: not decided, but the baseline has no more"),
        "{}",
        stderr(&ended)
    );
    fs::remove_dir_all(dir.path().join("new")).unwrap();
    let refused = |more: &[&str], expected: &str| {
        let run = run(more).code(3);
        assert!(stderr(&run).contains(expected), "{}", stderr(&run));
        assert!(!dir.path().join("new").exists());
    };
    refused(
        &["--set=variations.kp_scale=0.1"],
        "variations.kp_scale is \"nominal\" there and 0.1 here",
    );
    refused(
        &["--set=episode.judge.max_sole_force_weights=4"],
        "episode.judge.max_sole_force_weights is null there and 4 here",
    );
    refused(&["--seed=9"], "seed is 1 there and 9 here");
    let itself = standfast(
        dir.path(),
        &short(&[SEVERAL_PARTS, "--gate=hold >= baseline", "--baseline=./out"]),
    )
    .code(3);
    assert!(
        stderr(&itself).contains("the result folder itself"),
        "{}",
        stderr(&itself)
    );
}

#[test]
fn two_folders_are_compared_if_their_pushes_are_the_same() {
    let dir = folder();
    let with = |more: &[&'static str]| {
        let others = SHORT
            .iter()
            .copied()
            .filter(|arg| !["--out=out", "--controller=hold"].contains(arg));
        others
            .chain([SEVERAL_PARTS])
            .chain(more.iter().copied())
            .collect::<Vec<_>>()
    };
    standfast(dir.path(), &with(&["--controller=hold", "--out=a"])).success();
    standfast(
        dir.path(),
        &with(&["--controller=hold", "--controller=fixed", "--out=b"]),
    )
    .success();
    standfast(dir.path(), &with(&["--controller=fixed", "--out=c"])).success();
    let found: Value = serde_json::from_str(&stdout(
        &standfast(dir.path(), &["compare", "a", "b", "--json"]).success(),
    ))
    .unwrap();
    assert_eq!(found["pairs"].as_array().unwrap().len(), 1);
    assert_eq!(
        (&found["pairs"][0]["a"], &found["pairs"][0]["b"]),
        (&Value::from("hold (a)"), &Value::from("hold (b)"))
    );
    assert_eq!(
        (
            found["pairs"][0]["only_a"].as_u64(),
            found["pairs"][0]["only_b"].as_u64()
        ),
        (Some(0), Some(0))
    );
    // Without a common name, every controller is compared with every other, as in one campaign with both.
    let gate = "--gate=hold >= 1";
    let compared = standfast(dir.path(), &["compare", "a", "c", "--out=d", gate]).code(100);
    assert!(
        stderr(&compared).contains("--campaign a/campaign.toml"),
        "{}",
        stderr(&compared)
    );
    let (both, one) = (
        summary(&dir.path().join("d")),
        summary(&dir.path().join("b")),
    );
    assert_eq!(both["pairs"], one["pairs"]);
    let trials = |folder: &str| fs::read(dir.path().join(folder).join("trials.parquet")).unwrap();
    assert!(trials("b") == trials("d"), "the same trials, joined");
    for name in ["report.html", "summary.md", "junit.xml", "success.svg"] {
        assert!(dir.path().join("d").join(name).exists(), "{name}");
    }
    standfast(
        dir.path(),
        &with(&["--controller=fixed", "--seed=9", "--out=e"]),
    )
    .success();
    let refused = standfast(dir.path(), &["compare", "a", "e"]).code(3);
    assert!(
        stderr(&refused).contains("seed is 9 there and 1 here"),
        "{}",
        stderr(&refused)
    );
    standfast(dir.path(), &["compare", "a", "nothing"]).code(3);
    standfast(dir.path(), &["compare", "a", "c", "--out=b"]).code(3);
    standfast(dir.path(), &["compare", "a", "./a"]).code(3);
    // The results are compared again into the same folder, in which the printed commands are run.
    standfast(dir.path(), &["compare", "a", "c", "--out=d", gate]).code(100);
    let junit = fs::read_to_string(dir.path().join("d/junit.xml")).unwrap();
    let command = junit
        .lines()
        .find_map(|line| line.split("standfast push ").nth(1))
        .unwrap();
    let command = command
        .trim_end_matches("</system-out>")
        .replace("&#x2f;", "/");
    let words: Vec<&str> = command.split(' ').collect();
    assert!(words.contains(&"../a/campaign.toml"), "{command}");
    standfast(&dir.path().join("d"), &[&["push"], &words[..]].concat()).success();
}

/// `hold` and `hold@rapier` are two entrants that do the same, so this test needs no program with both engines.
#[test]
fn entrants_of_one_campaign_are_paired_whatever_their_engines() {
    let dir = folder();
    let both = [
        "--controller=hold@rapier",
        "--gate=hold@rapier >= hold - 0.5",
    ];
    standfast(dir.path(), &short(&[&both[..], &[SEVERAL_PARTS]].concat())).success();
    let found = summary(&dir.path().join("out"));
    let names = [0, 1].map(|set| found["controllers"][set]["name"].as_str().unwrap());
    assert_eq!(names, ["hold", "hold@rapier"]);
    assert_eq!(found["pairs"][0]["discordant"], 0, "{found}");
    assert_eq!(found["pairs"][0]["kappa"], 1.0, "{found}");
    assert_eq!(found["gates"][0]["status"], "passed", "{found}");
    let whole = files(&dir.path().join("out"));
    let other = folder();
    for shard in ["--shard=1/2", "--shard=2/2"] {
        let args = ["--controller=hold@rapier", SEVERAL_PARTS, shard];
        standfast(other.path(), &short(&args)).success();
    }
    let merged = ["merge", "out", "--gate=hold@rapier >= hold - 0.5"];
    standfast(other.path(), &merged).success();
    for name in ["trials.parquet", "parts/part-000000.parquet"] {
        assert!(
            files(&other.path().join("out"))[name] == whole[name],
            "{name}"
        );
    }
    let replay = [
        "replay",
        "out",
        "--trial=1",
        "--controller=hold",
        "--controller=hold@rapier",
        "--replay=a.html",
    ];
    let told = stdout(&standfast(dir.path(), &replay).success());
    assert!(told.contains("\nghost       hold@rapier"), "{told}");
    let unknown = stderr(&standfast(dir.path(), &short(&["--controller=hold@bullet"])).code(2));
    assert!(
        unknown.contains("hold@bullet") && unknown.contains("rapier, mujoco"),
        "{unknown}"
    );
}

#[cfg(feature = "mujoco")]
#[test]
fn a_campaign_in_both_engines_has_each_controller_twice() {
    let dir = folder();
    let gate = "--gate=hold@mujoco >= hold@rapier - 1";
    let both = |more: &[&'static str]| {
        standfast(
            dir.path(),
            &short(&[&["--engine=both", FEW, gate], more].concat()),
        )
    };
    let checked = stderr(&both(&["--dry-run"]).success());
    assert!(checked.contains("6 episodes to run"), "{checked}");
    assert!(files(dir.path()).is_empty());
    both(&[]).success();
    let found = summary(&dir.path().join("out"));
    let names = [0, 1].map(|set| found["controllers"][set]["name"].as_str().unwrap());
    assert_eq!(names, ["hold@rapier", "hold@mujoco"]);
    assert!(
        found["engine"].as_str().unwrap().contains(", MuJoCo "),
        "{found}"
    );
    // Each entrant has the trials that it has alone.
    let rows_in = |folder: &Path, name: &str| {
        let mut rows = rows(&folder.join("out/parts/part-000000.parquet"));
        rows.retain(|row| row["controller"] == name);
        for row in &mut rows {
            row.remove("controller");
        }
        rows
    };
    for engine in ["rapier", "mujoco"] {
        let alone = folder();
        let option = format!("--engine={engine}");
        standfast(alone.path(), &short(&[FEW, &option])).success();
        let entrant = rows_in(dir.path(), &format!("hold@{engine}"));
        assert!(
            !entrant.is_empty() && entrant == rows_in(alone.path(), "hold"),
            "{engine}"
        );
    }
    let again = stderr(&both(&[]).success());
    assert!(again.contains("nothing is computed again"), "{again}");
}

#[test]
fn a_campaign_ends_when_decided_with_the_same_bytes_whatever_happened_on_the_way() {
    let until = ["--trials=200", "--until-resolved", "--gate=hold >= 0.01"];
    let dir = folder();
    let run = standfast(dir.path(), &short(&[&until[..], &["--threads=1"]].concat())).success();
    assert!(stderr(&run).contains("decided"), "{}", stderr(&run));
    let whole = files(&dir.path().join("out"));
    let found = summary(&dir.path().join("out"));
    let trials = found["trials"].as_u64().unwrap();
    assert!(
        trials < 200 && found["gates"][0]["status"] == "passed",
        "{trials} trials"
    );
    let other = folder();
    standfast(
        other.path(),
        &short(&[&until[..], &["--threads=2"]].concat()),
    )
    .success();
    assert!(files(&other.path().join("out")) == whole, "two threads");
    // One part is removed by hand, and the same command continues.
    fs::remove_file(other.path().join("out/parts/part-000000.parquet")).unwrap();
    fs::remove_file(other.path().join("out/parts/stopped.json")).unwrap();
    standfast(other.path(), &short(&until)).success();
    assert!(files(&other.path().join("out")) == whole, "resumed");
    standfast(other.path(), &["status", "out"]).success();
    standfast(other.path(), &["merge", "out"]).success();
    assert!(files(&other.path().join("out")) == whole, "merged");
    // A new question that these few trials cannot decide continues the campaign where it was, up to the allowed
    // maximum.
    let close = format!("--gate=hold >= {}", found["controllers"][0]["success_rate"]);
    let said = stderr(&standfast(other.path(), &["merge", "out", &close]).code(3));
    assert!(
        said.contains("do not decide what is asked") && said.contains("--gate 'hold >= "),
        "{said}"
    );
    assert!(
        files(&other.path().join("out")) == whole,
        "a question that is refused changes nothing"
    );
    let more = standfast(
        other.path(),
        &short(&["--trials=100", "--until-resolved", &close]),
    )
    .success();
    assert!(
        stderr(&more).contains("75 episodes in"),
        "{}",
        stderr(&more)
    );
    let found = summary(&other.path().join("out"));
    assert_eq!(
        (found["trials"].as_u64(), &found["gates"][0]["status"]),
        (Some(100), &Value::from("unresolved"))
    );
}

/// One gate is decided at the first look, the other one is not. Each names one controller.
#[test]
#[ignore = "runs a campaign several times, a quarter of a minute"]
fn a_controller_that_is_decided_gets_no_more_trials_with_the_same_bytes_whatever_happened_on_the_way()
 {
    let until = |most| {
        [
            most,
            "--until-resolved",
            "--controller=fixed",
            "--gate=hold >= 0.01",
            "--gate=fixed >= 0.5",
        ]
    };
    let run = |dir: &Path, most, more: &[&str]| {
        standfast(dir, &short(&[&until(most), more].concat())).success()
    };
    let [dir, other] = [folder(), folder()];
    let said = stderr(&run(dir.path(), "--trials=50", &["--threads=1"]));
    assert!(
        said.contains("after 25 trials: not decided yet: fixed >= 0.5: "),
        "{said}"
    );
    assert!(
        said.contains("; hold needs no more trials") && said.contains("75 episodes in"),
        "{said}"
    );
    let whole = files(&dir.path().join("out"));
    let found = summary(&dir.path().join("out"));
    let trials =
        |found: &Value| [0, 1].map(|set| found["controllers"][set]["trials"].as_u64().unwrap());
    assert_eq!(trials(&found), [25, 50], "{found}");
    assert!(
        found["stopped"]
            .as_str()
            .unwrap()
            .contains("hold after 25 trials"),
        "{found}"
    );
    let pair = &found["pairs"][0];
    let counts = ["both", "only_a", "only_b", "neither"].map(|key| pair[key].as_u64().unwrap());
    assert_eq!(counts.iter().sum::<u64>(), 25, "{pair}");
    let has = |block: u64, controller: &str| {
        let part = dir
            .path()
            .join(format!("out/parts/part-{block:06}.parquet"));
        rows(&part)
            .iter()
            .any(|row| row["controller"] == controller)
    };
    assert!(has(4, "hold") && !has(5, "hold") && has(5, "fixed"));
    run(other.path(), "--trials=50", &["--threads=2"]);
    assert!(files(&other.path().join("out")) == whole, "two threads");
    for lost in ["part-000002.parquet", "part-000008.parquet", "stopped.json"] {
        fs::remove_file(other.path().join("out/parts").join(lost)).unwrap();
    }
    standfast(other.path(), &["status", "out"]).code(3);
    standfast(other.path(), &["merge", "out"]).code(3);
    let said = stderr(&run(other.path(), "--trials=50", &[]));
    assert!(said.contains("15 episodes in"), "{said}");
    assert!(files(&other.path().join("out")) == whole, "resumed");
    standfast(other.path(), &["merge", "out"]).success();
    assert!(files(&other.path().join("out")) == whole, "merged");
    let status = stdout(&standfast(other.path(), &["status", "out"]).success());
    assert!(status.contains("hold has 25 trials"), "{status}");
    // The content of `stopped.json` is checked again, whether it states a look or not.
    let stopped = other.path().join("out/parts/stopped.json");
    let text = fs::read_to_string(&stopped).unwrap();
    for trials in ["25", "7", "0"] {
        let forged = text.replace("\"trials\":50", &format!("\"trials\":{trials}"));
        fs::write(
            &stopped,
            forged.replace("[25,50]", &format!("[{trials},{trials}]")),
        )
        .unwrap();
        standfast(other.path(), &["merge", "out"]).success();
        assert!(
            files(&other.path().join("out")) == whole,
            "decided at {trials}"
        );
    }
    // With another question, a shard runs its part of the new trials, and the old report is removed.
    let shard = |k| {
        standfast(
            other.path(),
            &short(&["--trials=50", "--until-resolved", "--controller=fixed", k]),
        )
    };
    let lacking = || standfast(other.path(), &["status", "out", "--shards=2"]);
    shard("--shard=1/2").success();
    assert!(!other.path().join("out/report.html").exists());
    assert_eq!(stdout(&lacking().code(3)), "2\n");
    shard("--shard=2/2").success();
    assert_eq!(stdout(&lacking().success()), "none\n");
    // With more trials, the controller that is still undecided continues.
    let said = stderr(&run(other.path(), "--trials=75", &[]));
    assert!(said.contains("25 episodes in"), "{said}");
    assert_eq!(trials(&summary(&other.path().join("out"))), [25, 75]);
    // The result is compared with one of which both controllers have all trials.
    let elsewhere =
        |more: &[&'static str]| [&SHORT[..SHORT.len() - 1], &["--controller=fixed"], more].concat();
    standfast(other.path(), &elsewhere(&["--trials=40", "--out=fixed"])).success();
    let compared = standfast(other.path(), &["compare", "out", "fixed", "--json"]).success();
    let compared: Value = serde_json::from_str(&stdout(&compared)).unwrap();
    let of_sets = |i: usize| compared["controllers"][i]["trials"].as_u64().unwrap();
    assert_eq!([0, 1, 2, 3].map(of_sets), [25, 40, 40, 40], "{compared}");
    // As a baseline, the result gives each gate the trials of the gate's own controller.
    let gates = [
        "--gate=hold >= baseline - 0.9",
        "--gate=fixed >= baseline - 0.9",
        "--baseline=out",
    ];
    let gated = elsewhere(&[&["--trials=60", "--out=gated"][..], &gates].concat());
    standfast(other.path(), &gated).success();
    let gated = summary(&other.path().join("gated"));
    assert_eq!(
        [0, 1].map(|gate| gated["gates"][gate]["trials"].as_u64().unwrap()),
        [25, 60],
        "{}",
        gated["gates"]
    );
    assert!(
        gated["warnings"]
            .to_string()
            .contains("the baseline has 25 trials of some controllers"),
        "{gated}"
    );
}

#[test]
fn without_gates_it_is_the_pairs_that_are_decided() {
    let dir = folder();
    // Variants that stand alike differ by less than any margin that is not small.
    let same = [
        "--controller=hold:description='0.2'",
        "--trials=200",
        "--until-resolved",
        "--set=stopping.margin=0.4",
    ];
    standfast(dir.path(), &short(&same)).success();
    let found = summary(&dir.path().join("out"));
    assert_eq!(
        found["pairs"][0]["verdict"], "same",
        "{}",
        found["pairs"][0]
    );
    assert!(found["trials"].as_u64().unwrap() < 200);
    for (more, expected) in [
        (&["--until-resolved"][..], "nothing to decide"),
        (&["--shard=1/2", PASSES], "`merge`"),
    ] {
        let other = folder();
        let refused = standfast(other.path(), &short(more)).code(2);
        assert!(
            stderr(&refused).contains(expected),
            "{more:?}: {}",
            stderr(&refused)
        );
        assert!(files(other.path()).is_empty(), "{more:?} wrote something");
    }
}

#[test]
fn gates_and_stopping_of_a_campaign_file_are_those_of_the_command_line() {
    let dir = folder();
    let file = "name = 'c'\ntrials = 50\nseed = 1\ngains = ['hold']\n[push]\nimpulse_n_s = 1\nstart_s = 0.05\n\
                [sensors]\nnoise_scale = 1\n[episode]\nhorizon_s = 0.4\n[episode.judge]\nstanding_time_s = 0.1\n\
                [stopping]\nuntil_resolved = true\n[gates]\nrequire = ['hold >= 0']\nconfidence = 0.99\n";
    fs::write(dir.path().join("c.toml"), file).unwrap();
    standfast(dir.path(), &["run", "c.toml", "--out=out", FAILS]).code(100);
    let found = summary(&dir.path().join("out"));
    // Two gates have looks: each has the confidence at which both hold together with 99 %.
    assert_eq!(
        (
            found["gates"][1]["confidence"].as_f64(),
            found["gates"].as_array().unwrap().len()
        ),
        (Some(0.995), 2)
    );
    assert_eq!(found["stopping"]["until_resolved"], true);
    // The folder keeps its gates, and lists each once.
    standfast(dir.path(), &["merge", "out", FAILS]).code(100);
    assert_eq!(summary(&dir.path().join("out")), found);
    fs::write(dir.path().join("c.toml"), file.replace("0.99", "1.5")).unwrap();
    let refused = standfast(dir.path(), &["run", "c.toml", "--out=other"]).code(2);
    assert!(
        stderr(&refused).contains("gates.confidence = 1.5"),
        "{}",
        stderr(&refused)
    );
}

/// The text that is written to a terminal, without the codes that colour it, clear it and move the cursor.
#[cfg(target_os = "linux")]
fn plain(text: &str) -> String {
    let (mut plain, mut rest) = (String::new(), text.chars());
    while let Some(c) = rest.next() {
        if c == '\u{1b}' {
            rest.by_ref().find(|c| c.is_ascii_alphabetic());
        } else {
            plain.push(c);
        }
    }
    plain
}

/// The first line that is wider than the terminal. Text that must not be broken is left out: commands to copy and, with
/// less than the usual width, rows of numbers.
#[cfg(target_os = "linux")]
fn too_wide(text: &str, columns: usize) -> Option<String> {
    // Progress pads each of its lines with blanks, and writes them at once. Such a line ends with a blank, and no other
    // line does.
    let fits = |line: &&str| {
        let letters: Vec<char> = line.chars().collect();
        let ends_well = |row: &[char]| {
            row.len() < columns
                || row.last() == Some(&' ')
                || row.contains(&'░')
                || row.contains(&'█')
        };
        letters.len() <= columns
            || line.starts_with("after ") && letters.chunks(columns).all(ends_well)
    };
    let is_row = |line: &str| columns < 80 && line.starts_with([' ', '─']);
    let is_whole = |line: &&str| line.contains("--campaign") || is_row(line);
    text.split(['\r', '\n'])
        .filter(|line| !is_whole(line))
        .find(|line| !fits(line))
        .map(String::from)
}

#[cfg(target_os = "linux")]
#[test]
fn a_terminal_of_60_columns_is_enough_and_so_is_none() {
    let dir = folder();
    let long = [
        "--set=push.duration_s={uniform=[0.02, 0.1]}",
        "--set=push.height_m={uniform=[-0.05, 0.1]}",
        "--set=variations.trunk_com_x_m={uniform=[-0.005, 0.005]}",
        "--set=variations.trunk_com_y_m={uniform=[-0.005, 0.005]}",
        "--set=second_push={impulse_n_s={uniform=[0, 1]}, heading_deg={uniform=[-180, 180]}, after_s=0.05}",
    ];
    let sets = [
        "--controller=fixed",
        "--controller=switching",
        "--controller=catch",
        "--trials=6",
        PASSES,
        "--full",
    ];
    let args = short(&[&sets[..], &long].concat());
    let run = standfast(dir.path(), &args).success();
    assert_eq!(too_wide(&stdout(&run), 80), None);
    assert_eq!(too_wide(&stderr(&run), 80), None);
    // The command is run in a terminal, with a progress bar, and with the findings so far above it.
    let words: Vec<String> = args.iter().map(|arg| format!("'{arg}'")).collect();
    for columns in [60, 80] {
        fs::remove_dir_all(dir.path().join("out")).unwrap();
        let shell = format!(
            "stty cols {columns} rows 24; exec {} {}",
            PROGRAM,
            words.join(" ")
        );
        let terminal = std::process::Command::new("script")
            .args(["-qec", &shell, "/dev/null"])
            .env("TERM", "xterm")
            .current_dir(dir.path())
            .output()
            .expect("script, of util-linux, makes a terminal");
        let text = plain(&String::from_utf8(terminal.stdout).unwrap());
        assert!(
            terminal.status.success()
                && text.contains(" of 24 episodes")
                && text.contains("controller"),
            "{text}"
        );
        // The part with one trial may end before the part with five.
        assert!(
            text.contains(" trials, not final: ") && text.contains("can be told apart"),
            "{text}"
        );
        assert_eq!(too_wide(&text, columns), None);
    }
}

/// Runs the program without a terminal, interrupts it as soon as it prints `words`, and returns its whole output. It is
/// interrupted only once, even if it prints `words` again, since a second interruption would end it in the middle of a
/// word.
#[cfg(unix)]
fn interrupted_at(folder: &Path, args: &[&str], words: &str) -> String {
    use std::io::{BufRead, BufReader};
    let mut run = std::process::Command::new(PROGRAM)
        .args(args)
        .current_dir(folder)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let (mut said, mut is_told) = (String::new(), false);
    for line in BufReader::new(run.stderr.take().unwrap())
        .lines()
        .map(Result::unwrap)
    {
        said += &line;
        said += "\n";
        if line.contains(words) && !is_told {
            is_told = true;
            crate::common::program::send("INT", &run);
        }
    }
    assert_eq!(run.wait().unwrap().code(), Some(130), "{said}");
    said
}

/// The number before `words`.
#[cfg(unix)]
fn number_before(words: &str, text: &str) -> u64 {
    let (before, _) = text
        .split_once(words)
        .unwrap_or_else(|| panic!("no {words:?} in {text}"));
    before.rsplit([' ', '\n']).next().unwrap().parse().unwrap()
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_says_what_is_kept_and_goes_on_there() {
    let dir = folder();
    let args = short(&["--trials=400", "--threads=1"]);
    let said = interrupted_at(dir.path(), &args, "40 of 400 episodes");
    assert!(said.starts_with("0 of 400 episodes\n"), "{said}");
    assert!(
        said.contains("stopping as soon as what is running ends"),
        "{said}"
    );
    // The place of a line break depends on the number of digits of the numbers.
    let words = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words.contains("The same command goes on from there"),
        "{said}"
    );
    assert!(
        said.contains("  standfast run out/campaign.toml --out out"),
        "{said}"
    );
    assert!(!said.contains("error"), "{said}");
    let (kept, done) = (
        number_before(" of 400 episodes are kept", &said),
        number_before(" episodes in", &said),
    );
    // With one thread, at most one part of five trials is unfinished.
    assert!(
        kept % 5 == 0 && kept <= done && done < kept + 5,
        "{kept} of {done}"
    );
    let again = interrupted_at(dir.path(), &args, "goes on");
    assert!(
        again.starts_with(&format!("out: goes on, {kept} of 400 episodes are there\n")),
        "{again}"
    );
    assert!(
        again.contains(&format!("\n{kept} of 400 episodes\n")),
        "{again}"
    );
}

/// If the program is called without arguments, it says what it does, how long that takes, and what would be quicker.
#[cfg(unix)]
#[test]
fn without_a_command_it_says_first_what_it_is_about_to_do() {
    let dir = folder();
    let said = interrupted_at(dir.path(), &[], "It takes about ");
    let (first, rest) = said.split_once("0 of 4000 episodes\n").unwrap();
    // The name of the program is long here.
    assert!(
        first.lines().count() <= 6 && first.lines().all(|line| line.chars().count() <= 80),
        "{first}"
    );
    let words = first.replace('\n', " ");
    assert!(
        words.contains("1000 pushes for each of 4 controllers, on "),
        "{first}"
    );
    assert!(
        words.contains(" push --replay push.html ") && words.contains(" run smoke "),
        "{first}"
    );
    assert!(rest.contains(" here, by the pace of its first "), "{rest}");
    let again = interrupted_at(dir.path(), &[], "goes on");
    assert!(
        again.starts_with("standfast-results/standard: goes on, ") && !again.contains("quick look"),
        "{again}"
    );
}

#[test]
fn a_result_is_printed_in_full_again_without_a_change() {
    let dir = folder();
    let full = stdout(&standfast(dir.path(), &short(&[SEVERAL_PARTS, "--full", PASSES])).success());
    let before = files(dir.path());
    let status = stdout(&standfast(dir.path(), &["status", "out", "--full"]).success());
    assert!(
        full.contains("kind of trial") && status.ends_with(&format!("\n\n{full}")),
        "{status}"
    );
    assert!(files(dir.path()) == before);
    let short = stdout(&standfast(dir.path(), &["merge", "out"]).success());
    assert!(
        short.len() < full.len() && !short.contains("kind of trial"),
        "{short}"
    );
    for words in ["campaign smoke: 26 trials", "controller", "hold >= 0"] {
        assert!(
            short.contains(words) && full.contains(words),
            "{words} in {short}"
        );
    }
}

/// A robot that never stands still enough has not recovered, but it has survived. Survival has a rate of its own, and
/// counts as won if the judge is told so.
#[test]
fn who_does_not_fall_has_survived() {
    let dir = folder();
    let run = |out: &str, more: &[&str]| {
        let still = "--set=episode.judge.standing_com_speed_m_s=1e-9";
        let args = [
            "run",
            "smoke",
            "--trials=6",
            "--replays=0",
            "--controller=hold",
            "--controller=catch",
            still,
            out,
        ];
        standfast(dir.path(), &[&args[..], more].concat())
    };
    let told = stdout(&run("--out=a", &[]).success());
    assert!(
        told.contains("survived,") && told.contains("`episode.judge.counts=survived`"),
        "{told}"
    );
    let summed = |run: crate::common::program::Run| -> Value {
        serde_json::from_str(&stdout(&run.success())).unwrap()
    };
    let [stands, lasts] =
        [&[][..], &["--set=episode.judge.counts=survived"]].map(|judge: &[&str]| {
            let out = if judge.is_empty() {
                "--out=a"
            } else {
                "--out=b"
            };
            summed(run(out, &[judge, &["--json"]].concat()))
        });
    for set in 0..2 {
        let [stands, lasts] = [&stands, &lasts].map(|summary| &summary["controllers"][set]);
        let of = |key: &str| stands[key].as_u64().unwrap();
        let survived = stands["survived"]["recovered"].as_u64().unwrap();
        assert_eq!(
            (
                of("recovered"),
                of("timed_out"),
                of("timed_out") + of("fell")
            ),
            (0, survived, 6),
            "{stands}"
        );
        assert!(survived > 0, "{stands}");
        assert_eq!(
            (&lasts["recovered"], &lasts["survived"]),
            (&survived.into(), &stands["survived"]),
            "{lasts}"
        );
    }
    let gated = run(
        "--out=b",
        &[
            "--set=episode.judge.counts=survived",
            "--gate=catch >= 0.5",
            "--gate=hold >= 0.99",
        ],
    )
    .code(100);
    let told = stdout(&gated);
    assert!(
        told.contains("judge:  survival: a robot that stands still, or has not fallen after 6 s"),
        "{told}"
    );
    let rows = rows(&dir.path().join("b/parts/part-000000.parquet"));
    let has = |outcome: &str| rows.iter().any(|row| row["outcome"] == outcome);
    assert!(has("Survived") && !has("TimedOut"), "{rows:?}");
    // The robot has 8 kg. Over sqrt(g h), the change of velocity is a share of 1.74 m/s.
    let push = stdout(
        &standfast(
            dir.path(),
            &["push", "--impulse=4", "--controller=hold", "--json"],
        )
        .success(),
    );
    let push: Value = serde_json::from_str(&push).unwrap();
    let [dv_m_s, share] = ["dv_m_s", "dv_over_sqrt_g_h"].map(|key| push[key].as_f64().unwrap());
    assert!(
        (dv_m_s - 0.5).abs() < 0.001 && (share - 0.5 / 1.7435).abs() < 0.001,
        "{push}"
    );
}
