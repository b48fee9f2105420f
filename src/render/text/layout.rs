//! The layout of text: tables that all look alike, wrapped lines, and numbers.

use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, LineStyle, Table, TableStyle, Width};

/// Width of text that does not go to a terminal, and largest width of sentences on a terminal (columns).
const PLAIN_WIDTH: u16 = 80;

/// The unit of impulses in which robots compare, for a robot of which it is `unit_n_s` (N s).
pub fn unit_of_impulses(unit_n_s: f64) -> String {
    let decimals = (2.0 - unit_n_s.log10().floor()).clamp(0.0, 4.0) as usize;
    format!("1 m omega d = {unit_n_s:.decimals$} N s")
}

/// A table with a column for each name or, if there are `many`, a row for each. `rows` hold a label and a cell for each
/// name. `corner` is the heading of the first column.
pub fn compared<'a>(
    corner: &'a str,
    names: impl Iterator<Item = &'a str>,
    rows: Vec<(String, Vec<String>)>,
    many: bool,
) -> Table {
    if many {
        let mut table = table(std::iter::once(corner).chain(rows.iter().map(|(label, _)| label.as_str())));
        for (i, name) in names.enumerate() {
            table.add_row(std::iter::once(name).chain(rows.iter().map(|(_, cells)| cells[i].as_str())));
        }
        return whole_names(align(table));
    }
    let mut table = table(std::iter::once(corner).chain(names));
    for (label, cells) in rows {
        table.add_row(std::iter::once(label).chain(cells));
    }
    align(table)
}

/// The text in lines that fit the terminal. `mark` stands before the first line, and the others are indented by its
/// width. A number stays on one line with its unit and with a sign such as `=` before it.
pub fn wrapped(mark: &str, text: &str) -> String {
    let width = usize::from(Table::new().width().unwrap_or(PLAIN_WIDTH).min(PLAIN_WIDTH));
    let is_one_of = |word: &str, all: &[&str]| all.contains(&word.trim_end_matches(['.', ',', ';', ':', ')']));
    let stays = |before: &str, word: &str| {
        is_one_of(word, &["=", "<", ">=", "%", "s", "mm", "m", "m/s", "N", "deg", "degrees", "points"])
            || is_one_of(before, &["=", "<", ">=", "N"])
            || (before.starts_with('(') && before.ends_with(',') && !before.contains(')'))
    };
    let mut pieces: Vec<String> = Vec::new();
    let mut before = "";
    for word in text.split(' ') {
        match pieces.last_mut() {
            Some(piece) if stays(before, word) => *piece += &format!(" {word}"),
            _ => pieces.push(word.into()),
        }
        before = word;
    }
    let mut lines = vec![mark.to_string()];
    for piece in pieces {
        let line = lines.last_mut().expect("one at least");
        let is_new = line.len() == mark.len();
        if !is_new && line.chars().count() + 1 + piece.chars().count() > width {
            lines.push(" ".repeat(mark.len()) + &piece);
        } else {
            *line += if is_new { "" } else { " " };
            *line += &piece;
        }
    }
    lines.join("\n") + "\n"
}

/// A time (s), or a dash if there is none.
pub fn seconds(time_s: Option<f64>) -> String {
    time_s.map_or("-".into(), |s| format!("{s:.2} s"))
}

/// A table with a header, as wide as the terminal or 80 columns.
pub fn table<T: Into<comfy_table::Cell>>(header: impl IntoIterator<Item = T>) -> Table {
    let mut table = Table::new();
    let rule = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));
    table.load_style(rule).set_content_arrangement(ContentArrangement::Dynamic);
    if !table.is_tty() {
        table.set_width(PLAIN_WIDTH);
    }
    table.set_header(header.into_iter().map(Into::into).collect::<Vec<comfy_table::Cell>>());
    table
}

/// Aligns the first column, which holds names, to the left and all others to the right.
pub fn align(mut table: Table) -> Table {
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((1, 0));
        column.set_cell_alignment(if i == 0 { CellAlignment::Left } else { CellAlignment::Right });
    }
    table
}

/// Makes the first column wide enough for its longest word, so that the headers of the other columns wrap first.
pub fn whole_names(mut table: Table) -> Table {
    let cells = table.row_iter().filter_map(|row| row.cell_iter().next());
    let longest = cells.flat_map(|cell| cell.content().split(' ').map(|word| word.chars().count()).max()).max();
    if let (Some(longest), Some(column)) = (longest, table.column_mut(0)) {
        let width = Width::Fixed((longest as u16).saturating_add(1).min(PLAIN_WIDTH / 3));
        column.set_constraint(ColumnConstraint::LowerBoundary(width));
    }
    table
}

/// A number with its sign. A number that is rounded to zero has none.
pub fn signed(x: f64, digits: usize) -> String {
    let text = format!("{x:+.digits$}");
    if text[1..].chars().all(|c| matches!(c, '0' | '.')) { text[1..].into() } else { text }
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
        assert_eq!(wrapped("- ", &format!("{words} (p = 0.0625, y")), format!("- {words}\n  (p = 0.0625, y\n"));
        let short = &words[..60];
        let apart = wrapped("- ", &format!("{short} 67 % (25-94), paper 67 %"));
        assert_eq!(apart, format!("- {short} 67 % (25-94),\n  paper 67 %\n"));
        assert_eq!(wrapped("- ", &format!("{words}x at 12.5 N s. z")), format!("- {words}x at\n  12.5 N s. z\n"));
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!([12.34, -3.0, -0.04, 0.0].map(|x| signed(x, 1)), ["+12.3", "-3.0", "0.0", "0.0"]);
    }
}
