//! `standfast limit` from outside: its output, its independence of threads, and its refusals.

use crate::common::program::{files, folder, standfast, stderr, stdout};
use serde_json::Value;
use std::{fs, path::Path};

/// Two headings, forward and backward, for the controller without gains.
const SMALL: [&str; 5] = [
    "limit",
    "--controller=hold",
    "--headings=2",
    "--set=push.height_m=0.02",
    "--json",
];
const NOMINAL: &str = "--campaign=nominal";

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn what_hold_takes_forward_and_backward_beside_the_bounds() {
    let dir = tempfile::tempdir().unwrap();
    let args = [
        &SMALL[..],
        &[
            NOMINAL,
            "--precision=0.4",
            "--replicas=1",
            "--dense",
            "--out=out",
            "--plot=polar.svg",
        ],
    ]
    .concat();
    let run = standfast(dir.path(), &args).success();
    let printed = text(&run.get_output().stdout);
    assert_eq!(
        printed,
        fs::read_to_string(dir.path().join("out/limit.json")).unwrap()
    );
    let svg = fs::read_to_string(dir.path().join("out/limit.svg")).unwrap();
    assert!(
        svg.contains("<polygon class=\"bound one\"")
            && svg.contains("hold")
            && svg.contains("forward, 0")
    );
    // Two headings say nothing about the headings between them.
    assert!(svg.contains("hold, 180\u{b0}: ") && !svg.contains("class=\"outline\""));
    assert_eq!(
        svg,
        fs::read_to_string(dir.path().join("polar.svg")).unwrap()
    );

    let json: Value = serde_json::from_str(&printed).unwrap();
    let number = |pointer: &str| {
        json.pointer(pointer)
            .and_then(Value::as_f64)
            .unwrap_or_else(|| panic!("{pointer}"))
    };
    for (pointer, value, tolerance) in [
        ("/mass_kg", 8.0, 1e-3),
        ("/omega_rad_s", 5.63, 0.01),
        ("/com_height_m", 0.31, 1e-3),
        ("/com_offset_m/0", 0.0, 1e-4),
        ("/sole_x_m/0", -0.048086, 1e-9),
        ("/sole_y_m/1", 0.034586, 1e-9),
        ("/stance_width_m", 0.097, 1e-9),
        ("/reach/0/swing_time_s", 0.15, 0.0),
        ("/reach/0/x_m/1", 0.15, 0.0),
        ("/reach/0/y_m/1", 0.18, 0.0),
        ("/reach/1/y_m/0", -0.03, 0.0),
        ("/push_duration_s", 0.05, 1e-5),
        ("/push_height_m", 0.02, 0.0),
        ("/height_factor", 1.0 / (1.0 + 0.02 / 0.31), 1e-3),
        ("/headings/1/heading_deg", 180.0, 0.0),
        ("/headings/0/bound_no_step_n_s", 2.48, 0.01),
        ("/headings/0/bound_one_step_n_s", 5.815, 0.01),
        (
            "/headings/1/bound_one_step_at_height_n_s",
            5.815 / (1.0 + 0.02 / 0.31),
            0.01,
        ),
        // `standfast push --controller hold --set push.height_m=0.02` recovers from 2.4 N s and falls at 2.5, both ways.
        ("/headings/0/controllers/0/impulse50_n_s", 2.45, 0.4),
        ("/headings/1/controllers/0/impulse50_n_s", 2.45, 0.4),
    ] {
        assert!(
            (number(pointer) - value).abs() <= tolerance,
            "{pointer} = {}",
            number(pointer)
        );
    }
    assert!(number("/headings/0/bound_n_step_n_s") > 6.0);
    let mut episodes = 0.0;
    for heading in 0..2 {
        let of = |key: &str| number(&format!("/headings/{heading}/controllers/0/{key}"));
        let (low, high) = (of("ci95/0"), of("ci95/1"));
        assert!(low < of("impulse50_n_s") && of("impulse50_n_s") < high && high - low <= 0.8);
        let ninety = json.pointer(&format!("/headings/{heading}/controllers/0/impulse90_n_s"));
        assert_eq!(ninety, Some(&Value::Null), "nothing is left to chance");
        // The impulses go up on a grid of the precision.
        let (safe, lost) = (of("safe_n_s"), of("first_loss/impulse_n_s"));
        assert!(
            (safe / 0.4).fract() < 1e-9 || (safe / 0.4).fract() > 1.0 - 1e-9,
            "{safe}"
        );
        assert!(
            (lost / (safe + 0.4) - 1.0).abs() <= 0.01 && (2.0..2.9).contains(&lost),
            "{safe} {lost}"
        );
        // The search for the first loss looks between the headings, and compares the loss with the limit at the heading
        // of the loss.
        let turned = (of("first_loss/heading_deg") - 180.0 * f64::from(heading) + 180.0)
            .rem_euclid(360.0)
            - 180.0;
        assert!(turned.abs() > 1.0 && turned.abs() <= 11.25, "{turned}");
        assert_eq!(of("first_loss/of_limit"), lost / of("first_loss/limit_n_s"));
        assert!((0.0..0.002).contains(&(of("first_loss/start_s") - 0.5)));
        assert_eq!(of("safe_trials"), (safe / 0.4).round() + 1.0);
        assert_eq!(
            of("trials"),
            [
                "recovered",
                "fell",
                "broke",
                "timed_out",
                "diverged",
                "failed"
            ]
            .map(of)
            .iter()
            .sum::<f64>()
        );
        // The map has every impulse of the grid, up to a few beyond the limit.
        let map = json
            .pointer(&format!("/headings/{heading}/controllers/0/map"))
            .and_then(Value::as_array)
            .unwrap();
        for (point, tried) in (1..).zip(map) {
            let impulse = tried["impulse_n_s"].as_f64().unwrap();
            assert!((impulse - 0.4 * f64::from(point)).abs() < 1e-9, "{tried}");
            let is_known = impulse < low || impulse > high;
            assert!(
                !is_known || tried["outcome"] == if impulse < low { "recovered" } else { "fell" },
                "{tried}"
            );
        }
        assert_eq!(map.len() as f64, (1.15 * of("impulse50_n_s") / 0.4).floor());
        episodes +=
            of("trials") + of("safe_trials") + of("first_loss/limit_trials") + map.len() as f64;
        episodes += of("none_above_trials");
        // Eight steps of 3 % without any end the search above the limit.
        assert!(of("none_above_trials") >= 8.0 && of("none_above_n_s") >= safe);
    }
    let map = fs::read_to_string(dir.path().join("out/map.svg")).unwrap();
    assert!(
        map.contains("class=\"cell\"") && map.contains("<polyline class=\"limit\""),
        "{map}"
    );
    // The first loss can be repeated.
    let loss = &json["headings"][1]["controllers"][0]["first_loss"];
    let option = |name: &str, key: &str| format!("--{name}{}", loss[key]);
    let [trial, impulse, heading, start] = [
        ("trial=", "trial"),
        ("impulse=", "impulse_n_s"),
        ("heading=", "heading_deg"),
        ("set=push.start_s=", "start_s"),
    ]
    .map(|(name, key)| option(name, key));
    let push = [
        "push",
        NOMINAL,
        "--controller=hold",
        "--set=push.height_m=0.02",
        "--json",
        &trial,
        &impulse,
        &heading,
        &start,
    ];
    let repeated: Value = serde_json::from_str(&text(
        &standfast(dir.path(), &push).success().get_output().stdout,
    ))
    .unwrap();
    assert_eq!(repeated["outcome"], "Fell", "{repeated}");
    assert_eq!(episodes, number("/episodes"));
    let at_losses: f64 = (0..2)
        .map(|i| {
            number(&format!(
                "/headings/{i}/controllers/0/first_loss/limit_trials"
            ))
        })
        .sum();
    assert!(
        episodes - at_losses < 90.0 && at_losses < 20.0,
        "{episodes} {at_losses}"
    );
    // The limit at the heading of the loss is the limit that a search at this heading finds: the robot falls beyond it
    // and recovers below it.
    for (share, outcome) in [(0.8, "Recovered"), (1.2, "Fell")] {
        let impulse = format!("--impulse={}", share * loss["limit_n_s"].as_f64().unwrap());
        let push = [
            "push",
            NOMINAL,
            "--controller=hold",
            "--set=push.height_m=0.02",
            "--json",
            &impulse,
            &heading,
        ];
        let pushed = text(&standfast(dir.path(), &push).success().get_output().stdout);
        assert_eq!(
            serde_json::from_str::<Value>(&pushed).unwrap()["outcome"],
            outcome,
            "{impulse}"
        );
    }

    let again = standfast(dir.path(), &args).success();
    assert_eq!(text(&again.get_output().stdout), printed);
    assert!(
        text(&again.get_output().stderr)
            .contains("out: all 2 searches are there; nothing is computed again")
    );
}

/// The files of a search, whole or in shards, on one thread or two, and killed as often as it has finished something.
#[test]
#[ignore = "kills a search ten times, a hundred seconds"]
fn kills_shards_and_threads_change_nothing() {
    let dir = folder();
    let args = |more: &[&'static str]| {
        let few = [
            NOMINAL,
            "--precision=0.4",
            "--replicas=1",
            "--dense",
            "--headings=6",
        ];
        [&[SMALL[0], SMALL[1], SMALL[3], SMALL[4]], &few[..], more].concat()
    };
    let json = stdout(&standfast(dir.path(), &args(&["--threads=1", "--out=whole"])).success());
    let whole = files(&dir.path().join("whole"));
    assert_eq!(whole["limit.json"], json.as_bytes());
    assert!(whole.contains_key("map.svg") && whole.contains_key("parts/search-6-of-6.json"));

    // Killed as soon as one more search is finished, at another moment each time.
    let parts = || fs::read_dir(dir.path().join("killed/parts")).map_or(0, Iterator::count);
    let mut kills = 0;
    for round in 0..10 {
        let before = parts();
        let mut child = std::process::Command::new(crate::common::PROGRAM)
            .current_dir(dir.path())
            .args(args(&["--threads=2", "--out=killed"]))
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .unwrap();
        while parts() == before && child.try_wait().unwrap().is_none() {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        std::thread::sleep(std::time::Duration::from_millis(7 * round));
        kills += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert!(kills > 0);
    assert_eq!(
        stdout(&standfast(dir.path(), &args(&["--out=killed"])).success()),
        json
    );
    let mut killed = files(&dir.path().join("killed"));
    killed.retain(|name, _| !name.contains(".tmp-"));
    assert!(killed == whole, "{:?}", killed.keys());

    // Each shard runs its own searches, and the last one writes the result.
    for (shard, missing) in [("--shard=3/3", "1-2"), ("--shard=1/3", "2")] {
        let told = stdout(&standfast(dir.path(), &args(&[shard, "--out=shards"])).success());
        let told: Value = serde_json::from_str(&told).unwrap();
        assert_eq!(
            (&told["complete"], &told["missing_shards"]),
            (&false.into(), &missing.into())
        );
        assert!(!dir.path().join("shards/limit.json").exists());
    }
    assert_eq!(
        stdout(&standfast(dir.path(), &args(&["--shard=2/3", "--out=shards"])).success()),
        json
    );
    assert!(files(&dir.path().join("shards")) == whole);

    // A folder keeps to its search.
    for (more, expected) in [
        (
            args(&["--out=whole", "--trials=9"]),
            "holds another search: max_trials is 150 there and 9 here",
        ),
        (
            args(&["--out=whole", "--seed=9"]),
            "holds another search: seed is",
        ),
        (
            vec!["ceiling", NOMINAL, "--out=whole"],
            "holds something else than a search of `ceiling`",
        ),
        (vec!["run", "smoke", "--trials=1", "--out=whole"], "holds"),
    ] {
        let message = stderr(&standfast(dir.path(), &more).code(3));
        assert!(
            message.contains("whole: ") && message.contains(expected),
            "{message}"
        );
    }
    fs::write(dir.path().join("whole/parts/search-2-of-6.json"), "{").unwrap();
    let message = stderr(&standfast(dir.path(), &args(&["--out=whole"])).code(3));
    assert!(
        message.contains("whole/parts/search-2-of-6.json: is damaged"),
        "{message}"
    );
    fs::remove_file(dir.path().join("whole/parts/search-2-of-6.json")).unwrap();
    assert_eq!(
        stdout(&standfast(dir.path(), &args(&["--out=whole"])).success()),
        json
    );
    assert!(files(&dir.path().join("whole")) == whole);
}

/// Without `--out` a search has a folder, which is said, and another search of the campaign has another one.
#[test]
fn a_search_without_a_folder_gets_one() {
    let dir = folder();
    let args = |precision| [&SMALL[..], &[NOMINAL, "--replicas=0", precision]].concat();
    let first = standfast(dir.path(), &args("--precision=1")).success();
    assert!(
        stderr(&first).contains("written: standfast-results/limit-nominal/limit.json"),
        "{}",
        stderr(&first)
    );
    let second = stderr(&standfast(dir.path(), &args("--precision=2")).success());
    assert!(
        second.contains("written: standfast-results/limit-nominal-"),
        "{second}"
    );
    let again = standfast(dir.path(), &args("--precision=1")).success();
    assert!(
        stderr(&again).contains("nothing is computed again") && stdout(&again) == stdout(&first)
    );
}

/// Pushes on a controller that takes footsteps start at times that are spread; its limit is over these. The commands that show
/// a loss again state the start.
#[test]
#[ignore = "searches for an eighth of a minute"]
fn starts_are_spread_with_controllers_that_step() {
    let dir = tempfile::tempdir().unwrap();
    let args = [
        "limit",
        NOMINAL,
        "--controller=hold",
        "--controller=catch",
        "--headings=1",
        "--precision=0.8",
        "--replicas=1",
        "--trials=12",
        "--out=out",
    ];
    let printed = stdout(&standfast(dir.path(), &args).success());
    let json = fs::read_to_string(dir.path().join("out/limit.json")).unwrap();
    let json: Value = serde_json::from_str(&json).unwrap();
    let [hold, catch] = [0, 1].map(|i| &json["headings"][0]["controllers"][i]);
    let number = |of: &Value, key: &str| of.pointer(key).unwrap().as_f64().unwrap();
    assert_eq!(number(hold, "/start_spread_s"), 0.0);
    let spread_deg = [hold, catch].map(|of| number(of, "/heading_spread_deg"));
    assert_eq!(spread_deg, [0.0, 11.25]);
    assert!(hold["impulse90_n_s"].is_null() && catch["impulse90_n_s"].is_f64());
    let spread_s = number(catch, "/start_spread_s");
    assert!((spread_s - 0.604).abs() < 0.001, "{spread_s}");
    assert!(number(catch, "/safe_n_s") <= number(catch, "/none_above_n_s"));
    let start_s = number(catch, "/first_loss/start_s");
    assert!(start_s > 0.502 && start_s < 0.5 + spread_s, "{start_s}");
    let told = printed.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        told.contains(
            "are spread over 0.604 s, and their headings over 11.25 degrees to either side"
        ),
        "{printed}"
    );
}

/// The push at the limit of a robot of another size, with a campaign that is changed: with the printed command the
/// robot recovers, and with the other impulse that is named beside it the robot falls.
#[test]
fn a_limit_is_checked_by_the_command_that_is_printed() {
    let dir = tempfile::tempdir().unwrap();
    let robot = format!(
        "--robot={}/assets/robots/adult.urdf",
        env!("CARGO_MANIFEST_DIR")
    );
    let args = [
        "limit",
        NOMINAL,
        "--controller=hold",
        "--headings=1",
        "--replicas=0",
        "--set=push.height_m=0.02",
        &robot,
    ];
    let told = text(&standfast(dir.path(), &args).success().get_output().stdout);
    let (_, check) = told.split_once("\ncheck: ").unwrap();
    let told = check.split_whitespace().collect::<Vec<_>>().join(" ");
    let harder = told
        .split_once("loses it with --impulse ")
        .unwrap()
        .1
        .split_once(": standfast ")
        .unwrap();
    let (harder, command) = (
        harder.0,
        harder.1.split_once(" `none`").unwrap().0.replace("\\ ", ""),
    );
    assert!(
        command.contains("--set push.height_m=0.02 --trial 0 --controller hold --robot "),
        "{command}"
    );
    let push = |more: &[&str]| {
        let words = command
            .split(' ')
            .chain(more.iter().copied())
            .collect::<Vec<_>>();
        serde_json::from_str::<Value>(&text(
            &standfast(dir.path(), &words).success().get_output().stdout,
        ))
        .unwrap()
    };
    let found = push(&["--json"]);
    assert_eq!(
        (&found["outcome"], &found["push"]["height_m"]),
        (&"Recovered".into(), &0.02.into()),
        "{command}"
    );
    let (easy, _) = command.split_once(" --impulse ").unwrap();
    let (harder, heading) = (format!("--impulse={harder}"), "--heading=0");
    let words = easy
        .split(' ')
        .chain([harder.as_str(), heading, "--json"])
        .collect::<Vec<_>>();
    let lost: Value = serde_json::from_str(&text(
        &standfast(dir.path(), &words).success().get_output().stdout,
    ))
    .unwrap();
    assert_eq!(lost["outcome"], "Fell", "{words:?}");
}

#[test]
#[ignore = "searches limits several times, a third of a minute"]
fn threads_change_nothing_the_seed_does_and_too_few_trials_are_marked() {
    let dir = tempfile::tempdir().unwrap();
    // Robots, grounds and pushes differ so much that a wrong order of trials would show.
    let of = |more: &[&str]| {
        let few = [
            "--campaign=harsh",
            "--trials=8",
            "--precision=0.3",
            "--replicas=1",
        ];
        let args = [
            &[
                "limit",
                "--controller=hold",
                "--set=push.height_m=0.02",
                "--json",
            ],
            &few[..],
            more,
        ]
        .concat();
        let run = standfast(dir.path(), &args).success();
        text(&run.get_output().stdout)
    };
    let one = of(&["--headings=2", "--threads=1", "--out=one"]);
    assert!(one.contains("\"resolved\": false") && one.contains("\"random\": true"));
    assert_eq!(one, of(&["--headings=2", "--threads=2", "--out=two"]));
    let found = |json: &str| serde_json::from_str::<Value>(json).unwrap()["headings"].take();
    // The result at a heading depends on no other heading.
    assert_ne!(found(&one), found(&of(&["--headings=2", "--seed=9"])));
    assert_eq!(found(&one)[1], found(&of(&["--headings=4"]))[2]);
}

#[test]
fn what_is_wrong_is_said_before_anything_runs() {
    let dir = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/robots");
    fs::copy(assets.join("ut-mu2.urdf"), dir.path().join("r.urdf")).unwrap();
    let settings = fs::read_to_string(assets.join("ut-mu2.toml")).unwrap();
    let (before, after) = (
        settings.find("[[reach]]").unwrap(),
        settings.find("[noise]").unwrap(),
    );
    fs::write(
        dir.path().join("r.toml"),
        format!("{}{}", &settings[..before], &settings[after..]),
    )
    .unwrap();
    fs::write(dir.path().join("file"), "").unwrap();
    for (more, expected) in [
        (
            "--headings=0",
            "'0' for '--headings <N>': out of range; accepted: a whole number from 1 to 360",
        ),
        ("--precision=-1", "--precision = -1: out of range"),
        ("--trials=0", "'0' for '--trials <N>': out of range"),
        ("--plot=a.png", "--plot = a.png: unknown kind of file"),
        ("--out=file", "--out = file: it is a file"),
        ("--campaign=best", "campaign \"best\" not found"),
        ("--controller=best", "controller \"best\" not found"),
    ] {
        let run = standfast(dir.path(), &["limit", more]).code(2);
        let message = text(&run.get_output().stderr);
        assert!(message.contains(expected), "{more}: {message}");
        assert!(run.get_output().stdout.is_empty());
    }
    // Without its reach the robot has no bounds with footsteps, and can do everything else.
    let hold = [
        "--controller=hold",
        "--headings=1",
        "--replicas=0",
        "--precision=1",
    ];
    let limit = [&["limit", "--robot=r.urdf", "--json"][..], &hold].concat();
    let told = standfast(dir.path(), &limit).success();
    let told: Value = serde_json::from_str(&text(&told.get_output().stdout)).unwrap();
    let heading = &told["headings"][0];
    assert!(heading["bound_no_step_n_s"].as_f64() > Some(2.0), "{told}");
    assert!(heading["bound_one_step_n_s"].is_null() && heading["bound_n_step_n_s"].is_null());
    standfast(
        dir.path(),
        &["push", "--impulse=1", "--robot=r.urdf", "--controller=hold"],
    )
    .success();
    let model = standfast(dir.path(), &["model", "r.urdf"]).success();
    assert!(text(&model.get_output().stdout).contains("reach    not given"));
}
