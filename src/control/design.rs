//! A gain set prepared for a robot: its feedback gains, the home posture with its torques, and a check that the rules
//! for footsteps suit the robot.

use super::body::load;
use super::stand::Support;
use crate::error::{Error, Result};
use crate::geometry::SupportPolygon;
use crate::lipm::catching::Catching;
use crate::lipm::cpi_set::nesting_warning;
use crate::lipm::gains::{FootworkRules, GainFamily, GainSet};
use crate::lipm::pendulum::Pendulum;
use crate::lipm::stepping::Stepping;
use crate::robot::dynamics::load_torques;
use crate::robot::{Command, Foot, GRAVITY, Kinematics, PerFoot, Pose, Robot, Units};
use nalgebra::{Vector2, Vector3};
use std::sync::Arc;

/// A gain set prepared for a robot. All episodes with that gain set and robot share it.
#[derive(Debug, Clone)]
pub struct Design {
    /// The robot for which the design is made.
    pub robot: Arc<Robot>,
    pub family: GainFamily,
    /// Names the gains whose CPI sets do not nest on the home support; None when all sets nest.
    pub warning: Option<String>,
    /// Joint targets at home, with the torques that carry the weight there.
    pub(super) home: Command,
    /// The units of the robot.
    pub(super) units: Units,
    /// Vector from the centre of the right sole to that of the left one at home (m), control frame.
    pub(super) stance: Vector2<f64>,
    /// Whether the legs are rigid sideways while both soles are flat on the ground, because the ankles do not roll. The
    /// ZMP then follows the push, and no reference of the COM can be followed.
    pub(super) is_rigid_sideways: bool,
}

impl Design {
    /// Designs the feedback gains, and computes their CPI sets on the home support to check that they nest.
    pub fn new(robot: &Robot, gains: &GainSet, control_period_s: f64) -> Result<Self> {
        let units = Units::of(robot);
        let pendulum = Pendulum { omega: units.omega(), dt: control_period_s };
        let family = GainFamily::design(gains, pendulum)?;
        let polygon = family.allowed_support(&home_polygon(robot), &gains.name)?;
        family.check_disturbance(&polygon, &gains.name)?;
        let warning = if family.gains.len() > 1 { nesting_warning(&family, &polygon)? } else { None };
        let footholds = home_footholds(robot, &home_kinematics(robot));
        let stance = (footholds.left.translation.vector - footholds.right.translation.vector).xy();
        match &family.footwork {
            Some(FootworkRules::Stepping(rules)) => check_stepping(rules, stance, control_period_s, &gains.name)?,
            Some(FootworkRules::Catching(rules)) => {
                check_catching(rules, robot, stance, control_period_s, &gains.name)?
            }
            None => {}
        }
        let is_rigid_sideways = Foot::BOTH.into_iter().all(|foot| !robot.soles[foot].ankle.rolls());
        let home = home_command(robot);
        Ok(Self { robot: Arc::new(robot.clone()), family, warning, home, units, stance, is_rigid_sideways })
    }

    /// The same design with a patience of 0: a footstep starts at the first tick at which the state is in no CPI set.
    pub fn without_patience(&self) -> Self {
        let mut design = self.clone();
        if let Some(FootworkRules::Stepping(rules)) = &mut design.family.footwork {
            rules.patience_s = 0.0;
        }
        design
    }

    /// The command that holds the home posture.
    pub fn home_command(&self) -> &Command {
        &self.home
    }
}

/// Checks the paper's stepping rules against this robot and control period.
fn check_stepping(rules: &Stepping, stance: Vector2<f64>, control_period_s: f64, file: &str) -> Result<()> {
    let range = &rules.range;
    if !(range.least_m..=range.outward_m).contains(&stance.y) {
        let value = format!("{} to {} m to the side", range.least_m, range.outward_m);
        let accepted =
            format!("least_m and outward_m on both sides of the distance between its soles, {:.4} m", stance.y);
        return Err(Error::value(
            file,
            "stepping.range",
            value,
            "does not contain the robot's stance at home",
            accepted,
        ));
    }
    check_swing_time("stepping", rules.swing_time_s, control_period_s, file)
}

/// Checks that the robot has what catching needs, and the catching rules against the control period.
fn check_catching(
    rules: &Catching,
    robot: &Robot,
    stance: Vector2<f64>,
    control_period_s: f64,
    file: &str,
) -> Result<()> {
    let Some(region) = robot.reach.first() else {
        let problem = format!("requires the reach of the feet of {}", robot.name);
        let accepted = "a robot whose .toml has regions [[reach]] with name, x_m, y_m and swing_time_s; or another gain \
            set, for example switching";
        return Err(Error::value(file, "catching", "a table", problem, accepted));
    };
    let [inward, outward] = region.y_m;
    if !(inward..=outward).contains(&stance.y) {
        let value = format!("{inward} to {outward} m to the side");
        let accepted = format!("y_m on both sides of the distance between its soles, {:.4} m", stance.y);
        return Err(Error::value(&robot.name, "reach[0]", value, "does not contain the stance at home", accepted));
    }
    for (i, region) in robot.reach.iter().enumerate() {
        check_swing_time(&format!("reach[{i}]"), region.swing_time_s, control_period_s, &robot.name)?;
    }
    let quickest = robot.reach.iter().map(|region| region.swing_time_s).fold(f64::INFINITY, f64::min);
    Error::check_ranges(
        file,
        "catching",
        &[("transfer_s", rules.transfer_s, 0.0, 0.5 * quickest), ("settle_s", rules.settle_s, 0.01, quickest)],
    )
}

fn check_swing_time(table: &str, swing_time_s: f64, control_period_s: f64, file: &str) -> Result<()> {
    let least = SHORTEST_SWING_TICKS * control_period_s;
    if swing_time_s >= least {
        return Ok(());
    }
    let accepted = format!("{least} s ({SHORTEST_SWING_TICKS} control periods) or more");
    Err(Error::value(file, format!("{table}.swing_time_s"), swing_time_s, "is too short", accepted))
}

/// The shortest planned swing of a foot, in control ticks.
const SHORTEST_SWING_TICKS: f64 = 10.0;

const BOTH_FEET: PerFoot<bool> = PerFoot { left: true, right: true };

/// Support polygon of both soles at home, control frame.
pub fn home_polygon(robot: &Robot) -> SupportPolygon {
    let footholds = home_footholds(robot, &home_kinematics(robot));
    Support::of(robot, &footholds, &BOTH_FEET)
        .polygon
        .expect("loading a robot checks that its soles are flat and apart")
}

fn home_kinematics(robot: &Robot) -> Kinematics {
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, &robot.home_posture());
    kinematics
}

fn home_footholds(robot: &Robot, at_home: &Kinematics) -> PerFoot<Pose> {
    PerFoot::from_fn(|foot| at_home.sole_pose(robot, foot))
}

fn home_command(robot: &Robot) -> Command {
    let kinematics = home_kinematics(robot);
    let weight = Vector3::new(0.0, 0.0, robot.mass() * GRAVITY);
    let footholds = home_footholds(robot, &kinematics);
    let wrenches = load::share(robot, &footholds, &BOTH_FEET, kinematics.com().xy(), weight);
    let mut tau_ff = vec![0.0; robot.joints.len()];
    load_torques(&kinematics, robot, -weight / robot.mass(), &wrenches, &mut tau_ff);
    Command { q_ref: robot.home_rad.clone(), dq_ref: vec![0.0; robot.joints.len()], tau_ff }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::LandingRegion;

    #[test]
    fn what_a_robot_must_be_to_catch_is_said() {
        let (robot, gains) = (Robot::load("ut-mu2").unwrap(), GainSet::load("catch").unwrap());
        let beside = robot.reach[0].clone();
        let with = |reach: Option<LandingRegion>| Robot { reach: reach.into_iter().collect(), ..robot.clone() };
        let unknown = "catch: catching = a table: requires the reach of the feet of ut-mu2";
        for (robot, period_s, words) in [
            (with(None), 0.002, unknown),
            (
                with(Some(LandingRegion { y_m: [0.1, 0.18], ..beside.clone() })),
                0.002,
                "ut-mu2: reach[0] = 0.1 to 0.18 m to the side: does not contain the stance at home; \
                 accepted: y_m on both sides of the distance between its soles, 0.0970 m",
            ),
            (
                with(Some(LandingRegion { swing_time_s: 0.14, ..beside.clone() })),
                0.015,
                "ut-mu2: reach[0].swing_time_s = 0.14: is too short; accepted: 0.15 s (10 control periods) or more",
            ),
            (
                with(Some(LandingRegion { swing_time_s: 0.09, ..beside })),
                0.002,
                "catch: catching.transfer_s = 0.05: out of range; accepted: 0 to 0.045",
            ),
        ] {
            let error = Design::new(&robot, &gains, period_s).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().starts_with(words), "{error}\nwanted: {words}");
        }
        assert!(Design::new(&robot, &gains, 0.002).is_ok());
        // The reach may be missing if the gain set does not catch.
        assert!(Design::new(&with(None), &GainSet::load("hold").unwrap(), 0.002).is_ok());
    }
}
