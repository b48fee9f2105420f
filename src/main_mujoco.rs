//! The program `standfast-mujoco`, which `standfast` runs if a command asks for MuJoCo ([`standfast::commands`]).

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    standfast::commands::main()
}
