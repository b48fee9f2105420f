//! Any input is either read or refused in words, and any input that is read can be designed for and simulated. The
//! inputs are mutations of valid ones, and inputs that once failed (`tests/data/fuzz`).
//!
//! `STANDFAST_FUZZ_CASES=N` runs N cases of each kind. The running case, and so the case that crashed or hung, is in
//! `target/tmp/fuzz/KIND`; a copy of it in the folder of its kind becomes part of the test.

#[path = "fuzz/mutations.rs"]
mod mutations;

use mutations::{fuzz, simulated};
use standfast::controllers::{self, variant};
use standfast::core::robot::{Robot, Units};
use standfast::files::assets::{self, InputKind, Source};
use standfast::robots::urdf;
use standfast::sim::Push;
use standfast::sim::episode::{Disturbance, EpisodeConfig};
use standfast::study::ask::gate::Gate;
use standfast::study::ask::trial;
use standfast::study::run::{CampaignRun, RunEvents, RunOptions};
use standfast::study::{Campaign, Folder, Overrides, PreparedCampaign, StoredTrial};
use standfast::{Error, Result};
use std::fs;
use std::sync::atomic::AtomicBool;

/// Separator between the files of one case.
const NEXT_FILE: &str = "\n=====\n";

fn builtin(kind: InputKind, name: &str) -> Source {
    assets::open(kind, name).unwrap()
}

fn file(name: &str, text: &str) -> Source {
    Source {
        file: name.into(),
        text: text.into(),
    }
}

fn pushed(robot: &Robot) -> Result<()> {
    let units = Units::of(robot);
    let push = Push {
        start_s: 0.004,
        ..Push::of(&units)
    };
    let disturbance = Disturbance {
        pushes: vec![push],
        ..Disturbance::default()
    };
    let gains = if robot.reach.is_empty() {
        "fixed"
    } else {
        "catch"
    };
    simulated(
        robot,
        &standfast::controllers::gain_set(gains)?,
        &EpisodeConfig::of(&units),
        disturbance,
    )
}

/// A refusal by the design is a refusal in words, too.
fn read_of(robot: Result<Robot>) -> Result<()> {
    robot.and_then(|robot| pushed(&robot))
}

#[test]
fn urdf() {
    let settings = builtin(InputKind::RobotSettings, "ut-mu2");
    let valid = [builtin(InputKind::Robot, "ut-mu2").text];
    fuzz("urdf", &valid, |text| {
        read_of(standfast::robots::parse(
            &file("mine.urdf", text),
            &settings,
        ))
    });
}

#[test]
fn inferred_settings() {
    let valid = [
        include_str!("../assets/robots/child.urdf").to_string(),
        builtin(InputKind::Robot, "ut-mu2").text,
    ];
    fuzz("inferred", &valid, |text| {
        let urdf = file("mine.urdf", text);
        read_of(
            urdf::inferred(&urdf, None)
                .and_then(|settings| standfast::robots::parse(&urdf, &settings)),
        )
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

/// A tetrahedron of 10 cm, of which one face is drawn.
const KEPT: &str = "mesh 1 1 1 any.obj\nhull 0 0 0\nhull 0.1 0 0\nhull 0 0.1 0\nhull 0 0 0.1
point 0 0 0\npoint 0.1 0 0\npoint 0 0.1 0\ntriangle 0 1 2\n";

/// Meshes that collide on the robot's arm, each after its format; and the kept text of the meshes.
#[test]
fn meshes() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    let urdf = builtin(InputKind::Robot, "ut-mu2").text;
    let at = urdf.find("</link>").unwrap();
    let valid: Vec<String> = [
        (
            "obj",
            include_str!("../assets/robots/adult/meshes/head.obj"),
        ),
        (
            "stl",
            include_str!("../assets/robots/adult/meshes/foot.stl"),
        ),
        ("dae", COLLADA),
        ("meshes", KEPT),
    ]
    .map(|(format, text)| format!("{format}{NEXT_FILE}{text}"))
    .to_vec();
    fs::write(
        path("mine.toml"),
        builtin(InputKind::RobotSettings, "ut-mu2").text,
    )
    .unwrap();
    fuzz("mesh", &valid, |text| {
        let (format, mesh) = text.split_once(NEXT_FILE).unwrap_or(("obj", text));
        let format = if ["stl", "dae", "meshes"].contains(&format) {
            format
        } else {
            "obj"
        };
        let (file, name) = match format {
            "meshes" => ("mine.meshes".to_string(), "any.obj".to_string()),
            _ => (format!("any.{format}"), format!("any.{format}")),
        };
        fs::write(path(&file), mesh).unwrap();
        let solid =
            format!("<collision><geometry><mesh filename=\"{name}\"/></geometry></collision>");
        fs::write(
            path("mine.urdf"),
            format!("{}{solid}{}", &urdf[..at], &urdf[at..]),
        )
        .unwrap();
        let read = standfast::robots::load(&path("mine.urdf").to_string_lossy());
        fs::remove_file(path(&file)).unwrap();
        read_of(read)
    });
}

#[test]
fn robot_settings() {
    let robot = builtin(InputKind::Robot, "ut-mu2");
    let valid = [builtin(InputKind::RobotSettings, "ut-mu2").text];
    fuzz("settings", &valid, |text| {
        read_of(standfast::robots::parse(&robot, &file("mine.toml", text)))
    });
}

#[test]
fn gain_sets() {
    let robot = standfast::robots::load("ut-mu2").unwrap();
    let valid = InputKind::Controller
        .names()
        .into_iter()
        .map(|name| builtin(InputKind::Controller, name).text)
        .collect::<Vec<_>>();
    let config = EpisodeConfig::of(&Units::of(&robot));
    fuzz("gains", &valid, |text| {
        controllers::read(&file("mine.toml", text))?;
        // A controller of another kind has no gains to simulate.
        let Ok(gains) = standfast::controllers::parse_gain_set(&file("mine.toml", text)) else {
            return Ok(());
        };
        simulated(
            &robot,
            &gains,
            &config,
            Disturbance {
                pushes: vec![Push::of(&Units::of(&robot))],
                ..Disturbance::default()
            },
        )
    });
}

/// The first trial of a campaign, on its robot.
fn first_trial(campaign: &Campaign) -> Result<()> {
    let robot = standfast::robots::load(&campaign.robot)?;
    campaign
        .controllers
        .iter()
        .try_for_each(|gains| controllers::load(gains).map(|_| ()))?;
    campaign.to_toml()?;
    let disturbance = trial::disturbance(campaign, campaign.trials - 1);
    simulated(
        &robot,
        &standfast::controllers::gain_set("fixed")?,
        &campaign.episode,
        disturbance,
    )
}

#[test]
fn campaigns() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    let everything = "[episode]\nphysics_step_s = 0.001\n[stopping]\nuntil_resolved = true\n";
    let names = InputKind::Campaign.names().into_iter();
    let mut valid: Vec<String> = names
        .map(|name| builtin(InputKind::Campaign, name).text)
        .collect();
    valid.push(format!(
        "name = 'c'\ntrials = 3\nseed = 1\n[push]\nimpulse = {{ normal = [1, 0.2] }}\n{everything}"
    ));
    fuzz("campaign", &valid, |text| {
        fs::write(&path, text).unwrap();
        first_trial(&Campaign::load(
            path.to_str().unwrap(),
            &Overrides::default(),
        )?)
    });
}

#[test]
fn assignments() {
    let mut lines = Vec::new();
    let mut table: toml::Table = Campaign::load("harsh", &Overrides::default())
        .unwrap()
        .to_toml()
        .unwrap()
        .parse()
        .unwrap();
    for (key, value) in std::mem::take(&mut table) {
        match value {
            toml::Value::Table(inner) => lines.extend(
                inner
                    .into_iter()
                    .map(|(name, value)| format!("{key}.{name}={value}")),
            ),
            value => lines.push(format!("{key}={value}")),
        }
    }
    lines.retain(|line| !line.contains('\n') && !line.contains(".toml"));
    fuzz("set", &lines, |text| {
        let set = text.split('\n').map(String::from).collect();
        first_trial(&Campaign::load(
            "harsh",
            &Overrides {
                set,
                ..Overrides::default()
            },
        )?)
    });
}

#[test]
fn gates() {
    let names = ["catch", "hold", "a - b", "paper stepping.alpha=2"].map(String::from);
    let valid = [
        "catch >= 0.80",
        "catch >= hold + 0.10",
        "a - b >= 97.5 %",
        "paper stepping.alpha=2 >= baseline - 0.01",
    ];
    fuzz("gate", &valid.map(String::from), |text| {
        Gate::parse(text, &names).map(|_| ())
    });
}

#[test]
fn variants() {
    let valid = [
        "switching:gains.4.x=[1,2,3]",
        "catch:catching.lift=0.05",
        "paper:stepping.alpha=2",
        "robust:zmp_disturbance=[0.01,0.02]",
        "hold:description=stiff",
    ];
    fuzz("variant", &valid.map(String::from), |text| {
        variant::expand(text).map(|_| ())?;
        controllers::load(text).map(|_| ())
    });
}

/// Manifest, marker and rows of a result.
#[test]
fn results() {
    let folder = tempfile::tempdir().unwrap();
    let (made, damaged) = (folder.path().join("made"), folder.path().join("damaged"));
    let set = [
        "episode.horizon_s=0.4",
        "episode.judge.standing_time_s=0.1",
        "push.start_s=0.05",
    ]
    .map(String::from);
    let overrides = Overrides {
        set: set.into(),
        trials: Some(2),
        controllers: vec!["hold".into(), "fixed".into()],
        ..Overrides::default()
    };
    let plan = PreparedCampaign::new(&Campaign::load("smoke", &overrides).unwrap()).unwrap();
    let new = plan.folder(Some(&made)).unwrap();
    let mut work = CampaignRun::new(
        &plan,
        &new,
        RunOptions {
            threads: 1,
            ..RunOptions::default()
        },
        None,
    )
    .unwrap();
    work.run(&RunEvents {
        stop: &AtomicBool::new(false),
        on_episode: &|| {},
        on_part: &|_| {},
        on_look: &|_, _| {},
    })
    .unwrap();
    const FILES: [&str; 2] = ["parts/campaign.json", "parts/part-000000.parquet"];
    // A byte is a character, so that a part is a text, too.
    let valid = FILES
        .map(|name| {
            fs::read(made.join(name))
                .unwrap()
                .into_iter()
                .map(char::from)
                .collect::<String>()
        })
        .join(NEXT_FILE);
    fs::create_dir_all(damaged.join("parts")).unwrap();
    fs::copy(made.join("campaign.toml"), damaged.join("campaign.toml")).unwrap();
    fuzz("result", &[valid], |text| {
        let mut texts = text.split(NEXT_FILE);
        for name in FILES {
            let text = texts.next().unwrap_or_default();
            let bytes: Vec<u8> = text.chars().map(|byte| byte as u8).collect();
            fs::write(damaged.join(name), bytes).unwrap();
        }
        let folder = Folder::existing(&damaged)?;
        folder.manifest.campaign.check("parts/campaign.json")?;
        if folder.blocks() > 1000 {
            return Err(Error::Parts {
                path: damaged.clone(),
                problem: "has too many blocks for this test".into(),
            });
        }
        folder.missing();
        for rows in folder.parts()? {
            assert!(
                rows?
                    .iter()
                    .all(|row| row.settling_s().is_none_or(|s| s >= 0.0))
            );
        }
        StoredTrial::open(&damaged, 0, None).map(|_| ())
    });
}
