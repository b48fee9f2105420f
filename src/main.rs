//! The program `standfast`.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    standfast::commands::main()
}
