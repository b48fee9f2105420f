//! Tables on a terminal: all look alike, and are as wide as the terminal or 80 columns. Numbers, names and units are
//! never broken: a table that is too narrow for them becomes wider.

use super::{MOST_ROWS, Table, left_out};
use crate::text::layout::{terminal_width, together, wrapped, wrapped_to};
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, TableStyle};

/// Largest number of controllers side by side. With more, the controllers are the rows.
const FEW: usize = 4;

impl Table {
    /// The table, and its note below.
    pub fn text(&self) -> String {
        self.text_of_width(terminal_width())
    }

    fn text_of_width(&self, room: usize) -> String {
        if self
            .columns
            .iter()
            .filter(|column| column.controller.is_some())
            .count()
            > FEW
        {
            return self.turned().text_of_width(room);
        }
        let note = match &*(self.note.clone() + &left_out(self.rows.len(), "`summary.json`")) {
            "" => String::new(),
            note => wrapped(" ", note.trim_start()),
        };
        format!("{}\n{note}", self.drawn(room))
    }

    fn drawn(&self, room: usize) -> comfy_table::Table {
        let headings: Vec<String> = self
            .columns
            .iter()
            .map(|column| unbroken(&column.text()))
            .collect();
        let words = |i: usize| self.columns[i].is_words;
        let widths = self.widths(&headings, room);

        let mut drawn = comfy_table::Table::new();
        let rule = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));
        drawn
            .load_style(rule)
            .set_content_arrangement(ContentArrangement::Disabled);
        drawn.set_header(
            headings
                .iter()
                .zip(&widths)
                .map(|(heading, width)| in_lines(heading, *width)),
        );
        for row in self.rows.iter().take(MOST_ROWS) {
            let cells = row.iter().zip(&widths).enumerate();
            drawn.add_row(cells.map(|(i, (cell, width))| match words(i) {
                true => in_lines(&cell.text, *width),
                false => cell.text.clone(),
            }));
        }
        for i in 0..self.columns.len() {
            let Some(drawn) = drawn.column_mut(i) else {
                continue;
            };
            drawn.set_padding((1, 0));
            drawn.set_cell_alignment(if words(i) {
                CellAlignment::Left
            } else {
                CellAlignment::Right
            });
        }
        drawn
    }

    /// The width of each column without the two spaces between columns. If there is not enough room, the headings of
    /// numbers are broken first, and then words.
    fn widths(&self, headings: &[String], room: usize) -> Vec<usize> {
        let count = |text: &str| text.chars().count();
        let longest = |text: &str| {
            together(text)
                .split(' ')
                .map(count)
                .max()
                .unwrap_or_default()
        };
        let most = |width: &dyn Fn(&str) -> usize, i: usize| {
            let rows = self.rows.iter().take(MOST_ROWS);
            rows.flat_map(|row| row[i].text.lines().map(width))
                .max()
                .unwrap_or_default()
        };
        let needed = |widths: &[usize]| {
            widths
                .iter()
                .map(|width| width + 2)
                .sum::<usize>()
                .saturating_sub(1)
        };

        let wanted: Vec<usize> = (0..self.columns.len())
            .map(|i| most(&count, i).max(count(&headings[i])))
            .collect();
        let mut widths = wanted.clone();
        if needed(&widths) <= room {
            return widths;
        }
        for i in 0..self.columns.len() {
            let of_heading = longest(&headings[i]);
            widths[i] = match self.columns[i].is_words {
                // A cell may begin with spaces, with which all of its lines then begin.
                true => most(
                    &|text| count(text) - count(text.trim_start()) + longest(text.trim_start()),
                    i,
                ),
                false => most(&count, i),
            }
            .max(of_heading);
        }
        // The remaining width goes to words, first to the column that lacks most, and then to headings.
        for is_words in [true, false] {
            while needed(&widths) < room {
                let lacking = |&i: &usize| wanted[i] - widths[i].min(wanted[i]);
                let candidates = (0..self.columns.len())
                    .filter(|i| self.columns[*i].is_words == is_words && lacking(i) > 0);
                let Some(i) = candidates.max_by_key(lacking) else {
                    break;
                };
                widths[i] += 1;
            }
        }
        widths
    }
}

/// The heading with non-breaking spaces in its unit.
fn unbroken(heading: &str) -> String {
    match heading.split_once('[') {
        Some((name, unit)) => format!("{name}[{}", unit.replace(' ', "\u{a0}")),
        None => heading.into(),
    }
}

/// The text in lines of this width, all of which begin with the same number of spaces as the first.
fn in_lines(text: &str, width: usize) -> String {
    let words = text.trim_start();
    wrapped_to(width, &text[..text.len() - words.len()], words)
        .trim_end()
        .into()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{beside, rates};
    use super::super::{cell, headings, texts};
    use super::*;

    #[test]
    fn numbers_end_at_the_right_and_many_controllers_are_rows() {
        let text = rates().text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], " controller  recovered  rate [m/s]");
        assert_eq!(
            lines[2..],
            [
                " hold              1/2     -50.0 %",
                " <b>|x_            1/2     -50.0 %",
                " At 95 %, -1 to 1."
            ]
        );
        let few = beside(4).text();
        assert!(
            few.starts_with(" lost      set0  set1  set2  set3\n") && few.lines().count() == 4,
            "{few}"
        );
        let many = beside(5).text();
        assert!(
            many.starts_with(" lost  legs met  slipped\n")
                && many.contains(" set4         4        4"),
            "{many}"
        );
        let mut long = beside(1);
        long.rows = vec![long.rows[0].clone(); MOST_ROWS + 9];
        assert!(
            long.text()
                .ends_with(" 9 more rows are in `summary.json`.\n")
        );
    }

    #[test]
    fn a_table_of_any_width_breaks_no_number_no_name_and_no_unit() {
        let heads = [
            "home [rad]",
            "damping of the servo [N m s/rad]",
            "at the end",
        ];
        let mut table = Table::new(
            "",
            headings("joint", heads).chain([super::super::words("what it does")]),
        );
        for (name, angle) in [
            ("right_shoulder_pitch_joint", "-0.2550"),
            ("  torso", "1234.5 to 6789.0"),
        ] {
            let numbers = [name, angle, "-0.255", "12.5 N s"].map(String::from);
            table.row(
                texts(numbers).chain([cell("turns within 12.5 N s of what is wanted, and falls")]),
            );
        }
        let wide = table.text_of_width(300);
        let words = |text: &str| {
            let text = text.replace('─', " ");
            let mut words: Vec<String> = text.split_whitespace().map(String::from).collect();
            words.sort();
            words
        };
        for width in 1..200 {
            let text = table.text_of_width(width);
            assert_eq!(words(&text), words(&wide), "{width}:\n{text}");
            for whole in [
                "[rad]",
                "[N m s/rad]",
                "1234.5 to 6789.0",
                "within",
                "12.5 N s",
                "right_shoulder_pitch_joint",
                "  torso",
            ] {
                assert!(
                    text.contains(whole),
                    "{whole} is broken at {width}:\n{text}"
                );
            }
            let widest = text.lines().map(|line| line.chars().count()).max().unwrap();
            assert!(widest <= width.max(88), "{widest} of {width}:\n{text}");
        }
        assert_eq!(wide.lines().count(), 4, "{wide}");
    }
}
