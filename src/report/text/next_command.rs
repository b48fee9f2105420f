//! The commands that complete a result folder.

use standfast_core::error::Error;
use standfast_files::shell_word;
use standfast_study::Folder;
use std::path::Path;

/// The command that computes the missing trials.
pub fn resume(folder: &Folder) -> String {
    resume_in(&folder.path, folder.asks_for_baseline())
}

fn resume_in(path: &Path, asks_for_baseline: bool) -> String {
    let (file, out) = (word(&path.join("campaign.toml")), word(path));
    let baseline = baseline_option(asks_for_baseline);
    format!("standfast run {file} --out {out}{baseline}")
}

/// The command that joins the finished parts.
pub fn merge(folder: &Folder) -> String {
    let baseline = baseline_option(folder.asks_for_baseline());
    format!("standfast merge {}{baseline}", word(&folder.path))
}

fn word(path: &Path) -> String {
    shell_word(&path.display().to_string())
}

fn baseline_option(asks_for_baseline: bool) -> &'static str {
    if asks_for_baseline {
        " --baseline DIR"
    } else {
        ""
    }
}

/// The error if `gates` are added to a finished campaign whose trials do not decide them.
pub fn undecided(folder: &Folder, gates: &[String]) -> Error {
    let mut command = resume(folder);
    for gate in gates {
        command += &format!(" --gate {}", shell_word(gate));
    }
    let problem = format!(
        "its {} trials do not decide what is asked, and nothing was changed; to continue it, run: {command}",
        folder.trials(),
    );
    Error::Parts {
        path: folder.path.clone(),
        problem,
    }
}

/// An error, with the command that helps if a result folder is not complete.
pub fn told(error: &Error) -> String {
    match error {
        Error::Incomplete {
            path,
            asks_for_baseline,
            ..
        } => {
            let command = resume_in(path, *asks_for_baseline);
            format!("{error}; to complete it, run: {command}")
        }
        Error::LostManifest(path) => format!("{error}, and so does: {}", resume_in(path, false)),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_not_complete_is_told_with_the_command_that_completes_it() {
        let path = || "my res".into();
        let incomplete = Error::Incomplete {
            path: path(),
            problem: "it was stopped before its end".into(),
            asks_for_baseline: true,
        };
        let command = "standfast run 'my res/campaign.toml' --out 'my res'";
        assert_eq!(
            told(&incomplete),
            format!(
                "my res: incomplete: it was stopped before its end; to complete it, run: {command} --baseline DIR"
            )
        );
        let lost = told(&Error::LostManifest(path()));
        assert!(
            lost.ends_with(&format!(", and so does: {command}")),
            "{lost}"
        );
    }
}
