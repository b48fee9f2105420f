//! The program from outside: its exit codes and messages, and that results are the same bytes after any history of
//! runs.

use crate::common::program::{
    FEW, PROGRAM, Run, SEVERAL_PARTS, files, folder, short, standfast, stderr, stdout,
};
use standfast::files::assets::InputKind;
use std::process::Command;
use std::{collections::BTreeMap, fs};

/// Runs the short campaign in a new folder with further arguments, and returns the written files.
fn result_of(more: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let dir = folder();
    standfast(dir.path(), &short(more)).success();
    files(&dir.path().join("out"))
}

#[test]
fn bad_input_is_one_clear_error_and_nothing_is_written() {
    let good = "name = 'c'\ntrials = 2\nseed = 1\n[push]\nimpulse_n_s = 1\n";
    let cases: &[(&str, &[&str], &[&str])] = &[
        (
            good,
            &["run", "missing.toml"],
            &["missing.toml: cannot read"],
        ),
        (
            good,
            &["run", "smokey"],
            &[
                "campaign \"smokey\" not found",
                "smoke, nominal, standard, harsh, robocup, dysturbance or the path of a file",
            ],
        ),
        ("name = 'c\n", &["run", "c.toml"], &["c.toml", "line 1"]),
        (
            "zmp_margin = 0.1\n[[gains]]\nname = 'a'\nx = [1, 1, 5]\n",
            &["cpi", "c.toml"],
            &["c.toml: missing fields: name, gains.0.y"],
        ),
        (
            "name = 'c'\n[[gains]]\nname = 'a'\nx = [1, 1, 5]\ny = [1, 1, 5]\n[catching]\nlift = 0.1\npause = 0.2\n",
            &["cpi", "c.toml"],
            &["c.toml: missing fields: catching.late, catching.transfer, catching.settle"],
        ),
        (
            good,
            &["limit", "smoke", "--precision=2%"],
            &[
                "'2%' for '--precision <N_S>': the unit is fixed",
                "is accepted: 2",
            ],
        ),
        (
            "names = 'c'\n",
            &["run", "c.toml"],
            &["c.toml", "unknown field `names`", "`name`"],
        ),
        (
            "name = 'c'\n",
            &["run", "c.toml"],
            &["c.toml: missing fields: trials, seed, push.impulse"],
        ),
        (
            good,
            &["push", "--impulse=5Ns"],
            &[
                "'5Ns' for '--impulse <N_S>': the unit is fixed",
                "is accepted: 5",
            ],
        ),
        (
            good,
            &["push", "--impulse=5 N s"],
            &["the unit is fixed, and only the number is accepted: 5"],
        ),
        (
            good,
            &["push", "--heading=-30deg"],
            &["the unit is fixed, and only the number is accepted: -30"],
        ),
        (
            good,
            &["push", "--impulse=five"],
            &["is no number; accepted: a number without its unit"],
        ),
        (
            good,
            &["push", "--set=push.start_s=5"],
            &["push.start_s = 5", "0 to 3, half of episode.horizon_s"],
        ),
        (
            good,
            &["run", "smoke", "--campaign=smoke"],
            &["'--campaign <NAME|FILE>'", "cannot be used with"],
        ),
        (
            &good.replace("s = 1\n", "s = -1\n"),
            &["run", "c.toml"],
            &["c.toml: push.impulse_n_s = -1", "0 to 10000"],
        ),
        (
            good,
            &["run", "c.toml", "--set", "push.impulse_n_s=-2"],
            &["push.impulse_n_s = -2", "0 to 10000"],
        ),
        (
            good,
            &["run", "c.toml", "--set", "push.impuls=2"],
            &["--set: push.impuls", "push.impulse, push.impulse_n_s"],
        ),
        (
            &good.replace("[push]", "[push]\nimpulse = 1"),
            &["run", "c.toml"],
            &["push.impulse, push.impulse_n_s = 1, 1"],
        ),
        (
            good,
            &["run", "c.toml", "--trials", "0"],
            &["'0' for '--trials <N>': out of range", "from 1 to 10000000"],
        ),
        (
            good,
            &["run", "c.toml", "--trials", "-3"],
            &[
                "'-3' for '--trials <N>': is no count",
                "a whole number from 1",
            ],
        ),
        (
            good,
            &["run", "c.toml", "--trials", "1.5"],
            &["'1.5' for '--trials <N>': is no count"],
        ),
        (
            good,
            &["push", "--set=episode.judge.max_sole_force_weights=1"],
            &[
                "episode.judge.max_sole_force_weights = 1: out of range",
                "more than 1, which one sole bears at rest, at most 1000",
            ],
        ),
        (
            good,
            &["push", "--set=episode.horizon_s=0.1"],
            &[
                "standing_time_s = 0.500004",
                "at most 0.1, the length of the episode",
            ],
        ),
        (
            good,
            &[
                "run",
                "c.toml",
                "--set=episode.horizon_s=0.1",
                "--set=push.start_s=0.01",
                "--set=push.duration_s=0.01",
            ],
            &[
                "episode.judge.standing_time_s = 0.500004: out of range",
                "at most 0.1, the length of the episode",
            ],
        ),
        (
            good,
            &[
                "push",
                "--controller=hold",
                "--controller=catch",
                "--plot=a.svg",
            ],
            &[
                "--plot = a.svg: shows one controller, and two are asked for; accepted: --replay, which shows both",
            ],
        ),
        (
            good,
            &[
                "push",
                "--controller=hold",
                "--controller=catch",
                "--trace=a.csv",
            ],
            &["--trace = a.csv: shows one controller"],
        ),
        (
            good,
            &[
                "run",
                "c.toml",
                "--set=second_push={impulse_n_s=1, after_s=4}",
            ],
            &[
                "accepted: 0 to 3.901, since both pushes end within three quarters of episode.horizon_s = 6.001",
            ],
        ),
        (
            good,
            &["run", "c.toml", "--set=push.start_s=4"],
            &[
                "push.start_s = 4",
                "accepted: 0 to 3, half of episode.horizon_s",
            ],
        ),
        (
            good,
            &["model", "--set=left_knee_flexion=40"],
            &["left_knee_flexion = 40 rad: is beyond the joint's range"],
        ),
        (
            good,
            &["check"],
            &["required", "<CONTROLLER|--controller <NAME|FILE>>"],
        ),
        (
            good,
            &["cpi", "fixed", "--controller=slow"],
            &["cannot be used with"],
        ),
        (
            &good.replace("trials = 2", "trials = 'many'"),
            &["run", "c.toml"],
            &["c.toml: line 2, column 10: invalid type: string \"many\", expected u64"],
        ),
        (
            &good.replace("impulse_n_s = 1", "duration = 0.3\n  impulse = 'hard'"),
            &["run", "c.toml"],
            &["c.toml: line 6, column 13: invalid type: string \"hard\", expected a number, {"],
        ),
        (
            &good.replace("impulse_n_s = 1", "impulse_n_s = 1\nimpuls = 2"),
            &["run", "c.toml"],
            &["c.toml: line 6, column 10: unknown field `impuls`"],
        ),
        (
            good,
            &["run", "c.toml", "--controller", "best"],
            &["controller \"best\" not found", "hold, fixed, switching"],
        ),
        (
            good,
            &["run", "c.toml", "--controller", "best.toml"],
            &["best.toml: cannot read"],
        ),
        (
            good,
            &["run", "c.toml", "--controller=hold", "--controller=hold"],
            &["two controllers of this name"],
        ),
        (
            good,
            &["run", "c.toml", "--vary", "hold"],
            &["--vary = hold", "SET:KEY=V1,V2"],
        ),
        (
            good,
            &["run", "c.toml", "--vary", "switching:zmp=1"],
            &["--vary", "unknown field `zmp`", "`zmp_margin`"],
        ),
        (
            good,
            &["run", "c.toml", "--vary", "best:zmp=1"],
            &["controller \"best\" not found", "switching"],
        ),
        (
            good,
            &["run", "c.toml", "--vary", "hold:description=a,a"],
            &["two controllers of this name"],
        ),
        (
            good,
            &[
                "push",
                "--impulse=1",
                "--controller=fixed:gains.1.x=[1,1,5]",
            ],
            &["no `gains.1`", "gains.0 to gains.0"],
        ),
        (
            good,
            &["run", "c.toml", "--out", "c.toml"],
            &["result folder = c.toml: it is a file", "a folder"],
        ),
        (
            good,
            &["run", "c.toml", "--robot", "r2d2"],
            &["robot \"r2d2\" not found", "ut-mu2"],
        ),
        (
            good,
            &["run", "c.toml", "--shard", "5/4"],
            &["--shard", "1 <= k <= n"],
        ),
        (good, &["run", "c.toml", "--trails", "5"], &["--trails"]),
        (
            good,
            &["push", "--impulse=1", "--trace=a.txt"],
            &["--trace = a.txt", "ends in .csv or .parquet"],
        ),
        (
            good,
            &["push", "--impulse=1", "--plot=a.png"],
            &["--plot = a.png", "ends in .svg"],
        ),
        (
            good,
            &["push", "--impulse=1", "--trace=a.csv", "--plot=no/a.svg"],
            &["--plot = no/a.svg", "does not exist"],
        ),
        (good, &["walk"], &["walk"]),
        // This campaign would never end, or take all memory.
        (
            &good.replace("= 2\n", "= 1000000000000000000\n"),
            &["run", "c.toml"],
            &["c.toml: trials = 1000000000000000000", "1 to 1e7"],
        ),
        (
            good,
            &["run", "c.toml", "--trials=1000000001"],
            &["'1000000001' for '--trials <N>'", "from 1 to 10000000"],
        ),
        (
            &good.replace("'c'", &format!("'{}'", "c".repeat(101))),
            &["run", "c.toml"],
            &["is too long", "up to 100"],
        ),
        (
            good,
            &[
                "run",
                "c.toml",
                "--vary",
                &format!("hold:description={}0.1", "0.1,".repeat(200)),
            ],
            &["controllers = 202 entries: too many", "up to 200"],
        ),
        (
            good,
            &[
                "run",
                "c.toml",
                "--set",
                "push.heading_deg={normal=[0, 721]}",
            ],
            &[
                "push.heading_deg.normal = 721",
                "a standard deviation of 0 to 720",
            ],
        ),
        (
            good,
            &["run", "c.toml", "--threads=100000"],
            &[
                "'100000' for '--threads <T>': out of range; accepted: a whole number from 0 to 1024",
            ],
        ),
        (
            good,
            &["run", "c.toml", "--replays=1001"],
            &["'1001' for '--replays <N>': out of range", "from 0 to 1000"],
        ),
        (
            good,
            &["limit", "--threads=1025"],
            &["'1025' for '--threads <T>': out of range", "from 0 to 1024"],
        ),
        (
            good,
            &["limit", "--headings=361"],
            &["'361' for '--headings <N>': out of range", "from 1 to 360"],
        ),
        (
            good,
            &["run", "c.toml", "--set", "episode.physics_step_s=1e-9"],
            &["episode.physics_step_s = 0.000000001", "0.00001 to 0.002"],
        ),
        (
            good,
            &[
                "run",
                "c.toml",
                "--set",
                "episode.horizon_s=3600",
                "--set",
                "episode.physics_step_s=2e-5",
            ],
            &["episode.physics_step_s = 0.00002", "0.00036 to 0.002"],
        ),
        (
            &format!("{good}[episode]\ncontrol_period_s = 1e-9"),
            &["run", "c.toml"],
            &[
                "c.toml: episode.control_period_s = 0.000000001",
                "0.0001 to 0.1",
            ],
        ),
        (
            good,
            &["cpi", "fixed:gains.0.x=[300211,1,5]"],
            &["gains[0].x[0] = 300211", "0.0001 to 500"],
        ),
        (
            good,
            &["cpi", "--set=omega_rad_s=1e-300"],
            &["--set: omega_rad_s = 1e-300", "0.1 to 1000"],
        ),
        (
            &good.replace("s = 1\n", "s = { uniform = [1, 2, 3] }\n"),
            &["run", "c.toml"],
            &["c.toml", "invalid length 3, expected an array of length 2"],
        ),
        (
            good,
            &["cpi", "fixed:gains.0.x=[1,1,5,9]"],
            &["gains.0.x = [1,1,5,9]", "array of length 3"],
        ),
        (
            good,
            &["run", "/dev/zero"],
            &["/dev/zero: cannot read: it is no file; accepted: a file, not a folder"],
        ),
        (
            good,
            &["push", "--set=episode.horizon_s=3600", "--trace=a.csv"],
            &[
                "horizon_s = 3600: is too long to be kept tick by tick",
                "accepted: up to 400",
            ],
        ),
        (
            good,
            &["push", "--controller", "."],
            &[".: cannot read: it is no file"],
        ),
        (good, &["model", "/dev/tty"], &["/dev/tty: cannot read"]),
        (
            good,
            &["cpi", "--plot=c.toml"],
            &["--plot = c.toml: unknown kind of file", ".svg"],
        ),
        (
            good,
            &["init", "c.toml"],
            &["c.toml: kind of file = campaign: is no robot; accepted: a robot here"],
        ),
        (
            good,
            &["slurm", "c.toml", "--out", "a\nEND"],
            &["slurm = \"a\\nEND\"", "without line breaks"],
        ),
        (
            good,
            &["cpi", "--set=period_s=1e-9"],
            &["--set: period_s = 0.000000001", "0.0003555 to 0.1777"],
        ),
    ];
    for (text, args, expected) in cases {
        let dir = folder();
        fs::write(dir.path().join("c.toml"), text).unwrap();
        let run = standfast(dir.path(), args).code(2);
        let message = stderr(&run);
        assert!(
            message.starts_with("error: ") && stdout(&run).is_empty(),
            "{args:?}: {message}"
        );
        for part in *expected {
            assert!(
                message.contains(part),
                "{args:?}: {part:?} not in {message}"
            );
        }
        assert_eq!(files(dir.path()).len(), 1, "{args:?} wrote something");
    }
}

/// If a user misspells a name, or mixes up files, the message names the probable meaning.
#[test]
fn what_was_meant_is_told() {
    let dir = folder();
    let asset = |path: &str| {
        fs::read_to_string(format!("{}/assets/{path}", env!("CARGO_MANIFEST_DIR"))).unwrap()
    };
    for (name, from) in [
        ("c.toml", "campaigns/smoke.toml"),
        ("mine.toml", "controllers/catch.toml"),
        ("r.urdf", "robots/ut-mu2.urdf"),
        ("r.toml", "robots/ut-mu2.toml"),
    ] {
        fs::write(dir.path().join(name), asset(from)).unwrap();
    }
    let before = files(dir.path());
    let cases: &[(&[&str], &str)] = &[
        (&["run", "smok"], "path of a file; did you mean smoke?"),
        (&["run", "--controller=cath"], "did you mean catch?"),
        (&["push", "--controller=mine"], "did you mean mine.toml?"),
        (&["push", "--robot=r"], "did you mean r.urdf?"),
        (&["model", "utmu2"], "did you mean ut-mu2?"),
        (&["rnu"], "a similar subcommand exists: 'run'"),
        (
            &["push", "catch"],
            "campaign \"catch\" not found; accepted: smoke, nominal, standard, harsh, robocup, dysturbance or the path of a file; did you mean --controller catch?",
        ),
        (&["run", "ut-mu2"], "did you mean --robot ut-mu2?"),
        (
            &["push", "--controller=smoke"],
            "did you mean --campaign smoke?",
        ),
        (
            &["run", "r.urdf"],
            "r.urdf: kind of file = robot: is no campaign; accepted: a campaign here; --robot takes",
        ),
        (
            &["run", "r.toml"],
            "r.toml: kind of file = robot settings: is no campaign",
        ),
        (
            &["run", "mine.toml"],
            "mine.toml: kind of file = controller: is no campaign",
        ),
        (
            &["push", "--robot=c.toml"],
            "c.toml: kind of file = campaign: is no robot",
        ),
        (
            &["push", "--robot=mine.toml"],
            "accepted: a robot here; --controller takes this file",
        ),
        (
            &["push", "--controller=r.toml"],
            "accepted: a controller here; this file is read beside its URDF",
        ),
        (
            &["init", "r.toml"],
            "r.toml: kind of file = robot settings: is no robot",
        ),
        (
            &["init", "ut-mu2", "--force"],
            "init: robot = ut-mu2: has its settings within it; accepted: a URDF",
        ),
    ];
    for (args, words) in cases {
        let message = stderr(&standfast(dir.path(), args).code(2));
        assert!(
            message.contains(words),
            "{args:?}: {words:?} not in {message}"
        );
    }
    assert!(!stderr(&standfast(dir.path(), &["run", "xyz"]).code(2)).contains("did you mean"));
    assert!(files(dir.path()) == before);
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let one = result_of(&[SEVERAL_PARTS, "--threads=1"]);
    assert_eq!(one.len(), 20, "{:?}", one.keys());
    for name in [
        "campaign.toml",
        "summary.json",
        "trials.parquet",
        "report.html",
        "parts/part-000001.parquet",
    ] {
        assert!(one.contains_key(name), "{name} in {:?}", one.keys());
    }
    assert_eq!(
        one.keys()
            .filter(|name| name.starts_with("replays/trial-"))
            .count(),
        6,
        "{:?}",
        one.keys()
    );
    assert!(
        one == result_of(&[SEVERAL_PARTS, "--threads=2"]),
        "two threads wrote something else"
    );
}

#[test]
fn shards_merge_and_resume_end_in_the_same_bytes() {
    let whole = result_of(&[SEVERAL_PARTS]);
    let dir = folder();
    let out = dir.path().join("out");
    standfast(dir.path(), &short(&[SEVERAL_PARTS, "--shard=2/2"])).success();
    assert!(!out.join("trials.parquet").exists() && !out.join("summary.json").exists());
    let status = standfast(dir.path(), &["status", "out"]).code(3);
    assert!(
        stdout(&status).contains("missing: trials 0-4, 10-14, 20-24"),
        "{}",
        stdout(&status)
    );
    let merge = standfast(dir.path(), &["merge", "out"]).code(3);
    assert!(
        stderr(&merge).contains("standfast run out/campaign.toml --out out"),
        "{}",
        stderr(&merge)
    );
    // The command is the one that was just printed.
    let run = standfast(dir.path(), &["run", "out/campaign.toml", "--out", "out"]).success();
    assert!(
        stderr(&run).contains("goes on, 11 of 26 episodes are there"),
        "{}",
        stderr(&run)
    );
    assert!(files(&out) == whole, "resumed");
    fs::remove_file(out.join("summary.json")).unwrap();
    standfast(dir.path(), &["status", "out"]).success();
    standfast(dir.path(), &["merge", "out"]).success();
    assert!(files(&out) == whole, "merged");
}

#[test]
fn a_result_is_kept_printed_again_and_never_overwritten() {
    let dir = folder();
    let first = standfast(dir.path(), &short(&[FEW])).success();
    let whole = files(&dir.path().join("out"));
    let again = standfast(dir.path(), &short(&[FEW])).success();
    assert!(
        stderr(&again).contains("nothing is computed again"),
        "{}",
        stderr(&again)
    );
    assert_eq!(stdout(&first), stdout(&again));
    let other = standfast(dir.path(), &short(&[FEW, "--seed=9"])).code(3);
    let differs =
        "out: holds the result of another campaign: seed is 1 there and 9 here. Give a new folder";
    assert!(stderr(&other).contains(differs), "{}", stderr(&other));
    let other = standfast(dir.path(), &short(&[FEW, "--controller=catch"])).code(3);
    let differs = "controllers is [\"hold\"] there and [\"hold\",\"catch\"] here";
    assert!(stderr(&other).contains(differs), "{}", stderr(&other));
    assert!(files(&dir.path().join("out")) == whole);
    fs::create_dir(dir.path().join("thesis")).unwrap();
    fs::write(dir.path().join("thesis/main.tex"), "").unwrap();
    standfast(dir.path(), &["run", "smoke", "--trials=1", "--out=thesis"]).code(3);
    assert_eq!(files(&dir.path().join("thesis")).len(), 1);
}

#[test]
fn the_default_folder_makes_way_for_another_campaign() {
    let dir = folder();
    let args: Vec<&str> = short(&[FEW])
        .into_iter()
        .filter(|arg| !arg.starts_with("--out"))
        .collect();
    standfast(dir.path(), &args).success();
    let first = files(&dir.path().join("standfast-results/smoke"));
    let other: Vec<&str> = args.iter().copied().chain(["--seed=9"]).collect();
    standfast(dir.path(), &other).success();
    let results = dir.path().join("standfast-results");
    let mut names: Vec<String> = fs::read_dir(&results)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names.len(), 2);
    assert!(
        names[0] == "smoke" && names[1].starts_with("smoke-") && names[1].len() == 14,
        "{names:?}"
    );
    assert!(files(&results.join("smoke")) == first);
}

#[test]
fn json_is_one_object_and_all_else_goes_to_the_standard_error() {
    let dir = folder();
    let run = standfast(dir.path(), &short(&[FEW, "--json"])).success();
    let summary: serde_json::Value = serde_json::from_str(&stdout(&run)).unwrap();
    let set = &summary["controllers"][0];
    assert_eq!(
        (set["name"].as_str(), set["trials"].as_u64()),
        (Some("hold"), Some(3))
    );
    let total: u64 = [
        "recovered",
        "fell",
        "broke",
        "diverged",
        "failed",
        "timed_out",
    ]
    .iter()
    .map(|k| set[k].as_u64().unwrap())
    .sum();
    assert_eq!(total, 3);
    assert_eq!(summary["config_hash"].as_str().unwrap().len(), 64);
    assert_eq!(
        fs::read_to_string(dir.path().join("out/summary.json")).unwrap(),
        stdout(&run)
    );
    let status: serde_json::Value = serde_json::from_str(&stdout(
        &standfast(dir.path(), &["status", "out", "--json"]).success(),
    ))
    .unwrap();
    assert_eq!(status["complete"], true);
}

#[test]
fn a_robot_that_lands_harder_than_the_limit_breaks() {
    let limit = "--set=episode.judge.max_sole_force_weights=1.5";
    let push = standfast(folder().path(), &["push", "--impulse=5", limit]).success();
    let told = stdout(&push);
    assert!(
        told.contains("broke at t = ") && told.contains(": right sole bore more than 1.5 weights"),
        "{told}"
    );
}

#[test]
fn a_push_is_drawn_and_traced_beside_its_json() {
    let dir = folder();
    let push = [
        "push",
        "--controller=hold",
        "--impulse=4",
        "--set=push.start_s=0.1",
        "--set=episode.horizon_s=1.5",
        "--json",
    ];
    let plain = standfast(dir.path(), &push).success();
    let fell: serde_json::Value = serde_json::from_str(&stdout(&plain)).unwrap();
    assert_eq!(fell["outcome"], "Fell");
    let both = standfast(
        dir.path(),
        &[&push[..], &["--plot=a.svg", "--trace=a.csv"]].concat(),
    )
    .success();
    let alone = standfast(dir.path(), &[&push[..], &["--plot=b.svg"]].concat()).success();
    assert_eq!(stdout(&both), stdout(&alone));
    // The verdict is the same with and without an observer; the trace continues to the horizon.
    assert_eq!(stdout(&both), stdout(&plain));
    let written = files(dir.path());
    let trace = String::from_utf8_lossy(&written["a.csv"]);
    assert!(
        trace.lines().last().unwrap().starts_with("1.5,") && trace.lines().count() == 752,
        "{trace:.200}"
    );
    assert_eq!(
        written.keys().collect::<Vec<_>>(),
        ["a.csv", "a.svg", "b.svg"]
    );
    assert!(written["a.svg"] == written["b.svg"]);
    let svg = String::from_utf8_lossy(&written["a.svg"]);
    let title = format!(
        "4 N s towards 0 degrees, controller hold: fell at {:.2} s",
        fell["fell_at_s"].as_f64().unwrap()
    );
    assert!(
        svg.starts_with("<svg") && svg.contains(&title),
        "{title:?} in {svg:.600}"
    );
    let numbers = svg.lines().filter_map(|line| {
        line.strip_prefix("<text class=\"tick\" ")?
            .split(['<', '>'])
            .nth(1)
    });
    let times: Vec<f64> = numbers.filter_map(|number| number.parse().ok()).collect();
    let last = times.iter().copied().fold(0.0, f64::max);
    assert!(
        (0.3..=fell["fell_at_s"].as_f64().unwrap()).contains(&last),
        "the picture ends with the fall: {times:?}"
    );
}

/// Without options, the push is that of the window; in a trial, it is that of the trial.
#[test]
fn a_push_needs_nothing_to_be_given() {
    let dir = folder();
    let push = |more: &[&str]| {
        let args = [
            &[
                "push",
                "--controller=hold",
                "--set=push.start_s=0.1",
                "--set=episode.horizon_s=0.8",
                "--json",
            ],
            more,
        ]
        .concat();
        serde_json::from_str::<serde_json::Value>(&stdout(&standfast(dir.path(), &args).success()))
            .unwrap()["push"]
            .clone()
    };
    assert_eq!(push(&[])["impulse_n_s"].as_f64(), Some(5.0));
    assert_eq!(push(&["--impulse=1"])["impulse_n_s"].as_f64(), Some(1.0));
    let drawn = push(&["--campaign=smoke", "--trial=3"])["impulse_n_s"]
        .as_f64()
        .unwrap();
    assert!((3.0..5.0).contains(&drawn), "{drawn}");
    assert_eq!(
        push(&["--campaign=smoke"])["impulse_n_s"].as_f64(),
        Some(5.0)
    );
}

#[test]
fn inputs_from_files_are_kept_with_the_result() {
    let dir = folder();
    let campaign = "name='c'\ngains=['../g/mine.toml']\ntrials=1\nseed=1\n[episode]\nhorizon_s=0.6\n[push]\nimpulse_n_s=0\nstart_s=0\n";
    let hold = fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/controllers/hold.toml"
    ))
    .unwrap();
    for sub in ["c", "g"] {
        fs::create_dir(dir.path().join(sub)).unwrap();
    }
    fs::write(dir.path().join("c/c.toml"), campaign).unwrap();
    fs::write(dir.path().join("g/mine.toml"), &hold).unwrap();
    standfast(dir.path(), &["run", "c/c.toml", "--out=out"]).success();
    let kept: Vec<_> = fs::read_dir(dir.path().join("out/inputs/controllers"))
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(kept.len(), 1);
    assert_eq!(fs::read_to_string(kept[0].path()).unwrap(), hold);
    let before = files(&dir.path().join("out"));
    // The source files may be removed, since the result has copies of them.
    fs::remove_dir_all(dir.path().join("g")).unwrap();
    let again = standfast(dir.path(), &["run", "out/campaign.toml", "--out=out"]).success();
    assert!(
        stderr(&again).contains("nothing is computed again"),
        "{}",
        stderr(&again)
    );
    assert!(files(&dir.path().join("out")) == before);
    standfast(dir.path(), &["run", "out/campaign.toml", "--out=copy"]).success();
    assert!(files(&dir.path().join("copy")) == before);
}

#[test]
fn a_check_says_that_all_is_fine_and_writes_nothing() {
    let dir = folder();
    let files = ["--trace=t.csv", "--plot=p.svg", "--replay=r.html"];
    for args in [
        short(&[FEW, "--gate=hold >= 0.1", "--json"]),
        [
            &["push", "--impulse=2", "--controller=hold", "--json"],
            &files[..],
        ]
        .concat(),
        vec![
            "limit",
            "--campaign=nominal",
            "--controller=hold",
            "--headings=2",
            "--out=limits",
            "--plot=limits.svg",
        ],
        vec!["ceiling", "--campaign=nominal", "--out=ceiling"],
    ] {
        let run = standfast(dir.path(), &[&args[..], &["--dry-run"]].concat()).success();
        assert_eq!(stdout(&run), "", "{args:?}");
        let told = stderr(&run);
        assert!(
            told.starts_with("fine: ") && told.lines().count() == 1,
            "{args:?}: {told}"
        );
    }
    let one = standfast(
        dir.path(),
        &["limit", "--controller=hold", "--headings=1", "--dry-run"],
    )
    .success();
    assert!(
        stderr(&one).contains(": 1 search to run; that takes some "),
        "{}",
        stderr(&one)
    );
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    // For an existing result the command says what is left to do, and changes nothing.
    standfast(dir.path(), &short(&[FEW])).success();
    let before = crate::common::program::files(dir.path());
    let told = stderr(&standfast(dir.path(), &short(&[FEW, "--dry-run"])).success());
    assert!(told.contains(" 0 episodes to run"), "{told}");
    assert!(crate::common::program::files(dir.path()) == before);
}

/// A template runs as it is, under the name of its file.
#[test]
fn a_new_file_is_a_commented_template_and_nothing_is_replaced() {
    let dir = folder();
    for (what, file, used) in [
        ("campaign", "my.toml", &["run", "my.toml", "--trials=2"][..]),
        (
            "controller",
            "mine.toml",
            &[
                "run",
                "smoke",
                "--controller=switching",
                "--controller=mine.toml",
            ],
        ),
    ] {
        standfast(dir.path(), &["new", what, file]).success();
        let text = fs::read_to_string(dir.path().join(file)).unwrap();
        let name = format!("\nname = {:?}\n", file.strip_suffix(".toml").unwrap());
        assert!(
            text.starts_with("# ") && text.contains(&name),
            "{text:.300}"
        );
        let told = stderr(&standfast(dir.path(), &[used, &["--dry-run"]].concat()).success());
        assert!(told.contains("on this machine as it is now"), "{told}");
        let message = stderr(&standfast(dir.path(), &["new", what, file]).code(2));
        assert!(
            message.contains(&format!("FILE.toml|DIR = {file}: this is there already")),
            "{message}"
        );
    }
    assert!(stdout(&standfast(dir.path(), &["--help"]).success()).contains("  new "));
}

#[test]
fn a_campaign_is_named_with_its_option_or_without() {
    let dir = folder();
    for args in [
        &["run", "--trials=1"][..],
        &["limit", "--controller=hold", "--headings=1"],
        &["push", "--trial=0"],
    ] {
        let [first, second] = [&["smoke", "--dry-run"], &["--campaign=smoke", "--dry-run"]]
            .map(|more| stderr(&standfast(dir.path(), &[args, more].concat()).success()));
        let untimed = |told: &str| told.split("; that takes").next().unwrap().to_string();
        assert_eq!(untimed(&first), untimed(&second));
    }
}

/// The short help fits on a screen, however wide it is, and all commands share few options.
#[test]
fn the_help_is_short_and_the_long_one_has_examples() {
    use std::collections::BTreeSet;
    use std::process::Command;

    let dir = folder();
    let help = |args: &[&str]| {
        let mut program = Command::new(PROGRAM);
        stdout(&Run::of(program.env("COLUMNS", "200").args(args)).success())
    };
    let all = help(&["--help"]);
    let commands = all.split("Commands:\n").nth(1).unwrap().lines();
    let commands = commands.take_while(|line| !line.is_empty());
    // A description may go on in a second line.
    let commands: Vec<&str> = commands
        .filter_map(|line| line.strip_prefix("  ")?.split(' ').next())
        .filter(|name| !name.is_empty() && *name != "help")
        .collect();
    assert!(commands.len() > 15, "{commands:?}");
    let mut options = BTreeSet::new();
    for command in commands {
        let [short, long] = ["-h", "--help"].map(|option| help(&[command, option]));
        let most = if command == "run" { 30 } else { 45 };
        assert!(short.lines().count() <= most, "{short}");
        for line in short.lines().chain(long.lines()) {
            assert!(line.chars().count() <= 80, "{command}: {line}");
        }
        assert!(!short.contains("Examples:"), "{command}");
        assert!(!long.contains("--gains"), "{command}: the former name");
        let listed = long.lines().map(str::trim_start);
        let listed = listed.filter(|line| line.starts_with('-'));
        let words = listed.flat_map(|line| line.split_whitespace().take(2));
        let names = words.filter(|word| word.starts_with("--"));
        options.extend(names.map(|name| name.trim_end_matches(',').to_string()));
    }
    options.insert("--version".into());
    assert!(options.contains("--quiet") && options.contains("--set"));
    assert!(options.len() <= 49, "{}: {options:?}", options.len());
    for command in [
        "run", "slurm", "limit", "ceiling", "tune", "push", "cpi", "model",
    ] {
        assert!(
            help(&[command, "--help"]).contains("Examples:"),
            "{command}"
        );
    }
    let of = |args: &[&str]| stdout(&standfast(dir.path(), args).success());
    // Line breaks are removed, since they depend on the longest option.
    let words = |args: &[&str]| of(args).split_whitespace().collect::<Vec<_>>().join(" ");
    let run = words(&["run", "-h"]);
    assert!(run.contains("[default: standard]"), "{run}");
    let (tune, cpi) = (words(&["tune", "-h"]), words(&["cpi", "-h"]));
    assert!(
        tune.contains("[default: catch]") && cpi.contains("[default: switching]"),
        "{tune}{cpi}"
    );
    let push = words(&["push", "--help"]);
    for default in [
        "5, scaled to the robot",
        "0.5 s after the start, for 0.05 s",
    ] {
        assert!(push.contains(default), "{default} is not in {push}");
    }
    // The help lists no option that the command refuses.
    let slurm = of(&["slurm", "--help"]);
    for refused in ["--shard <", "--dry-run\n"] {
        assert!(!slurm.contains(refused), "{refused} is in {slurm}");
    }
}

/// Who types a word of a former version is told what does the same now.
#[test]
fn what_was_called_otherwise_is_told() {
    let dir = folder();
    for (args, now) in [
        (&["columns"][..], "docs columns"),
        (&["run", "--check"], "--dry-run"),
        (
            &["push", "--judge=survived"],
            "--set episode.judge.counts=survived",
        ),
        (&["status", "out", "--missing"], "--shards"),
        (&["slurm", "--cpus", "4"], "--sbatch=--cpus-per-task=4"),
    ] {
        let told = stderr(&standfast(dir.path(), args).code(2));
        assert!(told.contains(&format!("there is now: {now}\n")), "{told}");
    }
}

/// Every command that takes a controller takes it by the same option, under both names of the option.
#[test]
fn a_controller_is_named_by_its_option_or_without() {
    let dir = folder();
    for args in [
        &["cpi", "--json"][..],
        &["check", "--set=episode.horizon_s=1", "--json"],
        &["tune", "--budget=20000", "--dry-run"],
    ] {
        let name = if args[0] == "check" { "hold" } else { "fixed" };
        let of = |words: &[&str]| {
            let run = standfast(dir.path(), &[args, words].concat()).success();
            let told = stdout(&run) + &stderr(&run);
            // The time of a tick differs each time.
            told.lines()
                .filter(|line| !line.contains("tick"))
                .map(String::from)
                .collect::<Vec<_>>()
        };
        let vary = ["--vary=zmp_margin=0.02..0.1"];
        let more = if args[0] == "tune" { &vary[..] } else { &[] };
        let first = of(&[&[name], more].concat());
        for option in ["--controller", "--gains"] {
            assert_eq!(
                first,
                of(&[&[option, name], more].concat()),
                "{args:?} {option}"
            );
        }
    }
}

/// A warning comes from the step on at which verdicts were seen to change.
#[test]
fn long_steps_of_the_physics_are_warned_of() {
    let dir = folder();
    let told = |step: &str| {
        let set = [
            format!("--set=episode.control_period_s={step}"),
            format!("--set=episode.physics_step_s={step}"),
        ];
        stderr(
            &standfast(
                dir.path(),
                &[
                    "run",
                    "smoke",
                    "--controller=hold",
                    "--dry-run",
                    &set[0],
                    &set[1],
                ],
            )
            .success(),
        )
    };
    let long = told("0.01");
    assert!(
        long.contains(
            "physics_step_s = 0.01: is long for the servos of ut-mu2, and verdicts may differ"
        ),
        "{long}"
    );
    assert!(!told("0.005").contains("verdicts may differ"));
}

/// A count may be written with an exponent, as in 1e3.
#[test]
fn a_count_may_have_an_exponent() {
    let dir = folder();
    let of = |trials: &str| {
        stderr(
            &standfast(
                dir.path(),
                &["run", "smoke", "--dry-run", "--trials", trials],
            )
            .success(),
        )
    };
    let episodes = |told: &str| told.split("; that takes").next().unwrap().to_string();
    assert!(
        of("1e3").contains(": 4000 episodes to run"),
        "{}",
        of("1e3")
    );
    assert_eq!(episodes(&of("1e3")), episodes(&of("1000")));
}

/// With --quiet, a command prints its result and its errors.
#[test]
fn quiet_leaves_results_and_errors() {
    let dir = folder();
    let loud = standfast(dir.path(), &short(&[FEW])).success();
    assert!(
        stderr(&loud).contains("written: ") && stderr(&loud).contains(" replays"),
        "{}",
        stderr(&loud)
    );
    let quiet: Vec<&str> = short(&[FEW, "-q", "-o", "quiet"])
        .into_iter()
        .filter(|arg| *arg != "--out=out")
        .collect();
    let quiet = standfast(dir.path(), &quiet).success();
    assert_eq!(stderr(&quiet), "");
    assert_eq!(stdout(&quiet).replace("quiet", "out"), stdout(&loud));
    assert!(files(&dir.path().join("quiet")) == files(&dir.path().join("out")));
    let failed = standfast(dir.path(), &short(&[FEW, "-q", "--gate=hold >= 1"])).code(100);
    assert!(
        stderr(&failed).starts_with("gate failed: hold >= 1"),
        "{}",
        stderr(&failed)
    );
    let wrong = standfast(dir.path(), &["push", "--quiet", "--controller=best"]).code(2);
    assert!(
        stderr(&wrong).starts_with("error: controller \"best\" not found"),
        "{}",
        stderr(&wrong)
    );
}

#[test]
fn what_has_a_name_is_listed() {
    let dir = folder();
    let text = stdout(&standfast(dir.path(), &["list"]).success());
    let json: serde_json::Value = serde_json::from_str(&stdout(
        &standfast(dir.path(), &["list", "--json"]).success(),
    ))
    .unwrap();
    for (key, kind) in [
        ("robots", InputKind::Robot),
        ("controllers", InputKind::Controller),
        ("campaigns", InputKind::Campaign),
    ] {
        let listed: Vec<&str> = json[key]
            .as_array()
            .unwrap()
            .iter()
            .map(|item| item["name"].as_str().unwrap())
            .collect();
        assert_eq!(listed, kind.names(), "{key}");
        assert!(
            listed
                .iter()
                .all(|name| text.contains(&format!("\n  {name:<10} "))),
            "{key}: {text}"
        );
    }
    assert_eq!(json["engines"][0]["is_there"], true);
    let has = |name: &str| {
        json["features"]
            .as_array()
            .unwrap()
            .iter()
            .find(|feature| feature["name"] == name)
            .unwrap()["is_there"]
            .clone()
    };
    assert_eq!(
        [has("onnx"), has("mujoco")],
        [cfg!(feature = "onnx"), cfg!(feature = "mujoco")]
    );
    assert!(
        text.contains("a URDF or MJCF, or a TOML file")
            && text.lines().all(|line| line.chars().count() <= 80),
        "{text}"
    );
}

/// The default push is printed with all its numbers, and options change it.
#[test]
fn a_push_states_its_numbers_and_takes_changes_of_its_campaign() {
    let dir = folder();
    let robot = |file: &str| format!("{}/assets/robots/{file}", env!("CARGO_MANIFEST_DIR"));
    let push = |more: &[&str]| {
        let run = standfast(dir.path(), &[&["push", "--controller=hold"], more].concat()).success();
        stdout(&run)
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
    };
    let told = push(&[]);
    let numbers =
        "for 0.05 s from t = 0.5 s, level with the COM horizon 6 s: the episode ends then";
    assert!(
        told.starts_with("push 5 N s towards 0 degrees (dv = ") && told.contains(numbers),
        "{told}"
    );
    // The push is tested in the units of a larger robot, and as in a search by `limit`.
    let adult = format!("--robot={}", robot("adult.urdf"));
    let told = push(&[&adult]);
    let json: serde_json::Value = serde_json::from_str(&push(&[&adult, "--json"])).unwrap();
    let number = |key: &str| json["push"][key].as_f64().unwrap();
    let stated = format!(
        "for {} s from t = {} s, level",
        number("duration_s"),
        number("start_s")
    );
    assert!(
        told.contains(&stated) && number("duration_s") > 0.06,
        "{stated}: {told}"
    );
    let campaign = "name = 'c'\ntrials = 2\nseed = 1\n[push]\nimpulse_n_s = 1\n";
    fs::write(dir.path().join("c.toml"), campaign).unwrap();
    let drawn: serde_json::Value =
        serde_json::from_str(&push(&["c.toml", "--trial=0", &adult, "--json"])).unwrap();
    for key in ["duration_s", "start_s"] {
        let usual = drawn["push"][key].as_f64().unwrap();
        assert!(
            (usual / number(key) - 1.0).abs() < 5e-3,
            "{key}: {usual} {}",
            number(key)
        );
    }
    let changed = [
        "c.toml",
        "--trial=0",
        "--set=push.duration_s=0.07",
        "--set=episode.judge.counts=survived",
        "--json",
    ];
    let changed: serde_json::Value = serde_json::from_str(&push(&changed)).unwrap();
    assert_eq!(
        (&changed["push"]["duration_s"], &changed["judge"]["counts"]),
        (&0.07.into(), &"survived".into())
    );
    assert!(push(&["--set=push.profile=half-sine"]).contains("level with the COM, half-sine"));
}

#[test]
fn help_and_completions_are_printed() {
    let dir = folder();
    for command in ["run", "limit"] {
        let help = stdout(&standfast(dir.path(), &[command, "--help"]).success());
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        let campaigns = format!("{}, or a TOML file", InputKind::Campaign.names().join(", "));
        assert!(
            help.contains("Examples:") && help.contains(&campaigns),
            "{campaigns} not in {help}"
        );
    }
    assert!(
        stdout(&standfast(dir.path(), &["docs", "completions", "bash"]).success())
            .contains("standfast")
    );
}

/// A program with MuJoCo accepts the engine. A program without it refuses it, and says how to get it.
#[test]
fn the_physics_engine_is_chosen_by_its_name() {
    let dir = folder();
    for command in ["run", "limit", "push"] {
        let help = stdout(&standfast(dir.path(), &[command, "--help"]).success());
        let names = match command {
            "push" => "rapier or mujoco",
            _ => "rapier, mujoco or both",
        };
        assert!(
            help.contains(&format!("Physics engine: {names}\n")),
            "{help}"
        );
        let message = stderr(&standfast(dir.path(), &[command, "--engine=bullet"]).code(2));
        assert!(
            message.contains("'bullet' for '--engine <ENGINE>'"),
            "{message}"
        );
    }
    let in_file = "--set=episode.engine=mujoco";
    // The messages of a program without MuJoCo are tested in `mujoco_beside.rs`.
    for args in [
        short(&[FEW, "--engine=mujoco"]),
        short(&[FEW, in_file]),
        vec!["push", "--engine=mujoco"],
        vec!["limit", "--engine=mujoco"],
        vec!["limit", "--engine=both"],
    ] {
        if cfg!(feature = "mujoco") {
            standfast(dir.path(), &[&args[..], &["--dry-run"]].concat()).success();
        }
    }
    // The option overrules the campaign.
    standfast(dir.path(), &short(&[FEW, in_file, "--engine=rapier"])).success();
    let status = stdout(&standfast(dir.path(), &["status", "out"]).success());
    assert!(status.contains("simulated by Rapier "), "{status}");
}

#[cfg(unix)]
#[test]
fn names_that_are_not_utf_8_are_written_or_refused() {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::OsStrExt;
    use std::process::Command;

    let dir = folder();
    let named = |option: &[u8], ending: &[u8]| -> OsString {
        OsStr::from_bytes(&[option, b"\xff", ending].concat()).into()
    };
    let run = |args: &[OsString]| Run::of(Command::new(PROGRAM).current_dir(dir.path()).args(args));
    let push = ["push", "--controller=hold", "--set=episode.horizon_s=1"].map(OsString::from);
    for (option, ending) in [
        ("--trace=", ".csv"),
        ("--plot=", ".svg"),
        ("--replay=", ".html"),
    ] {
        let output = named(option.as_bytes(), ending.as_bytes());
        run(&[&push[..], &[output]].concat()).success();
        assert!(
            dir.path().join(named(b"", ending.as_bytes())).exists(),
            "{option}"
        );
    }
    for option in ["--controller=", "--robot=", "--campaign="] {
        let refused = run(&["push".into(), named(option.as_bytes(), b".toml")]).code(2);
        assert!(stderr(&refused).contains("UTF-8"), "{}", stderr(&refused));
    }
    let refused = run(&["slurm".into(), "smoke".into(), named(b"--out=", b".new")]).code(2);
    assert!(stderr(&refused).contains("UTF-8"), "{}", stderr(&refused));
}

/// A run creates `parts` first, so a campaign file without `parts` belongs to the user.
#[test]
fn a_campaign_in_its_folder_is_not_written_over() {
    let dir = folder();
    let text = "# mine\nname = 'c'\ntrials = 2\nseed = 1\n[push]\nimpulse_n_s = 1\n";
    fs::write(dir.path().join("campaign.toml"), text).unwrap();
    let refused = standfast(dir.path(), &["run", "campaign.toml", "--out=."]).code(3);
    assert!(
        stderr(&refused).contains("is not the folder of a campaign"),
        "{}",
        stderr(&refused)
    );
    assert_eq!(
        fs::read_to_string(dir.path().join("campaign.toml")).unwrap(),
        text
    );
}

/// Lines are broken between words only, at any width of the terminal. COLUMNS states the width if there is no terminal.
#[test]
fn no_number_no_name_and_no_unit_is_broken_at_any_width() {
    let dir = folder();
    let child = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/robots/child.urdf");
    fs::copy(child, dir.path().join("child.urdf")).unwrap();
    let campaign = short(&["--controller=catch", "--full", FEW]);
    for args in [
        &["model"][..],
        &["model", child],
        &["init", "child.urdf", "--force"],
        &campaign,
    ] {
        let of_width = |columns: &str| {
            let mut command = Command::new(PROGRAM);
            let run = Run::of(
                command
                    .current_dir(dir.path())
                    .args(args)
                    .env("COLUMNS", columns),
            )
            .success();
            let told = stdout(&run).replace('─', " ");
            let mut words: Vec<String> = told.split_whitespace().map(String::from).collect();
            words.sort();
            (
                words,
                told.lines()
                    .map(|line| line.trim_end().chars().count())
                    .max()
                    .unwrap(),
            )
        };
        let (whole, widest) = of_width("400");
        // The names of a robot's links and joints, and the paths of files, may need more.
        for (columns, most) in [("30", 100), ("80", 100)] {
            let (words, width) = of_width(columns);
            assert!(
                words == whole && width <= most,
                "{args:?} at {columns} columns, {width} wide: {words:?}\n{whole:?}"
            );
        }
        assert!(widest > 60, "{args:?}: {widest}");
    }
    let joints = standfast(dir.path(), &["model"]);
    let lines = stdout(&joints)
        .lines()
        .map(|line| line.chars().count())
        .max()
        .unwrap();
    assert!(lines <= 80, "UT-mu2 has room in 80 columns: {lines}");
}

/// A program that read a pipe without a writer would wait without end.
#[cfg(unix)]
#[test]
fn what_is_no_file_is_refused() {
    let dir = folder();
    let pipe = dir.path().join("pipe.toml");
    assert!(
        std::process::Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    for args in [
        ["run", "pipe.toml"],
        ["cpi", "pipe.toml"],
        ["model", "pipe.toml"],
    ] {
        let refused = standfast(dir.path(), &args).code(2);
        assert!(
            stderr(&refused).contains("pipe.toml: cannot read: it is no file"),
            "{}",
            stderr(&refused)
        );
    }
}
