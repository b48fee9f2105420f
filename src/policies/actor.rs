//! A policy in an episode: at each action it makes an observation, runs the network, and sets the targets of the joints.

use crate::Policy;
use crate::net::{Kept, Net};
use crate::observation::{Base, Memory, Observation};
use standfast_core::robot::Robot;
use standfast_core::socket::{Command, Controller, Report, Sensed, TickError};
use std::sync::Arc;

/// The data that all episodes share.
pub struct SharedPolicy {
    pub settings: Policy,
    pub robot: Robot,
    /// The indices in the robot of the joints that the policy drives, and of those that it observes.
    pub joints: Vec<usize>,
    pub observed: Vec<usize>,
    /// The angles of the observed joints from which the policy sees theirs (rad).
    pub observed_from_rad: Vec<f64>,
    pub ticks_per_action: u64,
    pub net: Net,
    /// The command at the action 0.
    pub home: Command,
}

/// A policy in an episode.
#[derive(Clone)]
pub struct Actor {
    shared: Arc<SharedPolicy>,
    base: Base,
    memory: Memory,
    /// The memory of the network itself.
    kept: Kept,
    ticks: u64,
    acting: Command,
    /// The last observation, a list for each observed input of the network.
    seen: Vec<Vec<f32>>,
}

impl Actor {
    pub fn new(shared: &Arc<SharedPolicy>) -> Self {
        let settings = &shared.settings;
        Self {
            base: Base::new(&shared.robot),
            memory: Memory::new(
                &settings.observation,
                settings.gait.as_ref(),
                settings.command,
                shared.joints.len(),
            ),
            kept: shared.net.fresh(),
            ticks: 0,
            acting: shared.home.clone(),
            seen: settings
                .inputs()
                .iter()
                .map(|(_, numbers)| vec![0.0; *numbers])
                .collect(),
            shared: Arc::clone(shared),
        }
    }

    fn act(&mut self, sensed: &Sensed) -> Result<(), TickError> {
        let SharedPolicy {
            settings,
            robot,
            joints,
            observed,
            observed_from_rad,
            net,
            ..
        } = &*self.shared;
        self.base.update(robot, sensed);
        let joint_positions = observed
            .iter()
            .zip(observed_from_rad)
            .map(|(&joint, from_rad)| sensed.q[joint] - from_rad)
            .collect();
        let now = Observation {
            base: &self.base,
            command: settings.command,
            joint_positions,
            joint_velocities: observed.iter().map(|&joint| sensed.dq[joint]).collect(),
        };
        self.seen = self
            .memory
            .observe(&settings.observation, settings.frames, &now);
        let mut answer = net
            .run(&self.seen, &mut self.kept)
            .map_err(TickError::Failed)?;
        let gains = answer.gains.iter().flatten().flatten();
        if let Some(i) = answer
            .action
            .iter()
            .chain(gains)
            .position(|value| !value.is_finite())
        {
            let what = match i < joints.len() {
                true => format!("action {i}"),
                false => "a stiffness or damping".into(),
            };
            let problem = format!(
                "{}: {what} of {} is not finite",
                settings.name, settings.model
            );
            return Err(TickError::Failed(problem));
        }
        if let Some(clip) = &settings.action_clip {
            for (i, value) in answer.action.iter_mut().enumerate() {
                let [lower, upper] = clip.of(i);
                *value = value.clamp(lower as f32, upper as f32);
            }
        }
        for (i, &joint) in joints.iter().enumerate() {
            self.acting.q_ref[joint] =
                settings.default_rad[i] + settings.action_scale[i] * f64::from(answer.action[i]);
            if let (Some([stiffness, damping]), Some(gains)) =
                (&answer.gains, &mut self.acting.gains)
            {
                gains[joint] = [stiffness[i], damping[i]].map(f64::from);
            }
        }
        self.memory.remember(
            answer.action,
            settings.gait.as_ref(),
            settings.command,
            settings.period_s,
        );
        Ok(())
    }
}

impl Controller for Actor {
    fn tick(&mut self, sensed: &Sensed, command: &mut Command) -> Result<(), TickError> {
        sensed.check(self.shared.robot.joints.len())?;
        if self.ticks.is_multiple_of(self.shared.ticks_per_action) {
            self.act(sensed)?;
        }
        self.ticks += 1;
        command.clone_from(&self.acting);
        Ok(())
    }

    fn report(&self) -> Report<'_> {
        Report::of_phase("policy")
    }

    fn fork(&self) -> Option<Box<dyn Controller>> {
        Some(Box::new(self.clone()))
    }

    fn answer(&mut self, observed: &[f64]) -> Option<Result<Vec<f64>, String>> {
        let SharedPolicy { settings, net, .. } = &*self.shared;
        let mut numbers = observed.iter().map(|&number| number as f32);
        let inputs: Vec<Vec<f32>> = settings
            .inputs()
            .iter()
            .map(|(_, count)| numbers.by_ref().take(*count).collect())
            .collect();
        let answer = net.run(&inputs, &mut self.kept);
        Some(answer.map(|answer| answer.action.into_iter().map(f64::from).collect()))
    }

    /// The terms, each with its numbers in all frames.
    fn observed(&self) -> Vec<(String, Vec<f64>)> {
        let settings = &self.shared.settings;
        let (sizes, frames) = (settings.sizes(), settings.frames.count);
        let mut inputs: Vec<_> = settings
            .inputs()
            .into_iter()
            .zip(&self.seen)
            .map(|((input, _), numbers)| (input, numbers.chunks(numbers.len() / frames), 0))
            .collect();
        let mut observed = Vec::new();
        for term in &settings.observation {
            let input = inputs.iter_mut().find(|(input, ..)| *input == term.input);
            let Some((_, of_frames, from)) = input else {
                continue;
            };
            let range = *from..*from + term.length(sizes);
            *from = range.end;
            let numbers = of_frames
                .clone()
                .flat_map(|frame| frame[range.clone()].iter().map(|&number| f64::from(number)));
            observed.push((term.name(), numbers.collect()));
        }
        observed
    }
}
