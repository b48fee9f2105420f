//! Finds the files to which the command of a process refers. Files in the folder of the controller's file become inputs
//! of a result, and all other names are listed.

use super::companion_files::is_inside;
use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

/// Programs that run other programs or scripts, and belong to the machine like its operating system.
const INTERPRETERS: [&str; 20] = [
    "bash", "bun", "dash", "deno", "env", "java", "julia", "lua", "luajit", "nice", "node",
    "octave", "perl", "pypy", "python", "Rscript", "ruby", "sh", "uv", "zsh",
];
/// Largest number of files in a Python package of a controller.
const MOST_FILES: usize = 1000;

/// The files and names to which a command refers.
#[derive(Debug, Default, PartialEq)]
pub(super) struct CommandFiles {
    /// Files in the folder, by their paths within it.
    pub kept: BTreeSet<String>,
    /// All other names: paths to elsewhere, and programs and modules that are not in the folder.
    pub not_kept: BTreeSet<String>,
}

impl CommandFiles {
    /// Follows a command that is run in `folder`: its words, the modules of Python that it starts, and the imports of
    /// these modules and of `files` from the folder.
    pub fn of(folder: &Path, command: &[String], files: &[String]) -> Self {
        let mut followed = Self::default();
        for file in files {
            followed.keep(folder, file);
        }
        let Some((program, args)) = command.split_first() else {
            return followed;
        };
        followed.program(folder, program);
        let mut is_python = interpreter(program) == "python" || interpreter(program) == "pypy";
        let mut words = args.iter().flat_map(|arg| words(folder, arg));
        while let Some(word) = words.next() {
            match word.strip_prefix("-m").filter(|_| is_python) {
                Some("") => {
                    if let Some(name) = words.next() {
                        followed.module(folder, name);
                    }
                }
                Some(name) => followed.module(folder, name),
                None => followed.word(folder, word),
            }
            is_python |= interpreter(word) == "python";
        }
        for arg in args {
            followed.imports(folder, Path::new(""), arg);
        }
        followed
    }

    /// The first word. A plain name is searched for as a shell does, but a file of that name in the folder is kept.
    fn program(&mut self, folder: &Path, program: &str) {
        if program.contains('/') {
            return self.word(folder, program);
        }
        if !INTERPRETERS.contains(&interpreter(program)) {
            self.not_kept.insert(program.into());
        }
        if folder.join(program).is_file() {
            self.keep(folder, program);
        }
    }

    /// A word that may be a path, or end in one, as in `--config=FILE`.
    fn word(&mut self, folder: &Path, word: &str) {
        let path = word.split_once('=').map_or(word, |(_, value)| value);
        let there = folder.join(path);
        let is_above = Path::new(path)
            .components()
            .any(|part| part == Component::ParentDir);
        if !is_inside(path) {
            let is_named = is_above || there.is_file() || there.is_dir();
            if is_named && !INTERPRETERS.contains(&interpreter(path)) {
                self.not_kept.insert(path.into());
            }
        } else if there.is_file() {
            self.keep(folder, path);
        } else if there.is_dir()
            && plain(path) != Path::new("")
            && !self.package(folder, &plain(path))
        {
            self.not_kept.insert(path.into());
        }
    }

    /// A module that Python starts.
    fn module(&mut self, folder: &Path, name: &str) {
        let first = name.split('.').next().unwrap_or_default();
        if !self.import(folder, Path::new(""), first) {
            self.not_kept.insert(format!("-m {name}"));
        }
    }

    /// Keeps a file of the folder, and the files that it imports.
    fn keep(&mut self, folder: &Path, file: &str) {
        if self.kept.iter().any(|kept| plain(kept) == plain(file)) {
            return;
        }
        self.kept.insert(file.into());
        if Path::new(file)
            .extension()
            .is_some_and(|ending| ending == "py")
            && is_inside(file)
            && let Ok(script) = standfast_files::assets::text(&folder.join(file))
        {
            self.imports(
                folder,
                plain(file).parent().unwrap_or(Path::new("")),
                &script.text,
            );
        }
    }

    /// Keeps the modules that a script imports from the folder. The script lies in `within`, and may import from there
    /// or from a folder above.
    fn imports(&mut self, folder: &Path, within: &Path, script: &str) {
        for statement in script
            .lines()
            .flat_map(|line| line.split(';'))
            .map(str::trim_start)
        {
            let names = match (
                statement.strip_prefix("import "),
                statement.strip_prefix("from "),
            ) {
                (Some(names), _) => names,
                (_, Some(from)) => match from.split_once(" import ") {
                    Some((package, names)) if package.trim().chars().all(|c| c == '.') => names,
                    Some((package, _)) => package,
                    None => continue,
                },
                _ => continue,
            };
            for name in names.split(',') {
                let name = name.trim_matches([' ', '.', '(']);
                let first = name
                    .split(|c: char| !c.is_alphanumeric() && c != '_')
                    .next()
                    .unwrap_or_default();
                let mut places = within.ancestors().filter(|_| !first.is_empty());
                places.any(|place| self.import(folder, place, first));
            }
        }
    }

    /// Keeps the module of this name that lies in `place` within the folder. Returns false if there is none.
    fn import(&mut self, folder: &Path, place: &Path, name: &str) -> bool {
        let script = place.join(format!("{name}.py"));
        if self.package(folder, &place.join(name)) {
            return true;
        }
        let is_there = folder.join(&script).is_file();
        if is_there {
            self.keep(folder, &script.to_string_lossy());
        }
        is_there
    }

    /// Keeps all files of a Python package in the folder. Returns false if there is no such package.
    fn package(&mut self, folder: &Path, package: &Path) -> bool {
        let mut files = Vec::new();
        files_in(folder, package, &mut files);
        if !files.iter().any(|file| {
            file.parent() == Some(package) && file.extension().is_some_and(|e| e == "py")
        }) {
            return false;
        }
        if files.len() > MOST_FILES {
            self.not_kept.insert(format!(
                "{} (more than {MOST_FILES} files)",
                package.display()
            ));
        } else {
            for file in &files {
                self.keep(folder, &file.to_string_lossy());
            }
        }
        true
    }
}

/// The files in a folder within `folder` and below it, without those that are hidden or that Python has compiled.
fn files_in(folder: &Path, within: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder.join(within)) else {
        return;
    };
    let mut entries: Vec<_> = entries.flatten().collect();
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries
        .iter()
        .filter(|entry| !entry.file_name().as_encoded_bytes().starts_with(b"."))
    {
        let path = within.join(entry.file_name());
        // A link may lead around in a circle, so only links to files are followed.
        match entry.file_type() {
            Ok(kind)
                if kind.is_dir()
                    && entry.file_name() != "__pycache__"
                    && files.len() <= MOST_FILES =>
            {
                files_in(folder, &path, files);
            }
            _ if folder.join(&path).is_file() => files.push(path),
            _ => {}
        }
    }
}

/// The words of an argument: the argument itself or, if it is a line for a shell, the words of the line.
fn words<'a>(folder: &Path, arg: &'a str) -> Vec<&'a str> {
    if folder.join(arg).exists() || !arg.contains(char::is_whitespace) {
        return vec![arg];
    }
    arg.split(|c: char| c.is_whitespace() || "'\"`;&|()<>".contains(c))
        .filter(|word| !word.is_empty())
        .collect()
}

/// The name of a program without its folder and version.
fn interpreter(program: &str) -> &str {
    let name = Path::new(program)
        .file_name()
        .and_then(|name| name.to_str())
        .unwrap_or_default();
    name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.')
}

/// The path without `./`.
fn plain(path: impl AsRef<Path>) -> PathBuf {
    path.as_ref()
        .components()
        .filter(|part| *part != Component::CurDir)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_command_refers_to_is_followed_or_told() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            standfast_files::write_atomic(&dir.path().join(name), text.as_bytes()).unwrap()
        };
        write(
            "mine/hold.py",
            "import os, helper as h; from parts.leg import Leg\nimport standfast\n",
        );
        write(
            "mine/helper.py",
            "    from shapes import (\n        Sole)\n",
        );
        write(
            "mine/shapes.py",
            "\"\"\"from nowhere import nothing\"\"\"\n",
        );
        write("mine/standfast.py", "import hold\n");
        write(
            "mine/parts/__init__.py",
            "from . import leg\nimport numbers\n",
        );
        write("mine/parts/leg.py", "import extra\n");
        write("mine/parts/table.json", "{}");
        write("mine/parts/__pycache__/leg.pyc", "");
        write("mine/extra.py", "");
        write("mine/other.py", "");
        write("mine/solver", "");
        write("mine/config.json", "{}");
        write("mine/data/table.json", "{}");
        write("elsewhere.py", "");
        let folder = dir.path().join("mine");
        let elsewhere = dir
            .path()
            .join("elsewhere.py")
            .to_string_lossy()
            .into_owned();
        let followed = |command: &[&str], files: &[&str]| {
            let owned = |texts: &[&str]| {
                texts
                    .iter()
                    .map(|text| text.to_string())
                    .collect::<Vec<_>>()
            };
            let CommandFiles { kept, not_kept } =
                CommandFiles::of(&folder, &owned(command), &owned(files));
            (
                Vec::from_iter(kept).join(" "),
                Vec::from_iter(not_kept).join(" "),
            )
        };
        let all = "extra.py helper.py hold.py parts/__init__.py parts/leg.py parts/table.json shapes.py standfast.py";
        for (command, files, kept, not_kept) in [
            (&["python3", "hold.py"][..], &[][..], all, ""),
            (&["/usr/bin/python3.11", "-u", "-m", "hold"], &[], all, ""),
            (
                &["python", "-mparts.leg"],
                &[],
                "extra.py parts/__init__.py parts/leg.py parts/table.json",
                "",
            ),
            (
                &["python", "parts"],
                &[],
                "extra.py parts/__init__.py parts/leg.py parts/table.json",
                "",
            ),
            (
                &["python3", "-c", "import helper; helper.run()"],
                &[],
                "helper.py shapes.py",
                "",
            ),
            (
                &["sh", "-c", "sleep 1; exec python3 -m other"],
                &[],
                "other.py",
                "",
            ),
            (
                &["uv", "run", "other.py", "--config=config.json"],
                &["extra.py"],
                "config.json extra.py other.py",
                "",
            ),
            (&["python3", "-m", "installed"], &[], "", "-m installed"),
            (
                &["python3", "../elsewhere.py", "."],
                &[],
                "",
                "../elsewhere.py",
            ),
            (&["python3", &elsewhere], &[], "", &elsewhere),
            (&["./solver", "--fast", "-m", "other"], &[], "./solver", ""),
            (&["solver", "data"], &[], "solver", "data solver"),
            (&["../solver", "/no/such/file"], &[], "", "../solver"),
        ] {
            assert_eq!(
                followed(command, files),
                (kept.to_string(), not_kept.to_string()),
                "{command:?}"
            );
        }
    }
}
