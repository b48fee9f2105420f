//! `standfast cpi`: the maximal CPI sets of a gain set: size, inclusion, horizon, picture, export.

use crate::error::{Error, Result};
use crate::geometry::SupportPolygon;
use crate::lipm::cpi_set::{CpiSet, Inclusion};
use crate::lipm::{GainFamily, GainSet, Pendulum};
use comfy_table::{Table, presets};
use nalgebra::{DMatrix, Vector2};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `standfast cpi`.
#[derive(Debug, Clone, clap::Args)]
pub struct CpiArgs {
    /// Gain set: a built-in name, a TOML file, or a variant NAME:KEY=VALUE of either
    #[arg(value_name = "GAINS", default_value = "switching")]
    pub gains: String,
    /// Pendulum frequency sqrt(g / height) (rad/s); default: the robot at home
    #[arg(long, value_name = "W", allow_hyphen_values = true)]
    pub omega: Option<f64>,
    /// Control period (s)
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    pub dt: Option<f64>,
    /// Support rectangle about the control origin (m), taken as is; default: both soles at home, less the ZMP margin
    #[arg(long, value_name = "XMIN,XMAX,YMIN,YMAX", allow_hyphen_values = true, value_parser = parse_support)]
    pub support: Option<SupportPolygon>,
    /// Write gain-0-set.csv, gain-0-closed-loop.csv, gain-1-set.csv ... here
    #[arg(long, value_name = "DIR")]
    pub export: Option<PathBuf>,
    /// Draw the sets as an SVG
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// What the arguments fall back on.
#[derive(Debug, Clone, Copy)]
pub struct CpiDefaults {
    pub pendulum: Pendulum,
    /// Support polygon of the robot at home in the control frame, without any margin.
    pub support: SupportPolygon,
}

/// Order of the state in exported files (eq. 5).
const HEADER: &str = "com_x,com_vel_x,zmp_x,com_y,com_vel_y,zmp_y";

/// Headings at which sizes are shown.
const HEADINGS: [(&str, Vector2<f64>); 4] = [
    ("forward", Vector2::new(1.0, 0.0)),
    ("left", Vector2::new(0.0, 1.0)),
    ("backward", Vector2::new(-1.0, 0.0)),
    ("right", Vector2::new(0.0, -1.0)),
];

/// Searches the sets, prints them to `out`, and writes what was asked for. Nothing is written if an input is bad.
pub fn run(args: &CpiArgs, defaults: &CpiDefaults, out: &mut dyn Write) -> Result<()> {
    let set = GainSet::load(&args.gains)?;
    if set.gains.is_empty() {
        let accepted = "a gain set with standing = \"switching\"";
        return Err(Error::value(&args.gains, "standing", "posture", "has no gains, so no CPI sets", accepted));
    }
    let pendulum = pendulum(args, defaults)?;
    let family = GainFamily::design(&set, pendulum)?;
    let support = match args.support {
        Some(support) => support,
        None => family.allowed_support(&defaults.support, &args.gains)?,
    };
    let sets = CpiSet::search_family(&family, &support)?;
    let inclusion = Inclusion::of(&sets)?;

    if let Some(folder) = &args.export {
        export(folder, &family, &sets)?;
    }
    if let Some(file) = &args.plot {
        super::cpi_plot::draw(file, &sets)?;
    }
    let text = if args.json {
        let object = as_json(&set, &family, &support, &sets, &inclusion);
        format!("{object:#}\n")
    } else {
        as_text(&set, &family, &support, &sets, &inclusion)
    };
    out.write_all(text.as_bytes()).map_err(|source| Error::Write { path: "stdout".into(), source })
}

fn pendulum(args: &CpiArgs, defaults: &CpiDefaults) -> Result<Pendulum> {
    let pendulum =
        Pendulum { omega: args.omega.unwrap_or(defaults.pendulum.omega), dt: args.dt.unwrap_or(defaults.pendulum.dt) };
    for (option, value) in [("--omega", pendulum.omega), ("--dt", pendulum.dt)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::value("command line", option, value, "is not positive", "a positive number"));
        }
    }
    Ok(pendulum)
}

fn parse_support(text: &str) -> Result<SupportPolygon, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| format!("{part:?} is not a number; accepted: xmin,xmax,ymin,ymax")))
        .collect::<Result<_, _>>()?;
    match numbers[..] {
        [xmin, xmax, ymin, ymax] if xmin < 0.0 && xmax > 0.0 && ymin < 0.0 && ymax > 0.0 => {
            SupportPolygon::rectangle(xmin, xmax, ymin, ymax).ok_or_else(|| "spans no area".into())
        }
        [_, _, _, _] => Err("the origin is not strictly inside; accepted: xmin < 0 < xmax, ymin < 0 < ymax [m]".into()),
        _ => Err(format!("{} numbers; accepted: xmin,xmax,ymin,ymax [m]", numbers.len())),
    }
}

fn as_json(
    set: &GainSet,
    family: &GainFamily,
    support: &SupportPolygon,
    sets: &[CpiSet],
    inclusion: &Inclusion,
) -> Value {
    let impulses = |s: &CpiSet| -> serde_json::Map<String, Value> {
        HEADINGS.iter().map(|(name, d)| ((*name).into(), json!(s.largest_impulse_from_rest(*d)))).collect()
    };
    let entries: Vec<Value> = sets
        .iter()
        .zip(&set.gains)
        .map(|(s, poles)| {
            json!({
                "gain": s.gain,
                "poles_x_over_omega": poles.x,
                "poles_y_over_omega": poles.y,
                "horizon": s.horizon,
                "horizon_s": s.horizon as f64 * family.pendulum.dt,
                "rows": s.set.rows.nrows(),
                "largest_impulse_over_m_omega_d": impulses(s),
            })
        })
        .collect();
    json!({
        "gain_set": set.name,
        "omega_rad_s": family.pendulum.omega,
        "dt_s": family.pendulum.dt,
        "support_m": support.vertices().iter().map(|v| [v.x, v.y]).collect::<Vec<_>>(),
        "sets": entries,
        "inside": inclusion.inside,
        "nested": inclusion.failures().is_empty(),
        "warning": inclusion.warning(),
    })
}

fn as_text(
    set: &GainSet,
    family: &GainFamily,
    support: &SupportPolygon,
    sets: &[CpiSet],
    inclusion: &Inclusion,
) -> String {
    let mut text = String::new();
    let Pendulum { omega, dt } = family.pendulum;
    let vertices: Vec<String> =
        support.vertices().iter().map(|v| format!("({:.1}, {:.1})", v.x * 1e3, v.y * 1e3)).collect();
    let _ = writeln!(text, "{}: maximal CPI sets at omega {omega:.3} rad/s, period {:.3} ms", set.name, dt * 1e3);
    let _ = writeln!(text, "support [mm]: {}", vertices.join(" "));

    let mut sizes = Table::new();
    sizes.load_style(presets::UTF8_FULL_CONDENSED);
    let mut header: Vec<String> = ["gain", "poles x", "poles y", "horizon", "rows"].map(String::from).into();
    header.extend(HEADINGS.iter().map(|(name, _)| (*name).into()));
    sizes.set_header(header);
    let poles = |p: [f64; 3]| format!("{} {} {}", p[0], p[1], p[2]);
    for (s, g) in sets.iter().zip(&set.gains) {
        let mut row = vec![
            s.gain.clone(),
            poles(g.x),
            poles(g.y),
            format!("{} ({:.3} s)", s.horizon, s.horizon as f64 * dt),
            s.set.rows.nrows().to_string(),
        ];
        row.extend(HEADINGS.iter().map(|(_, d)| format!("{:.3}", s.largest_impulse_from_rest(*d))));
        sizes.add_row(row);
    }
    let _ = writeln!(text, "{sizes}");
    let _ =
        writeln!(text, "forward ... right: largest impulse from rest over m omega d (d: origin to edge; 1 is the most");
    let _ = writeln!(text, "that standing can take). Poles are multiples of -omega.\n");

    let mut nesting = Table::new();
    nesting.load_style(presets::UTF8_FULL_CONDENSED);
    let mut header = vec!["inside".to_string()];
    header.extend(inclusion.names.iter().cloned());
    nesting.set_header(header);
    for (name, row) in inclusion.names.iter().zip(&inclusion.inside) {
        let mut cells = vec![name.clone()];
        cells.extend(row.iter().map(|inside| if *inside { "yes" } else { "-" }.to_string()));
        nesting.add_row(cells);
    }
    let _ = writeln!(text, "{nesting}");
    let _ = match inclusion.warning() {
        Some(warning) => writeln!(text, "warning: {warning}"),
        None => writeln!(text, "The family nests: the set of each gain lies inside the sets of the slower ones."),
    };
    text
}

/// Rows of S (S x <= 1) and the closed loop of eq. 13 for each gain, in full precision.
fn export(folder: &Path, family: &GainFamily, sets: &[CpiSet]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
    for (i, (gain, set)) in family.gains.iter().zip(sets).enumerate() {
        let closed = gain.closed_loop();
        write_csv(&folder.join(format!("gain-{i}-set.csv")), &set.set.rows)?;
        let closed = DMatrix::from_column_slice(6, 6, closed.as_slice());
        write_csv(&folder.join(format!("gain-{i}-closed-loop.csv")), &closed)?;
    }
    Ok(())
}

fn write_csv(path: &Path, rows: &DMatrix<f64>) -> Result<()> {
    let mut text = format!("{HEADER}\n");
    for row in rows.row_iter() {
        // Debug formatting is the shortest text that reads back as the same number; adding 0 makes -0 plain 0.
        let cells: Vec<String> = row.iter().map(|v| format!("{:?}", v + 0.0)).collect();
        let _ = writeln!(text, "{}", cells.join(","));
    }
    std::fs::write(path, text).map_err(|source| Error::Write { path: path.into(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        cpi: CpiArgs,
    }

    fn defaults() -> CpiDefaults {
        let support = SupportPolygon::rectangle(-0.0481, 0.0481, -0.0831, 0.0831).unwrap();
        CpiDefaults { pendulum: Pendulum { omega: 5.63, dt: 0.002 }, support }
    }

    fn run_with(args: &[&str]) -> Result<String> {
        let cli = Cli::try_parse_from([&["cpi"], args].concat())
            .map_err(|e| Error::Syntax { file: "command line".into(), message: e.to_string() })?;
        let mut out = Vec::new();
        run(&cli.cpi, &defaults(), &mut out)?;
        Ok(String::from_utf8(out).unwrap())
    }

    #[test]
    fn the_exported_rows_make_the_set_and_the_exported_loop_keeps_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sets");
        let args = ["fixed", "--json", "--support", "-0.03,0.06,-0.08,0.08", "--export", path.to_str().unwrap()];
        let object: Value = serde_json::from_str(&run_with(&args).unwrap()).unwrap();
        let read = |name: &str| -> Vec<Vec<f64>> {
            let text = std::fs::read_to_string(path.join(name)).unwrap();
            assert_eq!(text.lines().next(), Some(HEADER));
            text.lines().skip(1).map(|l| l.split(',').map(|c| c.parse().unwrap()).collect()).collect()
        };
        let (rows, closed) = (read("gain-0-set.csv"), read("gain-0-closed-loop.csv"));
        let k = object["sets"][0]["horizon"].as_u64().unwrap() as usize;
        assert_eq!(rows.len(), 4 * (k + 1));
        assert_eq!(object["sets"][0]["rows"], rows.len());
        // Row block j + 1 is row block j times the closed loop (eq. 21).
        for (row, next) in rows.iter().zip(&rows[4..]) {
            for c in 0..6 {
                let product: f64 = (0..6).map(|i| row[i] * closed[i][c]).sum();
                assert!((product - next[c]).abs() < 1e-9);
            }
        }
        let forward = object["sets"][0]["largest_impulse_over_m_omega_d"]["forward"].as_f64().unwrap();
        let largest = rows.iter().map(|r| r[1]).fold(0.0, f64::max);
        assert!((forward - 1.0 / (largest * 5.63 * 0.06)).abs() < 1e-12);
    }

    #[test]
    fn the_tables_name_every_gain_and_the_picture_is_drawn() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("sets.svg");
        let text = run_with(&["--plot", file.to_str().unwrap()]).unwrap();
        assert!(text.contains("The family nests"), "{text}");
        let svg = std::fs::read_to_string(file).unwrap();
        assert!(svg.starts_with("<svg") && svg.matches("<polygon").count() >= 10, "{svg}");
    }

    #[test]
    fn bad_input_is_one_error_of_exit_code_2_and_nothing_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sets");
        for (args, words) in [
            (vec!["hold"], "standing = posture"),
            (vec!["nosuch"], "hold, fixed, switching"),
            (vec!["--omega", "-5"], "--omega = -5"),
            (vec!["--dt", "0"], "--dt = 0"),
            (vec!["--dt", "1"], "dt"),
            (vec!["--support", "0.01,0.05,-0.05,0.05"], "origin is not strictly inside"),
            (vec!["--support", "-0.05,0.05,-0.05"], "3 numbers"),
            (vec!["--support", "-0.05,a,-0.05,0.05"], "not a number"),
        ] {
            let all = [&args[..], &["--export", path.to_str().unwrap()]].concat();
            let error = run_with(&all).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{args:?}: {error}");
            assert!(error.to_string().contains(words), "{args:?}: {error}");
            assert!(!path.exists());
        }
    }
}
