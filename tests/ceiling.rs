//! `standfast ceiling`: a search catches pushes that the controller loses, and its recoveries can be repeated.

use crate::common::program::{files, folder, standfast, stderr, stdout};
use serde_json::Value;
use std::fs;

/// A push that `catch` loses, and that a search catches with few tries.
const LOST: [&str; 4] = [
    "ceiling",
    "nominal",
    "--set=push.impulse_n_s=4.4",
    "--set=push.heading_deg=100",
];

#[test]
#[ignore = "searches for a quarter of a minute"]
fn a_lost_push_is_caught_and_can_be_repeated() {
    let dir = folder();
    let search = |more: &[&str]| stdout(&standfast(dir.path(), &[&LOST, more].concat()).success());
    let few = ["--trials=1", "--tries=48", "--json"];
    let json = search(&[&few[..], &["--threads=1", "--out=found"]].concat());
    assert_eq!(
        json,
        search(&[&few[..], &["--threads=2"]].concat()),
        "threads change nothing"
    );
    let found: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        [
            &found["alone"]["recovered"],
            &found["with_search"]["recovered"]
        ],
        [0, 1],
        "{json}"
    );
    assert_eq!(
        fs::read_to_string(dir.path().join("found/ceiling.json")).unwrap(),
        json
    );
    let lost = &found["lost"][0];
    assert!(
        lost["fell_at_s"].as_f64().unwrap() > 0.5 && lost["tries"].as_u64().unwrap() <= 48,
        "{lost}"
    );
    assert!(lost["of_n_step_bound"].as_f64() < lost["of_one_step_bound"].as_f64());

    // The written gain set catches the push with the same footsteps, and the controller itself does not.
    let push = |gains: &str| -> Value {
        let args = [
            "push",
            "nominal",
            "--trial=0",
            "--impulse=4.4",
            "--heading=100",
            "--json",
            "--controller",
            gains,
        ];
        serde_json::from_str(&stdout(&standfast(dir.path(), &args).success())).unwrap()
    };
    assert_eq!(push("catch")["outcome"], "Fell");
    let caught = push("found/trial-0.toml");
    assert_eq!(caught["outcome"], "Recovered", "{caught}");
    assert_eq!(caught["footsteps"], lost["found"]["footsteps"], "{caught}");
    // It is no luck: it holds for pushes that are a little weaker and harder, and earlier and later.
    let held = lost["found"]["held"].as_u64().unwrap();
    assert!((6..=8).contains(&held), "{lost}");
    assert!(
        lost["most_held"].as_u64().unwrap() >= 6 && lost["alone_held"].as_u64().unwrap() < 6,
        "{lost}"
    );

    assert_eq!(search(&[&few[..], &["--out=found"]].concat()), json);
    let other = stderr(
        &standfast(
            dir.path(),
            &[&LOST[..], &["--trials=2", "--out=found"]].concat(),
        )
        .code(3),
    );
    assert!(
        other.contains("found: holds another search: trials is 1 there and 2 here"),
        "{other}"
    );
}

/// The files of a search, whole, killed and continued, or in shards that end with the last one.
#[test]
#[ignore = "kills a search, a quarter of a minute"]
fn kills_and_shards_change_nothing() {
    let dir = folder();
    let args = |more: &[&'static str]| {
        let pushes = [
            "--set=push.impulse_n_s={uniform=[1, 30]}",
            "--set=push.heading_deg=90",
        ];
        [
            &["ceiling", "nominal", "--trials=4", "--tries=1", "--json"],
            &pushes[..],
            more,
        ]
        .concat()
    };
    let json = stdout(&standfast(dir.path(), &args(&["--threads=1", "--out=whole"])).success());
    let whole = files(&dir.path().join("whole"));
    assert!(json.contains("\"recovered\": ") && whole["ceiling.json"] == json.as_bytes());
    assert!(
        whole.contains_key("parts/trial-4-of-4.json"),
        "{:?}",
        whole.keys()
    );

    let mut child = std::process::Command::new(crate::common::PROGRAM)
        .current_dir(dir.path())
        .args(args(&["--out=killed"]))
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    while !dir.path().join("killed/parts").exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(
        stdout(&standfast(dir.path(), &args(&["--out=killed"])).success()),
        json
    );
    let mut killed = files(&dir.path().join("killed"));
    killed.retain(|name, _| !name.contains(".tmp-"));
    assert!(killed == whole, "{:?}", killed.keys());

    let first = stdout(&standfast(dir.path(), &args(&["--shard=1/2", "--out=shards"])).success());
    assert!(first.contains("\"missing_shards\": \"2\""), "{first}");
    assert_eq!(
        stdout(&standfast(dir.path(), &args(&["--shard=2/2", "--out=shards"])).success()),
        json
    );
    assert!(files(&dir.path().join("shards")) == whole);
}

/// With one generation of tries, nothing may be found. The text then says so, and claims no proof.
#[test]
fn what_is_not_found_is_told_as_that() {
    let dir = folder();
    let hard = [
        "ceiling",
        "nominal",
        "--set=push.impulse_n_s=30",
        "--set=push.heading_deg=90",
        "--trials=1",
        "--tries=1",
    ];
    let words = |told: String| told.split_whitespace().collect::<Vec<_>>().join(" ");
    let told = words(stdout(&standfast(dir.path(), &hard).success()));
    assert!(
        told.contains("not recovered by search") && told.contains("0 of 1 (0.0 %"),
        "{told}"
    );
    assert!(
        told.contains("may be possible all the same") && !told.contains("to see one"),
        "{told}"
    );
    let easy = [&hard[..2], &["--set=push.impulse_n_s=1", "--trials=3"]].concat();
    let told = words(stdout(&standfast(dir.path(), &easy).success()));
    assert!(
        told.contains("catch recovers from 3 of 3 (100.0 %") && told.contains("from 0 more"),
        "{told}"
    );
}

#[test]
fn what_is_wrong_is_said_before_anything_runs() {
    let dir = folder();
    for (args, words) in [
        (
            &["--controller=paper"][..],
            "--controller = paper: has no table [catching]; accepted: a gain set with the table [catching]",
        ),
        (
            &["--controller=catch", "--controller=paper"],
            "--controller = catch, paper: is more than one entrant; accepted: one, such as catch or catch@mujoco",
        ),
        (
            &["--tries=0"],
            "'0' for '--tries <N>': out of range; accepted: a whole number from 1 to 1000000",
        ),
        (
            &["--engine=both"],
            "--controller = catch@rapier, catch@mujoco: is more than one entrant",
        ),
    ] {
        let message = stderr(&standfast(dir.path(), &[&["ceiling"], args].concat()).code(2));
        assert!(message.contains(words), "{message}");
    }
    // Departures in a gain set are checked like its other values.
    let catch = fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/controllers/catch.toml"
    ))
    .unwrap();
    for (departures, words) in [
        (
            "[[catching.departures]]\nlift = 0.5\n".to_string(),
            "catching.departures[0] = [0.5, ",
        ),
        (
            "[[catching.departures]]\nhop = 1\n".into(),
            "unknown field `hop`",
        ),
        (
            "[[catching.departures]]\nslower = 0.1\n".repeat(5),
            "catching.departures = 5: too many; accepted: up to 4 footsteps",
        ),
    ] {
        fs::write(dir.path().join("mine.toml"), format!("{catch}{departures}")).unwrap();
        let message = stderr(&standfast(dir.path(), &["push", "--controller=mine.toml"]).code(2));
        assert!(
            message.contains("mine.toml: ") && message.contains(words),
            "{message}"
        );
    }
}
