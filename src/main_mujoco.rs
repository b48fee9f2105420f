//! The program `standfast-mujoco`: what `standfast` runs where a command asks for MuJoCo ([`standfast::commands`]).

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    standfast::commands::main()
}
