//! Reads a [`Robot`] from a URDF or an MJCF, and the settings beside it. What is called a URDF here may also be an MJCF.
//!
//! The accepted content of both is in the module `tree`. What they state of motors is used only where
//! settings are inferred, because the settings describe the servos.

use super::facing;
use super::infer;
use super::motors::Motors;
use super::settings::{self, RobotSettings};
pub use super::settings::{settings_path, states_soles_alone};
use super::skeleton::with_bones;
use super::tree::Tree;
pub use super::tree::opened;
use nalgebra::{Point3, Vector3};
use standfast_core::error::{Error, Result};
use standfast_core::geometry::SupportPolygon;
use standfast_core::geometry::gap::gap_m;
use standfast_core::robot::kinematics::Kinematics;
use standfast_core::robot::model::{Ankle, Foot, Link, PushPoint, Robot};
use standfast_files::assets::{self, InputKind, Source};
use std::path::Path;

/// Largest difference in height between the soles at home (m).
const LEVEL_M: f64 = 1e-4;
/// Largest tilt of each sole at home (rad).
const FLAT_RAD: f64 = 1e-3;

/// Least height of the COM above the soles at home (m).
const LEAST_COM_M: f64 = 1e-4;
/// Accepted lengths and widths of a sole, as shares of the height of the COM at home.
const SOLE_SHARES: [f64; 2] = [0.01, 2.0];
/// Accepted masses of a link with all that is fixed to it (kg).
const LINKS_KG: [f64; 2] = [1e-12, 1e7];
/// Least principal moment of inertia of a link, as a share of the robot's mass times the squared height of its COM.
/// Below a fifth of this share the physics engine divides by zero.
const LEAST_INERTIA_SHARE: f64 = 1e-16;

/// The texts from which a robot is read, and the content of its URDF.
#[derive(Debug, Clone)]
pub struct Files {
    pub urdf: Source,
    /// The meshes as a text, which replaces the files of the meshes if it is beside the URDF: `robot.meshes` for
    /// `robot.urdf`. None if the URDF names no mesh.
    pub meshes: Option<Source>,
    /// The settings (TOML). For a robot without a file of settings they are inferred.
    pub settings: Source,
    pub are_inferred: bool,
    tree: Tree,
}

impl Files {
    /// The files of a built-in robot by its name, or a URDF file with its settings beside it (same name, `.toml`). If
    /// there are no settings, they are inferred from the URDF.
    ///
    /// # Errors
    /// A file cannot be read, or the settings cannot be inferred.
    pub fn open(name_or_path: &str) -> Result<Files> {
        let urdf = opened(name_or_path)?;
        let beside = settings_path(name_or_path);
        let stated = match urdf.file.strip_prefix("builtin:") {
            Some(name) => Some(assets::open(InputKind::RobotSettings, name)?),
            None if beside.exists() => Some(assets::text(&beside)?),
            None => None,
        };
        let range_rad = match &stated {
            Some(source) => settings::parse(source)?.range_rad,
            None => None,
        };
        let (tree, are_inferred) = (Tree::parse(&urdf, range_rad)?, stated.is_none());
        let settings = match stated {
            Some(source) => source,
            None => inferred_from(&urdf, tree.clone(), None, None, None)?,
        };
        let meshes = tree.kept_meshes.clone().map(|text| Source {
            file: format!("meshes of {}", urdf.file),
            text,
        });
        Ok(Files {
            urdf,
            meshes,
            settings,
            are_inferred,
            tree,
        })
    }

    /// The extension of a file with the text of the robot.
    pub fn extension(&self) -> &'static str {
        if self.urdf.is_mjcf() { "xml" } else { "urdf" }
    }

    /// The same files with the motors of the file `path`, if there is one. It fails as [`Motors::open`] does.
    pub fn with_motors(mut self, path: Option<&str>) -> Result<Files> {
        let Some(path) = path else { return Ok(self) };
        let motors = Motors::open(path, &self.robot()?)?;
        self.settings = motors.in_settings(&self.settings)?;
        // The files of a built-in robot are not kept with a result, but its other motors have to be.
        self.settings.file = unbuilt(&self.settings.file);
        self.urdf.file = unbuilt(&self.urdf.file);
        Ok(self)
    }

    /// The robot that they describe. It fails as [`load`] does.
    pub fn robot(&self) -> Result<Robot> {
        of_tree(self.tree.clone(), &self.settings)
    }

    /// The same robot, with a warning in the log for what was inferred, changed or left out. It fails as [`load`] does.
    pub fn load(&self) -> Result<Robot> {
        if self.are_inferred {
            let urdf = &self.urdf.file;
            let beside = settings_path(urdf);
            log::warn!(
                "{urdf}: its settings are inferred, as there is no {}; `standfast init {urdf}` writes them",
                beside.display()
            );
        }
        let mut robot = self.robot()?;
        robot.urdf = Path::new(&self.urdf.file).canonicalize().ok();
        for note in &robot.notes {
            log::warn!("{}: {note}", self.urdf.file);
        }
        Ok(robot)
    }
}

/// The name of a file without the mark of what is compiled in.
fn unbuilt(file: &str) -> String {
    file.trim_start_matches("builtin:").into()
}

/// The settings that are inferred from a URDF. Joints without a range of their own get the range `range_rad` (rad) to
/// both sides or, if it is None, are locked. Fails if the URDF cannot be read or is not of a humanoid.
pub fn inferred(urdf: &Source, range_rad: Option<f64>) -> Result<Source> {
    completed(urdf, range_rad, None, None)
}

/// The settings that are inferred from a URDF as by [`inferred`], with the soles that a file [states
/// alone](states_soles_alone), and with the motors of the file `motors`.
pub fn completed(
    urdf: &Source,
    range_rad: Option<f64>,
    stated: Option<&Source>,
    motors: Option<&str>,
) -> Result<Source> {
    if let Some(range_rad) = range_rad {
        settings::check_range("init", range_rad)?;
    }
    let tree = Tree::parse(urdf, range_rad)?;
    let motors = match motors {
        Some(path) => {
            let plain = inferred_from(urdf, tree.clone(), range_rad, stated, None)?;
            Some(Motors::open(path, &of_tree(tree.clone(), &plain)?)?)
        }
        None => None,
    };
    inferred_from(urdf, tree, range_rad, stated, motors.as_ref())
}

fn inferred_from(
    urdf: &Source,
    tree: Tree,
    range_rad: Option<f64>,
    stated: Option<&Source>,
    motors: Option<&Motors>,
) -> Result<Source> {
    let text = infer::settings(urdf, tree, range_rad, stated, motors)?;
    Ok(Source {
        file: format!("settings inferred from {}", urdf.file),
        text,
    })
}

/// Loads a built-in robot by its name, or a URDF file with its settings: those beside it (same name, `.toml`), or else those
/// that are inferred from it, about which a warning is logged.
///
/// # Errors
/// A file cannot be read, is malformed, or describes a robot that this program cannot simulate.
pub fn load(name_or_path: &str) -> Result<Robot> {
    Files::open(name_or_path)?.load()
}

/// Builds a robot from the text of its two files. It fails as [`load`] does.
pub fn parse(urdf: &Source, settings: &Source) -> Result<Robot> {
    of_tree(
        Tree::parse(urdf, settings::parse(settings)?.range_rad)?,
        settings,
    )
}

fn of_tree(mut tree: Tree, settings: &Source) -> Result<Robot> {
    let parsed: RobotSettings = settings::parse(settings)?;
    let file = settings.file.as_str();
    facing::turn(&mut tree, parsed.forward);
    let states_faces = parsed.states_faces();
    let trunk = parsed.trunk(file, &tree.frames)?;
    facing::straighten(&mut tree, trunk);
    let mut robot = Robot {
        trunk,
        pushed: PushPoint::on(trunk),
        soles: parsed.soles(file, &tree)?,
        home_rad: parsed.home(file, &tree.joints)?,
        servos: parsed.servos(file, &tree.joints)?,
        motor_origins: parsed.motor_origins(&tree.joints),
        noise: parsed.noise,
        delay_s: parsed.delay_s,
        friction: parsed.friction,
        reach: parsed.reach,
        assumptions: parsed.assumptions,
        name: tree.name,
        urdf: None,
        links: tree.links,
        joints: tree.joints,
        frames: tree.frames,
        notes: tree.notes,
    };
    for foot in Foot::BOTH.into_iter().filter(|&foot| states_faces[foot]) {
        infer::stand_on_sole(&mut robot, foot);
    }
    check_masses(file, &robot)?;
    check_home(file, &robot)?;
    for foot in Foot::BOTH {
        robot.soles[foot].ankle = Ankle::of(&robot, foot);
    }
    check_support(file, &robot)?;
    check_inertias(file, &robot)?;
    Ok(with_bones(robot))
}

/// Checks that no link is too light or too heavy to be simulated.
fn check_masses(file: &str, robot: &Robot) -> Result<()> {
    let [least, most] = LINKS_KG;
    let Some(link) = robot
        .links
        .iter()
        .find(|link| !(least..=most).contains(&link.mass_kg))
    else {
        return Ok(());
    };
    let (field, accepted) = (
        format!("link {}: mass", link.name),
        format!("{least:e} to {most:e} kg"),
    );
    Err(Error::value(
        file,
        field,
        format!("{:e}", link.mass_kg),
        "out of range",
        accepted,
    ))
}

/// Checks that no link has so small an inertia that its angular acceleration is lost in rounding.
fn check_inertias(file: &str, robot: &Robot) -> Result<()> {
    let least_kg_m2 = LEAST_INERTIA_SHARE * robot.mass() * robot.home_com_height().powi(2);
    let moment = |link: &Link| link.inertia_kg_m2.symmetric_eigenvalues().min();
    let Some(link) = robot.links.iter().find(|link| moment(link) < least_kg_m2) else {
        return Ok(());
    };
    let field = format!("link {}: least moment of inertia", link.name);
    let accepted = format!("at least {least_kg_m2:.1e} kg m^2, or a fixed joint");
    Err(Error::value(
        file,
        field,
        format!("{:.1e}", moment(link)),
        "too small to be simulated",
        accepted,
    ))
}

/// Checks that the soles have a size that fits the robot, that they do not overlap, and that the parts of them on which
/// the ankles can hold the weight span an area at home.
fn check_support(file: &str, robot: &Robot) -> Result<()> {
    let height_m = robot.home_com_height();
    for foot in Foot::BOTH {
        let (sole, [least, most]) = (
            &robot.soles[foot],
            SOLE_SHARES.map(|share| share * height_m),
        );
        for (of, half_m) in ["length", "width"].into_iter().zip(sole.half_m) {
            if !(least..=most).contains(&(2.0 * half_m)) {
                let field = format!("sole of {}: {of}", robot.frames[sole.frame].name);
                let problem = format!("does not fit a robot whose COM is {height_m:.3} m high");
                let value = format!("{:.4} m", 2.0 * half_m);
                return Err(Error::value(
                    file,
                    field,
                    value,
                    problem,
                    format!("{least:.4} to {most:.3} m"),
                ));
            }
        }
    }
    let soles = Kinematics::at_home(robot).sole_poses(robot);
    let mut corners = Vec::new();
    for foot in Foot::BOTH {
        let pressable = robot.soles[foot].pressable_corners(0.5 * robot.weight_n());
        corners.extend(pressable.map(|corner| (soles[foot] * corner).xy()));
    }
    // Soles that only touch do not overlap.
    let inner = Foot::BOTH.map(|foot| {
        robot.soles[foot]
            .corners()
            .map(|at| (soles[foot] * (at * 0.99)).xy())
    });
    let [left, right] = inner.map(|corners| corners.map(|at| Point3::new(at.x, at.y, 0.0)));
    let (problem, accepted) = if SupportPolygon::hull(&corners).is_none() {
        (
            "the soles span no area on which the ankles can hold the weight",
            "a robot that can stand",
        )
    } else if gap_m(&left, &right) == 0.0 {
        ("the soles overlap at home", "soles beside each other")
    } else {
        return Ok(());
    };
    Err(Error::value(
        file,
        "soles",
        "left, right",
        problem,
        accepted,
    ))
}

/// Checks that the soles are flat and level with each other at home, without which no standing posture is defined.
fn check_home(file: &str, robot: &Robot) -> Result<()> {
    let (kinematics, height_m) = (Kinematics::at_home(robot), robot.home_com_height());
    if !(height_m.is_finite() && LEAST_COM_M < height_m) {
        let (value, problem) = (
            format!("the COM {height_m:.4} m above the soles"),
            "the robot does not stand on its feet",
        );
        return Err(Error::value(
            file,
            "home_rad",
            value,
            problem,
            format!("more than {LEAST_COM_M} m"),
        ));
    }
    let soles = kinematics.sole_poses(robot);
    for foot in Foot::BOTH {
        let tilt = (soles[foot].rotation * Vector3::z()).angle(&Vector3::z());
        if tilt > FLAT_RAD {
            let value = format!(
                "{} tilted by {tilt:.4} rad",
                robot.frames[robot.soles[foot].frame].name
            );
            let accepted = format!("up to {FLAT_RAD} rad with the base unrotated");
            return Err(Error::value(
                file,
                "home_rad",
                value,
                "soles must be flat at home",
                accepted,
            ));
        }
    }
    let step = soles.left.translation.z - soles.right.translation.z;
    if step.abs() > LEVEL_M {
        let value = format!("left sole {step:+.5} m above the right one");
        let accepted = format!("up to {LEVEL_M} m");
        return Err(Error::value(
            file,
            "home_rad",
            value,
            "soles must be level with each other at home",
            accepted,
        ));
    }
    Ok(())
}
