//! Mutations of valid inputs, and the check that each is accepted, or refused in words.

use standfast::Result;
use standfast::core::control::Design;
use standfast::core::lipm::GainSet;
use standfast::core::robot::Robot;
use standfast::sim::episode::{self, Disturbance, EpisodeConfig, Until};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::{fs, path::PathBuf};

/// Number of cases of each kind unless the environment states another one.
const USUAL_CASES: u64 = 40;

/// A small generator of random numbers (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }

    fn of<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

const NUMBERS: [&str; 34] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "-0.5",
    "1e-3",
    "1e-5",
    "1e-9",
    "1e-15",
    "1e-300",
    "5e-324",
    "10",
    "100",
    "1e3",
    "1e4",
    "1e5",
    "1e6",
    "1e9",
    "1e12",
    "1e15",
    "3.5e38",
    "1e300",
    "1e308",
    "1e999",
    "-1e300",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "18446744073709551616",
    "",
];
const WORDS: [&str; 24] = [
    "[", "]", "{", "}", "\"", "'", "=", ",", ".", "#", "<", ">", "/>", "&", "\0", "\u{7f}",
    "\u{2028}", "ä", "../", "%", "true", "NaN", "<!--", "\n\n",
];

/// Ranges of the numbers in a text.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let (bytes, mut found, mut at) = (text.as_bytes(), Vec::new(), 0);
    while at < bytes.len() {
        let starts = bytes[at].is_ascii_digit()
            || bytes[at] == b'-' && bytes.get(at + 1).is_some_and(u8::is_ascii_digit);
        let in_word = at > 0 && (bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_');
        if !starts || in_word {
            at += 1;
            continue;
        }
        let is_part = |b: &u8| b.is_ascii_digit() || b".eE".contains(b);
        let end = at + 1 + bytes[at + 1..].iter().take_while(|b| is_part(b)).count();
        found.push((at, end));
        at = end;
    }
    found
}

/// The text with all values of one key, or of one attribute, times the same factor: consistent values are accepted.
fn scaled(text: &str, random: &mut Random) -> String {
    let found = numbers(text);
    let Some(&(start, _)) = found.get(random.below(found.len())) else {
        return text.into();
    };
    let key_of = |at: usize| {
        let line = &text[text[..at].rfind('\n').map_or(0, |end| end + 1)..at];
        let key = line.rsplit_once('=').map_or(line, |(before, _)| before);
        key.trim_end()
            .rsplit([' ', '\t', '<', '{', ','])
            .next()
            .unwrap_or(key)
    };
    let (key, factor) = (
        key_of(start),
        random.of(&[0.0, 1e-9, 1e-6, 1e-3, 0.1, 0.5, 2.0, 10.0, 1e3, 1e6, 1e9]),
    );
    let (mut out, mut from) = (String::new(), 0);
    for (start, end) in found.into_iter().filter(|&(start, _)| key_of(start) == key) {
        let Ok(number) = text[start..end].parse::<f64>() else {
            continue;
        };
        out += &text[from..start];
        out += &(number * factor).to_string();
        from = end;
    }
    out + &text[from..]
}

/// The next position at which a text can be cut.
fn boundary(text: &str, at: usize) -> usize {
    (at..)
        .find(|&at| text.is_char_boundary(at))
        .unwrap_or(text.len())
}

/// A text with one change.
fn changed(text: &str, random: &mut Random, others: &[String]) -> String {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let (line, count) = (random.below(lines.len()), 1 + random.below(6));
    let end = (line + count).min(lines.len());
    match random.below(14) {
        // Most inputs are numbers, and most of their faults are numbers that nobody considered.
        0..=5 => {
            let found = numbers(text);
            let Some(&(start, end)) = found.get(random.below(found.len())) else {
                return text.into();
            };
            let number = match (random.below(2), text[start..end].parse::<f64>()) {
                (0, Ok(number)) => (number
                    * random.of(&[-1.0, 0.1, 0.5, 2.0, 10.0, 100.0, 1e-3, 1.0001]))
                .to_string(),
                _ => random.of::<&str>(&NUMBERS).to_string(),
            };
            return text[..start].to_string() + &number + &text[end..];
        }
        12.. => return scaled(text, random),
        6 => drop(lines.drain(line.min(end)..end)),
        7 => {
            let copy = lines[line.min(end)..end].to_vec();
            (0..=random.below(3))
                .for_each(|_| drop(lines.splice(line..line, copy.iter().copied())));
        }
        8 if end > line => {
            let other = random.below(lines.len());
            lines.swap(line, other);
        }
        9 => {
            let (open, close) =
                *random.of(&[("[", "]"), ("{a=", "}"), ("<link>", "</link>"), ("(", ")")]);
            let (at, depth) = (
                boundary(text, random.below(text.len() + 1)),
                *random.of(&[2, 100, 20_000]),
            );
            return text[..at].to_string()
                + &open.repeat(depth)
                + &close.repeat(depth)
                + &text[at..];
        }
        10 => {
            let start = boundary(text, random.below(text.len() + 1));
            let end = boundary(text, (start + random.below(20)).min(text.len()));
            return text[..start].to_string() + random.of::<&str>(&WORDS) + &text[end..];
        }
        _ => {
            let other = random.of(others);
            let start = boundary(other, random.below(other.len() + 1));
            let end = boundary(other, (start + random.below(200)).min(other.len()));
            let at = boundary(text, random.below(text.len() + 1));
            return text[..at].to_string() + &other[start..end] + &text[at..];
        }
    }
    lines.concat()
}

/// Runs the cases of one kind: the cases that once failed, the valid ones, and mutations of both. Each must be accepted
/// or refused in words.
pub fn fuzz(kind: &str, valid: &[String], check: impl Fn(&str) -> Result<()>) {
    let running = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("fuzz")
        .join(kind);
    fs::create_dir_all(running.parent().unwrap()).unwrap();
    let run = |text: &str| {
        fs::write(&running, text).unwrap();
        match catch_unwind(AssertUnwindSafe(|| check(text))) {
            Ok(Ok(())) => true,
            Ok(Err(error)) => {
                assert!(
                    error.to_string().len() > 10,
                    "{kind}: refused without words; the case is {}",
                    running.display()
                );
                false
            }
            Err(_) => panic!(
                "{kind}: a panic; cp {} tests/data/fuzz/{kind}/NAME",
                running.display()
            ),
        }
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/fuzz")
        .join(kind);
    let corpus = fs::read_dir(folder).map_or(Vec::new(), |entries| {
        entries.map(|entry| entry.unwrap().path()).collect()
    });
    let mut corpus: Vec<PathBuf> = corpus;
    corpus.sort();
    for path in corpus {
        run(&fs::read_to_string(path).unwrap());
    }
    for text in valid {
        assert!(
            run(text),
            "{kind}: a valid input is refused: {}",
            check(text).unwrap_err()
        );
    }
    let cases =
        std::env::var("STANDFAST_FUZZ_CASES").map_or(USUAL_CASES, |cases| cases.parse().unwrap());
    let accepted = (0..cases).filter(|&case| {
        let mut random = Random(case);
        let text = random.of(valid).clone();
        let text = (0..=random.below(4)).fold(text, |text, _| changed(&text, &mut random, valid));
        run(&text)
    });
    println!("{kind}: {} of {cases} cases accepted", accepted.count());
}

/// A few ticks of an episode.
pub fn simulated(
    robot: &Robot,
    gains: &GainSet,
    config: &EpisodeConfig,
    disturbance: Disturbance,
) -> Result<()> {
    // More gains take more time, and are read in the same way.
    let gains = GainSet {
        gains: gains.gains.iter().take(1).cloned().collect(),
        ..gains.clone()
    };
    let factory = Design::new(robot, &gains, config.control_period_s)?.into();
    let horizon_s = 12.0 * config.control_period_s;
    let steps = horizon_s / config.physics_step_s;
    if steps < 1000.0 {
        let config = EpisodeConfig {
            horizon_s,
            ..*config
        };
        episode::run(
            robot,
            &factory,
            &config,
            disturbance,
            Until::Horizon,
            &mut |_| {},
        )
        .unwrap();
    }
    Ok(())
}
