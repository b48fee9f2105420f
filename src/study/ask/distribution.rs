//! The distribution of a quantity of a campaign.

use crate::ask::bounds::{accept, digits, in_range};
use serde::Serialize;
use serde::de::{self, Deserialize, Deserializer, MapAccess, Visitor};
use standfast_core::arrays::exactly;
use standfast_core::error::{Error, Result};
use std::fmt;

/// What a distribution may be in TOML, for errors.
pub(crate) const FORMS: &str =
    "a number, { uniform = [a, b] }, { normal = [mean, sd] } or { each = [a, b, ...] }";

/// A distribution, in TOML `2.5`, `{ uniform = [a, b] }`, `{ normal = [mean, sd] }` or `{ each = [a, b, c] }`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Distribution {
    Constant(f64),
    Uniform {
        uniform: [f64; 2],
    },
    /// Values outside of the bounds of the quantity (for example a negative impulse) are drawn again.
    Normal {
        normal: [f64; 2],
    },
    /// Values that trials take in turn. Only a push has such quantities; all their combinations are equally frequent.
    Each {
        each: Values,
    },
}

/// A list of 1 to 24 numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, serde::Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub struct Values {
    count: usize,
    values: [f64; MOST_VALUES],
}

const MOST_VALUES: usize = 24;

impl Values {
    pub fn list(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

impl TryFrom<Vec<f64>> for Values {
    type Error = String;
    fn try_from(list: Vec<f64>) -> std::result::Result<Self, String> {
        let (count, mut values) = (list.len(), [0.0; MOST_VALUES]);
        if !(1..=MOST_VALUES).contains(&count) {
            return Err(format!(
                "a list of {count} values, expected 1 to {MOST_VALUES}"
            ));
        }
        values[..count].copy_from_slice(&list);
        Ok(Self { count, values })
    }
}

impl From<Values> for Vec<f64> {
    fn from(values: Values) -> Self {
        values.list().to_vec()
    }
}

impl Distribution {
    /// The mean. For a normal distribution, values that are drawn again are not considered.
    pub fn mean(&self) -> f64 {
        match *self {
            Distribution::Constant(value) => value,
            Distribution::Uniform { uniform: [a, b] } => (a + b) / 2.0,
            Distribution::Normal { normal: [mean, _] } => mean,
            Distribution::Each { each } => each.list().iter().sum::<f64>() / each.count as f64,
        }
    }

    /// Values of which a check can be made in place of all: those of a list, `count` (2 or more) of a range with its ends, or
    /// the mean.
    pub(crate) fn samples(&self, count: usize) -> Vec<f64> {
        match *self {
            Distribution::Uniform { uniform: [a, b] } => {
                let share = |i: usize| i as f64 / (count - 1) as f64;
                (0..count).map(|i| a + (b - a) * share(i)).collect()
            }
            Distribution::Each { each } => each.into(),
            other => vec![other.mean()],
        }
    }

    /// The distribution of a rising function of the quantity; for a normal one it is a guess.
    pub(crate) fn map(self, of: impl Fn(f64) -> f64) -> Self {
        match self {
            Distribution::Constant(value) => Distribution::Constant(of(value)),
            Distribution::Uniform { uniform } => Distribution::Uniform {
                uniform: uniform.map(of),
            },
            Distribution::Normal { normal } => Distribution::Normal {
                normal: normal.map(of),
            },
            Distribution::Each { mut each } => {
                each.values[..each.count]
                    .iter_mut()
                    .for_each(|x| *x = of(*x));
                Distribution::Each { each }
            }
        }
    }

    /// Whether every draw gives the same value.
    pub fn is_constant(&self) -> bool {
        match *self {
            Distribution::Constant(_) => true,
            Distribution::Uniform { uniform: [a, b] } => a == b,
            Distribution::Normal { normal: [_, sd] } => sd == 0.0,
            Distribution::Each { each } => each.list().iter().all(|value| *value == each.values[0]),
        }
    }

    /// Checks that all values lie in `[least, most]`; for a normal distribution, that its mean does.
    pub(crate) fn check(&self, file: &str, field: &str, [least, most]: [f64; 2]) -> Result<()> {
        match *self {
            Distribution::Constant(value) => in_range(file, field, value, [least, most]),
            Distribution::Uniform { uniform: [a, b] } => {
                let field = format!("{field}.uniform");
                in_range(file, &field, a, [least, most])?;
                let accepted = format!(
                    "{} to {}, the smaller number first",
                    digits(a),
                    digits(most)
                );
                accept((a..=most).contains(&b), file, &field, b, &accepted)
            }
            Distribution::Normal { normal: [mean, sd] } => {
                let field = format!("{field}.normal");
                in_range(file, &field, mean, [least, most])?;
                // With a larger standard deviation, nearly all values would have to be drawn again.
                let range = most - least;
                let accepted = format!(
                    "a standard deviation of 0 to {}, the width of the range",
                    digits(range)
                );
                accept((0.0..=range).contains(&sd), file, &field, sd, &accepted)
            }
            Distribution::Each { each } => {
                if !field.starts_with("push.") {
                    let (problem, accepted) =
                        ("only [push] takes a list", "a distribution without `each`");
                    return Err(Error::value(file, field, self, problem, accepted));
                }
                let field = format!("{field}.each");
                let mut values = each.list().iter();
                values.try_for_each(|value| in_range(file, &field, *value, [least, most]))
            }
        }
    }

    /// Smallest and largest value that can be drawn, if the accepted values are `bounds`.
    pub(crate) fn range(&self, bounds: [f64; 2]) -> [f64; 2] {
        match *self {
            Distribution::Constant(value) => [value, value],
            Distribution::Uniform { uniform } => uniform,
            Distribution::Normal { .. } => bounds,
            Distribution::Each { each } => {
                let values = each.list().iter();
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], x| {
                    [x.min(least), x.max(most)]
                })
            }
        }
    }
}

impl fmt::Display for Distribution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Distribution::Constant(value) => write!(f, "{}", digits(value)),
            Distribution::Uniform { uniform: [a, b] } => {
                write!(f, "uniform {} to {}", digits(a), digits(b))
            }
            Distribution::Normal { normal: [mean, sd] } => {
                write!(f, "normal {} +- {}", digits(mean), digits(sd))
            }
            Distribution::Each { each } => {
                let values = each.list().iter();
                let values: Vec<String> = values.map(|value| digits(*value).to_string()).collect();
                write!(f, "{}", values.join(", "))
            }
        }
    }
}

#[derive(serde::Deserialize)]
struct NumberPair(#[serde(deserialize_with = "exactly")] [f64; 2]);

// Written by hand: the error of a derived untagged enum names neither the key nor what is accepted.
impl<'de> Deserialize<'de> for Distribution {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct DistributionVisitor;
        impl<'de> Visitor<'de> for DistributionVisitor {
            type Value = Distribution;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str(FORMS)
            }
            fn visit_f64<E>(self, value: f64) -> Result<Distribution, E> {
                Ok(Distribution::Constant(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Distribution, E> {
                Ok(Distribution::Constant(value as f64))
            }
            fn visit_u64<E>(self, value: u64) -> Result<Distribution, E> {
                Ok(Distribution::Constant(value as f64))
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Distribution, A::Error> {
                let Some(key) = map.next_key::<String>()? else {
                    return Err(de::Error::invalid_length(0, &self));
                };
                let distribution = match key.as_str() {
                    "uniform" => Distribution::Uniform {
                        uniform: map.next_value::<NumberPair>()?.0,
                    },
                    "normal" => Distribution::Normal {
                        normal: map.next_value::<NumberPair>()?.0,
                    },
                    "each" => Distribution::Each {
                        each: map.next_value()?,
                    },
                    other => {
                        return Err(de::Error::unknown_field(
                            other,
                            &["uniform", "normal", "each"],
                        ));
                    }
                };
                match map.next_key::<String>()? {
                    None => Ok(distribution),
                    Some(_) => Err(de::Error::invalid_length(2, &self)),
                }
            }
        }
        deserializer.deserialize_any(DistributionVisitor)
    }
}
