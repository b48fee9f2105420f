//! The layout of text: wrapped lines, and numbers.

use comfy_table::Table;
use standfast_core::robot::Units;
use standfast_files::assets::DEFAULT_ROBOT;
use standfast_files::shell_word;

/// Width of text that does not go to a terminal, and largest width of sentences on a terminal (columns).
const PLAIN_WIDTH: usize = 80;

/// Width of the terminal (columns). The variable COLUMNS overrides it, even if there is no terminal.
pub fn terminal_width() -> usize {
    let set = std::env::var("COLUMNS")
        .ok()
        .and_then(|columns| columns.parse().ok())
        .filter(|columns| *columns > 0);
    set.or_else(|| Table::new().width().map(usize::from))
        .unwrap_or(PLAIN_WIDTH)
}

/// The unit of impulses of a robot, which is `sole_impulse_n_s` (N s).
pub fn sole_impulse(sole_impulse_n_s: f64) -> String {
    let decimals = (2.0 - sole_impulse_n_s.log10().floor()).clamp(0.0, 4.0) as usize;
    format!("1 sole impulse = {sole_impulse_n_s:.decimals$} N s")
}

/// The change of velocity by an impulse (N s), in m/s and in sqrt(g h).
pub fn velocity_change(units: &Units, impulse_n_s: f64) -> String {
    let [m_s, of_unit] = units.velocity_of(impulse_n_s);
    format!("dv = {m_s:.2} m/s = {of_unit:.2} sqrt(g h)")
}

/// The text in lines that fit the terminal. `mark` stands before the first line, and the others are indented by its
/// width. A number stays on one line with its unit and with a sign such as `=` before it.
pub fn wrapped(mark: &str, text: &str) -> String {
    wrapped_to(terminal_width().min(PLAIN_WIDTH), mark, text)
}

/// An entry of a story: a label in a column of its own, and the text.
pub fn entry(label: &str, what: &str) -> String {
    wrapped(&format!("{label:<12}"), what)
}

/// Wraps text as [`wrapped`] does, for a width (columns).
pub fn wrapped_to(width: usize, mark: &str, text: &str) -> String {
    // A text with lines of its own, such as the last output of a failed program, keeps these lines.
    let (text, own) = text.split_once('\n').unwrap_or((text, ""));
    let together = together(text);
    let mut lines = vec![mark.to_string()];
    for piece in together.split(' ') {
        let line = lines.last_mut().expect("one at least");
        let is_new = line.len() == mark.len();
        if !is_new && line.chars().count() + 1 + piece.chars().count() > width {
            lines.push(" ".repeat(mark.len()) + piece);
        } else {
            *line += if is_new { "" } else { " " };
            *line += piece;
        }
    }
    lines.extend(own.lines().map(|line| " ".repeat(mark.len()) + line));
    lines.join("\n").replace('\u{a0}', " ") + "\n"
}

/// The text with non-breaking spaces between a number and its unit, and around signs such as `=`.
pub fn together(text: &str) -> String {
    let is_one_of =
        |word: &str, all: &[&str]| all.contains(&word.trim_end_matches(['.', ',', ';', ':', ')']));
    let stays = |before: &str, word: &str| {
        is_one_of(
            word,
            &[
                "=", "<", ">=", "%", "s", "ms", "mm", "m", "m/s", "m/s^2", "N", "kg", "rad",
                "rad/s", "deg", "degrees", "points", "cm\u{b2}",
            ],
        ) || is_one_of(before, &["=", "<", ">=", "N"])
            || (before.starts_with('(') && before.ends_with(',') && !before.contains(')'))
    };
    let (mut out, mut before) = (String::new(), "");
    for (i, word) in text.split(' ').enumerate() {
        if i > 0 {
            out.push(if stays(before, word) { '\u{a0}' } else { ' ' });
        }
        out += word;
        before = word;
    }
    out
}

/// The options of a command for this robot and this engine (name and version), each with a space before it. An option
/// is left out if its value is the default of the command.
pub fn plant_options(robot: &str, engine: &str) -> String {
    let robot = if robot == DEFAULT_ROBOT {
        String::new()
    } else {
        format!(" --robot {}", shell_word(robot))
    };
    let engine = if engine.starts_with("MuJoCo") {
        " --engine mujoco"
    } else {
        ""
    };
    robot + engine
}

/// A time (s), or a dash if there is none.
pub fn seconds(time_s: Option<f64>) -> String {
    time_s.map_or("-".into(), |s| format!("{s:.2} s"))
}

/// A number with its sign. A number that is rounded to zero has no sign.
pub fn signed(x: f64, digits: usize) -> String {
    let text = format!("{x:+.digits$}");
    if text[1..].chars().all(|c| matches!(c, '0' | '.')) {
        text[1..].into()
    } else {
        text
    }
}

/// A share in percent, with one decimal.
pub fn percent(rate: f64) -> String {
    format!("{:.1} %", 100.0 * rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_stays_with_its_unit() {
        let words = "x".repeat(66);
        assert_eq!(
            wrapped("- ", &format!("{words} (p = 0.0625, y")),
            format!("- {words}\n  (p = 0.0625, y\n")
        );
        let short = &words[..60];
        let apart = wrapped("- ", &format!("{short} 67 % (25-94), paper 67 %"));
        assert_eq!(apart, format!("- {short} 67 % (25-94),\n  paper 67 %\n"));
        assert_eq!(
            wrapped("- ", &format!("{words}x at 12.5 N s. z")),
            format!("- {words}x at\n  12.5 N s. z\n")
        );
        let told = together("home after 2.77 s. 3.74 to 4.38 N s (1 to 2, p = 0.06) of 5 sets");
        assert_eq!(
            told.replace('\u{a0}', "~"),
            "home after 2.77~s. 3.74 to 4.38~N~s (1 to 2, p~=~0.06) of 5 sets"
        );
    }

    #[test]
    fn what_has_lines_of_its_own_keeps_them() {
        let said = format!(
            "it has ended; on stderr: Traceback\n  File \"a.py\", line 1\n    {}\nError: 3 < 4",
            "x ".repeat(40)
        );
        let told = entry("outcome", &said);
        let lines: Vec<&str> = told.lines().collect();
        assert_eq!(
            lines[..2],
            [
                "outcome     it has ended; on stderr: Traceback",
                "              File \"a.py\", line 1"
            ]
        );
        assert!(
            lines.len() == 4 && lines[3] == "            Error: 3 < 4",
            "{told}"
        );
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(
            [12.34, -3.0, -0.04, 0.0].map(|x| signed(x, 1)),
            ["+12.3", "-3.0", "0.0", "0.0"]
        );
    }
}
