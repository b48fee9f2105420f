//! The paper's scenarios from outside: which foot goes which way, and how it ends.

use crate::common::program::{Run, standfast as run};
use serde_json::Value;
use standfast_paper::scenario::BUILTIN;
use std::{fs, path::Path};

fn program(args: &[&str]) -> Run {
    run(Path::new("."), args)
}

fn json(args: &[&str]) -> Value {
    let assert = program(&[args, &["--json"]].concat()).success();
    serde_json::from_slice(&assert.get_output().stdout).unwrap()
}

/// The first footstep: its foot, how far it went (m; x forward, y left), and whether it landed inside a CPI set.
fn first(result: &Value) -> (&str, [f64; 2], bool) {
    let footstep = &result["footsteps"][0];
    let at = |key: &str, axis: usize| footstep[key][axis].as_f64().unwrap();
    let way = [0, 1].map(|axis| at("to_m", axis) - at("from_m", axis));
    (
        footstep["foot"].as_str().unwrap(),
        way,
        footstep["in_set_at_landing"].as_bool().unwrap(),
    )
}

/// Sect. V.C: for both imposed errors the right foot steps and lands inside a CPI set, and the COM comes home.
#[test]
fn the_imposed_errors_are_made_good() {
    let behind = json(&["scenario", "error-backward"]);
    let (foot, [x, y], inside) = first(&behind);
    assert!(
        foot == "right" && x < -0.1 && y.abs() < 1e-3 && inside,
        "{behind:#}"
    );
    let diagonal = json(&["scenario", "error-diagonal"]);
    let (foot, [x, y], inside) = first(&diagonal);
    assert!(
        foot == "right" && x < -0.02 && y < -0.05 && inside,
        "{diagonal:#}"
    );
    for result in [&behind, &diagonal] {
        assert!(result["home_at_s"].as_f64().unwrap() < 1.0, "{result:#}");
        assert!(
            result["worst_com_error_m"].as_f64().unwrap() < 0.002,
            "{result:#}"
        );
    }
    // One footstep cannot recover from a state that produces the second error.
    let moving = json(&["scenario", "moving-diagonal"]);
    assert!(
        moving["lost_at_s"].is_number() && !first(&moving).2,
        "{moving:#}"
    );
}

/// Sect. VI: pushed from behind, the robot steps forward. Pushed from diagonally forward left, its right foot goes back
/// and to the right.
#[test]
fn the_pushes_of_the_experiment_are_caught_by_a_footstep() {
    let behind = json(&["scenario", "push-behind"]);
    let (_, [x, _], _) = first(&behind);
    assert!(behind["outcome"] == "Recovered" && x > 0.1, "{behind:#}");
    let diagonal = json(&["scenario", "push-diagonal"]);
    let (foot, [x, y], _) = first(&diagonal);
    assert!(
        diagonal["outcome"] == "Recovered" && foot == "right" && x < -0.05 && y < -0.04,
        "{diagonal:#}"
    );
    for name in ["push-behind", "push-diagonal"] {
        assert_eq!(
            json(&["scenario", name, "--controller=switching"])["outcome"],
            "Fell",
            "{name} without a footstep"
        );
    }
}

/// The pushes in physics produce errors close to the two that the paper imposes (m).
#[test]
fn pushes_make_the_errors_of_the_paper() {
    for (name, wanted) in [
        ("push-error-backward", [-0.03, 0.0]),
        ("push-error-diagonal", [-0.03, -0.0685]),
    ] {
        let result = json(&["scenario", name]);
        // The first footstep may be unfinished at the fall.
        let step = result["footsteps"]
            .get(0)
            .unwrap_or(&result["unfinished_footstep"]);
        let error = [0, 1].map(|axis| step["zmp_error_m"][axis].as_f64().unwrap());
        let off = (error[0] - wanted[0]).hypot(error[1] - wanted[1]);
        assert!(off < 0.008, "{name}: {error:?} for {wanted:?}");
    }
}

#[test]
fn scenarios_are_listed_drawn_and_told() {
    let list = program(&["scenario"]).success();
    let text = String::from_utf8_lossy(&list.get_output().stdout).into_owned();
    for name in BUILTIN.map(|(name, _)| name) {
        assert!(text.contains(name), "{name} in\n{text}");
    }
    let dir = tempfile::tempdir().unwrap();
    for name in ["error-backward", "push-behind"] {
        let path = dir.path().join(format!("{name}.svg"));
        let told = program(&["scenario", name, "--plot", path.to_str().unwrap()]).success();
        let told = String::from_utf8_lossy(&told.get_output().stdout).into_owned();
        assert!(
            told.contains("footstep    right") && told.contains("for a ZMP error of ("),
            "{told}"
        );
        let svg = fs::read_to_string(path).unwrap();
        assert!(
            svg.starts_with("<svg")
                && svg.contains("right foot")
                && svg.contains("controller paper")
        );
    }
}

#[test]
fn bad_scenarios_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s.toml");
    let head = "name = 's'\ndescription = ''\ngains = 'paper'\nhorizon_s = 1.0\n";
    let imposed = "[imposed]\nzmp_error_m = [0.03, 0.0]\n";
    for (text, words) in [
        (head.to_string(), "push, imposed = neither"),
        (format!("{head}{imposed}start = 'soon'\n"), "at-rest"),
        (
            format!("{head}[imposed]\nzmp_error_m = [0.0, 0.0]\n"),
            "zmp_error_m = [0, 0]",
        ),
        (
            format!("{head}{imposed}").replace("paper", "switching"),
            "zmp_error_m = [0.03, 0]",
        ),
        (
            format!("{head}{imposed}").replace("1.0", "-1.0"),
            "horizon_s = -1",
        ),
        (
            format!("{head}[imposed]\nzmp_error_m = [-3.0, 0.0]\n"),
            "imposed.zmp_error_m = [-3, 0]",
        ),
        (
            format!("{head}[push]\nimpulse_n_s = -2.0\n"),
            "push.impulse_n_s = -2",
        ),
        (format!("{head}draw_m = 0.1\n[push]\n"), "draw_m = no bob"),
        (
            BUILTIN[8].1.replace("draw_m = 0.8", "draw_m = 3.0"),
            "draw_m = 3",
        ),
        (
            BUILTIN[8].1.replace("mass_kg = 1.0", "mass_kg = 0.0"),
            "push.bob.mass_kg = 0",
        ),
        (
            BUILTIN[8].1.replace("height_m = 0.0", "height_m = 0.8"),
            "push.height_m = 0.8",
        ),
        (
            format!("{head}[push]\nimpulse_n_s = 2.0\nstart_s = 5.0\n"),
            "push.start_s = 5",
        ),
    ] {
        fs::write(&path, &text).unwrap();
        let refused = program(&["scenario", path.to_str().unwrap()]).code(2);
        let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(
            message.contains(words),
            "{message}\nwanted {words} for\n{text}"
        );
    }
}
