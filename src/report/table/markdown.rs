//! Tables in Markdown, as GitHub shows it.

use super::{MOST_ROWS, Table};
use crate::foreign::harmless;

impl Table {
    /// The table, and its note below.
    pub fn markdown(&self) -> String {
        let row = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut text = row(self
            .columns
            .iter()
            .map(|column| escaped(&column.text()))
            .collect());
        let rule = self
            .columns
            .iter()
            .map(|column| if column.is_words { "---" } else { "--:" });
        text += &format!("|{}|\n", rule.collect::<Vec<_>>().join("|"));
        for cells in self.rows.iter().take(MOST_ROWS) {
            text += &row(cells.iter().map(|cell| escaped(&cell.text)).collect());
        }
        let note = escaped(&self.note) + &left_out(self.rows.len(), "`summary.json`");
        text + &if note.is_empty() {
            note
        } else {
            format!("\n{}\n", note.trim_start())
        }
    }
}

/// A sentence, after a space, on the number of entries that are left out of a list. It is empty if all are written.
pub fn left_out(count: usize, place: &str) -> String {
    match count.saturating_sub(MOST_ROWS) {
        0 => String::new(),
        more => format!(" {more} more rows are in {place}."),
    }
}

/// The text, [harmless], with all characters escaped that mean something in Markdown or HTML.
pub fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in harmless(text).chars() {
        match c {
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '&' => out += "&amp;",
            '\\' | '`' | '*' | '_' | '[' | ']' | '|' | '#' | '~' => out.extend(['\\', c]),
            '\n' | '\r' => out.push(' '),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::tests::rates;

    #[test]
    fn names_are_text_and_numbers_end_at_the_right() {
        let expected = "| controller | recovered | rate \\[m/s\\] |\n|---|--:|--:|\n| hold | 1/2 | -50.0 % |\n\
                        | &lt;b&gt;\\|x\\_ | 1/2 | -50.0 % |\n\nAt 95 %, -1 to 1.\n";
        assert_eq!(rates().markdown(), expected);
    }
}
