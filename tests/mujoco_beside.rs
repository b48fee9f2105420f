//! A program without MuJoCo continues in the program beside it that has MuJoCo, or says what is missing.
#![cfg(all(unix, not(feature = "mujoco")))]

use crate::common::program::{
    FEW, PROGRAM, Run, SHORT, files, folder, short, standfast, stderr, stdout,
};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The program in a folder without any other program.
fn installed(folder: &Path) -> PathBuf {
    let program = folder.join("bin/standfast");
    fs::create_dir_all(folder.join("bin")).unwrap();
    fs::copy(PROGRAM, &program).unwrap();
    program
}

fn run(program: &Path, folder: &Path, args: &[&str]) -> Run {
    Run::of(
        Command::new(program)
            .current_dir(folder)
            .args(args)
            .env("LD_LIBRARY_PATH", "/none"),
    )
}

#[test]
fn mujoco_is_asked_for_before_anything_runs() {
    let dir = folder();
    standfast(dir.path(), &short(&[FEW])).success();
    let program = installed(dir.path());
    let before = files(dir.path());
    let campaign = |more| [&SHORT[..SHORT.len() - 1], &["--out=other", FEW, more]].concat();
    let checked = |args: &[&'static str]| [args, &["--dry-run"]].concat();
    for args in [
        campaign("--engine=mujoco"),
        campaign("--engine=both"),
        campaign("--set=episode.engine=mujoco"),
        checked(&campaign("--engine=mujoco")),
        checked(&campaign("--set=episode.engine=mujoco")),
        checked(&["push", "--engine=mujoco"]),
        checked(&["limit", "--engine=mujoco"]),
        checked(&["limit", "--engine=both"]),
        vec!["push", "--engine=mujoco"],
        vec!["limit", "--engine=both"],
        vec!["replay", "out", "--trial=1", "--controller=hold@mujoco"],
        vec!["push", "--controller=hold@mujoco"],
    ] {
        let message = stderr(&run(&program, dir.path(), &args).code(2));
        let problem = "engine = mujoco: this program was built without MuJoCo, and there is no standfast-mujoco beside it";
        assert!(
            message.contains(problem) && message.contains("pip install 'standfast[mujoco]'"),
            "{args:?}: {message}"
        );
        assert!(message.contains("--features mujoco"), "{args:?}: {message}");
    }
    assert!(files(dir.path()) == before, "something was written");
}

#[test]
fn a_command_goes_on_in_the_program_beside_which_finds_its_library() {
    let dir = folder();
    let program = installed(dir.path());
    let beside = dir.path().join("bin/standfast-mujoco");
    fs::write(
        &beside,
        "#!/bin/sh\necho \"$LD_LIBRARY_PATH\"\nprintf '<%s>' \"$@\"\nexit 7\n",
    )
    .unwrap();
    fs::set_permissions(&beside, fs::Permissions::from_mode(0o755)).unwrap();
    let args = [&SHORT[..], &["--trials=3", "--engine=mujoco"]].concat();

    let missing = stderr(&run(&program, dir.path(), &args).code(2));
    assert!(
        missing.contains("its library libmujoco.so.3.17.0 is not installed; accepted: rapier"),
        "{missing}"
    );

    let package = dir.path().join("lib/python3.12/site-packages/mujoco");
    fs::create_dir_all(&package).unwrap();
    fs::write(package.join("libmujoco.so.4.0.0"), "").unwrap();
    let other = stderr(&run(&program, dir.path(), &args).code(2));
    assert!(
        other.contains("is not installed; there is libmujoco.so.4.0.0; accepted: "),
        "{other}"
    );
    assert!(other.contains("pip install mujoco==3.17.0"), "{other}");

    fs::write(package.join("libmujoco.so.3.17.0"), "").unwrap();
    let went_on = stdout(&run(&program, dir.path(), &args).code(7));
    let expected: String = args.iter().map(|arg| format!("<{arg}>")).collect();
    let package = fs::canonicalize(&package).unwrap();
    assert_eq!(went_on, format!("{}:/none\n{expected}", package.display()));
    // Another engine needs no program with MuJoCo.
    run(
        &program,
        dir.path(),
        &["push", "--controller=hold", "--set=episode.horizon_s=1"],
    )
    .success();
}
