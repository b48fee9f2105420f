//! Whatever an input holds, it is read or refused in words, and what is read can be designed for and simulated: mutations
//! of valid inputs, after those that once failed (`tests/data/fuzz`).
//!
//! `STANDFAST_FUZZ_CASES=N` runs N cases of each kind. The case that runs, and so the one that crashed or hung, is in
//! `target/tmp/fuzz/KIND`; a copy of it in the folder of its kind becomes part of the test.

use standfast::assets::{self, Kind, Source};
use standfast::campaign::ask::gate::Gate;
use standfast::campaign::ask::scenario::{Cause, Scenario};
use standfast::campaign::ask::trial;
use standfast::campaign::run::{RunOptions, Watch, Work};
use standfast::campaign::{Campaign, Folder, Overrides, Plan, StoredTrial};
use standfast::control::Design;
use standfast::episode::{self, Disturbance, EpisodeConfig, Until, imposed};
use standfast::lipm::{GainSet, variant};
use standfast::robot::{Robot, Units, urdf};
use standfast::sim::Push;
use standfast::{Error, Result};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::{fs, path::PathBuf};

/// Stands between the files of one case.
const NEXT_FILE: &str = "\n=====\n";
/// Cases of each kind unless the caller says otherwise.
const USUAL_CASES: u64 = 150;

fn builtin(kind: Kind, name: &str) -> Source {
    assets::open(kind, name).unwrap()
}

fn file(name: &str, text: &str) -> Source {
    Source { file: name.into(), text: text.into() }
}

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
    "[", "]", "{", "}", "\"", "'", "=", ",", ".", "#", "<", ">", "/>", "&", "\0", "\u{7f}", "\u{2028}", "ä", "../",
    "%", "true", "NaN", "<!--", "\n\n",
];

/// Places of the numbers in a text.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let (bytes, mut found, mut at) = (text.as_bytes(), Vec::new(), 0);
    while at < bytes.len() {
        let starts =
            bytes[at].is_ascii_digit() || bytes[at] == b'-' && bytes.get(at + 1).is_some_and(u8::is_ascii_digit);
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

/// The text with all values of one key, or one attribute, times the same factor: what is consistent is accepted.
fn scaled(text: &str, random: &mut Random) -> String {
    let found = numbers(text);
    let Some(&(start, _)) = found.get(random.below(found.len())) else { return text.into() };
    let key_of = |at: usize| {
        let line = &text[text[..at].rfind('\n').map_or(0, |end| end + 1)..at];
        let key = line.rsplit_once('=').map_or(line, |(before, _)| before);
        key.trim_end().rsplit([' ', '\t', '<', '{', ',']).next().unwrap_or(key)
    };
    let (key, factor) = (key_of(start), random.of(&[0.0, 1e-9, 1e-6, 1e-3, 0.1, 0.5, 2.0, 10.0, 1e3, 1e6, 1e9]));
    let (mut out, mut from) = (String::new(), 0);
    for (start, end) in found.into_iter().filter(|&(start, _)| key_of(start) == key) {
        let Ok(number) = text[start..end].parse::<f64>() else { continue };
        out += &text[from..start];
        out += &(number * factor).to_string();
        from = end;
    }
    out + &text[from..]
}

/// The next place at which a text can be cut.
fn boundary(text: &str, at: usize) -> usize {
    (at..).find(|&at| text.is_char_boundary(at)).unwrap_or(text.len())
}

/// A text with one change.
fn changed(text: &str, random: &mut Random, others: &[String]) -> String {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let (line, count) = (random.below(lines.len()), 1 + random.below(6));
    let end = (line + count).min(lines.len());
    match random.below(14) {
        // Most inputs are numbers, and most of their faults are numbers that nobody thought of.
        0..=5 => {
            let found = numbers(text);
            let Some(&(start, end)) = found.get(random.below(found.len())) else { return text.into() };
            let number = match (random.below(2), text[start..end].parse::<f64>()) {
                (0, Ok(number)) => (number * random.of(&[-1.0, 0.1, 0.5, 2.0, 10.0, 100.0, 1e-3, 1.0001])).to_string(),
                _ => random.of::<&str>(&NUMBERS).to_string(),
            };
            return text[..start].to_string() + &number + &text[end..];
        }
        12.. => return scaled(text, random),
        6 => drop(lines.drain(line.min(end)..end)),
        7 => {
            let copy = lines[line.min(end)..end].to_vec();
            (0..=random.below(3)).for_each(|_| drop(lines.splice(line..line, copy.iter().copied())));
        }
        8 if end > line => {
            let other = random.below(lines.len());
            lines.swap(line, other);
        }
        9 => {
            let (open, close) = *random.of(&[("[", "]"), ("{a=", "}"), ("<link>", "</link>"), ("(", ")")]);
            let (at, depth) = (boundary(text, random.below(text.len() + 1)), *random.of(&[2, 100, 20_000]));
            return text[..at].to_string() + &open.repeat(depth) + &close.repeat(depth) + &text[at..];
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

/// Runs the cases of one kind: those that once failed, the valid ones, and mutations of them. Each must be accepted or
/// refused with words.
fn fuzz(kind: &str, valid: &[String], check: impl Fn(&str) -> Result<()>) {
    let running = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz").join(kind);
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
            Err(_) => panic!("{kind}: a panic; cp {} tests/data/fuzz/{kind}/NAME", running.display()),
        }
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fuzz").join(kind);
    let corpus =
        fs::read_dir(folder).map_or(Vec::new(), |entries| entries.map(|entry| entry.unwrap().path()).collect());
    let mut corpus: Vec<PathBuf> = corpus;
    corpus.sort();
    for path in corpus {
        run(&fs::read_to_string(path).unwrap());
    }
    for text in valid {
        assert!(run(text), "{kind}: a valid input is refused: {}", check(text).unwrap_err());
    }
    let cases = std::env::var("STANDFAST_FUZZ_CASES").map_or(USUAL_CASES, |cases| cases.parse().unwrap());
    let accepted = (0..cases).filter(|&case| {
        let mut random = Random(case);
        let text = random.of(valid).clone();
        let text = (0..=random.below(4)).fold(text, |text, _| changed(&text, &mut random, valid));
        run(&text)
    });
    println!("{kind}: {} of {cases} cases accepted", accepted.count());
}

/// A few ticks of an episode.
fn simulated(robot: &Robot, gains: &GainSet, config: &EpisodeConfig, disturbance: Disturbance) -> Result<()> {
    // More gains cost more time, and are read in the same way.
    let gains = GainSet { gains: gains.gains.iter().take(1).cloned().collect(), ..gains.clone() };
    let design = Design::new(robot, &gains, config.control_period_s)?;
    let horizon_s = 12.0 * config.control_period_s;
    let steps = horizon_s / config.clock().physics_step_s;
    if steps < 1000.0 {
        let config = EpisodeConfig { horizon_s, ..*config };
        episode::run(robot, &design, &config, disturbance, Until::Horizon, &mut |_| {});
    }
    Ok(())
}

fn pushed(robot: &Robot) -> Result<()> {
    let units = Units::of(robot);
    let push = Push { start_s: 0.004, ..Push::of(&units) };
    let disturbance = Disturbance { pushes: vec![push], ..Disturbance::default() };
    let gains = if robot.reach.is_empty() { "fixed" } else { "catch" };
    simulated(robot, &GainSet::load(gains)?, &EpisodeConfig::of(&units), disturbance)
}

/// A refusal by the design is one in words too.
fn read_of(robot: Result<Robot>) -> Result<()> {
    robot.and_then(|robot| pushed(&robot))
}

#[test]
fn urdf() {
    let settings = builtin(Kind::RobotSettings, "ut-mu2");
    let valid = [builtin(Kind::Robot, "ut-mu2").text];
    fuzz("urdf", &valid, |text| read_of(Robot::parse(&file("mine.urdf", text), &settings)));
}

#[test]
fn inferred_settings() {
    let valid = [include_str!("../assets/robots/child.urdf").to_string(), builtin(Kind::Robot, "ut-mu2").text];
    fuzz("inferred", &valid, |text| {
        let urdf = file("mine.urdf", text);
        read_of(urdf::inferred(&urdf).and_then(|settings| Robot::parse(&urdf, &settings)))
    });
}

/// A tetrahedron of 2 cm.
const COLLADA: &str = r##"<COLLADA version="1.4.1"><asset><unit meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="solid"><mesh>
<source id="places"><float_array count="12">0 0 0 2 0 0 0 2 0 0 0 2</float_array>
<technique_common><accessor source="#places" count="4" stride="3"/></technique_common></source>
<vertices id="corners"><input semantic="POSITION" source="#places"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#corners" offset="0"/><p>0 2 1 0 1 3 1 2 3 2 0 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node><rotate>0 0 1 90</rotate><scale>1 -1 1</scale>
<instance_geometry url="#solid"/></node></visual_scene></library_visual_scenes></COLLADA>"##;

/// A tetrahedron of 10 cm, with one of its faces.
const KEPT: &str = "mesh 1 1 1 any.obj\nhull 0 0 0\nhull 0.1 0 0\nhull 0 0.1 0\nhull 0 0 0.1
point 0 0 0\npoint 0.1 0 0\npoint 0 0.1 0\ntriangle 0 1 2\n";

/// Meshes that collide on the robot's arm, each after its format; and the same as a result keeps them.
#[test]
fn meshes() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    let urdf = builtin(Kind::Robot, "ut-mu2").text;
    let at = urdf.find("</link>").unwrap();
    let valid: Vec<String> = [
        ("obj", include_str!("../assets/robots/adult/meshes/head.obj")),
        ("stl", include_str!("../assets/robots/adult/meshes/foot.stl")),
        ("dae", COLLADA),
        ("meshes", KEPT),
    ]
    .map(|(format, text)| format!("{format}{NEXT_FILE}{text}"))
    .to_vec();
    fs::write(path("mine.toml"), builtin(Kind::RobotSettings, "ut-mu2").text).unwrap();
    fuzz("mesh", &valid, |text| {
        let (format, mesh) = text.split_once(NEXT_FILE).unwrap_or(("obj", text));
        let format = if ["stl", "dae", "meshes"].contains(&format) { format } else { "obj" };
        let (file, name) = match format {
            "meshes" => ("mine.meshes".to_string(), "any.obj".to_string()),
            _ => (format!("any.{format}"), format!("any.{format}")),
        };
        fs::write(path(&file), mesh).unwrap();
        let solid = format!("<collision><geometry><mesh filename=\"{name}\"/></geometry></collision>");
        fs::write(path("mine.urdf"), format!("{}{solid}{}", &urdf[..at], &urdf[at..])).unwrap();
        let read = Robot::load(&path("mine.urdf").to_string_lossy());
        fs::remove_file(path(&file)).unwrap();
        read_of(read)
    });
}

#[test]
fn robot_settings() {
    let robot = builtin(Kind::Robot, "ut-mu2");
    let valid = [builtin(Kind::RobotSettings, "ut-mu2").text];
    fuzz("settings", &valid, |text| read_of(Robot::parse(&robot, &file("mine.toml", text))));
}

#[test]
fn gain_sets() {
    let robot = Robot::load("ut-mu2").unwrap();
    let valid = Kind::Gains.names().into_iter().map(|name| builtin(Kind::Gains, name).text).collect::<Vec<_>>();
    let config = EpisodeConfig::of(&Units::of(&robot));
    fuzz("gains", &valid, |text| {
        let gains = GainSet::parse(&file("mine.toml", text))?;
        simulated(
            &robot,
            &gains,
            &config,
            Disturbance { pushes: vec![Push::of(&Units::of(&robot))], ..Disturbance::default() },
        )
    });
}

/// The first trial of a campaign, on its robot.
fn first_trial(campaign: &Campaign) -> Result<()> {
    let robot = Robot::load(&campaign.robot)?;
    campaign.gains.iter().try_for_each(|gains| GainSet::load(gains).map(|_| ()))?;
    campaign.to_toml()?;
    let disturbance = trial::disturbance(campaign, campaign.trials - 1);
    simulated(&robot, &GainSet::load("fixed")?, &campaign.episode, disturbance)
}

#[test]
fn campaigns() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    let everything =
        "[episode]\nphysics_step_s = { rapier = 0.001, mujoco = 0.0005 }\n[stopping]\nuntil_resolved = true\n";
    let names = Kind::Campaign.names().into_iter();
    let mut valid: Vec<String> = names.map(|name| builtin(Kind::Campaign, name).text).collect();
    valid.push(format!("name = 'c'\ntrials = 3\nseed = 1\n[push]\nimpulse = {{ normal = [1, 0.2] }}\n{everything}"));
    fuzz("campaign", &valid, |text| {
        fs::write(&path, text).unwrap();
        first_trial(&Campaign::load(path.to_str().unwrap(), &Overrides::default())?)
    });
}

#[test]
fn assignments() {
    let mut lines = Vec::new();
    let mut table: toml::Table =
        Campaign::load("harsh", &Overrides::default()).unwrap().to_toml().unwrap().parse().unwrap();
    for (key, value) in std::mem::take(&mut table) {
        match value {
            toml::Value::Table(inner) => {
                lines.extend(inner.into_iter().map(|(name, value)| format!("{key}.{name}={value}")))
            }
            value => lines.push(format!("{key}={value}")),
        }
    }
    lines.retain(|line| !line.contains('\n') && !line.contains(".toml"));
    fuzz("set", &lines, |text| {
        let set = text.split('\n').map(String::from).collect();
        first_trial(&Campaign::load("harsh", &Overrides { set, ..Overrides::default() })?)
    });
}

#[test]
fn scenarios() {
    let valid = Kind::Scenario.names().into_iter().map(|name| builtin(Kind::Scenario, name).text).collect::<Vec<_>>();
    fuzz("scenario", &valid, |text| {
        let scenario = Scenario::parse(&file("mine.toml", text))?;
        let (robot, gains) = (Robot::load(&scenario.robot)?, GainSet::load(&scenario.gains)?);
        let config = EpisodeConfig { horizon_s: scenario.horizon_s.min(0.05), ..scenario.episode(&robot) };
        match scenario.cause()? {
            Cause::Push(push) => {
                simulated(&robot, &gains, &config, Disturbance { pushes: vec![push], ..Disturbance::default() })
            }
            Cause::Imposed(error) => {
                let gains = GainSet { gains: gains.gains.iter().take(1).cloned().collect(), ..gains };
                let design = Design::new(&robot, &gains, config.control_period_s)?;
                imposed::run(&robot, &design, &config, error.zmp_error_m.into(), error.start, &mut |_| {}).map(|_| ())
            }
        }
    });
}

#[test]
fn gates() {
    let names = ["catch", "hold", "a - b", "paper stepping.alpha=2"].map(String::from);
    let valid =
        ["catch >= 0.80", "catch >= hold + 0.10", "a - b >= 97.5 %", "paper stepping.alpha=2 >= baseline - 0.01"];
    fuzz("gate", &valid.map(String::from), |text| Gate::parse(text, &names).map(|_| ()));
}

#[test]
fn variants() {
    let valid = [
        "switching:gains.4.x=[1,2,3]",
        "catch:catching.lift=0.05",
        "paper:stepping.alpha=2",
        "robust:zmp_disturbance=[0.01,0.02]",
        "hold:zmp_margin=0.1",
    ];
    fuzz("variant", &valid.map(String::from), |text| {
        variant::expand(text).map(|_| ())?;
        GainSet::load(text).map(|_| ())
    });
}

/// Manifest, marker and rows of a result.
#[test]
fn results() {
    let folder = tempfile::tempdir().unwrap();
    let (made, damaged) = (folder.path().join("made"), folder.path().join("damaged"));
    let set = ["episode.horizon_s=0.4", "episode.judge.standing_time_s=0.1", "push.start_s=0.05"].map(String::from);
    let overrides = Overrides {
        set: set.into(),
        trials: Some(2),
        gains: vec!["hold".into(), "fixed".into()],
        ..Overrides::default()
    };
    let plan = Plan::new(&Campaign::load("smoke", &overrides).unwrap()).unwrap();
    let new = plan.folder(Some(&made)).unwrap();
    let mut work = Work::new(&plan, &new, RunOptions { threads: 1, shard: None }, None).unwrap();
    work.run(&Watch { stop: &AtomicBool::new(false), on_episode: &|| {}, on_part: &|_| {}, on_look: &|_, _| {} })
        .unwrap();
    const FILES: [&str; 3] = ["parts/campaign.json", "parts/part-000000.json", "parts/part-000000.csv"];
    let valid = FILES.map(|name| fs::read_to_string(made.join(name)).unwrap()).join(NEXT_FILE);
    fs::create_dir_all(damaged.join("parts")).unwrap();
    fs::copy(made.join("campaign.toml"), damaged.join("campaign.toml")).unwrap();
    fuzz("result", &[valid], |text| {
        let mut texts = text.split(NEXT_FILE);
        for name in FILES {
            fs::write(damaged.join(name), texts.next().unwrap_or_default()).unwrap();
        }
        let folder = Folder::existing(&damaged)?;
        folder.manifest.campaign.check("parts/campaign.json")?;
        if folder.blocks() > 1000 {
            return Err(Error::Parts { path: damaged.clone(), problem: "has too many blocks for this test".into() });
        }
        folder.missing();
        for rows in folder.parts()? {
            rows?.iter().for_each(|row| drop((row.pushes(), row.variation(), row.settling_s())));
        }
        StoredTrial::open(&damaged, 0, None).map(|_| ())
    });
}
