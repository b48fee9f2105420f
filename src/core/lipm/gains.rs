//! Gain sets: the content of a TOML file under `assets/controllers/`, and the feedback gains that follow from it (eq. 11-13).
//!
//! A family of gains is ordered from slow to fast. It nests (Sect. III.D: the CPI set of a faster gain lies inside the
//! set of a slower one) if every gain has three such poles: one at -omega, so that the feedback acts on the divergent
//! component alone, a fast one that all gains share, and a slow one that orders the gains. With other poles the family
//! may not nest; [`Inclusion`](super::cpi_set::Inclusion) checks this.

use super::axis_loop::AxisLoop;
use super::catching::CatchingTable;
use super::disturbance::{Spread, ZmpDisturbance};
use super::pendulum::{Pendulum, State};
use super::stepping::SteppingTable;
use crate::arrays::exactly;
use crate::error::{Error, Result};
use crate::geometry::SupportPolygon;
use nalgebra::{Matrix6, Point2, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Which gain moves the ZMP while the state is in no gain's CPI set and both feet stay on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutOfSets {
    /// The slowest gain, whose CPI set is the largest.
    #[default]
    Slowest,
    /// The fastest gain, which moves the ZMP farthest beyond the DCM.
    Fastest,
}

impl OutOfSets {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// A gain set as its file states it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GainSet {
    /// The kind of controller, `cpi`, which may be left out.
    #[serde(default, skip_serializing)]
    pub kind: Option<String>,
    /// Name of the gain set in tables and results.
    pub name: String,
    /// A sentence that describes the gain set.
    #[serde(default)]
    pub description: String,
    /// The ZMP keeps this distance from the edges of the support polygon, in half sole lengths.
    #[serde(default = "default_zmp_margin")]
    pub zmp_margin: f64,
    /// The CPI sets hold for every disturbance of the ZMP up to this bound on each axis, in half sole lengths; see
    /// [`disturbance`](super::disturbance). With 0 they are the CPI sets of the paper.
    #[serde(default, skip_serializing_if = "ZmpDisturbance::is_none")]
    pub zmp_disturbance: ZmpDisturbance,
    /// Which gain acts when no CPI set contains the state.
    #[serde(default, skip_serializing_if = "OutOfSets::is_default")]
    pub out_of_sets: OutOfSets,
    /// The gains, from slow to fast.
    #[serde(default)]
    pub gains: Vec<GainPoles>,
    /// The paper's rule for footsteps when no CPI set contains the state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stepping: Option<SteppingTable>,
    /// The rule that plans footsteps anew during the swing. With neither table the robot only stands; a file with both
    /// tables is refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub catching: Option<CatchingTable>,
}

/// The poles of one gain, as multiples of -omega (1 is the pole at -omega).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GainPoles {
    pub name: String,
    #[serde(deserialize_with = "exactly")]
    pub x: [f64; 3],
    #[serde(deserialize_with = "exactly")]
    pub y: [f64; 3],
}

/// Largest number of gains in a gain set. The CPI sets of 32 gains take some seconds.
const MOST_GAINS: usize = 32;
/// Slowest and fastest pole, as a multiple of -omega. The effect of the fastest one decays within a control period.
/// With faster poles, the powers of the poles would leave the range of numbers.
const POLES: [f64; 2] = [1e-4, 500.0];
/// Largest margin and disturbance of the ZMP, in half sole lengths.
const MOST_OF_SOLE: f64 = 10.0;

fn default_zmp_margin() -> f64 {
    0.06
}

impl GainSet {
    /// Whether it has rules for footsteps.
    pub fn takes_footsteps(&self) -> bool {
        self.stepping.is_some() || self.catching.is_some()
    }

    /// Checks the values. Errors name the gain set `file`.
    pub fn validate(&self, file: &str) -> Result<()> {
        if self.name.trim().is_empty() {
            return Err(Error::value(
                file,
                "name",
                format!("{:?}", self.name),
                "is empty",
                "a name",
            ));
        }
        if let Some(kind) = self.kind.as_ref().filter(|kind| *kind != "cpi") {
            return Err(Error::value(
                file,
                "kind",
                kind,
                "is not a gain set",
                "a controller of kind \"cpi\", such as switching",
            ));
        }
        let is_share = |value: &f64| (0.0..=MOST_OF_SOLE).contains(value);
        let (problem, accepted) = (
            "out of range",
            format!("0 to {MOST_OF_SOLE}, in half sole lengths"),
        );
        if !is_share(&self.zmp_margin) {
            return Err(Error::value(
                file,
                "zmp_margin",
                self.zmp_margin,
                problem,
                accepted,
            ));
        }
        if !self.zmp_disturbance.bounds().iter().all(is_share) {
            return Err(Error::value(
                file,
                "zmp_disturbance",
                self.zmp_disturbance.text(1.0),
                problem,
                format!("{accepted}, or [x, y]"),
            ));
        }
        let count = self.gains.len();
        if count > MOST_GAINS {
            return Err(Error::value(
                file,
                "gains",
                format!("{count} gains"),
                "too many",
                format!("up to {MOST_GAINS} gains"),
            ));
        }
        if count == 0 {
            return Err(Error::value(
                file,
                "gains",
                "none",
                "a gain set needs gains",
                "one or more [[gains]], slow to fast",
            ));
        }
        if let Some(stepping) = &self.stepping {
            stepping.validate(file)?;
        }
        if let Some(catching) = &self.catching {
            if self.stepping.is_some() {
                return Err(Error::value(
                    file,
                    "catching",
                    "a table",
                    "excludes [stepping]",
                    "one of the two tables",
                ));
            }
            catching.validate(file)?;
        }
        for (i, gain) in self.gains.iter().enumerate() {
            if self.gains[..i]
                .iter()
                .any(|earlier| earlier.name == gain.name)
            {
                return Err(Error::value(
                    file,
                    format!("gains[{i}].name"),
                    format!("{:?}", gain.name),
                    "is used twice",
                    "distinct names",
                ));
            }
            for (axis, poles) in [("x", gain.x), ("y", gain.y)] {
                let [slowest, fastest] = POLES;
                if let Some(k) = poles
                    .iter()
                    .position(|pole| !(slowest..=fastest).contains(pole))
                {
                    let problem = match poles[k] {
                        pole if pole > fastest => "is too fast".into(),
                        pole if pole > 0.0 => "is too slow".into(),
                        _ => format!("gain {:?} would be unstable", gain.name),
                    };
                    let field = format!("gains[{i}].{axis}[{k}]");
                    let accepted =
                        format!("positive numbers: multiples of -omega, {slowest} to {fastest}");
                    return Err(Error::value(file, field, poles[k], problem, accepted));
                }
            }
        }
        Ok(())
    }
}

/// One gain: F_i of the paper, with its closed loop Sigma_i.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    pub name: String,
    pub x: AxisLoop,
    pub y: AxisLoop,
    /// Largest distances by which disturbances can have moved the ZMP; none in the paper.
    pub spread: Spread,
}

impl Gain {
    /// Places the poles. The CPI sets of this gain hold without disturbances.
    pub fn design(pendulum: &Pendulum, poles: &GainPoles) -> Self {
        let (x, y) = (
            AxisLoop::design(pendulum, poles.x),
            AxisLoop::design(pendulum, poles.y),
        );
        Self {
            name: poles.name.clone(),
            x,
            y,
            spread: Spread::default(),
        }
    }

    /// The gain with CPI sets that hold for all disturbances of the ZMP of at most `bounds` (m).
    pub fn under(self, pendulum: &Pendulum, bounds: Vector2<f64>) -> Self {
        Self {
            spread: Spread::new(pendulum, &self.x, &self.y, bounds),
            ..self
        }
    }

    /// Velocity of the ZMP u = -F x (m/s) (eq. 11).
    pub fn zmp_rate(&self, state: &State) -> Vector2<f64> {
        -Vector2::new(self.x.feedback.dot(&state.x), self.y.feedback.dot(&state.y))
    }

    /// The ZMP at which `zmp_rate` would be zero with the present COM and COM velocity.
    pub fn resting_zmp(&self, state: &State) -> Point2<f64> {
        let rest =
            |f: &Vector3<f64>, axis: &Vector3<f64>| -(f[0] * axis[0] + f[1] * axis[1]) / f[2];
        Point2::new(
            rest(&self.x.feedback, &state.x),
            rest(&self.y.feedback, &state.y),
        )
    }

    /// The state one period later, in closed loop (eq. 13).
    pub fn successor(&self, state: &State) -> State {
        State {
            x: self.x.closed * state.x,
            y: self.y.closed * state.y,
        }
    }

    /// The closed-loop matrix of eq. 13, which acts on the state of eq. 5.
    pub fn closed_loop(&self) -> Matrix6<f64> {
        let mut closed = Matrix6::zeros();
        closed
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&self.x.closed);
        closed
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&self.y.closed);
        closed
    }
}

/// A gain set designed for a pendulum.
#[derive(Debug, Clone, PartialEq)]
pub struct GainFamily {
    pub name: String,
    /// Half the length of a sole (m), the unit of the margin and the disturbance in a gain set.
    pub half_sole_m: f64,
    /// Margin of the ZMP (m); see [`GainSet::zmp_margin`].
    pub zmp_margin: f64,
    /// Bound of the disturbance of the ZMP, in half sole lengths; see [`GainSet::zmp_disturbance`].
    pub zmp_disturbance: ZmpDisturbance,
    /// Which gain acts when no CPI set contains the state.
    pub out_of_sets: OutOfSets,
    pub pendulum: Pendulum,
    /// The gains, from slow to fast.
    pub gains: Vec<Gain>,
}

impl GainFamily {
    /// The polygon in which the ZMP may be: `support` less the gain set's margin. It fails (naming `file`) if nothing
    /// is left.
    pub fn allowed_support(&self, support: &SupportPolygon, file: &str) -> Result<SupportPolygon> {
        support.inset(self.zmp_margin).ok_or_else(|| {
            let value = format!("{:.4}", self.zmp_margin / self.half_sole_m);
            let accepted = "less than half the width of the support, in half sole lengths";
            Error::value(
                file,
                "zmp_margin",
                value,
                "leaves no support at home",
                accepted,
            )
        })
    }

    /// Checks that every gain has a CPI set on `support`, where the ZMP may be. It fails (naming `file`) if
    /// disturbances can move a ZMP at the origin out of `support`.
    pub fn check_disturbance(&self, support: &SupportPolygon, file: &str) -> Result<()> {
        let (mut worst, mut gain) = (0.0_f64, "");
        for candidate in &self.gains {
            let [x, y] = candidate.spread.limit();
            for h in support.half_planes() {
                let share = (h.normal.x.abs() * x + h.normal.y.abs() * y) / h.distance;
                if share > worst {
                    (worst, gain) = (share, &candidate.name);
                }
            }
        }
        if worst < 1.0 {
            return Ok(());
        }
        let problem = format!("leaves gain {gain:?} no set at home");
        let accepted = format!("less than {}", self.zmp_disturbance.text(1.0 / worst));
        Err(Error::value(
            file,
            "zmp_disturbance",
            self.zmp_disturbance.text(1.0),
            problem,
            accepted,
        ))
    }

    /// Bound of the disturbance of the ZMP on each axis (m).
    pub fn zmp_disturbance_m(&self) -> Vector2<f64> {
        self.zmp_disturbance.bounds() * self.half_sole_m
    }

    /// The family without disturbances, with the CPI sets of the paper.
    pub fn undisturbed(&self) -> Self {
        let gains = self
            .gains
            .iter()
            .map(|gain| Gain {
                spread: Spread::default(),
                ..gain.clone()
            })
            .collect();
        Self {
            zmp_disturbance: ZmpDisturbance::default(),
            gains,
            ..self.clone()
        }
    }

    /// Places the poles of every gain, for a robot whose soles have half the length `half_sole_m` (m). It fails if the
    /// gain set or the pendulum is not valid.
    pub fn design(set: &GainSet, pendulum: Pendulum, half_sole_m: f64) -> Result<Self> {
        set.validate(&set.name)?;
        for (field, value) in [("omega", pendulum.omega), ("dt", pendulum.dt)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::value(
                    "pendulum",
                    field,
                    value,
                    "is not positive",
                    "a positive number",
                ));
            }
        }
        if pendulum.omega * pendulum.dt > 1.0 {
            let accepted = format!("at most 1/omega = {} s", 1.0 / pendulum.omega);
            return Err(Error::value(
                "pendulum",
                "dt",
                pendulum.dt,
                "the pendulum falls within a period",
                accepted,
            ));
        }
        let bounds = set.zmp_disturbance.bounds() * half_sole_m;
        Ok(Self {
            name: set.name.clone(),
            half_sole_m,
            zmp_margin: set.zmp_margin * half_sole_m,
            zmp_disturbance: set.zmp_disturbance,
            out_of_sets: set.out_of_sets,
            pendulum,
            gains: set
                .gains
                .iter()
                .map(|g| Gain::design(&pendulum, g).under(&pendulum, bounds))
                .collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{PENDULUM, parse};
    use super::*;

    #[test]
    fn the_feedback_is_the_closed_loop() {
        let poles = GainPoles {
            name: "g".into(),
            x: [0.2, 1.0, 5.0],
            y: [1.0, 2.0, 3.0],
        };
        let gain = Gain::design(&PENDULUM, &poles);
        let state = State {
            x: [0.01, -0.1, 0.02].into(),
            y: [-0.02, 0.3, 0.01].into(),
        };
        let (rate, next) = (gain.zmp_rate(&state), gain.successor(&state));
        assert!((PENDULUM.step(&state.x, rate.x) - next.x).norm() < 1e-14);
        assert!((PENDULUM.step(&state.y, rate.y) - next.y).norm() < 1e-14);
        assert!((gain.closed_loop() * state.stacked() - next.stacked()).norm() < 1e-15);
    }

    #[test]
    fn errors_name_file_field_value_and_what_is_accepted() {
        const GAIN: &str = "[[gains]]\nname = \"a\"\nx = [0.2, 1, 5]\ny = [0.2, 1, 5]\n";
        const STEPPING: &str = "[stepping]\nalpha = 4\nswing_time = 1.2\nlift = 0.06\nlate = 0.6\npause = 0\n\
                                same_foot_pause = 0\nrange = { forward = 0.9, outward = 1.0, least = 0.5 }\n\
                                weights = { dcm = 1, com = 0.1, zmp = 0.01 }\n";
        const CATCHING: &str =
            "[catching]\nlift = 0.03\nlate = 0.6\npause = 0\ntransfer = 0\nsettle = 0.05\n";
        const TWO_RULES: &str =
            "catching = a table: excludes [stepping]; accepted: one of the two tables";
        let good = format!("name = \"g\"\n{GAIN}");
        let with = |before: &str, after: &str| format!("{before}\n{good}{after}");
        let x = |x: &str| good.replacen("[0.2, 1, 5]", x, 1);
        assert!(parse(&with("", CATCHING)).is_ok());
        for (text, words) in [
            (
                x("[0.2, -1.0, 5.0]"),
                "g.toml: gains[0].x[1] = -1: gain \"a\" would be unstable",
            ),
            (x("[0.0, 1.0, 5.0]"), "gains[0].x[0] = 0"),
            (x("[0.2, 1.0, inf]"), "gains[0].x[2] = inf"),
            (with("", GAIN), "gains[1].name = \"a\": is used twice"),
            (good.replace(GAIN, ""), "gains = none"),
            (good.replace("\"g\"", "\"\""), "name = \"\": is empty"),
            (
                with("zmp_disturbance = -0.1", ""),
                "zmp_disturbance = -0.1000: out of range; accepted: 0 to 10",
            ),
            (
                with("zmp_disturbance = [0, nan]", ""),
                "zmp_disturbance = [0.0000, NaN]",
            ),
            (
                with("zmp_disturbance = [1]", ""),
                "or two, [x, y], in half sole lengths",
            ),
            (
                with("", &format!("{STEPPING}lambda = 5.0\nswing = 0.2")),
                "unknown field `swing`",
            ),
            (with("", STEPPING), "missing field `lambda`"),
            (
                with("", &format!("{STEPPING}lambda = 5.0\n{CATCHING}")),
                TWO_RULES,
            ),
        ] {
            let error = parse(&text).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            let message = error.to_string();
            assert!(
                message.contains(words) && message.starts_with("g.toml"),
                "{message}\nwanted: {words}"
            );
        }
    }
}
