//! How well the ZMP under the soles follows the commanded ZMP, and what the response means for the poles, as text and
//! JSON.

use crate::response::{self, Axis, Bandwidth, Experiment, Point};
use serde_json::{Value, json};
use standfast::core::lipm::gains::GainFamily;
use standfast::report::text::layout::wrapped;
use std::fmt::Write;

pub struct Response<'a> {
    pub robot: &'a str,
    pub family: &'a GainFamily,
    pub axis: Axis,
    pub amplitude_m: f64,
    /// The points of the response, in ascending order of frequency.
    pub points: Vec<Point>,
    pub bandwidth: Bandwidth,
}

impl<'a> Response<'a> {
    pub fn new(
        robot: &'a str,
        family: &'a GainFamily,
        what: &Experiment,
        points: Vec<Point>,
    ) -> Self {
        let bandwidth = response::bandwidth(&points);
        Self {
            robot,
            family,
            axis: what.axis,
            amplitude_m: what.amplitude_m,
            points,
            bandwidth,
        }
    }

    pub fn axis_name(&self) -> &'static str {
        match self.axis {
            Axis::X => "x",
            Axis::Y => "y",
        }
    }

    /// The fastest pole on the axis, as a multiple of -omega.
    fn fastest_pole(&self) -> f64 {
        self.family
            .gains
            .iter()
            .flat_map(|gain| match self.axis {
                Axis::X => gain.x.poles,
                Axis::Y => gain.y.poles,
            })
            .fold(0.0, f64::max)
    }

    /// The fastest pole on the axis (rad/s, positive).
    pub fn fastest_pole_rad_s(&self) -> f64 {
        self.fastest_pole() * self.family.pendulum.omega
    }

    pub fn as_json(&self) -> Value {
        json!({
            "gains": self.family.name,
            "robot": self.robot,
            "axis": self.axis,
            "amplitude_m": self.amplitude_m,
            "omega_rad_s": self.family.pendulum.omega,
            "points": self.points,
            "bandwidth_3db_rad_s": self.bandwidth.gain_rad_s,
            "bandwidth_45deg_rad_s": self.bandwidth.phase_rad_s,
            "fastest_pole_rad_s": self.fastest_pole_rad_s(),
        })
    }

    /// The table of the response, and a comparison of the bandwidth with the poles.
    pub fn text(&self) -> String {
        let omega = self.family.pendulum.omega;
        let mut text = format!(
            "How the ZMP under the soles follows the commanded ZMP\n\
             gain set {}, robot {}, axis {}\n\
             A sine of {} mm is added to the commanded ZMP. omega is the natural frequency\n\
             of the pendulum, {omega:.2} rad/s. The last column is the amplitude of the commanded\n\
             ZMP over that of the sine.\n\n\
             frequency  in omega   gain    phase    delay  commanded/sine\n",
            self.family.name,
            self.robot,
            self.axis_name(),
            1e3 * self.amplitude_m,
        );
        for p in &self.points {
            _ = writeln!(
                text,
                "{:6.2} Hz  {:8.2}  {:5.3}  {:5.1} deg  {:4.1} ms  {:14.2}",
                p.frequency_hz,
                p.angular_frequency() / omega,
                p.gain,
                p.phase_deg,
                1e3 * p.delay_s(),
                p.sensitivity
            );
        }
        let most = self.points.last().map_or(0.0, Point::angular_frequency);
        let shown = |limit: Option<f64>| match limit {
            Some(w) => format!("at {w:.1} rad/s ({:.1} omega)", w / omega),
            None => format!("only above {most:.0} rad/s ({:.0} omega)", most / omega),
        };
        let (fastest, pole) = (self.fastest_pole(), self.fastest_pole_rad_s());
        let [gain, phase] =
            [self.bandwidth.gain_rad_s, self.bandwidth.phase_rad_s].map(|w| w.unwrap_or(most));
        let side = |limit: f64| if pole < limit { "below" } else { "above" };
        let follows = if pole < phase.min(gain) {
            "The ZMP can follow the gains."
        } else {
            "The ZMP lags behind what the CPI sets assume."
        };
        let conclusion = format!(
            "The gain falls to -3 dB {}, and the phase reaches -45 degrees {}. The fastest pole, {fastest} omega = \
             {pole:.1} rad/s, is {} the -45 degrees bandwidth and {} the -3 dB bandwidth. {follows}",
            shown(self.bandwidth.gain_rad_s),
            shown(self.bandwidth.phase_rad_s),
            side(phase),
            side(gain),
        );
        text += "\n";
        text += &wrapped("", &conclusion);
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast::core::lipm::Pendulum;

    #[test]
    fn the_pole_is_judged_by_the_bandwidth() {
        let gains = crate::gain_set("switching").unwrap();
        let robot = standfast::robots::load("ut-mu2").unwrap();
        let family = GainFamily::design(
            &gains,
            Pendulum {
                omega: robot.omega(),
                dt: 0.002,
            },
            0.048,
        )
        .unwrap();
        let say = |gain_rad_s, phase_rad_s| {
            let bandwidth = Bandwidth {
                gain_rad_s,
                phase_rad_s,
            };
            let (axis, points) = (Axis::Y, Vec::new());
            let told = Response {
                robot: "ut-mu2",
                family: &family,
                axis,
                amplitude_m: 0.005,
                points,
                bandwidth,
            }
            .text();
            told.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        let pole = family
            .gains
            .iter()
            .flat_map(|gain| gain.y.poles)
            .fold(0.0, f64::max)
            * family.pendulum.omega;
        assert!(say(Some(2.0 * pole), Some(1.5 * pole)).contains("can follow"));
        let mixed = say(Some(2.0 * pole), Some(0.5 * pole));
        assert!(
            mixed.contains("is above the -45 degrees bandwidth and below the -3 dB bandwidth"),
            "{mixed}"
        );
        assert!(
            mixed.contains("lags behind what the CPI sets assume"),
            "{mixed}"
        );
    }
}
