//! The program from outside: what it refuses, and what it checks without running.

use crate::common::program::{files, folder, standfast as program, stderr, stdout};

#[test]
fn bad_input_is_one_clear_error_and_nothing_is_written() {
    let dir = folder();
    for (args, expected) in [
        (
            vec!["response", "--controller", "hold"],
            ["kind = posture", "is not a gain set"],
        ),
        (
            vec!["response", "--amplitude", "-1"],
            ["--amplitude = -1", "to 0.05"],
        ),
        (
            vec!["scenario", "error-backward", "--engine=rapier", "--dry-run"],
            ["--engine = rapier", "has no physics"],
        ),
        (
            vec!["scenario", "error-backward", "--trace=t.csv"],
            ["--trace = t.csv", "has no physics"],
        ),
        (
            vec!["scenario", "nothing-like-it"],
            [
                "\"nothing-like-it\" not found",
                "error-backward, error-diagonal",
            ],
        ),
        (
            vec!["scenario", "--plot=p.svg"],
            ["SCENARIO = none", "`standfast-paper scenario` lists"],
        ),
    ] {
        let run = program(dir.path(), &args).code(2);
        let message = stderr(&run);
        assert!(
            message.starts_with("error: ") && stdout(&run).is_empty(),
            "{args:?}: {message}"
        );
        assert!(
            expected.iter().all(|part| message.contains(part)),
            "{args:?}: {message}"
        );
    }
    assert_eq!(files(dir.path()).len(), 0);
}

/// A user who names no known command is shown all commands.
#[test]
fn without_a_command_that_it_knows_it_lists_them() {
    let dir = folder();
    for args in [&[][..], &["walk"]] {
        let help = stderr(&program(dir.path(), args).code(2));
        assert!(
            ["page", "scenario", "response", "published"]
                .iter()
                .all(|name| help.contains(&format!("\n  {name} "))),
            "{help}"
        );
        assert_eq!(help.contains("'walk'"), args.contains(&"walk"), "{help}");
    }
}

#[test]
fn a_check_says_that_all_is_fine_and_writes_nothing() {
    let dir = folder();
    for args in [
        &[
            "scenario",
            "push-behind",
            "--controller=hold",
            "--plot=p.svg",
        ][..],
        &["scenario", "error-backward", "--plot=p.svg"],
        &["scenario"],
    ] {
        let run = program(dir.path(), &[args, &["--dry-run"]].concat()).success();
        assert_eq!(stdout(&run), "", "{args:?}");
        let told = stderr(&run);
        assert!(
            told.starts_with("fine: ") && told.lines().count() == 1,
            "{args:?}: {told}"
        );
    }
    assert_eq!(files(dir.path()).len(), 0);
}

/// A program with MuJoCo accepts the engine that a program without MuJoCo refuses, saying how to get it.
#[test]
fn the_physics_engine_is_chosen_by_its_name() {
    let dir = folder();
    for command in ["scenario", "response"] {
        let message = stderr(&program(dir.path(), &[command, "--engine=bullet"]).code(2));
        assert!(
            message.contains("'bullet' for '--engine <ENGINE>'")
                && message.contains("rapier, mujoco"),
            "{message}"
        );
    }
    let run = program(
        dir.path(),
        &["scenario", "push-behind", "--engine=mujoco", "--dry-run"],
    );
    if cfg!(feature = "mujoco") {
        run.success();
    } else {
        assert!(
            stderr(&run.code(2)).contains("engine = mujoco: this program was built without MuJoCo")
        );
    }
}

/// A pipe without a writer would be waited for without end.
#[cfg(unix)]
#[test]
fn what_is_no_file_is_refused() {
    let dir = folder();
    assert!(
        std::process::Command::new("mkfifo")
            .arg(dir.path().join("pipe.toml"))
            .status()
            .unwrap()
            .success()
    );
    let refused = program(dir.path(), &["scenario", "pipe.toml"]).code(2);
    assert!(
        stderr(&refused).contains("pipe.toml: cannot read: it is no file"),
        "{}",
        stderr(&refused)
    );
}
