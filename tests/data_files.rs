//! Traces for other programs (MCAP, Parquet with meanings), and the page of a result in the browser.

use crate::common::program::{FEW, PROGRAM, Run, folder, short, standfast, stderr, stdout};
use mcap::{MessageStream, Summary};
use serde_json::Value;
use standfast::files::columns::{meaning, unit};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

const PUSH: [&str; 5] = [
    "push",
    "--controller=hold",
    "--impulse=1",
    "--set=episode.horizon_s=1",
    "--trace=a.mcap",
];

/// The messages of a file by topic, as far as the file can be read, and whether it can be read to its end.
fn messages(bytes: &[u8]) -> (BTreeMap<String, Vec<Value>>, bool) {
    let mut found: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    for message in MessageStream::new(bytes).unwrap() {
        let Ok(message) = message else {
            return (found, false);
        };
        found
            .entry(message.channel.topic.clone())
            .or_default()
            .push(serde_json::from_slice(&message.data).unwrap());
    }
    (found, bytes.ends_with(mcap::MAGIC))
}

#[test]
fn an_mcap_file_says_the_same_as_a_csv_file() {
    let dir = folder();
    standfast(dir.path(), &PUSH).success();
    standfast(dir.path(), &[&PUSH[..4], &["--trace=a.csv"]].concat()).success();
    let bytes = fs::read(dir.path().join("a.mcap")).unwrap();
    let (by_topic, is_whole) = messages(&bytes);
    assert!(is_whole);
    let mut csv = csv::Reader::from_path(dir.path().join("a.csv")).unwrap();
    let names = csv.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = csv.records().map(Result::unwrap).collect();
    for (topic, count) in [
        ("/trace", 501),
        ("/joint_states", 501),
        ("/joint_commands", 501),
        ("/tf", 101),
        ("/forces", 101),
        ("/robot", 1),
    ] {
        assert_eq!(by_topic[topic].len(), count, "{topic}");
    }
    let cell = |row: usize, name: &str| {
        let column = names
            .iter()
            .position(|n| n == name)
            .unwrap_or_else(|| panic!("{name}"));
        rows[row][column].to_string()
    };
    for tick in [0, 260, 500] {
        let state = &by_topic["/trace"][tick];
        assert!(state.as_object().unwrap().len() > 30, "{state}");
        for (name, value) in state
            .as_object()
            .unwrap()
            .iter()
            .filter(|(name, _)| *name != "timestamp")
        {
            let told = match value {
                Value::Null => String::new(),
                Value::String(word) => word.clone(),
                number => number.as_f64().unwrap().to_string(),
            };
            assert_eq!(told, cell(tick, name), "{name} of tick {tick}");
        }
        let joint = &by_topic["/joint_states"][tick]["joints"][3];
        let name = joint["name"].as_str().unwrap();
        for (field, prefix) in [("position", "q"), ("velocity", "dq"), ("effort", "tau")] {
            assert_eq!(
                joint[field].as_f64().unwrap().to_string(),
                cell(tick, &format!("{prefix}_{name}")),
                "{field}"
            );
        }
    }
    // The base is a link, and its pose is the one in the trace.
    let base = &by_topic["/tf"][50]["transforms"][0];
    assert_eq!(
        (
            base["parent_frame_id"].as_str(),
            base["timestamp"]["nsec"].as_u64()
        ),
        (Some("world"), Some(500_000_000))
    );
    assert_eq!(
        base["translation"]["z"].as_f64().unwrap().to_string(),
        cell(250, "base_z_m")
    );
    assert_eq!(
        base["rotation"]["w"].as_f64().unwrap().to_string(),
        cell(250, "base_qw")
    );
    let links = by_topic["/tf"][0]["transforms"].as_array().unwrap().len();
    assert_eq!(
        by_topic["/robot"][0]["entities"].as_array().unwrap().len(),
        links
    );

    let summary = Summary::read(&bytes).unwrap().unwrap();
    let attached = mcap::read::attachment(&bytes, &summary.attachment_indexes[0]).unwrap();
    assert_eq!(attached.name, "ut-mu2.urdf");
    assert_eq!(
        attached.data.as_ref(),
        include_bytes!("../assets/robots/ut-mu2.urdf")
    );
    // A second run gives the same bytes.
    standfast(dir.path(), &[&PUSH[..4], &["--trace=b.mcap"]].concat()).success();
    assert!(fs::read(dir.path().join("b.mcap")).unwrap() == bytes);
}

/// Asserts that a folder contains at most the file `a.mcap`, as it was.
#[track_caller]
fn assert_as_it_was(folder: &Path) {
    let names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(names, ["a.mcap"]);
    assert_eq!(
        fs::read_to_string(folder.join("a.mcap")).unwrap(),
        "earlier"
    );
}

/// As on a full disk, no file may grow beyond 200 blocks of 512 bytes.
#[cfg(unix)]
#[test]
fn a_disk_that_is_full_in_the_middle_is_an_error_and_leaves_the_file_that_was_there() {
    let dir = folder();
    fs::write(dir.path().join("a.mcap"), "earlier").unwrap();
    let push = format!("ulimit -f 200; exec '{PROGRAM}' {}", PUSH.join(" "));
    let run = Run::of(
        Command::new("sh")
            .current_dir(dir.path())
            .args(["-c", &push]),
    )
    .code(75);
    assert!(
        stderr(&run).contains("a.mcap: cannot write: "),
        "{}",
        stderr(&run)
    );
    assert_as_it_was(dir.path());
}

/// The controller reports its ticks, and then takes its time.
#[cfg(unix)]
#[test]
fn a_kill_in_the_middle_leaves_the_file_that_was_there() {
    let [dir, of_controller] = [folder(), folder()];
    fs::write(dir.path().join("a.mcap"), "earlier").unwrap();
    let file = |name: &str| of_controller.path().join(name);
    fs::write(
        file("standfast.py"),
        include_str!("../assets/controllers/python/standfast.py"),
    )
    .unwrap();
    let script = "import standfast, time\nclass Slow(standfast.Controller):\n    def tick(self, sensed):\n        \
                  open('ticks', 'w').close()\n        time.sleep(5)\n        return {}\nstandfast.serve(Slow)\n";
    fs::write(file("slow.py"), script).unwrap();
    let settings = "kind = 'process'\nname = 'slow'\ncommand = ['python3', 'slow.py']\nfiles = ['standfast.py']\n";
    fs::write(file("slow.toml"), format!("{settings}timeout_s = 60.0\n")).unwrap();
    let controller = file("slow.toml").display().to_string();
    let mut push = Command::new(PROGRAM)
        .current_dir(dir.path())
        .args(["push", "--trace=a.mcap", "--controller", &controller])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !file("ticks").exists() {
        assert!(
            push.try_wait().unwrap().is_none(),
            "it has ended before a tick"
        );
        std::thread::sleep(Duration::from_millis(5));
    }
    push.kill().unwrap();
    push.wait().unwrap();
    assert_as_it_was(dir.path());
}

/// A pipe that nobody reads or writes would stop the program for ever. `timeout` ends with 124 if that happens.
#[cfg(unix)]
#[test]
fn a_pipe_in_the_place_of_a_file_is_refused_before_anything_is_simulated() {
    let dir = folder();
    let pipe = |name: &str| {
        fs::create_dir_all(dir.path().join(name).parent().unwrap()).unwrap();
        assert!(
            Command::new("mkfifo")
                .arg(dir.path().join(name))
                .status()
                .unwrap()
                .success()
        );
    };
    let refused = |name: &str, args: &str, words: &str| {
        let args = ["60", PROGRAM].into_iter().chain(args.split(' '));
        let told =
            stderr(&Run::of(Command::new("timeout").current_dir(dir.path()).args(args)).code(2));
        assert!(
            told.contains(name) && told.contains("it is no file"),
            "{told}"
        );
        assert!(
            told.contains(words) && !told.contains("generation "),
            "{told}"
        );
    };
    let robot = include_str!("../assets/robots/child.urdf");
    fs::write(dir.path().join("child.urdf"), robot).unwrap();
    for (option, name) in [
        ("push --trace", "a.mcap"),
        ("push --trace", "a.csv"),
        ("push --trace", "a.parquet"),
    ]
    .into_iter()
    .chain([
        ("push --plot", "a.svg"),
        ("push --replay", "a.html"),
        ("limit smoke --plot", "b.svg"),
    ])
    .chain([
        ("cpi catch --plot", "c.svg"),
        ("init child.urdf --force", "child.toml"),
    ]) {
        pipe(name);
        let args = match option {
            // It writes beside the URDF.
            "init child.urdf --force" => option.into(),
            _ => format!("{option} {name}"),
        };
        refused(name, &args, "");
        // A folder is no file either.
        fs::remove_file(dir.path().join(name)).unwrap();
        fs::create_dir(dir.path().join(name)).unwrap();
        refused(name, &args, "");
        fs::remove_dir(dir.path().join(name)).unwrap();
    }
    for (name, args) in [
        ("d.urdf", "push --robot d.urdf"),
        ("e.toml", "push --controller e.toml"),
        ("f.toml", "run f.toml"),
        ("t/task.json", "tune fixed --campaign smoke --out t"),
    ] {
        pipe(name);
        refused(name, args, "cannot read");
        fs::remove_file(dir.path().join(name)).unwrap();
    }
}

#[test]
fn every_column_says_what_it_means() {
    let dir = folder();
    standfast(dir.path(), &short(&[FEW])).success();
    let file = fs::File::open(dir.path().join("out/trials.parquet")).unwrap();
    let reader = parquet::file::reader::SerializedFileReader::new(file).unwrap();
    let metadata = parquet::file::reader::FileReader::metadata(&reader)
        .file_metadata()
        .clone();
    let about = metadata
        .key_value_metadata()
        .unwrap()
        .iter()
        .find(|pair| pair.key == "columns")
        .unwrap();
    let about: BTreeMap<String, Value> =
        serde_json::from_str(about.value.as_deref().unwrap()).unwrap();
    assert_eq!(about.len(), metadata.schema_descr().num_columns());
    for (name, about) in &about {
        assert!(about["meaning"].is_string(), "{name}: {about}");
    }
    assert_eq!(about["fell_at_s"]["unit"], "s");
    assert_eq!(about["peak_torque_n_m"]["unit"], "N m");
    assert_eq!(about["outcome"]["unit"], Value::Null);
    for (name, expected, words) in [
        (
            "left_sole_moment_x_n_m",
            Some("N m"),
            "moment about its centre",
        ),
        ("com_vel_y_m_s_est", Some("m/s"), "its estimated velocity"),
        (
            "q_ref_left_knee",
            Some("rad"),
            "joint angle that is commanded",
        ),
        (
            "in_cpi_set",
            None,
            "1 if some set holds the estimated state",
        ),
    ] {
        assert_eq!(unit(name), expected, "{name}");
        assert!(
            meaning(name).unwrap().contains(words),
            "{name}: {:?}",
            meaning(name)
        );
    }
    assert_eq!(meaning("zmp_z_m"), None);
}

#[cfg(unix)]
#[test]
fn the_report_of_a_result_is_opened_or_named() {
    use std::os::unix::fs::PermissionsExt;

    let dir = folder();
    standfast(dir.path(), &short(&[FEW])).success();
    let report = fs::canonicalize(dir.path().join("out/report.html")).unwrap();
    // The program that is started instead of a browser writes down the page that it is to show.
    let browser = dir.path().join("xdg-open");
    fs::write(
        &browser,
        "#!/bin/sh\necho \"$1\" > opened.part\nmv opened.part opened\n",
    )
    .unwrap();
    fs::set_permissions(&browser, fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!(
        "{}:{}",
        dir.path().display(),
        std::env::var("PATH").unwrap()
    );
    let open = |display: &str, what: &str| {
        let mut command = Command::new(PROGRAM);
        command
            .current_dir(dir.path())
            .args(["open", what])
            .env("PATH", &path)
            .env("DISPLAY", display);
        Run::of(command.env_remove("WAYLAND_DISPLAY").env_remove("BROWSER"))
    };
    assert_eq!(
        stdout(&open("", "out").success()),
        format!("{}\n", report.display())
    );
    assert!(
        !dir.path().join("opened").exists(),
        "a browser without a display"
    );
    assert_eq!(
        stdout(&open(":7", "out").success()),
        format!("{}\n", report.display())
    );
    let opened = dir.path().join("opened");
    for _ in 0..200 {
        if opened.exists() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    assert_eq!(
        fs::read_to_string(&opened).unwrap().trim(),
        report.to_str().unwrap()
    );

    fs::remove_file(&report).unwrap();
    assert!(stderr(&open("", "out").code(3)).contains("out: there is no report.html, "));
    assert!(stderr(&open("", "nothing").code(2)).contains("nothing/report.html: cannot read: "));
    assert!(
        stderr(&open("", "out/summary.html").code(2)).contains("out/summary.html: cannot read: ")
    );
}
