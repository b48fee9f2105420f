//! MuJoCo as a program of its own. Nothing can be linked to a library that may be absent, so `standfast` has no MuJoCo,
//! and starts everywhere. A command that asks for MuJoCo goes on in `standfast-mujoco`: the same program, built with
//! the feature `mujoco`, in the same folder. `standfast` tells it where the library is, which comes with the Python
//! package `mujoco`.

use standfast_core::error::Error;
use standfast_sim::MUJOCO_VERSION;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

const MUJOCO_PROGRAM: &str = "standfast-mujoco";
/// How a user without MuJoCo gets it.
pub const HOW_TO_GET: &str = "`pip install 'standfast[mujoco]'`, or from the source `eval \"$(.ci/mujoco)\"` and `cargo build \
                              --release --features mujoco --bin standfast-mujoco`";
/// Where the system's loader looks for libraries first.
const LOADER_PATH: &str = "LD_LIBRARY_PATH";

/// Runs this command again in the program with MuJoCo, in the place of this one. Errors say what is missing.
pub fn go_on() -> Result<ExitCode, Error> {
    let lacks = |problem: String, remedy: &str| {
        Error::value("engine", "--engine", "mujoco", problem, remedy)
    };
    let program = std::env::current_exe().map_err(|source| Error::Read {
        path: "standfast".into(),
        source,
    })?;
    let beside = program.with_file_name(MUJOCO_PROGRAM);
    if !beside.is_file() {
        return Err(lacks(
            format!(
                "this program was built without MuJoCo, and there is no {MUJOCO_PROGRAM} beside it"
            ),
            &format!("rapier; for mujoco, {HOW_TO_GET}"),
        ));
    }
    let library = format!("libmujoco.so.{MUJOCO_VERSION}");
    let folders = folders(&program);
    let Some(folder) = folders
        .iter()
        .find(|folder| folder.join(&library).is_file())
    else {
        let others = folders.iter().flat_map(|folder| versions(folder)).next();
        let other = others.map_or(String::new(), |other| format!("; there is {other}"));
        let packages =
            format!("rapier; for mujoco, `pip install mujoco=={MUJOCO_VERSION}` beside standfast");
        return Err(lacks(
            format!("its library {library} is not installed{other}"),
            &packages,
        ));
    };
    let mut path = OsString::from(folder);
    if let Some(before) = std::env::var_os(LOADER_PATH) {
        path.push(":");
        path.push(before);
    }
    replace(
        Command::new(beside)
            .args(std::env::args_os().skip(1))
            .env(LOADER_PATH, path),
    )
}

/// Whether the program with MuJoCo lies beside this one.
pub fn is_beside() -> bool {
    std::env::current_exe().is_ok_and(|program| program.with_file_name(MUJOCO_PROGRAM).is_file())
}

/// The program that a user calls: this one, or the one beside it for which it stands in.
pub fn called() -> std::io::Result<PathBuf> {
    let program = std::env::current_exe()?;
    let plain = program.with_file_name("standfast");
    Ok(if program.ends_with(MUJOCO_PROGRAM) && plain.is_file() {
        plain
    } else {
        program
    })
}

/// Where the library may lie, seen from the program `PREFIX/bin/standfast`: in the Python package of the same
/// environment; where the program was built, in `target/mujoco`; and where the system's loader looks.
fn folders(program: &Path) -> Vec<PathBuf> {
    let prefix = program
        .parent()
        .and_then(Path::parent)
        .unwrap_or(Path::new("/"));
    let mut pythons = Vec::new();
    for lib in ["lib", "lib64"] {
        for entry in std::fs::read_dir(prefix.join(lib))
            .into_iter()
            .flatten()
            .flatten()
        {
            if entry.file_name().to_string_lossy().starts_with("python3") {
                pythons.push(entry.path());
            }
        }
    }
    pythons.sort();
    let mut folders = Vec::new();
    for python in pythons {
        for packages in ["site-packages", "dist-packages"] {
            folders.push(python.join(packages).join("mujoco"));
        }
    }
    folders.push(prefix.join("mujoco"));
    let named = std::env::var_os(LOADER_PATH).unwrap_or_default();
    folders.extend(std::env::split_paths(&named));
    folders
}

/// MuJoCo's libraries in a folder.
fn versions(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names
        .filter(|name| name.starts_with("libmujoco.so."))
        .collect()
}

#[cfg(unix)]
fn replace(command: &mut Command) -> Result<ExitCode, Error> {
    use std::os::unix::process::CommandExt;
    // `exec` returns only if it fails.
    let source = command.arg0("standfast").exec();
    Err(Error::Read {
        path: command.get_program().into(),
        source,
    })
}

#[cfg(not(unix))]
fn replace(command: &mut Command) -> Result<ExitCode, Error> {
    let status = command.status().map_err(|source| Error::Read {
        path: MUJOCO_PROGRAM.into(),
        source,
    })?;
    Ok(ExitCode::from(
        u8::try_from(status.code().unwrap_or(1)).unwrap_or(1),
    ))
}
