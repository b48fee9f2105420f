//! The quantities of a campaign that a file states in units of its robot, so that a campaign asks the same of robots of
//! every size. Each may be stated in SI units instead, under a key of its own: `push.impulse = 1.0` in sole impulses,
//! or `push.impulse_n_s = 2.16`. A campaign is converted once, when it meets its robot, and is in SI units from then
//! on.

use standfast_core::error::{Error, Result};
use standfast_core::robot::{Robot, Units};
use toml::{Table, Value};

/// What 1 of a quantity means.
#[derive(Debug, Clone, Copy)]
enum Unit {
    /// Sole impulses.
    Impulse,
    /// COM height h.
    Length,
    /// 1 / omega.
    Time,
    /// omega h.
    Speed,
    /// The robot's own delay.
    Delay,
    /// Mass of the robot.
    Mass,
}

/// Table, key in units of the robot, key in SI units, and unit.
const QUANTITIES: [(&str, &str, &str, Unit); 17] = [
    ("push", "impulse", "impulse_n_s", Unit::Impulse),
    ("push", "height", "height_m", Unit::Length),
    ("push", "duration", "duration_s", Unit::Time),
    ("push", "start", "start_s", Unit::Time),
    ("push.pendulum", "mass", "mass_kg", Unit::Mass),
    ("push.pendulum", "rope", "rope_m", Unit::Length),
    ("push.pendulum", "draw", "draw_m", Unit::Length),
    ("second_push", "impulse", "impulse_n_s", Unit::Impulse),
    ("second_push", "after", "after_s", Unit::Time),
    ("variations", "trunk_com_x", "trunk_com_x_m", Unit::Length),
    ("variations", "trunk_com_y", "trunk_com_y_m", Unit::Length),
    ("variations", "ground_step", "ground_step_m", Unit::Length),
    ("variations", "delay_scale", "delay_s", Unit::Delay),
    ("episode", "horizon", "horizon_s", Unit::Time),
    (
        "episode.judge",
        "standing_com_speed",
        "standing_com_speed_m_s",
        Unit::Speed,
    ),
    (
        "episode.judge",
        "standing_time",
        "standing_time_s",
        Unit::Time,
    ),
    (
        "episode.judge",
        "home_radius",
        "home_radius_m",
        Unit::Length,
    ),
];

/// The units of one robot.
#[derive(Debug, Clone, Copy)]
pub struct Measures {
    pub units: Units,
    delay_s: f64,
}

impl Measures {
    pub fn of(robot: &Robot) -> Self {
        Self {
            units: Units::of(robot),
            delay_s: robot.delay_s,
        }
    }

    /// What 1 of a unit is in SI units.
    fn one(&self, unit: Unit) -> f64 {
        match unit {
            Unit::Impulse => self.units.impulse_n_s(),
            Unit::Length => self.units.length_m,
            Unit::Time => self.units.time_s(),
            Unit::Speed => self.units.speed_m_s(),
            Unit::Delay => self.delay_s,
            Unit::Mass => self.units.mass_kg,
        }
    }

    /// Converts all quantities of the table with the dotted key `outer` to SI units; the key of a whole campaign is
    /// empty. It fails if a quantity is stated both in units of the robot and in SI units.
    pub fn to_si(&self, outer: &str, file: &str, asked: &mut Table) -> Result<()> {
        for (path, relative, absolute, unit) in QUANTITIES {
            let Some(inner) = path.strip_prefix(outer) else {
                continue;
            };
            let Some(table) = table_at(asked, inner) else {
                continue;
            };
            let Some(value) = table.remove(relative) else {
                continue;
            };
            if let Some(other) = table.get(absolute) {
                let field = format!("{path}.{relative}, {path}.{absolute}");
                let stated = format!("{value}, {other}");
                return Err(Error::value(
                    file,
                    field,
                    stated,
                    "the quantity is stated twice",
                    "one of the two keys",
                ));
            }
            table.insert(absolute.into(), times(value, self.one(unit)));
        }
        Ok(())
    }

    /// The dotted key in SI units and the value of an assignment that may be in units of the robot.
    pub fn assigned(&self, key: &str, value: Value) -> Result<(String, Value)> {
        for (path, relative, absolute, unit) in QUANTITIES {
            if key
                .strip_prefix(path)
                .and_then(|rest| rest.strip_prefix('.'))
                == Some(relative)
            {
                return Ok((format!("{path}.{absolute}"), times(value, self.one(unit))));
            }
        }
        let mut value = value;
        if let Value::Table(table) = &mut value {
            self.to_si(key, "--set", table)?;
        }
        Ok((key.into(), value))
    }

    /// Adds the unit of the quantity to an error about a quantity that may be stated in units of the robot.
    pub fn explain(&self, mut error: Error) -> Error {
        if let Error::Value { field, problem, .. } = &mut error {
            let stated = QUANTITIES.iter().find(|(path, _, absolute, _)| {
                field
                    .strip_prefix(path)
                    .and_then(|rest| rest.strip_prefix('.'))
                    .is_some_and(|key| {
                        key.strip_prefix(absolute)
                            .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
                    })
            });
            if let Some((path, relative, _, unit)) = stated {
                *problem += &format!(" (1 of {path}.{relative} is {:.4} here)", self.one(*unit));
            }
        }
        error
    }
}

/// The dotted keys under which a file may state the quantity with this dotted key in SI units: the key itself, and the
/// key in units of the robot.
pub fn keys_in_file(key: &str) -> Vec<String> {
    let mut keys = vec![key.to_string()];
    for (path, relative, absolute, _) in QUANTITIES {
        let rest = key
            .strip_prefix(path)
            .and_then(|rest| rest.strip_prefix('.'))
            .and_then(|rest| rest.strip_prefix(absolute));
        if let Some(rest) = rest
            && (rest.is_empty() || rest.starts_with('.'))
        {
            keys.push(format!("{path}.{relative}{rest}"));
        }
    }
    keys
}

/// Puts the key in units of the robot before each key in SI units, in a list of accepted dotted keys or in a message
/// that names keys in backquotes.
pub fn with_relative_keys(text: &str) -> String {
    let mut items = Vec::new();
    for item in text.split(", ") {
        for (path, relative, absolute, _) in QUANTITIES {
            if item == format!("{path}.{absolute}") {
                items.push(format!("{path}.{relative}"));
            }
        }
        items.push(item.into());
    }
    let mut text = items.join(", ");
    for (i, (_, relative, absolute, _)) in QUANTITIES.iter().enumerate() {
        if !QUANTITIES[..i]
            .iter()
            .any(|(_, _, earlier, _)| earlier == absolute)
        {
            text = text.replace(
                &format!("`{absolute}`"),
                &format!("`{relative}`, `{absolute}`"),
            );
        }
    }
    text
}

/// The table with this dotted key, if there is one.
fn table_at<'a>(root: &'a mut Table, path: &str) -> Option<&'a mut Table> {
    path.split('.')
        .filter(|name| !name.is_empty())
        .try_fold(root, |table, name| table.get_mut(name)?.as_table_mut())
}

/// A number or distribution times `factor`. Any other value stays as it is, and is refused when the campaign is read.
fn times(value: Value, factor: f64) -> Value {
    match value {
        Value::Integer(number) => Value::Float(number as f64 * factor),
        Value::Float(number) => Value::Float(number * factor),
        Value::Array(values) => Value::Array(
            values
                .into_iter()
                .map(|value| times(value, factor))
                .collect(),
        ),
        Value::Table(table) => Value::Table(
            table
                .into_iter()
                .map(|(key, value)| (key, times(value, factor)))
                .collect(),
        ),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::campaign;
    use standfast_core::robot::SizeRatio;

    /// The campaigns were in SI units at first. In units of the robot they ask the same of UT-mu2, up to rounding.
    #[test]
    fn the_harsh_campaign_asks_of_ut_mu2_what_its_si_units_say() {
        let harsh = serde_json::to_value(campaign("harsh", &[])).unwrap();
        for (key, si) in [
            ("push/impulse_n_s/uniform", [0.5, 5.5]),
            ("push/height_m/uniform", [-0.1, 0.2]),
            ("push/duration_s/uniform", [0.02, 0.25]),
            ("push/start_s", [1.0; 2]),
            ("second_push/impulse_n_s/uniform", [0.0, 2.0]),
            ("second_push/after_s/uniform", [0.1, 1.5]),
            ("variations/trunk_com_x_m/uniform", [-0.0125, 0.0125]),
            ("variations/trunk_com_y_m/uniform", [-0.0125, 0.0125]),
            ("variations/ground_step_m/uniform", [-0.01, 0.01]),
            ("variations/delay_s/uniform", [0.002, 0.012]),
            ("episode/horizon_s", [6.0; 2]),
            ("episode/judge/standing_com_speed_m_s", [0.02; 2]),
            ("episode/judge/standing_time_s", [0.5; 2]),
            ("episode/judge/home_radius_m", [0.005; 2]),
        ] {
            let found = harsh.pointer(&format!("/{key}")).unwrap();
            let near = |i: usize| {
                (found.get(i).unwrap_or(found).as_f64().unwrap() - si[i]).abs()
                    <= 2e-3 * si[i].abs()
            };
            assert!(near(0) && near(1), "{key}: {found}, not {si:?}");
        }
    }

    #[test]
    fn a_similar_robot_is_asked_for_the_same_in_its_own_units() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let similar = robot.scaled(SizeRatio {
            length: 4.0,
            mass: 64.0,
        });
        for (unit, factor) in [
            (Unit::Impulse, 64.0 * 2.0),
            (Unit::Length, 4.0),
            (Unit::Time, 2.0),
            (Unit::Speed, 2.0),
            (Unit::Delay, 2.0),
        ] {
            let [large, small] = [&similar, &robot].map(|robot| Measures::of(robot).one(unit));
            assert!(
                (large / small / factor - 1.0).abs() < 1e-9,
                "{unit:?}: {large}, {small}"
            );
        }
    }
}
