//! `standfast new`: writes what to begin with, as it is compiled in: a commented file, or a folder of controllers in
//! Python or C++.

use super::arguments::check_output;
use super::terminal::note;
use standfast_core::error::{Error, Result};
use standfast_files::assets::{self, CPP, InputKind, PYTHON};
use standfast_files::{shell_word, write_atomic};
use standfast_sim::push::three_digits;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  standfast new campaign my.toml                    then: standfast run my.toml
  standfast new controller mine.toml                then: standfast push --controller mine.toml
  standfast new python controllers                  then: standfast push --controller controllers/ankles.toml
  standfast new cpp controllers                     then: g++ as the files say, and push

The campaign is a copy of `standard` with numbers of three digits, and the controller one
of `switching`, with their comments. The folder has two controllers, in Python or in C++. For the settings of a robot there is
`standfast init`.")]
pub struct NewArgs {
    /// What to write
    #[arg(value_parser = ["campaign", "controller", "python", "cpp"])]
    pub what: String,
    /// File to write, or folder for python and cpp, which must not be there yet
    #[arg(value_name = "FILE.toml|DIR")]
    pub file: PathBuf,
}

pub fn run(args: &NewArgs) -> Result<ExitCode> {
    let path = &args.file;
    if path.exists() {
        let (problem, accepted) = (
            "this is there already",
            "a file or folder that is not there yet",
        );
        return Err(Error::option(
            "FILE.toml|DIR",
            path.display(),
            problem,
            accepted,
        ));
    }
    let word = shell_word(&path.to_string_lossy());
    let of_language = match args.what.as_str() {
        "python" => Some((PYTHON, String::new())),
        "cpp" => Some((
            CPP,
            format!("(cd {word} && g++ -O2 -std=c++17 -o ankles ankles.cpp) && "),
        )),
        _ => None,
    };
    if let Some((files, first)) = of_language {
        for (name, text) in files {
            write_atomic(&path.join(name), text.as_bytes())?;
        }
        let then = format!("{first}standfast push --controller {word}/ankles.toml");
        note(&format!(
            "written: {word}, with two controllers; then: {then}"
        ));
        return Ok(ExitCode::SUCCESS);
    }
    check_output("FILE.toml", path, &["toml"])?;
    let (kind, from, use_it) = match args.what.as_str() {
        "campaign" => (InputKind::Campaign, "standard", "run"),
        _ => (InputKind::Controller, "switching", "push --controller"),
    };
    // Results and tables name a controller or campaign by `name`, so the name is the file's.
    let name = |name: &str| format!("\nname = {}\n", toml::Value::String(name.into()));
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let text = assets::open(kind, from)?
        .text
        .replacen(&name(from), &name(&stem), 1);
    let (text, how) = match kind {
        InputKind::Campaign => (in_round_numbers(&text), ", its numbers rounded,"),
        _ => (text, ""),
    };
    write_atomic(path, text.as_bytes())?;
    note(&format!(
        "written: {word}, a copy of `{from}`{how} to be edited; then: standfast {use_it} {word}"
    ));
    Ok(ExitCode::SUCCESS)
}

/// The text of a campaign, with three significant digits for each of its numbers that has more: those in units of a
/// robot were converted once.
fn in_round_numbers(text: &str) -> String {
    let mut rounded = String::new();
    for line in text.split_inclusive('\n') {
        let (code, comment) = line.split_at(line.find('#').unwrap_or(line.len()));
        for piece in code.split_inclusive(|c: char| !(c.is_ascii_digit() || c == '.')) {
            let digits = piece.trim_end_matches(|c: char| !c.is_ascii_digit());
            match digits.parse() {
                Ok(number) if digits.contains('.') && three_digits(number) != number => {
                    rounded += &format!("{}{}", three_digits(number), &piece[digits.len()..]);
                }
                _ => rounded += piece,
            }
        }
        rounded += comment;
    }
    rounded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_new_campaign_have_three_digits_and_nothing_else_changes() {
        let text = "a = { uniform = [-0.16132, 2.5413] } # 0.16132\nb = 1.05\nc_2 = 180.0\nd = 100000\ne = 0.0\n";
        let round = "a = { uniform = [-0.161, 2.54] } # 0.16132\nb = 1.05\nc_2 = 180.0\nd = 100000\ne = 0.0\n";
        assert_eq!(in_round_numbers(text), round);
    }
}
