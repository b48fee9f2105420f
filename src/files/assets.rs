//! The files that are compiled into the binary, and the opening of an input that is either compiled in or a file.

use standfast_core::error::{Error, Result};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A text input, with its name in error messages.
#[derive(Debug, Clone)]
pub struct Source {
    /// Path as the caller gave it, or `builtin:NAME`.
    pub file: String,
    pub text: String,
}

impl Source {
    /// Whether the text is compiled in.
    pub fn is_builtin(&self) -> bool {
        self.file.starts_with("builtin:")
    }

    /// Whether the text is an MJCF, the format of MuJoCo, by its root element.
    pub fn is_mjcf(&self) -> bool {
        let mut rest = self.text.trim_start_matches('\u{feff}').trim_start();
        // What may stand before the root.
        let before = [("<!--", "-->"), ("<?", "?>"), ("<!", ">")];
        while let Some((start, end)) = before.iter().find(|(start, _)| rest.starts_with(start)) {
            let within = &rest[start.len()..];
            rest = within
                .split_once(end)
                .map_or("", |(_, after)| after.trim_start());
        }
        let after = rest.strip_prefix("<mujoco");
        after.is_some_and(|after| after.starts_with(|c: char| !c.is_alphanumeric()))
    }
}

/// The robot that is used if none is named.
pub const DEFAULT_ROBOT: &str = "ut-mu2";

/// Files of a new controller in Python: names and texts.
pub const PYTHON: [(&str, &str); 5] = [
    (
        "ankles.py",
        include_str!("assets/controllers/python/ankles.py"),
    ),
    (
        "ankles.toml",
        include_str!("assets/controllers/python/ankles.toml"),
    ),
    ("hold.py", include_str!("assets/controllers/python/hold.py")),
    (
        "hold.toml",
        include_str!("assets/controllers/python/hold.toml"),
    ),
    (
        "standfast.py",
        include_str!("assets/controllers/python/standfast.py"),
    ),
];

/// Files of a new controller in C++: names and texts.
pub const CPP: [(&str, &str); 5] = [
    (
        "ankles.cpp",
        include_str!("assets/controllers/cpp/ankles.cpp"),
    ),
    (
        "ankles.toml",
        include_str!("assets/controllers/cpp/ankles.toml"),
    ),
    ("hold.cpp", include_str!("assets/controllers/cpp/hold.cpp")),
    (
        "hold.toml",
        include_str!("assets/controllers/cpp/hold.toml"),
    ),
    (
        "standfast.hpp",
        include_str!("assets/controllers/cpp/standfast.hpp"),
    ),
];

/// Files of a folder under `assets`, by their names without the extension.
macro_rules! texts {
    ($folder:literal, $extension:literal: $($name:literal)*) => {
        &[$(($name, include_str!(concat!("assets/", $folder, "/", $name, ".", $extension)))),*]
    };
}

/// A packed result that is compiled in.
pub struct Baseline {
    pub name: &'static str,
    /// Paths in its folder, and their bytes.
    pub files: &'static [(&'static str, &'static [u8])],
    /// Robot and controllers, in Markdown.
    pub about: &'static str,
    /// The largest impulses by heading, as `limit --json` prints them.
    pub limits: &'static str,
}

/// The packed results that are in the folders of these names, each with one part.
macro_rules! baselines {
    ($($name:literal)*) => {
        &[$(Baseline {
            name: $name,
            files: baselines!(@ $name: "parts/campaign.json" "parts/part-000000.parquet"),
            about: include_str!(concat!("assets/baselines/", $name, "/about.md")),
            limits: include_str!(concat!("assets/baselines/", $name, "/limits.json")),
        }),*]
    };
    (@ $name:literal: $($file:literal)*) => {
        &[$(($file, include_bytes!(concat!("assets/baselines/", $name, "/", $file)))),*]
    };
}

/// What public policies survived on their robots.
pub const BASELINES: &[Baseline] = baselines!("g1-public" "h1-public" "t1-public");

/// Kinds of built-in inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputKind {
    Robot,
    RobotSettings,
    Controller,
    Campaign,
}

impl InputKind {
    fn what(self) -> &'static str {
        self.what_and_where()[0]
    }

    /// The name of the kind, and the option or command that takes a file of this kind.
    fn what_and_where(self) -> [&'static str; 2] {
        match self {
            InputKind::Robot => ["robot", "--robot takes this file"],
            InputKind::RobotSettings => [
                "robot settings",
                "this file is read beside its URDF or MJCF, which --robot takes",
            ],
            InputKind::Controller => ["controller", "--controller takes this file"],
            InputKind::Campaign => ["campaign", "`standfast run` and --campaign take this file"],
        }
    }

    /// The kind to which a text surely belongs. None if no key tells it.
    fn of(text: &str) -> Option<InputKind> {
        if text.trim_start().starts_with('<') {
            return Some(InputKind::Robot);
        }
        let table: toml::Table = toml::from_str(text).ok()?;
        let is_there = |keys: &[&str]| keys.iter().any(|key| table.contains_key(*key));
        let gains = table.get("gains").and_then(|gains| gains.get(0));
        match () {
            () if is_there(&["push", "trials"]) => Some(InputKind::Campaign),
            () if is_there(&["soles", "servos"]) => Some(InputKind::RobotSettings),
            () if is_there(&["kind"]) || gains.is_some_and(toml::Value::is_table) => {
                Some(InputKind::Controller)
            }
            () => None,
        }
    }

    /// Names and texts of the built-in inputs, in the order in which they are listed.
    fn builtin(self) -> &'static [(&'static str, &'static str)] {
        match self {
            InputKind::Robot => texts!("robots", "urdf": "ut-mu2"),
            InputKind::RobotSettings => texts!("robots", "toml": "ut-mu2"),
            InputKind::Controller => {
                texts!("controllers", "toml": "hold" "fixed" "switching" "robust" "paper" "catch" "slow" "fast")
            }
            InputKind::Campaign => {
                texts!("campaigns", "toml": "smoke" "nominal" "standard" "harsh" "robocup" "dysturbance")
            }
        }
    }

    /// Names of the built-in inputs, in the order in which they are listed.
    pub fn names(self) -> Vec<&'static str> {
        self.builtin().iter().map(|(name, _)| *name).collect()
    }
}

/// Opens a built-in input by its name, or a file by its path. A built-in name takes precedence, so a file of the same
/// name in the working folder must be written as a path, such as `./switching` or `switching.toml`.
///
/// # Errors
/// There is no such input, or the file is surely of another kind.
pub fn open(kind: InputKind, name: &str) -> Result<Source> {
    refuse_other_kind(kind, name)?;
    let source = open_among(kind.what(), kind.builtin(), name)
        .map_err(|error| of_another_kind(error, kind, name))?;
    match InputKind::of(&source.text).filter(|actual| *actual != kind && !source.is_builtin()) {
        Some(actual) => {
            let ([what, goes], asked) = (actual.what_and_where(), kind.what());
            let (problem, accepted) = (format!("is no {asked}"), format!("a {asked} here; {goes}"));
            Err(Error::value(
                &source.file,
                "kind of file",
                what,
                problem,
                accepted,
            ))
        }
        None => Ok(source),
    }
}

/// Adds to an error about an unknown name the option that takes the name.
fn of_another_kind(mut error: Error, asked: InputKind, name: &str) -> Error {
    let options = [
        (InputKind::Robot, "--robot"),
        (InputKind::Controller, "--controller"),
        (InputKind::Campaign, "--campaign"),
    ];
    let takes = options
        .iter()
        .find(|(kind, _)| *kind != asked && kind.names().contains(&name));
    if let (Error::Unknown { accepted, .. }, Some((_, option))) = (&mut error, takes) {
        *accepted += &format!("; did you mean {option} {name}?");
    }
    error
}

/// Opens an input as [`open()`] does, among the inputs that another program has compiled in. `what` is the name of
/// their kind, and `builtin` has their names and texts in the order in which they are listed.
pub fn open_among(what: &'static str, builtin: &[(&str, &str)], name: &str) -> Result<Source> {
    if let Some((_, text)) = builtin.iter().find(|(n, _)| *n == name) {
        return Ok(Source {
            file: format!("builtin:{name}"),
            text: (*text).into(),
        });
    }
    let path = Path::new(name);
    if !is_path(name) && !path.exists() {
        let names: Vec<&str> = builtin.iter().map(|(name, _)| *name).collect();
        let beside = format!(
            "{name}.{}",
            if what == InputKind::Robot.what() {
                "urdf"
            } else {
                "toml"
            }
        );
        let beside = Path::new(&beside).exists().then_some(beside.as_str());
        let meant = beside.or_else(|| nearest(name, names.iter().copied()));
        let meant = meant.map_or(String::new(), |meant| format!("; did you mean {meant}?"));
        let accepted = format!("{} or the path of a file{meant}", names.join(", "));
        return Err(Error::Unknown {
            what,
            name: name.into(),
            accepted,
        });
    }
    Ok(Source {
        file: name.into(),
        ..text(path)?
    })
}

/// The name nearest to a misspelt one, if it is near enough.
pub fn nearest<'a>(misspelt: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let away = |name: &str| strsim::damerau_levenshtein(misspelt, name);
    let most = (misspelt.chars().count() / 3).max(1);
    names
        .into_iter()
        .min_by_key(|name| away(name))
        .filter(|name| away(name) <= most)
}

/// Fails if `name` is a file that belongs to a policy or a program. The error names the file to be given instead.
pub fn refuse_other_kind(kind: InputKind, name: &str) -> Result<()> {
    let path = Path::new(name);
    match other_kind(path).filter(|_| path.is_file() && !kind.names().contains(&name)) {
        Some((what, mut accepted)) => {
            let asked = kind.what();
            if kind != InputKind::Controller {
                accepted = format!("a {asked} here; as a controller, {accepted}");
            }
            Err(Error::value(
                name,
                "kind of file",
                what,
                format!("is no {asked}"),
                accepted,
            ))
        }
        None => Ok(()),
    }
}

/// For a file that belongs to a policy or a program and is none of the inputs in [`InputKind`]: what it is, judged by its
/// name, and what is to be given instead.
fn other_kind(path: &Path) -> Option<(&'static str, String)> {
    let file = shell_word(&path.to_string_lossy());
    let toml = path.with_extension("toml");
    let beside = toml
        .is_file()
        .then(|| format!("the file beside it, {}", toml.display()));
    let extension = path.extension()?.to_str()?.to_lowercase();
    Some(match extension.as_str() {
        "onnx" | "pt" | "jit" => {
            let written = format!(
                "a TOML file that says what it observes: `standfast init {file} --robot ROBOT` writes it"
            );
            ("a network", beside.unwrap_or(written))
        }
        "pth" | "ckpt" | "pkl" | "safetensors" => {
            let accepted = "the same network as an ONNX or TorchScript file, which `torch.onnx.export` and `torch.jit.save` write in \
                            Python, and for it the TOML file that `standfast init FILE.onnx --robot ROBOT` writes";
            ("a checkpoint of a network", accepted.into())
        }
        "py" | "sh" | "js" | "lua" | "cpp" | "cc" | "c" | "rs" => {
            let written = "a TOML file beside it, with kind = \"process\" and the command that starts it; `standfast new python FOLDER` \
                           writes examples";
            ("a program", beside.unwrap_or(written.into()))
        }
        "yaml" | "yml" => {
            let accepted = format!(
                "a TOML file; that of a policy is written by `standfast init FILE.onnx {file} --robot ROBOT`"
            );
            ("a YAML file", accepted)
        }
        _ => return None,
    })
}

/// The kind of a file that is no text in UTF-8, judged by its first bytes.
pub fn what_else(bytes: &[u8]) -> Option<&'static str> {
    const KNOWN: [(&[u8], &str); 9] = [
        (
            b"version https://git-lfs",
            "a pointer of Git LFS, in whose place `git lfs pull` puts the file itself",
        ),
        (b"\xff\xfe", "text in UTF-16"),
        (b"\xfe\xff", "text in UTF-16"),
        (b"PK\x03\x04", "a ZIP archive, as PyTorch and NumPy write"),
        (b"\x1f\x8b", "an archive of gzip"),
        (b"\x80\x02", "a pickle of Python"),
        (b"\x80\x04", "a pickle of Python"),
        (b"\x93NUMPY", "an array of NumPy"),
        (b"\x7fELF", "a program"),
    ];
    KNOWN
        .iter()
        .find(|(start, _)| bytes.starts_with(start))
        .map(|(_, what)| *what)
}

/// The text of a file, without the byte order mark with which some editors begin. Fails as [`read`] does, and if the
/// text is not UTF-8.
pub fn text(path: &Path) -> Result<Source> {
    let text = String::from_utf8(read(path, MOST_TEXT_BYTES)?).map_err(|error| {
        let what =
            what_else(error.as_bytes()).map_or(String::new(), |what| format!(", but {what}"));
        let source = std::io::Error::new(
            std::io::ErrorKind::InvalidData,
            format!("it is no text in UTF-8{what}"),
        );
        Error::Read {
            path: path.into(),
            source,
        }
    })?;
    Ok(Source {
        file: path.display().to_string(),
        text: without_mark(text),
    })
}

/// A text without a byte order mark.
pub fn without_mark(text: String) -> String {
    text.strip_prefix('\u{feff}')
        .map(String::from)
        .unwrap_or(text)
}

const MOST_TEXT_BYTES: u64 = 20_000_000;

/// Reads a file of up to `most` bytes. Fails if it is larger, if it cannot be read, or if it is no regular file: a pipe
/// or a device may never answer or never end, and inputs are read more than once.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    let fail = |source| Error::Read {
        path: path.into(),
        source,
    };
    if !std::fs::metadata(path).map_err(fail)?.is_file() {
        return Err(fail(std::io::Error::other(
            "it is no file; accepted: a file, not a folder, pipe or device",
        )));
    }
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(most + 1).read_to_end(&mut bytes))
        .map_err(fail)?;
    if bytes.len() as u64 > most {
        let file = path.display().to_string();
        let accepted = format!("up to {} MB", most / 1_000_000);
        return Err(Error::value(
            &file,
            "size",
            format!("over {most} bytes"),
            "the file is too large",
            accepted,
        ));
    }
    Ok(bytes)
}

/// Whether `name` is written as a path: with a folder or an extension.
pub fn is_path(name: &str) -> bool {
    let path = Path::new(name);
    path.extension().is_some() || path.components().count() > 1
}

/// Reads the value of `key=value` as TOML. Text that is not valid TOML is taken as a string (a bare word).
pub fn toml_value(text: &str) -> toml::Value {
    toml::from_str::<toml::Table>(&format!("value = {text}"))
        .ok()
        .filter(|table| table.len() == 1)
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| toml::Value::String(text.into()))
}

/// The value as a number, if it is one.
pub fn number(value: &toml::Value) -> Option<f64> {
    value
        .as_float()
        .or(value.as_integer().map(|whole| whole as f64))
}

/// A part of a dotted key that does not exist.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Missing {
    /// The key up to the missing name.
    pub name: String,
    /// The existing names at this level.
    pub accepted: String,
}

/// The place of a dotted key. A number is an index into an array, from 0. An empty key is the root.
pub fn place<'a>(root: &'a mut toml::Value, key: &str) -> Result<&'a mut toml::Value, Missing> {
    let (mut at, mut walked) = (root, String::new());
    for name in key.split('.').filter(|_| !key.is_empty()) {
        let inside = walked.trim_end_matches('.').to_string();
        let accepted = match &*at {
            toml::Value::Table(t) => t
                .keys()
                .map(|k| format!("{walked}{k}"))
                .collect::<Vec<_>>()
                .join(", "),
            toml::Value::Array(a) if a.is_empty() => format!("nothing: `{inside}` is empty"),
            toml::Value::Array(a) => format!("{walked}0 to {walked}{}", a.len() - 1),
            _ => inside,
        };
        let next = match at {
            toml::Value::Array(values) => name.parse().ok().and_then(|i: usize| values.get_mut(i)),
            other => other.get_mut(name),
        };
        walked += name;
        at = next.ok_or_else(|| Missing {
            name: walked.clone(),
            accepted,
        })?;
        walked.push('.');
    }
    Ok(at)
}

/// Parses TOML. Errors name the file, the line and the key.
pub fn parse_toml<T: serde::de::DeserializeOwned>(source: &Source) -> Result<T> {
    toml::from_str(&source.text).map_err(|e| Error::Syntax {
        file: source.file.clone(),
        message: e.to_string().trim_end().replace('\n', "\n  "),
    })
}

/// Line and column, from 1, of the value with a dotted key in a TOML text.
pub fn position(text: &str, key: &str) -> Option<(usize, usize)> {
    let root = DeTable::parse(text).ok()?;
    let mut names = key.split('.');
    let mut at = value_of(root.get_ref(), names.next()?)?;
    for name in names {
        at = match at.get_ref() {
            DeValue::Table(table) => value_of(table, name)?,
            DeValue::Array(list) => list.get(name.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    let before = &text[..at.span().start];
    let line_start = before.rfind('\n').map_or(0, |end| end + 1);
    Some((
        before.matches('\n').count() + 1,
        before[line_start..].chars().count() + 1,
    ))
}

fn value_of<'a, 'i>(table: &'a DeTable<'i>, name: &str) -> Option<&'a Spanned<DeValue<'i>>> {
    table
        .iter()
        .find(|(key, _)| key.get_ref() == name)
        .map(|(_, value)| value)
}

/// Writes a number with a decimal point, so that TOML reads it as a float.
pub fn decimal(figure: f64) -> String {
    let text = (figure + 0.0).to_string();
    if text.contains('.') {
        text
    } else {
        text + ".0"
    }
}

/// A text as a TOML string on one line.
pub fn quoted(text: &str) -> String {
    toml::Value::String(one_line(text)).to_string()
}

/// A text without control characters, such as a line break that would end a comment.
pub fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

/// The text as one word for a shell, in quotes if it contains special characters.
pub fn shell_word(text: &str) -> String {
    let is_plain = text
        .chars()
        .all(|c| c.is_alphanumeric() || "-_./:=,+@%".contains(c));
    if is_plain && !text.is_empty() {
        text.into()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_a_name_as_one_word() {
        assert_eq!(shell_word("out/campaign.toml"), "out/campaign.toml");
        assert_eq!(shell_word("mine zmp_margin=0.1"), "'mine zmp_margin=0.1'");
        assert_eq!(shell_word("x=[1,2]"), "'x=[1,2]'");
        assert_eq!(shell_word("it's"), r"'it'\''s'");
        assert_eq!(shell_word(""), "''");
    }
}
