//! Numbers of a controller by their keys: finds the number of a key, and makes the controller with other values.

use super::kinds::kind_of;
use super::spec::ControllerSpec;
use super::tunable::{Tunable, rounded};
use standfast_core::error::{Error, Result};
use standfast_files::assets::{self, nearest, number};
use toml::Value;

/// Reads `KEY=FROM..TO`, or the key of a number for which the controller names a range itself.
pub fn number_to_vary(text: &str, of: &dyn ControllerSpec) -> Result<Tunable> {
    let accepted = "KEY=FROM..TO, such as zmp_margin=0.02..0.3";
    let refuse = |problem: &str| Error::option("--vary", text, problem, accepted);
    let (key, range) = text
        .split_once('=')
        .map_or((text, None), |(key, range)| (key, Some(range)));
    let key = key.trim();
    let mut tree = Value::Table(of.tree());
    let now = match assets::place(&mut tree, key).ok().as_deref() {
        Some(value) => is_number_or_list(value)
            .ok_or_else(|| refuse("is neither a number nor a list of numbers"))?,
        None => {
            let keys = keys_of(&tree);
            let nearest = nearest(key, keys.iter().map(String::as_str));
            let accepted = nearest.map_or_else(
                || keys.join(", "),
                |nearest| format!("{nearest}, for example"),
            );
            return Err(Error::option(
                "--vary",
                key,
                format!("{} has no such number", of.name()),
                accepted,
            ));
        }
    };
    let Some(range) = range else {
        let known = of.tunables().into_iter().find(|tunable| tunable.key == key);
        return known.ok_or_else(|| refuse("has no range, and the controller names none for it"));
    };
    let ends = range
        .split_once("..")
        .map(|(from, to)| [from.trim().parse(), to.trim().parse()]);
    match ends {
        Some([Ok(from), Ok(to)]) => match Tunable::problem([from, to]) {
            None => Ok(Tunable::new(key, now, [from, to])),
            Some(problem) => Err(refuse(problem)),
        },
        _ => Err(refuse("has no range of two numbers")),
    }
}

/// The value of a number. For a list of numbers that are not all 0, it is the factor 1.
fn is_number_or_list(value: &Value) -> Option<f64> {
    match value {
        Value::Array(list) => {
            let numbers = list.iter().map(number).collect::<Option<Vec<f64>>>()?;
            numbers.iter().any(|number| *number != 0.0).then_some(1.0)
        }
        one => number(one),
    }
}

/// The keys of all numbers and lists of numbers in a tree.
fn keys_of(tree: &Value) -> Vec<String> {
    let inner = |name: &str, value: &Value| -> Vec<String> {
        let own = is_number_or_list(value).map(|_| name.to_string());
        own.into_iter()
            .chain(
                keys_of(value)
                    .into_iter()
                    .map(|key| format!("{name}.{key}")),
            )
            .collect()
    };
    match tree {
        Value::Table(table) => table
            .iter()
            .flat_map(|(name, value)| inner(name, value))
            .collect(),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .flat_map(|(i, value)| inner(&i.to_string(), value))
            .collect(),
        _ => Vec::new(),
    }
}

/// The controller with these values instead of its own. Fails if the values do not fit together.
pub fn with_values(
    base: &dyn ControllerSpec,
    name: &str,
    values: &[(&str, f64)],
) -> Result<Box<dyn ControllerSpec>> {
    let mut tree = Value::Table(base.tree());
    for &(key, value) in values {
        let place = assets::place(&mut tree, key)
            .map_err(|missing| Error::value(name, key, value, "unknown key", missing.accepted))?;
        set(place, value);
    }
    let Value::Table(mut tree) = tree else {
        unreachable!("a table")
    };
    tree.insert("name".into(), name.into());
    let settings = (kind_of(&tree, name)?.of_tree)(tree).map_err(|e| Error::Syntax {
        file: name.into(),
        message: e.message().trim_end().into(),
    })?;
    settings.check(name)?;
    Ok(settings)
}

/// Sets a number, or multiplies the numbers of a list.
fn set(place: &mut Value, value: f64) {
    let Value::Array(list) = place else {
        *place = Value::Float(value);
        return;
    };
    for element in list {
        let now = number(element).unwrap_or_default();
        *element = Value::Float(match value {
            1.0 => now,
            _ => rounded(value * now, 0.0),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{gain_set, read};
    use standfast_core::lipm::GainSet;
    use std::any::Any;

    #[test]
    fn values_are_put_where_their_keys_say_and_change_nothing_else() {
        let base = gain_set("catch").unwrap();
        let values = [
            ("zmp_margin", 0.1),
            ("gains.0.y.2", 6.0),
            ("catching.every.tilt.1", 0.05),
            ("gains.0.x", 2.0),
        ];
        let tuned: Box<dyn Any> = with_values(&base, "mine", &values).unwrap();
        let mut expected = GainSet {
            name: "mine".into(),
            zmp_margin: 0.1,
            ..base.clone()
        };
        expected.gains[0].y[2] = 6.0;
        expected.gains[0].x = [2.4, 2.0, 10.0];
        expected.catching.as_mut().unwrap().every.tilt[1] = 0.05;
        assert_eq!(*tuned.downcast::<GainSet>().unwrap(), expected);
        // The present values change nothing, and the written file states the same.
        let now: Vec<(String, f64)> = base
            .tunables()
            .into_iter()
            .map(|tunable| (tunable.key, tunable.now))
            .collect();
        let now: Vec<(&str, f64)> = now
            .iter()
            .map(|(key, value)| (key.as_str(), *value))
            .collect();
        let same = with_values(&base, "catch", &now).unwrap();
        let text = same.text();
        assert!(!text.contains("every"), "{text}");
        let again: Box<dyn Any> = read(&standfast_files::assets::Source {
            file: "c.toml".into(),
            text,
        })
        .unwrap();
        assert_eq!(*again.downcast::<GainSet>().unwrap(), base);
    }
}
