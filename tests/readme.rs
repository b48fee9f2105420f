//! The commands in the README, the guide and the help are valid, as far as this can be checked without running them:
//! files, names, keys and gates are checked, and not only the options. Links lead somewhere, and a shown output is
//! true.

#[path = "readme/shown.rs"]
mod shown;

use crate::common::program::{folder, standfast, stderr, stdout};
use rayon::prelude::*;
use shown::{commands_of, documents, words_of};
use standfast::files::assets::PYTHON;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Commands that can check everything without running. For all other commands, only the options are checked.
const CHECKED: [&str; 6] = ["run", "push", "limit", "ceiling", "tune", "card"];
/// Commands that first try whether the robot stands. This is left out here, because it would take most of the time.
const TRYING: [&str; 5] = ["run", "limit", "ceiling", "tune", "card"];
const COMMANDS: [&str; 16] = [
    "card", "ceiling", "run", "merge", "compare", "status", "push", "replay", "limit", "check",
    "cpi", "model", "view", "slurm", "init", "tune",
];

fn root() -> PathBuf {
    env!("CARGO_MANIFEST_DIR").into()
}

/// The commands of the examples in the help of a command.
fn examples_of(command: &str) -> Vec<String> {
    let help = stdout(&standfast(Path::new("."), &[command, "--help"]).success());
    help.lines()
        .filter_map(|line| line.strip_prefix("  standfast "))
        .map(|rest| format!("standfast {rest}"))
        .collect()
}

/// A folder with the files that a reader of these commands has.
fn reader() -> TempDir {
    let dir = folder();
    let put = |asset: &str, name: &str, file: &str| {
        let text = fs::read_to_string(root().join("assets").join(asset)).unwrap();
        let old = text
            .lines()
            .find(|line| line.starts_with("name = "))
            .unwrap();
        fs::write(
            dir.path().join(file),
            text.replacen(old, &format!("name = '{name}'"), 1),
        )
        .unwrap();
    };
    put("campaigns/smoke.toml", "my", "my.toml");
    put("controllers/switching.toml", "mine", "mine.toml");
    fs::create_dir(dir.path().join("controllers")).unwrap();
    for (file, text) in PYTHON {
        fs::write(dir.path().join("controllers").join(file), text).unwrap();
    }
    // A robot of our own replaces the public one.
    let public = dir.path().join("unitree_ros/robots/h1_description/urdf");
    fs::create_dir_all(&public).unwrap();
    let child = root().join("assets/robots/child.urdf");
    fs::copy(&child, public.join("h1.urdf")).unwrap();
    fs::copy(&child, dir.path().join("g1.urdf")).unwrap();
    let settings = standfast(dir.path(), &["init", "g1.urdf", "--dry-run"]).success();
    fs::write(dir.path().join("theirs.toml"), stdout(&settings)).unwrap();
    fs::create_dir_all(dir.path().join("assets/robots")).unwrap();
    fs::copy(&child, dir.path().join("assets/robots/child.urdf")).unwrap();
    dir
}

/// Creates the earlier result with which a command compares, unless it exists.
fn put_baseline(words: &[String], folder: &Path) {
    let Some(at) = words.iter().position(|word| word == "--baseline") else {
        return;
    };
    if !folder.join(&words[at + 1]).exists() && !is_public(&words[at + 1]) {
        let few = [
            "run",
            "standard",
            "--trials=1",
            "--controller=hold",
            "--controller=catch",
            "--replays=0",
            "--out",
        ];
        standfast(folder, &[&few[..], &[&words[at + 1]]].concat()).success();
    }
}

/// Whether a result of this name is compiled in. Its robot is not here, so commands beside it are not checked.
fn is_public(name: &str) -> bool {
    name.ends_with("-public")
}

/// The reason why a command is not valid. It is None if the command is valid.
fn wrong(command: &str, folder: &Path) -> Option<String> {
    let words = words_of(&command.replace("${{ matrix.k }}", "1"));
    let is_among = |names: &[&str]| {
        words
            .get(1)
            .is_some_and(|name| names.contains(&name.as_str()))
    };
    // Arguments are parsed before help is printed, so an unknown one or an invalid value is an error.
    // In a program without MuJoCo, entrants in that engine are no more than arguments.
    let is_checked = (cfg!(feature = "mujoco") || !command.contains("@mujoco"))
        && !words.iter().any(|word| is_public(word));
    let only = if is_checked && is_among(&CHECKED) {
        "--dry-run"
    } else {
        "--help"
    };
    let untried = (is_checked && is_among(&TRYING)).then_some("--untried");
    // In a program without MuJoCo the rest of the command can still be checked.
    let there = |word| {
        if cfg!(feature = "mujoco") || !["mujoco", "both"].contains(&word) {
            word
        } else {
            "rapier"
        }
    };
    let given = words[1..]
        .iter()
        .map(|word| there(word))
        .filter(|word| *word != only && Some(*word) != untried);
    put_baseline(&words, folder);
    let args: Vec<&str> = given.chain([only]).chain(untried).collect();
    let run = standfast(folder, &args);
    (!run.get_output().status.success()).then(|| format!("{command}: {}", stderr(&run)))
}

#[test]
#[ignore = "runs every command of README and guide, over a minute"]
fn every_command_that_is_shown_is_good() {
    let shown = documents(&root())
        .into_iter()
        .flat_map(|path| commands_of(&fs::read_to_string(path).unwrap(), "standfast"));
    let (shown, examples): (Vec<_>, Vec<_>) = (
        shown.collect(),
        COMMANDS.into_iter().flat_map(examples_of).collect(),
    );
    assert!(
        shown.len() > 40 && examples.len() > 30,
        "only {} and {} found",
        shown.len(),
        examples.len()
    );
    let dir = reader();
    let all: Vec<String> = shown.into_iter().chain(examples).collect();
    let wrong: Vec<String> = all
        .par_iter()
        .filter_map(|command| wrong(command, dir.path()))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The test above can fail because of names inside of a command, and not only because of its options.
#[test]
fn a_command_that_is_wrong_inside_is_not_good() {
    let dir = folder();
    for (command, words) in [
        ("standfast run --gate nonsense", "gate = nonsense"),
        (
            "standfast run --set foo=bar",
            "--set: foo = bar: unknown key",
        ),
        ("standfast run --gate nonsense --set foo=bar", "foo"),
        (
            "standfast run --gate 'best >= 0.8'",
            "no controller is named `best`",
        ),
        (
            "standfast run --controller hold --until-resolved",
            "nothing to decide",
        ),
        (
            "standfast run --vary paper:stepping.beta=2",
            "stepping.beta",
        ),
        ("standfast run missing.toml", "missing.toml: cannot read"),
        (
            "standfast push --impulse 2 --controller best",
            "controller \"best\" not found",
        ),
        (
            "standfast push --impulse 2 --trace push.txt",
            "--trace = push.txt: unknown kind",
        ),
        (
            "standfast limit --headings 0",
            "'0' for '--headings <N>': out of range",
        ),
    ] {
        let told =
            wrong(command, dir.path()).unwrap_or_else(|| panic!("{command} is taken for good"));
        assert!(told.contains(words), "{told}");
        // Without the check it fails in the same way.
        let args = shlex::split(command).unwrap();
        let run = standfast(
            dir.path(),
            &args[1..].iter().map(String::as_str).collect::<Vec<_>>(),
        )
        .code(2);
        assert_eq!(told, format!("{command}: {}", stderr(&run)));
    }
}

/// The guide shows the output of one push: the words equal those of the program, and the numbers nearly so.
#[test]
fn what_a_push_tells_is_what_the_guide_shows() {
    let guide = fs::read_to_string(root().join("src/guide/commands.md")).unwrap();
    let (command, shown) = guide
        .split_once("```console\n$ standfast ")
        .unwrap()
        .1
        .split_once('\n')
        .unwrap();
    let args = shlex::split(command).unwrap();
    let told = stdout(
        &standfast(
            &root(),
            &args.iter().map(String::as_str).collect::<Vec<_>>(),
        )
        .success(),
    );
    let words = |text: &str| {
        text.split_whitespace()
            .map(str::to_string)
            .collect::<Vec<_>>()
    };
    let (shown, told) = (words(shown.split("```").next().unwrap()), words(&told));
    assert_eq!(shown.len(), told.len(), "{told:?}");
    let number = |word: &str| {
        word.trim_matches(|letter| "(),;.".contains(letter))
            .parse::<f64>()
    };
    for (shown, told) in shown.iter().zip(&told) {
        match (number(shown), number(told)) {
            (Ok(a), Ok(b)) => assert!(
                (a - b).abs() <= 0.05 * a.abs() + 0.005,
                "{shown} is {told} now"
            ),
            _ => assert_eq!(shown, told),
        }
    }
}

/// One thing has one name, on pages, in texts and in tables: m omega d (with d in the direction of the push) and the
/// sole impulse are two measures, the pendulum bound is no bound of physics, and what is compared are controllers.
#[test]
fn a_thing_has_one_name() {
    let mut texts = documents(&root());
    texts.extend(
        [
            "assets/python/README.md",
            "src/report/html/report.html.jinja",
        ]
        .map(|file| root().join(file)),
    );
    for folder in [
        "assets/campaigns",
        "src/report/text",
        "src/report/tables",
        "src/report/figure",
        "src/study/verdict",
    ] {
        texts.extend(
            fs::read_dir(root().join(folder))
                .unwrap()
                .map(|entry| entry.unwrap().path()),
        );
    }
    assert!(texts.len() > 60, "{texts:?}");
    for path in texts {
        // A sentence may continue in the next line.
        let text = fs::read_to_string(&path).unwrap();
        let words = text
            .split_whitespace()
            .filter(|word| *word != "\\")
            .collect::<Vec<_>>()
            .join(" ");
        for wrong in [
            "m w d",
            "m&omega;d",
            "m\u{3c9}d",
            "m omega d with half",
            "1 m omega d = ",
            "bound that physics sets",
            "bound of a pendulum",
            "bounds of a pendulum",
            "bounds of the pendulum",
            "pendulum's bound",
            "two sets end",
            "which set is better",
            "pair of gain sets",
        ] {
            assert!(!words.contains(wrong), "{}: {wrong:?}", path.display());
        }
    }
    for file in [
        "README.md",
        "src/guide/limits.md",
        "src/guide/measured.md",
        "assets/python/README.md",
    ] {
        let words = fs::read_to_string(root().join(file))
            .unwrap()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        assert!(
            words.contains("pendulum bound") && words.to_lowercase().contains("a robot can pass"),
            "{file}"
        );
    }
}

/// The files that the README names exist, or are made by the line above.
#[test]
fn the_commands_of_the_readme_make_the_files_that_they_name() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let commands = commands_of(&readme, "standfast");
    let made: Vec<Vec<String>> = commands
        .iter()
        .map(|command| words_of(command))
        .filter(|words| words.get(1).is_some_and(|word| word == "new"))
        .collect();
    let dir = folder();
    for words in &made {
        standfast(
            dir.path(),
            &words[1..].iter().map(String::as_str).collect::<Vec<_>>(),
        )
        .success();
    }
    let own = commands
        .iter()
        .flat_map(|command| words_of(command))
        .filter(|word| word.ends_with(".toml"));
    let own: Vec<String> = own.filter(|word| !word.contains('/')).collect();
    assert!(own.len() >= 4 && made.len() >= 2, "{own:?} {made:?}");
    for file in own {
        assert!(
            dir.path().join(&file).is_file(),
            "{file} is made by no command of the README"
        );
    }
    let run = commands
        .iter()
        .map(|command| words_of(command))
        .find(|words| words[1] == "run" && words[2] == "my.toml")
        .unwrap();
    let args: Vec<&str> = run[1..]
        .iter()
        .map(String::as_str)
        .chain(["--dry-run", "--untried"])
        .collect();
    standfast(dir.path(), &args).success();
}

/// Targets of a document's links: the targets in its text, and the targets in the list at its end.
fn targets_of(document: &str) -> impl Iterator<Item = &str> {
    let inline = document
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    inline.chain(
        document
            .lines()
            .filter_map(target_at_the_end)
            .map(|(_, target)| target),
    )
}

/// A line `[name]: target` of the list of targets.
fn target_at_the_end(line: &str) -> Option<(&str, &str)> {
    line.strip_prefix('[')?.split_once("]: ")
}

/// The anchors of a document's headings.
fn anchors_of(document: &str) -> Vec<String> {
    let mut in_block = false;
    let headings = document.lines().filter(|line| {
        in_block ^= line.starts_with("```");
        !in_block && line.starts_with('#')
    });
    let kept = |letter: &char| letter.is_alphanumeric() || [' ', '-', '_'].contains(letter);
    let name = |heading: &str| heading.trim_start_matches('#').trim().to_lowercase();
    headings
        .map(|heading| {
            name(heading)
                .chars()
                .filter(kept)
                .collect::<String>()
                .replace(' ', "-")
        })
        .collect()
}

/// The reason why a link of a document is broken. It is None if the link is not broken.
fn leads_nowhere(target: &str, path: &Path) -> Option<String> {
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let other = if file.is_empty() {
        path.to_path_buf()
    } else {
        path.parent().unwrap().join(file)
    };
    let problem = if !other.is_file() {
        "is not there"
    } else if !anchor.is_empty()
        && !anchors_of(&fs::read_to_string(other).unwrap())
            .iter()
            .any(|name| name == anchor)
    {
        "is no heading"
    } else {
        return None;
    };
    Some(format!("{}: {target} {problem}", path.display()))
}

/// The linked pictures, files and headings exist, relative to the folder of each document.
#[test]
fn every_link_of_readme_and_guide_leads_somewhere() {
    let (mut count, mut wrong) = (0, Vec::new());
    for path in documents(&root()) {
        let document = fs::read_to_string(&path).unwrap();
        let targets = targets_of(&document).filter(|target| !target.starts_with("https://"));
        let problems = targets
            .inspect(|_| count += 1)
            .filter_map(|target| leads_nowhere(target, &path));
        wrong.extend(problems);
    }
    assert!(count > 40, "only {count} links");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Without this test, a chapter that rustdoc does not show, a link without a target, and a target that rustdoc does not
/// know would not be noticed.
#[test]
fn rustdoc_shows_every_chapter_with_its_links() {
    let shown = include_str!("../src/guide/mod.rs");
    let list = shown
        .split_once("chapters! {")
        .unwrap()
        .1
        .split_once('}')
        .unwrap()
        .0;
    let chapters: Vec<PathBuf> = documents(&root())
        .into_iter()
        .filter(|path| !path.ends_with("README.md"))
        .collect();
    assert_eq!(chapters.len(), list.split_whitespace().count(), "{list}");
    for path in chapters {
        let name = path.file_stem().unwrap().to_str().unwrap();
        assert!(
            list.split_whitespace().any(|word| word == name),
            "{name} is not among {list}"
        );
        let document = fs::read_to_string(&path).unwrap();
        let named: Vec<&str> = document
            .lines()
            .filter_map(target_at_the_end)
            .map(|(name, _)| name)
            .collect();
        for link in document
            .split("][")
            .skip(1)
            .filter_map(|rest| rest.split(']').next())
        {
            assert!(
                named.contains(&link),
                "{name}: [{link}] has no target at its end"
            );
        }
        for link in named {
            assert!(
                shown.contains(&format!("\"[{link}]: ")),
                "{name}: src/guide/mod.rs has no [{link}]"
            );
        }
    }
    for file in shown
        .lines()
        .filter_map(|line| line.split_once("]: ../")?.1.strip_suffix("\"]"))
    {
        let file = file.trim_start_matches("../");
        assert!(root().join(file).is_file(), "{file} is not there");
    }
}
