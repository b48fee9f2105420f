//! Infers the settings of a robot from its URDF or MJCF alone: feet, trunk, soles, home posture, servos, noise, delay, and where
//! a foot can land.

mod clearance;
mod feet;
mod figures;
mod home;
mod limbs;
mod reach;
mod sensors;
mod servos;
mod soles;
mod srdf;
mod text;

pub(super) use feet::stand_on_sole;

use crate::facing::{self, Forward};
use crate::motors::Motors;
use crate::settings::{SolesAlone, settings_path};
use crate::tree::{Tree, format_of};
use limbs::Limbs;
use nalgebra::Vector3;
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Foot, MotorOrigin, PerFoot, PushPoint, Robot, SensorNoise};
use standfast_files::assets::Source;

/// How to state by hand what cannot be inferred.
const BY_HAND: &str = "a humanoid, or a TOML file of the same name beside the robot's file that says it: trunk, [soles], [home_rad], \
                       [[servos]], [noise], friction, delay_s; the chapter Robots of the guide explains each key, and \
                       assets/robots/ut-mu2.toml is an example";

/// Number of joints of a leg that can bring its sole to any pose.
const FULL_LEG: usize = 6;

/// The text of the settings (TOML) of the robot that a URDF with this content describes. `range_rad` is the range that
/// was given to joints without one. If there is a file `stated`, its soles are taken, and `motors` in place of those of the URDF.
///
/// # Errors The robot is no humanoid; the error lists all that cannot be inferred. Or the soles are not at the ends of
/// the legs.
pub(super) fn settings(
    urdf: &Source,
    mut tree: Tree,
    range_rad: Option<f64>,
    stated: Option<&Source>,
    motors: Option<&Motors>,
) -> Result<String> {
    let fail = |problems: &[String]| {
        let problem = format!("cannot be inferred: {}", problems.join("; "));
        Error::value(&urdf.file, "settings", "(none)", problem, BY_HAND)
    };
    let mut robot = bare(&tree);
    let mut legs = limbs::legs(&robot).map_err(|problem| {
        let mut problems = vec![problem];
        if tree.without_range > 0 {
            problems.push(format!(
                    "{} joints are locked, since their limits in the file leave them no range (lower = upper): state the limits \
                     there, or give these joints a range by `standfast init --range 1.5` (rad, to both sides)",
                    tree.without_range
                ));
        }
        fail(&problems)
    })?;
    let facing = limbs::facing(&robot, &legs);
    if facing.forward != Forward::default() {
        facing::turn(&mut tree, facing.forward);
        robot = bare(&tree);
        legs = limbs::legs(&robot).map_err(|problem| fail(&[problem]))?;
    }
    let limbs = Limbs::of(&robot, legs);
    let stated = match stated {
        Some(source) => {
            let file = SolesAlone::parse(source)?;
            let soles = file.soles(&source.file, &tree)?;
            Some((source, soles, file.are_boxes()))
        }
        None => None,
    };
    let (written, missing, postures) = (tree.motors, tree.missing, tree.postures);
    robot.trunk = limbs.trunk;
    robot.pushed = PushPoint::on(limbs.trunk);
    let mut warnings = Vec::from_iter(facing.warning);
    let foot_link = |foot: Foot| limbs.legs[foot].last().map_or(0, |j| j + 1);
    let lost = missing.iter().find(|(frame, _)| {
        Foot::BOTH
            .iter()
            .any(|&f| robot.frames[*frame].link == foot_link(f))
    });
    let by_hand = format!(
        "[soles.left] and [soles.right] in {}, each with link, center_m and size_m; the same command then adds the rest",
        settings_path(&urdf.file).display()
    );
    let no_sole = |problem: String| {
        Error::value(
            &urdf.file,
            "soles",
            "(none)",
            format!("cannot be inferred: {problem}"),
            &*by_hand,
        )
    };
    let reference =
        srdf::beside(urdf, &robot)?.or_else(|| srdf::among(&postures, &urdf.file, &robot));
    let angles_rad = reference
        .as_ref()
        .map(|reference| reference.angles_rad.as_slice());
    let start_rad = angles_rad.unwrap_or(&robot.home_rad);
    let mut soles = match &stated {
        Some((source, soles, are_boxes)) => {
            if let Some(foot) = Foot::BOTH
                .into_iter()
                .find(|&foot| soles[foot].link != foot_link(foot))
            {
                let (field, name) = (
                    format!("soles.{}", foot.name()),
                    &robot.frames[soles[foot].frame].name,
                );
                let accepted = format!("a link of {}", robot.links[foot_link(foot)].name);
                return Err(Error::value(
                    &source.file,
                    field,
                    name,
                    "is not at the end of that leg",
                    accepted,
                ));
            }
            PerFoot::from_fn(|foot| soles::FoundSole::stated(soles[foot], &robot, are_boxes[foot]))
        }
        None => {
            if let Some((frame, mesh)) = lost {
                let name = &robot.frames[*frame].name;
                return Err(no_sole(format!(
                    "the mesh of the foot {name} is left out: {mesh}"
                )));
            }
            match Foot::BOTH
                .map(|foot| soles::find(&robot, foot_link(foot), start_rad, &Vector3::x()))
            {
                [Ok(left), Ok(right)] => PerFoot { left, right },
                [left, right] => {
                    let problems: Vec<String> = [left, right]
                        .into_iter()
                        .filter_map(|sole| sole.err())
                        .collect();
                    return Err(no_sole(problems.join("; ")));
                }
            }
        }
    };
    robot.soles = PerFoot::from_fn(|foot| soles[foot].sole);
    warnings.extend(
        Foot::BOTH
            .into_iter()
            .filter_map(|foot| soles[foot].warning.clone()),
    );
    let joints = Foot::BOTH.map(|foot| limbs.legs[foot].len());
    if joints.iter().any(|count| *count < FULL_LEG) {
        warnings.push(format!(
            "the legs have {} and {} joints: with fewer than {FULL_LEG}, a leg cannot bring its foot into every pose",
            joints[0], joints[1]
        ));
    }
    let home = home::find(&robot, &limbs, angles_rad).map_err(|problem| fail(&[problem]))?;
    robot.home_rad = home.home_rad;
    warnings.extend(home.warnings);
    if home.apart_m != 0.0 {
        let (short, long) = match home.apart_m > 0.0 {
            true => ("left", "right"),
            false => ("right", "left"),
        };
        warnings.push(format!(
            "the {short} leg reaches {:.2} mm less far down than the {long} one; both soles are taken to be level, halfway",
            1e3 * home.apart_m.abs()
        ));
        for foot in Foot::BOTH {
            soles[foot].raise(-0.5 * foot.side() * home.apart_m);
            robot.soles[foot] = soles[foot].sole;
        }
    }
    for foot in Foot::BOTH.into_iter().filter(|&foot| !soles[foot].is_box) {
        stand_on_sole(&mut robot, foot);
    }
    let format = format_of(urdf);
    let (mut servos, unbelieved) = servos::find(&robot, &limbs, &written, format);
    warnings.extend(unbelieved);
    if let Some(motors) = motors {
        let from = format!("of {}", motors.file);
        for (found, joint) in servos.iter_mut().zip(&robot.joints) {
            if let Some(motor) = motors.by_joint.get(&joint.name) {
                motor.replace(&mut found.servo, &mut found.origin, &from);
            }
        }
    }
    robot.servos = servos.iter().map(|found| found.servo).collect();
    robot.motor_origins = servos.iter().map(|found| found.origin.clone()).collect();
    robot.noise = sensors::noise(&robot);
    robot.delay_s = sensors::delay_s(&robot);
    let (regions, unreached) = reach::find(&robot, &limbs);
    robot.reach = regions;
    warnings.extend(unreached);
    robot.assumptions = assumptions(&servos, reference.is_some());
    robot
        .assumptions
        .extend(warnings.iter().map(|warning| format!("WARNING: {warning}")));
    let origins = text::Origins {
        soles,
        servos,
        solved: home.solved,
        reference: reference.map(|reference| reference.name),
        range_rad,
        forward: (facing.forward, facing.why),
        soles_are_stated: stated.is_some(),
    };
    Ok(text::toml(&urdf.file, format, &robot, &origins))
}

/// A robot of which only the URDF is known. The other fields are filled in step by step.
fn bare(tree: &Tree) -> Robot {
    Robot {
        name: tree.name.clone(),
        urdf: None,
        links: tree.links.clone(),
        joints: tree.joints.clone(),
        frames: tree.frames.clone(),
        trunk: 0,
        pushed: PushPoint::on(0),
        soles: PerFoot::from_fn(|_| soles::none()),
        home_rad: vec![0.0; tree.joints.len()],
        servos: Vec::new(),
        motor_origins: Vec::new(),
        noise: SensorNoise::default(),
        delay_s: 0.0,
        friction: sensors::FRICTION,
        reach: Vec::new(),
        assumptions: Vec::new(),
        notes: tree.notes.clone(),
    }
}

/// The assumptions, in words.
fn assumptions(servos: &[servos::FoundServo], has_reference: bool) -> Vec<String> {
    let assumed = |origin: fn(&MotorOrigin) -> &str| {
        let mut servos = servos.iter();
        servos.any(|found| origin(&found.origin) == servos::ASSUMED)
    };
    let figures = [
        (assumed(|origin| &origin.rotor_inertia), "rotor inertias"),
        (assumed(|origin| &origin.torque), "torque limits"),
        (assumed(|origin| &origin.speed), "speed limits"),
    ];
    let mut motors = vec!["gains"];
    motors.extend(
        figures
            .into_iter()
            .filter_map(|(is_assumed, what)| is_assumed.then_some(what)),
    );
    let home = (!has_reference).then(|| "home: knees bent by 0.7 rad, arms hanging".to_string());
    [format!(
        "servos: {}, in proportion to weight, height and time",
        motors.join(", ")
    )]
    .into_iter()
    .chain(["friction, delay, sensor noise".to_string()])
    .chain(home)
    .collect()
}
