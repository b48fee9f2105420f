//! Faults on one machine, and their effect on a result: each row of the guide's table of faults is tested here.
//! Whatever happens, the result is in the end, byte for byte, the result of an undisturbed run.
//!
//! `cargo test --release --test faults -- --nocapture` prints the table.

use crate::common::parts;
use crate::common::program::{PROGRAM, Run, files, folder, send, standfast, stderr};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A campaign of a second or two, with an input of its own.
const RUN: [&str; 11] = [
    "run",
    "smoke",
    "--controller=hold",
    "--controller=mine.toml",
    "--trials=60",
    "--threads=1",
    "--set=episode.horizon_s=0.5",
    "--set=episode.judge.standing_time_s=0.1",
    "--set=push.start_s=0.05",
    "--replays=1",
    "--out=out",
];
const MINE: &str = "kind = 'posture'\nname = 'mine'\ndescription = 'a'\n";

type Files = BTreeMap<String, Vec<u8>>;

/// A folder in which the campaign can run, and the result of an undisturbed run.
fn begin() -> tempfile::TempDir {
    let dir = folder();
    fs::write(dir.path().join("mine.toml"), MINE).unwrap();
    dir
}

fn run(dir: &Path) -> Run {
    standfast(dir, &RUN)
}

fn out(dir: &Path) -> Files {
    files(&dir.join("out"))
}

/// Starts the campaign, and waits until it has written some parts.
fn started(dir: &Path) -> Child {
    let child = Command::new(PROGRAM)
        .current_dir(dir)
        .args(RUN)
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let part = dir.join("out/parts/part-000002.parquet");
    while !part.exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

/// Runs a command while the campaign is at work. The campaign is stopped during the command, so that it cannot end
/// before, and ends well after the command.
fn beside(dir: &Path, args: &[&str]) -> Run {
    let mut child = started(dir);
    send("STOP", &child);
    let second = standfast(dir, args);
    send("CONT", &child);
    assert!(child.wait().unwrap().success());
    second
}

/// Runs the campaign with at most `blocks` blocks of 1024 bytes in a file, as on a full disk.
fn run_with_files_up_to(dir: &Path, blocks: u32) -> Run {
    let command = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    Run::of(
        Command::new("bash")
            .current_dir(dir)
            .args(["-c", &command, PROGRAM])
            .args(RUN),
    )
}

fn change(path: &Path, change: impl FnOnce(&mut Value)) {
    let mut value: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    change(&mut value);
    fs::write(path, value.to_string()).unwrap();
}

/// Changes the numbers of a column in a part, and makes the hash of the part anew.
fn forge(dir: &Path, part: &str, column: &str, change: impl Fn(f64) -> f64) {
    parts::forge(
        &dir.join(format!("out/parts/{part}.parquet")),
        column,
        change,
    );
}

/// A fault in the folder of a campaign, which is new or, after `begin`, begun. The function returns what happened.
/// Afterwards the same command has to end with the whole result.
type Fault = (&'static str, fn(&Path) -> &'static str);

const FAULTS: [Fault; 14] = [
    ("killed (SIGKILL) in the middle", |dir| {
        let mut child = started(dir);
        child.kill().unwrap();
        child.wait().unwrap();
        fs::write(dir.join("out/parts/.tmp-half"), "1,hold").unwrap();
        standfast(dir, &["merge", "out"]).code(3);
        "finished parts are kept; the same command goes on from there"
    }),
    ("terminated (SIGTERM) in the middle", |dir| {
        let mut child = started(dir);
        send("TERM", &child);
        assert_eq!(child.wait().unwrap().code(), Some(75));
        "finished parts are kept, exit code 75; the same command goes on from there"
    }),
    ("the same campaign again while it runs", |dir| {
        let said = stderr(&beside(dir, &RUN).code(75));
        assert!(said.contains("another command is at work"), "{said}");
        "the second is refused, exit code 75; the first ends as if alone"
    }),
    (
        "another campaign with the same `--out` while it runs",
        |dir| {
            let said = stderr(&beside(dir, &[&RUN[..], &["--seed=5"]].concat()).code(3));
            assert!(said.contains("another campaign"), "{said}");
            "the second is refused, exit code 3; the first ends as if alone"
        },
    ),
    (
        "two different campaigns begun at once with one `--out`",
        |dir| {
            let other = Command::new(PROGRAM)
                .current_dir(dir)
                .args(RUN)
                .arg("--seed=5")
                .stderr(Stdio::null())
                .spawn();
            let mut first = Command::new(PROGRAM)
                .current_dir(dir)
                .args(RUN)
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            let ended = [
                other.unwrap().wait().unwrap().success(),
                first.wait().unwrap().success(),
            ];
            assert!(
                ended[0] != ended[1],
                "one of them must be refused: {ended:?}"
            );
            if ended[0] {
                fs::remove_dir_all(dir.join("out")).unwrap();
            }
            "one has the folder, the other is refused"
        },
    ),
    (
        "a limit on file sizes (`ulimit -f`) that the first file meets",
        |dir| {
            let said = stderr(&run_with_files_up_to(dir, 0).code(75));
            assert!(said.contains("cannot write"), "{said}");
            "an error that names the file, exit code 75; the same command begins anew"
        },
    ),
    ("a limit on file sizes that is met in the middle", |dir| {
        run_with_files_up_to(dir, 14).code(75);
        assert!(
            dir.join("out/parts/part-000011.parquet").exists()
                && !dir.join("out/report.html").exists()
        );
        "an error, exit code 75; finished parts are kept, and no half of a file is left"
    }),
    ("a byte of a part changed", |dir| {
        run(dir).success();
        let part = dir.join("out/parts/part-000003.parquet");
        let mut bytes = fs::read(&part).unwrap();
        bytes[200] ^= 1;
        fs::write(&part, bytes).unwrap();
        standfast(dir, &["merge", "out"]).code(3);
        "`merge` refuses, exit code 3, and names the trials; they are run again"
    }),
    (
        "an impulse changed in a part, and the part's hash made anew",
        |dir| {
            run(dir).success();
            forge(dir, "part-000003", "impulse_n_s", |_| 0.001);
            for command in ["merge", "status"] {
                let said = stderr(&standfast(dir, &[command, "out"]).code(3));
                let told = "trial 15 of hold: impulse_n_s = 0.001: is not what seed 1 draws for this trial; accepted: ";
                assert!(
                    said.contains("part-000003.parquet: ") && said.contains(told),
                    "{said}"
                );
                assert!(said.contains("remove part-000003.parquet"), "{said}");
            }
            standfast(dir, &["replay", "out", "--trial=15"]).code(3);
            fs::remove_file(dir.join("out/parts/part-000003.parquet")).unwrap();
            "`merge` and `status` refuse, exit code 3, and name the trial and the file to remove; it is run again"
        },
    ),
    (
        "outcomes changed in all parts, and the hashes of the parts made anew",
        |dir| {
            run(dir).success();
            (0..12).for_each(|part| {
                forge(dir, &format!("part-{part:06}"), "end_s", |end_s| {
                    end_s + 0.001
                })
            });
            standfast(dir, &["status", "out"]).success();
            for _ in 0..2 {
                let said = stderr(&standfast(dir, &["merge", "out", "--replays=1"]).code(3));
                assert!(
                    said.contains(
                        "of the trials that were simulated again do not end as its parts say"
                    ),
                    "{said}"
                );
            }
            fs::remove_dir_all(dir.join("out")).unwrap();
            "`merge` ends with exit code 3, since the trials that it simulates again end otherwise"
        },
    ),
    ("the seed changed in `parts/campaign.json`", |dir| {
        run(dir).success();
        let manifest = dir.join("out/parts/campaign.json");
        let before = fs::read(&manifest).unwrap();
        change(&manifest, |value| value["campaign"]["seed"] = 5.into());
        for command in ["merge", "status"] {
            let said = stderr(&standfast(dir, &[command, "out"]).code(3));
            assert!(said.contains("not as standfast wrote it"), "{said}");
        }
        standfast(dir, &["replay", "out", "--trial=0"]).code(3);
        run(dir).code(3);
        fs::write(&manifest, before).unwrap();
        "every command refuses the folder, exit code 3, until it is restored"
    }),
    ("an input changed in the folder", |dir| {
        run(dir).success();
        let input = dir.join("out/inputs/controllers/mine.toml");
        fs::write(&input, MINE.replace("'a'", "'b'")).unwrap();
        let said = stderr(&standfast(dir, &["merge", "out"]).code(3));
        assert!(said.contains("mine.toml"), "{said}");
        run(dir).code(3);
        fs::write(&input, MINE).unwrap();
        "every command refuses the folder, exit code 3, until it is restored"
    }),
    ("the manifest lost", |dir| {
        run(dir).success();
        fs::remove_file(dir.join("out/parts/campaign.json")).unwrap();
        let said = stderr(&standfast(dir, &["merge", "out"]).code(3));
        assert!(
            said.contains("standfast run out/campaign.toml --out out"),
            "{said}"
        );
        "the parts say whose they are: the command that began it writes it again, and nothing is run again"
    }),
    ("the folder removed while it runs", |dir| {
        let mut child = started(dir);
        fs::rename(dir.join("out"), dir.join("moved")).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(3));
        fs::remove_dir_all(dir.join("out")).ok();
        fs::rename(dir.join("moved"), dir.join("out")).unwrap();
        "exit code 3: nothing is written where no manifest is; moved back, the same command goes on"
    }),
];

#[test]
#[ignore = "kills and fills disks in many ways, half a minute"]
fn nothing_is_lost() {
    let whole = {
        let dir = begin();
        run(dir.path()).success();
        out(dir.path())
    };
    let guide = fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/src/guide/clusters.md"
    ))
    .unwrap();
    let mut missing = Vec::new();
    for (done, fault) in FAULTS {
        let dir = begin();
        let happened = fault(dir.path());
        run(dir.path()).success();
        let (found, wanted) = (out(dir.path()), &whole);
        let differ: Vec<&String> = wanted
            .keys()
            .filter(|name| found.get(*name) != wanted.get(*name))
            .collect();
        assert!(
            differ.is_empty() && found.len() == wanted.len(),
            "{done}: {differ:?} of {:?}",
            found.keys()
        );
        let row = format!("| {done} | {happened} |");
        println!("{row}");
        missing.extend((!guide.contains(&row)).then_some(row));
    }
    assert!(
        missing.is_empty(),
        "not in the guide's table of faults:\n{}",
        missing.join("\n")
    );
}
