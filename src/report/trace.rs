//! The trace of an episode: a table with one row for each control tick, and with units in the names of its columns.
//!
//! The row of time t holds the true state at t, the mean forces over the tick that ends at t, and the controller's
//! estimates and commands at t (which act after the robot's delay). All values are in the world frame. Estimates and
//! commands are in the controller's estimate of the world frame, which drifts when feet slip. Before the first physics
//! step, the forces are half of the weight on each sole. A value that does not exist is empty, such as the ZMP in
//! flight or a value that a controller does not report. What else a controller reports has columns of its own. The
//! chapter `columns` of the guide has the meaning of each column.

use serde_json::{Map, Value, json};
use standfast_core::robot::{Foot, Pose, Robot};
use standfast_files::columns::{Data, DataColumn};
use standfast_sim::episode::Tick;

/// Collects the rows of an episode.
pub struct Trace {
    names: Vec<String>,
    values: Vec<Vec<Option<f64>>>,
    phase: Vec<Option<String>>,
    /// The acting gain.
    gain: Vec<Option<String>>,
    /// The [numbers](standfast_core::socket::Report::numbers) of the controller and of a bob, by name.
    numbers: Vec<(String, Vec<Option<f64>>)>,
    /// Whether the tick lies after the verdict (1) or not (0).
    after_verdict: Vec<Option<i64>>,
    /// The links that met during the tick.
    links_met: Vec<Option<String>>,
    links: Vec<String>,
}

/// Names of the columns before `phase`, what else the controller reports, `after_verdict` and `links_met`.
const BODY: &str = "time_s com_x_m com_y_m com_z_m com_vel_x_m_s com_vel_y_m_s com_vel_z_m_s \
                    com_x_m_est com_y_m_est com_z_m_est com_vel_x_m_s_est com_vel_y_m_s_est com_vel_z_m_s_est \
                    zmp_x_m zmp_y_m zmp_ref_x_m zmp_ref_y_m dcm_x_m dcm_y_m \
                    contact_force_x_n contact_force_y_n contact_force_z_n \
                    push_force_x_n push_force_y_n push_force_z_n \
                    zmp_x_m_est zmp_y_m_est trunk_tilt_deg dcm_outside_m";

/// Names of the columns of a pendulum's bob.
const BOB: [&str; 3] = ["bob_x_m", "bob_y_m", "bob_z_m"];

impl Trace {
    pub fn new(robot: &Robot) -> Self {
        let mut names: Vec<String> = BODY.split_whitespace().map(String::from).collect();
        for side in ["left", "right"] {
            for part in ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"] {
                names.push(format!("{side}_sole_{part}"));
            }
            for part in [
                "force_x_n",
                "force_y_n",
                "force_z_n",
                "moment_x_n_m",
                "moment_y_n_m",
                "moment_z_n_m",
            ] {
                names.push(format!("{side}_sole_{part}"));
            }
        }
        let base = "x_m y_m z_m qw qx qy qz vel_x_m_s vel_y_m_s vel_z_m_s ang_vel_x_rad_s ang_vel_y_rad_s ang_vel_z_rad_s";
        names.extend(base.split(' ').map(|part| format!("base_{part}")));
        for prefix in ["q", "dq", "q_ref", "tau"] {
            names.extend(
                robot
                    .joints
                    .iter()
                    .map(|joint| format!("{prefix}_{}", joint.name)),
            );
        }
        let values = vec![Vec::new(); names.len()];
        let links = robot.links.iter().map(|link| link.name.clone()).collect();
        Self {
            names,
            values,
            phase: Vec::new(),
            gain: Vec::new(),
            numbers: Vec::new(),
            after_verdict: Vec::new(),
            links_met: Vec::new(),
            links,
        }
    }

    /// Adds the row of a tick.
    pub fn push(&mut self, tick: &Tick) {
        let (truth, report) = (tick.truth, &tick.report);
        let mut row: Vec<Option<f64>> = vec![Some((1e9 * truth.time_s).round() / 1e9)];
        fn add<'a>(row: &mut Vec<Option<f64>>, values: impl IntoIterator<Item = &'a f64>) {
            row.extend(values.into_iter().map(|value| Some(*value)));
        }
        fn maybe<const N: usize>(row: &mut Vec<Option<f64>>, values: Option<[f64; N]>) {
            row.extend(values.map_or([None; N], |values| values.map(Some)));
        }
        add(&mut row, truth.com.coords.iter().chain(&truth.com_vel));
        maybe::<3>(&mut row, report.com.map(Into::into));
        maybe::<3>(&mut row, report.com_vel.map(Into::into));
        maybe(&mut row, truth.zmp);
        maybe::<2>(&mut row, report.zmp_ref.map(Into::into));
        add(
            &mut row,
            tick.dcm
                .coords
                .iter()
                .chain(&truth.contact_force)
                .chain(&truth.push_force),
        );
        maybe::<2>(&mut row, report.zmp.map(Into::into));
        row.push(Some(truth.tilt_rad().to_degrees()));
        row.push(Some(tick.dcm_outside_m).filter(|distance_m| distance_m.is_finite()));
        for foot in Foot::BOTH {
            add(&mut row, &as_numbers(&truth.soles[foot]));
            let wrench = &truth.sole_wrenches[foot];
            add(&mut row, &wrench.force);
            add(&mut row, &wrench.moment);
        }
        add(&mut row, &as_numbers(&truth.posture.base));
        let (of_base, of_joints) = truth.velocity.as_slice().split_at(6);
        add(&mut row, of_base);
        add(&mut row, &truth.posture.q);
        add(&mut row, of_joints);
        add(&mut row, &tick.command.q_ref);
        add(&mut row, &truth.tau);
        for (column, value) in self.values.iter_mut().zip(row) {
            column.push(value);
        }
        let bob = truth
            .rope()
            .into_iter()
            .flat_map(|[_, bob]| BOB.into_iter().zip([bob.x, bob.y, bob.z]));
        for (name, number) in report.numbers().chain(bob) {
            let ticks = self.phase.len();
            let place = self
                .numbers
                .iter()
                .position(|(known, _)| known == name)
                .unwrap_or_else(|| {
                    self.numbers.push((name.to_string(), vec![None; ticks]));
                    self.numbers.len() - 1
                });
            self.numbers[place].1.push(Some(number));
        }
        self.phase.push(Some(report.phase.to_string()));
        self.gain.push(report.gain.map(String::from));
        let ticks = self.phase.len();
        for (_, numbers) in &mut self.numbers {
            numbers.resize(ticks, None);
        }
        self.after_verdict.push(Some(tick.is_after.into()));
        self.links_met.push(truth.meeting.map(|meeting| {
            let [a, b] = meeting.links;
            format!("{} and {}", self.links[a], self.links[b])
        }));
    }

    /// The numbers and words of the last tick, by name, without those of joints, feet and base.
    pub fn last_row(&self) -> Map<String, Value> {
        let numbers = Self::names_of_body()
            .zip(&self.values)
            .map(|(name, of_tick)| (name, json!(of_tick.last())));
        let gain = self.has_gain().then(|| ("gain", json!(self.gain.last())));
        let reported = self
            .numbers
            .iter()
            .map(|(name, of_tick)| (name.as_str(), json!(of_tick.last())));
        let words = [
            ("phase", json!(self.phase.last())),
            ("links_met", json!(self.links_met.last())),
        ];
        let after = ("after_verdict", json!(self.after_verdict.last()));
        numbers
            .chain(gain)
            .chain(reported)
            .chain(words)
            .chain([after])
            .map(|(name, value)| (name.to_string(), value))
            .collect()
    }

    /// Whether the controller has gains.
    fn has_gain(&self) -> bool {
        self.gain.iter().any(Option::is_some)
    }

    /// The names of the numbers that every robot has and every controller may have.
    pub fn names_of_body() -> impl Iterator<Item = &'static str> {
        BODY.split_whitespace()
    }

    /// The finished table. Only columns with missing values are nullable.
    pub fn columns(self) -> Vec<DataColumn> {
        let has_gain = self.has_gain();
        let mut columns: Vec<DataColumn> = (self.names.into_iter().zip(self.values))
            .map(|(name, values)| {
                let may_miss = values.contains(&None);
                DataColumn::new(name, Data::Number(values), may_miss)
            })
            .collect();
        let phase = DataColumn::new("phase", Data::Text(self.phase), false);
        let gain = has_gain.then(|| DataColumn::new("gain", Data::Text(self.gain), true));
        let after_verdict = Data::Whole(self.after_verdict);
        let after_verdict = DataColumn::new("after_verdict", after_verdict, false);
        let links_met = DataColumn::new("links_met", Data::Text(self.links_met), true);
        let numbers = self.numbers.into_iter().map(|(name, numbers)| {
            let finite = numbers.into_iter().map(|n| n.filter(|n| n.is_finite()));
            DataColumn::new(name, Data::Number(finite.collect()), true)
        });
        let reported = std::iter::once(phase)
            .chain(gain)
            .chain(numbers)
            .chain([after_verdict, links_met]);
        let place = BODY.split_whitespace().count();
        columns.splice(place..place, reported);
        columns
    }
}

/// Position and quaternion (w first) of a pose.
fn as_numbers(pose: &Pose) -> [f64; 7] {
    let (at, r) = (pose.translation.vector, pose.rotation);
    [at.x, at.y, at.z, r.w, r.i, r.j, r.k]
}
