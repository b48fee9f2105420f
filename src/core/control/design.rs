//! A gain set prepared for a robot: its feedback gains, the home posture with its torques, and a check that the rules
//! for footsteps suit the robot.

use super::stand::Support;
use crate::error::{Error, Result};
use crate::geometry::SupportPolygon;
use crate::lipm::capture::SwingRegion;
use crate::lipm::catching::{Catching, Departures, first};
use crate::lipm::cpi_set::nesting_warning;
use crate::lipm::gains::{GainFamily, GainSet};
use crate::lipm::pendulum::Pendulum;
use crate::lipm::stepping::Stepping;
use crate::robot::{Foot, Kinematics, PerFoot, Robot, Units};
use crate::socket::Command;
use nalgebra::Vector2;
use std::sync::Arc;

/// A gain set prepared for a robot. All episodes with that gain set and robot share it.
#[derive(Debug, Clone)]
pub struct Design {
    /// The robot for which the design is made.
    pub robot: Arc<Robot>,
    pub family: GainFamily,
    /// The footwork rules for a state in no CPI set. None if the robot only stands.
    pub footwork: Option<FootworkRules>,
    /// How the first footsteps depart from the rule `[catching]`.
    pub departures: Departures,
    /// Names the gains whose CPI sets do not nest on the home support; None when all sets nest.
    pub warning: Option<String>,
    /// Joint targets at home, with the torques that carry the weight there.
    pub(super) home: Command,
    pub(super) units: Units,
    /// Vector from the centre of the right sole to the centre of the left one at home (m), control frame.
    pub(super) stance: Vector2<f64>,
    /// Whether the legs are rigid sideways while both soles are flat on the ground, because the ankles do not roll. The
    /// ZMP then follows the push, and no reference of the COM can be followed.
    pub(super) is_rigid_sideways: bool,
}

/// The footwork rules, each with its table in a gain set's file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FootworkRules {
    /// The paper's rule, `[stepping]`.
    Stepping(Stepping),
    /// The rule that plans anew during the swing, `[catching]`.
    Catching(Catching),
}

impl Design {
    /// Designs the feedback gains, and computes their CPI sets on the home support to check that they nest.
    pub fn new(robot: &Robot, gains: &GainSet, control_period_s: f64) -> Result<Self> {
        let units = Units::of(robot);
        let pendulum = Pendulum {
            omega: units.omega(),
            dt: control_period_s,
        };
        let family = GainFamily::design(gains, pendulum, units.half_sole_m)?;
        let polygon = family.allowed_support(&home_polygon(robot), &gains.name)?;
        family.check_disturbance(&polygon, &gains.name)?;
        let warning = if family.gains.len() > 1 {
            nesting(gains, &family, &polygon)?
        } else {
            None
        };
        let footholds = Kinematics::at_home(robot).sole_poses(robot);
        let stance = (footholds.left.translation.vector - footholds.right.translation.vector).xy();
        let footwork = footwork_rules(gains, robot, &units, stance.y)?;
        let stays = (gains.takes_footsteps() && footwork.is_none()).then(|| {
            format!(
                "takes no footsteps, as it is not known where the feet of {} can land ([[reach]] of its settings)",
                robot.name
            )
        });
        let warning = warning
            .into_iter()
            .chain(stays)
            .reduce(|a, b| format!("{a}; {b}"));
        let departures = gains
            .catching
            .as_ref()
            .map_or_else(Departures::default, |table| first(&table.departures));
        check_swing_times(footwork, robot, control_period_s, &gains.name)?;
        let is_rigid_sideways = Foot::BOTH
            .into_iter()
            .all(|foot| !robot.soles[foot].ankle.rolls());
        let (robot, home) = (Arc::new(robot.clone()), robot.home_command());
        Ok(Self {
            robot,
            family,
            footwork,
            departures,
            warning,
            home,
            units,
            stance,
            is_rigid_sideways,
        })
    }

    /// The paper's stepping rules, if the gain set uses them.
    pub fn stepping(&self) -> Option<&Stepping> {
        match &self.footwork {
            Some(FootworkRules::Stepping(rules)) => Some(rules),
            _ => None,
        }
    }

    /// The command that holds the home posture.
    pub fn home_command(&self) -> &Command {
        &self.home
    }
}

/// Shortest control period with which nesting is checked, in 1/omega. CPI sets hardly depend on a period as short as
/// this, and with half of it the check takes four times as long.
const LEAST_PHASE: f64 = 0.005;

/// Names the gains of a gain set whose CPI sets do not nest on `support`.
fn nesting(
    gains: &GainSet,
    family: &GainFamily,
    support: &SupportPolygon,
) -> Result<Option<String>> {
    let pendulum = family.pendulum;
    if pendulum.phase() >= LEAST_PHASE {
        return nesting_warning(family, support);
    }
    let slower = Pendulum {
        dt: LEAST_PHASE / pendulum.omega,
        ..pendulum
    };
    nesting_warning(
        &GainFamily::design(gains, slower, family.half_sole_m)?,
        support,
    )
}

/// The footwork rules of a gain set for a robot whose feet stand `stance_m` (m) apart at home. It is None if the robot
/// only stands, as one does that does not say where its feet can land. Fails if its feet at home are not in such a region.
fn footwork_rules(
    gains: &GainSet,
    robot: &Robot,
    units: &Units,
    stance_m: f64,
) -> Result<Option<FootworkRules>> {
    let Some(beside) = robot.reach.first().filter(|_| gains.takes_footsteps()) else {
        return Ok(None);
    };
    let ([backward, forward], [inward, outward]) = (beside.x_m, beside.y_m);
    if !(inward..=outward).contains(&stance_m) || backward >= 0.0 || forward <= 0.0 {
        let value =
            format!("{backward} to {forward} m forward and {inward} to {outward} m to the side");
        let accepted = format!(
            "x_m on both sides of 0, and y_m on both sides of the distance between its soles, {stance_m:.4} m"
        );
        return Err(Error::value(
            &robot.name,
            "reach[0]",
            value,
            "does not contain the stance at home",
            accepted,
        ));
    }
    let (length_m, time_s) = (units.length_m, units.time_s());
    let quickest_s = robot
        .reach
        .iter()
        .map(|region| region.swing_time_s)
        .fold(f64::INFINITY, f64::min);
    let beside = SwingRegion {
        x_m: beside.x_m,
        y_m: beside.y_m,
        swing_time_s: beside.swing_time_s,
    };
    let stepping = gains
        .stepping
        .map(|table| FootworkRules::Stepping(table.rules(length_m, time_s, &beside, stance_m)));
    let catching = gains
        .catching
        .as_ref()
        .map(|table| FootworkRules::Catching(table.rules(length_m, time_s, quickest_s)));
    Ok(stepping.or(catching))
}

/// Checks that swings last long enough for the control period.
fn check_swing_times(
    rules: Option<FootworkRules>,
    robot: &Robot,
    control_period_s: f64,
    file: &str,
) -> Result<()> {
    match rules {
        None => return Ok(()),
        Some(FootworkRules::Stepping(rules)) => {
            return check_swing_time(
                file,
                "stepping.swing_time",
                rules.swing_time_s,
                control_period_s,
            );
        }
        Some(FootworkRules::Catching(_)) => {}
    }
    for (i, region) in robot.reach.iter().enumerate() {
        let field = format!("reach[{i}].swing_time_s");
        check_swing_time(&robot.name, &field, region.swing_time_s, control_period_s)?;
    }
    Ok(())
}

fn check_swing_time(
    file: &str,
    field: &str,
    swing_time_s: f64,
    control_period_s: f64,
) -> Result<()> {
    let least = SHORTEST_SWING_TICKS * control_period_s;
    if swing_time_s >= least {
        return Ok(());
    }
    let (value, accepted) = (
        format!("{swing_time_s} s"),
        format!("{least} s ({SHORTEST_SWING_TICKS} control periods) or more"),
    );
    Err(Error::value(file, field, value, "is too short", accepted))
}

/// The shortest planned swing of a foot, in control ticks.
const SHORTEST_SWING_TICKS: f64 = 10.0;

const BOTH_FEET: PerFoot<bool> = PerFoot {
    left: true,
    right: true,
};

/// Support polygon of both soles at home, control frame.
pub fn home_polygon(robot: &Robot) -> SupportPolygon {
    let footholds = Kinematics::at_home(robot).sole_poses(robot);
    Support::of(robot, &footholds, &BOTH_FEET)
        .polygon
        .expect("loading a robot checks that its soles are flat and apart")
}
