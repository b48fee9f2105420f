//! Controllers that run in processes of their own, in Python: they do the same as the same controller within the
//! program, failures are outcomes with a cause, and no child is left behind.

use crate::common::parts::{Row, rows};
use crate::common::program::{PROGRAM, Run, folder, send, standfast, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Folders of the controllers in C++ and in Python.
const CPP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/controllers/cpp");
const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/controllers/python");

/// Whether there is Python, without which these tests cannot run.
fn has_python() -> bool {
    let found = Command::new("python3")
        .arg("--version")
        .output()
        .is_ok_and(|run| run.status.success());
    if !found {
        eprintln!("left out: there is no python3");
    }
    found
}

/// A controller in a folder: further lines of its file, and the Python code that answers after the greeting.
fn controller(folder: &Path, name: &str, more: &str, script: &str) -> String {
    let text = format!(
        "kind = 'process'\nname = '{name}'\ncommand = ['python3', '{name}.py']\nfiles = ['standfast.py']\n{more}"
    );
    fs::write(folder.join(format!("{name}.toml")), text).unwrap();
    fs::write(folder.join(format!("{name}.py")), script).unwrap();
    fs::copy(
        format!("{PYTHON}/standfast.py"),
        folder.join("standfast.py"),
    )
    .unwrap();
    format!("{name}.toml")
}

/// The rows of a controller in a part, without its name, and without the column on second runs.
fn rows_of(part: &Path, controller: &str) -> Vec<Row> {
    let mut rows = rows(part);
    rows.retain(|row| row["controller"] == controller);
    for row in &mut rows {
        row.retain(|name, _| !["controller", "repeats"].contains(&name.as_str()));
    }
    rows
}

#[test]
fn hold_in_python_is_hold_to_the_bit_and_is_replayed_from_its_result() {
    if !has_python() {
        return;
    }
    let dir = folder();
    let python = format!("--controller={PYTHON}/hold.toml");
    let run = |out: &str, threads: &str| {
        let args = [
            "run",
            "smoke",
            "--trials=6",
            "--replays=0",
            "--controller=hold",
            &python,
            out,
            threads,
        ];
        standfast(dir.path(), &args).success();
    };
    run("--out=a", "--threads=1");
    run("--out=b", "--threads=2");
    let part = |out: &str| dir.path().join(out).join("parts/part-000000.parquet");
    assert_eq!(fs::read(part("a")).unwrap(), fs::read(part("b")).unwrap());
    let [inside, outside] = ["hold", "hold-python"].map(|set| rows_of(&part("a"), set));
    assert!(
        !inside.is_empty() && inside == outside,
        "{inside:?}\n{outside:?}"
    );
    for file in ["hold-python.toml", "hold.py", "standfast.py"] {
        assert!(
            dir.path().join("a/inputs/controllers").join(file).is_file(),
            "{file}"
        );
    }
    let args = [
        "replay",
        "a",
        "--trial=0",
        "--controller=hold-python",
        "--replay=page.html",
    ];
    let replayed = standfast(dir.path(), &args).success();
    assert!(
        !stderr(&replayed).contains("is not as it was"),
        "{}",
        stderr(&replayed)
    );
    // With another script it is another campaign.
    fs::write(dir.path().join("a/inputs/controllers/hold.py"), "pass").unwrap();
    let changed = stderr(&standfast(dir.path(), &args).code(3));
    assert!(
        changed.contains("inputs/controllers/hold.py") && changed.contains("restore it"),
        "{changed}"
    );
}

/// Both languages have the same two controllers, whose commands are the same to the bit.
#[test]
#[ignore = "compiles C++, a sixth of a minute"]
fn controllers_in_cpp_do_what_those_in_python_do_to_the_bit() {
    if !has_python() || Command::new("g++").arg("--version").output().is_err() {
        eprintln!("left out: there is no g++");
        return;
    }
    let dir = folder();
    standfast(dir.path(), &["new", "cpp", "cpp"]).success();
    for name in ["hold", "ankles"] {
        let source = format!("{name}.cpp");
        let options = [
            "-O2",
            "-std=c++17",
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
            "-o",
            name,
            &source,
        ];
        let compiled = Command::new("g++")
            .current_dir(dir.path().join("cpp"))
            .args(options)
            .output()
            .unwrap();
        assert!(
            compiled.status.success(),
            "{}",
            String::from_utf8_lossy(&compiled.stderr)
        );
    }
    let python = [
        format!("--controller={PYTHON}/hold.toml"),
        format!("--controller={PYTHON}/ankles.toml"),
    ];
    let run = [
        "run",
        "smoke",
        "--trials=4",
        "--replays=0",
        "--out=a",
        "--controller=cpp/hold.toml",
        "--controller=cpp/ankles.toml",
    ];
    standfast(dir.path(), &[&run[..], &[&python[0], &python[1]]].concat()).success();
    let part = dir.path().join("a/parts/part-000000.parquet");
    let rows = |set: &str| rows_of(&part, set);
    assert!(rows("hold-cpp").len() == 4 && rows("hold-cpp") == rows("hold-python"));
    assert!(rows("ankles-cpp") == rows("ankles") && rows("ankles") != rows("hold-cpp"));
    // The copy in the result can be started.
    let replay = [
        "replay",
        "a",
        "--trial=0",
        "--controller=ankles-cpp",
        "--replay=page.html",
    ];
    let replayed = standfast(dir.path(), &replay).success();
    assert!(
        !stderr(&replayed).contains("is not as it was"),
        "{}",
        stderr(&replayed)
    );
    // The message of an exception in a controller is shown.
    let source = fs::read_to_string(format!("{CPP}/hold.cpp")).unwrap();
    let throws = source.replace(
        "return command;",
        "throw std::runtime_error(\"no \\\"gain\\\" é\");",
    );
    fs::write(dir.path().join("cpp/hold.cpp"), throws).unwrap();
    let again = ["-std=c++17", "-o", "hold", "hold.cpp"];
    assert!(
        Command::new("g++")
            .current_dir(dir.path().join("cpp"))
            .args(again)
            .status()
            .unwrap()
            .success()
    );
    let told = stdout(
        &standfast(
            dir.path(),
            &["check", "cpp/hold.toml", "--set=episode.horizon_s=1"],
        )
        .code(100),
    );
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains("gives up: no \"gain\" é"), "{told}");
}

#[test]
#[ignore = "a tenth of a minute"]
fn parameters_are_swept_and_numbers_are_traced() {
    if !has_python() {
        return;
    }
    let dir = folder();
    standfast(dir.path(), &["new", "python", "mine"]).success();
    let again = stderr(&standfast(dir.path(), &["new", "python", "mine"]).code(2));
    assert!(again.contains("this is there already"), "{again}");
    let vary = "--vary=mine/ankles.toml:parameters.gain=0.0,1.0";
    let args = [
        "run",
        "smoke",
        "--trials=2",
        "--replays=0",
        vary,
        "--out=a",
        "--json",
    ];
    let summary: Value =
        serde_json::from_str(&stdout(&standfast(dir.path(), &args).success())).unwrap();
    let sets = summary["controllers"].as_array().unwrap();
    let names: Vec<&str> = sets
        .iter()
        .map(|set| set["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["ankles", "ankles gain=0.0", "ankles gain=1.0"]);
    standfast(
        dir.path(),
        &[
            "push",
            "--impulse=1",
            "--controller=mine/ankles.toml",
            "--trace=t.csv",
        ],
    )
    .success();
    let trace = fs::read_to_string(dir.path().join("t.csv")).unwrap();
    assert!(
        trace.lines().next().unwrap().contains("tilt_rate") && trace.contains("ankles"),
        "{}",
        &trace[..400]
    );
}

/// The beginning of a controller, whose `tick` is given.
fn ticks(tick: &str) -> String {
    format!(
        "import os, standfast, sys, time\nclass Mine(standfast.Controller):\n    count = 0\n    def reset(self, seed):\n        self.pushed = False\n    def tick(self, sensed):\n        \
         self.count += 1\n        home = dict(self.robot['home'])\n        self.pushed = self.pushed or sensed['time_s'] > 0.1 and max(map(abs, sensed['gyro'])) > 0.2\n        {tick}\nopen('pids', 'a').write(f'{{os.getpid()}}\\n')\n\
         standfast.serve(Mine)\n"
    )
}

/// The output of `standfast check` for a controller whose `tick` is given, and its exit code.
fn checked(tick: &str) -> (String, Option<i32>) {
    let dir = folder();
    let file = controller(dir.path(), "mine", "", &ticks(tick));
    let check = standfast(dir.path(), &["check", &file, "--set=episode.horizon_s=2"]);
    let told = stdout(&check)
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ");
    (told, check.get_output().status.code())
}

#[test]
fn a_controller_is_tried_before_it_is_pushed() {
    if !has_python() {
        return;
    }
    let stands = "it stands still at the end of the episode of 2.00 s; its trunk tilts by 0.0 degrees at most";
    let same = "again the same to the bit in a second episode, and started anew";
    let knee = "q = list(home['q_ref']); q[self.joints.index('left_knee_flexion')] += sensed['time_s']\n        ";
    for (tick, words, code) in [
        ("return home", [stands, same], 0),
        (
            // The count of ticks continues through a reset.
            "home['q_ref'] = [q + 1e-9 * (self.count > 1500) for q in home['q_ref']]\n        return home",
            [
                stands,
                "again WARNING: in a second episode, its command differs from 0.",
            ],
            100,
        ),
        (
            "home['q_ref'] = [q + 1e-9 * (os.getpid() % 1000) for q in home['q_ref']]\n        return home",
            [
                stands,
                "again WARNING: started anew, its command differs from 0.000 s on",
            ],
            100,
        ),
        (
            &format!("{knee}return {{'q_ref': q}}"),
            [
                "WARNING: it falls without a push, at",
                "from its angle of the start is left_knee_flexion, at 0.1",
            ],
            100,
        ),
        (
            "return {}",
            [
                "it fails without a push, at 0.000 s: q_ref has 0 values",
                same,
            ],
            100,
        ),
    ] {
        let (told, found) = checked(tick);
        assert_eq!(found, Some(code), "{told}");
        for words in words {
            assert!(told.contains(words), "{words:?} is not in: {told}");
        }
    }
}

/// The error message of a program keeps its lines, and the story has no sentence about a joint if there is none.
#[test]
fn the_traceback_of_a_controller_keeps_its_lines() {
    if !has_python() {
        return;
    }
    let dir = folder();
    let tick = "raise ValueError('no gain for ' + ', '.join(self.joints))";
    let file = controller(dir.path(), "mine", "", &ticks(tick));
    for args in [&["push", "--controller", &file][..], &["check", &file]] {
        let told = stdout(&standfast(dir.path(), args));
        let lines: Vec<&str> = told.lines().map(str::trim).collect();
        let raised = lines
            .iter()
            .position(|line| line.starts_with("ValueError: no gain for "))
            .unwrap_or_else(|| panic!("{told}"));
        assert!(lines[raised].len() > 200, "{told}");
        assert!(
            lines[raised - 1].starts_with("raise ValueError(")
                || lines[raised - 1].starts_with('^'),
            "{told}"
        );
        assert!(
            lines
                .iter()
                .any(|line| line.starts_with("File \"") && line.ends_with(", in tick")),
            "{told}"
        );
        assert!(!told.contains("of the limit, at"), "{told}");
    }
}

#[test]
#[ignore = "waits for programs that hang, a third of a minute"]
fn a_failure_is_an_outcome_with_its_cause_and_leaves_no_child() {
    if !has_python() {
        return;
    }
    let nonsense = "sys.__stdout__.write('hello\\n'); sys.__stdout__.flush(); return home";
    let flood = "sys.__stdout__.write('x' * 3000000); sys.__stdout__.flush(); return home";
    for (name, tick, cause) in [
        (
            "dies",
            "sys.exit('out of order')",
            "has closed its output (exit status: 1); on stderr: out of order",
        ),
        (
            "raises",
            "raise ValueError('no gain')",
            "ValueError: no gain",
        ),
        ("hangs", "time.sleep(60)", "gave no answer within 2 s"),
        (
            "gives-up",
            "return {'error': 'no solution'}",
            "gives up: no solution",
        ),
        (
            "short",
            "return {'q_ref': [0.0] * 3}",
            "q_ref has 3 values; accepted: one for each of the robot's 20 joints",
        ),
        (
            "nan",
            "home['q_ref'] = [float('nan')] * 20; return home",
            "answered with something else than a command",
        ),
        (
            "unknown",
            "home['torque'] = 1; return home",
            "unknown field `torque`",
        ),
        (
            "nonsense",
            nonsense,
            "answered with something else than a command",
        ),
        (
            "flood",
            flood,
            "answered with a line of more than 1000000 bytes",
        ),
    ] {
        let dir = folder();
        // A controller that fails before the push is refused, and nothing is run.
        let file = controller(dir.path(), name, "timeout_s = 2\n", &ticks(tick));
        let run = [
            "run",
            "smoke",
            "--trials=2",
            "--replays=0",
            "--set=push.impulse_n_s=4",
            "--controller=hold",
            "--controller",
        ];
        let args = [&run[..], &[&file, "--out=a"]].concat();
        let refused = stderr(&standfast(dir.path(), &args).code(2));
        let fails = format!("controller {name}: it fails without a push, at 0.000 s: ");
        assert!(
            refused.contains(&fails) && refused.contains(cause),
            "{refused}"
        );
        assert!(
            refused.contains("Nothing was run") && !dir.path().join("a").exists(),
            "{refused}"
        );
        let _ = fs::remove_file(dir.path().join("pids"));

        let later = ticks(&format!(
            "if self.pushed:\n            {tick}\n        return home"
        ));
        let file = controller(dir.path(), name, "timeout_s = 2\n", &later);
        let summary = stdout(&standfast(dir.path(), &[&args[..], &["--json"]].concat()).success());
        let summary: Value = serde_json::from_str(&summary).unwrap();
        assert_eq!(
            (
                &summary["controllers"][1]["failed"],
                &summary["controllers"][1]["recovered"]
            ),
            (&2.into(), &0.into()),
            "{file}"
        );
        assert!(
            summary["warnings"]
                .to_string()
                .contains("2 trials ended since the controller failed"),
            "{summary}"
        );
        for row in rows_of(&dir.path().join("a/parts/part-000000.parquet"), name) {
            assert_eq!(row["outcome"], "Failed", "{name}");
            assert!(
                row["fall_cause"].as_str().unwrap().contains(cause),
                "{name}: {}\nwanted: {cause}",
                row["fall_cause"]
            );
        }
        let pids = fs::read_to_string(dir.path().join("pids")).unwrap();
        // A child whose command does not fit the robot has not failed, and may serve the next episode.
        let least = if name == "short" { 1 } else { 2 };
        assert!(
            pids.lines().count() >= least,
            "{name}: a new child after each failure: {pids}"
        );
        if cfg!(target_os = "linux") {
            let alive = pids
                .lines()
                .find(|pid| Path::new("/proc").join(pid).exists());
            assert_eq!(alive, None, "{name}: a child is left");
        }
    }
}

/// A controller with which the robot falls without a push is refused with the reason. A second run that differs is
/// reported.
#[test]
fn a_campaign_tries_its_controllers_before_it_pushes_and_some_trials_twice() {
    if !has_python() {
        return;
    }
    let dir = folder();
    let bend = "q = list(home['q_ref']); q[self.joints.index('left_knee_flexion')] += sensed['time_s']; return {'q_ref': q}";
    let falls = controller(dir.path(), "falls", "", &ticks(bend));
    for command in [
        &["run", "smoke", "--trials=2", "--replays=0"][..],
        &["limit", "--campaign=smoke", "--headings=1"],
    ] {
        let told = stderr(
            &standfast(
                dir.path(),
                &[command, &["--controller=hold", "--controller", &falls]].concat(),
            )
            .code(2),
        );
        assert!(
            told.contains("controller falls: it falls without a push, at "),
            "{told}"
        );
        assert!(
            told.contains("of the start is left_knee_flexion, at 0.1"),
            "{told}"
        );
    }
    let args = [
        "run",
        "smoke",
        "--trials=2",
        "--replays=0",
        "--json",
        "--untried",
        "--controller",
        &falls,
        "--out=a",
    ];
    let summary: Value =
        serde_json::from_str(&stdout(&standfast(dir.path(), &args).success())).unwrap();
    let set = &summary["controllers"][0];
    assert_eq!(
        (&set["fell"], &set["run_twice"], &set["not_repeated"]),
        (&2.into(), &1.into(), &0.into()),
        "{summary}"
    );
    // The child remembers how many ticks it has had.
    let counts =
        "home['q_ref'] = [q + 1e-6 * (self.count % 7) for q in home['q_ref']]; return home";
    let counts = controller(dir.path(), "counts", "", &ticks(counts));
    let args = [
        "run",
        "smoke",
        "--trials=2",
        "--json",
        "--replays=1",
        "--controller",
        &counts,
        "--out=b",
    ];
    let run = standfast(dir.path(), &args).success();
    let summary: Value = serde_json::from_str(&stdout(&run)).unwrap();
    assert_eq!(summary["controllers"][0]["not_repeated"], 1, "{summary}");
    assert!(
        summary["warnings"]
            .to_string()
            .contains("counts does not repeat itself: of 1 trials that"),
        "{summary}"
    );
}

#[test]
fn what_cannot_be_a_controller_is_refused_before_any_episode() {
    if !has_python() {
        return;
    }
    let dir = folder();
    let hello = |answer: &str| {
        format!(
            "import sys\nsys.stdin.readline()\nprint('''{answer}''', flush=True)\nsys.stdin.readline()\n"
        )
    };
    for (name, more, script, words) in [
        (
            "old",
            "",
            hello("{\"protocol\": 0}"),
            "speaks version 0 of the protocol; accepted: 1",
        ),
        (
            "other",
            "",
            hello("good day"),
            "does not answer the greeting as it should",
        ),
        (
            "wrong",
            "",
            "import nowhere\n".into(),
            "No module named 'nowhere'",
        ),
        (
            "key",
            "file = 'x'\n",
            String::new(),
            "file = \"x\": is no key of such a file",
        ),
        (
            "slow",
            "timeout_s = 0\n",
            String::new(),
            "timeout_s = 0: out of range; accepted: more than 0, at most 1000",
        ),
    ] {
        let file = controller(dir.path(), name, more, &script);
        let message = stderr(&standfast(dir.path(), &["push", "--controller", &file]).code(2));
        assert!(message.contains(words), "{name}: {message}");
    }
    for (text, words) in [
        (
            "command = ['no-such-program']",
            "command = no-such-program: cannot be started",
        ),
        ("command = []", "command = []: names no program"),
        ("command = ['python3', 'gone.py']", "can't open file"),
    ] {
        fs::write(
            dir.path().join("bad.toml"),
            format!("kind = 'process'\nname = 'bad'\n{text}\n"),
        )
        .unwrap();
        let message = stderr(&standfast(dir.path(), &["push", "--controller=bad.toml"]).code(2));
        assert!(message.contains(words), "{text}: {message}");
    }
    let outside = "kind = 'process'\nname = 'bad'\ncommand = ['python3']\nfiles = ['../secret']\n";
    fs::write(dir.path().join("bad.toml"), outside).unwrap();
    let message = stderr(
        &standfast(
            dir.path(),
            &["run", "smoke", "--controller=bad.toml", "--dry-run"],
        )
        .code(2),
    );
    assert!(
        message.contains("files = ../secret: is not in the folder of this file"),
        "{message}"
    );
}

/// A controller that is started by a shell, which leaves another child of its own that would run for a long time.
fn with_grandchild(folder: &Path, name: &str, tick: &str) -> String {
    let file = controller(folder, name, "timeout_s = 1000\n", &ticks(tick));
    let text = fs::read_to_string(folder.join(&file)).unwrap();
    let by_shell =
        format!("command = ['sh', '-c', 'sleep 982 & echo $! >> pids; exec python3 {name}.py']\n");
    let lines = text.lines().map(|line| {
        if line.starts_with("command") {
            by_shell.clone()
        } else {
            format!("{line}\n")
        }
    });
    fs::write(folder.join(&file), lines.collect::<String>()).unwrap();
    file
}

/// Running processes of the file `pids` in a folder. Processes that are only waited for have ended.
fn alive(folder: &Path) -> Vec<String> {
    let pids = fs::read_to_string(folder.join("pids")).unwrap_or_default();
    let runs = |pid: &&str| {
        let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
        stat.rsplit_once(") ")
            .is_some_and(|(_, state)| !state.starts_with('Z'))
    };
    pids.lines().filter(runs).map(String::from).collect()
}

/// Waits until `is_so` is true, and fails if it never is.
#[track_caller]
fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < Duration::from_secs(100), "{what}");
        sleep(Duration::from_millis(20));
    }
}

/// Runs the program with at most `most` open files.
fn with_open_files(dir: &Path, most: u32, args: &[&str]) -> Run {
    let command = format!("ulimit -n {most}; exec \"$0\" \"$@\"");
    Run::of(
        Command::new("sh")
            .current_dir(dir)
            .args(["-c", &command, PROGRAM])
            .args(args),
    )
}

/// A grandchild holds the pipes of a child that has failed.
#[test]
fn failed_children_leave_no_open_files_and_no_grandchildren() {
    if !has_python() || !cfg!(target_os = "linux") {
        return;
    }
    let dir = folder();
    let file = with_grandchild(dir.path(), "wrapped", "return {'error': 'no solution'}");
    let args = [
        "run",
        "smoke",
        "--trials=40",
        "--replays=0",
        "--untried",
        "--json",
        "--out=a",
        "--threads=2",
    ];
    let run = with_open_files(
        dir.path(),
        40,
        &[&args[..], &["--controller", &file]].concat(),
    )
    .success();
    let summary: Value = serde_json::from_str(&stdout(&run)).unwrap();
    assert_eq!(summary["controllers"][0]["failed"], 40, "{summary}");
    for part in fs::read_dir(dir.path().join("a/parts"))
        .unwrap()
        .map(|part| part.unwrap().path())
    {
        if part.extension().is_some_and(|ending| ending == "csv") {
            let rows = fs::read_to_string(&part).unwrap();
            assert_eq!(
                rows.matches("gives up: no solution").count(),
                rows.lines().count() - 1,
                "{rows}"
            );
        }
    }
    let pids = fs::read_to_string(dir.path().join("pids")).unwrap();
    assert!(
        pids.lines().count() >= 80 && alive(dir.path()).is_empty(),
        "{:?}",
        alive(dir.path())
    );
}

#[test]
fn what_the_machine_lacks_is_no_outcome() {
    if !has_python() || !cfg!(target_os = "linux") {
        return;
    }
    let dir = folder();
    let python = format!("--controller={PYTHON}/hold.toml");
    let told = |run: &Run| {
        let told = stderr(run);
        assert!(
            told.contains("Too many open files") && told.contains("`ulimit -n`"),
            "{told}"
        );
        told
    };
    // The limit does not allow even one child.
    let ankles = format!("{PYTHON}/ankles.toml");
    for args in [
        &["push", &python][..],
        &["check", &ankles],
        &["limit", "--campaign=nominal", "--headings=1", &python],
        &[
            "tune",
            &ankles,
            "--campaign=smoke",
            "--budget=200",
            "--out=t",
        ],
        &["run", "smoke", "--trials=5", &python, "--out=b"],
    ] {
        let run = with_open_files(dir.path(), 9, args).code(75);
        assert!(
            stdout(&run).is_empty() && !told(&run).contains("command ="),
            "{args:?}: {}",
            stdout(&run)
        );
    }
    // The limit allows fewer children than threads.
    let args = [
        "run",
        "smoke",
        "--trials=12",
        "--replays=0",
        &python,
        "--json",
    ];
    let all = |out: &str| standfast(dir.path(), &[&args[..], &[out]].concat()).success();
    let short_of_files = with_open_files(
        dir.path(),
        40,
        &[&args[..], &["--out=a", "--threads=24"]].concat(),
    )
    .code(75);
    assert!(
        told(&short_of_files).contains("incomplete: "),
        "{}",
        stderr(&short_of_files)
    );
    assert!(!dir.path().join("a/summary.json").exists());
    assert_eq!(stdout(&all("--out=a")), stdout(&all("--out=whole")));
}

/// Starts a campaign in a folder, whose controller answers no tick.
fn waiting(dir: &Path, name: &str) -> Child {
    let file = with_grandchild(dir, name, "time.sleep(1000)");
    let mut run = Command::new(PROGRAM);
    run.current_dir(dir).args([
        "run",
        "smoke",
        "--untried",
        "--threads=1",
        "--replays=0",
        "--out=a",
        "--controller",
        &file,
    ]);
    let mut run = run
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let pids = || {
        fs::read_to_string(dir.join("pids"))
            .unwrap_or_default()
            .lines()
            .count()
    };
    wait_until("the controller starts", || {
        pids() >= 2 && dir.join("a/parts/campaign.json").exists()
    });
    assert!(!alive(dir).is_empty() && run.try_wait().unwrap().is_none());
    run
}

#[test]
fn whatever_ends_the_program_ends_all_children() {
    if !has_python() || !cfg!(target_os = "linux") {
        return;
    }
    for (signals, code) in [
        (&["INT"][..], Some(130)),
        (&["TERM"], Some(75)),
        (&["QUIT"], None),
        (&["KILL"], None),
    ] {
        let dir = folder();
        let mut run = waiting(dir.path(), "waits");
        signals.iter().for_each(|signal| send(signal, &run));
        // An answer may be waited for 1000 s.
        wait_until(&format!("{signals:?}: the program ends"), || {
            alive(dir.path()).is_empty()
        });
        assert_eq!(run.wait().unwrap().code(), code, "{signals:?}");
    }
}

#[test]
fn what_a_controller_tells_is_bounded() {
    if !has_python() {
        return;
    }
    let numbers = |names: &str| {
        format!("home['numbers'] = {{{names}: 1.0 for i in range(101)}}; return home")
    };
    for (tick, words) in [
        (
            "home['phase'] = 'x' * 900; return home",
            "answered with a phase of 900 characters; accepted: up to 100",
        ),
        (
            "home['phase'] = str(sensed['time_s']); return home",
            "answered with more than 1000 different phases in an episode; accepted: up to 1000",
        ),
        (
            &numbers("i"),
            "answered with 101 `numbers`; accepted: up to 100",
        ),
        (
            &numbers("'x' * (200 + i % 2)"),
            "answered with a name in `numbers` of 200 characters; accepted: up to 100",
        ),
        (
            "home['numbers'] = {str(sensed['time_s']): 1.0}; return home",
            "answered with more than 100 different names in `numbers` in an episode; accepted: up to 100",
        ),
        (
            "return {'x' * 900000: 1}",
            "answered with something else than a command (unknown field `xxx",
        ),
    ] {
        let (told, code) = checked(&tick.replace("i}:", "str(i)}:"));
        assert!(
            code == Some(100) && told.contains(words) && told.len() < 8000,
            "{words}: {told}"
        );
    }
}

/// Names, answers and error messages of a program neither command the terminal nor break a picture.
#[test]
fn foreign_text_is_a_picture() {
    if !has_python() {
        return;
    }
    let dir = folder();
    let is_plain = |text: &str| !text.contains(|c: char| c.is_control() && c != '\n');
    let name = r#""\u001b[31msays""#;
    let says = |tick: &str| {
        let file = controller(dir.path(), "says", "", &ticks(tick));
        let text = fs::read_to_string(dir.path().join(&file))
            .unwrap()
            .replace("'says'", name);
        fs::write(dir.path().join(&file), text).unwrap();
        let push = [
            "push",
            "--impulse=1",
            "--plot=p.svg",
            "--replay=p.html",
            "--controller",
            &file,
        ];
        let pushed = standfast(dir.path(), &push);
        stdout(&pushed) + &stderr(&pushed)
    };
    let answers =
        r"sys.__stdout__.write('\x1b]0;pwned\x07\n'); sys.__stdout__.flush(); return home";
    let last_words = r"sys.exit('\x1b[2J\x9b1m')";
    for (tick, words) in [
        (answers, r"\u001b]0;pwned\u0007"),
        (last_words, r"\u001b[2J\u009b1m"),
    ] {
        let told = says(tick);
        assert!(
            is_plain(&told) && told.contains(r"\u001b[31msays") && told.contains(words),
            "{told}"
        );
    }
    let read = |name: &str| fs::read_to_string(dir.path().join(name)).unwrap();
    assert!(roxmltree::Document::parse(&read("p.svg")).is_ok() && is_plain(&read("p.html")));
    // The number 1e308 written out has 309 digits.
    let refused = stderr(&standfast(dir.path(), &["push", "--impulse=1e308"]).code(2));
    assert!(
        refused.contains("1e308") && refused.len() < 400,
        "{refused}"
    );
}

#[test]
fn what_a_command_refers_to_is_an_input_or_is_told() {
    if !has_python() {
        return;
    }
    let dir = folder();
    let mine = dir.path().join("mine");
    fs::create_dir(&mine).unwrap();
    let file = format!(
        "mine/{}",
        controller(&mine, "holds", "", "import posture\nposture.serve()\n")
    );
    let posture = fs::read_to_string(format!("{PYTHON}/hold.py")).unwrap();
    let posture = posture.replace(
        "standfast.serve(Hold)",
        "def serve():\n    standfast.serve(Hold)",
    );
    fs::write(mine.join("posture.py"), &posture).unwrap();
    let as_command = |command: &str| {
        let text = format!("kind = 'process'\nname = 'holds'\ncommand = {command}\n");
        fs::write(dir.path().join(&file), text).unwrap();
    };
    let run = |more: &[&str]| {
        let args = [
            "run",
            "smoke",
            "--trials=2",
            "--replays=0",
            "--controller",
            &file,
        ];
        standfast(dir.path(), &[&args[..], more].concat())
    };
    as_command("['python3', '-m', 'holds']");
    let told = stderr(&run(&["--out=a"]).success());
    assert!(!told.contains("not kept"), "{told}");
    for name in ["holds.py", "posture.py", "standfast.py"] {
        assert!(
            dir.path().join("a/inputs/controllers").join(name).is_file(),
            "{name}"
        );
    }
    let replay = standfast(
        dir.path(),
        &["replay", "a", "--trial=0", "--replay=page.html"],
    )
    .success();
    assert!(
        !stderr(&replay).contains("is not as it was"),
        "{}",
        stderr(&replay)
    );
    fs::write(mine.join("posture.py"), posture + "\n# another\n").unwrap();
    let other = stderr(&run(&["--out=a"]).code(3));
    assert!(other.contains("another campaign"), "{other}");
    // The script is in another folder.
    fs::write(
        dir.path().join("elsewhere.py"),
        "import posture\nposture.serve()\n",
    )
    .unwrap();
    as_command("['env', 'PYTHONPATH=.', 'python3', '../elsewhere.py']");
    let ran = run(&["--out=b"]).success();
    let sentence = "holds depends on files that are not kept: ../elsewhere.py.";
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words(&stderr(&ran)).contains(sentence) && words(&stdout(&ran)).contains(sentence),
        "{}",
        stdout(&ran)
    );
    let read = |name: &str| {
        words(&fs::read_to_string(dir.path().join("b").join(name)).unwrap()).replace("&#x2f;", "/")
    };
    for name in ["summary.json", "summary.md", "report.html"] {
        assert!(read(name).contains(sentence), "{name}");
    }
    assert!(
        read("parts/campaign.json")
            .contains("\"not_kept\": { \"holds\": [ \"../elsewhere.py\" ] }")
    );
}

/// A result from elsewhere may hold any command. So the program that starts the command says so, and asks before.
#[test]
fn the_command_of_a_result_from_elsewhere_starts_only_if_it_is_allowed() {
    if !has_python() {
        return;
    }
    let dir = folder();
    let started = dir.path().join("started");
    let script = format!(
        "import standfast\nopen({:?}, 'a').write('x')\nclass Mine(standfast.Controller):\n    def tick(self, sensed):\n        \
         return {{'q_ref': self.home}}\nstandfast.serve(Mine)\n",
        started.display().to_string()
    );
    let mine = controller(dir.path(), "mine", "", &script);
    let on = |machine: &str, args: &[&str]| {
        let state = dir.path().join(machine);
        Run::of(
            Command::new(PROGRAM)
                .current_dir(dir.path())
                .args(args)
                .env("XDG_STATE_HOME", state),
        )
    };
    let starts = |run: &dyn Fn() -> Run| {
        let count = || fs::read(&started).map_or(0, |text| text.len());
        let before = count();
        (run(), count() > before)
    };
    let run = ["run", "smoke", "--trials=2", "--replays=1", "--out=out"];
    on(
        "ours",
        &[&run[..], &[&format!("--controller={mine}")]].concat(),
    )
    .success();
    let told = "out/inputs/controllers/mine.toml: its controller is the program: python3 mine.py";
    for args in [
        &["merge", "out", "--replays=1"][..],
        &["replay", "out", "--trial=0"],
    ] {
        let (ours, has_started) = starts(&|| on("ours", args).success());
        assert!(
            has_started && stderr(&ours).contains(told),
            "{}",
            stderr(&ours)
        );
        let (theirs, has_started) = starts(&|| on("theirs", args).code(2));
        let said = stderr(&theirs);
        assert!(
            !has_started && said.contains("mine.toml: command = python3 mine.py: was not started"),
            "{said}"
        );
        assert!(said.contains("accepted: --run-inputs"), "{said}");
        let (allowed, has_started) =
            starts(&|| on("theirs", &[args, &["--run-inputs"]].concat()).success());
        assert!(
            has_started && stderr(&allowed).contains(told),
            "{}",
            stderr(&allowed)
        );
    }
    for args in [
        &["run", "out/campaign.toml", "--out=new"][..],
        &[
            "push",
            "--campaign=out/campaign.toml",
            "--trial=0",
            "--controller=out/inputs/controllers/mine.toml",
        ],
        &["check", "out/inputs/controllers/mine.toml"],
    ] {
        let (run, has_started) = starts(&|| on("theirs", args).code(2));
        assert!(
            !has_started && stderr(&run).contains("was not started"),
            "{args:?}: {}",
            stderr(&run)
        );
    }
    on("theirs", &["merge", "out", "--replays=0"]).success();
    // Python would load this file instead of its own module.
    fs::write(dir.path().join("out/inputs/controllers/json.py"), "").unwrap();
    let (planted, has_started) = starts(&|| on("ours", &["merge", "out", "--replays=1"]).code(2));
    assert!(!has_started, "{}", stderr(&planted));
    // Controllers that are no programs have no commands.
    on(
        "ours",
        &[
            "run",
            "smoke",
            "--trials=1",
            "--controller=hold",
            "--replays=0",
            "--out=plain",
        ],
    )
    .success();
    on("theirs", &["merge", "plain", "--replays=1"]).success();
}
