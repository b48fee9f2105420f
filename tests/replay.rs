//! Trials of a campaign, run again one by one: the report of `push` agrees with the campaign, to the bit.

use crate::common::parts::{forge_manifest, rows};
use crate::common::program::{FEW, SEVERAL_PARTS, files, folder, short, standfast, stderr, stdout};
use std::fs;

/// The columns of a trial that `push` reports too, as JSON values: outcome, times and peaks.
const REPLAYED: [&str; 16] = [
    "outcome",
    "end_s",
    "fell_at_s",
    "fall_cause",
    "settled_at_s",
    "home_at_s",
    "peak_tilt_deg",
    "peak_torque_n_m",
    "peak_joint_speed_rad_s",
    "peak_sole_force_n",
    "peak_gear_torque_ratio",
    "peak_dcm_outside_m",
    "legs_met_at_s",
    "legs_met",
    "promise_margin",
    "promise_margin_est",
];

#[test]
fn a_trial_is_replayed_to_the_bit() {
    let dir = folder();
    let gains = fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/controllers/switching.toml"
    ))
    .unwrap();
    fs::write(
        dir.path().join("file.toml"),
        gains.replace("name = \"switching\"", "name = \"mine\""),
    )
    .unwrap();
    let args = [
        "--trials=2",
        "--set=push.impulse_n_s={uniform=[0.2, 5]}",
        "--set=episode.horizon_s=2",
        "--set=push.start_s=0.8",
    ];
    let gains = ["--controller=hold", "--controller=file.toml"];
    for more in [
        ["standard", "--set=episode.end_early=true", "--out=a"],
        ["standard", "--set=episode.end_early=false", "--out=b"],
        ["harsh", "--set=second_push.after_s=0.1", "--out=c"],
    ] {
        let out = more[2].trim_start_matches("--out=");
        let run = [&["run", "--seed=5"][..], &gains, &args, &more[..]].concat();
        standfast(dir.path(), &run).success();
        let rows = rows(&dir.path().join(out).join("parts/part-000000.parquet"));
        assert_eq!(rows.len(), 4);
        assert!(more[0] == "harsh" || rows.iter().any(|row| row["outcome"] == "Recovered"));
        for row in rows {
            let (trial, set) = (
                row["trial"].as_f64().unwrap().to_string(),
                row["controller"].as_str().unwrap(),
            );
            // A controller from a file can be given by its name, since the result has a copy.
            let campaign = format!("{out}/campaign.toml");
            let args = [
                "push",
                "--json",
                "--campaign",
                &campaign,
                "--trial",
                &trial,
                "--controller",
                set,
            ];
            let replay: serde_json::Value =
                serde_json::from_str(&stdout(&standfast(dir.path(), &args).success())).unwrap();
            for name in REPLAYED {
                assert_eq!(row[name], replay[name], "{name} of trial {trial}, {set}");
            }
            let varied = replay["variation"].as_object().unwrap();
            assert!(
                varied.len() >= 8 && varied.iter().all(|(name, value)| row[name] == *value),
                "{row:?} {varied:?}"
            );
            assert_eq!(
                row["second_impulse_n_s"],
                replay["second_push"]["impulse_n_s"]
            );
            assert_eq!(row["second_impulse_n_s"].is_null(), more[0] == "standard");
        }
        // The ground of these trials is inclined and tilts first, and a second push follows the first.
        let early = [
            "push",
            "--campaign",
            more[0],
            "--trial=0",
            "--set=push.start_s=0.2",
        ];
        let message = stderr(&standfast(dir.path(), &early).code(2));
        let words = "push.start_s = 0.2: the ground is still tilting to its slope";
        assert!(message.contains(words), "{message}");
    }
}

/// Files, pages and pictures show a trial. They change neither its outcome nor its times.
#[test]
#[ignore = "looks at one trial in every way, half a minute"]
fn a_trial_ends_alike_however_it_is_looked_at() {
    let dir = folder();
    let gains = ["--controller=hold", "--controller=catch"];
    let run = [
        &[
            "run",
            "smoke",
            "--trials=1",
            "--seed=3",
            "--out=out",
            "--replays=0",
        ][..],
        &gains,
    ]
    .concat();
    standfast(dir.path(), &run).success();
    let rows = rows(&dir.path().join("out/parts/part-000000.parquet"));
    assert_eq!(
        rows.iter().map(|row| &row["outcome"]).collect::<Vec<_>>(),
        ["Fell", "Recovered"]
    );
    for row in &rows {
        let set = [
            "--trial=0",
            "--json",
            "--controller",
            row["controller"].as_str().unwrap(),
        ];
        let push = ["push", "--campaign=out/campaign.toml"];
        let page = ["replay", "out", "--replay=page.html"];
        let looks: Vec<(&[&str], &[&str])> = vec![
            (&push, &[]),
            (&push, &["--trace=t.csv"]),
            (&push, &["--plot=p.svg", "--replay=r.html"]),
            (&page, &[]),
            (&page, &["--trace=t.csv", "--plot=p.svg"]),
        ];
        for (command, look) in looks {
            let looked = standfast(dir.path(), &[command, &set, look].concat()).success();
            let seen: serde_json::Value = serde_json::from_str(&stdout(&looked)).unwrap();
            for name in REPLAYED {
                assert_eq!(row[name], seen[name], "{name} of {command:?} with {look:?}");
            }
            assert!(
                !stderr(&looked).contains("is not as it was"),
                "{command:?}: {}",
                stderr(&looked)
            );
        }
    }
}

/// Each episode is the same as alone, and the page has the other robot as a ghost.
#[test]
fn two_controllers_are_shown_beside_each_other() {
    let dir = folder();
    let alone = |controller: &str| -> serde_json::Value {
        let run = standfast(dir.path(), &["push", "--controller", controller, "--json"]).success();
        serde_json::from_str(&stdout(&run)).unwrap()
    };
    let shown = ["--json", "--replay=page.html"];
    let run = standfast(
        dir.path(),
        &[
            &["push", "--controller=hold", "--controller=catch"],
            &shown[..],
        ]
        .concat(),
    )
    .success();
    let both: serde_json::Value = serde_json::from_str(&stdout(&run)).unwrap();
    assert_eq!(
        both["controllers"],
        serde_json::json!([alone("hold"), alone("catch")])
    );
    assert_eq!(
        [
            &both["controllers"][0]["outcome"],
            &both["controllers"][1]["outcome"]
        ],
        ["Fell", "Recovered"]
    );
    let page = fs::read_to_string(dir.path().join("page.html")).unwrap();
    for words in [
        "<b>Solid:</b> hold: fell at",
        "<b>Ghost:</b> catch: recovered",
    ] {
        assert!(page.contains(words), "{words}");
    }
    let same = ["push", "--controller=catch", "--controller=catch"];
    let same = stderr(&standfast(dir.path(), &same).code(2));
    assert!(
        same.contains("--controller = catch: cannot be shown beside the others"),
        "{same}"
    );
}

#[test]
#[ignore = "runs a sweep several times, a quarter of a minute"]
fn a_sweep_resumes_merges_and_replays_like_any_campaign() {
    let dir = folder();
    let (mine, out) = (dir.path().join("mine.toml"), dir.path().join("out"));
    let gains = fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/controllers/switching.toml"
    ))
    .unwrap();
    fs::write(
        &mine,
        gains.replace("name = \"switching\"", "name = \"mine\""),
    )
    .unwrap();
    let sweep = [
        "--vary=mine.toml:zmp_margin=0.02,0.4",
        "--vary=fixed:gains.0.x=[0.8,1,5]",
        SEVERAL_PARTS,
        "--replays=0",
    ];
    standfast(dir.path(), &short(&sweep)).success();
    let whole = files(&out);
    let campaign = String::from_utf8(whole["campaign.toml"].clone()).unwrap();
    let listed = r#"controllers = ["hold", "inputs/controllers/mine.toml", "inputs/controllers/mine.toml:zmp_margin=0.02", "inputs/controllers/mine.toml:zmp_margin=0.4", "fixed", "fixed:gains.0.x=[0.8,1,5]"]"#;
    assert!(campaign.contains(listed), "{campaign}");
    assert_eq!(
        whole
            .keys()
            .filter(|name| name.starts_with("inputs/"))
            .collect::<Vec<_>>(),
        ["inputs/controllers/mine.toml"]
    );

    for share in ["--shard=1/2", "--shard=2/2"] {
        let args = short(&[&sweep[..], &["--out=shards", share]].concat());
        let args: Vec<&str> = args.into_iter().filter(|arg| *arg != "--out=out").collect();
        standfast(dir.path(), &args).success();
    }
    standfast(dir.path(), &["merge", "shards", "--replays=0"]).success();
    assert!(files(&dir.path().join("shards")) == whole, "merged");
    // The result has its own copy of the controller.
    fs::remove_file(&mine).unwrap();
    fs::remove_file(out.join("parts/part-000001.parquet")).unwrap();
    let run = standfast(
        dir.path(),
        &["run", "out/campaign.toml", "--out", "out", "--replays=0"],
    )
    .success();
    assert!(
        stderr(&run).contains("goes on, 126 of 156 episodes are there"),
        "{}",
        stderr(&run)
    );
    assert!(files(&out) == whole, "resumed");

    let rows = rows(&out.join("parts/part-000005.parquet"));
    let sets: Vec<&str> = rows
        .iter()
        .map(|row| row["controller"].as_str().unwrap())
        .collect();
    assert_eq!(
        sets,
        [
            "hold",
            "mine",
            "mine zmp_margin=0.02",
            "mine zmp_margin=0.4",
            "fixed",
            "fixed x=[0.8,1,5]"
        ]
    );
    assert_ne!(
        rows[2]["promise_margin"], rows[3]["promise_margin"],
        "a variant is another set"
    );
    // Controllers are given by the name in the results, and as in the list, where the file has the name of its
    // controller.
    let asked = [
        sets[2],
        sets[3],
        sets[5],
        "mine:zmp_margin=0.4",
        "fixed:gains.0.x=[0.8,1,5]",
    ];
    for (set, row) in asked.into_iter().zip([2, 3, 5, 3, 5].map(|i| &rows[i])) {
        let args = [
            "push",
            "--json",
            "--campaign=out/campaign.toml",
            "--trial=25",
            "--controller",
            set,
        ];
        let replay: serde_json::Value =
            serde_json::from_str(&stdout(&standfast(dir.path(), &args).success())).unwrap();
        for name in REPLAYED {
            assert_eq!(row[name], replay[name], "{name} of {set}");
        }
    }
}

#[test]
#[ignore = "an eighth of a minute"]
fn a_sweep_alone_replaces_the_controllers_begins_with_the_unchanged_one_and_keeps_its_names_whole()
{
    let dir = folder();
    let sweep =
        "--vary=switching:zmp_margin=0.02,0.04,0.06,0.08,0.1,0.12,0.14,0.16,0.18,0.2,0.22,0.24";
    let args: Vec<&str> = short(&[FEW, sweep, "--replays=0", "--full"])
        .into_iter()
        .filter(|arg| *arg != "--controller=hold")
        .collect();
    let text = stdout(&standfast(dir.path(), &args).success());
    let (_, tables) = text.split_once("controller ").unwrap();
    let (tables, _) = tables.split_once("to replay a trial").unwrap();
    // A row with two such names takes 86 columns, since no name and no number is broken.
    assert!(
        tables.lines().all(|line| line.chars().count() <= 86),
        "{tables}"
    );
    assert!(!tables.contains("hold   "), "{tables}");
    // Most tables show the name as a whole, not cut into pieces.
    assert!(tables.matches("zmp_margin=0.24").count() >= 4, "{tables}");
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(dir.path().join("out/summary.json")).unwrap())
            .unwrap();
    assert_eq!(summary["controllers"].as_array().unwrap().len(), 13);
    assert_eq!(
        (&summary["reference"], &summary["controllers"][0]["name"]),
        (&"switching".into(), &"switching".into())
    );
    let is_of_reference =
        |pair: &serde_json::Value| [&pair["a"], &pair["b"]].contains(&&summary["reference"]);
    assert!(
        summary["pairs"].as_array().unwrap()[..12]
            .iter()
            .all(is_of_reference),
        "they come first"
    );
    assert!(
        text.contains(" headings ") && text.contains("than switching, over all"),
        "{text}"
    );
    let picture = fs::read_to_string(dir.path().join("out/success.svg")).unwrap();
    assert!(picture.contains("switching zmp_margin=0.24"), "{picture}");
}

#[test]
fn without_a_terminal_the_table_fits_80_columns() {
    let dir = folder();
    let args = [
        "--controller=switching",
        "--controller=fixed",
        "--set=episode.end_early=false",
    ];
    let text =
        stdout(&standfast(dir.path(), &short(&[&[FEW, "--full"][..], &args].concat())).success());
    let (_, tables) = text.split_once("controller ").unwrap();
    let (tables, _) = tables.split_once("to replay a trial").unwrap();
    // A row with two such names takes 86 columns, since no name and no number is broken.
    assert!(
        tables.lines().all(|line| line.chars().count() <= 86),
        "{tables}"
    );
    assert!(
        text.contains("seed 1") && text.contains("fell:") && !text.contains("varied:"),
        "{text}"
    );
    let text = stdout(
        &standfast(
            folder().path(),
            &short(&[FEW, "--full", "--set=variations.mass_scale=1.1"]),
        )
        .success(),
    );
    assert!(text.contains("varied: mass_scale 1.1\n"), "{text}");
}

/// Pages of telling trials exist, are linked, and are removed when the trials change.
#[test]
fn a_result_has_replays_of_telling_trials() {
    let dir = folder();
    let args = short(&[
        SEVERAL_PARTS,
        "--controller=switching",
        "--set=push.impulse_n_s={uniform=[0, 6]}",
    ]);
    let asked = |replays: &'static str| [&args[..], &[replays]].concat();
    standfast(dir.path(), &asked("--replays=0")).success();
    let out = dir.path().join("out");
    let report = || fs::read_to_string(out.join("report.html")).unwrap();
    assert!(!out.join("replays").exists() && !report().contains("watch in 3D"));

    let said = stderr(&standfast(dir.path(), &asked("--replays=3")).success());
    let (pages, pictures): (Vec<String>, Vec<String>) = files(&out.join("replays"))
        .into_keys()
        .partition(|name| name.ends_with(".html"));
    assert!(
        said.contains(&format!("{} replays of telling trials", pages.len())),
        "{said}"
    );
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    for set in summary["controllers"].as_array().unwrap() {
        let (name, telling) = (
            set["name"].as_str().unwrap(),
            set["telling"].as_array().unwrap(),
        );
        assert!(telling.len() > 3, "{telling:?}");
        // The easiest lost trial may also be the lost trial nearest to the limit.
        let survived = telling
            .iter()
            .position(|trial| trial["survived"] == true)
            .unwrap();
        assert!([1, 2].contains(&survived), "{telling:?}");
        for trial in &telling[..3] {
            let page = format!("trial-{}-{name}.html", trial["trial"]);
            assert!(pages.contains(&page), "{pages:?}");
            assert!(
                report().contains(&format!("href=\"replays/{page}\"")),
                "{page} is not linked"
            );
        }
    }
    assert_eq!(
        (pages.len(), pictures.len()),
        (6, 6),
        "{pages:?} {pictures:?}"
    );
    assert_eq!(
        report()
            .matches("<img src=\"data:image/svg+xml;base64,")
            .count(),
        6
    );

    // The same page is made by hand, with the controller that lost the trial.
    let lost = summary["controllers"][0]["telling"][0]["trial"].to_string();
    let page = |trial: &str, set: &str| {
        fs::read_to_string(out.join(format!("replays/trial-{trial}-{set}.html"))).unwrap()
    };
    let before = page(&lost, "hold");
    let told = standfast(
        dir.path(),
        &["replay", "out", "--trial", &lost, "--replay=page.html"],
    )
    .success();
    assert!(
        stderr(&told).contains("written: page.html"),
        "{}",
        stderr(&told)
    );
    let pushed = [
        "push",
        "--campaign=out/campaign.toml",
        "--trial",
        &lost,
        "--controller=hold",
    ];
    assert_eq!(
        stdout(&told),
        stdout(&standfast(dir.path(), &pushed).success())
    );
    let by_hand = fs::read_to_string(dir.path().join("page.html")).unwrap();
    let poses = |page: &str| {
        page.split("<script")
            .find(|part| part.contains("application/json"))
            .map(str::to_string)
    };
    assert!(
        poses(&by_hand).is_some_and(|poses| poses.len() > 10_000),
        "a page without poses"
    );
    assert_eq!(poses(&by_hand), poses(&before));

    // The trial is the same if it is watched for longer.
    let longer = [
        "replay",
        "out",
        "--trial",
        &lost,
        "--controller=hold",
        "--replay=page.html",
        "--trace=trace.csv",
    ];
    let said = stderr(&standfast(dir.path(), &longer).success());
    assert!(
        said.contains("written: page.html") && !said.contains("not as it was"),
        "{said}"
    );

    // With another build or other inputs the trial is another one, and the program says so.
    forge_manifest(&out, |manifest| manifest.campaign.seed += 1);
    let refused = stderr(
        &standfast(
            dir.path(),
            &["replay", "out", "--trial=0", "--controller=hold"],
        )
        .code(3),
    );
    assert!(
        refused.contains("trial 0 of hold: impulse_n_s = ") && refused.contains("is not what seed"),
        "{refused}"
    );
    forge_manifest(&out, |manifest| manifest.campaign.seed -= 1);
    // The trial then ends at another time, whether the robot stands or not.
    let ends = |horizon_s: f64, standing_time_s: f64| {
        forge_manifest(&out, |manifest| {
            manifest.campaign.episode.horizon_s = horizon_s;
            manifest.campaign.episode.judge.standing_time_s = standing_time_s;
        });
    };
    ends(0.6, 0.05);
    let telling = summary["controllers"][0]["telling"].as_array().unwrap();
    let won = telling
        .iter()
        .find(|trial| trial["survived"] == true)
        .unwrap()["trial"]
        .to_string();
    let warned = stderr(
        &standfast(
            dir.path(),
            &["replay", "out", "--trial", &won, "--controller=hold"],
        )
        .success(),
    );
    assert!(
        warned.contains(&format!("trial {won} of hold is not as it was: ")),
        "{warned}"
    );
    assert!(
        page(&won, "hold").contains("is not as it was"),
        "the page does not say so"
    );
    ends(0.4, 0.1);

    // The trials are computed again, so other trials may be telling.
    fs::remove_file(out.join("parts/part-000001.parquet")).unwrap();
    standfast(dir.path(), &asked("--replays=0")).success();
    assert!(
        !out.join("replays").join(&pages[0]).exists(),
        "a page of another result"
    );
    for (args, code, words) in [
        (
            ["replay", "out", "--trial=99"],
            2,
            "--trial = 99: the campaign has no such trial; accepted: 0 to 25",
        ),
        (
            ["replay", "nothing", "--trial=0"],
            3,
            "nothing: there is no such folder",
        ),
        (
            ["replay", "out/parts", "--trial=0"],
            3,
            "is not the folder of a campaign",
        ),
    ] {
        let message = stderr(&standfast(dir.path(), &args).code(code));
        assert!(message.contains(words), "{message}");
    }
    let message = stderr(
        &standfast(
            dir.path(),
            &["replay", "out", "--trial=0", "--controller=other"],
        )
        .code(2),
    );
    assert!(
        message.contains("controller \"other\" not found; accepted: hold, switching"),
        "{message}"
    );
}

#[cfg(feature = "mujoco")]
#[test]
fn a_trial_is_replayed_in_another_engine_and_beside_itself_in_it() {
    let dir = folder();
    standfast(dir.path(), &short(&[FEW, "--replays=0"])).success();
    let replay = |more: &[&str]| {
        let args = [&["replay", "out", "--trial=1", "--replay=a.html"], more].concat();
        standfast(dir.path(), &args).success()
    };
    let told = stderr(&replay(&["--controller=hold@mujoco"]));
    assert!(
        told.contains("This trial of hold@mujoco is not in the result"),
        "{told}"
    );
    let page = fs::read_to_string(dir.path().join("a.html")).unwrap();
    assert!(!page.contains("id=\"parting\""));

    let both = ["--controller=hold", "--controller=hold@mujoco"];
    let run = replay(&both);
    let (text, told) = (stdout(&run), stderr(&run));
    assert!(
        text.starts_with("solid       hold") && text.contains("\nghost       hold@mujoco"),
        "{text}"
    );
    assert!(!told.contains("not as it was"), "{told}");
    let json = |more: &[&str]| -> serde_json::Value {
        serde_json::from_str(&stdout(&replay(&[&["--json"], more].concat()))).unwrap()
    };
    let (both, alone) = (json(&both), json(&["--controller=hold@mujoco"]));
    assert_eq!(json(&[])["outcome"], both["outcome"]);
    assert_eq!(
        (&both["ghost"]["end_s"], &both["ghost"]["outcome"]),
        (&alone["end_s"], &alone["outcome"])
    );
}

/// `standfast docs columns` has every column of trials and of traces, and no other.
#[test]
fn every_column_is_explained() {
    let dir = folder();
    standfast(
        dir.path(),
        &[
            "run",
            "smoke",
            "--trials=1",
            "--controller=catch",
            "--out=out",
            "--replays=0",
            "--set=push.pendulum={mass_kg=1, rope_m=1.75, draw_m=0.2}",
        ],
    )
    .success();
    standfast(
        dir.path(),
        &[
            "push",
            "--pendulum=3kg,1.75m",
            "--draw=1",
            "--trace=t.csv",
            "--set=episode.horizon_s=1",
        ],
    )
    .success();
    let of_file = |path: &str| {
        let names = csv::Reader::from_path(dir.path().join(path))
            .unwrap()
            .headers()
            .unwrap()
            .clone();
        names
            .iter()
            .map(String::from)
            .collect::<std::collections::BTreeSet<_>>()
    };
    let part = dir.path().join("out/parts/part-000000.parquet");
    let trials = rows(&part).remove(0).into_keys().collect();
    let told = stdout(&standfast(dir.path(), &["docs", "columns"]).success());
    assert!(
        told.lines().all(|line| line.chars().count() <= 80),
        "{told}"
    );
    let (of_trials, of_traces) = told.split_once("Traces\n").unwrap();
    let robot = standfast::robots::load("ut-mu2").unwrap();
    // `com_[xyz]_m` stands for three columns, SIDE for two, and JOINT for one of each joint.
    let each = |name: &str| -> Vec<String> {
        let joints = robot
            .joints
            .iter()
            .map(|joint| name.replace("JOINT", &joint.name));
        let names = if name.contains("JOINT") {
            joints.collect()
        } else {
            vec![name.to_string()]
        };
        let sides = |name: String| ["left", "right"].map(|side| name.replace("SIDE", side));
        let axes = |name: String| match name
            .split_once('[')
            .and_then(|(a, rest)| Some((a, rest.split_once(']')?)))
        {
            Some((before, (axes, after))) => axes
                .chars()
                .map(|axis| format!("{before}{axis}{after}"))
                .collect(),
            None => vec![name],
        };
        names.into_iter().flat_map(sides).flat_map(axes).collect()
    };
    let listed = |text: &str| {
        let lines = text
            .lines()
            .filter(|line| line.starts_with(' ') && !line.starts_with("  "));
        lines
            .flat_map(|line| each(line.split_whitespace().next().unwrap()))
            .collect::<std::collections::BTreeSet<_>>()
    };
    assert_eq!(listed(of_trials), trials);
    assert_eq!(listed(of_traces), of_file("t.csv"));
}
