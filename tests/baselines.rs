//! Packed results, by the program from outside: those that a user makes, and those that are compiled in.

use crate::common::program::{SEVERAL_PARTS, files, folder, short, standfast, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// The names of the results that are compiled in.
const PUBLIC: [&str; 3] = ["g1-public", "h1-public", "t1-public"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A folder with a packed result of `hold`, and without what it was packed from.
fn packed() -> tempfile::TempDir {
    let dir = folder();
    standfast(dir.path(), &short(&[SEVERAL_PARTS])).success();
    let pack = ["merge", "out", "--replays=0", "--pack=packed"];
    standfast(dir.path(), &pack).success();
    fs::remove_dir_all(dir.path().join("out")).unwrap();
    dir
}

/// The campaign of the packed result with these controllers and more arguments.
fn beside<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let args = [
        "run",
        "smoke",
        "--controller=hold",
        "--controller=fixed",
        "--replays=0",
        "--baseline=packed",
        "--out=new",
    ];
    [&args[..], more].concat()
}

/// Another robot, whose file and settings are those of UT-mu2 with some text exchanged.
fn robot_with(from: &str, to: &str, folder: &Path) -> PathBuf {
    let robot = folder.join("other.urdf");
    for extension in ["urdf", "toml"] {
        let ours = root().join(format!("assets/robots/ut-mu2.{extension}"));
        let text = fs::read_to_string(ours).unwrap();
        fs::write(robot.with_extension(extension), text.replace(from, to)).unwrap();
    }
    robot
}

#[test]
fn a_packed_result_is_a_baseline_without_files_of_robot_and_controllers() {
    let dir = packed();
    let kept: Vec<String> = files(&dir.path().join("packed")).into_keys().collect();
    assert_eq!(kept, ["parts/campaign.json", "parts/part-000000.parquet"]);
    // The pushes are those of the packed result, although the campaign has others.
    let run = standfast(
        dir.path(),
        &beside(&["--json", "--gate=hold >= baseline - 0.2"]),
    )
    .success();
    let said = stderr(&run);
    assert!(
        said.contains("the robot is that of packed: all its"),
        "{said}"
    );
    let found: Value = serde_json::from_str(&stdout(&run)).unwrap();
    let names: Vec<&str> = found["controllers"]
        .as_array()
        .unwrap()
        .iter()
        .map(|controller| controller["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["hold", "fixed", "hold (packed)"]);
    assert_eq!(found["trials"], 26);
    assert!(dir.path().join("new/beside/report.html").is_file());
    let pairs = found["pairs"].as_array().unwrap();
    let own = pairs
        .iter()
        .find(|pair| {
            [&pair["a"], &pair["b"]]
                .iter()
                .all(|name| name.as_str().unwrap().starts_with("hold"))
        })
        .unwrap();
    // The pair of ours, and each of ours with the packed one.
    assert_eq!((pairs.len(), &own["discordant"]), (3, &0.into()));
    assert_eq!(found["gates"].as_array().unwrap().len(), 1);
    let place = "Among the 1 of packed, hold would be number 1 by its rate: not told apart from hold (packed). Among";
    let headline = found["headline"].as_str().unwrap();
    assert!(headline.starts_with(place), "{headline}");
    // It can be compared later, too, and printed, but not replayed.
    let compared = standfast(dir.path(), &["compare", "new", "packed", "--out=page"]).success();
    assert!(
        !stdout(&compared).contains("--controller hold\\ "),
        "{}",
        stdout(&compared)
    );
    let page = fs::read_to_string(dir.path().join("page/report.html")).unwrap();
    assert!(page.contains("has no files of hold to replay trial"));
    standfast(dir.path(), &["status", "packed", "--full"]).success();
    let replay = standfast(dir.path(), &["replay", "packed", "--trial=0"]).code(3);
    assert!(
        stderr(&replay).contains("it cannot be replayed"),
        "{}",
        stderr(&replay)
    );
    let merge = standfast(dir.path(), &["merge", "packed"]).code(3);
    assert!(
        stderr(&merge).contains("it cannot be merged again"),
        "{}",
        stderr(&merge)
    );
    // A folder comes before what is compiled in.
    fs::rename(dir.path().join("packed"), dir.path().join("h1-public")).unwrap();
    let status = standfast(dir.path(), &["status", "h1-public", "--full"]).success();
    assert!(stdout(&status).contains("26 trials"), "{}", stdout(&status));
}

#[test]
fn a_robot_counts_as_the_same_by_its_values() {
    let dir = packed();
    // As a file rounds it.
    let robot = robot_with("2.983032", "2.9831", dir.path());
    let robot = format!("--robot={}", robot.display());
    let run = standfast(dir.path(), &beside(&[&robot])).success();
    assert!(stderr(&run).contains("all its"), "{}", stderr(&run));
    fs::remove_dir_all(dir.path().join("new")).unwrap();
    robot_with("2.983032", "3.2", dir.path());
    let run = standfast(dir.path(), &beside(&[&robot])).success();
    let said = stderr(&run);
    assert!(
        said.contains("the robot is not that of packed") && said.contains("mass_kg is "),
        "{said}"
    );
    assert!(stdout(&run).contains("the robot is not that of packed"));
    fs::remove_dir_all(dir.path().join("new")).unwrap();
    robot_with("left_knee", "left_kneecap", dir.path());
    let refused = standfast(dir.path(), &beside(&[&robot])).code(3);
    let said = stderr(&refused);
    assert!(
        said.contains("its robot has other joints: left_knee"),
        "{said}"
    );
    assert!(!dir.path().join("new").exists());
}

#[test]
fn a_baseline_of_other_trials_or_engines_and_a_taken_folder_are_refused() {
    let dir = packed();
    for (more, code, expected) in [
        (&["--set=push.height_m=0.01"][..], 3, "push.height_m is"),
        (&["--seed=9"], 3, "seed is 1 there and 9 here"),
        (&["--baseline=g2-public"], 3, "one of g1-public, h1-public"),
        (
            &["--until-resolved"],
            2,
            "beside a packed baseline all trials are run",
        ),
    ] {
        let args = beside(more);
        let args: Vec<&str> = match more[0].starts_with("--baseline") {
            true => args
                .into_iter()
                .filter(|arg| *arg != "--baseline=packed")
                .collect(),
            false => args,
        };
        let run = standfast(dir.path(), &args).code(code);
        assert!(
            stderr(&run).contains(expected),
            "{more:?}: {}",
            stderr(&run)
        );
        assert!(!dir.path().join("new").exists(), "{more:?} wrote something");
    }
    standfast(dir.path(), &short(&["--trials=1"])).success();
    let again = ["merge", "out", "--replays=0", "--pack=packed"];
    let run = standfast(dir.path(), &again).code(3);
    assert!(
        stderr(&run).contains("a new or an empty folder"),
        "{}",
        stderr(&run)
    );
}

#[cfg(feature = "mujoco")]
#[test]
fn a_run_in_one_engine_is_compared_with_the_entrants_in_that_engine() {
    let dir = folder();
    standfast(dir.path(), &short(&["--engine=both", "--trials=5"])).success();
    let pack = ["merge", "out", "--replays=0", "--pack=packed"];
    standfast(dir.path(), &pack).success();
    for (engine, expected) in [
        ("rapier", &["hold", "fixed", "hold (packed)"][..]),
        (
            "both",
            &[
                "hold@rapier",
                "hold@mujoco",
                "fixed@rapier",
                "fixed@mujoco",
                "hold@rapier (packed)",
                "hold@mujoco (packed)",
            ],
        ),
    ] {
        let engine = format!("--engine={engine}");
        let run = standfast(dir.path(), &beside(&[&engine, "--json"])).success();
        let found: Value = serde_json::from_str(&stdout(&run)).unwrap();
        let controllers = found["controllers"].as_array().unwrap();
        let names: Vec<&str> = controllers
            .iter()
            .map(|own| own["name"].as_str().unwrap())
            .collect();
        assert_eq!(names, expected);
        // Each of ours has a pair with each other one of ours, and with the packed one in its engine.
        let own = expected.len() * 2 / 3;
        let pairs = found["pairs"].as_array().unwrap().len();
        assert_eq!(pairs, own * (own - 1) / 2 + own);
        fs::remove_dir_all(dir.path().join("new")).unwrap();
    }
}

/// Their rows are read as those of any result: the pushes are what their campaigns draw, to the bit.
#[test]
fn what_is_compiled_in_is_whole_and_the_guide_has_its_page() {
    let dir = folder();
    for name in PUBLIC {
        let status = standfast(dir.path(), &["status", name, "--full"]).success();
        assert!(stdout(&status).contains("500 trials"), "{name}");
        assert!(files(dir.path()).is_empty(), "{name} wrote something");
    }
    let page = standfast(dir.path(), &["docs", "baselines"]).success();
    let chapter = fs::read_to_string(root().join("src/guide/baselines.md")).unwrap();
    assert_eq!(
        stdout(&page),
        chapter,
        "`standfast docs baselines` writes it"
    );
}

/// A controller of this program falls and stands in the same trials as in the result that is compiled in. If not, the physics
/// or the controller has changed: `.ci/baselines` measures the public policies again.
#[test]
fn the_rows_of_the_g1_are_those_of_this_build() {
    let shared = root().join("../shared/data/robots/g1");
    if !shared.is_dir() {
        eprintln!("left out: there is no G1");
        return;
    }
    let dir = folder();
    let meshes = dir.path().join("meshes");
    fs::create_dir(&meshes).unwrap();
    for mesh in fs::read_dir(shared.join("meshes"))
        .unwrap()
        .map(Result::unwrap)
    {
        fs::copy(mesh.path(), meshes.join(mesh.file_name())).unwrap();
    }
    let urdf = shared.join("g1_29dof_rev_1_0.urdf");
    fs::copy(urdf, dir.path().join("g1.urdf")).unwrap();
    standfast(dir.path(), &["init", "g1.urdf"]).success();
    let run = [
        "run",
        "standard",
        "--robot=g1.urdf",
        "--controller=hold",
        "--controller=catch",
        "--baseline=g1-public",
        "--trials=4",
        "--replays=0",
        "--json",
    ];
    let run = standfast(dir.path(), &run).success();
    assert!(
        stderr(&run).contains("the robot is that of g1-public"),
        "{}",
        stderr(&run)
    );
    let found: Value = serde_json::from_str(&stdout(&run)).unwrap();
    let count = |name: &str| {
        let mut controllers = found["controllers"].as_array().unwrap().iter();
        let found = controllers.find(|controller| controller["name"] == name);
        found.unwrap()["count"].clone()
    };
    for name in ["hold", "catch"] {
        assert_eq!(count(name), count(&format!("{name} (g1-public)")), "{name}");
    }
}
