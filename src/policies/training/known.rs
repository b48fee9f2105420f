//! The known facts of a policy's training: figures with their origins, and the names that trainers give to observed
//! quantities.

use crate::net::Outputs;
use crate::terms::{Gait, Quantity, Scale, Sizes, Stack, Term};
use crate::{ActionClip, ObservedJoints};
use standfast_core::error::{Error, Result};

/// A figure of a policy, and its origin in words.
#[derive(Default)]
pub struct Figure<T> {
    pub value: T,
    pub origin: String,
}

impl<T> Figure<T> {
    pub fn read(value: T) -> Self {
        Self {
            value,
            origin: "read".into(),
        }
    }

    pub fn inferred(value: T, why: impl Into<String>) -> Self {
        Self {
            value,
            origin: format!("inferred: {}", why.into()),
        }
    }

    pub fn assumed(value: T, why: impl Into<String>) -> Self {
        Self {
            value,
            origin: format!("assumed: {}", why.into()),
        }
    }
}

/// The known facts of a policy's training. Lists of joints are in the order of the policy.
#[derive(Default)]
pub struct Training {
    /// The trainer of the policy, and the file that says so.
    pub by: String,
    pub period_s: Figure<f64>,
    pub joints: Figure<Vec<String>>,
    pub default_rad: Figure<Vec<f64>>,
    pub action_scale: Figure<Vec<f64>>,
    pub action_clip: Option<Figure<ActionClip>>,
    pub stiffness: Figure<Vec<f64>>,
    pub damping: Figure<Vec<f64>>,
    pub torque_n_m: Option<Figure<Vec<f64>>>,
    pub rotor_inertia_kg_m2: Option<Figure<Vec<f64>>>,
    pub gait: Option<Figure<Gait>>,
    pub observed: Option<Figure<ObservedJoints>>,
    pub network: Option<Figure<Outputs>>,
    pub observation: Figure<Vec<Term>>,
    /// How many frames of the observation the network sees.
    pub frames: Stack,
}

impl Training {
    /// The lists with one number for each joint: key in the file, meaning, and list. Where the network gives the gains of
    /// the servos, they have no lists.
    pub fn lists(&self) -> Vec<(&'static str, &'static str, &Figure<Vec<f64>>)> {
        let gives_gains = self
            .network
            .as_ref()
            .is_some_and(|network| network.value.stiffness.is_some());
        let lists = [
            (
                "default_rad",
                "Angles at the action 0 [rad]",
                &self.default_rad,
            ),
            (
                "action_scale",
                "How far an action of 1 goes from there [rad]",
                &self.action_scale,
            ),
            ("stiffness", "Of the servos [N m/rad]", &self.stiffness),
            ("damping", "Of the servos [N m s/rad]", &self.damping),
        ];
        let count = if gives_gains { 2 } else { lists.len() };
        lists[..count].to_vec()
    }

    /// The same of the motors.
    pub fn motors(&self) -> Vec<(&'static str, &'static str, &Figure<Vec<f64>>)> {
        let motors = [
            (
                "torque_n_m",
                "Torque limits of the motors [N m]",
                &self.torque_n_m,
            ),
            (
                "rotor_inertia_kg_m2",
                "Rotor inertias seen at the joints [kg m^2]",
                &self.rotor_inertia_kg_m2,
            ),
        ];
        motors
            .into_iter()
            .filter_map(|(key, what, list)| Some((key, what, list.as_ref()?)))
            .collect()
    }

    /// Checks lengths and numbers. Errors name the source.
    pub fn check(&self) -> Result<()> {
        let joints = self.joints.value.len();
        for (field, _, Figure { value: list, .. }) in self.lists().into_iter().chain(self.motors())
        {
            if list.len() != joints || list.iter().any(|number| !number.is_finite()) {
                let accepted = format!("a finite number for each of its {joints} joints");
                return Err(Error::value(
                    &self.by,
                    field,
                    format!("{list:?}"),
                    "does not fit",
                    accepted,
                ));
            }
        }
        let observed = self.observed.as_ref();
        let sizes = Sizes {
            driven: joints,
            observed: observed.map_or(joints, |observed| observed.value.joints.len()),
        };
        let times = [("time between two actions (s)", Some(self.period_s.value))];
        let clock = [("gait (1/s)", self.gait.as_ref().map(|gait| gait.value.hz))];
        for (field, number) in times.into_iter().chain(clock) {
            if let Some(number) = number.filter(|number| !(number.is_finite() && *number > 0.0)) {
                return Err(Error::value(
                    &self.by,
                    field,
                    number,
                    "is not positive",
                    "more than 0",
                ));
            }
        }
        for term in &self.observation.value {
            term.check_scale(sizes).map_err(|problem| {
                let accepted = "a finite number, or one for each number of the term";
                Error::value(&self.by, "scale of a term", term.name(), problem, accepted)
            })?;
        }
        Ok(())
    }

    /// The figures that are assumed, each with the reason.
    pub fn assumed(&self) -> Vec<String> {
        let mut origins = vec![
            ("period_s", &self.period_s.origin),
            ("joints", &self.joints.origin),
        ];
        for (key, _, figure) in self.lists().into_iter().chain(self.motors()) {
            origins.push((key, &figure.origin));
        }
        origins.push(("observation", &self.observation.origin));
        if let Some(figure) = &self.action_clip {
            origins.push(("action_clip", &figure.origin));
        }
        if let Some(figure) = &self.gait {
            origins.push(("gait", &figure.origin));
        }
        if let Some(figure) = &self.observed {
            origins.push(("observed", &figure.origin));
        }
        let assumed = origins.into_iter().filter_map(|(key, origin)| {
            let why = origin.strip_prefix("assumed: ")?;
            Some(format!("{key}: {why}"))
        });
        assumed.collect()
    }
}

/// The rotor inertias (kg m^2) from which stiffness and damping were made, as holosoma and mjlab do: `kp = I w^2` and
/// `kd = 2 z I w`, with w of 10 Hz and z of 2. It is None if they were made otherwise.
pub fn inertias_of_gains(stiffness: &[f64], damping: &[f64]) -> Option<Figure<Vec<f64>>> {
    const OMEGA_RAD_S: f64 = 10.0 * std::f64::consts::TAU;
    const DAMPING_RATIO: f64 = 2.0;
    /// Largest relative error of damping that is written with one decimal.
    const ROUNDED: f64 = 0.04;
    let fit = stiffness.iter().zip(damping).all(|(kp, kd)| {
        *kp > 0.0 && (kd * OMEGA_RAD_S / (2.0 * DAMPING_RATIO * kp) - 1.0).abs() < ROUNDED
    });
    if stiffness.is_empty() || !fit {
        return None;
    }
    // Six digits are more than the accuracy of the inertias.
    let inertias = stiffness.iter().map(|kp| {
        let inertia = kp / OMEGA_RAD_S.powi(2);
        format!("{inertia:.5e}").parse().unwrap_or(inertia)
    });
    let why = "stiffness and damping are those of a natural frequency of 10 Hz and a damping ratio of 2 with them";
    Some(Figure::inferred(inertias.collect(), why))
}

/// The quantity that Isaac Lab and mjlab call by this name, with their usual terms. Errors name `file` and `field`.
pub fn quantity(file: &str, field: &str, name: &str) -> Result<Quantity> {
    const KNOWN: [(&str, Quantity); 13] = [
        ("base_lin_vel", Quantity::BaseLinearVelocity),
        ("base_ang_vel", Quantity::BaseAngularVelocity),
        ("projected_gravity", Quantity::ProjectedGravity),
        ("velocity_commands", Quantity::Command),
        ("generated_commands", Quantity::Command),
        ("command", Quantity::Command),
        ("joint_pos_rel", Quantity::JointPositions),
        ("joint_pos", Quantity::JointPositions),
        ("joint_vel_rel", Quantity::JointVelocities),
        ("joint_vel", Quantity::JointVelocities),
        ("last_action", Quantity::LastAction),
        ("actions", Quantity::LastAction),
        ("gait_phase", Quantity::Phase),
    ];
    let quantity = KNOWN
        .into_iter()
        .find(|(known, _)| *known == name)
        .map(|(_, quantity)| quantity);
    quantity.ok_or_else(|| {
        let accepted = KNOWN.map(|(known, _)| known).join(", ");
        Error::value(file, field, name, "is no term that is known here", accepted)
    })
}

/// The scale of a term: a single factor if all numbers have the same.
pub fn scale_of(each: Vec<f64>) -> Scale {
    match each[..] {
        [first, ..] if each.iter().all(|scale| *scale == first) => Scale::All(first),
        _ => Scale::Each(each),
    }
}

/// A term without scale, clip or history.
pub fn plain(term: Quantity) -> Term {
    Term::of(term)
}

pub fn scaled(term: Quantity, scale: Scale) -> Term {
    Term {
        scale,
        ..Term::of(term)
    }
}

/// The clock of a gait with one phase. At the first observation it has advanced by `period_s` (s).
pub fn one_phase(gait_period_s: f64, period_s: f64) -> Gait {
    let first_rad = std::f64::consts::TAU * period_s / gait_period_s;
    Gait {
        hz: 1.0 / gait_period_s,
        start_rad: [first_rad, first_rad + std::f64::consts::PI],
        standing_rad: None,
        standing_zero: false,
    }
}
