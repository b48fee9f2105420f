//! The trace of an episode: a table with one row for each control tick, and with units in the names of its columns.
//!
//! The row of time t holds the true state at t, the mean forces over the tick that ends at t, and the controller's
//! estimates and commands at t (which act after the robot's delay). All values are in the world frame. Estimates and
//! commands are in the controller's estimate of it, which drifts when feet slip. Before the first physics step, the
//! forces are half of the weight on each sole. A value that does not exist is empty, such as the ZMP in flight or the
//! margin of a gain set without gains. `links_met` names the two links that pressed on each other hardest during the tick,
//! legs before arms.

use crate::columns::{Column, Data};
use crate::episode::Tick;
use crate::robot::{Foot, Robot};
use nalgebra::Vector3;

/// Collects the rows of an episode.
pub struct Trace {
    names: Vec<String>,
    values: Vec<Vec<Option<f64>>>,
    phase: Vec<String>,
    gain: Vec<String>,
    /// The links that met during the tick.
    links_met: Vec<Option<String>>,
    links: Vec<String>,
}

/// Names of the columns before `phase`, `gain` and `links_met`.
const BODY: &str = "time_s com_x_m com_y_m com_z_m com_vel_x_m_s com_vel_y_m_s com_vel_z_m_s \
                    com_x_m_est com_y_m_est com_z_m_est com_vel_x_m_s_est com_vel_y_m_s_est com_vel_z_m_s_est \
                    zmp_x_m zmp_y_m zmp_ref_x_m zmp_ref_y_m dcm_x_m dcm_y_m \
                    contact_force_x_n contact_force_y_n contact_force_z_n \
                    push_force_x_n push_force_y_n push_force_z_n \
                    zmp_x_m_est zmp_y_m_est trunk_tilt_deg dcm_outside_m cpi_margin";

impl Trace {
    pub fn new(robot: &Robot) -> Self {
        let mut names: Vec<String> = BODY.split_whitespace().map(String::from).collect();
        for side in ["left", "right"] {
            for part in ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"] {
                names.push(format!("{side}_sole_{part}"));
            }
            for part in ["force_x_n", "force_y_n", "force_z_n", "moment_x_n_m", "moment_y_n_m", "moment_z_n_m"] {
                names.push(format!("{side}_sole_{part}"));
            }
        }
        for prefix in ["q", "q_ref", "tau"] {
            names.extend(robot.joints.iter().map(|joint| format!("{prefix}_{}", joint.name)));
        }
        let values = vec![Vec::new(); names.len()];
        let links = robot.links.iter().map(|link| link.name.clone()).collect();
        Self { names, values, phase: Vec::new(), gain: Vec::new(), links_met: Vec::new(), links }
    }

    /// Adds the row of a tick.
    pub fn push(&mut self, tick: &Tick) {
        let (truth, account) = (tick.truth, &tick.account);
        let estimate = account.estimate;
        let zmp = truth.zmp.map_or([None; 2], |z| z.map(Some));
        // The margin is not updated while a foot is in the air.
        let margin = account.gain.filter(|_| account.stands()).map(|_| account.margin);
        let mut row: Vec<Option<f64>> = vec![Some(truth.time_s)];
        let mut add = |values: &[f64]| row.extend(values.iter().map(|v| Some(*v)));
        add(truth.com.coords.as_slice());
        add(truth.com_vel.as_slice());
        add(estimate.com.coords.as_slice());
        add(estimate.com_vel.as_slice());
        row.extend(zmp);
        let mut add = |values: &[f64]| row.extend(values.iter().map(|v| Some(*v)));
        add(account.zmp_ref.coords.as_slice());
        add(tick.dcm.coords.as_slice());
        add(truth.contact_force.as_slice());
        add(truth.push_force.as_slice());
        add(estimate.zmp.coords.as_slice());
        add(&[truth.tilt_rad().to_degrees()]);
        row.extend([Some(tick.dcm_outside_m), margin].map(|v| v.filter(|v| v.is_finite())));
        let mut add = |values: &[f64]| row.extend(values.iter().map(|v| Some(*v)));
        for foot in Foot::BOTH {
            let (pose, wrench) = (&truth.soles[foot], &truth.sole_wrenches[foot]);
            let r = pose.rotation;
            add(pose.translation.vector.as_slice());
            add(&[r.w, r.i, r.j, r.k]);
            for v in [wrench.force, wrench.moment] {
                add(Vector3::as_slice(&v));
            }
        }
        add(&truth.posture.q);
        add(&tick.command.q_ref);
        add(&truth.tau);
        for (column, value) in self.values.iter_mut().zip(row) {
            column.push(value);
        }
        self.phase.push(account.phase.name().into());
        self.gain.push(account.gain_name().unwrap_or("none").into());
        let names = |[a, b]: [usize; 2]| format!("{} and {}", self.links[a], self.links[b]);
        self.links_met.push(truth.meeting.map(|meeting| names(meeting.links)));
    }

    /// The finished table. Only columns with missing values are nullable.
    pub fn columns(self) -> Vec<Column> {
        let mut columns: Vec<Column> = (self.names.into_iter().zip(self.values))
            .map(|(name, values)| {
                let whole: Option<Vec<f64>> = values.iter().copied().collect();
                Column::new(name, whole.map_or(Data::OptF64(values), Data::F64))
            })
            .collect();
        let words = [
            ("phase", Data::Text(self.phase)),
            ("gain", Data::Text(self.gain)),
            ("links_met", Data::OptText(self.links_met)),
        ]
        .map(|(name, data)| Column::new(name, data));
        let place = BODY.split_whitespace().count();
        columns.splice(place..place, words);
        columns
    }
}
