//! The maximal CPI sets of a gain set as text, JSON and CSV: their sizes, their inclusion, and their rows.

use super::layout::wrapped;
use crate::table::{Table, cell, headings, number, texts};
use nalgebra::{DMatrix, Vector2};
use serde_json::{Map, Value, json};
use standfast_core::error::{Error, Result};
use standfast_core::geometry::SupportPolygon;
use standfast_core::lipm::cpi_set::{CpiSet, Inclusion};
use standfast_core::lipm::{GainFamily, GainSet, Pendulum};
use standfast_files::write_atomic;
use std::fmt::Write as _;
use std::path::Path;

/// First line of exported files: the order of the state (eq. 5).
pub const HEADER: &str = "com_x,com_vel_x,zmp_x,com_y,com_vel_y,zmp_y";

/// Directions in which sizes are shown.
const HEADINGS: [(&str, Vector2<f64>); 4] = [
    ("forward", Vector2::new(1.0, 0.0)),
    ("left", Vector2::new(0.0, 1.0)),
    ("backward", Vector2::new(-1.0, 0.0)),
    ("right", Vector2::new(0.0, -1.0)),
];

/// Explains the columns of the first table.
const EXPLAINED: &str = "Poles are multiples of -omega. The set of a gain is what keeps the ZMP within its region over the \
                         horizon, which takes so many inequalities (rows). Forward, left, backward and right are the \
                         largest impulses in these directions that a robot at rest can take within the set, over m omega d: \
                         mass times omega times the way d from the origin to the edge in the direction of the push. A standing pendulum \
                         can take 1 at most.";
/// Explains the table of the CPI sets without disturbances.
const UNDISTURBED_EXPLAINED: &str =
    "Without disturbances the same gains have these sets, as in the paper.";
/// Explains the last table.
const NESTING_EXPLAINED: &str = "\"yes\": the set of the row lies inside the set of the column.";

/// The CPI sets of a gain set, and the data from which they were computed.
pub struct Sets<'a> {
    pub set: &'a GainSet,
    pub family: &'a GainFamily,
    pub support: &'a SupportPolygon,
    /// CPI sets, from slow to fast.
    pub sets: &'a [CpiSet],
    pub inclusion: Inclusion,
    /// The CPI sets of the same gains without disturbances. It is empty if the gain set states no disturbances.
    pub undisturbed: &'a [CpiSet],
}

impl Sets<'_> {
    pub fn as_json(&self) -> Value {
        let dt = self.family.pendulum.dt;
        let entries = |sets: &[CpiSet]| {
            let mut entries = Vec::new();
            for (s, poles) in sets.iter().zip(&self.set.gains) {
                let mut impulses = Map::new();
                for (name, direction) in HEADINGS {
                    let impulse = s.largest_impulse_from_rest(direction);
                    impulses.insert(name.into(), json!(impulse));
                }
                entries.push(json!({
                    "zmp_spread_m": s.spread_m,
                    "gain": s.gain,
                    "poles_x_over_omega": poles.x,
                    "poles_y_over_omega": poles.y,
                    "horizon": s.horizon,
                    "horizon_s": s.horizon as f64 * dt,
                    "rows": s.set.rows.nrows(),
                    "largest_impulse_over_m_omega_d": impulses,
                }));
            }
            entries
        };
        json!({
            "gain_set": self.set.name,
            "omega_rad_s": self.family.pendulum.omega,
            "dt_s": dt,
            "support_m": self.support.vertices().iter().map(|v| [v.x, v.y]).collect::<Vec<_>>(),
            "zmp_disturbance_m": self.family.zmp_disturbance_m().as_slice(),
            "sets": entries(self.sets),
            "sets_without_disturbances": entries(self.undisturbed),
            "inside": self.inclusion.inside,
            "nested": self.inclusion.failures().is_empty(),
            "warning": self.inclusion.warning(),
        })
    }

    pub fn text(&self) -> String {
        let Pendulum { omega, dt } = self.family.pendulum;
        let vertices: Vec<String> = self
            .support
            .vertices()
            .iter()
            .map(|vertex| format!("({:.1}, {:.1})", vertex.x * 1e3, vertex.y * 1e3))
            .collect();
        let warning = match self.inclusion.warning() {
            Some(warning) => wrapped("warning: ", &warning),
            None => {
                "The family nests: the set of each gain lies inside the sets of all slower gains.\n"
                    .into()
            }
        };
        let (mut robust, mut disturbance, mut undisturbed) = ("", String::new(), String::new());
        if !self.undisturbed.is_empty() {
            let bounds = self.family.zmp_disturbance_m() * 1e3;
            let words = format!(
                "against disturbances of up to {:.1} mm in x and {:.1} mm in y",
                bounds.x, bounds.y
            );
            robust = "robust ";
            disturbance = wrapped("robust    ", &words);
            undisturbed = format!(
                "{}\n{}\n",
                wrapped("", UNDISTURBED_EXPLAINED),
                self.sizes(self.undisturbed)
            );
        }
        format!(
            "Maximal {robust}CPI sets of gain set {}\n\
             pendulum  omega {omega:.3} rad/s, control period {:.3} ms\n\
             {}{disturbance}\n\
             {}{}\n\
             {undisturbed}{}\n\
             {warning}",
            self.set.name,
            dt * 1e3,
            wrapped(
                "ZMP       ",
                &format!(
                    "within a region with the corners {} mm",
                    vertices.join(", ")
                )
            ),
            self.sizes(self.sets),
            wrapped("", EXPLAINED),
            self.nesting(),
        )
    }

    /// A row for each CPI set: poles, horizon, number of inequalities, and sizes.
    fn sizes(&self, sets: &[CpiSet]) -> String {
        let columns = headings("gain", ["poles x", "poles y", "horizon", "rows"]);
        let mut sizes = Table::new("", columns.chain(HEADINGS.map(|(name, _)| number(name))));
        let poles = |p: [f64; 3]| format!("{} {} {}", p[0], p[1], p[2]);
        for (s, g) in sets.iter().zip(&self.set.gains) {
            let horizon = format!("{:.0} ms", 1e3 * s.horizon as f64 * self.family.pendulum.dt);
            let row = [
                s.gain.clone(),
                poles(g.x),
                poles(g.y),
                horizon,
                s.set.rows.nrows().to_string(),
            ];
            let impulses = HEADINGS.map(|(_, d)| format!("{:.3}", s.largest_impulse_from_rest(d)));
            sizes.row(texts(row).chain(texts(impulses)));
        }
        sizes.text()
    }

    /// Which CPI set lies inside which.
    fn nesting(&self) -> String {
        let Inclusion { names, inside, .. } = &self.inclusion;
        let mut nesting = Table::new("", headings("inside", []).chain(names.iter().map(number)));
        for (name, row) in names.iter().zip(inside) {
            nesting.row(
                [name.as_str()]
                    .into_iter()
                    .chain(row.iter().map(|inside| if *inside { "yes" } else { "-" }))
                    .map(cell),
            );
        }
        nesting.with_note(NESTING_EXPLAINED).text()
    }

    /// Writes CSV files to `folder`: for each gain the rows of S (S x <= 1) and the closed loop of eq. 13, in full
    /// precision. Fails if a file cannot be written.
    pub fn export(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).map_err(|source| Error::Write {
            path: folder.into(),
            source,
        })?;
        for (i, (gain, set)) in self.family.gains.iter().zip(self.sets).enumerate() {
            let closed = gain.closed_loop();
            write_csv(&folder.join(format!("gain-{i}-set.csv")), &set.set.rows)?;
            let closed = DMatrix::from_column_slice(6, 6, closed.as_slice());
            write_csv(&folder.join(format!("gain-{i}-closed-loop.csv")), &closed)?;
        }
        Ok(())
    }
}

fn write_csv(path: &Path, rows: &DMatrix<f64>) -> Result<()> {
    let mut text = format!("{HEADER}\n");
    for row in rows.row_iter() {
        // Debug formatting is the shortest text that reads back as the same number; adding 0 makes -0 plain 0.
        let cells: Vec<String> = row.iter().map(|v| format!("{:?}", v + 0.0)).collect();
        let _ = writeln!(text, "{}", cells.join(","));
    }
    write_atomic(path, text.as_bytes())
}
