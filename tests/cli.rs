//! The program from outside: exit codes, messages, and that results are the same bytes whatever happened on the way.

use assert_cmd::Command;
use std::{collections::BTreeMap, fs, path::Path};
use tempfile::TempDir;

/// A campaign with little to simulate.
const SHORT: [&str; 8] = [
    "run",
    "smoke",
    "--gains=hold",
    "--set=episode.horizon_s=0.4",
    "--set=episode.judge.standing_time_s=0.1",
    "--set=push.start_s=0.05",
    "--set=push.impulse_n_s={uniform=[0, 4]}",
    "--out=out",
];
/// How many trials: one part of a campaign, and two.
const FEW: &str = "--trials=3";
const TWO_PARTS: &str = "--trials=26";

fn standfast(folder: &Path, args: &[&str]) -> assert_cmd::assert::Assert {
    Command::cargo_bin("standfast").unwrap().current_dir(folder).args(args).assert()
}

/// The short campaign with further arguments.
fn short<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SHORT[..], more].concat()
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// Every file under a folder, by path.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() {
            found.extend(files(&entry.path()).into_iter().map(|(k, v)| (format!("{name}/{k}"), v)));
        } else {
            found.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    found
}

fn stdout(assert: &assert_cmd::assert::Assert) -> String {
    String::from_utf8(assert.get_output().stdout.clone()).unwrap()
}

fn stderr(assert: &assert_cmd::assert::Assert) -> String {
    String::from_utf8(assert.get_output().stderr.clone()).unwrap()
}

/// Runs the short campaign in a new folder with further arguments and gives what it wrote.
fn result_of(more: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let dir = folder();
    standfast(dir.path(), &short(more)).success();
    files(&dir.path().join("out"))
}

#[test]
fn bad_input_is_one_clear_error_and_nothing_is_written() {
    let good = "name = 'c'\ntrials = 2\nseed = 1\n[push]\nimpulse_n_s = 1\n";
    let cases: &[(&str, &[&str], &[&str])] = &[
        (good, &["run", "missing.toml"], &["missing.toml: cannot read"]),
        (good, &["run", "smokey"], &["campaign \"smokey\" not found", "smoke, nominal, standard, harsh or a path"]),
        ("name = 'c\n", &["run", "c.toml"], &["c.toml", "line 1"]),
        ("names = 'c'\n", &["run", "c.toml"], &["c.toml", "unknown field `names`", "`name`"]),
        ("name = 'c'\n", &["run", "c.toml"], &["c.toml", "missing field `trials`"]),
        (&good.replace("s = 1\n", "s = -1\n"), &["run", "c.toml"], &["c.toml: push.impulse_n_s = -1", "0 to 10000"]),
        (good, &["run", "c.toml", "--set", "push.impulse_n_s=-2"], &["push.impulse_n_s = -2", "0 to 10000"]),
        (good, &["run", "c.toml", "--set", "push.impulse=2"], &["--set: push.impulse", "push.impulse_n_s"]),
        (good, &["run", "c.toml", "--trials", "0"], &["trials = 0", "1 to"]),
        (good, &["run", "c.toml", "--gains", "best"], &["gain set \"best\" not found", "hold, fixed, switching"]),
        (good, &["run", "c.toml", "--gains", "best.toml"], &["best.toml: cannot read"]),
        (good, &["run", "c.toml", "--gains=hold", "--gains=hold"], &["two gain sets of this name"]),
        (good, &["run", "c.toml", "--vary", "hold"], &["--vary = hold", "SET:KEY=V1,V2"]),
        (good, &["run", "c.toml", "--vary", "hold:zmp=1"], &["--vary", "unknown field `zmp`", "`zmp_margin_m`"]),
        (good, &["run", "c.toml", "--vary", "best:zmp=1"], &["gain set \"best\" not found", "switching"]),
        (good, &["run", "c.toml", "--vary", "hold:zmp_margin_m=1,1"], &["two gain sets of this name"]),
        (good, &["push", "--impulse=1", "--gains=fixed:gains.1.x=[1,1,5]"], &["no `gains.1`", "gains.0 to gains.0"]),
        (good, &["run", "c.toml", "--robot", "r2d2"], &["robot \"r2d2\" not found", "ut-mu2"]),
        (good, &["run", "c.toml", "--shard", "5/4"], &["--shard", "1 <= k <= n"]),
        (good, &["run", "c.toml", "--trails", "5"], &["--trails"]),
        (good, &["push", "--impulse=1", "--trace=a.txt"], &["--trace = a.txt", "ends in .csv or .parquet"]),
        (good, &["push", "--impulse=1", "--plot=a.png"], &["--plot = a.png", "ends in .svg"]),
        (good, &["push", "--impulse=1", "--trace=a.csv", "--plot=no/a.svg"], &["--plot = no/a.svg", "does not exist"]),
        (good, &["response", "--gains", "hold"], &["--gains = hold", "a gain set with gains"]),
        (good, &["response", "--amplitude", "-1"], &["--amplitude = -1", "to 0.05"]),
        (good, &["walk"], &["walk"]),
    ];
    for (text, args, expected) in cases {
        let dir = folder();
        fs::write(dir.path().join("c.toml"), text).unwrap();
        let run = standfast(dir.path(), args).code(2);
        let message = stderr(&run);
        assert!(message.starts_with("error: ") && stdout(&run).is_empty(), "{args:?}: {message}");
        for part in *expected {
            assert!(message.contains(part), "{args:?}: {part:?} not in {message}");
        }
        assert_eq!(files(dir.path()).len(), 1, "{args:?} wrote something");
    }
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let one = result_of(&[TWO_PARTS, "--threads=1"]);
    assert_eq!(one.len(), 9, "{:?}", one.keys());
    for name in ["campaign.toml", "summary.json", "trials.parquet", "success.svg", "parts/part-000001.csv"] {
        assert!(one.contains_key(name), "{name} in {:?}", one.keys());
    }
    assert!(one == result_of(&[TWO_PARTS, "--threads=2"]), "two threads wrote something else");
}

#[test]
fn shards_merge_and_resume_end_in_the_same_bytes() {
    let whole = result_of(&[TWO_PARTS]);
    let dir = folder();
    let out = dir.path().join("out");
    standfast(dir.path(), &short(&[TWO_PARTS, "--shard=2/2"])).success();
    assert!(!out.join("trials.parquet").exists() && !out.join("summary.json").exists());
    let status = standfast(dir.path(), &["status", "out"]).code(3);
    assert!(stdout(&status).contains("missing: trials 0-24"), "{}", stdout(&status));
    let merge = standfast(dir.path(), &["merge", "out"]).code(3);
    assert!(stderr(&merge).contains("standfast run out/campaign.toml --out out"), "{}", stderr(&merge));
    // The command that was just printed.
    let run = standfast(dir.path(), &["run", "out/campaign.toml", "--out", "out"]).success();
    assert!(stderr(&run).contains("goes on, 1 of 2 parts"), "{}", stderr(&run));
    assert!(files(&out) == whole, "resumed");
    fs::remove_file(out.join("summary.json")).unwrap();
    standfast(dir.path(), &["status", "out"]).success();
    standfast(dir.path(), &["merge", "out"]).success();
    assert!(files(&out) == whole, "merged");
}

#[test]
fn a_damaged_part_is_noticed_and_computed_again() {
    let dir = folder();
    let out = dir.path().join("out");
    standfast(dir.path(), &short(&[FEW])).success();
    let whole = files(&out);
    let part = out.join("parts/part-000000.csv");
    let mut bytes = fs::read(&part).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&part, bytes).unwrap();
    standfast(dir.path(), &["merge", "out"]).code(3);
    standfast(dir.path(), &short(&[FEW])).success();
    assert!(files(&out) == whole);
}

#[test]
fn a_result_is_kept_printed_again_and_never_overwritten() {
    let dir = folder();
    let first = standfast(dir.path(), &short(&[FEW])).success();
    let whole = files(&dir.path().join("out"));
    let again = standfast(dir.path(), &short(&[FEW])).success();
    assert!(stderr(&again).contains("nothing is computed again"), "{}", stderr(&again));
    assert_eq!(stdout(&first), stdout(&again));
    let other = standfast(dir.path(), &short(&[FEW, "--seed=9"])).code(3);
    assert!(stderr(&other).contains("another campaign"), "{}", stderr(&other));
    assert!(files(&dir.path().join("out")) == whole);
    fs::create_dir(dir.path().join("thesis")).unwrap();
    fs::write(dir.path().join("thesis/main.tex"), "").unwrap();
    standfast(dir.path(), &["run", "smoke", "--trials=1", "--out=thesis"]).code(3);
    assert_eq!(files(&dir.path().join("thesis")).len(), 1);
}

#[test]
fn the_default_folder_makes_way_for_another_campaign() {
    let dir = folder();
    let args: Vec<&str> = short(&[FEW]).into_iter().filter(|arg| !arg.starts_with("--out")).collect();
    standfast(dir.path(), &args).success();
    let first = files(&dir.path().join("standfast-results/smoke"));
    let other: Vec<&str> = args.iter().copied().chain(["--seed=9"]).collect();
    standfast(dir.path(), &other).success();
    let results = dir.path().join("standfast-results");
    let mut names: Vec<String> =
        fs::read_dir(&results).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names.len(), 2);
    assert!(names[0] == "smoke" && names[1].starts_with("smoke-") && names[1].len() == 14, "{names:?}");
    assert!(files(&results.join("smoke")) == first);
}

#[test]
fn json_is_one_object_and_all_else_goes_to_the_standard_error() {
    let dir = folder();
    let run = standfast(dir.path(), &short(&[FEW, "--json"])).success();
    let summary: serde_json::Value = serde_json::from_str(&stdout(&run)).unwrap();
    let set = &summary["sets"][0];
    assert_eq!((set["name"].as_str(), set["trials"].as_u64()), (Some("hold"), Some(3)));
    let total: u64 = ["recovered", "fell", "diverged", "timed_out"].iter().map(|k| set[k].as_u64().unwrap()).sum();
    assert_eq!(total, 3);
    assert_eq!(summary["config_hash"].as_str().unwrap().len(), 64);
    assert_eq!(fs::read_to_string(dir.path().join("out/summary.json")).unwrap(), stdout(&run));
    let status: serde_json::Value =
        serde_json::from_str(&stdout(&standfast(dir.path(), &["status", "out", "--json"]).success())).unwrap();
    assert_eq!(status["complete"], true);
}

/// The columns of a trial that `push` reports too, as JSON values: outcome and all times and peaks.
const REPLAYED: [&str; 14] = [
    "outcome",
    "end_s",
    "fell_at_s",
    "fall_cause",
    "settled_at_s",
    "home_at_s",
    "peak_tilt_deg",
    "peak_torque_n_m",
    "peak_joint_speed_rad_s",
    "peak_dcm_outside_m",
    "left_sets_at_s",
    "set_after_push",
    "cpi_margin_after_push",
    "cpi_margin_after_push_est",
];

/// A part of a campaign, one object per row; numbers are read as the numbers that they are, to the bit.
fn rows(part: &Path) -> Vec<BTreeMap<String, serde_json::Value>> {
    let mut reader = csv::Reader::from_path(part).unwrap();
    let names = reader.headers().unwrap().clone();
    let value = |text: &str| match text {
        "" => serde_json::Value::Null,
        text => text.parse::<f64>().map_or(text.into(), serde_json::Value::from),
    };
    let row = |row: csv::StringRecord| names.iter().map(String::from).zip(row.iter().map(value)).collect();
    reader.records().map(|record| row(record.unwrap())).collect()
}

#[test]
fn a_trial_is_replayed_to_the_bit() {
    let dir = folder();
    let gains = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/gains/switching.toml")).unwrap();
    fs::write(dir.path().join("file.toml"), gains.replace("name = \"switching\"", "name = \"mine\"")).unwrap();
    let args = [
        "--trials=2",
        "--set=push.impulse_n_s={uniform=[0.2, 5]}",
        "--set=episode.horizon_s=2",
        "--set=push.start_s=0.1",
    ];
    let gains = ["--gains=hold", "--gains=file.toml"];
    for more in [
        ["standard", "--set=episode.end_early=true", "--out=a"],
        ["standard", "--set=episode.end_early=false", "--out=b"],
        ["harsh", "--set=second_push.after_s=0.1", "--out=c"],
    ] {
        let out = more[2].trim_start_matches("--out=");
        let run = [&["run", "--seed=5"][..], &gains, &args, &more[..]].concat();
        standfast(dir.path(), &run).success();
        let rows = rows(&dir.path().join(out).join("parts/part-000000.csv"));
        assert_eq!(rows.len(), 4);
        assert!(more[0] == "harsh" || rows.iter().any(|row| row["outcome"] == "Recovered"));
        for row in rows {
            let (trial, set) = (row["trial"].as_f64().unwrap().to_string(), row["set"].as_str().unwrap());
            // The name is enough for a set that is a file: the result has a copy.
            let campaign = format!("{out}/campaign.toml");
            let args = ["push", "--json", "--campaign", &campaign, "--trial", &trial, "--gains", set];
            let replay: serde_json::Value =
                serde_json::from_str(&stdout(&standfast(dir.path(), &args).success())).unwrap();
            for name in REPLAYED {
                assert_eq!(row[name], replay[name], "{name} of trial {trial}, {set}");
            }
            let varied = replay["variation"].as_object().unwrap();
            assert!(varied.len() >= 8 && varied.iter().all(|(name, value)| row[name] == *value), "{row:?} {varied:?}");
            assert_eq!(row["second_impulse_n_s"], replay["second_push"]["impulse_n_s"]);
            assert_eq!(row["second_impulse_n_s"].is_null(), more[0] == "standard");
        }
    }
}

#[test]
fn a_push_is_drawn_and_traced_beside_its_json() {
    let dir = folder();
    let push = ["push", "--gains=hold", "--impulse=4", "--start=0.1", "--horizon=1.5", "--json"];
    let plain = standfast(dir.path(), &push).success();
    let fell: serde_json::Value = serde_json::from_str(&stdout(&plain)).unwrap();
    assert_eq!(fell["outcome"], "Fell");
    let both = standfast(dir.path(), &[&push[..], &["--plot=a.svg", "--trace=a.csv"]].concat()).success();
    let alone = standfast(dir.path(), &[&push[..], &["--plot=b.svg"]].concat()).success();
    assert_eq!(stdout(&both), stdout(&alone));
    let longer: serde_json::Value = serde_json::from_str(&stdout(&both)).unwrap();
    assert_eq!((&longer["fell_at_s"], longer["end_s"].as_f64()), (&fell["fell_at_s"], Some(1.5)));
    let written = files(dir.path());
    assert_eq!(written.keys().collect::<Vec<_>>(), ["a.csv", "a.svg", "b.svg"]);
    assert!(written["a.svg"] == written["b.svg"]);
    let svg = String::from_utf8_lossy(&written["a.svg"]);
    let title = format!("4 N s towards 0 degrees, gain set hold: fell at {:.2} s", fell["fell_at_s"].as_f64().unwrap());
    assert!(svg.starts_with("<svg") && svg.contains(&title), "{title:?} in {svg:.600}");
    let times: Vec<f64> = svg.lines().filter_map(|line| line.parse().ok()).filter(|t| *t > 0.0 && *t < 2.0).collect();
    let last = times.iter().copied().fold(0.0, f64::max);
    assert!((0.3..=longer["fell_at_s"].as_f64().unwrap()).contains(&last), "the picture ends with the fall: {times:?}");
}

#[test]
fn a_sweep_resumes_merges_and_replays_like_any_campaign() {
    let dir = folder();
    let (mine, out) = (dir.path().join("mine.toml"), dir.path().join("out"));
    let gains = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/gains/switching.toml")).unwrap();
    fs::write(&mine, gains.replace("name = \"switching\"", "name = \"mine\"")).unwrap();
    let sweep = ["--vary=mine.toml:zmp_margin_m=0.001,0.02", "--vary=fixed:gains.0.x=[0.8,1,5]", TWO_PARTS];
    standfast(dir.path(), &short(&sweep)).success();
    let whole = files(&out);
    let campaign = String::from_utf8(whole["campaign.toml"].clone()).unwrap();
    let listed = r#"gains = ["hold", "inputs/gains/mine.toml:zmp_margin_m=0.001", "inputs/gains/mine.toml:zmp_margin_m=0.02", "fixed:gains.0.x=[0.8,1,5]"]"#;
    assert!(campaign.contains(listed), "{campaign}");
    assert_eq!(whole.keys().filter(|name| name.starts_with("inputs/")).collect::<Vec<_>>(), ["inputs/gains/mine.toml"]);

    for share in ["--shard=1/2", "--shard=2/2"] {
        let args = short(&[&sweep[..], &["--out=shards", share]].concat());
        let args: Vec<&str> = args.into_iter().filter(|arg| *arg != "--out=out").collect();
        standfast(dir.path(), &args).success();
    }
    standfast(dir.path(), &["merge", "shards"]).success();
    assert!(files(&dir.path().join("shards")) == whole, "merged");
    // The result has its own copy of the gain set.
    fs::remove_file(&mine).unwrap();
    fs::remove_file(out.join("parts/part-000001.json")).unwrap();
    let run = standfast(dir.path(), &["run", "out/campaign.toml", "--out", "out"]).success();
    assert!(stderr(&run).contains("goes on, 1 of 2 parts"), "{}", stderr(&run));
    assert!(files(&out) == whole, "resumed");

    let rows = rows(&out.join("parts/part-000001.csv"));
    let sets: Vec<&str> = rows.iter().map(|row| row["set"].as_str().unwrap()).collect();
    assert_eq!(sets, ["hold", "mine zmp_margin_m=0.001", "mine zmp_margin_m=0.02", "fixed x=[0.8,1,5]"]);
    assert_ne!(rows[1]["cpi_margin_after_push"], rows[2]["cpi_margin_after_push"], "a variant is another set");
    // By the name in the results, and as a list has it, where the file goes by the name of its set.
    let asked = [sets[1], sets[2], sets[3], "mine:zmp_margin_m=0.02", "fixed:gains.0.x=[0.8,1,5]"];
    for (set, row) in asked.into_iter().zip([1, 2, 3, 2, 3].map(|i| &rows[i])) {
        let args = ["push", "--json", "--campaign=out/campaign.toml", "--trial=25", "--gains", set];
        let replay: serde_json::Value = serde_json::from_str(&stdout(&standfast(dir.path(), &args).success())).unwrap();
        for name in REPLAYED {
            assert_eq!(row[name], replay[name], "{name} of {set}");
        }
    }
}

#[test]
fn a_sweep_alone_replaces_the_gain_sets_and_many_sets_stay_within_80_columns() {
    let dir = folder();
    let sweep = "--vary=switching:zmp_margin_m=0.001,0.002,0.003,0.004,0.005,0.006,0.007,0.008,0.009,0.01,0.011,0.012";
    let args: Vec<&str> = short(&[FEW, sweep]).into_iter().filter(|arg| *arg != "--gains=hold").collect();
    let text = stdout(&standfast(dir.path(), &args).success());
    let (_, tables) = text.split_once("gain set ").unwrap();
    let (tables, _) = tables.split_once("95 % intervals").unwrap();
    assert!(tables.lines().all(|line| line.chars().count() <= 80), "{tables}");
    assert!(!tables.contains("hold   "), "{tables}");
    // Whole in most tables, not cut into pieces.
    assert!(tables.matches("zmp_margin_m=0.012").count() >= 4, "{tables}");
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(dir.path().join("out/summary.json")).unwrap()).unwrap();
    assert_eq!(summary["sets"].as_array().unwrap().len(), 12);
    let picture = fs::read_to_string(dir.path().join("out/success.svg")).unwrap();
    assert!(picture.contains("switching zmp_margin_m=0.012"), "{picture}");
}

#[test]
fn without_a_terminal_the_table_fits_80_columns() {
    let dir = folder();
    let args = ["--gains=switching", "--gains=fixed", "--set=episode.end_early=false"];
    let text = stdout(&standfast(dir.path(), &short(&[&[FEW][..], &args].concat())).success());
    let (_, tables) = text.split_once("gain set ").unwrap();
    let (tables, _) = tables.split_once("95 % intervals").unwrap();
    assert!(tables.lines().all(|line| line.chars().count() <= 80), "{tables}");
    assert!(text.contains("seed 1") && text.contains("fell:") && !text.contains("varied:"), "{text}");
    let text = stdout(&standfast(folder().path(), &short(&[FEW, "--set=variations.mass_scale=1.1"])).success());
    assert!(text.contains("varied: mass_scale 1.1\n"), "{text}");
}

#[test]
fn inputs_from_files_are_kept_with_the_result() {
    let dir = folder();
    let campaign = "name='c'\ngains=['../g/mine.toml']\ntrials=1\nseed=1\n[episode]\nhorizon_s=0.6\n[push]\nimpulse_n_s=0\nstart_s=0\n";
    let hold = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/gains/hold.toml")).unwrap();
    for sub in ["c", "g"] {
        fs::create_dir(dir.path().join(sub)).unwrap();
    }
    fs::write(dir.path().join("c/c.toml"), campaign).unwrap();
    fs::write(dir.path().join("g/mine.toml"), &hold).unwrap();
    standfast(dir.path(), &["run", "c/c.toml", "--out=out"]).success();
    let kept: Vec<_> = fs::read_dir(dir.path().join("out/inputs/gains")).unwrap().map(Result::unwrap).collect();
    assert_eq!(kept.len(), 1);
    assert_eq!(fs::read_to_string(kept[0].path()).unwrap(), hold);
    let before = files(&dir.path().join("out"));
    // The sources may go: the result has its own.
    fs::remove_dir_all(dir.path().join("g")).unwrap();
    let again = standfast(dir.path(), &["run", "out/campaign.toml", "--out=out"]).success();
    assert!(stderr(&again).contains("nothing is computed again"), "{}", stderr(&again));
    assert!(files(&dir.path().join("out")) == before);
    standfast(dir.path(), &["run", "out/campaign.toml", "--out=copy"]).success();
    assert!(files(&dir.path().join("copy")) == before);
}

#[test]
fn help_and_completions_are_printed() {
    let dir = folder();
    assert!(stdout(&standfast(dir.path(), &["run", "--help"]).success()).contains("Examples:"));
    assert!(stdout(&standfast(dir.path(), &["completions", "bash"]).success()).contains("standfast"));
}
