//! One row of the result: one trial with one controller.

#[cfg(doc)]
use crate::campaign::ask::no_step::NoStep;
use crate::columns::{Column, Data, ParquetFile};
use crate::episode::{Membership, Outcome, Record};
use crate::error::{Error, Result};
use crate::files::Hashing;
use crate::robot::Foot;
use crate::sim::{Profile, Push, Variation};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Write;

/// Builds a struct from fields that other structs have by the same name, and from further fields.
macro_rules! copied {
    ($into:ident { $(..$source:ident: $($same:ident)+;)* $($field:ident: $value:expr,)* }) => {
        $into { $($($same: $source.$same,)+)* $($field: $value,)* }
    };
}

/// A row of `trials.parquet`. Units are in the names, angles in degrees, quantities in the world frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialRow {
    /// Index of the trial, from 0. A trial has the same pushes, robot, ground and noise for every set.
    pub trial: u64,
    /// Name of the controller.
    pub set: String,
    pub impulse_n_s: f64,
    /// Impulse of the first push divided by m omega d ([`NoStep`]); None if the COM at home is not above the support.
    pub impulse_over_m_omega_d: Option<f64>,
    pub heading_deg: f64,
    pub height_m: f64,
    pub duration_s: f64,
    pub start_s: f64,
    pub profile: Profile,
    /// Impulse of the second push, which else is as the first; None if there is none.
    pub second_impulse_n_s: Option<f64>,
    pub second_heading_deg: Option<f64>,
    pub second_start_s: Option<f64>,
    /// Variation of robot and ground, with fields as in [`Variation`]; None where it is as designed.
    pub mass_scale: Option<f64>,
    pub trunk_com_x_m: Option<f64>,
    pub trunk_com_y_m: Option<f64>,
    pub friction: Option<f64>,
    pub slope_deg: Option<f64>,
    pub slope_heading_deg: Option<f64>,
    pub ground_step_m: Option<f64>,
    pub kp_scale: Option<f64>,
    pub kd_scale: Option<f64>,
    pub torque_scale: Option<f64>,
    pub speed_scale: Option<f64>,
    pub delay_s: Option<f64>,
    pub outcome: Outcome,
    /// The other fields are as in [`Record`].
    pub end_s: f64,
    pub fell_at_s: Option<f64>,
    pub fall_cause: Option<String>,
    pub settled_at_s: Option<f64>,
    pub home_at_s: Option<f64>,
    pub com_speed_at_push_m_s: Option<f64>,
    pub peak_tilt_deg: f64,
    pub peak_torque_n_m: f64,
    pub peak_torque_ratio: f64,
    pub torque_limited_s: f64,
    pub peak_joint_speed_rad_s: f64,
    pub peak_dcm_outside_m: f64,
    pub peak_slip_m: f64,
    pub legs_met_at_s: Option<f64>,
    pub legs_met: Option<String>,
    pub promise_margin: Option<f64>,
    pub promise_margin_est: Option<f64>,
    /// Number of completed footsteps.
    pub footsteps: u32,
    /// The foot that was in the air at the fall or at the end.
    pub unfinished_footstep: Option<Foot>,
    pub totals: Totals,
}

impl TrialRow {
    /// `pushes` are the first and, if there is one, the second. `no_step_n_s` is m omega d for the first ([`NoStep`]).
    pub fn new(
        trial: u64,
        set: &str,
        pushes: &[Push],
        no_step_n_s: Option<f64>,
        variation: &Variation,
        record: Record,
    ) -> Self {
        let (push, second) = (&pushes[0], pushes.get(1));
        copied! { Self {
            ..push: impulse_n_s heading_deg height_m duration_s start_s profile;
            ..variation: mass_scale trunk_com_x_m trunk_com_y_m friction slope_deg slope_heading_deg ground_step_m
                kp_scale kd_scale torque_scale speed_scale delay_s;
            ..record: outcome end_s fell_at_s fall_cause settled_at_s home_at_s com_speed_at_push_m_s
                peak_tilt_deg peak_torque_n_m peak_torque_ratio torque_limited_s peak_joint_speed_rad_s
                peak_dcm_outside_m peak_slip_m legs_met_at_s legs_met promise_margin
                promise_margin_est;
            trial: trial,
            set: set.into(),
            impulse_over_m_omega_d: no_step_n_s.map(|bound_n_s| push.impulse_n_s / bound_n_s),
            second_impulse_n_s: second.map(|push| push.impulse_n_s),
            second_heading_deg: second.map(|push| push.heading_deg),
            second_start_s: second.map(|push| push.start_s),
            footsteps: record.footsteps.len() as u32,
            unfinished_footstep: record.unfinished_footstep.map(|lifted| lifted.foot),
            totals: Totals(record.totals),
        } }
    }

    /// The pushes, in order of time.
    pub fn pushes(&self) -> Vec<Push> {
        let first = copied! { Push { ..self: impulse_n_s heading_deg height_m duration_s start_s profile; } };
        let second = || {
            let (impulse_n_s, heading_deg) = (self.second_impulse_n_s?, self.second_heading_deg?);
            Some(Push { impulse_n_s, heading_deg, start_s: self.second_start_s?, ..first })
        };
        std::iter::once(first).chain(second()).collect()
    }

    /// The variation of robot and ground.
    pub fn variation(&self) -> Variation {
        copied! { Variation {
            ..self: mass_scale trunk_com_x_m trunk_com_y_m friction slope_deg slope_heading_deg ground_step_m
                kp_scale kd_scale torque_scale speed_scale delay_s;
        } }
    }

    /// Where the true state lay at the end of the last push; None without a promise.
    pub fn set_after_push(&self) -> Option<Membership> {
        self.promise_margin.map(Membership::of_margin)
    }

    pub fn has_recovered(&self) -> bool {
        self.outcome == Outcome::Recovered
    }

    /// Time from the end of the last push until the robot stands (s); None unless it recovered.
    pub fn settling_s(&self) -> Option<f64> {
        self.after_last_push_s(self.settled_at_s)
    }

    /// Time from the end of the last push until the COM is home to stay (s); None unless the robot recovered.
    pub fn homing_s(&self) -> Option<f64> {
        self.after_last_push_s(self.home_at_s)
    }

    fn after_last_push_s(&self, at_s: Option<f64>) -> Option<f64> {
        let pushed_until_s = self.second_start_s.unwrap_or(self.start_s) + self.duration_s;
        at_s.filter(|_| self.has_recovered()).map(|at_s| (at_s - pushed_until_s).max(0.0))
    }
}

/// A column for each field, by its kind.
macro_rules! columns {
    ($($kind:ident $($field:ident)*;)*) => {
        [$($(|rows| Column::new(stringify!($field), $kind(rows.iter().map(|row| &row.$field)))),*),*]
    };
}

/// The rows as columns, in the order of the fields, the last of them with a column for each of `totals`. Each column is
/// made when it is due.
pub fn columns(rows: &[TrialRow], totals: &[String]) -> impl Iterator<Item = Column> {
    const COLUMNS: &[fn(&[TrialRow]) -> Column] = &columns! {
        count trial; word set;
        number impulse_n_s; maybe impulse_over_m_omega_d; number heading_deg height_m duration_s start_s; word profile;
        maybe second_impulse_n_s second_heading_deg second_start_s;
        maybe mass_scale trunk_com_x_m trunk_com_y_m friction slope_deg slope_heading_deg ground_step_m;
        maybe kp_scale kd_scale torque_scale speed_scale delay_s;
        word outcome; number end_s; maybe fell_at_s; maybe_word fall_cause; maybe settled_at_s home_at_s;
        maybe com_speed_at_push_m_s;
        number peak_tilt_deg peak_torque_n_m peak_torque_ratio torque_limited_s peak_joint_speed_rad_s;
        number peak_dcm_outside_m peak_slip_m; maybe legs_met_at_s; maybe_word legs_met;
        maybe promise_margin promise_margin_est; count footsteps; maybe_word unfinished_footstep;
    };
    let of_controller = |name: &String| {
        let total = |row: &TrialRow| row.totals.0.get(name).copied();
        Column::new(name, Data::OptF64(rows.iter().map(total).collect()))
    };
    COLUMNS.iter().map(|column| column(rows)).chain(totals.iter().map(of_controller))
}

/// What a controller reports of a whole episode: numbers by their names. In a part they are one JSON object.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Totals(pub BTreeMap<String, f64>);

impl Serialize for Totals {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&serde_json::to_string(&self.0).map_err(serde::ser::Error::custom)?)
    }
}

impl<'de> Deserialize<'de> for Totals {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        serde_json::from_str(&String::deserialize(from)?).map(Self).map_err(serde::de::Error::custom)
    }
}

fn count<'a, T: Copy + TryInto<i64> + 'a>(values: impl Iterator<Item = &'a T>) -> Data {
    Data::I64(values.map(|&count| count.try_into().unwrap_or(i64::MAX)).collect())
}

fn number<'a>(values: impl Iterator<Item = &'a f64>) -> Data {
    Data::F64(values.copied().collect())
}

fn maybe<'a>(values: impl Iterator<Item = &'a Option<f64>>) -> Data {
    Data::OptF64(values.copied().collect())
}

/// Text, or a name out of several, as in a CSV file.
fn word<'a, T: Serialize + 'a>(values: impl Iterator<Item = &'a T>) -> Data {
    Data::Text(values.map(as_text).collect())
}

fn maybe_word<'a, T: Serialize + 'a>(values: impl Iterator<Item = &'a Option<T>>) -> Data {
    Data::OptText(values.map(|value| value.as_ref().map(as_text)).collect())
}

/// A name as it is written in files.
pub fn as_text(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| value.as_str().map(String::from)).unwrap_or_default()
}

/// Number of rows in a row group of `trials.parquet`; the last one may have fewer. So many wait in memory, about 50 MB.
const GROUP_ROWS: usize = 65_536;

/// `trials.parquet` in the making. Rows are written as they come, and hashed.
pub struct TrialsFile<W: Write + Send> {
    file: ParquetFile<Hashing<W>>,
    /// Rows of the next row group.
    waiting: Vec<TrialRow>,
    groups: usize,
    totals: Vec<String>,
}

impl<W: Write + Send> TrialsFile<W> {
    /// With columns for these totals of controllers. Fails if nothing can be written there.
    pub fn new(to: W, totals: &[String]) -> Result<Self> {
        let file = ParquetFile::new(Hashing::new(to), columns(&[], totals)).map_err(not_written)?;
        Ok(Self { file, waiting: Vec::new(), groups: 0, totals: totals.to_vec() })
    }

    /// Adds the next rows.
    pub fn push(&mut self, rows: impl IntoIterator<Item = TrialRow>) -> Result<()> {
        for row in rows {
            self.waiting.push(row);
            if self.waiting.len() == GROUP_ROWS {
                self.write_group()?;
            }
        }
        Ok(())
    }

    /// Ends the file. Gives back what it was written to, and its SHA-256.
    pub fn finish(mut self) -> Result<(W, String)> {
        // A file without rows has a group without rows.
        if !self.waiting.is_empty() || self.groups == 0 {
            self.write_group()?;
        }
        Ok(self.file.finish().map_err(not_written)?.finish())
    }

    fn write_group(&mut self) -> Result<()> {
        self.file.group(columns(&self.waiting, &self.totals)).map_err(not_written)?;
        self.waiting.clear();
        self.groups += 1;
        Ok(())
    }
}

fn not_written(source: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::Write { path: "trials.parquet".into(), source: std::io::Error::other(source) }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::error::TRY_AGAIN;
    use parquet::errors::ParquetError;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    pub(crate) fn record(outcome: Outcome) -> Record {
        Record {
            outcome,
            end_s: 2.0,
            fell_at_s: (outcome == Outcome::Fell).then_some(1.5),
            fall_cause: (outcome == Outcome::Fell).then(|| "left_knee, at the ground".into()),
            settled_at_s: (outcome == Outcome::Recovered).then_some(1.25),
            home_at_s: (outcome == Outcome::Recovered).then_some(1.75),
            com_speed_at_push_m_s: Some(0.001),
            peak_tilt_deg: 1.0 / 3.0,
            peak_torque_n_m: f64::NAN,
            peak_torque_ratio: 0.5,
            torque_limited_s: 0.004,
            peak_joint_speed_rad_s: 2.0,
            peak_dcm_outside_m: 1e-300,
            peak_slip_m: 0.003,
            promise_margin: Some(-0.25),
            promise_margin_est: Some(0.25),
            totals: [("gain_switches".to_string(), 3.0)].into(),
            ..Record::default()
        }
    }

    pub(crate) fn row(trial: u64, set: &str, impulse_n_s: f64, outcome: Outcome) -> TrialRow {
        let push = Push { impulse_n_s, ..Push::default() };
        TrialRow::new(trial, set, &[push], Some(2.0), &Variation::default(), record(outcome))
    }

    /// A trial for each pair of outcomes of the sets "a" and "b".
    pub(crate) fn rows(outcomes: &[[Outcome; 2]]) -> Vec<TrialRow> {
        let trial = |(i, of): (usize, &[Outcome; 2])| [row(i as u64, "a", 1.0, of[0]), row(i as u64, "b", 1.0, of[1])];
        outcomes.iter().enumerate().flat_map(trial).collect()
    }

    #[test]
    fn columns_are_the_fields_of_a_row() {
        let mut csv = csv::Writer::from_writer(Vec::new());
        csv.serialize(row(0, "hold", 2.0, Outcome::Fell)).unwrap();
        let text = String::from_utf8(csv.into_inner().unwrap()).unwrap();
        let names: Vec<String> = columns(&[], &["totals".into()]).map(|c| c.name).collect();
        assert_eq!(text.lines().next().unwrap(), names.join(","));
    }

    #[test]
    fn words_are_those_of_a_csv_file() {
        let rows = [row(0, "hold", 2.0, Outcome::TimedOut)];
        let found: Vec<Column> = columns(&rows, &["gain_switches".into(), "left_sets_at_s".into()]).collect();
        let column = |name: &str| found.iter().find(|column| column.name == name).map(|column| column.data.clone());
        for (name, expected) in [("set", "hold"), ("profile", "rectangular"), ("outcome", "TimedOut")] {
            assert_eq!(column(name), Some(Data::Text(vec![expected.into()])), "{name}");
        }
        assert_eq!(column("promise_margin"), Some(Data::OptF64(vec![Some(-0.25)])));
        assert_eq!(column("gain_switches"), Some(Data::OptF64(vec![Some(3.0)])));
        assert_eq!(column("left_sets_at_s"), Some(Data::OptF64(vec![None])));
        assert_eq!(column("unfinished_footstep"), Some(Data::OptText(vec![None])));
    }

    /// Also if they come a few at a time.
    #[test]
    fn rows_beyond_the_first_row_group_read_back() {
        let rows = |trials: std::ops::Range<u64>| trials.map(|i| row(i, "hold", i as f64 / 7.0, Outcome::Fell));
        let trials = GROUP_ROWS as u64 + 3;
        let mut file = TrialsFile::new(Vec::new(), &[]).unwrap();
        file.push(rows(0..10)).unwrap();
        file.push(rows(10..trials)).unwrap();
        let (bytes, sha256) = file.finish().unwrap();
        assert_eq!(sha256, crate::files::sha256_hex(&bytes));
        let mut at = tempfile::tempfile().unwrap();
        at.write_all(&bytes).unwrap();
        let reader = SerializedFileReader::new(at).unwrap();
        assert_eq!(reader.num_row_groups(), 2);
        let mut found = 0;
        for (row, i) in reader.get_row_iter(None).unwrap().map(Result::unwrap).zip(0..) {
            assert_eq!((row.get_long(0).unwrap(), row.get_double(2).unwrap()), (i, i as f64 / 7.0));
            found += 1;
        }
        assert_eq!(found, trials);
    }

    #[test]
    fn a_push_is_measured_by_what_standing_takes() {
        assert_eq!(row(0, "hold", 3.0, Outcome::Fell).impulse_over_m_omega_d, Some(1.5));
    }

    #[test]
    fn settling_counts_from_the_end_of_the_push() {
        assert_eq!(row(0, "hold", 2.0, Outcome::Fell).settling_s(), None);
        let settling_s = row(0, "hold", 2.0, Outcome::Recovered).settling_s().unwrap();
        assert!((settling_s - (1.25 - 0.55)).abs() < 1e-12);
    }

    /// There may be room later.
    #[test]
    fn a_full_disk_is_told_by_its_exit_code() {
        let full = |kind| not_written(ParquetError::from(std::io::Error::from(kind))).exit_code();
        assert_eq!(full(std::io::ErrorKind::StorageFull), TRY_AGAIN);
        assert_ne!(full(std::io::ErrorKind::PermissionDenied), TRY_AGAIN);
    }
}
