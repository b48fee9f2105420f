//! The terms of what a policy observes, as its file states them: a quantity each, with its scale, clip and history, in
//! the order of the training.

use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use std::collections::VecDeque;
use std::f64::consts::PI;

/// Longest history of a term, and largest number of frames.
const MOST_HISTORY: usize = 1000;
/// Largest velocity of a command that asks for standing (m/s, rad/s).
const STANDS: f64 = 0.01;

/// A part of the observation.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    pub term: Quantity,
    /// The input of the network that takes the term. It is left out if the network observes with one input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input: Option<String>,
    /// The numbers of a `constant`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<f64>,
    /// Factor of the term.
    #[serde(default, skip_serializing_if = "is_default")]
    pub scale: Scale,
    /// Largest magnitude of a number, after scaling.
    pub clip: Option<f64>,
    #[serde(default, skip_serializing_if = "is_default")]
    pub history: Stack,
}

pub fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Number of joints that a policy drives, and of joints that it observes.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub driven: usize,
    pub observed: usize,
}

impl Term {
    /// A term without scale, clip or history.
    pub fn of(term: Quantity) -> Self {
        Self {
            term,
            input: None,
            values: Vec::new(),
            scale: Scale::default(),
            clip: None,
            history: Stack::default(),
        }
    }

    /// Number of numbers of the term at one time.
    fn numbers(&self, sizes: Sizes) -> usize {
        match self.term {
            Quantity::BaseLinearVelocity
            | Quantity::BaseAngularVelocity
            | Quantity::ProjectedGravity
            | Quantity::EulerAngles
            | Quantity::Command => 3,
            Quantity::Orientation => 4,
            Quantity::CommandWalk | Quantity::PhaseSin | Quantity::PhaseCos | Quantity::Phase => 2,
            Quantity::CommandTurn | Quantity::PhaseLeftSin | Quantity::PhaseLeftCos => 1,
            Quantity::JointPositions | Quantity::JointVelocities => sizes.observed,
            Quantity::LastAction => sizes.driven,
            Quantity::Constant => self.values.len(),
        }
    }

    /// Number of numbers of the term in a frame of the observation.
    pub fn length(&self, sizes: Sizes) -> usize {
        self.history.count * self.numbers(sizes)
    }

    /// Fails, in words, if the scale does not fit the number of values of the term.
    pub fn check_scale(&self, sizes: Sizes) -> Result<(), String> {
        self.scale.check(self.numbers(sizes))
    }

    /// The quantity of the term, in the word of a file.
    pub fn name(&self) -> String {
        let word = toml::Value::try_from(self.term).ok();
        word.as_ref()
            .and_then(toml::Value::as_str)
            .unwrap_or_default()
            .into()
    }

    /// Numbers as the network takes them: scaled, then clipped.
    pub fn scaled(&self, numbers: Vec<f64>) -> Vec<f32> {
        let clip = self.clip.unwrap_or(f64::INFINITY);
        let scaled = numbers
            .into_iter()
            .enumerate()
            .map(|(i, number)| (self.scale.at(i) * number).clamp(-clip, clip) as f32);
        scaled.collect()
    }
}

/// One factor for all numbers of a term, or one for each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Scale {
    All(f64),
    Each(Vec<f64>),
}

impl Default for Scale {
    fn default() -> Self {
        Self::All(1.0)
    }
}

impl Scale {
    fn at(&self, i: usize) -> f64 {
        match self {
            Self::All(scale) => *scale,
            Self::Each(each) => each[i],
        }
    }

    /// Fails, in words, if the scale does not fit a term of `numbers` numbers.
    fn check(&self, numbers: usize) -> Result<(), String> {
        match self {
            Self::Each(each) if each.len() != numbers => {
                Err(format!("{} factors for {numbers} numbers", each.len()))
            }
            _ if (0..numbers).any(|i| !self.at(i).is_finite()) => Err("is not finite".into()),
            _ => Ok(()),
        }
    }
}

/// Values of several times in one list. In a file it is their number, or a table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "StackText", into = "StackText")]
pub struct Stack {
    pub count: usize,
    /// The newest value is the first one; otherwise it is the last one.
    pub newest_first: bool,
    /// The present value is not among them.
    pub past_only: bool,
    /// Values from before the start are 0; otherwise they are the first value.
    pub zero_before: bool,
}

#[derive(Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "accepted: a number of values, or a table with `count`, `newest_first`, `past_only`, `zero_before`"
)]
enum StackText {
    Count(usize),
    Table(StackTable),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StackTable {
    count: usize,
    #[serde(default, skip_serializing_if = "is_default")]
    newest_first: bool,
    #[serde(default, skip_serializing_if = "is_default")]
    past_only: bool,
    #[serde(default, skip_serializing_if = "is_default")]
    zero_before: bool,
}

impl From<StackText> for Stack {
    fn from(text: StackText) -> Self {
        match text {
            StackText::Count(count) => Self::of(count),
            StackText::Table(table) => Self {
                count: table.count,
                newest_first: table.newest_first,
                past_only: table.past_only,
                zero_before: table.zero_before,
            },
        }
    }
}

impl From<Stack> for StackText {
    fn from(stack: Stack) -> Self {
        match stack == Stack::of(stack.count) {
            true => Self::Count(stack.count),
            false => Self::Table(StackTable {
                count: stack.count,
                newest_first: stack.newest_first,
                past_only: stack.past_only,
                zero_before: stack.zero_before,
            }),
        }
    }
}

impl Default for Stack {
    fn default() -> Self {
        Self::of(1)
    }
}

impl Stack {
    /// The last `count` values, the oldest first.
    pub fn of(count: usize) -> Self {
        Self {
            count,
            newest_first: false,
            past_only: false,
            zero_before: false,
        }
    }

    /// The values that are stacked at a time at which the value is `now`. `past` keeps the former values, the oldest
    /// first; it is empty at the start.
    pub fn stacked(self, past: &mut VecDeque<Vec<f32>>, now: Vec<f32>) -> Vec<f32> {
        if past.is_empty() {
            let before = match self.zero_before {
                true => vec![0.0; now.len()],
                false => now.clone(),
            };
            past.resize(self.count, before);
        }
        let after = self.past_only.then(|| now.clone());
        if !self.past_only {
            past.push_back(now);
            past.pop_front();
        }
        let stacked = match self.newest_first {
            true => past.iter().rev().flatten().copied().collect(),
            false => past.iter().flatten().copied().collect(),
        };
        if let Some(now) = after {
            past.push_back(now);
            past.pop_front();
        }
        stacked
    }

    /// Fails if the count is out of range. The error names `file` and `field`.
    fn check(self, file: &str, field: String) -> Result<()> {
        if (1..=MOST_HISTORY).contains(&self.count) {
            return Ok(());
        }
        let accepted = format!("1 to {MOST_HISTORY}");
        Err(Error::value(
            file,
            field,
            self.count,
            "out of range",
            accepted,
        ))
    }
}

/// The quantity of a term. The base is the first link of the robot, and vectors are in its axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Velocity of the base (m/s), estimated from the joints and the sole with more load, as if it did not slide.
    BaseLinearVelocity,
    /// Angular velocity of the base (rad/s).
    BaseAngularVelocity,
    /// The direction of gravity, of length 1.
    ProjectedGravity,
    /// Roll, pitch and yaw of the base in the world (rad), and its quaternion w, x, y, z.
    EulerAngles,
    Orientation,
    /// The velocity that the policy is asked for: all three numbers, the first two, and the last one.
    Command,
    CommandWalk,
    CommandTurn,
    /// Angles of the observed joints less `default_rad` (rad); speeds of these joints (rad/s).
    JointPositions,
    JointVelocities,
    /// The last action, within `action_clip`; 0 at first.
    LastAction,
    /// Sine and cosine of the phases of the left and the right foot.
    PhaseSin,
    PhaseCos,
    /// Sine and cosine of the phase of the left foot: both, and each alone.
    Phase,
    PhaseLeftSin,
    PhaseLeftCos,
    /// The `values` of the term, such as a height that is asked for.
    Constant,
}

impl Quantity {
    fn needs_gait(self) -> bool {
        matches!(
            self,
            Self::PhaseSin | Self::PhaseCos | Self::Phase | Self::PhaseLeftSin | Self::PhaseLeftCos
        )
    }
}

/// The clock of a gait. The phase of each foot goes around `hz` times a second.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gait {
    pub hz: f64,
    /// Phases of the left and the right foot at first (rad).
    #[serde(default = "opposite")]
    pub start_rad: [f64; 2],
    /// The phases while the command asks for standing (rad); None if they go on.
    pub standing_rad: Option<[f64; 2]>,
    /// Sines and cosines are 0 while the command asks for standing.
    #[serde(default, skip_serializing_if = "is_default")]
    pub standing_zero: bool,
}

fn opposite() -> [f64; 2] {
    [0.0, PI]
}

impl Gait {
    /// The vector (cos, sin) of each foot that the policy sees at these phases (rad).
    pub fn seen(&self, phase_rad: [f64; 2], command: [f64; 3]) -> [[f64; 2]; 2] {
        let stands = command.iter().all(|velocity| velocity.abs() < STANDS);
        if stands && self.standing_zero {
            return [[0.0; 2]; 2];
        }
        self.standing_rad
            .filter(|_| stands)
            .unwrap_or(phase_rad)
            .map(|phase_rad| [phase_rad.cos(), phase_rad.sin()])
    }
}

/// Checks the values. Errors name `file`.
pub fn check(
    file: &str,
    terms: &[Term],
    frames: Stack,
    sizes: Sizes,
    gait: Option<&Gait>,
) -> Result<()> {
    if terms.is_empty() {
        return Err(Error::value(
            file,
            "observation",
            "[]",
            "is empty",
            "the terms that the network sees",
        ));
    }
    frames.check(file, "frames".into())?;
    if terms
        .iter()
        .any(|term| term.input.is_some() != terms[0].input.is_some())
    {
        return Err(Error::value(
            file,
            "observation",
            "(terms)",
            "some say to which input of the network they go, and others do not",
            "`input` in all terms or in none",
        ));
    }
    for (i, term) in terms.iter().enumerate() {
        let field = |key: &str| format!("observation.{i}.{key}");
        let bad = |key: &str, value: String, problem: &str, accepted: &str| {
            Err(Error::value(file, field(key), value, problem, accepted))
        };
        if (term.term == Quantity::Constant) == term.values.is_empty() {
            let values = format!("{:?}", term.values);
            let accepted = "numbers for a `constant`, and none for other terms";
            return bad("values", values, "does not fit the term", accepted);
        }
        if term.values.iter().any(|value| !value.is_finite()) {
            let values = format!("{:?}", term.values);
            return bad("values", values, "is not finite", "finite numbers");
        }
        if let Err(problem) = term.check_scale(sizes) {
            let accepted = "a finite number, or one for each number of the term";
            return bad("scale", format!("{:?}", term.scale), &problem, accepted);
        }
        if let Some(clip) = term.clip.filter(|clip| clip.is_nan() || *clip <= 0.0) {
            return bad("clip", clip.to_string(), "out of range", "more than 0");
        }
        term.history.check(file, field("history"))?;
        if term.term.needs_gait() && gait.is_none() {
            let accepted = "a table `[gait]` with `hz`";
            return bad(
                "term",
                "a phase".into(),
                "needs the clock of a gait",
                accepted,
            );
        }
    }
    let phases = gait.map_or([0.0; 4], |gait| {
        let [left, right] = gait.standing_rad.unwrap_or_default();
        [gait.start_rad[0], gait.start_rad[1], left, right]
    });
    if phases.iter().any(|phase_rad| !phase_rad.is_finite()) {
        return Err(Error::value(
            file,
            "gait.start_rad, gait.standing_rad",
            format!("{phases:?}"),
            "is not finite",
            "finite numbers",
        ));
    }
    match gait.filter(|gait| !(gait.hz > 0.0 && gait.hz <= 100.0)) {
        Some(gait) => Err(Error::value(
            file,
            "gait.hz",
            gait.hz,
            "out of range",
            "more than 0, at most 100",
        )),
        None => Ok(()),
    }
}

/// The inputs of the network that observe, in the order of the terms, each with its number of numbers.
pub fn inputs(terms: &[Term], frames: Stack, sizes: Sizes) -> Vec<(Option<String>, usize)> {
    let mut inputs: Vec<(Option<String>, usize)> = Vec::new();
    for term in terms {
        let length = frames.count * term.length(sizes);
        match inputs.iter_mut().find(|(input, _)| *input == term.input) {
            Some((_, numbers)) => *numbers += length,
            None => inputs.push((term.input.clone(), length)),
        }
    }
    inputs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a network sees of the values 1, 2, 3 and 4, one after the other.
    fn seen(stack: Stack) -> Vec<Vec<f32>> {
        let mut past = VecDeque::new();
        let values = (1..=4).map(|value| stack.stacked(&mut past, vec![value as f32]));
        values.collect()
    }

    #[test]
    fn values_are_stacked_in_the_order_of_the_training() {
        let two = Stack::of(2);
        assert_eq!(seen(two), [[1., 1.], [1., 2.], [2., 3.], [3., 4.]]);
        let zero = Stack {
            zero_before: true,
            ..two
        };
        assert_eq!(seen(zero), [[0., 1.], [1., 2.], [2., 3.], [3., 4.]]);
        // HumanoidVerse: the values before the present one, the newest first.
        let past = Stack {
            newest_first: true,
            past_only: true,
            ..zero
        };
        assert_eq!(seen(past), [[0., 0.], [1., 0.], [2., 1.], [3., 2.]]);
    }
}
